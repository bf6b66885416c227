// The dual sweep, one workgroup a task: runs from the eye on, added where they end; asks when the sweep passes their run
// (Baran et al. 2010, section 4, turned round). Integers, so that any order of threads gives the same bits.

var<workgroup> ending: array<atomic<i32>, 2564>;
var<workgroup> blocks: array<atomic<i32>, 164>;
var<workgroup> chunk_lit: array<u32, 128>;
var<workgroup> chunk_prefix: array<vec4<i32>, 129>;

// Columns a block of sums, blocks, and elements a term: terms stand apart, so that neighbouring columns are in other banks.
const BLOCK: u32 = 16u;
const BLOCKS: u32 = 41u;
const ENDINGS: u32 = 641u;

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

@compute @workgroup_size(256)
fn sums(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let task = tasks[group.x];
    for (var at = thread; at < 4u * ENDINGS; at += 256u) {
        atomicStore(&ending[at], 0);
    }
    if thread < 4u * BLOCKS {
        atomicStore(&blocks[thread], 0);
    }
    let chunk_count = (task.run_count + CHUNK - 1u) / CHUNK;
    for (var chunk = 0u; chunk < chunk_count; chunk++) {
        let run = chunk * CHUNK + thread;
        if thread < CHUNK {
            chunk_lit[thread] = select(0u, lit_of(task, min(run, task.run_count - 1u)), run < task.run_count);
        }
        if thread <= CHUNK {
            chunk_prefix[thread] = run_prefixes[task.first_prefix + min(run, task.run_count)];
        }
        workgroupBarrier();
        let last = chunk_starts[task.first_chunk + chunk + 1u];
        for (var at = chunk_starts[task.first_chunk + chunk] + thread; at < last; at += 256u) {
            let ask = asks[at];
            let inside = min(ask.run - chunk * CHUNK, CHUNK - 1u);
            var sum = ending_behind(ask.rank);
            for (var j = 0u; j < inside; j++) {
                sum += select(vec4<i32>(0), chunk_prefix[j + 1u] - chunk_prefix[j], chunk_lit[j] > ask.rank);
            }
            sum += select(vec4<i32>(0), ask.end - chunk_prefix[inside], chunk_lit[inside] > ask.rank);
            answers[ask.answer] = sum;
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
