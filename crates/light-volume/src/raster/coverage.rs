//! Which rays of a block cross which faces: sixteen rays at a time, by the order of numbers alone.
//!
//! A ray crosses a texel's border or a depth at **one** number of f32, computed from that border's own index, whoever asks.
//! What a ray passes is the order of these numbers (columns before rows before depths where they tie), and a face is crossed
//! if the crossing with its plane comes after the ray has entered the face's span along both other axes and before it leaves
//! them:
//!
//! ```text
//! column wall   rows:   first < s ≤ last      depths: first < s ≤ last
//! row wall      columns: first ≤ s < last     depths: first < s ≤ last
//! cap           columns: first ≤ s < last     rows:   first ≤ s < last
//! ```
//!
//! So no edge needs a rule of its own: two faces that meet in an edge ask the same two numbers, and exactly one of those around
//! it that a ray can leave by is crossed. Rounding may let a ray pass an edge on the other side; it never lets one through.
//! The paper leaves this to the hardware's top-left rule.
//!
//! The crossing's depth is then solved in f64 ([`BlockRays::depth_of`]).

use fearless_simd::Simd;
use fearless_simd::prelude::*;

use super::block_rays::{BlockRays, RAYS};
use super::candidates::Candidate;
use super::crossings::{Crossing, Crossings};
use super::ray_group::{BlockBeams, LANES, RayGroup, Wide};
use crate::volume::{Axis, Chunk, SteppedVolume, code_of};

/// Writes down which rays of a block cross the faces of a patch of a layer; returns how many faces the block's beam met.
#[inline(always)]
pub fn cross<S: Simd>(
    simd: S,
    (volume, layer, perspective): (&SteppedVolume, u8, bool),
    candidate: &Candidate,
    (rays, beams): (&BlockRays, &BlockBeams),
    crossings: &mut Crossings,
) -> u64 {
    let mut met = 0;
    for chunk in volume.faces(candidate.place[1], volume.patch(candidate.place)) {
        let (boxes, codes) = boxes_of(chunk, perspective);
        let mut faces = beams.block.crosses_sixteen(simd, &boxes) & ((1u64 << chunk.count) - 1);
        met += u64::from(faces.count_ones());
        let by_sixteens = beams.crosses_by_sixteens(simd, &boxes, faces);
        while faces != 0 {
            let index = faces.trailing_zeros() as usize;
            faces &= faces - 1;
            let rectangle = Rectangle {
                columns: [boxes[0][index], boxes[1][index]],
                rows: [boxes[2][index], boxes[3][index]],
                codes: [boxes[4][index], boxes[5][index]],
            };
            let sign = if codes[1][index] < codes[0][index] { 1 } else { -1 };
            for (n, first) in (0..RAYS).step_by(LANES).enumerate() {
                if by_sixteens[n] >> index & 1 == 0 {
                    continue;
                }
                let group = RayGroup::load(simd, rays, first);
                let mut sink = Sink { rays, group: first, layer, crossings };
                match chunk.axis[index] {
                    Axis::Column => cross_wall::<S, true>(simd, &group, &rectangle, sign, &mut sink),
                    Axis::Row => cross_wall::<S, false>(simd, &group, &rectangle, sign, &mut sink),
                    Axis::Depth => {
                        let depth = f64::from(chunk.depth[0][index]);
                        let at = if perspective { -1.0 / depth } else { depth };
                        cross_cap(simd, &group, &rectangle, at, &mut sink);
                    }
                }
            }
        }
    }
    met
}

