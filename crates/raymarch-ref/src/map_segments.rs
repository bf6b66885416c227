//! Which map of a light decides about which part of a view ray: the ray cut into segments of one shadow layer each.
//!
//! An orthographic or a perspective map decides inside of its rectangle (and in front of a lamp); a cube decides by
//! the face of the largest component; cascades by the first map in the list that contains the point; where no map
//! decides, nothing is shadowed (MODEL.md, Conventions). All of these regions are convex cones or prisms, so each
//! cuts a ray in one interval, whose ends are roots of linear functions of the ray parameter. f64.

use glam::DVec3;
use scatter_core::{MapProjection, MapRay, ShadowLayer, ShadowMap, ViewRay, cube_face_of};

/// A piece of a view ray and the layer of the shadow map that decides about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// The layer's index in [`ShadowMap::layers`]; `None` where nothing can cast a shadow.
    pub layer: Option<usize>,
    /// Start of the piece on the ray \[world units\], ≥ 0.
    pub start: f64,
    /// End of the piece \[world units\], > start, may be ∞.
    pub end: f64,
}

/// Calls `visit` for all segments of the ray's part `[0, end]`, in order and without gaps.
///
/// `ray.origin` is relative to `eye`. An empty part has no segments.
pub fn visit_segments(
    shadow: &ShadowMap<'_>,
    eye: DVec3,
    ray: &ViewRay,
    end: f64,
    visit: &mut dyn FnMut(Segment),
) {
    if !(end > 0.0) {
        return;
    }
    match shadow {
        ShadowMap::Unshadowed => visit(Segment { layer: None, start: 0.0, end }),
        // Faces may overlap: the first that contains a point decides, as with cascades.
        ShadowMap::Orthographic(_)
        | ShadowMap::Perspective(_)
        | ShadowMap::Cascades(_)
        | ShadowMap::Faces(_) => {
            let projection_of = |index| shadow.layer(index).map(|layer: ShadowLayer<'_>| *layer.projection());
            visit_layers(&projection_of, eye, ray, (0.0, end), visit);
        }
        ShadowMap::Cube(cube) => faces(cube.position(), eye, ray, end, visit),
    }
}

/// The same for the part `(a, b)` of a ray and layers of which the first that contains a point decides, up to the first
/// index for which there is none.
pub fn visit_layers(
    projection_of: &dyn Fn(usize) -> Option<MapProjection>,
    eye: DVec3,
    ray: &ViewRay,
    part: (f64, f64),
    visit: &mut dyn FnMut(Segment),
) {
    cascade(projection_of, 0, eye, ray, part, visit);
}

/// Cuts the part `(a, b)` by the layer `index` and gives what it leaves to the next ones.
fn cascade(
    projection_of: &dyn Fn(usize) -> Option<MapProjection>,
    index: usize,
    eye: DVec3,
    ray: &ViewRay,
    (a, b): (f64, f64),
    visit: &mut dyn FnMut(Segment),
) {
    if !(a < b) {
        return;
    }
    let Some(projection) = projection_of(index) else {
        return visit(Segment { layer: None, start: a, end: b });
    };
    let path = projection.ray(eye, ray.origin, ray.direction);
    match inside(&projection, &path, a, b) {
        None => cascade(projection_of, index + 1, eye, ray, (a, b), visit),
        Some((start, end)) => {
            cascade(projection_of, index + 1, eye, ray, (a, start), visit);
            visit(Segment { layer: Some(index), start, end });
            cascade(projection_of, index + 1, eye, ray, (end, b), visit);
        }
    }
}

/// The part of `(a, b)` inside of a map's rectangle and before a perspective map's centre.
pub fn inside(projection: &MapProjection, path: &MapRay, a: f64, b: f64) -> Option<(f64, f64)> {
    let [width, height] = projection.size().map(f64::from);
    let (p, d) = (path.start, path.step);
    // u ≥ 0 and u < width·w with w = depth for a perspective map, 1 for a parallel one: linear in t either way.
    let (w, dw) = if projection.is_perspective() { (p.z, d.z) } else { (1.0, 0.0) };
    let borders = [
        (p.x, d.x, true),
        (width * w - p.x, width * dw - d.x, false),
        (p.y, d.y, true),
        (height * w - p.y, height * dw - d.y, false),
        (w, dw, false),
    ];
    let (mut start, mut end) = (a, b);
    for (value, slope, closed) in borders {
        if slope == 0.0 {
            // Texels are half-open: on the left and the upper border a ray is inside.
            if value < 0.0 || (value == 0.0 && !closed) {
                return None;
            }
        } else if slope > 0.0 {
            start = start.max(-value / slope);
        } else {
            end = end.min(-value / slope);
        }
    }
    (start < end).then_some((start, end))
}

/// Cuts a ray where two components of the way from the lamp become equally large.
fn faces(lamp: DVec3, eye: DVec3, ray: &ViewRay, end: f64, visit: &mut dyn FnMut(Segment)) {
    let from_lamp = (eye - lamp) + ray.origin;
    let direction = ray.direction;
    let mut cuts = [f64::INFINITY; 6];
    for (pair, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        for (half, sign) in [1.0, -1.0].into_iter().enumerate() {
            let t = -(from_lamp[i] + sign * from_lamp[j]) / (direction[i] + sign * direction[j]);
            // Parallel to a border plane t is ±∞ or NaN: no cut.
            if t > 0.0 && t < end {
                cuts[2 * pair + half] = t;
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    let mut start = 0.0;
    let mut open: Option<Segment> = None;
    for cut in cuts.into_iter().chain([end]) {
        let cut = cut.min(end);
        if !(cut > start) {
            continue;
        }
        // Any inner point will do: between two cuts the face does not change.
        let inner = if cut == f64::INFINITY { 2.0 * start + 1.0 } else { 0.5 * (start + cut) };
        let layer = Some(cube_face_of(from_lamp + direction * inner));
        match &mut open {
            Some(segment) if segment.layer == layer => segment.end = cut,
            _ => {
                if let Some(segment) = open.replace(Segment { layer, start, end: cut }) {
                    visit(segment);
                }
            }
        }
        start = cut;
    }
    if let Some(segment) = open {
        visit(segment);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::CubeShadow;

    fn segments(shadow: &ShadowMap<'_>, ray: &ViewRay, end: f64) -> Vec<Segment> {
        let mut list = Vec::new();
        visit_segments(shadow, DVec3::ZERO, ray, end, &mut |segment| list.push(segment));
        list
    }

    fn layer(half: f64, texel: &[f32; 1]) -> ShadowLayer<'_> {
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [half; 2], [1, 1]);
        ShadowLayer::new(projection.unwrap(), texel).unwrap()
    }

    #[test]
    fn nested_cascades_cut_a_ray_like_onion_rings() {
        let texel = [1.0f32];
        let layers = [layer(1.0, &texel), layer(2.0, &texel)];
        let shadow = ShadowMap::Cascades(&layers);
        let ray = ViewRay { origin: DVec3::new(-5.0, 0.0, 0.0), direction: DVec3::X };
        let found = segments(&shadow, &ray, f64::INFINITY);
        let expected = [
            (None, 0.0, 3.0),
            (Some(1), 3.0, 4.0),
            (Some(0), 4.0, 6.0),
            (Some(1), 6.0, 7.0),
            (None, 7.0, f64::INFINITY),
        ];
        assert_eq!(found, expected.map(|(layer, start, end)| Segment { layer, start, end }));
    }

    #[test]
    fn a_ray_past_a_lamp_sees_the_faces_of_the_largest_component() {
        let texels = [1.0f32; 6];
        let shadow = ShadowMap::Cube(CubeShadow::new([0.0; 3], 1, &texels).unwrap());
        let ray = ViewRay { origin: DVec3::new(-5.0, 1.0, 0.5), direction: DVec3::X };
        let found = segments(&shadow, &ray, f64::INFINITY);
        // −X until x = −1, then +Y until x = 1, then +X.
        let expected = [(Some(1), 0.0, 4.0), (Some(2), 4.0, 6.0), (Some(0), 6.0, f64::INFINITY)];
        assert_eq!(found, expected.map(|(layer, start, end)| Segment { layer, start, end }));
    }

    #[test]
    fn segments_cover_every_ray_without_gaps_and_agree_with_the_map() {
        let texels = [1.0f32; 24];
        let shadow = ShadowMap::Cube(CubeShadow::new([0.3, 0.1, -0.2], 2, &texels).unwrap());
        for i in 0..2000 {
            let angle = f64::from(i);
            let direction = DVec3::new(angle.sin(), (1.7 * angle).cos(), (2.3 * angle).sin()).normalize();
            let ray = ViewRay { origin: DVec3::new((0.9 * angle).cos(), 0.2, 0.7), direction };
            let found = segments(&shadow, &ray, 7.0);
            assert_eq!((found[0].start, found[found.len() - 1].end), (0.0, 7.0));
            for pair in found.windows(2) {
                assert_eq!(pair[0].end, pair[1].start);
                assert_ne!(pair[0].layer, pair[1].layer);
            }
            for segment in &found {
                for share in [0.01, 0.5, 0.99] {
                    let t = segment.start + share * (segment.end - segment.start);
                    let p = ray.origin + direction * t - DVec3::new(0.3, 0.1, -0.2);
                    assert_eq!(segment.layer, Some(cube_face_of(p)));
                }
            }
        }
    }

    #[test]
    fn a_ray_behind_a_perspective_map_is_unshadowed() {
        let texel = [1.0f32];
        let projection =
            MapProjection::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0, 1).unwrap();
        let shadow = ShadowMap::Perspective(ShadowLayer::new(projection, &texel).unwrap());
        let behind = ViewRay { origin: DVec3::new(-5.0, 0.0, 1.0), direction: DVec3::X };
        assert_eq!(segments(&shadow, &behind, 10.0), [Segment { layer: None, start: 0.0, end: 10.0 }]);
        let before = ViewRay { origin: DVec3::new(-5.0, 0.0, -1.0), direction: DVec3::X };
        let found = segments(&shadow, &before, 10.0);
        assert_eq!(found.len(), 3);
        assert_eq!(found[1], Segment { layer: Some(0), start: 4.0, end: 6.0 });
    }
}
