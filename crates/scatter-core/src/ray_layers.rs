//! A view ray through all maps of a light, in order: which layer decides where, and where the ray is lit.
//!
//! One map decides inside of its rectangle (and in front of its lamp), six faces divide the space around a lamp, of
//! cascades and of overlapping faces the first that contains a point decides, and where no map decides nothing is shadowed
//! (MODEL.md, Conventions). Every layer's region is convex, so it holds one stretch of a ray; the ends of all stretches
//! cut the ray into pieces, and each piece belongs to the first layer whose stretch contains its middle. f64.
//!
//! `raymarch-ref` has an implementation of its own, by recursion over the layers, and never calls this one: the judge
//! must not sit in the judged. Its tests compare the two.

use glam::DVec3;

use crate::camera::ViewRay;
use crate::kinds::MapKind;
use crate::map_layout::{MAX_CASCADES, MapLayout};
use crate::map_projection::{MapProjection, MapRay, cube_face_of};
use crate::shadow_map::ShadowMap;
use crate::texel_walk::{TexelSpan, TexelWalk};

/// A piece of a view ray and the layer that decides about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LayerPiece {
    /// The layer's index in [`ShadowMap::layers`]; `None` where nothing can cast a shadow.
    pub layer: Option<usize>,
    /// Where the piece starts on the ray \[world units\].
    pub t_min: f64,
    /// Where it ends, > `t_min`; may be ∞.
    pub t_max: f64,
}

/// Cuts the part `[t_min, t_max]` of a ray (0 ≤ `t_min`, `t_max` may be ∞) by the layers of a light and calls `each` for
/// every piece, in order, without gaps; neighbours have different layers. `ray.origin` is relative to `reference` (world
/// space). Borders are exact to the rounding of their one root. O(layers · log layers), no heap.
pub fn layer_pieces(
    maps: &MapLayout,
    reference: DVec3,
    ray: &ViewRay,
    [t_min, t_max]: [f64; 2],
    mut each: impl FnMut(LayerPiece),
) {
    if !(t_min < t_max) {
        return;
    }
    let projections = maps.projections();
    let mut stretches = [None; MAX_CASCADES];
    let mut cuts = [t_max; 2 * MAX_CASCADES + 1];
    let mut cut_count = 1;
    for (stretch, projection) in stretches.iter_mut().zip(projections) {
        let path = projection.ray(reference, ray.origin, ray.direction);
        *stretch = stretch_inside(projection, &path, [t_min, t_max]);
        if let Some(ends) = *stretch {
            cuts[cut_count..cut_count + 2].copy_from_slice(&ends);
            cut_count += 2;
        }
    }
    let cuts = &mut cuts[..cut_count];
    cuts.sort_unstable_by(f64::total_cmp);
    let layer_at = |t: f64| {
        let contains = |stretch: &Option<[f64; 2]>| stretch.is_some_and(|[from, to]| from <= t && t < to);
        let first = stretches[..projections.len()].iter().position(contains);
        // Rounding may leave a slit between two faces of a cube.
        let face = || {
            let lamp = projections.first().and_then(MapProjection::centre)?;
            Some(cube_face_of((reference - lamp) + ray.origin + ray.direction * t))
        };
        first.or_else(|| if maps.kind() == MapKind::Cube { face() } else { None })
    };
    let mut open: Option<LayerPiece> = None;
    let mut start = t_min;
    for &cut in cuts.iter() {
        if !(cut > start) {
            continue;
        }
        let middle = if cut == f64::INFINITY { 2.0 * start + 1.0 } else { 0.5 * (start + cut) };
        let layer = layer_at(middle);
        match &mut open {
            Some(piece) if piece.layer == layer => piece.t_max = cut,
            _ => {
                if let Some(piece) = open.replace(LayerPiece { layer, t_min: start, t_max: cut }) {
                    each(piece);
                }
            }
        }
        start = cut;
    }
    if let Some(piece) = open {
        each(piece);
    }
}

