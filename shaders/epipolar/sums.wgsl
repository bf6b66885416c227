// In-slice sums (Baran et al. 2010, section 4, turned round): for each view ray that asks, the lit runs before its end. The
// dual sweep, one workgroup a task: runs from the eye on, added where they end; view rays when the sweep passes their ends.
// Integers, so that any order of threads gives the same bits.
//
//     for each chunk of 128 runs, up to the last that a ray ends in:
//         rays that end in it:   what was added and ends behind them + the chunk's own runs before them
//         add the chunk's runs

// A run: bits of gamma where it starts, columns that see it lit. Before a row's runs stands their number.
@group(0) @binding(12) var<storage, read> runs: array<vec2<u32>>;

const CHUNK: u32 = 128u;
const COLUMNS: u32 = 512u;
// Columns a block of sums, blocks, and elements a term: terms stand apart, so that neighbouring columns are in other banks.
const BLOCK: u32 = 16u;
const BLOCKS: u32 = 33u;
const ENDINGS: u32 = 513u;

var<workgroup> ending: array<atomic<i32>, 2052>;
var<workgroup> blocks: array<atomic<i32>, 132>;
var<workgroup> sines: array<f32, 512>;
var<workgroup> chunk_lit: array<u32, 128>;
var<workgroup> chunk_start: array<u32, 129>;
var<workgroup> chunk_prefix: array<vec4<i32>, 129>;
var<workgroup> farthest: atomic<u32>;
var<workgroup> last_light_ray: u32;

// Of all runs that were added: those that more than `rank` columns see.
fn ending_behind(rank: u32) -> vec4<i32> {
    var sum = vec4<i32>(0);
    let first = rank + 1u;
    let last = min((first / BLOCK + 1u) * BLOCK, ENDINGS);
    for (var c = first; c < last; c++) {
        sum += vec4<i32>(atomicLoad(&ending[c]), atomicLoad(&ending[ENDINGS + c]), atomicLoad(&ending[2u * ENDINGS + c]), atomicLoad(&ending[3u * ENDINGS + c]));
    }
    for (var b = first / BLOCK + 1u; b < BLOCKS; b++) {
        sum += vec4<i32>(atomicLoad(&blocks[b]), atomicLoad(&blocks[BLOCKS + b]), atomicLoad(&blocks[2u * BLOCKS + b]), atomicLoad(&blocks[3u * BLOCKS + b]));
    }
    return sum;
}

// The chunk's run that a light ray is in.
fn run_in_chunk(gamma: u32) -> u32 {
    var run = 0u;
    for (var step = CHUNK / 2u; step > 0u; step /= 2u) {
        if chunk_start[run + step] <= gamma {
            run += step;
        }
    }
    return run;
}

