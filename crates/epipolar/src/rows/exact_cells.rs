//! Rows whose cells end where the line crosses from texel to texel: the map's visibility, exactly.
//!
//! What is computed, texel column by texel column:
//!
//! ```text
//! for each texel column of the line, from the eye on:
//!     for each texel that the line crosses in it (one, or two with a border between them):
//!         [t, t'] = where the line enters and leaves the texel
//!         [n, n'] = view columns that see its surface's light rays at t and t' lit
//!         push a run of ⌊n⌋ columns from t on
//!         where the surface passes from one view column to the next between t and t', push the next number
//! ```
//!
//! How it is computed, and why each departure gives the same row:
//!
//! 1. **Stretches.** A line is walked in stretches of one tile of 16×16 texels. Where the tile's extrema say that all its
//!    light rays end behind the same view ray ([`Surface::certain_lanes`]), the stretch is one run and its texels are not read:
//!    n is monotone in t and in the depth, so its extrema over the tile are those of four corners, and they agree with a
//!    margin of [`CERTAIN`], more than f32 rounds.
//! 2. **Batches.** The other stretches are rectified four at a time, a lane a texel column, in loops without a branch.
//!    Lanes before the line and behind it repeat its ends; they are masked when runs are pushed.
//! 3. **Changes only.** A bit a lane says whether n differs from the lane before: most lanes continue a run, and
//!    [`RunWriter::push`] would drop them anyway.
//! 4. **Middles.** A texel that hides at most `uncut_columns` columns is pushed once, with the middle of n and n': this is
//!    the one departure that moves edges, by half of that, and with 0 it never happens.
//! 5. **Pieces.** Where n and n' differ, the borders are solved for from their own numbers ([`RunWriter::split`]), and clamped
//!    to the texel: rounding cannot put them in another one.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16};

use super::map_line::{FARTHEST, MapLine};
use super::min_max_tiles::{LayerTiles, TILE_SIDE};
use super::row::{LANES, RowSettings, RunWriter, Surface, UNSURE};

/// Stretches that are rectified side by side.
const GROUPS: usize = LANES / TILE_SIDE;

/// A count of lit columns is certain if it would be the same this far away \[columns\]: sixteen units in the last place of
/// an f32 at 8,192 columns, of which a quotient's few roundings take up to four; and well below a column.
const CERTAIN: f32 = 1.0 / 64.0;

/// Columns from a slice's ends beyond which texels that hide less than `uncut_columns` columns are not cut: there a quarter of
/// a column is 0.4 % of the angle to an epipole at the end.
const FAR_FROM_ENDS: f32 = 64.0;

/// A line, cut where it crosses from tile to tile along its major axis.
struct Stretches {
    count: u32,
    /// Texel columns of the first stretch's tile that lie before the line.
    before: i32,
    first_tile: i32,
}

impl Stretches {
    fn new(line: &MapLine) -> Self {
        let tile = TILE_SIDE as i32;
        let into = line.first % tile;
        let before = if line.advance > 0 { into } else { tile - 1 - into };
        let count = (line.columns + before as u32).div_ceil(TILE_SIDE as u32);
        Self { count, before, first_tile: line.first / tile }
    }

    /// Texel column of the line at which a stretch's tile begins; negative if that is before the line.
    #[inline(always)]
    fn first_column(&self, stretch: u32) -> i32 {
        stretch as i32 * TILE_SIDE as i32 - self.before
    }
}