/// The part of a ray inside of a map's rectangle, and before the centre of a perspective map: one stretch, since the
/// region is convex. `None` where it is empty.
fn stretch_inside(
    projection: &MapProjection,
    path: &MapRay,
    [mut from, mut to]: [f64; 2],
) -> Option<[f64; 2]> {
    let [width, height] = projection.size().map(f64::from);
    // Texel coordinates are u/w and v/w, w the depth of a perspective map and 1 of a parallel one: 0 ≤ u < width·w.
    let depth = if projection.is_perspective() { [path.start.z, path.step.z] } else { [1.0, 0.0] };
    let (u, v) = ([path.start.x, path.step.x], [path.start.y, path.step.y]);
    let beyond = |size: f64, way: [f64; 2]| [size * depth[0] - way[0], size * depth[1] - way[1]];
    for ([value, slope], half_open) in
        [(u, false), (v, false), (beyond(width, u), true), (beyond(height, v), true), (depth, true)]
    {
        // value + slope·t ≥ 0, or > 0 on the side that does not belong to the map.
        match slope.partial_cmp(&0.0)? {
            std::cmp::Ordering::Greater => from = from.max(-value / slope),
            std::cmp::Ordering::Less => to = to.min(-value / slope),
            std::cmp::Ordering::Equal if value < 0.0 || (half_open && value == 0.0) => return None,
            std::cmp::Ordering::Equal => {}
        }
    }
    (from < to).then_some([from, to])
}

