//! A lit stretch through translucent occluders: piece by piece of the texels of their captured layers.
//!
//! Within a texel depth is linear along the ray, and so is the optical depth of each segment between its ends; what is left
//! of the light is exp of a linear function between two crossings with such ends, and each such piece is integrated exactly
//! ([`RayLight::fading_interval`]). f64.

use std::cell::Cell;

use glam::DVec3;
use scatter_core::{RayLight, TranslucentLayer, TranslucentSegment, ViewRay};

use super::map_path::MapPath;
use crate::map_segments::visit_layers;

/// Calls `each(start, end, depth, rate)` for the pieces of the ray's part `(a, b)`, in order and without gaps: its light
/// keeps `exp(−depth − rate·(t − start))`. Pieces without light are left out.
pub fn visit_pieces(
    layers: &[TranslucentLayer<'_>],
    eye: DVec3,
    ray: &ViewRay,
    part: (f64, f64),
    each: &mut dyn FnMut([f64; 2], f64, f64),
) {
    let projection_of = |index: usize| layers.get(index).map(|layer| *layer.projection());
    let mut pieces = Pieces { open: None, each };
    visit_layers(&projection_of, eye, ray, part, &mut |segment| {
        let whole = (segment.start, segment.end);
        let Some(layer) = segment.layer.map(|index| &layers[index]) else {
            return pieces.push(whole.0, whole.1, 0.0, 0.0);
        };
        let projection = layer.projection();
        let map_ray = projection.ray(eye, ray.origin, ray.direction);
        match MapPath::new(map_ray, projection.is_perspective(), projection.size(), whole.0, whole.1) {
            // Less than a rounding error of the ray.
            None => pieces.push(whole.0, whole.1, 0.0, 0.0),
            Some(path) => walk(layer, &path, [map_ray.start.z, map_ray.step.z], whole, &mut pieces),
        }
    });
    pieces.finish();
}

/// The radiance of the part `(a, b)` of a ray that is lit but for the occluders.
pub fn dimmed_radiance(
    layers: &[TranslucentLayer<'_>],
    eye: DVec3,
    ray: &ViewRay,
    light: &RayLight<'_>,
    part: (f64, f64),
) -> DVec3 {
    let mut sum = DVec3::ZERO;
    visit_pieces(layers, eye, ray, part, &mut |[a, b], depth, rate| {
        sum += light.fading_interval(a, b, depth, rate)
    });
    sum
}

thread_local! {
    /// Where a ray passes the ends of one texel's segments: a buffer, so that rays allocate nothing.
    static CUTS: Cell<Vec<f64>> = const { Cell::new(Vec::new()) };
}

/// Joins neighbours of one constant transmittance, so that clear stretches are integrated once.
struct Pieces<'e> {
    open: Option<(f64, f64, f64)>,
    each: &'e mut dyn FnMut([f64; 2], f64, f64),
}

impl Pieces<'_> {
    fn push(&mut self, a: f64, b: f64, depth: f64, rate: f64) {
        if !(a < b) || depth == f64::INFINITY {
            return;
        }
        match &mut self.open {
            Some((_, end, same)) if rate == 0.0 && *same == depth && *end == a => *end = b,
            _ => {
                self.flush();
                if rate == 0.0 {
                    self.open = Some((a, b, depth));
                } else {
                    (self.each)([a, b], depth, rate);
                }
            }
        }
    }

    fn flush(&mut self) {
        if let Some((a, b, depth)) = self.open.take() {
            (self.each)([a, b], depth, 0.0);
        }
    }

    fn finish(mut self) {
        self.flush();
    }
}

fn walk(
    layer: &TranslucentLayer<'_>,
    path: &MapPath,
    [depth, slope]: [f64; 2],
    (a, b): (f64, f64),
    pieces: &mut Pieces<'_>,
) {
    let mut cuts = CUTS.take();
    path.visit_texels((a, b), |i, j, from, to| {
        texel(layer.at(i, j), [depth, slope], [from, to], &mut cuts, pieces);
    });
    CUTS.set(cuts);
}

