// What pixels ask of a slice: each lies in one gap between two slices of its fan, and asks both, with its own depth.

@group(0) @binding(10) var<storage, read> slices: array<SliceData>;
@group(0) @binding(13) var<storage, read> tasks: array<SliceTask>;
// Per fan and column k: the fan's first pixel and the one behind its last.
@group(0) @binding(14) var<storage, read> ranges: array<vec2<i32>>;

fn border_at(slice: SliceData, k: i32) -> i32 {
    return slice.border.x + slice.border.y * k;
}

// The first pixel of a column behind a slice's line. The outermost lines are shared with other fans, and every pixel is on
// one side of them.
fn first_pixel(slice: SliceData, k: i32, range: vec2<i32>) -> i32 {
    if has(slice.flags, FIRST_OF_FAN) {
        return range.x;
    }
    if has(slice.flags, LAST_OF_FAN) {
        return range.y;
    }
    let bits = epipolar.counts.y;
    let ceiling = (border_at(slice, k) + ((1 << bits) - 1)) >> bits;
    return clamp(ceiling, range.x, range.y);
}

// The weight of the slice behind a gap at a pixel, in units of 2^-16.
fn part_of(pixel: i32, before: i32, behind: i32) -> u32 {
    let gap = behind - before;
    let part = f32((pixel << epipolar.counts.y) - before) / f32(max(gap, 1));
    return select(32768u, u32(clamp(part, 0.0, 1.0) * 65536.0 + 0.5), gap > 0);
}

// Sine of the angle between a column's view ray and the light.
fn sine_of(slice: SliceData, k: i32) -> f32 {
    let ray = slice.view_ray.xy + f32(k) * slice.view_ray.zw;
    return clamp(ray.x / max(length(ray), 1e-30), 1e-6, 1.0);
}

// Column by its rank, and back.
fn column_of_rank(slice: SliceData, rank: u32) -> i32 {
    return i32(select(rank, slice.column_count - 1u - rank, epipolar.counts.z == 1u));
}

fn pixel_at(slice: SliceData, k: i32, minor: i32) -> vec2<u32> {
    let column = slice.column.x + slice.column.y * k;
    return vec2<u32>(select(vec2<i32>(column, minor), vec2<i32>(minor, column), has(slice.flags, STEEP)));
}

// The light ray in which a pixel's view ray ends, as bits: in the order of the numbers, and nobody multiplies across them.
fn light_ray(pixel: vec2<u32>, sine: f32) -> u32 {
    return min(bitcast<u32>(min(ray_end(pixel), epipolar.reach.x) * sine), 0x7e000000u);
}
