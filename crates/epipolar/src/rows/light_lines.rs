//! A slice's lines through all maps of its light, in the order of the light rays, each light ray once.
//!
//! Which map decides over a point is a property of its light ray: of a lamp the cube's face that the ray leaves through, of
//! a sun the first cascade whose texel coordinates contain the ray (they are constant along it). So a slice's light rays
//! are cut where its line goes from map to map, and what follows never asks again which map it is in.

use glam::DVec3;
use scatter_core::{MAX_CASCADES, MapProjection, ShadowMap};

use super::map_line::MapLine;
use crate::geometry::{ColumnOrder, SlicePlane};

/// Calls `visit(layer, line)` for every stretch of light rays of a slice that lies in one map of the light, from the eye on,
/// up to the light ray γ = `reach`. What lies between two stretches, and behind the last, no map shadows.
///
/// `lamp` is the distance of a lamp from the eye, `None` for a sun. Along the edge between two faces of a cube both have the
/// same light rays: the first one has them. O(layers²) at the most, and nothing is allocated.
#[inline(always)]
pub fn for_each_line(
    shadow: &ShadowMap<'_>,
    eye: DVec3,
    (plane, order): (&SlicePlane, ColumnOrder),
    lamp: Option<f64>,
    reach: f64,
    mut visit: impl FnMut(usize, MapLine),
) {
    let line = |projection: &MapProjection| line_through(projection, eye, (plane, order), lamp, reach);
    match shadow {
        ShadowMap::Unshadowed => {}
        ShadowMap::Orthographic(layer) | ShadowMap::Perspective(layer) => {
            if let Some(line) = line(layer.projection()) {
                visit(0, line);
            }
        }
        ShadowMap::Cube(cube) => {
            let mut faces: [_; 6] = std::array::from_fn(|face| {
                let line = line(cube.face(face).projection());
                line.map(|line| (line.gamma.at(0.0), face, line))
            });
            // In the order of γ; `None` first.
            faces.sort_unstable_by(|a, b| {
                let start = |face: &Option<(f32, usize, MapLine)>| face.as_ref().map_or(-1.0, |face| face.0);
                start(a).total_cmp(&start(b))
            });
            let mut covered = -1.0;
            for (_, face, line) in faces.into_iter().flatten() {
                let [_, end] = line.gamma_span();
                if end > covered {
                    visit(face, line);
                    covered = end;
                }
            }
        }
        ShadowMap::Faces(faces) => {
            let Some(distance) = lamp else { return };
            let spans: [_; 6] = std::array::from_fn(|face| {
                line(faces[face].projection()).map_or(NOWHERE, |line| line.gamma_span().map(f64::from))
            });
            first_holders(&spans, |face, span| {
                let line = MapLine::lamp(faces[face].projection(), plane, order, distance, span);
                line.into_iter().for_each(|line| visit(face, line));
            });
        }
        ShadowMap::Cascades(layers) => {
            let map = |layer: usize| layers[layer].projection();
            for_each_sun_line(layers.len(), map, eye, (plane, order), reach, visit);
        }
    }
}

/// [`for_each_line`] of a sun's `count` parallel maps, of which no texel is needed: the first that holds a light ray has it.
#[inline(always)]
pub fn for_each_sun_line<'m>(
    count: usize,
    map: impl Fn(usize) -> &'m MapProjection,
    eye: DVec3,
    (plane, order): (&SlicePlane, ColumnOrder),
    reach: f64,
    mut visit: impl FnMut(usize, MapLine),
) {
    let mut spans = [NOWHERE; MAX_CASCADES];
    let spans = &mut spans[..count];
    for (layer, span) in spans.iter_mut().enumerate() {
        *span = MapLine::sun_span(map(layer), eye, plane, [0.0, reach]).unwrap_or(NOWHERE);
    }
    first_holders(spans, |layer, span| {
        let line = MapLine::sun(map(layer), eye, plane, order, span);
        line.into_iter().for_each(|line| visit(layer, line));
    });
}

/// The light rays of a map that a slice does not meet.
const NOWHERE: [f64; 2] = [f64::INFINITY; 2];

/// The slice's line through one map of its light, or through the light's texture.
#[inline(always)]
pub fn line_through(
    projection: &MapProjection,
    eye: DVec3,
    (plane, order): (&SlicePlane, ColumnOrder),
    lamp: Option<f64>,
    reach: f64,
) -> Option<MapLine> {
    match lamp {
        None => MapLine::sun(projection, eye, plane, order, [0.0, reach]),
        Some(distance) => MapLine::lamp(projection, plane, order, distance, [0.0, reach]),
    }
}

/// Cuts the union of intervals, in ascending order, into stretches that belong to the first interval that holds them.
fn first_holders(spans: &[[f64; 2]], mut stretch: impl FnMut(usize, [f64; 2])) {
    let mut at = spans.iter().fold(f64::INFINITY, |first, span| first.min(span[0]));
    while at < f64::INFINITY {
        let holder = spans.iter().position(|&[from, to]| from <= at && at < to);
        // Until the holder ends, or one that goes before it begins; without a holder until any begins.
        let rivals = &spans[..holder.unwrap_or(spans.len())];
        let end = holder.map_or(f64::INFINITY, |holder| spans[holder][1]);
        let end = rivals.iter().map(|span| span[0]).filter(|&from| from > at).fold(end, f64::min);
        if let Some(holder) = holder {
            stretch(holder, [at, end]);
        }
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_place_belongs_to_the_first_interval_that_holds_it(
            ends in prop::collection::vec((0u8..40, 0u8..20), 1..8),
        ) {
            // Whole numbers, so that intervals touch, nest and coincide; some are empty.
            let spans: Vec<[f64; 2]> = ends.iter().map(|&(from, length)| {
                if length == 0 { [f64::INFINITY; 2] } else { [f64::from(from), f64::from(from + length)] }
            }).collect();
            let mut owners = [None; 60];
            let mut before = f64::NEG_INFINITY;
            first_holders(&spans, |owner, [from, to]| {
                assert!(from >= before && to > from, "in order, none empty");
                before = to;
                owners[from as usize..to as usize].fill(Some(owner));
            });
            for (place, owner) in owners.into_iter().enumerate() {
                let middle = place as f64 + 0.5;
                let expected = spans.iter().position(|&[from, to]| from <= middle && middle < to);
                prop_assert_eq!(owner, expected, "{} of {:?}", place, spans);
            }
        }
    }
}
