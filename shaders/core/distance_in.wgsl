// Distances along the pixels' rays, of the pass `distance`, 0 to FARTHEST.
@group(0) @binding(3) var distances: texture_2d<f32>;

// Where the ray of a pixel ends: its surface, or max_distance if that is nearer.
fn ray_end(pixel: vec2<u32>) -> f32 {
    return min(textureLoad(distances, vec2<i32>(pixel), 0).x, frame.reference.z);
}
