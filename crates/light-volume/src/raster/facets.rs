//! Which rays of a block cross the facets of an interpolated surface.
//!
//! As in `coverage.rs` a ray crosses each border of a facet at one number, whoever asks. The ray's height against the surface is
//! asked where it crosses edges of triangles, from the edge's own two vertices: two triangles that share an edge get the same
//! number, so a ray is on the same side when it leaves one as when it enters the other. Which of the two edges of a stitched side it
//! crosses follows from the order of numbers, as it does for the two finer facets beyond; and the edges inside of a facet follow from
//! the sides by which it comes in and goes out (`volume::stitching`). Between two edges with different signs it crosses the triangle,
//! at the root in f64; where depths jump, a facet in whose shadow the ray enters or leaves has a wall.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use scatter_core::ShadowLayer;

use super::block_rays::{BlockRays, RAYS};
use super::candidates::Candidate;
use super::crossings::{Crossing, Crossings};
use super::ray_group::{BlockBeams, LANES, RayGroup, Wide, lanes};
use crate::volume::stitching::{PLACES, STITCHINGS, Stitching};
use crate::volume::{Facet, HeightField};

/// How far beyond the depths of a facet's vertices a ray must stay for none of its edges to be asked, as a share of their spread and of
/// the numbers themselves: what rounding makes of a height against an edge is far less.
const ASIDE: [f32; 2] = [0.25, 4e-6];

/// Whether a ray starts behind a facet that it starts over.
pub fn starts_behind(facet: &Facet, rays: &BlockRays, ray: usize) -> bool {
    Divided::new(facet).at_start(rays, ray).1 > 0.0
}

/// Writes down which rays of a block cross the facets of a patch of cells; returns how many facets the block's beam met.
#[inline(always)]
pub fn cross_facets<S: Simd>(
    simd: S,
    (field, map, layer, perspective): (&HeightField, &ShadowLayer<'_>, u8, bool),
    candidate: &Candidate,
    (rays, beams): (&BlockRays, &BlockBeams),
    crossings: &mut Crossings,
) -> u64 {
    // A wall reaches to infinity.
    let open = if perspective { 0.0 } else { f32::INFINITY };
    let mut met = 0;
    for packed in field.facets(candidate.place).chunks(LANES) {
        let mut boxes = [[0.0f32; LANES]; 6];
        let mut facets = [Facet::NONE; LANES];
        for (lane, packed) in packed.iter().enumerate() {
            let facet = packed.unpacked(map, candidate.place);
            let [least, most] = facet.spread();
            boxes[0][lane] = facet.columns[0];
            boxes[1][lane] = facet.columns[1];
            boxes[2][lane] = facet.rows[0];
            boxes[3][lane] = facet.rows[1];
            boxes[4][lane] = least;
            boxes[5][lane] = if packed.has_walls() { open } else { most };
            facets[lane] = facet;
        }
        let mut found = beams.block.crosses_sixteen(simd, &boxes) & ((1u64 << packed.len()) - 1);
        met += u64::from(found.count_ones());
        let by_sixteens = beams.crosses_by_sixteens(simd, &boxes, found);
        while found != 0 {
            let lane = found.trailing_zeros() as usize;
            found &= found - 1;
            let facet = Divided::new(&facets[lane]);
            for (n, first) in (0..RAYS).step_by(LANES).enumerate() {
                if by_sixteens[n] >> lane & 1 == 0 {
                    continue;
                }
                cross_facet(simd, &facet, (boxes[4][lane], boxes[5][lane]), rays, (first, layer), crossings);
            }
        }
    }
    met
}

/// Sixteen rays and a facet between two codes.
#[inline(always)]
fn cross_facet<S: Simd>(
    simd: S,
    facet: &Divided<'_>,
    (least, most): (f32, f32),
    rays: &BlockRays,
    (first, layer): (usize, u8),
    crossings: &mut Crossings,
) {
    let group = RayGroup::load(simd, rays, first);
    let [u_in, u_out] = group.between(simd, 0, facet.facet.columns);
    let [v_in, v_out] = group.between(simd, 1, facet.facet.rows);
    let (from, to) = (u_in.max(v_in), u_out.min(v_out));
    let zero = Wide::splat(simd, 0.0);
    // Of ties columns come first. A ray that does not start before it leaves, or ends before it enters, is not here.
    let here = u_in.simd_le(v_out) & v_in.simd_lt(u_out) & to.simd_gt(zero) & from.simd_lt(group.end);
    if here.to_bitmask() & 0xFFFF == 0 {
        return;
    }
    // Rays that stay before all vertices or behind them cross no triangle; what is no number is not left out.
    let (start, step) = (group.start[2], lanes(simd, &rays.step[2], first));
    let (a, b) = (start + from.max(zero) * step, start + to * step);
    let size = least.abs().max(if most < f32::INFINITY { most.abs() } else { 0.0 });
    let spread = if most < f32::INFINITY { most - least } else { 0.0 };
    let slack =
        start.abs() * Wide::splat(simd, ASIDE[1]) + Wide::splat(simd, ASIDE[0] * spread + ASIDE[1] * size);
    let before = (a.max(b) + slack).simd_lt(Wide::splat(simd, least));
    let behind = (a.min(b) - slack).simd_gt(Wide::splat(simd, most));
    let mut visits = here.to_bitmask() & !(before | behind).to_bitmask() & 0xFFFF;
    if visits == 0 {
        return;
    }
    let (enters, leaves) = ([u_in.to_array(), v_in.to_array()], [u_out.to_array(), v_out.to_array()]);
    while visits != 0 {
        let lane = visits.trailing_zeros() as usize;
        visits &= visits - 1;
        let visit = Visit {
            ray: first + lane,
            enters: [enters[0][lane], enters[1][lane]],
            leaves: [leaves[0][lane], leaves[1][lane]],
        };
        visit.cross(facet, rays, layer, crossings);
    }
}

/// A facet with its triangles.
struct Divided<'a> {
    facet: &'a Facet,
    stitching: &'static Stitching,
    /// Whether all of it is one plane, and its borders are no edges of triangles.
    is_plane: bool,
    /// Halves of a side: a texel for each.
    half: f32,
    per_half: f32,
}

