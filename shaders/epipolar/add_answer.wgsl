// What slices tell pixels: per channel and pixel the share of its unoccluded light, in units of 2^-30, times the slice's weight. Both
// slices' add up.

@group(0) @binding(16) var<storage, read_write> answers: array<atomic<u32>>;

// `part`: the slice's weight in units of 2^-16.
fn add_answer(pixel: vec2<u32>, channel: u32, share: f32, part: u32) {
    let at = channel * epipolar.counts.w + pixel.y * frame.image.x + pixel.x;
    atomicAdd(&answers[at], u32(share * f32(part << 14u) + 0.5));
}
