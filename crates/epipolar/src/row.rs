//! A rectified row of the shadow map: the light rays of one slice as runs that end at the same view ray.
//!
//! "Rectified" means that values change, not only positions (Baran et al. 2010, Section 3): a stored depth becomes
//! the number of the slice's columns, counted from the light, that see the light ray before it ends. Neighbouring
//! cells with the same number are one run. The paper keeps every light ray as an entry of its own; on smooth
//! surfaces a run holds several, and sums over runs are the same sums.

use crate::map_line::MapLine;
use crate::simd_level::{Level, at_level};

/// Cells that are rectified side by side.
const LANES: usize = 16;

/// "No surface", as a depth that survives products with image coordinates in f32.
const FARTHEST: f32 = 1e25;

/// No number of columns.
const NONE: u32 = u32::MAX;

/// Runs of light rays from the eye on: run i spans γ from `starts[i]` to `starts[i + 1]`.
#[derive(Debug, Clone, Default)]
pub struct Row {
    starts: Vec<f32>,
    /// The number before the first is [`NONE`], so that every run has one before it.
    lit: Vec<u32>,
    count: usize,
}

impl Row {
    /// An empty row for slices of `columns` columns, with room for `capacity` runs.
    pub fn clear(&mut self, capacity: usize) {
        // Two cells a texel column, and every batch writes before it knows how much of it is kept.
        let room = capacity + 2 * LANES + 4;
        if self.starts.len() < room {
            self.starts.resize(room, 0.0);
            self.lit.resize(room + 1, NONE);
        }
        self.count = 0;
        self.lit[0] = NONE;
    }

    /// Appends light rays from γ on that `lit` columns see.
    #[inline(always)]
    pub fn push(&mut self, gamma: f32, lit: u32) {
        // Without a branch: what is not kept is overwritten by the next call.
        let fresh = self.lit[self.count] != lit;
        self.starts[self.count] = gamma;
        self.lit[self.count + 1] = lit;
        self.count += usize::from(fresh);
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
        4 * (self.starts.capacity() + self.lit.capacity())
    }

    /// Appends the texels of a line; `behind` columns see what ends behind the camera.
    pub fn append(&mut self, level: Level, line: &MapLine, texels: &[f32], columns: u32, behind: u32) {
        at_level!(level, self.append_cells(line, texels, columns as f32, behind as f32));
    }

    #[inline(always)]
    fn append_cells(&mut self, line: &MapLine, texels: &[f32], columns: f32, behind: f32) {
        let (mut borders, mut crossings, mut ends) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut before, mut after) = ([0u32; LANES], [0u32; LANES]);
        let (mut depth_before, mut depth_after) = ([0.0; LANES], [0.0; LANES]);
        let (mut place_before, mut place_after) = ([0i32; LANES], [0i32; LANES]);
        let [minor, slope] = line.minor;
        let per_slope = if slope == 0.0 { 0.0 } else { 1.0 / slope };
        let [major_stride, minor_stride] = line.strides;
        for base in (0..line.columns).step_by(LANES) {
            for lane in 0..LANES {
                let column = (base as i32 + lane as i32) as f32;
                let from = (column - line.consumed).max(0.0).min(line.length);
                let to = (column + 1.0 - line.consumed).min(line.length);
                let (a, b) = (minor + slope * from, minor + slope * to);
                let texel_a = a.floor().max(0.0).min(line.last_minor);
                let texel_b = b.floor().max(0.0).min(line.last_minor);
                let crossing = (texel_a.max(texel_b) - minor) * per_slope;
                borders[lane] = from;
                ends[lane] = to;
                // Without a border between texels the second cell is empty, at the far end.
                crossings[lane] = if texel_a == texel_b { to } else { crossing.max(from).min(to) };
                place_before[lane] = texel_a as i32;
                place_after[lane] = texel_b as i32;
            }
            let lanes = LANES.min((line.columns - base) as usize);
            let mut major = (line.first + line.advance * base as i32) as usize * major_stride;
            let major_step = (line.advance as isize * major_stride as isize) as usize;
            for lane in 0..lanes {
                depth_before[lane] = texels[major + place_before[lane] as usize * minor_stride];
                depth_after[lane] = texels[major + place_after[lane] as usize * minor_stride];
                major = major.wrapping_add(major_step);
            }
            for lane in 0..LANES {
                let middle = 0.5 * (borders[lane] + crossings[lane]);
                before[lane] = lit_columns(line, middle, depth_before[lane], columns, behind);
                let middle = 0.5 * (crossings[lane] + ends[lane]);
                after[lane] = lit_columns(line, middle, depth_after[lane], columns, behind);
            }
            let [gamma, per_texel] = line.gamma;
            for lane in 0..lanes {
                self.push(gamma + per_texel * borders[lane], before[lane]);
                if place_before[lane] != place_after[lane] {
                    self.push(gamma + per_texel * crossings[lane], after[lane]);
                }
            }
        }
    }
}

/// Columns that see a surface's light ray at t lit, with the surface at a stored depth.
#[inline(always)]
fn lit_columns(line: &MapLine, t: f32, depth: f32, columns: f32, behind: f32) -> u32 {
    let z = depth.min(FARTHEST) - line.depth_base;
    let [n, d] = line.lit_columns;
    let numerator = n[0] + n[1] * t + z * (n[2] + n[3] * t);
    let denominator = d[0] + d[1] * t + z * (d[2] + d[3] * t);
    let lit = if denominator > 0.0 { numerator / denominator } else { behind };
    lit.max(0.0).min(columns) as u32
}