/// Calls `each(a, b)` for every lit stretch of the part `[t_min, t_max]` of a ray, in order; neighbouring texels'
/// stretches are one. Visibility by nearest texel: lit if and only if depth ≤ the stored depth.
///
/// `maps` is the layout of `shadow`, `ray.origin` is relative to `reference` (world space). Crossings are roots of one
/// linear function each, exact to its rounding. O(texels along the ray), no heap.
pub fn lit_stretches(
    (shadow, maps): (&ShadowMap<'_>, &MapLayout),
    reference: DVec3,
    ray: &ViewRay,
    part: [f64; 2],
    mut each: impl FnMut(f64, f64),
) {
    let mut open: Option<(f64, f64)> = None;
    let mut push = |a: f64, b: f64| {
        if !(b > a) {
            return;
        }
        match &mut open {
            Some((_, end)) if *end == a => *end = b,
            _ => {
                if let Some((a, b)) = open.replace((a, b)) {
                    each(a, b);
                }
            }
        }
    };
    layer_pieces(maps, reference, ray, part, |piece| {
        let Some(layer) = piece.layer.and_then(|index| shadow.layer(index)) else {
            return push(piece.t_min, piece.t_max);
        };
        let path = layer.projection().ray(reference, ray.origin, ray.direction);
        // The walk cuts a map's borders by its own roots. Slits that rounding leaves belong to the texel beside them.
        let mut spans = TexelWalk::new(layer.projection(), &path, piece.t_min, piece.t_max);
        let mut start = piece.t_min;
        let mut next = spans.next();
        while let Some(span) = next {
            next = spans.next();
            let t_max = if next.is_none() { piece.t_max } else { span.t_max };
            let span = TexelSpan { t_min: start, t_max, ..span };
            let surface = f64::from(layer.at(span.i, span.j));
            if let Some((a, b)) = lit_part(surface, &path, &span) {
                push(a, b);
            }
            start = t_max;
        }
    });
    if let Some((a, b)) = open {
        each(a, b);
    }
}

/// The stretch of a texel's span that is not deeper than its surface, in the parameter of `path`; `None` where there is none.
pub fn lit_part(surface: f64, path: &MapRay, span: &TexelSpan) -> Option<(f64, f64)> {
    let (start, step) = (path.start.z, path.step.z);
    if surface == f64::INFINITY {
        return Some((span.t_min, span.t_max));
    }
    let crossing = (surface - start) / step;
    match step.partial_cmp(&0.0)? {
        std::cmp::Ordering::Greater => Some((span.t_min, span.t_max.min(crossing))),
        std::cmp::Ordering::Less => Some((span.t_min.max(crossing), span.t_max)),
        std::cmp::Ordering::Equal => (start <= surface).then_some((span.t_min, span.t_max)),
    }
    .filter(|(a, b)| a < b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shadow_map::{CubeShadow, ShadowLayer};

    fn pieces(maps: &MapLayout, ray: &ViewRay, part: [f64; 2]) -> Vec<(Option<usize>, f64, f64)> {
        let mut found = Vec::new();
        layer_pieces(maps, DVec3::ZERO, ray, part, |piece| {
            found.push((piece.layer, piece.t_min, piece.t_max))
        });
        found
    }

    #[test]
    fn nested_cascades_cut_a_ray_like_onion_rings() {
        let map = |half: f64| {
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [half; 2], [1, 1])
                .unwrap()
        };
        let maps = MapLayout::new(MapKind::Cascades, &[map(1.0), map(2.0), map(1.5)]).unwrap();
        let ray = ViewRay { origin: DVec3::new(-5.0, 0.0, 0.0), direction: DVec3::X };
        let endless = f64::INFINITY;
        let expected = [
            (None, 0.0, 3.0),
            (Some(1), 3.0, 4.0),
            (Some(0), 4.0, 6.0),
            (Some(1), 6.0, 7.0),
            (None, 7.0, endless),
        ];
        assert_eq!(pieces(&maps, &ray, [0.0, endless]), expected);
        // A part of it, and a ray along the left border (inside) and the right one (outside).
        assert_eq!(pieces(&maps, &ray, [5.0, 6.5]), [(Some(0), 5.0, 6.0), (Some(1), 6.0, 6.5)]);
        let beside = |x: f64| ViewRay { origin: DVec3::new(x, -5.0, 0.0), direction: DVec3::Y };
        assert_eq!(pieces(&maps, &beside(-2.0), [0.0, 9.0])[1], (Some(1), 3.0, 7.0));
        assert_eq!(pieces(&maps, &beside(2.0), [0.0, 9.0]), [(None, 0.0, 9.0)]);
    }

    #[test]
    fn a_ray_past_a_lamp_sees_the_faces_of_the_largest_component() {
        let faces: Vec<_> = (0..6).map(|face| MapProjection::cube_face([0.0; 3], face, 4).unwrap()).collect();
        let faces = MapLayout::new(MapKind::Faces, &faces).unwrap();
        for maps in [MapLayout::cube([0.0; 3], 4).unwrap(), faces] {
            let ray = ViewRay { origin: DVec3::new(-5.0, 1.0, 0.5), direction: DVec3::X };
            // −X until x = −1, then +Y until x = 1, then +X.
            let expected = [(Some(1), 0.0, 4.0), (Some(2), 4.0, 6.0), (Some(0), 6.0, f64::INFINITY)];
            assert_eq!(pieces(&maps, &ray, [0.0, f64::INFINITY]), expected);
        }
    }

    #[test]
    fn lit_stretches_are_where_the_map_says_so() {
        // 2 × 2 texels a face, some of them near: every point but those next to an end agrees with the map.
        let lamp = DVec3::new(0.3, 0.1, -0.2);
        let texels: Vec<f32> = (0..24).map(|n| [0.4, f32::INFINITY, 1.5, 0.9, 0.0][n % 5]).collect();
        let layers: Vec<_> = (0..6)
            .map(|face| {
                let map = MapProjection::cube_face(lamp.to_array(), 5 - face, 2).unwrap();
                ShadowLayer::new(map, &texels[4 * face..][..4]).unwrap()
            })
            .collect();
        let cube = ShadowMap::Cube(CubeShadow::new(lamp.to_array(), 2, &texels).unwrap());
        let mut lit = 0;
        for shadow in [cube, ShadowMap::Faces(layers.as_array().unwrap())] {
            let maps = MapLayout::of(&shadow).unwrap();
            for i in 0..500 {
                let angle = f64::from(i);
                let direction = DVec3::new(angle.sin(), (1.7 * angle).cos(), (2.3 * angle).sin()).normalize();
                let ray = ViewRay { origin: DVec3::new((0.9 * angle).cos(), 0.2, 0.7), direction };
                let mut found = Vec::new();
                lit_stretches((&shadow, &maps), DVec3::ZERO, &ray, [0.0, 7.0], |a, b| found.push((a, b)));
                for step in 0..200 {
                    let t = 7.0 * (f64::from(step) + 0.5) / 200.0;
                    let is_lit = found.iter().any(|(a, b)| *a <= t && t < *b);
                    let at_an_end = found.iter().any(|(a, b)| (a - t).abs().min((b - t).abs()) < 1e-9);
                    let expected = shadow.is_lit(ray.origin + direction * t);
                    assert!(at_an_end || is_lit == expected, "{i} at {t}: {found:?}");
                    lit += usize::from(is_lit);
                }
                assert!(found.windows(2).all(|pair| pair[0].1 < pair[1].0), "in order and joined: {found:?}");
            }
        }
        assert!(lit > 10_000 && lit < 190_000, "light and shadow: {lit} of 200,000");
    }
}
