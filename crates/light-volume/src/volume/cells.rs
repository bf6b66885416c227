//! Adaptive tessellation of a stepped surface: squares of texels whose depths differ by less than a threshold become one.
//!
//! After Billeter et al. 2010, Section 4.1: a hierarchy over the map says of each square whether it needs further
//! subdivision. Departures: what decides is the spread of the depths in a square (least and greatest), since one flat cap
//! replaces them; the paper's Laplacian measures how far they are from a plane, which a step is not. And neighbouring
//! squares may differ by any number of levels: walls stand on texels' borders, so that there is nothing to stitch.

use scatter_core::parallel;

/// Texels along the side of a patch: the smallest square that has a list of faces of its own.
pub const PATCH: u32 = 8;

/// The level of the largest squares that become one: 32,768 texels a side, so that numbers within one fit into sixteen bits.
const LARGEST_LEVEL: usize = 12;

/// Largest spread of the depths in a square that becomes one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// In the depth's unit.
    pub absolute: f32,
    /// As a share of the nearest depth.
    pub relative: f32,
}

impl Tolerance {
    /// Texels of equal depth alone become one.
    pub const EXACT: Self = Self { absolute: 0.0, relative: 0.0 };

    /// Whether one cap may stand for depths from `least` to `greatest`.
    #[inline(always)]
    pub fn holds(&self, [least, greatest]: [f32; 2]) -> bool {
        // ∞ − ∞ is no number: all of a hole is a square, and a hole with a rim is none.
        least == greatest || greatest - least <= self.absolute.max(self.relative * least)
    }
}

/// A square's cap: half way between its nearest and its farthest depth.
fn middle([least, greatest]: [f32; 2]) -> f32 {
    if least == greatest { least } else { least + 0.5 * (greatest - least) }
}

/// Least and greatest depths of all squares of a map; level n has squares of `PATCH`·2ⁿ texels.
#[derive(Debug, Clone, Default)]
pub struct Spreads {
    size: [u32; 2],
    levels: Vec<Vec<[f32; 2]>>,
}

impl Spreads {
    /// Of a map. Buffers are reused. O(texels).
    pub fn build(&mut self, size: [u32; 2], texels: &[f32]) {
        self.size = size;
        let count = level_count(size);
        self.levels.resize_with(count.max(self.levels.len()), Vec::new);
        for (level, spreads) in self.levels.iter_mut().enumerate() {
            let [columns, rows] = if level < count { squares(size, level) } else { [0; 2] };
            spreads.resize((columns * rows) as usize, EMPTY);
        }
        let [columns, _] = squares(size, 0);
        parallel::for_each_row(&mut self.levels[0], columns as usize, |row, spreads| {
            for (column, spread) in spreads.iter_mut().enumerate() {
                *spread = spread_of(size, texels, [column as u32 * PATCH, row as u32 * PATCH], PATCH);
            }
        });
        for level in 1..count {
            let (finer, coarser) = self.levels.split_at_mut(level);
            halve(&finer[level - 1], squares(size, level - 1), &mut coarser[0]);
        }
    }

    /// The level of the largest square around a patch that one cap may stand for, and that square's spread; `None` if the
    /// patch itself is not such a one.
    pub fn largest(&self, [column, row]: [u32; 2], tolerance: &Tolerance) -> Option<(usize, [f32; 2])> {
        let mut found = None;
        for level in 0..level_count(self.size).min(LARGEST_LEVEL + 1) {
            let [columns, _] = squares(self.size, level);
            let spread = self.levels[level][((row >> level) * columns + (column >> level)) as usize];
            if !tolerance.holds(spread) {
                break;
            }
            found = Some((level, spread));
        }
        found
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.levels.iter().map(|level| level.capacity() * size_of::<[f32; 2]>()).sum::<usize>() as u64
    }
}

