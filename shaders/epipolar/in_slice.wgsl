// What in-slice sums read and write: the mirror of `in_slice` (scatter-kernels; a test compares the layouts).

// One workgroup's share of a slice: some columns of it, all runs of its row up to the last ask's.
struct Task {
    first_run: u32,
    run_count: u32,
    // Of `run_prefixes`: one more than there are runs.
    first_prefix: u32,
    // Of `chunk_starts`: one more than there are chunks of 128 runs.
    first_chunk: u32,
    first_column: u32,
    column_count: u32,
    first_ask: u32,
    ask_count: u32,
}

// A pixel's ray: column of the slice, counted from the task's first; the run in which it ends; the prefix up to its end.
struct Ask {
    rank: u32,
    run: u32,
    answer: u32,
    padding: u32,
    end: vec4<i32>,
}

@group(0) @binding(10) var<storage, read> tasks: array<Task>;
// Columns that see a run lit, counted from the light.
@group(0) @binding(11) var<storage, read> lit_columns: array<u32>;
@group(0) @binding(12) var<storage, read> run_prefixes: array<vec4<i32>>;
// Sorted by chunks of runs.
@group(0) @binding(13) var<storage, read> asks: array<Ask>;
@group(0) @binding(14) var<storage, read> chunk_starts: array<u32>;
@group(0) @binding(15) var<storage, read_write> answers: array<vec4<i32>>;

const CHUNK: u32 = 128u;
const COLUMNS: u32 = 640u;

// How many of the task's columns see a run lit.
fn lit_of(task: Task, run: u32) -> u32 {
    let lit = lit_columns[task.first_run + run];
    return min(max(lit, task.first_column) - task.first_column, task.column_count);
}
