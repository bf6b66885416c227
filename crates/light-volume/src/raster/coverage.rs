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

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::block_rays::{BlockRays, RAYS};
use super::candidates::{Candidate, code_of};
use super::crossings::{Crossing, Crossings};
use crate::volume::{Axis, Face, SteppedVolume};

/// Rays that are tested side by side.
const LANES: usize = 16;

/// A number for each ray.
type Wide<S> = f32x16<S>;

/// Sixteen rays of a block.
struct Group<S: Simd> {
    start: [Wide<S>; 3],
    inverse: [Wide<S>; 3],
    end: Wide<S>,
}

impl<S: Simd> Group<S> {
    #[inline(always)]
    fn load(simd: S, rays: &BlockRays, first: usize) -> Self {
        let load = |values: &[f32; RAYS]| Wide::from_slice(simd, &values[first..first + LANES]);
        Self {
            start: [load(&rays.start[0]), load(&rays.start[1]), load(&rays.start[2])],
            inverse: [load(&rays.inverse[0]), load(&rays.inverse[1]), load(&rays.inverse[2])],
            end: load(&rays.end),
        }
    }

    /// Where the rays cross a border or a code.
    #[inline(always)]
    fn crossing(&self, simd: S, axis: usize, at: f32) -> Wide<S> {
        (Wide::splat(simd, at) - self.start[axis]) * self.inverse[axis]
    }
}

/// Writes down which rays of a block cross the faces of a patch of a layer; returns how many faces were tested.
#[inline(always)]
pub fn cross<S: Simd>(
    simd: S,
    (volume, layer, perspective): (&SteppedVolume, u8, bool),
    candidate: &Candidate,
    rays: &BlockRays,
    crossings: &mut Crossings,
) -> u64 {
    let faces = |axis| volume.faces(candidate.place[1], &candidate.patch, axis);
    let (caps, columns, rows) = (faces(Axis::Depth), faces(Axis::Column), faces(Axis::Row));
    for first in (0..RAYS).step_by(LANES) {
        let group = Group::load(simd, rays, first);
        let mut sink = Sink { rays, group: first, layer, crossings };
        cross_caps(simd, &group, caps, perspective, &mut sink);
        cross_walls::<S, true>(simd, &group, columns, perspective, &mut sink);
        cross_walls::<S, false>(simd, &group, rows, perspective, &mut sink);
    }
    (caps.len() + columns.len() + rows.len()) as u64
}

#[inline(always)]
fn cross_caps<S: Simd>(simd: S, group: &Group<S>, faces: &[Face], perspective: bool, sink: &mut Sink<'_>) {
    let zero = Wide::splat(simd, 0.0);
    for face in faces {
        let rectangle = face.rectangle(Axis::Depth);
        let code = code_of(rectangle.at, perspective);
        let s = group.crossing(simd, 2, code);
        let mut hits = s.simd_gt(zero) & s.simd_lt(group.end);
        for (axis, [first, last]) in [(0, rectangle.first), (1, rectangle.second)] {
            let (a, b) = (group.crossing(simd, axis, first), group.crossing(simd, axis, last));
            hits &= a.min(b).simd_le(s) & s.simd_lt(a.max(b));
        }
        let hits = hits.to_bitmask();
        if hits != 0 {
            let at = f64::from(rectangle.at);
            sink.push(hits, 2, if perspective { -1.0 / at } else { at }, 1);
        }
    }
}

#[inline(always)]
fn cross_walls<S: Simd, const COLUMN: bool>(
    simd: S,
    group: &Group<S>,
    faces: &[Face],
    perspective: bool,
    sink: &mut Sink<'_>,
) {
    let zero = Wide::splat(simd, 0.0);
    let (axis, other) = if COLUMN { (0, 1) } else { (1, 0) };
    for face in faces {
        let rectangle = face.rectangle(if COLUMN { Axis::Column } else { Axis::Row });
        let s = group.crossing(simd, axis, rectangle.at);
        let [first, last] = rectangle.first;
        let (a, b) = (group.crossing(simd, other, first), group.crossing(simd, other, last));
        let [near, far] = rectangle.second.map(|depth| code_of(depth, perspective));
        let (c, d) = (group.crossing(simd, 2, near), group.crossing(simd, 2, far));
        // Of ties columns come first, then rows, then depths.
        let within = if COLUMN {
            a.min(b).simd_lt(s) & s.simd_le(a.max(b))
        } else {
            a.min(b).simd_le(s) & s.simd_lt(a.max(b))
        };
        let hits =
            within & c.min(d).simd_lt(s) & s.simd_le(c.max(d)) & s.simd_gt(zero) & s.simd_lt(group.end);
        let hits = hits.to_bitmask();
        if hits != 0 {
            sink.push(hits, axis, f64::from(rectangle.at), rectangle.sign);
        }
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
    fn push(&mut self, mut hits: u64, axis: usize, at: f64, sign: i8) {
        while hits != 0 {
            let ray = self.group + hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let depth = self.rays.depth_of(ray, axis, at);
            let rises = self.rays.inverse[axis][ray] > 0.0;
            self.crossings.push(Crossing {
                depth,
                ray: ray as u8,
                layer: self.layer,
                sign: if rises { sign } else { -sign },
            });
        }
    }
}