/// Of no depth at all.
pub const EMPTY: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// The spread of two together.
#[inline(always)]
pub fn joined(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Levels up to the one of a single square.
pub fn level_count(size: [u32; 2]) -> usize {
    let patches = size[0].max(size[1]).div_ceil(PATCH);
    (patches.next_power_of_two().trailing_zeros() + 1) as usize
}

/// Squares of a level along columns and rows.
pub fn squares(size: [u32; 2], level: usize) -> [u32; 2] {
    size.map(|n| n.div_ceil(PATCH << level))
}

/// The next coarser level of spreads.
pub fn halve(finer: &[[f32; 2]], [columns, rows]: [u32; 2], coarser: &mut [[f32; 2]]) {
    let width = columns.div_ceil(2) as usize;
    coarser.fill(EMPTY);
    for (row, values) in finer.chunks(columns as usize).enumerate().take(rows as usize) {
        for (column, spread) in values.iter().enumerate() {
            let at = &mut coarser[(row / 2) * width + column / 2];
            *at = joined(*at, *spread);
        }
    }
}

fn spread_of(size: [u32; 2], texels: &[f32], [x, y]: [u32; 2], side: u32) -> [f32; 2] {
    let mut spread = EMPTY;
    let columns = (size[0].min(x + side) - x) as usize;
    for row in y..size[1].min(y + side) {
        for depth in &texels[row as usize * size[0] as usize + x as usize..][..columns] {
            spread = joined(spread, [*depth; 2]);
        }
    }
    spread
}

/// Writes a row of patches of the map with every square that one cap may stand for at the cap's depth. `strip` are its rows
/// of the new map, `levels` the level of the square that each patch belongs to (−1 for none).
pub fn flatten(
    (size, texels): ([u32; 2], &[f32]),
    spreads: &Spreads,
    tolerance: &Tolerance,
    patch_row: u32,
    strip: &mut [f32],
) {
    let y = patch_row * PATCH;
    let rows = size[1].min(y + PATCH) - y;
    let width = size[0] as usize;
    strip.copy_from_slice(&texels[y as usize * width..][..rows as usize * width]);
    for column in 0..squares(size, 0)[0] {
        let x = column * PATCH;
        match spreads.largest([column, patch_row], tolerance) {
            Some((_, spread)) => fill(strip, width, [x, 0], PATCH, middle(spread)),
            None => flatten_square(strip, width, [x, 0], PATCH / 2, tolerance),
        }
    }
}

/// The four squares of that side from `(x, y)` of a strip on, and their parts.
fn flatten_square(strip: &mut [f32], width: usize, [x, y]: [u32; 2], side: u32, tolerance: &Tolerance) {
    for [x, y] in [[x, y], [x + side, y], [x, y + side], [x + side, y + side]] {
        let rows = strip.len() / width;
        if x as usize >= width || y as usize >= rows {
            continue;
        }
        let spread = spread_of([width as u32, rows as u32], strip, [x, y], side);
        if tolerance.holds(spread) {
            fill(strip, width, [x, y], side, middle(spread));
        } else if side > 2 {
            flatten_square(strip, width, [x, y], side / 2, tolerance);
        }
    }
}

fn fill(strip: &mut [f32], width: usize, [x, y]: [u32; 2], side: u32, depth: f32) {
    let columns = width.min((x + side) as usize) - x as usize;
    for row in strip.chunks_mut(width).skip(y as usize).take(side as usize) {
        row[x as usize..][..columns].fill(depth);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flattened(size: [u32; 2], texels: &[f32], tolerance: Tolerance) -> Vec<f32> {
        let mut spreads = Spreads::default();
        spreads.build(size, texels);
        let mut flat = vec![0.0; texels.len()];
        for (row, strip) in flat.chunks_mut((size[0] * PATCH) as usize).enumerate() {
            flatten((size, texels), &spreads, &tolerance, row as u32, strip);
        }
        flat
    }

    #[test]
    fn an_exact_tolerance_changes_no_texel() {
        let size = [37, 19];
        let texels: Vec<f32> =
            (0..37 * 19).map(|n| if n % 7 == 0 { f32::INFINITY } else { ((n * n) % 11) as f32 }).collect();
        assert_eq!(flattened(size, &texels, Tolerance::EXACT), texels);
    }

    #[test]
    fn no_texel_moves_by_more_than_half_the_tolerance_and_holes_keep_their_rims() {
        let size = [45, 27];
        let texels: Vec<f32> = (0..45 * 27)
            .map(|n| {
                let (x, y) = (n % 45, n / 45);
                if x > 30 && y > 12 { f32::INFINITY } else { 5.0 + 0.01 * x as f32 + 0.02 * y as f32 }
            })
            .collect();
        let flat = flattened(size, &texels, Tolerance { absolute: 0.1, relative: 0.0 });
        let mut distinct: Vec<f32> = flat.clone();
        distinct.sort_by(f32::total_cmp);
        distinct.dedup();
        for (before, after) in texels.iter().zip(&flat) {
            assert_eq!(before.is_finite(), after.is_finite());
            assert!(!before.is_finite() || (before - after).abs() <= 0.0501, "{before} {after}");
        }
        assert!(distinct.len() < 120, "few caps are left: {}", distinct.len());
    }
}
