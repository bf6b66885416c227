// The light's maps: where a pixel's ray runs in a layer, and what a texel of it says.

@group(0) @binding(4) var shadow_maps: texture_2d_array<f32>;

// A ray in a layer's space: (u, v, depth) = start + s * step; u and v to be divided by depth in a perspective layer.
struct MapRay {
    start: vec3<f32>,
    step: vec3<f32>,
}

fn map_ray(layer: u32, pixel: vec2<u32>) -> MapRay {
    let p = from_reference(pixel);
    var ray: MapRay;
    ray.start = (frame.maps[layer].start[0] + p.x * frame.maps[layer].start[1] + p.y * frame.maps[layer].start[2]).xyz;
    ray.step = (frame.maps[layer].step[0] + p.x * frame.maps[layer].step[1] + p.y * frame.maps[layer].step[2]).xyz;
    return ray;
}

fn is_perspective(layer: u32) -> bool {
    return has(frame.maps[layer].place.w, LAYER_PERSPECTIVE);
}

// Linear depth stored at a texel of a layer; coordinates beyond its borders are the border's texel.
fn stored_depth(layer: u32, texel: vec2<i32>) -> f32 {
    let map = frame.maps[layer];
    let inside = clamp(texel, vec2<i32>(0), vec2<i32>(map.size.xy) - vec2<i32>(1));
    let at = vec2<i32>(map.place.xy) + inside;
    let z = textureLoad(shadow_maps, at, i32(map.place.z), 0).x;
    return linear_of_texel(map, z, vec2<f32>(inside) + 0.5);
}

// Whether (u, v), already divided by depth, lies in a layer (half-open), with a slack in texels.
fn in_layer(layer: u32, uv: vec2<f32>, slack: f32) -> bool {
    let size = frame.maps[layer].size.xy;
    return all(uv >= vec2<f32>(-slack)) && all(uv < size + vec2<f32>(slack));
}