impl<'a> Divided<'a> {
    #[inline(always)]
    fn new(facet: &'a Facet) -> Self {
        let stitching = &STITCHINGS[usize::from(facet.finer)];
        let is_plane = facet.is_plane();
        Self { facet, stitching, is_plane, half: 0.5 * facet.side, per_half: 2.0 / facet.side }
    }

    /// Column (or row) of a place of a vertex.
    #[inline(always)]
    fn at(&self, place: usize, axis: usize) -> f32 {
        self.facet.corner[axis] + f32::from(PLACES[place][axis]) * self.half
    }

    /// Whether a place is the middle of a side beyond which quads are finer.
    #[inline(always)]
    fn is_halved(&self, side: usize) -> bool {
        self.facet.finer >> side & 1 != 0
    }

    /// How far behind the edge between two places a point of that code lies, `along` it on an axis on which it is not square.
    #[inline(always)]
    fn behind_edge(&self, [p, q]: [usize; 2], axis: usize, along: f32, code: f32) -> f32 {
        let halves = f32::from(PLACES[q][axis]) - f32::from(PLACES[p][axis]);
        // One or two halves: exact, as the finer facet beyond has it.
        let share = (along - self.at(p, axis)) * (self.per_half * if halves == 2.0 { 0.5 } else { 1.0 });
        let [a, b] = [self.facet.codes[p], self.facet.codes[q]];
        code - (a + (b - a) * share)
    }

    /// The triangle over which a ray starts, and how far behind it.
    #[inline(always)]
    fn at_start(&self, rays: &BlockRays, ray: usize) -> (usize, f32) {
        let [u, v, code] = [0, 1, 2].map(|axis| rays.start[axis][ray]);
        let place = [u, v].map(f64::from);
        let triangle = self.facet.triangle_at(place);
        let (p, [right, below]) = self.facet.plane(triangle);
        let height = p[2] + right * (place[0] - p[0]) + below * (place[1] - p[1]);
        (triangle, code - height as f32)
    }
}

/// Where a ray crosses a facet's border.
struct Gate {
    axis: usize,
    /// At the last column (or row).
    far: bool,
    s: f32,
    triangle: usize,
    behind: f32,
}

/// A ray that passes over a facet.
struct Visit {
    ray: usize,
    /// Where it crosses the first border of columns and of rows, and the last ones.
    enters: [f32; 2],
    leaves: [f32; 2],
}

impl Visit {
    #[inline(always)]
    fn cross(&self, facet: &Divided<'_>, rays: &BlockRays, layer: u8, crossings: &mut Crossings) {
        let ray = self.ray;
        let walls = &facet.facet.walls;
        let rises = [rays.inverse[0][ray] > 0.0, rays.inverse[1][ray] > 0.0];

        // In: the later of the two borders, rows where they tie.
        let axis_in = usize::from(self.enters[1] >= self.enters[0]);
        let s_in = self.enters[axis_in];
        let (first, behind_in) = if s_in <= 0.0 {
            facet.at_start(rays, ray)
        } else {
            let gate = self.gate(facet, rays, (axis_in, !rises[axis_in]), s_in);
            if walls[axis_in][usize::from(gate.far)] && gate.behind > 0.0 {
                crossings.push(self.at_wall(facet, rays, layer, &gate, 1));
            }
            (gate.triangle, gate.behind)
        };
        // Out: the earlier of the two, columns where they tie.
        let axis_out = usize::from(self.leaves[1] < self.leaves[0]);
        let out = self.gate(facet, rays, (axis_out, rises[axis_out]), self.leaves[axis_out]);

        let (mut triangle, mut before) = (first, [s_in.max(0.0), behind_in]);
        // The chords between the two triangles, in the order in which they lie.
        while triangle != out.triangle {
            let up = out.triangle > triangle;
            let chord = facet.stitching.chords()[if up { triangle } else { triangle - 1 }].map(usize::from);
            let s = chord_crossing(facet, chord, rays, ray);
            let s = if s.is_finite() { s.max(before[0]).min(out.s) } else { before[0] };
            let along = rays.start[0][ray] + s * rays.step[0][ray];
            let code = rays.start[2][ray] + s * rays.step[2][ray];
            let after = [s, facet.behind_edge(chord, 0, along, code)];
            self.pass(facet, rays, (triangle, layer), [before, after], crossings);
            before = after;
            triangle = if up { triangle + 1 } else { triangle - 1 };
        }
        self.pass(facet, rays, (triangle, layer), [before, [out.s, out.behind]], crossings);
        if walls[axis_out][usize::from(out.far)] && out.behind > 0.0 && out.s < rays.end[ray] {
            crossings.push(self.at_wall(facet, rays, layer, &out, -1));
        }
    }

