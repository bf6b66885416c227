//! Before any ray goes its own way: slabs of a block of pixels' rays that are all lit or all dark.
//!
//! A slab is what lies between two depths of the camera on all rays of a block. Its bounds in a map are those of the rays
//! at the block's corners, and two by two nodes of the mipmap hold them. Sixteen slabs a block are looked at side by side;
//! those that are neither lit nor dark are cut in four once more. Only there do rays become segments.
//!
//! Under a perspective map a slab is what eight points span, so its bounds are theirs there too, as long as all of them lie
//! before the lamp.
//!
//! Bounds are computed in f32 between the block's two ends, which are computed in f64, and widened by more than that
//! rounds.

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::lanes::{Indices, Reals, clamped, index, real};
use super::ray_fan::Corners;
use super::tree_view::TreeView;
use crate::depth_codes::DepthCodes;
use crate::tree::FINEST;

/// Slabs of the first look; each that is mixed is cut in [`PARTS`].
const SLABS: u32 = 16;
/// Parts of a mixed slab.
const PARTS: u32 = 4;
/// All parts.
const ALL: u32 = SLABS * PARTS;

/// What bounds are widened by, of the largest number that they are computed from: eight times 2⁻²⁴, for a product and a
/// sum of numbers that were rounded.
const ROUNDING: f64 = 1.0 / (1u64 << 21) as f64;

/// What they are widened by in any case \[texels, codes\].
const LEAST_MARGIN: f64 = 0.02;

/// Least distance before the lamp's plane, of the largest one in the block, from which on a slab is looked at.
const BEFORE_LAMP: f32 = 1.0 / 1024.0;

/// What a slab is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Before all surfaces.
    Lit,
    /// Behind all surfaces.
    Dark,
    /// Some rays may be lit and some dark.
    Mixed,
}

/// Slabs in order; they tile the rays.
#[derive(Debug, Clone, Copy)]
pub struct Slabs {
    /// Where the first one begins \[the camera's depth\].
    from: f64,
    /// How deep each of [`ALL`] is.
    width: f64,
    /// Those that are lit, and those that are dark: a bit each.
    lit: u64,
    dark: u64,
}

/// A map and its mipmap, as slabs look at them.
#[derive(Clone, Copy)]
pub struct SlabView<'a> {
    /// The mipmap.
    pub tree: TreeView<'a>,
    /// Texels of the map.
    pub size: [u32; 2],
    /// How its depths are coded.
    pub codes: DepthCodes,
    /// Whether columns and rows are to be divided by the depth.
    pub perspective: bool,
}

impl Slabs {
    /// One slab of which nothing is known.
    pub const UNKNOWN: Self = Self { from: f64::NEG_INFINITY, width: f64::INFINITY, lit: 0, dark: 0 };

    /// Of a block whose rays are in the map between two depths.
    #[inline(always)]
    pub fn of<S: Simd>(simd: S, view: &SlabView<'_>, corners: &Corners, [from, to]: [f64; 2]) -> Self {
        let Some(block) = Block::new(view, corners, [from, to]) else { return Self::UNKNOWN };
        let number: Reals<S> = Reals::from_slice(simd, &NUMBERS);
        let coarse = block.classify(simd, view, number * (1.0 / SLABS as f32), 1.0 / SLABS as f32);
        let mut slabs = Self { from, width: (to - from) / f64::from(ALL), lit: 0, dark: 0 };
        let mut mixed = 0xFFFF & !(coarse[0] | coarse[1]);
        slabs.lit = spread(coarse[0]);
        slabs.dark = spread(coarse[1]);
        while mixed != 0 {
            // Four mixed ones are cut together.
            let (mut cut, mut firsts) = ([0u32; 4], [0.0f32; 16]);
            let mut count = 0;
            while count < 4 && mixed != 0 {
                cut[count] = mixed.trailing_zeros();
                mixed &= mixed - 1;
                count += 1;
            }
            for (part, first) in firsts.iter_mut().enumerate() {
                let slab = cut[(part / PARTS as usize).min(count - 1)];
                *first = (slab * PARTS + part as u32 % PARTS) as f32 * (1.0 / ALL as f32);
            }
            let fine = block.classify(simd, view, Reals::from_slice(simd, &firsts), 1.0 / ALL as f32);
            for (n, slab) in cut.iter().enumerate().take(count) {
                let place = PARTS * slab;
                slabs.lit |= (fine[0] >> (4 * n) & 0xF) << place;
                slabs.dark |= (fine[1] >> (4 * n) & 0xF) << place;
            }
        }
        slabs
    }

