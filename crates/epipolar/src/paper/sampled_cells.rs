//! The paper's rows: a cell a texel column, with one depth or four in it (Baran et al. 2010, Sections 3 and 7).
//!
//! The paper samples a rectified row at d uniform places; without prefiltering that takes ten times the samples. With it,
//! four samples a cell are grouped into modes with fractional weights. The box filter, which keeps all four, is what the
//! modes stand for. All of them err at edges where exact cells (`rows::Row`) do not, and cost more: kept to be measured.

use crate::driver::SliceView;
use crate::rows::{FARTHEST, MapLine, Row};

/// How many depths a cell knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampledCells {
    /// One, in its middle: Riemann sums, as the paper's without prefiltering.
    Uniform,
    /// Four, grouped into modes with fractional weights (Baran et al. 2010, Section 7).
    Modes,
    /// Four, each with a quarter of the cell: the box filter that the modes stand for.
    Box,
}

impl SampledCells {
    /// Rectifies the light rays of a slice; returns how many texel columns were read. O(texels along the slice).
    pub fn rectify(self, slice: &SliceView<'_>, row: &mut Row) -> u64 {
        let columns = slice.order.count() as u32;
        slice.fill_row(row, |row, line, layer| {
            let texels = slice.texels(layer);
            match self {
                Self::Uniform => append::<1>(row, line, texels, columns, false),
                Self::Modes => append::<4>(row, line, texels, columns, true),
                Self::Box => append::<4>(row, line, texels, columns, false),
            }
            line.columns
        })
    }
}

/// Appends a cell a texel column with N depths; as modes where they are to be told apart.
fn append<const N: usize>(row: &mut Row, line: &MapLine, texels: &[f32], columns: u32, as_modes: bool) {
    /// Depths that differ by less than this share of a depth are one mode: a surface, not an edge.
    const ONE_MODE: f32 = 0.01;
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
            let known = modes[..count].iter_mut().find(near).filter(|_| as_modes);
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
            let middle = if as_modes { 0.5 * (from + to) } else { 0.5 * (start + end) };
            row.push(line.gamma.at(start), line.view_coordinate(middle, depth, columns as f32) as u32);
            done += weight;
        }
    }
}
