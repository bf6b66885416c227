//! Small random frames of every kind of light, map, medium and camera.

use glam::{DQuat, DVec3};
use scatter_core::{Camera, Light, MapProjection, Medium, Phase, Scattering};

use crate::filling::random_depth;
use crate::owned_frame::{MapKind, OwnedFrame};
use crate::random::Random;

/// What a random frame is to have.
#[derive(Debug, Clone, Copy)]
pub struct Recipe {
    /// The light's map, and with it the kind of light.
    pub kind: MapKind,
    /// Largest side of a map in texels.
    pub map_side: u32,
    /// `[width, height]` of the image.
    pub size: [u32; 2],
    /// Whether coloured glass stands before the light.
    pub textured: bool,
    /// Where it lies: every position is shifted by it.
    pub centre: DVec3,
}

impl Recipe {
    /// An image of 5 × 3 pixels, maps of up to 13 texels along a side, no glass, around the origin.
    pub fn of(kind: MapKind) -> Self {
        Self { kind, map_side: 13, size: [5, 3], textured: false, centre: DVec3::ZERO }
    }
}

impl OwnedFrame {
    /// The frame of that seed: an eye half a unit to three units from the centre that looks near it (once in four times
    /// without perspective), a lamp 0.3 to 2.5 units from it, maps of random sizes with random depths, of which a quarter
    /// `+∞`, and one or two components in a medium of any thickness.
    pub fn random(seed: u64, recipe: Recipe) -> Self {
        let mut random = Random(seed);
        let r = &mut random;
        let Recipe { kind, map_side, size, textured, centre } = recipe;
        let eye = centre + r.direction() * r.range(0.5, 3.0);
        let target = centre + r.direction() * 0.4;
        let up = [0.1, 0.9, 0.3];
        let camera = if r.below(4) == 0 {
            Camera::orthographic(eye.into(), target.into(), up, r.range(0.5, 4.0), size)
        } else {
            Camera::perspective(eye.into(), target.into(), up, r.range(10.0, 110.0), size)
        }
        .unwrap();
        let pixels = size[0] * size[1];
        let depth = (0..pixels)
            .map(|_| if r.below(5) == 0 { f32::INFINITY } else { r.range(0.0, 7.0) as f32 })
            .collect();
        let forward = r.direction();
        // Drawn for suns too, so that a seed has the same view under every light.
        let lamp = centre + r.direction() * r.range(0.3, 2.5);
        let strength = r.rgb(0.1, 4.0);
        let outer = r.range(5.0, 75.0);
        let inner = outer * r.range(0.0, 1.0);
        let light = match kind {
            MapKind::Unshadowed | MapKind::Orthographic | MapKind::Cascades => {
                Light::directional(forward.into(), strength)
            }
            MapKind::Spot => Light::spot(lamp.into(), forward.into(), strength, inner, outer, 0.0),
            MapKind::SpotCube => Light::spot(lamp.into(), forward.into(), strength, 40.0, 88.0, 0.0),
            MapKind::Point | MapKind::Faces => Light::point(lamp.into(), strength, 0.0),
        }
        .unwrap();
        let side = |r: &mut Random| 1 + r.below(map_side);
        let map_up = [0.3, 0.1, 0.9];
        let sun_map = |r: &mut Random, half: f64| {
            let size = [side(r), side(r)];
            let origin = centre + r.direction() * 0.3 - forward * 4.0;
            let extent = [half * r.range(0.6, 1.0), half * r.range(0.6, 1.0)];
            MapProjection::orthographic(origin.into(), forward.into(), map_up, extent, size).unwrap()
        };
        let projections = match kind {
            MapKind::Unshadowed => vec![],
            MapKind::Orthographic => vec![sun_map(r, 3.0)],
            MapKind::Cascades => (1..=3).map(|n| sun_map(r, f64::from(n))).collect(),
            MapKind::Spot => {
                let tan = outer.to_radians().tan() * r.range(0.7, 1.0);
                let side = side(r);
                vec![MapProjection::perspective(lamp.into(), forward.into(), map_up, tan, side).unwrap()]
            }
            MapKind::SpotCube | MapKind::Point => {
                let side = side(r);
                (0..6).map(|face| MapProjection::cube_face(lamp.into(), face, side).unwrap()).collect()
            }
            MapKind::Faces => {
                let (axis, angle) = (r.direction(), r.range(0.0, 6.0));
                let tan_half = r.range(1.0, 1.2);
                turned_faces(lamp, DQuat::from_axis_angle(axis, angle), tan_half, || 1 + r.below(map_side))
            }
        };
        let far = if matches!(kind, MapKind::Orthographic | MapKind::Cascades) { 8.0 } else { 4.0 };
        let texels = projections
            .iter()
            .map(|p| {
                let [width, height] = p.size();
                (0..width * height).map(|_| random_depth(r, far)).collect()
            })
            .collect();
        let texture = textured.then(|| {
            let side = side(r);
            let projection = if light.position().is_none() {
                sun_map(r, 1.5)
            } else {
                MapProjection::perspective(lamp.into(), forward.into(), map_up, 0.8, side).unwrap()
            };
            let [width, height] = projection.size();
            let glass = (0..width * height).map(|_| r.rgb(0.0, 2.0).map(|c| c as f32)).collect();
            (projection, glass)
        });
        Self {
            camera,
            depth,
            light,
            kind,
            projections,
            texels,
            medium: random_medium(r),
            texture,
            max_distance: r.range(3.0, 6.0),
        }
    }
}

/// Six square faces around a lamp, turned as a whole, each half of a field of view with that tangent (1 and more cover the
/// sphere) and a side of its own.
pub fn turned_faces(
    lamp: DVec3,
    turn: DQuat,
    tan_half: f64,
    mut side: impl FnMut() -> u32,
) -> Vec<MapProjection> {
    const LOOKS: [(DVec3, DVec3); 6] = [
        (DVec3::X, DVec3::Y),
        (DVec3::NEG_X, DVec3::Z),
        (DVec3::Y, DVec3::X),
        (DVec3::NEG_Y, DVec3::X),
        (DVec3::Z, DVec3::NEG_Y),
        (DVec3::NEG_Z, DVec3::Y),
    ];
    let face = |(forward, up): (DVec3, DVec3)| {
        let (forward, up) = ((turn * forward).into(), (turn * up).into());
        MapProjection::perspective(lamp.into(), forward, up, tan_half, side()).expect("a sane face")
    };
    LOOKS.map(face).into()
}

/// One or two components, σs up to 10⁻³ to 2 a unit, half of them grey.
fn random_medium(r: &mut Random) -> Medium {
    let phase = |r: &mut Random| match r.below(3) {
        0 => Phase::Isotropic,
        1 => Phase::Rayleigh,
        _ => Phase::HenyeyGreenstein { g: r.range(-0.9, 0.9) },
    };
    let thickness = r.range(-3.0, 0.3);
    let scale = 10f64.powf(thickness);
    let mut components: Vec<_> =
        (0..1 + r.below(2)).map(|_| Scattering { sigma_s: r.rgb(0.0, scale), phase: phase(r) }).collect();
    if r.below(2) == 0 {
        for component in &mut components {
            component.sigma_s = [component.sigma_s[0]; 3];
        }
        return Medium::new(components, [0.1 * scale; 3]).unwrap();
    }
    Medium::new(components, r.rgb(0.0, scale)).unwrap()
}
