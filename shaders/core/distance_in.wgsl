// Distances along the pixels' rays, of the pass `distance`, 0 to FARTHEST.
@group(0) @binding(3) var distances: texture_2d<f32>;

// Where the ray of a pixel ends: its surface, or max_distance if that is nearer.
fn ray_end(pixel: vec2<u32>) -> f32 {
    return min(textureLoad(distances, vec2<i32>(pixel), 0).x, frame.reference.z);
}

// Size of the image: that of the camera, in blocks of 1, 2 or 4 pixels a side.
fn image_size() -> vec2<u32> {
    let block = u32(frame.depth_more.y);
    return (frame.image.xy + vec2<u32>(block - 1u)) / vec2<u32>(block);
}

// The pixel of the camera that a pixel of the image stands for: of a block the nearest or the farthest, in turns.
fn camera_pixel(pixel: vec2<u32>) -> vec2<u32> {
    let block = u32(frame.depth_more.y);
    if block == 1u {
        return pixel;
    }
    let nearest = ((pixel.x + pixel.y) & 1u) == 0u;
    let first = pixel * block;
    // Where all are alike, the one in the middle.
    var chosen = min(first + vec2<u32>(block / 2u), frame.image.xy - vec2<u32>(1u));
    var best = ray_end(chosen);
    for (var i = 0u; i < min(block * block, 16u); i++) {
        let other = min(first + vec2<u32>(i % block, i / block), frame.image.xy - vec2<u32>(1u));
        let end = ray_end(other);
        if (nearest && end < best) || (!nearest && end > best) {
            best = end;
            chosen = other;
        }
    }
    return chosen;
}

// Direction through the middle of a pixel of the image. What light does there by its direction alone is taken in that
// direction, whichever pixel of the block its ray is, so that whoever mixes pixels knows it.
fn image_direction(pixel: vec2<u32>) -> vec3<f32> {
    let way = way_at((vec2<f32>(pixel) + 0.5) * frame.depth_more.y - 0.5 - frame.reference.xy);
    return way / length(way);
}
