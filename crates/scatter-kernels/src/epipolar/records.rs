//! What the passes of `epipolar` share with Rust: the mirrors of the structs and constants of `slices.wgsl`.

use bytemuck::{Pod, Zeroable};
use epipolar::rows::MapLine;
use epipolar::rows::MapLineRecord;

/// Most bands of 1/sin β, octaves from 1 to `epipolar::geometry::STEEPEST`, and a few more.
pub const MOST_BANDS: usize = 24;

/// Runs that a workgroup of `sums` holds at once.
pub const CHUNK: u32 = 128;

/// Most columns of a task: its sums fit the 16,384 bytes of workgroup memory that WebGPU guarantees.
pub const COLUMNS: u32 = 512;

/// Binding of [`EpipolarUniform`].
pub const UNIFORM: u32 = 9;

/// Workgroups in x, before they go on in y.
pub const GROUPS_A_ROW: u32 = 1024;

/// What all answers of a pixel add up to where it sees everything lit.
pub const WHOLE: u32 = 1 << 30;

/// Flags of [`SliceData`].
pub mod flags {
    /// The first slice of its fan: pixels begin where the fan does.
    pub const FIRST_OF_FAN: u32 = 1;
    /// The last slice of its fan.
    pub const LAST_OF_FAN: u32 = 2;
    /// Columns are rows of the image.
    pub const STEEP: u32 = 4;
}

/// One slice. Columns are counted by `k`, from the one nearest to the epipole on.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SliceData {
    /// View ray of column k = 0 in the slice's plane, `[across, to_light]`, and its change a column.
    pub view_ray: [f32; 4],
    /// Minor coordinate of the slice's line at k = 0, less ½, and its change a column; fixed point.
    pub border: [i32; 2],
    /// Image column of k = 0, and its change a column, ±1.
    pub column: [i32; 2],
    /// Columns of its fan.
    pub column_count: u32,
    /// Its fan's first of the ranges of pixels.
    pub first_range: u32,
    /// Its first line.
    pub first_line: u32,
    /// Its lines.
    pub line_count: u32,
    /// Its row: the number of runs, then the runs, then an end.
    pub first_run: u32,
    /// Most runs.
    pub room: u32,
    /// [`flags`].
    pub flags: u32,
    /// Unused.
    pub padding: u32,
}

/// A slice's line through one layer of the sun's maps.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct SliceLine {
    /// Texel columns that it crosses.
    pub columns: u32,
    /// Index of the first one along the major axis.
    pub first: i32,
    /// Its change a column, ±1.
    pub advance: i32,
    /// Layer of the maps.
    pub layer: u32,
    /// Distance of texels that are neighbours along the major and the minor axis, in texels of the layer.
    pub strides: [u32; 2],
    /// Minor texel coordinate at t = 0, and its change a texel.
    pub minor: [f32; 2],
    /// Length \[texels\].
    pub length: f32,
    /// Part of the first texel column before the start.
    pub consumed: f32,
    /// Last texel index along the minor axis.
    pub last_minor: f32,
    /// Subtracted from depths first.
    pub depth_base: f32,
    /// Distance of the light ray at t = 0 from the eye, and its change a texel; zeros.
    pub gamma: [f32; 4],
    /// Lit columns of a surface: numerator by `1, t, z, t·z`.
    pub numerator: [f32; 4],
    /// And denominator.
    pub denominator: [f32; 4],
}

impl SliceLine {
    /// Of a sun's line through a layer.
    pub fn new(layer: usize, line: &MapLine) -> Self {
        let record = MapLineRecord::from(line);
        let [a, b, c, d, e, f, g, h] = record.lit_columns;
        Self {
            columns: record.columns,
            first: record.first,
            advance: record.advance,
            layer: layer as u32,
            strides: record.strides,
            minor: record.minor,
            length: record.length,
            consumed: record.consumed,
            last_minor: record.last_minor,
            depth_base: record.depth_base,
            gamma: record.gamma,
            numerator: [a, b, c, d],
            denominator: [e, f, g, h],
        }
    }
}

/// A workgroup's share of a slice: columns of one band.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct SliceTask {
    /// The slice.
    pub slice: u32,
    /// The band of 1/sin β.
    pub band: u32,
    /// First column, counted from the light.
    pub first_rank: u32,
    /// How many, 1 to [`COLUMNS`].
    pub column_count: u32,
}

/// What a batch of slices shares.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct EpipolarUniform {
    /// First slice of the batch, how many; first task, how many.
    pub batch: [u32; 4],
    /// Channels whose shares differ, bits behind the point of borders, 1 where light travels towards the epipole, pixels of the
    /// camera.
    pub counts: [u32; 4],
    /// Pixels that no slice answers: columns from, to; rows from, to.
    pub walked: [u32; 4],
    /// Where rays end that are longer; 1 where slices answer at all.
    pub reach: [f32; 4],
    /// Of each channel: first node of its table, intervals, bits of a place between two nodes.
    pub tables: [[u32; 4]; 3],
    /// Of each channel: unit of each term.
    pub units: [[f32; 4]; 3],
    /// Of each channel and band: places of the table a unit of γ, smallest 1/sin β, 2 over the band's width.
    pub bands: [[[f32; 4]; MOST_BANDS]; 3],
    /// To a multiple of 256 bytes, at which batches follow each other.
    pub padding: [[f32; 4]; 14],
}
