//! Where a light's curve maps look.

use glam::DVec3;
use scatter_core::{
    Frame, Light, LightKind, MAX_CASCADES, MapKind, MapLayout, MapProjection, ModelError, ShadowMap,
    Translucent, TranslucentSource,
};

use crate::options::{Opaque, Options, Texels};

/// Half angle from which on a spot has six faces instead of one map \[degrees\] (MODEL.md, Conventions).
const WIDEST_CONE: f64 = 80.0;

/// The layers of a frame's curve maps; none where the frame has nothing to put into curves.
///
/// Captured segments bring their own maps. Opaque surfaces are in the rectangles of the shadow map. Occluders of a source get
/// the shadow map's own texels ([`Texels::ShadowMap`]) or, under a sun, a map around themselves, whatever else is in the
/// scene, so that no texel is wasted; around lamps the shadow map's, or faces of a cube.
pub fn curve_layout(frame: &Frame<'_>, options: &Options) -> Result<MapLayout, ModelError> {
    let in_curves = options.opaque == Opaque::Curve && !matches!(frame.shadow(), ShadowMap::Unshadowed);
    match frame.translucent() {
        Some(Translucent::Captured(layers)) => {
            let kind = match (LightKind::of(frame.light()), layers.len()) {
                (LightKind::Directional, 1) => MapKind::Orthographic,
                (LightKind::Directional, _) => MapKind::Cascades,
                (_, 1) => MapKind::Perspective,
                _ => MapKind::Faces,
            };
            with_projections(kind, layers.len(), |index| Ok(*layers[index].projection()))
        }
        Some(Translucent::Source(source)) if !in_curves => {
            if let Some(layout) = on_shadow_texels(frame, *source, options)? {
                return Ok(layout);
            }
            match frame.light() {
                Light::Directional(sun) => match source.bounds() {
                    None => Ok(MapLayout::UNSHADOWED),
                    Some(bounds) => {
                        let map = around(bounds, sun.direction(), options.curves)?;
                        MapLayout::new(MapKind::Orthographic, &[map])
                    }
                },
                _ => lamp_layout(frame, *source, options.curves),
            }
        }
        Some(Translucent::Source(_)) if in_curves => shadow_layout(frame, options.curves),
        // Surfaces alone have no more to tell than the map's own texels.
        None if in_curves => shadow_layout(frame, options.curves.min(frame.setup().maps().largest_side())),
        _ => Ok(MapLayout::UNSHADOWED),
    }
}

/// The shadow map's own texels, where they are asked for and few enough. Of one map those that the occluders' box covers, of
/// cascades and faces all.
fn on_shadow_texels(
    frame: &Frame<'_>,
    source: &dyn TranslucentSource,
    options: &Options,
) -> Result<Option<MapLayout>, ModelError> {
    let maps = frame.setup().maps();
    let (Texels::ShadowMap, Some(bounds)) = (options.texels, source.bounds()) else { return Ok(None) };
    let most = 2 * options.curves;
    if let [map] = maps.projections() {
        let covered = covered_texels(map, bounds);
        let [x0, y0, x1, y1] = covered;
        if x0 >= x1 || y0 >= y1 {
            // None of the map's light is dimmed; outside of it there is no shadow either.
            return Ok(Some(MapLayout::UNSHADOWED));
        }
        if (x1 - x0).max(y1 - y0) > most {
            return Ok(None);
        }
        return MapLayout::new(maps.kind(), &[map.cropped(covered)?]).map(Some);
    }
    if maps.projections().is_empty() || maps.largest_side() > most {
        return Ok(None);
    }
    let kind = if maps.kind() == MapKind::Cube { MapKind::Faces } else { maps.kind() };
    MapLayout::new(kind, maps.projections()).map(Some)
}

/// The texels `[x0, y0, x1, y1)` of a map that a box covers, and one more on each side for rounding; all of them if a corner lies
/// behind the lamp.
fn covered_texels(map: &MapProjection, [low, high]: [[f64; 3]; 2]) -> [u32; 4] {
    let [width, height] = map.size();
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for corner in 0..8 {
        let p = DVec3::from_array(std::array::from_fn(
            |axis| if corner >> axis & 1 == 0 { low } else { high }[axis],
        ));
        let p = map.texel_from_world(p);
        (least, most) = (least.min(p), most.max(p));
    }
    if map.is_perspective() && !(least.z > 0.0) {
        return [0, 0, width, height];
    }
    // Casts saturate.
    let first = |value: f64, size: u32| ((value.floor() - 1.0).max(0.0) as u32).min(size);
    let end = |value: f64, size: u32| ((value.ceil() + 1.0).max(0.0) as u32).min(size);
    [first(least.x, width), first(least.y, height), end(most.x, width), end(most.y, height)]
}

/// The shadow map's rectangles at another size.
fn shadow_layout(frame: &Frame<'_>, side: u32) -> Result<MapLayout, ModelError> {
    let maps = frame.setup().maps();
    let kind = if maps.kind() == MapKind::Cube { MapKind::Faces } else { maps.kind() };
    let projections = maps.projections();
    with_projections(kind, projections.len(), |index| resized(&projections[index], side))
}