// The row's run that a light ray is in: the last one that starts before it.
fn run_of(first: u32, count: u32, gamma: u32) -> u32 {
    var low = 0u;
    var high = max(count, 1u);
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if runs[first + middle].x <= gamma {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

@compute @workgroup_size(256)
fn sums(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let number = group.x + group.y * GROUPS_A_ROW;
    if number >= epipolar.batch.w {
        return;
    }
    let task = tasks[epipolar.batch.z + number];
    let channel = group.z;
    let band = epipolar.bands[channel * MOST_BANDS + task.band];
    let slice = slices[task.slice];
    let before = slices[select(task.slice - 1u, task.slice, has(slice.flags, FIRST_OF_FAN))];
    let behind = slices[select(task.slice + 1u, task.slice, has(slice.flags, LAST_OF_FAN))];

    for (var at = thread; at < 4u * ENDINGS; at += 256u) {
        atomicStore(&ending[at], 0);
    }
    if thread < 4u * BLOCKS {
        atomicStore(&blocks[thread], 0);
    }
    if thread == 0u {
        atomicStore(&farthest, 0u);
    }
    workgroupBarrier();
    for (var column = thread; column < task.column_count; column += 256u) {
        let k = column_of_rank(slice, task.first_rank + column);
        let sine = sine_of(slice, k);
        sines[column] = sine;
        let range = ranges[slice.first_range + u32(k)];
        let first = first_pixel(before, k, range);
        let last = first_pixel(behind, k, range);
        for (var minor = first; minor < last; minor++) {
            // One more, so that 0 is nobody.
            atomicMax(&farthest, light_ray(pixel_at(slice, k, minor), sine) + 1u);
        }
    }
    workgroupBarrier();
    if thread == 0u {
        last_light_ray = atomicLoad(&farthest);
    }
    let last_asked = workgroupUniformLoad(&last_light_ray);
    if last_asked == 0u {
        return;
    }
    let first_run = slice.first_run + 1u;
    let run_count = runs[slice.first_run].x;
    let chunk_count = run_of(first_run, run_count, last_asked - 1u) / CHUNK + 1u;
    for (var chunk = 0u; chunk < chunk_count; chunk++) {
        if thread <= CHUNK {
            let run = runs[first_run + min(chunk * CHUNK + thread, run_count)];
            chunk_start[thread] = run.x;
            chunk_prefix[thread] = prefix_at(channel, band.x, run.x);
            if thread < CHUNK {
                chunk_lit[thread] = min(max(run.y, task.first_rank) - task.first_rank, task.column_count);
            }
        }
        workgroupBarrier();
        for (var rank = thread; rank < task.column_count; rank += 256u) {
            let k = column_of_rank(slice, task.first_rank + rank);
            let range = ranges[slice.first_range + u32(k)];
            let first = first_pixel(before, k, range);
            let own = first_pixel(slice, k, range);
            let last = first_pixel(behind, k, range);
            for (var minor = first; minor < last; minor++) {
                let pixel = pixel_at(slice, k, minor);
                let gamma = light_ray(pixel, sines[rank]);
                if gamma < chunk_start[0] || gamma >= chunk_start[CHUNK] {
                    continue;
                }
                let inside = run_in_chunk(gamma);
                let end = prefix_at(channel, band.x, gamma);
                var sum = ending_behind(rank);
                for (var j = 0u; j < inside; j++) {
                    sum += select(vec4<i32>(0), chunk_prefix[j + 1u] - chunk_prefix[j], chunk_lit[j] > rank);
                }
                sum += select(vec4<i32>(0), end - chunk_prefix[inside], chunk_lit[inside] > rank);
                var part = 0u;
                if minor < own {
                    part = part_of(minor, border_at(before, k), border_at(slice, k));
                } else {
                    part = 65536u - part_of(minor, border_at(slice, k), border_at(behind, k));
                }
                answer(Answer(pixel, channel, task.slice, task.band, task.first_rank + rank, gamma, part, sum, end, sines[rank], minor < own));
            }
        }
        workgroupBarrier();
        if thread < CHUNK {
            let lit = chunk_lit[thread];
            if lit > 0u {
                let weight = chunk_prefix[thread + 1u] - chunk_prefix[thread];
                for (var term = 0u; term < 4u; term++) {
                    atomicAdd(&ending[term * ENDINGS + lit], weight[term]);
                    atomicAdd(&blocks[term * BLOCKS + lit / BLOCK], weight[term]);
                }
            }
        }
        workgroupBarrier();
    }
}

// What a view ray is told.
struct Answer {
    pixel: vec2<u32>,
    channel: u32,
    slice: u32,
    band: u32,
    rank: u32,
    // The light ray in which it ends, by its bits.
    gamma: u32,
    // The slice's weight at the pixel, in units of 2^-16.
    part: u32,
    // Its lit runs, and all.
    sum: vec4<i32>,
    end: vec4<i32>,
    sine: f32,
    // Whether the pixel lies in the gap before the slice.
    is_before: bool,
}
