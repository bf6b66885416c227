//! Segments through the quadtree, sixteen side by side: which stretches are lit, and which blocks of texels must be looked
//! at one by one.
//!
//! ```text
//!     for each lane:  block ← that of its level which holds its texel
//!                     e     ← where it leaves the block, or its end
//!         codes of the ray ≤ nearest of the block:  lit from s to e       (joined with what was lit up to s)
//!         codes of the ray ≥ farthest:              dark
//!         else, above the finest level:             a level down, and again
//!         else:                                     write the block down
//!         go on at e, in the next block; a level up where that is another parent's
//! ```
//!
//! 1. No lane branches. Two packets take turns, so that one computes while the other waits for its nodes (1.28 times as fast
//!    as one in the prototype, where a third added nothing).
//! 2. Lanes that are done are refilled when a third of a packet is.
//! 3. Cells advance by integer indices. A border's parameter is computed from its index relative to the segment's first
//!    texel; the index on the other axis is clamped to the block that is left, and never turns back.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::{Answers, Indices, Reals, clamped, first_lanes, index, real};
use super::queues::{Blocks, Runs};
use super::ray_fan::LANES;
use super::segment::{Columns, Segment, Word};
use super::tree_view::TreeView;
use crate::tree::FINEST;

/// Packets that take turns.
const PACKETS: usize = 2;

/// Dead lanes from which on a packet is refilled: fewer cost more set-up, more idle lanes (8 is 2 % slower).
const REFILL: u32 = 5;

/// Segments on their way through a tree.
pub struct Packets<S: Simd> {
    packets: [Packet<S>; PACKETS],
    next: usize,
    /// The level where segments enter the tree.
    start: i32,
    /// Nodes that were looked at.
    pub nodes: u64,
}

impl<S: Simd> Packets<S> {
    /// None on their way yet; all will enter the tree at that level.
    #[inline(always)]
    pub fn new(simd: S, start: i32) -> Self {
        Self { packets: [Packet::new(simd); PACKETS], next: 0, start, nodes: 0 }
    }