fn lamp_layout(
    frame: &Frame<'_>,
    source: &dyn TranslucentSource,
    side: u32,
) -> Result<MapLayout, ModelError> {
    if source.bounds().is_none() {
        return Ok(MapLayout::UNSHADOWED);
    }
    if !matches!(frame.shadow(), ShadowMap::Unshadowed) {
        return shadow_layout(frame, side);
    }
    match frame.light() {
        Light::Spot(spot) if spot.outer().to_degrees() <= WIDEST_CONE => {
            let axis = spot.direction();
            let tan_half = spot.outer().tan();
            let position = spot.lamp().position();
            let map = MapProjection::perspective(
                position.into(),
                axis.into(),
                beside(axis).into(),
                tan_half,
                side,
            )?;
            MapLayout::new(MapKind::Perspective, &[map])
        }
        light => {
            let lamp = light.position().unwrap_or_default();
            with_projections(MapKind::Faces, 6, |face| MapProjection::cube_face(lamp.into(), face, side))
        }
    }
}

/// A layout of `count` projections, without a list on the heap.
fn with_projections(
    kind: MapKind,
    count: usize,
    projection: impl Fn(usize) -> Result<MapProjection, ModelError>,
) -> Result<MapLayout, ModelError> {
    if count == 0 {
        return Ok(MapLayout::UNSHADOWED);
    }
    let mut projections = [projection(0)?; MAX_CASCADES];
    for (index, slot) in projections.iter_mut().enumerate().take(count) {
        *slot = projection(index)?;
    }
    MapLayout::new(kind, &projections[..count.min(MAX_CASCADES)])
}

/// The same map with `side` texels along its longer side and, as nearly as can be, the same shape of texels.
fn resized(map: &MapProjection, side: u32) -> Result<MapProjection, ModelError> {
    let longer = map.size().into_iter().max().unwrap_or(1);
    let scaled = |own: u32| (u64::from(own) * u64::from(side)).div_ceil(u64::from(longer)).max(1) as u32;
    map.with_size(map.size().map(scaled))
}

/// A sun's map around a box, from before the whole of it on.
fn around([low, high]: [[f64; 3]; 2], direction: DVec3, side: u32) -> Result<MapProjection, ModelError> {
    let [low, high] = [low, high].map(DVec3::from);
    let centre = 0.5 * (low + high);
    let half = 0.5 * (high - low);
    let up = beside(direction);
    let right = direction.cross(up).normalize();
    let up = right.cross(direction);
    // How far the box reaches along an axis; a flat one gets a sliver, and everything a millionth more for rounding.
    let reach = |axis: DVec3| axis.abs().dot(half);
    let least = 1e-6 * half.length().max(1e-6 * centre.length()).max(f64::MIN_POSITIVE.sqrt());
    let extent = [right, up].map(|axis| reach(axis) * (1.0 + 1e-6) + least);
    let origin = centre - direction * (reach(direction) * (1.0 + 1e-6) + least);
    let longer = extent[0].max(extent[1]);
    let size = extent.map(|own| ((own / longer * f64::from(side)).ceil() as u32).clamp(1, side));
    MapProjection::orthographic(origin.into(), direction.into(), up.into(), extent, size)
}

/// A direction at a right angle to another.
fn beside(direction: DVec3) -> DVec3 {
    direction.any_orthonormal_vector()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_around_a_box_holds_all_of_it() {
        for (low, high) in
            [([0.0; 3], [1.0, 2.0, 3.0]), ([1e5, -3.0, 2.0], [1e5 + 0.1, 5.0, 2.0]), ([1.0; 3], [1.0; 3])]
        {
            for direction in [DVec3::NEG_Y, DVec3::new(0.3, -1.0, 0.2).normalize()] {
                let map = around([low, high], direction, 37).unwrap();
                let [width, height] = map.size();
                assert!(width.max(height) == 37);
                for corner in 0..8 {
                    let p = DVec3::from_array(std::array::from_fn(
                        |axis| if corner >> axis & 1 == 0 { low } else { high }[axis],
                    ));
                    let p = map.texel_from_world(p);
                    assert!(
                        p.x >= 0.0 && p.x < width.into() && p.y >= 0.0 && p.y < height.into() && p.z >= 0.0,
                        "{p}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_box_covers_the_texels_that_it_projects_to() {
        let (down, up) = ([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]);
        let sun = MapProjection::orthographic([0.0, 9.0, 0.0], down, up, [4.0, 4.0], [16, 16]).unwrap();
        // Half a unit a texel; row 0 is at z = 4, column 0 at one end of x.
        let covered = |low, high| covered_texels(&sun, [low, high]);
        let [x0, y0, x1, y1] = covered([-1.0, 0.0, -0.4], [1.0, 1.0, 2.4]);
        assert_eq!([x1 - x0, y0, y1], [6, 2, 10]);
        assert_eq!(covered([-9.0, 0.0, -9.0], [9.0, 1.0, 9.0]), [0, 0, 16, 16]);
        let [x0, _, x1, _] = covered([20.0, 0.0, 0.0], [21.0, 1.0, 1.0]);
        assert!(x0 >= x1 || x1 - x0 <= 1, "{x0} {x1}");
        let lamp = MapProjection::perspective([0.0, 9.0, 0.0], down, up, 1.0, 16).unwrap();
        assert_eq!(covered_texels(&lamp, [[-1.0, 8.0, -1.0], [1.0, 10.0, 1.0]]), [0, 0, 16, 16]);
        // At a distance of 8 a texel is a unit wide.
        assert_eq!(covered_texels(&lamp, [[-0.5, 1.0, -0.5], [0.5, 1.0, 0.5]]), [6, 6, 10, 10]);
    }

    #[test]
    fn another_side_keeps_the_shape() {
        let map =
            MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [4.0, 3.0], [64, 48])
                .unwrap();
        assert_eq!(resized(&map, 64).unwrap(), map);
        assert_eq!(resized(&map, 256).unwrap().size(), [256, 192]);
        assert_eq!(resized(&map, 1).unwrap().size(), [1, 1]);
    }
}
