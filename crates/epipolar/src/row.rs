//! A rectified row of the shadow map: the light rays of one slice as runs that end at the same view ray.
//!
//! "Rectified" means that values change, not only positions (Baran et al. 2010, Section 3): a stored depth becomes
//! the number of the slice's columns, counted from the light, that see the light ray before it ends. Neighbouring
//! cells with the same number are one run. The paper keeps every light ray as an entry of its own; on smooth
//! surfaces a run holds several, and sums over runs are the same sums.

use scatter_core::{Level, at_level};

use crate::extrema::{LayerExtrema, TILE};
use crate::map_line::MapLine;

/// Where the cells of a row lie, and how many depths each of them knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Cells {
    /// Cells end where the line crosses from texel to texel: the map's visibility, exactly.
    #[default]
    Exact,
    /// A cell a texel column, with the depth in its middle: Riemann sums, as the paper's without prefiltering.
    Uniform,
    /// A cell a texel column, four depths in it, grouped into modes with fractional weights (Baran et al. 2010,
    /// Section 7).
    Modes,
    /// Four depths a texel column, each with a quarter of it: the box filter that the modes stand for.
    Box,
}

/// Texel columns that are rectified side by side: four registers, and as many cache misses as a core keeps in flight
/// while it gathers depths. Sixteen took 1.4 times as long on a 4096² map.
pub(crate) const LANES: usize = 64;

/// "No surface", as a depth that survives products with image coordinates in f32.
pub(crate) const FARTHEST: f32 = 1e25;

/// No number of columns.
const NONE: u32 = u32::MAX;

/// What is known of a stretch of texels that are not one run.
pub(crate) const UNSURE: i32 = -1;

/// Runs of light rays from the eye on: run i spans γ from `starts[i]` to `starts[i + 1]`.
#[derive(Debug, Clone, Default)]
pub struct Row {
    starts: Vec<f32>,
    /// The number before the first is [`NONE`], so that every run has one before it.
    lit: Vec<u32>,
    count: usize,
    /// Lit columns of each stretch of a line, or [`UNSURE`], for [`Self::append`].
    pub(crate) certain: Vec<i32>,
}

impl Row {
    /// An empty row for slices of `columns` columns, with room for `capacity` runs.
    pub fn clear(&mut self, capacity: usize) {
        // Two cells a texel column, and every batch writes before it knows how much of it is kept.
        let room = capacity + 2 * LANES + 4;
        if self.starts.len() < room {
            self.starts.resize(room, 0.0);
            self.lit.resize(room + 1, NONE);
            // A line is no longer than the row has runs.
            self.certain.resize(room / TILE + 2 * TILE, UNSURE);
        }
        self.count = 0;
        self.lit[0] = NONE;
    }

    /// Appends light rays from γ on that `lit` columns see.
    #[inline(always)]
    pub fn push(&mut self, gamma: f32, lit: u32) {
        let (mut writer, _) = self.writer();
        writer.push(gamma, lit);
        self.count = writer.count;
    }

    /// What appends runs, and what is certain of stretches. The row's own count is to be set when it is done.
    #[inline(always)]
    fn writer(&mut self) -> (RunWriter<'_>, &mut [i32]) {
        let Self { starts, lit, count, certain } = self;
        (RunWriter { last: lit[*count], starts, lit, count: *count }, certain)
    }

    /// Ends the row: nothing follows its last run.
    pub fn finish(&mut self) {
        self.starts[self.count] = f32::INFINITY;
    }

    /// Number of runs.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no runs.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// γ where each run starts, and one more: ∞.
    pub fn starts(&self) -> &[f32] {
        &self.starts[..=self.count]
    }

    /// Columns, counted from the light, that see each run lit.
    pub fn lit(&self) -> &[u32] {
        &self.lit[1..=self.count]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.starts.capacity() + self.lit.capacity() + self.certain.capacity())
    }

    /// Appends the texels of a line; returns how many of its columns were read. What the map's extrema leave no doubt
    /// of is not read.
    pub fn append(
        &mut self,
        level: Level,
        line: &MapLine,
        texels: &[f32],
        extrema: LayerExtrema<'_>,
        seen: Seen,
    ) -> u32 {
        match seen.cells {
            Cells::Exact => {
                let (mut writer, certain) = self.writer();
                let read = at_level!(level, simd => {
                    writer.append_exact(simd, line, texels, extrema, certain, seen)
                });
                self.count = writer.count;
                return read;
            }
            Cells::Uniform => self.append_samples::<1>(line, texels, seen),
            Cells::Box | Cells::Modes => self.append_samples::<4>(line, texels, seen),
        }
        line.columns
    }

    /// Appends a cell a texel column with N depths.
    fn append_samples<const N: usize>(&mut self, line: &MapLine, texels: &[f32], seen: Seen) {
        /// Depths that differ by less than this share of a depth are one mode: a surface, not an edge.
        const ONE_MODE: f32 = 0.01;
        let surface = Surface::new(line, seen);
        let [minor, slope] = line.minor;
        for column in 0..line.columns as i32 {
            let from = (column as f32 - line.consumed).max(0.0).min(line.length);
            let to = (column as f32 + 1.0 - line.consumed).min(line.length);
            let major = (line.first + line.advance * column) as usize * line.strides[0];
            let place = |sample: f32| from + (to - from) * (sample / N as f32);
            // Depth and weight of each mode.
            let mut modes = [(0.0f32, 0.0f32); N];
            let mut count = 0;
            for sample in 0..N {
                let at = minor + slope * place(sample as f32 + 0.5);
                let texel = at.floor().max(0.0).min(line.last_minor) as usize;
                let depth = texels[major + texel * line.strides[1]].min(FARTHEST);
                let near = |mode: &&mut (f32, f32)| (mode.0 - depth).abs() <= ONE_MODE * depth;
                let known = modes[..count].iter_mut().find(near).filter(|_| seen.cells == Cells::Modes);
                match known {
                    Some(mode) => {
                        mode.1 += 1.0;
                        mode.0 += (depth - mode.0) / mode.1;
                    }
                    None => {
                        modes[count] = (depth, 1.0);
                        count += 1;
                    }
                }
            }
            let mut done = 0.0;
            for &(depth, weight) in &modes[..count] {
                let (start, end) = (place(done), place(done + weight));
                // A mode stands for all of its cell, a sample for its own part.
                let middle = if seen.cells == Cells::Modes { 0.5 * (from + to) } else { 0.5 * (start + end) };
                self.push(line.gamma.at(start), surface.lit_columns([middle; 2], depth)[0] as u32);
                done += weight;
            }
        }
    }
}