    /// Goes on through the `count` first of the segments (sixteen more must follow them) until a list is full; true when all
    /// are through.
    #[inline(always)]
    pub fn advance(
        &mut self,
        simd: S,
        tree: &TreeView<'_>,
        segments: &[Segment],
        count: usize,
        (blocks, runs): (&mut Blocks, &mut Runs),
    ) -> bool {
        loop {
            let mut live = false;
            for packet in &mut self.packets {
                if self.next < count && LANES as u32 - packet.live.to_bitmask().count_ones() >= REFILL {
                    packet.refill(simd, self.start, segments, count, &mut self.next, runs);
                }
                let bits = packet.live.to_bitmask();
                live |= bits != 0;
                self.nodes += u64::from(bits.count_ones());
                packet.step(simd, tree, blocks, runs);
            }
            if !live {
                for packet in &mut self.packets {
                    packet.end_runs(runs, Answers::splat(simd, true));
                }
                return true;
            }
            if blocks.is_full() || runs.is_full() {
                return false;
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Packet<S: Simd> {
    live: Answers<S>,
    segment: u32x16<S>,
    /// The texel where each ray is, mirrored, and the level of its block.
    texel: [Indices<S>; 2],
    level: Indices<S>,
    /// What does not change along a segment ([`Word`]).
    first: [Indices<S>; 2],
    mirror: [Indices<S>; 2],
    place: [Reals<S>; 2],
    step: [Reals<S>; 2],
    per: [Reals<S>; 2],
    before: [Reals<S>; 2],
    code_at_start: Reals<S>,
    code_step: Reals<S>,
    end: Reals<S>,
    /// Where each ray is, and its code there.
    s: Reals<S>,
    code: Reals<S>,
    /// The lit run that may go on.
    lit: [Reals<S>; 2],
}

impl<S: Simd> Packet<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let (none, zero) = (index(simd, 0), real(simd, 0.0));
        Self {
            live: Answers::splat(simd, false),
            segment: u32x16::splat(simd, 0),
            texel: [none; 2],
            level: none,
            first: [none; 2],
            mirror: [none; 2],
            place: [zero; 2],
            step: [zero; 2],
            per: [zero; 2],
            before: [zero; 2],
            code_at_start: zero,
            code_step: zero,
            end: zero,
            s: zero,
            code: zero,
            lit: [zero; 2],
        }
    }

    /// Writes down the runs of these lanes.
    #[inline(always)]
    fn end_runs(&mut self, runs: &mut Runs, lanes: Answers<S>) {
        let [from, to] = self.lit;
        runs.push(lanes & to.simd_gt(from), self.segment, from, to);
        self.lit[1] = lanes.select(from, to);
    }

    /// Gives the next segments to lanes that are done.
    #[inline(always)]
    fn refill(
        &mut self,
        simd: S,
        start: i32,
        segments: &[Segment],
        count: usize,
        next: &mut usize,
        runs: &mut Runs,
    ) {
        let dead = !self.live;
        self.end_runs(runs, dead);
        let left = count - *next;
        let wanted = dead.to_bitmask().count_ones() as usize;
        let columns = Columns::from(simd, segments, *next);
        // Of the lanes that are done, as many as there are segments left.
        let numbers = Indices::from_slice(simd, &NUMBERS);
        let ranks = numbers.expand_merge(dead, index(simd, LANES as i32));
        let filled = dead & ranks.simd_lt(index(simd, left as i32));
        macro_rules! fill {
            ($($old:expr => $new:expr),+ $(,)?) => { $($old = $new.expand_merge(filled, $old);)+ };
        }
        let (texel, mirror) = (columns.pair(Word::Texel), columns.pair(Word::Mirror));
        let number: u32x16<S> = (numbers + *next as i32).bitcast();
        let zero = real(simd, 0.0);
        fill!(
            self.segment => number,
            self.texel[0] => texel[0],
            self.texel[1] => texel[1],
            self.mirror[0] => mirror[0],
            self.mirror[1] => mirror[1],
            self.place[0] => columns.real(Word::PlaceU),
            self.place[1] => columns.real(Word::PlaceV),
            self.step[0] => columns.real(Word::StepU),
            self.step[1] => columns.real(Word::StepV),
            self.per[0] => columns.real(Word::PerU),
            self.per[1] => columns.real(Word::PerV),
            self.before[0] => columns.real(Word::BorderU),
            self.before[1] => columns.real(Word::BorderV),
            self.code_at_start => columns.real(Word::Code),
            self.code_step => columns.real(Word::CodeStep),
            self.end => columns.real(Word::End),
        );
        for axis in 0..2 {
            self.first[axis] = filled.select(self.texel[axis], self.first[axis]);
            self.lit[axis] = filled.select(zero, self.lit[axis]);
        }
        self.level = filled.select(index(simd, start), self.level);
        self.s = filled.select(zero, self.s);
        self.code = filled.select(clamped(simd, self.code_at_start), self.code);
        self.live |= filled;
        *next += wanted.min(left);
    }

    /// Takes every lane to its next block, or a level down.
    #[inline(always)]
    fn step(&mut self, simd: S, tree: &TreeView<'_>, blocks: &mut Blocks, runs: &mut Runs) {
        let level = self.level;
        // 2^level − 1.
        let within = index(simd, i32::MAX) >> (31 - level);
        // The last texel of the block, where the ray leaves it, on both axes.
        let last = [self.texel[0] | within, self.texel[1] | within];
        let borders = [self.border(&last, 0), self.border(&last, 1)];
        let end = borders[0].min(borders[1]).min(self.end);

        let column = (self.texel[0] ^ self.mirror[0]) >> level;
        let row = (self.texel[1] ^ self.mirror[1]) >> level;
        let [nearest, farthest] = tree.fetch(simd, tree.places(simd, level, [column, row]));
        let code = clamped(simd, end.mul_add(self.code_step, self.code_at_start));
        let is_lit = self.live & self.code.max(code).simd_le(nearest);
        let is_dark = self.live & self.code.min(code).simd_ge(farthest);

        let adds = is_lit & end.simd_gt(self.s);
        let starts = adds & !self.s.simd_eq(self.lit[1]);
        let [from, to] = self.lit;
        runs.push(starts & to.simd_gt(from), self.segment, from, to);
        self.lit = [starts.select(self.s, from), adds.select(end, to)];

        let by_columns = borders[0].simd_le(borders[1]);
        let next = [
            by_columns.select(last[0] + 1, self.follow(&last, end, 0)),
            by_columns.select(self.follow(&last, end, 1), last[1] + 1),
        ];
        let mixed = self.live & !(is_lit | is_dark);
        let is_finest = mixed & level.simd_le(index(simd, FINEST as i32));
        let texels: u32x16<S> = (self.texel[0] | (self.texel[1] << 16)).bitcast();
        let passed: u32x16<S> = ((next[0] - self.texel[0]) + (next[1] - self.texel[1])).bitcast();
        blocks.push(is_finest, (self.segment, passed), texels, self.s, end);

        let leaves = is_lit | is_dark | is_finest;
        let crossed = (self.texel[0] ^ next[0]) | (self.texel[1] ^ next[1]);
        let another = (crossed >> (level + 1)).simd_gt(index(simd, 0));
        let up = leaves & another & level.simd_lt(index(simd, tree.coarsest));
        let level = up.select(level + 1, level);
        self.level = (mixed & !is_finest).select(level - 1, level);
        self.texel = [leaves.select(next[0], self.texel[0]), leaves.select(next[1], self.texel[1])];
        self.s = leaves.select(end, self.s);
        self.code = leaves.select(code, self.code);
        let off = next[0].simd_ge(index(simd, tree.sides[0])) | next[1].simd_ge(index(simd, tree.sides[1]));
        self.live &= !(leaves & (off | end.simd_ge(self.end)));
    }
}

impl<S: Simd> Packet<S> {
    /// Where the border behind the last texel of a block is on each ray.
    #[inline(always)]
    fn border(&self, last: &[Indices<S>; 2], axis: usize) -> Reals<S> {
        let texels: Reals<S> = (last[axis] + 1 - self.first[axis]).to_float();
        texels.mul_add(self.per[axis], self.before[axis])
    }

    /// The texel at `end` on the axis that is not left: inside of the block, and not behind the one before.
    #[inline(always)]
    fn follow(&self, last: &[Indices<S>; 2], end: Reals<S>, axis: usize) -> Indices<S> {
        let texels: Indices<S> = end.mul_add(self.step[axis], self.place[axis]).to_int();
        (texels + self.first[axis]).min(last[axis]).max(self.texel[axis])
    }
}

const NUMBERS: [i32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// For lists of segments: what follows the last one.
pub const PADDING: [Segment; LANES] = [[0; LANES]; LANES];

/// The first lanes of a packet, for lists that end within one.
#[inline(always)]
pub fn lanes_until<S: Simd>(simd: S, at: usize, count: usize) -> Answers<S> {
    first_lanes(simd, count.saturating_sub(at))
}