/// The pieces of a ray within one texel.
fn texel(
    segments: &[TranslucentSegment],
    [depth, slope]: [f64; 2],
    [a, b]: [f64; 2],
    cuts: &mut Vec<f64>,
    pieces: &mut Pieces<'_>,
) {
    if segments.is_empty() {
        return pieces.push(a, b, 0.0, 0.0);
    }
    cuts.clear();
    cuts.extend(
        segments
            .iter()
            .flat_map(|segment| [segment.entry, segment.exit].map(|end| (f64::from(end) - depth) / slope)),
    );
    // NaN and ±∞ where the ray keeps its depth.
    cuts.retain(|cut| *cut > a && *cut < b);
    cuts.push(b);
    cuts.sort_unstable_by(f64::total_cmp);
    let mut from = a;
    for &to in cuts.iter() {
        if !(from < to) {
            continue;
        }
        // Anywhere inside tells on which side of each segment's ends the piece lies.
        let inside = if to.is_finite() { 0.5 * (from + to) } else { 2.0 * from.max(1.0) };
        let middle = depth + slope * inside;
        let (mut before, mut rate) = (0.0, 0.0);
        for segment in segments {
            let [entry, exit, whole] = [segment.entry, segment.exit, segment.optical_depth].map(f64::from);
            if middle <= entry || whole == 0.0 {
                continue;
            }
            if middle >= exit || whole == f64::INFINITY {
                before += whole;
            } else {
                let density = whole / (exit - entry);
                before += density * (depth + slope * from - entry);
                rate += density * slope;
            }
        }
        pieces.push(from, to, before.max(0.0), rate);
        from = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::MapProjection;

    /// Two columns of texels, 4 wide each, and depth along −z.
    fn projection() -> MapProjection {
        MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [4.0, 1.0], [2, 1]).unwrap()
    }

    fn pieces(
        segments: &[TranslucentSegment],
        offsets: &[u32],
        ray: &ViewRay,
        end: f64,
    ) -> Vec<([f64; 2], f64, f64)> {
        let layer = TranslucentLayer::new(projection(), offsets, segments).unwrap();
        let mut found = Vec::new();
        visit_pieces(&[layer], DVec3::ZERO, ray, (0.0, end), &mut |ends, depth, rate| {
            found.push((ends, depth, rate))
        });
        found
    }

    #[test]
    fn smoke_fades_and_hairs_jump() {
        // Away from the light through smoke of optical depth 1 between depths 2 and 6, and a hair that takes half at 4.
        let ray = ViewRay { origin: DVec3::new(-2.0, 0.0, 0.0), direction: DVec3::NEG_Z };
        let segments = [TranslucentSegment::volume(2.0, 6.0, 0.25), TranslucentSegment::hair(4.0, 0.5)];
        let found = pieces(&segments, &[0, 2, 2], &ray, 10.0);
        let half = f64::from(segments[1].optical_depth);
        let expected = [
            ([0.0, 2.0], 0.0, 0.0),
            ([2.0, 4.0], 0.0, 0.25),
            ([4.0, 6.0], 0.5 + half, 0.25),
            ([6.0, 10.0], 1.0 + half, 0.0),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn towards_the_light_smoke_grows_clear_and_opaque_segments_end_the_light() {
        let ray = ViewRay { origin: DVec3::new(-2.0, 0.0, -10.0), direction: DVec3::Z };
        let segments = [TranslucentSegment::volume(2.0, 6.0, 0.25), TranslucentSegment::hair(8.0, 1.0)];
        let found = pieces(&segments, &[0, 2, 2], &ray, f64::INFINITY);
        assert_eq!(
            found,
            [([2.0, 4.0], 1.0, 0.0), ([4.0, 8.0], 1.0, -0.25), ([8.0, f64::INFINITY], 0.0, 0.0)]
        );
    }

    #[test]
    fn texels_without_segments_and_what_lies_beside_the_map_are_one_clear_stretch() {
        let ray = ViewRay { origin: DVec3::new(9.0, 0.0, -5.0), direction: DVec3::NEG_X };
        // The right column is clear, the left one behind a hair.
        let found = pieces(&[TranslucentSegment::hair(1.0, 0.75)], &[0, 1, 1], &ray, 20.0);
        let quarter = f64::from(TranslucentSegment::hair(1.0, 0.75).optical_depth);
        assert_eq!(found, [([0.0, 9.0], 0.0, 0.0), ([9.0, 13.0], quarter, 0.0), ([13.0, 20.0], 0.0, 0.0)]);
    }
}
