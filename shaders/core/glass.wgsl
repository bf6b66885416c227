// The colour texture in front of the light: linear RGB by nearest texel, white outside.
@group(0) @binding(5) var glass_texture: texture_2d<f32>;

// At a homogeneous point of the texture's space: (u, v) * w and w.
fn glass_at(point: vec3<f32>, w: f32) -> vec3<f32> {
    let size = frame.glass.size.xy;
    let inside = w > 0.0 && all(point.xy >= vec2<f32>(0.0)) && all(point.xy < size * w);
    if !inside {
        return vec3<f32>(1.0);
    }
    let texel = clamp(vec2<i32>(point.xy / w), vec2<i32>(0), vec2<i32>(size) - vec2<i32>(1));
    let rgb = textureLoad(glass_texture, texel, 0).xyz;
    return vec3<f32>(finite_texel(rgb.x), finite_texel(rgb.y), finite_texel(rgb.z));
}
