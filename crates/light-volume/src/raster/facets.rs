//! Which rays of a block cross the facets of an interpolated surface.
//!
//! As in `coverage.rs` a ray crosses each line at one number, whoever asks: borders of facets, and the diagonal between two
//! triangles. The ray's height against the surface is asked where it crosses these lines, from the depths of the line's own two
//! vertices: two triangles that share an edge get the same number, so a ray is on the same side when it leaves one as when it
//! enters the other. Between two of these numbers with different signs it crosses the triangle, at the root in f64; where depths
//! jump, a facet in whose shadow the ray enters or leaves has a wall.

use super::beam::{Beam, LANES};
use super::block_rays::{BlockRays, RAYS};
use super::candidates::{Candidate, code_of};
use super::crossings::{Crossing, Crossings};
use crate::volume::HeightField;
use crate::volume::height_field::{Facet, for_each_cell, for_each_facet};
use fearless_simd::Simd;
use scatter_core::ShadowLayer;

/// A facet in codes: what is affine along rays.
struct CodedFacet<'a> {
    facet: &'a Facet,
    /// Top left, top right, bottom left, bottom right.
    codes: [f32; 4],
}

impl CodedFacet<'_> {
    /// How far behind the surface a point of that code lies on the border before (or behind) an axis: between the border's vertices.
    #[inline(always)]
    fn behind_border(&self, axis: usize, far: bool, along: f32, code: f32) -> f32 {
        let [a, b] = match (axis, far) {
            (0, false) => [0, 2],
            (0, true) => [1, 3],
            (_, false) => [0, 1],
            (_, true) => [2, 3],
        };
        code - (self.codes[a] + (self.codes[b] - self.codes[a]) * (along - self.facet.corner[1 - axis]))
    }

    /// The same on the diagonal.
    #[inline(always)]
    fn behind_diagonal(&self, column: f32, code: f32) -> f32 {
        code - (self.codes[0] + (self.codes[3] - self.codes[0]) * (column - self.facet.corner[0]))
    }

    /// The same anywhere; `upper` says in which triangle.
    #[inline(always)]
    fn behind(&self, upper: bool, column: f32, row: f32, code: f32) -> f32 {
        let (x, y) = (column - self.facet.corner[0], row - self.facet.corner[1]);
        let [right, below] = self.slopes(upper);
        code - (self.codes[0] + right * x + below * y)
    }

    /// Change of the surface's code a column and a row.
    #[inline(always)]
    fn slopes(&self, upper: bool) -> [f32; 2] {
        let [a, b, c, d] = self.codes;
        if upper { [b - a, d - b] } else { [d - c, c - a] }
    }
}

/// Whether a ray starts behind a facet that it starts over.
pub fn starts_behind(facet: &Facet, perspective: bool, rays: &BlockRays, ray: usize) -> bool {
    behind_at_start(&coded(facet, perspective), rays, ray) > 0.0
}

fn coded(facet: &Facet, perspective: bool) -> CodedFacet<'_> {
    CodedFacet { facet, codes: facet.depths.map(|depth| code_of(depth, perspective)) }
}

#[inline(always)]
fn behind_at_start(facet: &CodedFacet<'_>, rays: &BlockRays, ray: usize) -> f32 {
    let [u, v, code] = [0, 1, 2].map(|axis| rays.start[axis][ray]);
    let upper = u - facet.facet.corner[0] > v - facet.facet.corner[1];
    facet.behind(upper, u, v, code)
}