    /// Over a triangle, between two of its edges: where the ray is, and how far behind.
    #[inline(always)]
    fn pass(
        &self,
        facet: &Divided<'_>,
        rays: &BlockRays,
        (triangle, layer): (usize, u8),
        [[from, before], [to, after]]: [[f32; 2]; 2],
        crossings: &mut Crossings,
    ) {
        if (before > 0.0) == (after > 0.0) {
            return;
        }
        let s = root(facet, triangle, rays, self.ray);
        let s = if s.is_finite() { s } else { from.into() };
        let s = s.max(from.into()).min(to.min(1e30).into());
        if (s as f32) < rays.end[self.ray] {
            let sign = if after > 0.0 { 1 } else { -1 };
            let depth = rays.depth_at(self.ray, s);
            crossings.push(Crossing { depth, s: s as f32, ray: self.ray as u8, layer, axis: 2, sign });
        }
    }

    /// The crossing with a wall at a border.
    fn at_wall(&self, facet: &Divided<'_>, rays: &BlockRays, layer: u8, gate: &Gate, sign: i8) -> Crossing {
        let border = [facet.facet.columns, facet.facet.rows][gate.axis][usize::from(gate.far)];
        Crossing {
            depth: rays.depth_of(self.ray, gate.axis, border.into()),
            s: gate.s,
            ray: self.ray as u8,
            layer,
            axis: gate.axis as u8,
            sign,
        }
    }

    /// The edge by which the ray crosses a border at `s`.
    #[inline(always)]
    fn gate(&self, facet: &Divided<'_>, rays: &BlockRays, (axis, far): (usize, bool), s: f32) -> Gate {
        let (ray, other) = (self.ray, 1 - axis);
        // Clockwise the top, the right, the bottom, the left.
        let side = [[3, 1], [0, 2]][axis][usize::from(far)];
        // From its upper (or left) end to its lower (or right) one, with the middle.
        let ends = [[0, 1, 2], [2, 3, 4], [6, 5, 4], [0, 7, 6]][side];
        let edge = if facet.is_halved(side) {
            let middle = facet.at(ends[1], other);
            let passes = (middle - rays.start[other][ray]) * rays.inverse[other][ray];
            // Of ties columns come first: as the two finer facets beyond have it.
            let is_past = if axis == 0 { passes < s } else { passes <= s };
            if is_past == (rays.inverse[other][ray] > 0.0) { [ends[1], ends[2]] } else { [ends[0], ends[1]] }
        } else {
            [ends[0], ends[2]]
        };
        let along = rays.start[other][ray] + s * rays.step[other][ray];
        let code = rays.start[2][ray] + s * rays.step[2][ray];
        let behind = facet.behind_edge(edge, other, along, code);
        // Of the top and the right the edge begins clockwise at its first end, of the others at its last.
        let triangle =
            if facet.is_plane { 0 } else { facet.stitching.owner(if side < 2 { edge[0] } else { edge[1] }) };
        Gate { axis, far, s, triangle, behind }
    }
}

/// Where a ray crosses the line through a chord.
#[inline(always)]
fn chord_crossing(facet: &Divided<'_>, [p, q]: [usize; 2], rays: &BlockRays, ray: usize) -> f32 {
    let [right, below] = [0, 1].map(|axis| f32::from(PLACES[q][axis]) - f32::from(PLACES[p][axis]));
    let aside = |axis: usize| rays.start[axis][ray] - facet.at(p, axis);
    let drift = right * rays.step[1][ray] - below * rays.step[0][ray];
    (below * aside(0) - right * aside(1)) / drift
}

/// Where a ray crosses the plane of a triangle, in f64.
#[inline(always)]
fn root(facet: &Divided<'_>, triangle: usize, rays: &BlockRays, ray: usize) -> f64 {
    let (p, [right, below]) = facet.facet.plane(triangle);
    let height = |u: f64, v: f64| p[2] + right * (u - p[0]) + below * (v - p[1]);
    rays.plane_crossing(ray, height, [right, below])
}
