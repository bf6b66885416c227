// What is written of a pixel: finite by construction, and within the format's range. The transmittance carries the distance
// of its ray's end, by which half images are made whole.
fn write_pixel(pixel: vec2<u32>, radiance: vec3<f32>, transmittance: vec3<f32>, end: f32) {
    let light = clamp(radiance, vec3<f32>(0.0), vec3<f32>(LARGEST));
    let through = clamp(transmittance, vec3<f32>(0.0), vec3<f32>(1.0));
    let mean = (through.x + through.y + through.z) / 3.0;
    textureStore(inscattered_out, vec2<i32>(pixel), vec4<f32>(light, mean));
    textureStore(transmittance_out, vec2<i32>(pixel), vec4<f32>(through, min(end, LARGEST)));
}
