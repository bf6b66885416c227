//! Surfaces lit through the medium: the other half of the picture (Billeter et al. 2010, Section 5, step 2).
//!
//! Light is dimmed on its way from a lamp to a surface, and what the surface sends on is dimmed on its way to the eye. An engine
//! shades `albedo/π · cos · irradiance · to_eye` and adds the in-scattered radiance of the same pixel. Under a sun only the
//! second way dims (MODEL.md).

use glam::DVec3;
use scatter_core::{Frame, Light, ViewRay};

/// The light that a point of a surface gets, and how much of what it sends to the eye comes through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLight {
    /// RGB irradiance \[W/m²\] of a surface that faces the light; 0 in shadow. Times the cosine at the surface.
    pub irradiance: [f64; 3],
    /// Unit vector from the surface to the light.
    pub dir_to_light: DVec3,
    /// RGB transmittance, 0 to 1, of the way from the surface to the eye (a parallel camera: to its image plane).
    pub to_eye: [f64; 3],
}

/// How a frame's light reaches the world point `p_world`, with hard shadows by the map's nearest texel: the point's own texel
/// shadows it where the map's rounding lets it, so an engine hands in a point that is moved off its surface as its shadow maps
/// need it.
///
/// A lamp closer than its radius, or than 10⁻⁶ of the eye's distance to it, is taken at that distance, so that every value is
/// finite. f64; O(1), and O(layers) for the shadow.
pub fn surface_light(frame: &Frame<'_>, p_world: DVec3) -> SurfaceLight {
    let (medium, camera) = (frame.medium(), frame.camera());
    let eye = camera.eye();
    let visibility = if frame.shadow().is_lit(p_world) { 1.0 } else { 0.0 };
    let glass = frame.texture().map_or([1.0; 3], |texture| texture.lookup(p_world).map(f64::from));
    let (dir_to_light, arriving) = match frame.light() {
        Light::Directional(sun) => (-sun.direction(), DVec3::from(sun.irradiance())),
        Light::Point(lamp) => from_lamp(frame, lamp.position(), lamp.radius(), p_world, |_| 1.0),
        Light::Spot(spot) => {
            let lamp = spot.lamp();
            from_lamp(frame, lamp.position(), lamp.radius(), p_world, |way| {
                spot.cone(way.dot(spot.direction()))
            })
        }
    };
    let (start, way, distance) = match camera.parallel_direction() {
        None => (DVec3::ZERO, p_world - eye, (p_world - eye).length()),
        Some(travel) => {
            let forward = camera.forward();
            let distance = (p_world - eye).dot(forward) / travel.dot(forward);
            (p_world - eye - travel * distance, travel, distance.max(0.0))
        }
    };
    let ray = ViewRay { origin: start, direction: way.normalize_or(camera.forward()) };
    SurfaceLight {
        irradiance: (arriving * DVec3::from(glass) * visibility).to_array(),
        dir_to_light,
        to_eye: medium.transmittance_along(eye, &ray, distance),
    }
}

/// Direction to a lamp, and the irradiance that arrives from it through the medium.
fn from_lamp(
    frame: &Frame<'_>,
    position: DVec3,
    radius: f64,
    p_world: DVec3,
    cone: impl Fn(DVec3) -> f64,
) -> (DVec3, DVec3) {
    // As view rays near a lamp are taken (MODEL.md).
    const CLOSEST_SHARE: f64 = 1e-6;
    let eye = frame.camera().eye();
    let from_lamp = p_world - position;
    let distance = from_lamp.length().max(radius).max(CLOSEST_SHARE * (position - eye).length());
    let way = from_lamp.normalize_or(frame.camera().forward());
    let ray = ViewRay { origin: DVec3::ZERO, direction: way };
    let through = frame.medium().transmittance_along(position, &ray, distance);
    let intensity = DVec3::from(frame.light().strength()) * cone(way);
    (-way, intensity * DVec3::from(through) / (distance * distance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::{Camera, DepthMap, Medium, Phase, ShadowMap};

    fn with_frame<R>(light: &Light, medium: &Medium, see: impl FnOnce(&Frame<'_>) -> R) -> R {
        let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [1, 1]).unwrap();
        let depth = DepthMap::new(&[10.0], [1, 1]).unwrap();
        see(&Frame::new(&camera, depth, light, &ShadowMap::Unshadowed, medium, 50.0).unwrap())
    }

    #[test]
    fn light_is_dimmed_on_both_ways_of_a_lamp_and_on_one_of_a_sun() {
        let medium = Medium::homogeneous([0.1, 0.2, 0.0], [0.0; 3], Phase::Isotropic).unwrap();
        let lamp = Light::point([0.0, 4.0, -3.0], [8.0; 3], 0.0).unwrap();
        let sun = Light::directional([0.0, -1.0, 0.0], [2.0; 3]).unwrap();
        let point = DVec3::new(0.0, 0.0, -3.0);
        with_frame(&lamp, &medium, |frame| {
            let found = surface_light(frame, point);
            for (channel, sigma) in [0.1f64, 0.2, 0.0].into_iter().enumerate() {
                assert!((found.irradiance[channel] - 8.0 / 16.0 * (-4.0 * sigma).exp()).abs() < 1e-15);
                assert!((found.to_eye[channel] - (-3.0 * sigma).exp()).abs() < 1e-15);
            }
            assert!((found.dir_to_light - DVec3::Y).length() < 1e-15);
            assert!(
                surface_light(frame, DVec3::new(0.0, 4.0, -3.0))
                    .irradiance
                    .iter()
                    .all(|value| value.is_finite())
            );
        });
        with_frame(&sun, &medium, |frame| {
            let found = surface_light(frame, point);
            assert_eq!((found.irradiance, found.dir_to_light), ([2.0; 3], DVec3::Y));
        });
    }
}