/// Writes down which rays of a block cross the facets of a patch of cells; returns how many facets the block's beam met.
#[inline(always)]
pub fn cross_facets<S: Simd>(
    simd: S,
    (field, map, layer, perspective): (&HeightField, &ShadowLayer<'_>, u8, bool),
    candidate: &Candidate,
    (rays, beam): (&BlockRays, &Beam),
    crossings: &mut Crossings,
) -> u64 {
    let _ = simd;
    let mut met = 0;
    for_each_cell(field.cells(), candidate.place, |i, j| {
        for_each_facet(map, [i, j], |facet| {
            let facet = coded(facet, perspective);
            let [a, b, c, d] = facet.codes;
            let least = a.min(b).min(c.min(d));
            // A wall reaches to infinity.
            let open = if perspective { 0.0 } else { f32::INFINITY };
            let most = if facet.facet.has_walls() { open } else { a.max(b).max(c.max(d)) };
            let [columns, rows] = [facet.facet.columns, facet.facet.rows];
            if beam.crosses(&[columns[0], columns[1], rows[0], rows[1], least, most]) {
                met += 1;
                for first in (0..RAYS).step_by(LANES) {
                    cross_facet(&facet, rays, (first, layer), crossings);
                }
            }
        });
    });
    met
}

/// Sixteen rays and a facet.
#[inline(always)]
fn cross_facet(
    facet: &CodedFacet<'_>,
    rays: &BlockRays,
    (first, layer): (usize, u8),
    crossings: &mut Crossings,
) {
    let mut visits = [false; LANES];
    let (mut enters, mut leaves) = ([[0.0f32; LANES]; 2], [[0.0f32; LANES]; 2]);
    for (axis, [near, far]) in [facet.facet.columns, facet.facet.rows].into_iter().enumerate() {
        for lane in 0..LANES {
            let (start, inverse) = (rays.start[axis][first + lane], rays.inverse[axis][first + lane]);
            let (a, b) = ((near - start) * inverse, (far - start) * inverse);
            enters[axis][lane] = a.min(b);
            leaves[axis][lane] = a.max(b);
        }
    }
    for lane in 0..LANES {
        let ([u_in, v_in], [u_out, v_out]) =
            ([enters[0][lane], enters[1][lane]], [leaves[0][lane], leaves[1][lane]]);
        // Of ties columns come first. A ray that does not start before it leaves, or ends before it enters, is not here.
        visits[lane] = (u_in <= v_out)
            & (v_in < u_out)
            & (u_out.min(v_out) > 0.0)
            & (u_in.max(v_in) < rays.end[first + lane]);
    }
    for lane in (0..LANES).filter(|&lane| visits[lane]) {
        let visit = Visit {
            ray: first + lane,
            enters: [enters[0][lane], enters[1][lane]],
            leaves: [leaves[0][lane], leaves[1][lane]],
        };
        visit.cross(facet, rays, layer, crossings);
    }
}

/// A ray that passes over a facet.
struct Visit {
    ray: usize,
    /// Where it crosses the first border of columns and of rows, and the last ones.
    enters: [f32; 2],
    leaves: [f32; 2],
}

impl Visit {
    fn cross(&self, facet: &CodedFacet<'_>, rays: &BlockRays, layer: u8, crossings: &mut Crossings) {
        let ray = self.ray;
        let end = rays.end[ray];
        let at = |axis: usize, s: f32| rays.start[axis][ray] + s * rays.step[axis][ray];
        let borders = [facet.facet.columns, facet.facet.rows];
        let rises = |axis: usize| rays.inverse[axis][ray] > 0.0;
        let push = |crossings: &mut Crossings, s: f32, depth: f64, axis: usize, sign: i8| {
            crossings.push(Crossing { depth, s, ray: ray as u8, layer, axis: axis as u8, sign });
        };
        let behind_at =
            |axis: usize, s: f32, far: bool| facet.behind_border(axis, far, at(1 - axis, s), at(2, s));
        let border = |axis: usize, far: bool| f64::from(borders[axis][usize::from(far)]);

        // In: the later of the two borders, rows where they tie.
        let axis_in = usize::from(self.enters[1] >= self.enters[0]);
        let s_in = self.enters[axis_in];
        let far_in = !rises(axis_in);
        let starts_here = s_in <= 0.0;
        let behind_in =
            if starts_here { behind_at_start(facet, rays, ray) } else { behind_at(axis_in, s_in, far_in) };
        let walls = &facet.facet.walls;
        if !starts_here && walls[axis_in][usize::from(far_in)] && behind_in > 0.0 {
            push(crossings, s_in, rays.depth_of(ray, axis_in, border(axis_in, far_in)), axis_in, 1);
        }
        // Out: the earlier of the two, columns where they tie.
        let axis_out = usize::from(self.leaves[1] < self.leaves[0]);
        let s_out = self.leaves[axis_out];
        let far_out = rises(axis_out);
        let behind_out = behind_at(axis_out, s_out, far_out);

        let corner = facet.facet.corner;
        let across = corner[0] - corner[1];
        // The way across the diagonal, relative to it.
        let offset = rays.start[0][ray] - rays.start[1][ray] - across;
        let drift = rays.step[0][ray] - rays.step[1][ray];
        let s_diagonal = -offset / drift;
        let from = s_in.max(0.0);
        let crosses_diagonal = s_diagonal > from && s_diagonal < s_out;
        let side_at = |s: f32| offset + drift * s > 0.0;
        let mut pass = |[from, to]: [f32; 2], [before, after]: [f32; 2], upper: bool| {
            if (before > 0.0) == (after > 0.0) {
                return;
            }
            let [right, below] = facet.slopes(upper).map(f64::from);
            let height = |u: f64, v: f64| {
                f64::from(facet.codes[0])
                    + right * (u - f64::from(corner[0]))
                    + below * (v - f64::from(corner[1]))
            };
            let s = rays.plane_crossing(ray, height, [right, below]);
            let s = if s.is_finite() { s } else { from.into() };
            let s = s.max(from.into()).min(to.min(1e30).into());
            if (s as f32) < end {
                push(crossings, s as f32, rays.depth_at(ray, s), 2, if after > 0.0 { 1 } else { -1 });
            }
        };
        if crosses_diagonal {
            let behind = facet.behind_diagonal(at(0, s_diagonal), at(2, s_diagonal));
            let upper = drift < 0.0;
            pass([from, s_diagonal], [behind_in, behind], upper);
            pass([s_diagonal, s_out], [behind, behind_out], !upper);
        } else {
            pass([from, s_out], [behind_in, behind_out], side_at(0.5 * (from + s_out.min(1e30))));
        }
        if walls[axis_out][usize::from(far_out)] && behind_out > 0.0 && s_out < end {
            push(crossings, s_out, rays.depth_of(ray, axis_out, border(axis_out, far_out)), axis_out, -1);
        }
    }
}
