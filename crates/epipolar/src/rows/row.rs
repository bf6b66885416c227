//! A rectified row of the shadow map: the light rays of one slice as runs that end at the same view ray.
//!
//! "Rectified" means that values change, not only positions (Baran et al. 2010, Section 3): a stored depth becomes
//! the number of the slice's columns, counted from the light, that see the light ray before it ends. Neighbouring
//! cells with the same number are one run. The paper keeps every light ray as an entry of its own; on smooth
//! surfaces a run holds several, and sums over runs are the same sums.

use scatter_core::{Level, at_level};

use super::map_line::{FARTHEST, MapLine};
use super::min_max_tiles::{LayerTiles, TILE_SIDE};

/// Texel columns that are rectified side by side: four registers, and as many cache misses as a core keeps in flight
/// while it gathers depths. Sixteen took 1.4 times as long on a 4096² map.
pub(crate) const LANES: usize = 64;

/// No number of columns.
const NONE: u32 = u32::MAX;

/// What is known of a stretch of texels that are not one run.
pub(crate) const UNSURE: i32 = -1;

/// A rectified row (Baran et al. 2010, Section 3): runs of light rays that end behind the same view ray, from the eye on.
///
/// "Rectified" means that values change, not only positions: a stored depth is the number of the slice's columns, counted
/// from the light, that see the light ray before it ends. The paper keeps every light ray as an entry of its own; sums over runs
/// are the same sums. Run i spans γ from `starts[i]` to `starts[i + 1]`.
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
    /// An empty row with room for `capacity` runs. Where texels are cut more finely than there is room, the last of their
    /// pieces are one: a row keeps to its room, but for two runs a texel column, which it always has.
    pub fn clear(&mut self, capacity: usize) {
        self.count = 0;
        self.make_room(capacity);
        self.lit[0] = NONE;
    }

    /// Room for further runs, and for what is known of as many texel columns.
    #[inline(always)]
    pub(crate) fn make_room(&mut self, further: usize) {
        // Two cells a texel column, and every batch writes before it knows how much of it is kept.
        let room = self.count + further + 2 * LANES + 4;
        if self.starts.len() < room {
            self.starts.resize(room, 0.0);
            self.lit.resize(room + 1, NONE);
            // A line is no longer than the row has runs.
            self.certain.resize(room / TILE_SIDE + 2 * TILE_SIDE, UNSURE);
        }
    }

    /// Room for so many further runs that are [pushed](Self::push).
    #[inline(always)]
    pub fn reserve(&mut self, runs: usize) {
        self.make_room(runs);
    }

    /// Appends light rays from γ on that `lit` columns see; there must be [room](Self::reserve) for them.
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
        simd: Level,
        line: &MapLine,
        texels: &[f32],
        tiles: LayerTiles<'_>,
        settings: RowSettings,
    ) -> u32 {
        let (mut writer, certain) = self.writer();
        let read = at_level!(simd, vectors => {
            writer.append_exact(vectors, line, texels, tiles, certain, settings)
        });
        self.count = writer.count;
        read
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
pub struct RowSettings {
    /// Number of columns.
    pub columns: u32,
    /// Columns that one texel may hide before the light rays behind it are told apart, 0 to 16: 0 is exact, 1 moves a
    /// shadow's edge by up to half a column. Less within 64 columns of a slice's ends.
    pub uncut_columns: f32,
}

/// What a stored depth means along one line.
pub(crate) struct Surface<'a> {
    pub line: &'a MapLine,
    pub columns: f32,
}

impl<'a> Surface<'a> {
    pub fn new(line: &'a MapLine, columns: u32) -> Self {
        Self { line, columns: columns as f32 }
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