impl RunWriter<'_> {
    /// Appends the exact cells of a line; returns how many texel columns were read.
    #[inline(always)]
    pub fn append_exact<S: Simd>(
        &mut self,
        simd: S,
        line: &MapLine,
        texels: &[f32],
        tiles: LayerTiles<'_>,
        certain: &mut [i32],
        settings: RowSettings,
    ) -> u32 {
        let surface = Surface::new(line, settings.columns);
        let stretches = Stretches::new(line);
        if tiles.extrema.is_empty() {
            certain[..stretches.count as usize].fill(UNSURE);
        } else {
            surface.judge(simd, &stretches, tiles, certain);
        }
        let mut cells = CellBatch::default();
        let (mut from, mut read) = (0, 0);
        while from < stretches.count {
            // As many as fit side by side, with those in between that are one run.
            let (mut group, mut to) = (0, from);
            while to < stretches.count {
                if certain[to as usize] == UNSURE {
                    if group == GROUPS {
                        break;
                    }
                    cells.first_columns[group] = stretches.first_column(to);
                    group += 1;
                }
                to += 1;
            }
            if group > 0 {
                read += (group * TILE_SIDE) as u32;
                cells.rectify(simd, &surface, texels, settings.uncut_columns, group);
            }
            group = 0;
            for stretch in from..to {
                let certain = certain[stretch as usize];
                if certain == UNSURE {
                    self.append_stretch(&surface, &cells, group);
                    group += 1;
                } else if self.last_lit() != certain as u32 {
                    let start = stretches.first_column(stretch) as f32 - line.consumed;
                    self.push(line.gamma.at(start.max(0.0).min(line.length)), certain as u32);
                }
            }
            from = to;
        }
        read
    }

    /// Appends one stretch of a batch.
    #[inline(always)]
    fn append_stretch(&mut self, surface: &Surface<'_>, cells: &CellBatch, group: usize) {
        let first = cells.first_columns[group];
        // Lanes before the line and behind it repeat its ends.
        let from = (-first).max(0) as u32;
        let to = (surface.line.columns as i32 - first).min(TILE_SIDE as i32) as u32;
        let inside = (u64::MAX >> (64 - (to - from))) << from;
        // The first lane may differ from whatever came before.
        let changes = cells.changes >> (group * TILE_SIDE) | 1 << from;
        let mut changes = changes & inside;
        while changes != 0 {
            let lane = group * TILE_SIDE + changes.trailing_zeros() as usize % TILE_SIDE;
            changes &= changes - 1;
            for cell in 0..2 {
                let [from, to] = [cells.lit[2 * cell][lane] as u32, cells.lit[2 * cell + 1][lane] as u32];
                self.push(surface.line.gamma.at(cells.borders[cell][lane]), from);
                if from != to {
                    let ends = [cells.borders[cell][lane], cells.borders[cell + 1][lane]];
                    self.split(surface, cells.depths[cell][lane], [from, to], ends);
                }
            }
        }
    }
}

/// The cells of a few stretches, a lane a texel column.
struct CellBatch {
    first_columns: [i32; GROUPS],
    borders: [[f32; LANES]; 3],
    depths: [[f32; LANES]; 2],
    /// Lit columns at the two ends of each column's two cells, in the order along the row.
    lit: [[i32; LANES]; 4],
    /// One bit a lane in which a run may begin: most lanes continue the run of the one before.
    changes: u64,
}

impl Default for CellBatch {
    fn default() -> Self {
        Self {
            first_columns: [0; GROUPS],
            borders: [[0.0; LANES]; 3],
            depths: [[0.0; LANES]; 2],
            lit: [[0; LANES]; 4],
            changes: 0,
        }
    }
}

/// A lane a texel column of one stretch.
type Lanes<S> = f32x16<S>;

/// x, or the border that it is beyond.
#[inline(always)]
fn between<S: Simd>(simd: S, x: Lanes<S>, least: f32, most: f32) -> Lanes<S> {
    x.max(Lanes::splat(simd, least)).min(Lanes::splat(simd, most))
}

impl CellBatch {
    /// Rectifies all groups, of which the first `groups` are used.
    #[inline(always)]
    fn rectify<S: Simd>(
        &mut self,
        simd: S,
        surface: &Surface<'_>,
        texels: &[f32],
        uncut_columns: f32,
        groups: usize,
    ) {
        // Indices of texels as unsigned numbers: a map has fewer than 2³² of them.
        let mut places = [[0i32; LANES]; 2];
        for group in 0..groups {
            self.place(simd, surface.line, group, &mut places);
        }
        for cell in 0..2 {
            for lane in 0..groups * TILE_SIDE {
                self.depths[cell][lane] = texels[places[cell][lane] as u32 as usize];
            }
        }
        self.changes = 0;
        for group in 0..groups {
            self.count_lit(simd, surface, group, uncut_columns, &places);
        }
    }

