// An answer as the integers that it is made of: eight vectors a channel and pixel, four of each side.

@group(0) @binding(16) var<storage, read_write> answers: array<vec4<i32>>;

fn answer(told: Answer) {
    let pixel = told.pixel.y * frame.image.x + told.pixel.x;
    let at = 8u * (told.channel * epipolar.counts.w + pixel) + select(4u, 0u, told.is_before);
    answers[at] = told.sum;
    answers[at + 1u] = told.end;
    answers[at + 2u] = vec4<i32>(vec4<u32>(told.slice, told.band, told.rank, told.gamma));
    answers[at + 3u] = vec4<i32>(i32(told.part), bitcast<i32>(told.sine), 1, 0);
}
