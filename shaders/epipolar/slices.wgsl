// Slices, their lines through the sun's maps, and what a batch of them shares: the mirrors of the records of
// scatter-kernels' `epipolar` (a test compares the layouts). Columns of a slice are counted by k, from the one nearest to the
// epipole on; a column's rank is its number counted from the light.

struct SliceData {
    // View ray of column k = 0 in the slice's plane, (across, to_light), and its change a column: both across parts are >= 0.
    view_ray: vec4<f32>,
    // Minor coordinate of the slice's line at k = 0, less 1/2, and its change a column; fixed point. Neither falls from a slice
    // of a fan to the next, so that lines do not cross, and every pixel lies in one gap.
    border: vec2<i32>,
    // Image column of k = 0, and its change a column, 1 or -1.
    column: vec2<i32>,
    // Columns of its fan.
    column_count: u32,
    // Its fan's first of `ranges`.
    first_range: u32,
    first_line: u32,
    line_count: u32,
    // Its row: the number of runs, then the runs, then an end.
    first_run: u32,
    // Most runs.
    room: u32,
    // SLICE_*.
    flags: u32,
    padding: u32,
}

const FIRST_OF_FAN: u32 = 1u;
const LAST_OF_FAN: u32 = 2u;
const STEEP: u32 = 4u;

// The line of a slice through one layer: MapLine of the crate epipolar. t counts texels from where it enters.
struct SliceLine {
    columns: u32,
    first: i32,
    advance: i32,
    layer: u32,
    strides: vec2<u32>,
    minor: vec2<f32>,
    length: f32,
    consumed: f32,
    last_minor: f32,
    depth_base: f32,
    // gamma at t = 0, and its change a texel; -, -.
    gamma: vec4<f32>,
    // Lit columns of a surface at a depth z: quotient of two sums by 1, t, z, t z.
    numerator: vec4<f32>,
    denominator: vec4<f32>,
}

// A workgroup's share of a slice: columns of one band of 1/sin(beta).
struct SliceTask {
    slice: u32,
    band: u32,
    first_rank: u32,
    column_count: u32,
}

struct EpipolarUniform {
    // First slice of the batch, how many; first task, how many.
    batch: vec4<u32>,
    // Channels, bits behind the point of borders, 1 where light travels towards the epipole, pixels.
    counts: vec4<u32>,
    // Pixels that no slice answers: columns from, to; rows from, to.
    walked: vec4<u32>,
    // Where rays end that are longer; 1 where slices answer at all; -, -.
    reach: vec4<f32>,
    // Of each channel: first node of its table, intervals, bits of a place between two nodes, -.
    tables: array<vec4<u32>, 3>,
    // Of each channel: what a unit of each term is worth.
    units: array<vec4<f32>, 3>,
    // Of each channel and band: places of the table a unit of gamma, smallest 1/sin(beta), 2 over the band's width, -.
    bands: array<vec4<f32>, 72>,
    padding: array<vec4<f32>, 14>,
}

const MOST_BANDS: u32 = 24u;
const GROUPS_A_ROW: u32 = 1024u;
// What all answers of a pixel add up to where it sees everything lit: 2^30.
const WHOLE: u32 = 1073741824u;

@group(0) @binding(9) var<uniform> epipolar: EpipolarUniform;