    /// Where the texel columns of a group begin, end, and cross to another texel.
    #[inline(always)]
    fn place<S: Simd>(&mut self, simd: S, line: &MapLine, group: usize, places: &mut [[i32; LANES]; 2]) {
        let splat = |value: f32| Lanes::splat(simd, value);
        let [minor, slope] = line.minor;
        let per_slope = if slope == 0.0 { 0.0 } else { 1.0 / slope };
        let [major_stride, minor_stride] = line.strides.map(|stride| stride as i32);
        let column = i32x16::from_fn(simd, |lane| lane as i32) + self.first_columns[group];
        let column = column.max(i32x16::splat(simd, 0)).min(i32x16::splat(simd, line.columns as i32 - 1));
        let major = column * i32x16::splat(simd, line.advance) + line.first;
        let column: Lanes<S> = column.to_float();
        let from = between(simd, column - line.consumed, 0.0, line.length);
        let to = (column + 1.0 - line.consumed).min(splat(line.length));
        let texel_at = |t: Lanes<S>| between(simd, (t * slope + minor).floor(), 0.0, line.last_minor);
        let (one, other) = (texel_at(from), texel_at(to));
        let crossing = ((one.max(other) - minor) * per_slope).max(from).min(to);
        // Without a border between texels the second cell is empty, at the far end.
        let crossing = one.simd_eq(other).select(to, crossing);
        let range = group * TILE_SIDE..(group + 1) * TILE_SIDE;
        for (border, at) in self.borders.iter_mut().zip([from, crossing, to]) {
            at.store_slice(&mut border[range.clone()]);
        }
        let major = major * major_stride;
        for (place, texel) in places.iter_mut().zip([one, other]) {
            let place_at: i32x16<S> = major + texel.to_int::<i32x16<S>>() * minor_stride;
            place_at.store_slice(&mut place[range.clone()]);
        }
    }

    /// The lit columns of a group's cells, and where they change.
    #[inline(always)]
    fn count_lit<S: Simd>(
        &mut self,
        simd: S,
        surface: &Surface<'_>,
        group: usize,
        uncut_columns: f32,
        places: &[[i32; LANES]; 2],
    ) {
        let range = group * TILE_SIDE..(group + 1) * TILE_SIDE;
        let load = |values: &[f32; LANES]| Lanes::from_slice(simd, &values[range.clone()]);
        let mut lit = [i32x16::splat(simd, 0); 4];
        for cell in 0..2 {
            let ends = [load(&self.borders[cell]), load(&self.borders[cell + 1])];
            let [from, to] = surface.lit_lanes(simd, ends, load(&self.depths[cell]));
            // Where a texel hides little, its middle stands for all of it. Near the slice's ends, one of which may be the
            // epipole, less is much of a view ray's angle to the light.
            let from_end = from.min(Lanes::splat(simd, surface.columns) - from);
            let little = (from_end * (1.0 / FAR_FROM_ENDS)).min(Lanes::splat(simd, 1.0)) * uncut_columns;
            let whole = (to - from).abs().simd_le(little);
            let middle = (from + to) * 0.5;
            lit[2 * cell] = whole.select(middle, from).to_int();
            lit[2 * cell + 1] = whole.select(middle, to).to_int();
        }
        let one = i32x16::from_slice(simd, &places[0][range.clone()]);
        let other = i32x16::from_slice(simd, &places[1][range.clone()]);
        let same = one.simd_eq(other);
        (lit[2], lit[3]) = (same.select(lit[1], lit[2]), same.select(lit[1], lit[3]));
        for (stored, lit) in self.lit.iter_mut().zip(lit) {
            lit.store_slice(&mut stored[range.clone()]);
        }
        // Against the lane before; of the first nobody asks.
        let before = if group == 0 {
            i32x16::from_fn(simd, |lane| self.lit[3][lane.saturating_sub(1)])
        } else {
            i32x16::from_slice(simd, &self.lit[3][range.start - 1..range.end - 1])
        };
        let [a, b, c, d] = lit;
        let differs = (a ^ before) | (a ^ b) | (b ^ c) | (c ^ d);
        let bits = (!differs.simd_eq(i32x16::splat(simd, 0))).to_bitmask();
        self.changes |= (bits & 0xFFFF) << range.start;
    }
}

