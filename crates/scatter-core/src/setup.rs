//! A frame without pixels: all that a technique needs to set up, and nothing that only a GPU may hold.
//!
//! Slices, bands, factors, capabilities and whatever else is prepared on the CPU read a [`Setup`]; a
//! [`Frame`](crate::Frame) is a set-up with its texels.

use glam::DVec3;

use crate::camera::Camera;
use crate::clip_rows::ROUNDING;
use crate::cube_faces::covers_the_sphere;
use crate::error::ModelError;
use crate::kinds::{LightKind, MapKind};
use crate::light::{DirectionalLight, Light};
use crate::map_layout::MapLayout;
use crate::map_projection::MapProjection;
use crate::medium::Medium;
use crate::translucent::Translucent;

/// Camera, light, medium, range, where the maps and the texture look, and whether anything dims the light. Checked once: a set-up that exists is
/// sane. Copied as it is; about 2 KB.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) light: &'a Light,
    pub(crate) medium: &'a Medium,
    pub(crate) max_distance: f64,
    pub(crate) maps: MapLayout,
    pub(crate) texture: Option<MapProjection>,
    pub(crate) translucent: bool,
}

impl<'a> Setup<'a> {
    /// Borrows the parts and checks how they fit each other (each part has checked itself).
    ///
    /// `max_distance` ≥ 0 \[world units\] is where rays end that hit nothing nearer; it may be ∞ if the medium
    /// extinguishes every channel that scatters. Errors name what does not fit and the cure.
    pub fn new(
        camera: &'a Camera,
        light: &'a Light,
        maps: MapLayout,
        medium: &'a Medium,
        max_distance: f64,
    ) -> Result<Self, ModelError> {
        check_range(max_distance, light, medium)?;
        check_lamp(camera, light)?;
        check_maps(MAP, light, &maps)?;
        Ok(Self { camera, light, medium, max_distance, maps, texture: None, translucent: false })
    }

    /// The same with a colour texture in front of the light.
    ///
    /// The texture is read by the kind of its light, so an error is: a perspective one on a sun, or one that does not
    /// look along it; a parallel one on a lamp, or a cone that does not start at the lamp.
    pub fn with_texture(self, projection: MapProjection) -> Result<Self, ModelError> {
        check_texture(self.light, &projection)?;
        Ok(Self { texture: Some(projection), ..self })
    }

    /// The same with translucent occluders.
    ///
    /// Captured layers look where shadow maps of the light look: the errors are those of such maps, and a number of layers
    /// that no map of the light has (a sun: one or cascades; a spot: one or six faces; a lamp: six faces). A source fits
    /// every light.
    pub fn with_translucent(self, translucent: &Translucent<'_>) -> Result<Self, ModelError> {
        if let Some(layout) = translucent.layout(LightKind::of(self.light))? {
            check_maps("the map of translucent occluders", self.light, &layout)?;
        }
        Ok(Self { translucent: true, ..self })
    }

    /// The camera.
    pub fn camera(&self) -> &'a Camera {
        self.camera
    }

    /// The light of this pass.
    pub fn light(&self) -> &'a Light {
        self.light
    }

    /// The medium.
    pub fn medium(&self) -> &'a Medium {
        self.medium
    }

    /// Where rays end that hit nothing nearer \[world units\], ≥ 0 or ∞.
    pub fn max_distance(&self) -> f64 {
        self.max_distance
    }

    /// Where the light's maps look.
    pub fn maps(&self) -> &MapLayout {
        &self.maps
    }

    /// Where the texture in front of the light is.
    pub fn texture(&self) -> Option<&MapProjection> {
        self.texture.as_ref()
    }

    /// Whether there are translucent occluders.
    pub fn translucent(&self) -> bool {
        self.translucent
    }

    /// `[width, height]` of the image.
    pub fn size(&self) -> [u32; 2] {
        self.camera.size()
    }
}

/// What errors call a map.
const MAP: &str = "the shadow map";

