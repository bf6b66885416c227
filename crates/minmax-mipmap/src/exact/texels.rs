//! Blocks of 4×4 texels, texel by texel, sixteen side by side: where each ray is lit, by its crossing with each depth.
//!
//! The same walk as over nodes with one level, and without codes: a texel is lit up to (or from) where the ray has its
//! depth. Indices, borders and the end of the block are computed as the packets do it, so both agree to the last bit on
//! where a block ends.
//!
//! One group at a time: no texel that is read decides which one is next, so loads of the next step start before those of
//! this one arrive. Two groups that took turns were 4 to 6 % slower.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};
use scatter_core::ShadowLayer;

use super::lanes::{Answers, Indices, Reals, index, real};
use super::packets::lanes_until;
use super::queues::{Blocks, Runs};
use super::ray_fan::LANES;
use super::segment::{Columns, Segment, Word};

/// A layer's texels as lanes read them.
#[derive(Clone, Copy)]
pub struct TexelView<'a> {
    texels: &'a [f32],
    last: [i32; 2],
    width: i32,
    perspective: bool,
    sides: [i32; 2],
}

impl<'a> TexelView<'a> {
    /// Of a layer.
    pub fn new(layer: &ShadowLayer<'a>, sides: [u32; 2]) -> Self {
        let size = layer.projection().size().map(|n| n as i32);
        Self {
            texels: layer.texels(),
            last: size.map(|n| n - 1),
            width: size[0],
            perspective: layer.projection().is_perspective(),
            sides: sides.map(|side| side as i32),
        }
    }

    #[inline(always)]
    fn fetch<S: Simd>(&self, simd: S, [i, j]: [Indices<S>; 2]) -> Reals<S> {
        let (i, j) = (i.min(index(simd, self.last[0])), j.min(index(simd, self.last[1])));
        let at: u32x16<S> = (j * index(simd, self.width) + i).bitcast();
        // As u32: a map of more than 2³¹ texels wraps around to its right index.
        let at = at.min(self.texels.len() as u32 - 1).to_array();
        let mut texels = [0.0; LANES];
        for lane in 0..LANES {
            texels[lane] = self.texels[at[lane] as usize];
        }
        Reals::load_array(simd, texels)
    }
}

/// Works off blocks from number `at` on until the runs are full, and says how far it came; counts texels.
#[inline(always)]
pub fn look_closely<S: Simd>(
    simd: S,
    view: &TexelView<'_>,
    segments: &[Segment],
    blocks: &Blocks,
    mut at: usize,
    runs: &mut Runs,
    texels: &mut u64,
) -> usize {
    let count = blocks.len();
    while at < count && !runs.is_full() {
        let lanes = lanes_until(simd, at, count);
        let mut group = Group::new(simd, segments, blocks, at, lanes);
        loop {
            *texels += u64::from(group.live.to_bitmask().count_ones());
            group.step(simd, view, runs);
            if !group.live.any_true() {
                break;
            }
        }
        let [from, to] = group.lit;
        runs.push(lanes & to.simd_gt(from), group.segment, from, to);
        at += LANES;
    }
    at
}

#[derive(Clone, Copy)]
struct Group<S: Simd> {
    live: Answers<S>,
    segment: u32x16<S>,
    texel: [Indices<S>; 2],
    first: [Indices<S>; 2],
    mirror: [Indices<S>; 2],
    per: [Reals<S>; 2],
    before: [Reals<S>; 2],
    depth: Reals<S>,
    depth_rest: Reals<S>,
    per_depth: Reals<S>,
    deepens: Answers<S>,
    s: Reals<S>,
    end: Reals<S>,
    lit: [Reals<S>; 2],
}

impl<S: Simd> Group<S> {
    #[inline(always)]
    fn new(simd: S, segments: &[Segment], blocks: &Blocks, at: usize, live: Answers<S>) -> Self {
        let [numbers, texels] = blocks.sixteen(at);
        let [from, to] = blocks.parts(at);
        let (from, to) = (Reals::from_slice(simd, from), Reals::from_slice(simd, to));
        let columns = Columns::gathered(simd, segments, numbers);
        let texel = u32x16::from_slice(simd, texels);
        let per_depth = columns.real(Word::PerDepth);
        Self {
            live,
            segment: u32x16::from_slice(simd, numbers),
            texel: [(texel & 0xFFFF).bitcast(), (texel >> 16).bitcast()],
            first: columns.pair(Word::Texel),
            mirror: columns.pair(Word::Mirror),
            per: [columns.real(Word::PerU), columns.real(Word::PerV)],
            before: [columns.real(Word::BorderU), columns.real(Word::BorderV)],
            depth: columns.real(Word::Depth),
            depth_rest: columns.real(Word::DepthRest),
            per_depth,
            deepens: per_depth.simd_gt(real(simd, 0.0)),
            s: from,
            end: to,
            lit: [from; 2],
        }
    }

    /// Where the border behind the texel is on each ray.
    #[inline(always)]
    fn border(&self, axis: usize) -> Reals<S> {
        let texels: Reals<S> = (self.texel[axis] + 1 - self.first[axis]).to_float();
        texels.mul_add(self.per[axis], self.before[axis])
    }

    #[inline(always)]
    fn step(&mut self, simd: S, view: &TexelView<'_>, runs: &mut Runs) {
        let surface = view.fetch(simd, [self.texel[0] ^ self.mirror[0], self.texel[1] ^ self.mirror[1]]);
        let borders = [self.border(0), self.border(1)];
        let end = borders[0].min(borders[1]).min(self.end);
        let crossing = if view.perspective {
            // No surface is one so far away that the quotient is its limit.
            let surface = surface.min(real(simd, 1e30));
            ((surface - self.depth) - self.depth_rest) / surface * self.per_depth
        } else {
            ((surface - self.depth) - self.depth_rest) * self.per_depth
        };
        let from = self.deepens.select(self.s, self.s.max(crossing));
        let to = self.deepens.select(end.min(crossing), end);

        let adds = self.live & to.simd_gt(from);
        let starts = adds & !from.simd_eq(self.lit[1]);
        let [run, run_end] = self.lit;
        runs.push(starts & run_end.simd_gt(run), self.segment, run, run_end);
        self.lit = [starts.select(from, run), adds.select(to, run_end)];

        let by_columns = borders[0].simd_le(borders[1]);
        self.texel = [
            by_columns.select(self.texel[0] + 1, self.texel[0]),
            by_columns.select(self.texel[1], self.texel[1] + 1),
        ];
        self.s = end;
        let on = self.texel[0].simd_lt(index(simd, view.sides[0]))
            & self.texel[1].simd_lt(index(simd, view.sides[1]));
        self.live &= on & end.simd_lt(self.end);
    }
}