impl Surface<'_> {
    /// Finds the lit columns of the stretches that are one run, [`UNSURE`] for the others.
    #[inline(always)]
    fn judge<S: Simd>(&self, simd: S, stretches: &Stretches, tiles: LayerTiles<'_>, certain: &mut [i32]) {
        let line = self.line;
        let [minor, slope] = line.minor;
        let width = i32x16::splat(simd, tiles.width as i32);
        let along_rows = line.strides[0] == 1;
        for base in (0..stretches.count).step_by(TILE_SIDE) {
            let stretch =
                i32x16::from_fn(simd, |lane| (base as i32 + lane as i32).min(stretches.count as i32 - 1));
            let first =
                (stretch * TILE_SIDE as i32 - stretches.before).to_float::<Lanes<S>>() - line.consumed;
            let ends = [
                between(simd, first, 0.0, line.length),
                between(simd, first + TILE_SIDE as f32, 0.0, line.length),
            ];
            let major = stretch * line.advance + stretches.first_tile;
            // Along a stretch the line rises by a tile at the most, so it crosses two at the most.
            let mut places = [[0i32; TILE_SIDE]; 2];
            for end in 0..2 {
                let texel =
                    between(simd, ends[end] * slope + minor, 0.0, line.last_minor).to_int::<i32x16<S>>();
                let tile = texel >> TILE_SIDE.trailing_zeros();
                let place = if along_rows { tile * width + major } else { major * width + tile };
                place.store_slice(&mut places[end]);
            }
            let mut depths = [[0.0f32; TILE_SIDE]; 2];
            for lane in 0..TILE_SIDE {
                let a = tiles.extrema[places[0][lane] as usize];
                let b = tiles.extrema[places[1][lane] as usize];
                (depths[0][lane], depths[1][lane]) = (a[0].min(b[0]), a[1].max(b[1]));
            }
            let depths = [Lanes::from_slice(simd, &depths[0]), Lanes::from_slice(simd, &depths[1])];
            self.certain_lanes(simd, ends, depths).store_slice(&mut certain[base as usize..][..TILE_SIDE]);
        }
    }

    /// [`MapLine::view_coordinate`] of sixteen texel columns.
    #[inline(always)]
    fn lit_lanes<S: Simd>(&self, simd: S, ends: [Lanes<S>; 2], depth: Lanes<S>) -> [Lanes<S>; 2] {
        let z = depth.min(Lanes::splat(simd, FARTHEST)) - self.line.depth_base;
        let [n, d] = self.line.lit_columns;
        let linear = |f: [f32; 4]| [z * f[2] + f[0], z * f[3] + f[1]];
        let (numerator, denominator) = (linear(n), linear(d));
        let (zero, columns) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, self.columns));
        let mut lit = ends;
        for lit in &mut lit {
            let t = *lit;
            let numerator = numerator[1] * t + numerator[0];
            let denominator = denominator[1] * t + denominator[0];
            let behind = numerator.simd_lt(denominator).select(zero, columns);
            let ahead = denominator.simd_gt(zero).select(numerator / denominator, behind);
            *lit = between(simd, ahead, 0.0, self.columns);
        }
        lit
    }

    /// The lit columns of all light rays from t to t' that end between two depths, if that is one number; else
    /// negative. Sixteen stretches at a time.
    ///
    /// A quotient of functions that are linear in t and in the depth is monotone in each of them, so its extrema over a
    /// box are those of the corners, while the denominator keeps its sign; and so are the extrema of their difference.
    #[inline(always)]
    fn certain_lanes<S: Simd>(&self, simd: S, ends: [Lanes<S>; 2], depths: [Lanes<S>; 2]) -> i32x16<S> {
        let [n, d] = self.line.lit_columns;
        let splat = |value: f32| Lanes::splat(simd, value);
        let (zero, one) = (splat(0.0), splat(1.0));
        let (mut least, mut most) = (splat(f32::INFINITY), splat(f32::NEG_INFINITY));
        // Corners before the camera, and corners that no column sees lit if they are behind it.
        let (mut ahead, mut dark) = (zero, zero);
        for depth in depths {
            let z = depth.min(splat(FARTHEST)) - self.line.depth_base;
            for t in ends {
                let numerator = (z * n[3] + n[1]) * t + (z * n[2] + n[0]);
                let denominator = (z * d[3] + d[1]) * t + (z * d[2] + d[0]);
                ahead += denominator.simd_gt(zero).select(one, zero);
                dark += numerator.simd_lt(denominator).select(one, zero);
                let lit = numerator / denominator;
                (least, most) = (least.min(lit), most.max(lit));
            }
        }
        let count = |lit: Lanes<S>| between(simd, lit, 0.0, self.columns).to_int::<i32x16<S>>();
        let (least, most) = (count(least - CERTAIN), count(most + CERTAIN));
        let unsure = i32x16::splat(simd, UNSURE);
        let ahead_of_it = least.simd_eq(most).select(least, unsure);
        let (none, all) = (i32x16::splat(simd, 0), i32x16::splat(simd, self.columns as i32));
        let behind_it = dark.simd_eq(zero).select(all, dark.simd_eq(splat(4.0)).select(none, unsure));
        ahead.simd_eq(zero).select(behind_it, ahead.simd_eq(splat(4.0)).select(ahead_of_it, unsure))
    }
}