/// Appends runs to a row. A hundred runs in a row depend on the count of them, so it is not kept in memory: a core waits
/// for what it has just stored.
pub(crate) struct RunWriter<'a> {
    starts: &'a mut [f32],
    lit: &'a mut [u32],
    count: usize,
    last: u32,
}

impl RunWriter<'_> {
    /// As [`Row::push`].
    #[inline(always)]
    pub fn push(&mut self, gamma: f32, lit: u32) {
        // Without a branch: what is not kept is overwritten by the next call.
        self.starts[self.count] = gamma;
        self.lit[self.count + 1] = lit;
        self.count += usize::from(self.last != lit);
        self.last = lit;
    }

    /// Columns that see the last run lit.
    #[inline(always)]
    pub fn last_lit(&self) -> u32 {
        self.last
    }

    /// Appends the light rays of one texel behind which the number of lit columns changes from `from` to `to`.
    pub fn split(&mut self, surface: &Surface<'_>, depth: f32, [from, to]: [u32; 2], [start, end]: [f32; 2]) {
        // Where the map is coarse beside the image near the epipole a texel may change every column; a row keeps to
        // its room, whatever the map holds.
        let room = (self.starts.len() - self.count).saturating_sub(2 * LANES + 4) as u32;
        let steps = from.abs_diff(to).min(room);
        let mut at = start;
        for step in 0..steps {
            let (border, next) =
                if to > from { (from + step + 1, from + step + 1) } else { (from - step, from - step - 1) };
            at = surface.crossing(border as f32, depth).max(at).min(end);
            self.push(surface.line.gamma.at(at), next);
        }
    }
}

/// How a slice's columns see a row.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Where the cells lie.
    pub cells: Cells,
    /// Number of columns.
    pub columns: u32,
    /// Columns that a texel may hide before its light rays are told apart.
    pub split_over: f32,
}

/// What a stored depth means along one line.
pub(crate) struct Surface<'a> {
    pub line: &'a MapLine,
    pub columns: f32,
}

impl<'a> Surface<'a> {
    pub fn new(line: &'a MapLine, seen: Seen) -> Self {
        Self { line, columns: seen.columns as f32 }
    }

    /// Columns that see a surface's light rays from t to t' lit, with the surface at a stored depth.
    #[inline(always)]
    pub fn lit_columns(&self, ends: [f32; 2], depth: f32) -> [f32; 2] {
        let z = depth.min(FARTHEST) - self.line.depth_base;
        let [n, d] = self.line.lit_columns;
        let (numerator, denominator) =
            ([n[0] + z * n[2], n[1] + z * n[3]], [d[0] + z * d[2], d[1] + z * d[3]]);
        ends.map(|t| {
            let (numerator, denominator) =
                (numerator[0] + numerator[1] * t, denominator[0] + denominator[1] * t);
            // Behind the camera all columns see it lit, or none. Compared with the denominator, for one that should
            // be 0 (the light is parallel to the image plane) may have any sign.
            let behind = if numerator < denominator { 0.0 } else { self.columns };
            let lit = if denominator > 0.0 { numerator / denominator } else { behind };
            lit.max(0.0).min(self.columns)
        })
    }

    /// Where along the line exactly `count` columns see the surface lit.
    fn crossing(&self, count: f32, depth: f32) -> f32 {
        let z = depth.min(FARTHEST) - self.line.depth_base;
        let [n, d] = self.line.lit_columns;
        let constant = (n[0] + z * n[2]) - count * (d[0] + z * d[2]);
        let slope = (n[1] + z * n[3]) - count * (d[1] + z * d[3]);
        // NaN where the surface runs along a view ray: the caller's max and min then choose an end.
        -constant / slope
    }
}