    /// With what is lit left to the rays themselves, unless nothing of the block is mixed: an interval that begins in a
    /// lit slab and ends in a mixed one is then one interval, where each is dear.
    #[inline(always)]
    pub fn with_whole_intervals(self) -> Self {
        if self.lit | self.dark == u64::MAX { self } else { Self { lit: 0, ..self } }
    }

    /// Kind, start and end of each, neighbours of one kind joined; the first one begins at −∞, and the last one ends at ∞:
    /// rays that end later by rounding belong to it.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (Kind, f64, f64)> {
        let (lit, dark) = (self.lit, self.dark);
        // Bit n: slab n is of another kind than slab n − 1.
        let mut changes = ((lit ^ (lit << 1)) | (dark ^ (dark << 1))) & !1;
        let (mut first, mut start) = (0, f64::NEG_INFINITY);
        let mut done = false;
        std::iter::from_fn(move || {
            if done {
                return None;
            }
            let kind = match (lit >> first & 1, dark >> first & 1) {
                (1, _) => Kind::Lit,
                (_, 1) => Kind::Dark,
                _ => Kind::Mixed,
            };
            let from = start;
            if changes == 0 {
                done = true;
                return Some((kind, from, f64::INFINITY));
            }
            first = changes.trailing_zeros();
            changes &= changes - 1;
            start = self.from + self.width * f64::from(first);
            Some((kind, from, start))
        })
    }
}

const NUMBERS: [f32; 16] =
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];

/// Each of sixteen bits four times.
#[inline(always)]
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 24) & 0x0000_00FF_0000_00FF;
    let bits = (bits | bits << 12) & 0x000F_000F_000F_000F;
    let bits = (bits | bits << 6) & 0x0303_0303_0303_0303;
    let bits = (bits | bits << 3) & 0x1111_1111_1111_1111;
    bits * 0xF
}

/// A block of rays between its two ends: what is linear in the share τ of the way between them.
struct Block {
    /// `[column, row, depth or code][corner]` at τ = 0, and how they grow to τ = 1.
    start: [[f32; 4]; 3],
    growth: [[f32; 4]; 3],
    /// What f32 may be wrong by in each.
    error: [f32; 3],
}

impl Block {
    /// None where a bound is not finite.
    #[inline(always)]
    fn new(view: &SlabView<'_>, corners: &Corners, [from, to]: [f64; 2]) -> Option<Self> {
        let mut block = Self { start: [[0.0; 4]; 3], growth: [[0.0; 4]; 3], error: [0.0; 3] };
        let [offset, scale] = if view.perspective { [0.0, 1.0] } else { view.codes.of_ray([0.0, 1.0]) };
        let mut finite = true;
        for axis in 0..3 {
            let [offset, scale] = if axis == 2 { [offset, scale] } else { [0.0, 1.0] };
            let mut most = 0.0f64;
            for corner in 0..4 {
                let (start, step) = (corners.start[axis][corner], corners.step[axis][corner]);
                let first = offset + (start + from * step) * scale;
                let last = offset + (start + to * step) * scale;
                most = most.max(first.abs()).max(last.abs());
                block.start[axis][corner] = first as f32;
                block.growth[axis][corner] = (last - first) as f32;
                finite &= first.abs() < 1e15 && last.abs() < 1e15;
            }
            block.error[axis] = (most * ROUNDING) as f32;
        }
        finite.then_some(block)
    }

