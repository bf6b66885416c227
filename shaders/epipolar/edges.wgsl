// In height fog nothing is factorised: every view ray visits the runs before its end, and where lit and dark meet it takes a
// closed form (epipolar's baran/fog). One workgroup a task; exact along the slice.

// A run: bits of gamma where it starts, columns that see it lit. Before a row's runs stands their number.
@group(0) @binding(12) var<storage, read> runs: array<vec2<u32>>;

// The share of a view ray's light that it sees lit: up to `end`, where it meets the light ray `gamma`.
fn lit_share(fog: FogAlong, first: u32, count: u32, rank: u32, sine: f32, gamma: u32, end: f32) -> vec3<f32> {
    var light = vec3<f32>(0.0);
    // Where the lit stretch begins; negative in the dark.
    var begin = -1.0;
    for (var run = 0u; run <= count; run++) {
        let next = runs[first + run];
        let is_over = run == count || next.x > gamma;
        let is_lit = !is_over && next.y > rank;
        if is_lit != (begin >= 0.0) {
            let at = select(min(bitcast<f32>(next.x) / sine, end), end, is_over);
            if is_lit {
                begin = at;
            } else {
                if begin == 0.0 && is_over {
                    return vec3<f32>(1.0);
                }
                light += sun_interval(fog, begin, at);
                begin = -1.0;
            }
        }
        if is_over {
            break;
        }
    }
    let whole = sun_interval(fog, 0.0, end);
    // A ray without light has no shadow.
    return select(vec3<f32>(1.0), clamp(light / max(whole, vec3<f32>(1e-37)), vec3<f32>(0.0), vec3<f32>(1.0)), whole > vec3<f32>(0.0));
}

@compute @workgroup_size(256)
fn edges(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let number = group.x + group.y * GROUPS_A_ROW;
    if number >= epipolar.batch.w {
        return;
    }
    let task = tasks[epipolar.batch.z + number];
    let slice = slices[task.slice];
    let before = slices[select(task.slice - 1u, task.slice, has(slice.flags, FIRST_OF_FAN))];
    let behind = slices[select(task.slice + 1u, task.slice, has(slice.flags, LAST_OF_FAN))];
    let count = runs[slice.first_run].x;
    for (var column = thread; column < task.column_count; column += 256u) {
        let rank = task.first_rank + column;
        let k = column_of_rank(slice, rank);
        let sine = sine_of(slice, k);
        let range = ranges[slice.first_range + u32(k)];
        let first = first_pixel(before, k, range);
        let own = first_pixel(slice, k, range);
        let last = first_pixel(behind, k, range);
        for (var minor = first; minor < last; minor++) {
            let pixel = pixel_at(slice, k, minor);
            let gamma = light_ray(pixel, sine);
            let end = min(ray_end(pixel), epipolar.reach.x);
            let share = lit_share(fog_along(pixel_ray(pixel)), slice.first_run + 1u, count, rank, sine, gamma, end);
            var part = 0u;
            if minor < own {
                part = part_of(minor, border_at(before, k), border_at(slice, k));
            } else {
                part = 65536u - part_of(minor, border_at(slice, k), border_at(behind, k));
            }
            for (var channel = 0u; channel < min(epipolar.counts.x, 3u); channel++) {
                add_answer(pixel, channel, share[channel], part);
            }
        }
    }
}
