// The first pass of every technique: depth texels of the viewport -> distances along the pixels' rays. Of several samples
// the nearest counts.
@group(0) @binding(2) var distance_out: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn distance(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= frame.image.xy) {
        return;
    }
    let ray = pixel_ray(pixel);
    let at = vec2<i32>(pixel + frame.image.zw);
    var nearest = FARTHEST;
    for (var sample = 0; sample < min(depth_samples(), 16); sample++) {
        nearest = min(nearest, distance_of_texel(pixel, depth_sample(at, sample), ray.stretch));
    }
    textureStore(distance_out, vec2<i32>(pixel), vec4<f32>(nearest, 0.0, 0.0, 0.0));
}
