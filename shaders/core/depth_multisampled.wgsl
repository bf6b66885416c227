// An engine's depth texture with several samples a pixel.
@group(0) @binding(1) var depth_texture: texture_multisampled_2d<f32>;

fn depth_samples() -> i32 {
    return i32(textureNumSamples(depth_texture));
}

fn depth_sample(pixel: vec2<i32>, sample: i32) -> f32 {
    return textureLoad(depth_texture, pixel, sample).x;
}
