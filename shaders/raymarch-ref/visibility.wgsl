// Which samples of a march are lit. A sample is homogeneous: start + at * step in a map's space, all of it times w, where w is 1
// under a sun and the cosine of the angle at a lamp.

// A ray's marched part in one layer.
struct MarchRay {
    start: vec3<f32>,
    step: vec3<f32>,
}

// start + at * step of the ray of a pixel, scaled: `s` is where the march starts, `unit` a unit of its parameter.
fn march_ray(layer: u32, pixel: vec2<u32>, s: f32, unit: f32) -> MarchRay {
    let ray = map_ray(layer, pixel);
    return MarchRay(ray.start + ray.step * s, ray.step * unit);
}

// 1 where the first layer that contains the sample says so, and outside of all layers. `first` is the ray in layer 0.
fn is_lit(first: MarchRay, pixel: vec2<u32>, s: f32, unit: f32, at: f32, w: f32) -> bool {
    for (var layer = 0u; layer < min(frame.kinds.x, 16u); layer++) {
        var ray = first;
        if layer > 0u {
            ray = march_ray(layer, pixel, s, unit);
        }
        let p = ray.start * w + ray.step * at;
        let perspective = is_perspective(layer);
        let scale = select(w, p.z, perspective);
        let size = frame.maps[layer].size.xy * scale;
        // What f32 rounds between two faces that abut must not be lit by belonging to neither.
        let slack = select(0.0, 1e-6, frame.kinds.y == MAPS_FACES) * size;
        let inside = scale > 0.0 && all(p.xy >= -slack) && all(p.xy < size + slack);
        if inside {
            let texel = vec2<i32>(floor(p.xy / scale));
            return p.z <= stored_depth(layer, texel) * w;
        }
    }
    return true;
}
