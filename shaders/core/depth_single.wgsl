// An engine's depth texture with one sample a pixel.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;

fn depth_samples() -> i32 {
    return 1;
}

fn depth_sample(pixel: vec2<i32>, sample: i32) -> f32 {
    return textureLoad(depth_texture, pixel, 0).x;
}