/// The first and last column, row and code of the faces of a chunk, and the codes before and behind each.
#[inline(always)]
fn boxes_of(chunk: &Chunk, perspective: bool) -> ([[f32; LANES]; 6], [[f32; LANES]; 2]) {
    let mut boxes = [[0.0; LANES]; 6];
    let mut codes = [[0.0; LANES]; 2];
    for (code, depth) in codes.iter_mut().zip(&chunk.depth) {
        for lane in 0..LANES {
            code[lane] = code_of(depth[lane], perspective);
        }
    }
    for axis in 0..2 {
        let (borders, extents) = (&chunk.first[axis], &chunk.extent[axis]);
        for (lane, (border, extent)) in borders.iter().zip(extents).enumerate() {
            let first = chunk.origin[axis] + f32::from(*border);
            boxes[2 * axis][lane] = first;
            boxes[2 * axis + 1][lane] = first + f32::from(*extent);
        }
    }
    for (lane, (before, behind)) in codes[0].iter().zip(&codes[1]).enumerate() {
        boxes[4][lane] = before.min(*behind);
        boxes[5][lane] = before.max(*behind);
    }
    (boxes, codes)
}

/// A face in texels and codes.
struct Rectangle {
    columns: [f32; 2],
    rows: [f32; 2],
    codes: [f32; 2],
}

#[inline(always)]
fn cross_cap<S: Simd>(simd: S, group: &RayGroup<S>, cap: &Rectangle, at: f64, sink: &mut Sink<'_>) {
    let s = group.crossing(simd, 2, cap.codes[0]);
    let mut hits = s.simd_gt(Wide::splat(simd, 0.0)) & s.simd_lt(group.end);
    for (axis, [first, last]) in [(0, cap.columns), (1, cap.rows)] {
        let (a, b) = (group.crossing(simd, axis, first), group.crossing(simd, axis, last));
        hits &= a.min(b).simd_le(s) & s.simd_lt(a.max(b));
    }
    let hits = hits.to_bitmask();
    if hits != 0 {
        sink.push(hits, 2, (at, s.to_array()), 1);
    }
}

#[inline(always)]
fn cross_wall<S: Simd, const COLUMN: bool>(
    simd: S,
    group: &RayGroup<S>,
    wall: &Rectangle,
    sign: i8,
    sink: &mut Sink<'_>,
) {
    let (axis, at) = if COLUMN { (0, wall.columns[0]) } else { (1, wall.rows[0]) };
    let (other, [first, last]) = if COLUMN { (1, wall.rows) } else { (0, wall.columns) };
    let s = group.crossing(simd, axis, at);
    let (a, b) = (group.crossing(simd, other, first), group.crossing(simd, other, last));
    let (c, d) = (group.crossing(simd, 2, wall.codes[0]), group.crossing(simd, 2, wall.codes[1]));
    // Of ties columns come first, then rows, then depths.
    let within = if COLUMN {
        a.min(b).simd_lt(s) & s.simd_le(a.max(b))
    } else {
        a.min(b).simd_le(s) & s.simd_lt(a.max(b))
    };
    let hits = within
        & c.min(d).simd_lt(s)
        & s.simd_le(c.max(d))
        & s.simd_gt(Wide::splat(simd, 0.0))
        & s.simd_lt(group.end);
    let hits = hits.to_bitmask();
    if hits != 0 {
        sink.push(hits, axis, (f64::from(at), s.to_array()), sign);
    }
}

/// Where crossings go.
struct Sink<'a> {
    rays: &'a BlockRays,
    group: usize,
    layer: u8,
    crossings: &'a mut Crossings,
}

impl Sink<'_> {
    /// Rays whose bits are set cross the plane `at`; `sign` is that of a ray towards larger numbers.
    #[inline(always)]
    fn push(&mut self, mut hits: u64, axis: usize, (at, s): (f64, [f32; LANES]), sign: i8) {
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let ray = self.group + lane;
            let rises = self.rays.inverse[axis][ray] > 0.0;
            self.crossings.push(Crossing {
                depth: self.rays.depth_of(ray, axis, at),
                s: s[lane],
                ray: ray as u8,
                layer: self.layer,
                axis: axis as u8,
                sign: if rises { sign } else { -sign },
            });
        }
    }
}