fn check_range(max_distance: f64, light: &Light, medium: &Medium) -> Result<(), ModelError> {
    if !(max_distance >= 0.0) {
        return Err(ModelError::OutOfRange {
            field: "max_distance".into(),
            value: max_distance,
            range: "a number ≥ 0, or ∞ in a medium with extinction",
        });
    }
    let endless = max_distance == f64::INFINITY && matches!(light, Light::Directional(_));
    // σt = 0 in a channel means that it scatters nothing either, so the integral is 0 there, not infinite; but a
    // channel with σt > 0 converges. Nothing to refuse but a σ so small that 1/σ overflows.
    let overflows = medium.sigma_t().iter().any(|&sigma| sigma > 0.0 && !(1.0 / sigma).is_finite());
    if endless && overflows {
        return Err(ModelError::Mismatch(
            "max_distance is ∞ and the extinction is below 1e-308; give a finite max_distance".into(),
        ));
    }
    Ok(())
}

fn check_lamp(camera: &Camera, light: &Light) -> Result<(), ModelError> {
    match light.position() {
        Some(position) if position == camera.eye() => Err(ModelError::Mismatch(
            "the lamp is at the camera's eye, where the integral diverges; move one of them".into(),
        )),
        _ => Ok(()),
    }
}

fn mismatch<T>(message: &str) -> Result<T, ModelError> {
    Err(ModelError::Mismatch(message.into()))
}

fn check_maps(what: &str, light: &Light, maps: &MapLayout) -> Result<(), ModelError> {
    let projections = maps.projections();
    match (light, maps.kind()) {
        (_, MapKind::Unshadowed) => Ok(()),
        (Light::Directional(sun), MapKind::Orthographic | MapKind::Cascades) => {
            for projection in projections {
                if projection.is_perspective() {
                    return mismatch(
                        "a directional light has a perspective shadow map; give a parallel projection (last row 0 0 0 1 \
                         in column-major order)",
                    );
                }
                check_direction(what, projection, sun)?;
            }
            Ok(())
        }
        (Light::Directional(_), _) => {
            mismatch("a directional light needs an orthographic shadow map, cascades, or none")
        }
        (Light::Point(_) | Light::Spot(_), MapKind::Cube) => {
            projections.iter().try_for_each(|projection| check_centre(what, light, projection))
        }
        (Light::Point(_) | Light::Spot(_), MapKind::Faces) => check_faces(what, light, projections),
        (Light::Point(_), _) => mismatch("a point light needs a cube shadow map, six faces, or none"),
        (Light::Spot(_), MapKind::Perspective) => {
            if !projections.iter().all(MapProjection::is_perspective) {
                return mismatch("a spot light has a parallel shadow map; give a perspective projection");
            }
            projections.iter().try_for_each(|projection| check_centre(what, light, projection))
        }
        (Light::Spot(_), _) => {
            mismatch("a spot light needs a perspective or a cube shadow map, six faces, or none")
        }
    }
}

fn check_faces(what: &str, light: &Light, faces: &[MapProjection]) -> Result<(), ModelError> {
    for face in faces {
        let [width, height] = face.size();
        if !face.is_perspective() || width != height {
            return mismatch(
                "a face of the cube map is parallel or not square; give six square perspective faces",
            );
        }
        check_centre(what, light, face)?;
    }
    if covers_the_sphere(faces) {
        Ok(())
    } else {
        mismatch(
            "the six faces of the cube map leave a gap; give faces of at least 90° that look along six directions \
             at right angles to each other",
        )
    }
}

fn check_texture(light: &Light, projection: &MapProjection) -> Result<(), ModelError> {
    match light {
        Light::Directional(_) if projection.is_perspective() => {
            mismatch("a directional light has a perspective texture; give it a parallel projection")
        }
        Light::Directional(sun) => check_direction("the texture", projection, sun),
        Light::Point(_) | Light::Spot(_) if !projection.is_perspective() => {
            mismatch("a lamp has a parallel texture; give it a perspective projection from light.position")
        }
        Light::Point(_) | Light::Spot(_) => check_centre("the texture", light, projection),
    }
}

/// How far a map may look off its sun \[radians\]: 2⁻¹⁸. Directions and rows of f32 hold 2⁻²⁴ of their length; a rotation made
/// of a quaternion, inverted and multiplied with a projection comes to 2⁻²¹, and a sun's direction read off another matrix
/// to as much (`tests/engine_matrices` prints the margin). What the angle moves a shadow by is below f32, too: 4e-6 of
/// the way from the surface that casts it.
const ALIGNED: f64 = 4.0 * ROUNDING;