    /// Which of the slabs that begin at τ = `first` and are `width` deep are lit, and which are dark.
    #[inline(always)]
    fn classify<S: Simd>(&self, simd: S, view: &SlabView<'_>, first: Reals<S>, width: f32) -> [u64; 2] {
        let ends = [first, first + width];
        let mut known = 0xFFFF;
        let bounds = if view.perspective {
            let (bounds, before_lamp) = self.bounds_in_perspective(simd, view, &ends);
            known &= before_lamp;
            bounds
        } else {
            let mut bounds = [[real(simd, 0.0); 2]; 3];
            for (axis, bound) in bounds.iter_mut().enumerate() {
                let mut least = real(simd, f32::INFINITY);
                let mut most = real(simd, f32::NEG_INFINITY);
                for corner in 0..4 {
                    for end in ends {
                        let value = self.at(simd, end, axis, corner);
                        least = least.min(value);
                        most = most.max(value);
                    }
                }
                let margin = self.error[axis] + LEAST_MARGIN as f32;
                *bound = [least - margin, most + margin];
            }
            bounds
        };
        let mut texels = [[index(simd, 0); 2]; 2];
        for axis in 0..2 {
            let last = real(simd, (view.size[axis] - 1) as f32);
            for end in 0..2 {
                texels[axis][end] = bounds[axis][end].max(real(simd, 0.0)).min(last).to_int();
            }
        }
        let [i, j] = texels;
        let extent = (i[1] - i[0]).max(j[1] - j[0]) | ((1 << FINEST) - 1);
        // The finest level of which two blocks a side hold that many texels and one: from the exponent of a float.
        let level = (extent.to_float::<Reals<S>>().bitcast::<Indices<S>>() >> 23) - 126;
        known &= level.simd_le(index(simd, view.tree.coarsest)).to_bitmask();
        let level = level.max(index(simd, FINEST as i32)).min(index(simd, view.tree.coarsest));
        let (i, j) = ([i[0] >> level, i[1] >> level], [j[0] >> level, j[1] >> level]);
        let a = view.tree.fetch(simd, view.tree.places(simd, level, [i[0], j[0]]));
        let b = view.tree.fetch(simd, view.tree.places(simd, level, [i[1], j[0]]));
        let c = view.tree.fetch(simd, view.tree.places(simd, level, [i[0], j[1]]));
        let d = view.tree.fetch(simd, view.tree.places(simd, level, [i[1], j[1]]));
        let nearest = a[0].min(b[0]).min(c[0].min(d[0]));
        let farthest = a[1].max(b[1]).max(c[1].max(d[1]));
        let least = clamped(simd, bounds[2][0]);
        let most = clamped(simd, bounds[2][1]);
        let lit = known & most.simd_le(nearest).to_bitmask();
        [lit, known & !lit & least.simd_ge(farthest).to_bitmask()]
    }

    /// One coordinate of a corner's ray at τ.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, end: Reals<S>, axis: usize, corner: usize) -> Reals<S> {
        end.mul_add(real(simd, self.growth[axis][corner]), real(simd, self.start[axis][corner]))
    }

    /// Bounds under a perspective map, and which slabs lie before the lamp as a whole.
    #[inline(always)]
    fn bounds_in_perspective<S: Simd>(
        &self,
        simd: S,
        view: &SlabView<'_>,
        ends: &[Reals<S>; 2],
    ) -> ([[Reals<S>; 2]; 3], u64) {
        let (mut nearest, mut inverse_most) = (real(simd, f32::INFINITY), real(simd, 0.0));
        let mut inverse_least = real(simd, f32::INFINITY);
        let mut bounds = [[real(simd, f32::INFINITY), real(simd, f32::NEG_INFINITY)]; 3];
        for corner in 0..4 {
            for end in ends {
                let u = self.at(simd, *end, 0, corner);
                let v = self.at(simd, *end, 1, corner);
                let w = self.at(simd, *end, 2, corner);
                let inverse = 1.0 / w;
                nearest = nearest.min(w);
                inverse_least = inverse_least.min(inverse);
                inverse_most = inverse_most.max(inverse);
                for (bound, value) in bounds.iter_mut().zip([u * inverse, v * inverse]) {
                    *bound = [bound[0].min(value), bound[1].max(value)];
                }
            }
        }
        // Errors of u and of w, both over the least w; a quotient that counts is at most the map's size.
        let depth_error = self.error[2];
        for ((bound, error), size) in bounds.iter_mut().zip(self.error).zip(view.size) {
            let error = error + depth_error * size as f32;
            let margin = inverse_most * error + LEAST_MARGIN as f32;
            *bound = [bound[0] - margin, bound[1] + margin];
        }
        let [offset, scale] = view.codes.of_ray([0.0, 1.0]).map(|value| value as f32);
        let relative = inverse_most * depth_error + ROUNDING as f32;
        let margin = inverse_most * relative * scale + (offset.abs() * ROUNDING as f32 + LEAST_MARGIN as f32);
        bounds[2] = [
            real(simd, offset) - inverse_most * scale - margin,
            real(simd, offset) - inverse_least * scale + margin,
        ];
        let farthest = depth_error / ROUNDING as f32;
        (bounds, nearest.simd_gt(real(simd, farthest * BEFORE_LAMP)).to_bitmask())
    }
}
