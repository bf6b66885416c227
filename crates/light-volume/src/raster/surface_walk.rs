//! A ray through an interpolated surface in f64: for the few that the image pass cannot hold in its numbers.
//!
//! The ray is cut where it passes from layer to layer, from texel to texel, over a texel's centre and over an edge between two
//! triangles; between two cuts the surface is one plane, and the ray is before it up to one root. It asks the same facets as the
//! image pass, adaptive ones as well, and nothing of the order of its numbers. O(texels along the ray).

use scatter_core::{Frame, MapRay, ShadowLayer, TexelSpan, TexelWalk, ViewRay, layer_pieces};

use crate::volume::{Facet, HeightField};

/// Calls `each(from, to)` for stretches that are lit of the first `end` of a ray, which starts relative to the eye; in order, and
/// neighbours may touch \[world units\].
pub fn lit_on_surface(
    frame: &Frame<'_>,
    fields: &[HeightField],
    ray: &ViewRay,
    end: f64,
    mut each: impl FnMut(f64, f64),
) {
    let eye = frame.camera().eye();
    layer_pieces(frame.setup().maps(), eye, ray, [0.0, end], |piece| {
        let part = [piece.t_min, piece.t_max];
        let of_layer = piece.layer.and_then(|index| Some((frame.shadow().layer(index)?, fields.get(index)?)));
        let Some((layer, field)) = of_layer else { return each(part[0], part[1]) };
        let path = layer.projection().ray(eye, ray.origin, ray.direction);
        walk_layer((&layer, field), &path, part, &mut each);
    });
}

fn walk_layer(
    (layer, field): (&ShadowLayer<'_>, &HeightField),
    path: &MapRay,
    [from, to]: [f64; 2],
    each: &mut impl FnMut(f64, f64),
) {
    // The walk cuts a map's borders by its own roots. Slits that rounding leaves belong to the texel beside them.
    let mut spans = TexelWalk::new(layer.projection(), path, from, to);
    let mut start = from;
    let mut next = spans.next();
    while let Some(span) = next {
        next = spans.next();
        let end = if next.is_none() { to } else { span.t_max };
        walk_texel((layer, field), path, &TexelSpan { t_min: start, t_max: end, ..span }, each);
        start = end;
    }
}

/// Between two borders of texels: up to four cells, each with its own facet.
fn walk_texel(
    (layer, field): (&ShadowLayer<'_>, &HeightField),
    path: &MapRay,
    span: &TexelSpan,
    each: &mut impl FnMut(f64, f64),
) {
    let line = Line::new(path, layer.projection().is_perspective());
    let mut cuts = Cuts::new([span.t_min, span.t_max]);
    let centre = [f64::from(span.i) + 0.5, f64::from(span.j) + 0.5];
    cuts.add(line.root([1.0, 0.0], -centre[0]));
    cuts.add(line.root([0.0, 1.0], -centre[1]));
    cuts.for_each_part(|part| {
        let p = line.at(middle_of(part));
        let is_past = [p[0] >= centre[0], p[1] >= centre[1]];
        let cell = [span.i + u32::from(is_past[0]), span.j + u32::from(is_past[1])];
        match field.facet_at(layer, cell, is_past.map(|past| !past)) {
            None => each(part[0], part[1]),
            Some(facet) => walk_facet(&facet, &line, part, each),
        }
    });
}

fn walk_facet(facet: &Facet, line: &Line, part: [f64; 2], each: &mut impl FnMut(f64, f64)) {
    let mut cuts = Cuts::new(part);
    facet.for_each_chord(|[p, q]| {
        let across = [p[1] - q[1], q[0] - p[0]];
        cuts.add(line.root(across, -(across[0] * p[0] + across[1] * p[1])));
    });
    cuts.for_each_part(|[from, to]| {
        let (p, slopes) = facet.plane(facet.triangle_at(line.at(middle_of([from, to]))));
        let [value, slope] = line.before(p[2] - slopes[0] * p[0] - slopes[1] * p[1], slopes);
        let root = -value / slope;
        let [from, to] = if slope == 0.0 || !root.is_finite() {
            [from, if value >= 0.0 { to } else { from }]
        } else if slope > 0.0 {
            [from.max(root), to]
        } else {
            [from, to.min(root)]
        };
        if from < to {
            each(from, to);
        }
    });
}

/// A point of a stretch, which may have no end.
fn middle_of([from, to]: [f64; 2]) -> f64 {
    if to == f64::INFINITY { 2.0 * from.abs() + 1.0 + from } else { 0.5 * (from + to) }
}

/// A ray in a map's space: values at t = 0 and slopes.
struct Line {
    u: [f64; 2],
    v: [f64; 2],
    /// What u and v are to be divided by.
    divisor: [f64; 2],
    /// The code times the divisor, turned round: 1 for −1/w.
    code: [f64; 2],
}

impl Line {
    fn new(path: &MapRay, perspective: bool) -> Self {
        let [u, v, depth] = [0, 1, 2].map(|axis| [path.start[axis], path.step[axis]]);
        let (divisor, code) =
            if perspective { (depth, [1.0, 0.0]) } else { ([1.0, 0.0], depth.map(|value| -value)) };
        Self { u, v, divisor, code }
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let w = self.divisor[0] + self.divisor[1] * t;
        [self.u, self.v].map(|[value, slope]| (value + slope * t) / w)
    }

    /// Where `across · (column, row) + shift` is 0.
    fn root(&self, across: [f64; 2], shift: f64) -> f64 {
        let [value, slope] =
            [0, 1].map(|n| across[0] * self.u[n] + across[1] * self.v[n] + shift * self.divisor[n]);
        -value / slope
    }

    /// How far the ray is before a plane of codes, with the sign alone: value and slope.
    fn before(&self, code: f64, slopes: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|n| code * self.divisor[n] + slopes[0] * self.u[n] + slopes[1] * self.v[n] + self.code[n])
    }
}

/// The ends of a stretch, and up to five cuts within it, in order.
struct Cuts {
    at: [f64; 7],
    count: usize,
}

impl Cuts {
    fn new([from, to]: [f64; 2]) -> Self {
        let mut at = [to; 7];
        at[0] = from;
        Self { at, count: 2 }
    }

    fn add(&mut self, t: f64) {
        let last = self.count - 1;
        if self.at[0] < t && t < self.at[last] {
            self.at[self.count] = self.at[last];
            self.at[last] = t;
            self.count += 1;
            self.at[..self.count].sort_unstable_by(f64::total_cmp);
        }
    }

    fn for_each_part(&self, mut each: impl FnMut([f64; 2])) {
        for ends in self.at[..self.count].windows(2) {
            if ends[0] < ends[1] {
                each([ends[0], ends[1]]);
            }
        }
    }
}