/// The light rays of a parallel map, along which u and v are constant and depth grows, against the sun's direction.
fn check_direction(what: &str, projection: &MapProjection, sun: &DirectionalLight) -> Result<(), ModelError> {
    let [u, v, depth] = projection.rows().map(|row| row.truncate());
    let null = (u / u.abs().max_element()).cross(v / v.abs().max_element());
    let along = if depth.dot(null) < 0.0 { -null } else { null };
    let angle = along.cross(sun.direction()).length().atan2(along.dot(sun.direction()));
    if angle <= ALIGNED {
        return Ok(());
    }
    let degrees = angle.to_degrees();
    let cure = if angle > std::f64::consts::FRAC_PI_2 {
        "build it from light.direction, the way the light travels; of reversed z, say ClipSpace::reversed()"
    } else {
        "build it from light.direction"
    };
    Err(ModelError::Mismatch(format!(
        "{what} does not look along the directional light but {degrees:.6}° off it; {cure}"
    )))
}

/// A map's centre against the lamp's: an error beyond 1e-5 of their distance from the origin. Each of the three numbers
/// that the centre is solved from is a sum of three products of f32, right to 2⁻²³ of that distance; an inverse and a
/// product in f32 make it 2⁻²⁰.
fn check_centre(what: &str, light: &Light, projection: &MapProjection) -> Result<(), ModelError> {
    let Some(centre) = projection.centre() else {
        return Err(ModelError::Mismatch(format!(
            "{what} has a singular projection; build it from the lamp"
        )));
    };
    let position = light.position().unwrap_or(DVec3::ZERO);
    let distance = centre.distance(position);
    if distance <= 1e-5 * (1.0 + position.length()) {
        return Ok(());
    }
    Err(ModelError::Mismatch(format!(
        "{what} is not at the lamp but its centre {distance:.6} from it; build it from light.position"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase::Phase;
    use crate::translucent::TranslucentLayer;

    const UP: [f64; 3] = [0.0, 0.0, 1.0];
    const DOWN: [f64; 3] = [0.0, -1.0, 0.0];
    const LAMP: [f64; 3] = [1.0, 2.0, 3.0];

    fn sun() -> Light {
        Light::directional(DOWN, [1.0; 3]).unwrap()
    }

    fn spot() -> Light {
        Light::spot(LAMP, DOWN, [1.0; 3], 20.0, 30.0, 0.0).unwrap()
    }

    fn parallel(forward: [f64; 3]) -> MapProjection {
        MapProjection::orthographic([0.0; 3], forward, UP, [1.0; 2], [2, 2]).unwrap()
    }

    fn cone(position: [f64; 3], up: [f64; 3], forward: [f64; 3]) -> MapProjection {
        MapProjection::perspective(position, forward, up, 1.0, 2).unwrap()
    }

    /// What is said of a set-up with these maps and this texture; "" if it is accepted.
    fn message(light: &Light, maps: Result<MapLayout, ModelError>, texture: Option<MapProjection>) -> String {
        let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [3, 2]).unwrap();
        let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
        let setup = maps.and_then(|maps| Setup::new(&camera, light, maps, &medium, 10.0));
        let setup = setup.and_then(|setup| texture.map_or(Ok(setup), |texture| setup.with_texture(texture)));
        setup.err().map_or(String::new(), |error| error.to_string())
    }

    #[test]
    fn a_texture_that_does_not_fit_its_light_is_refused_with_the_cure() {
        let texture =
            |light: &Light, texture: MapProjection| message(light, Ok(MapLayout::UNSHADOWED), Some(texture));
        assert_eq!(texture(&sun(), parallel(DOWN)), "");
        assert!(texture(&sun(), cone(LAMP, UP, DOWN)).contains("give it a parallel projection"));
        for forward in [[0.1, -1.0, 0.0], [0.0, 1.0, 0.0], [1e-4, -1.0, 0.0]] {
            let message = texture(&sun(), parallel(forward));
            assert!(
                message.contains("does not look along") && message.contains("light.direction"),
                "{message}"
            );
        }
        let point = Light::point(LAMP, [1.0; 3], 0.0).unwrap();
        for lamp in [&spot(), &point] {
            // Anywhere the lamp shines, not along its axis alone.
            assert_eq!(texture(lamp, cone(LAMP, UP, [1.0, -1.0, 0.3])), "");
            assert!(texture(lamp, parallel(DOWN)).contains("perspective projection from light.position"));
            let message = texture(lamp, cone([1.0, 2.001, 3.0], UP, DOWN));
            assert!(message.contains("not at the lamp") && message.contains("light.position"), "{message}");
        }
        // What f32 matrices round is allowed.
        assert_eq!(texture(&spot(), cone([1.0, 2.0 + 1e-6, 3.0], UP, DOWN)), "");
    }

    #[test]
    fn six_faces_start_at_the_lamp_are_square_and_leave_no_gap() {
        let mut faces: Vec<_> = (0..6).map(|face| MapProjection::cube_face(LAMP, face, 2).unwrap()).collect();
        let said = |faces: &[MapProjection]| message(&spot(), MapLayout::new(MapKind::Faces, faces), None);
        assert_eq!(said(&faces), "");
        // Mirrored and turned about its axis: another engine's face.
        let whole = faces[2];
        faces[2] = cone(LAMP, [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert_eq!(said(&faces), "");
        assert!(said(&faces[..5]).contains("six projections"));
        // A cube's faces are no choice, so that nobody reads turned ones by wgpu's order.
        let cube = |maps: Result<MapLayout, ModelError>| message(&spot(), maps, None);
        assert_eq!(cube(MapLayout::cube(LAMP, 2)), "");
        assert!(cube(MapLayout::new(MapKind::Cube, &faces)).contains("MapLayout::cube"));
        assert!(cube(MapLayout::cube([1.0, 2.0, 3.1], 2)).contains("not at the lamp"));
        faces[2] = cone([1.0, 2.1, 3.0], UP, [0.0, 1.0, 0.0]);
        assert!(said(&faces).contains("not at the lamp"));
        faces[2] = MapProjection::perspective(LAMP, [0.0, 1.0, 0.0], UP, 0.9, 2).unwrap();
        assert!(said(&faces).contains("leave a gap"));
        faces[2] = parallel(DOWN);
        assert!(said(&faces).contains("six square perspective faces"));
        faces[2] = whole;
        assert!(message(&sun(), MapLayout::new(MapKind::Faces, &faces), None).contains("cascades, or none"));
    }

    #[test]
    fn translucent_layers_look_where_maps_of_the_light_look() {
        let said = |light: &Light, projections: &[MapProjection]| {
            let layers: Vec<_> =
                projections.iter().map(|p| TranslucentLayer::new(*p, &[0; 5], &[]).unwrap()).collect();
            let camera =
                Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [3, 2]).unwrap();
            let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
            let setup = Setup::new(&camera, light, MapLayout::UNSHADOWED, &medium, 10.0).unwrap();
            let setup = setup.with_translucent(&Translucent::Captured(&layers));
            setup.map_or_else(|error| error.to_string(), |setup| setup.translucent().to_string())
        };
        let faces: Vec<_> = (0..6).map(|face| MapProjection::cube_face(LAMP, face, 2).unwrap()).collect();
        let point = Light::point(LAMP, [1.0; 3], 0.0).unwrap();
        assert_eq!(said(&sun(), &[parallel(DOWN)]), "true");
        assert_eq!(said(&sun(), &[parallel(DOWN); 3]), "true");
        assert_eq!(said(&spot(), &[cone(LAMP, UP, DOWN)]), "true");
        assert_eq!(said(&spot(), &faces), "true");
        assert_eq!(said(&point, &faces), "true");
        let off = said(&sun(), &[parallel([0.1, -1.0, 0.0])]);
        assert!(off.starts_with("the map of translucent occluders does not look along"), "{off}");
        assert!(said(&sun(), &[]).contains("0 translucent layers; give one layer, or one a cascade"));
        assert!(said(&sun(), &[parallel(DOWN); 17]).contains("at most 16"));
        assert!(said(&point, &faces[..1]).contains("a point light has 1 translucent layers; give six faces"));
        assert!(said(&spot(), &[cone([1.0, 2.0, 3.1], UP, DOWN)]).contains("not at the lamp"));
    }

    #[test]
    fn more_cascades_than_a_layout_holds_are_an_error() {
        let maps = [parallel(DOWN); 17];
        assert_eq!(message(&sun(), MapLayout::new(MapKind::Cascades, &maps[..16]), None), "");
        assert!(message(&sun(), MapLayout::new(MapKind::Cascades, &maps), None).contains("at most 16"));
        assert!(message(&sun(), MapLayout::new(MapKind::Cascades, &[]), None).contains("at least one"));
    }
}
