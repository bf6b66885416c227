//! Frames that are the same every time: one for each kind of map, boards in open air, and media.

use scatter_core::{Camera, Light, MapProjection, Medium, Phase, Scattering};

use crate::filling::Filling;
use crate::owned_frame::{MapKind, OwnedFrame};
use crate::random_frame::turned_faces;

/// Where the stock lamps hang, and how high above the origin a sun's map begins.
const ABOVE: [f64; 3] = [0.0, 8.0, 0.0];
/// Where the lamps with cube maps hang.
const LAMP: [f64; 3] = [0.0, 3.0, 0.0];
/// The way of a stock sun's light, and the axis of the spots.
const DOWN: [f64; 3] = [0.1, -1.0, 0.2];
/// What is up in their maps.
const MAP_UP: [f64; 3] = [0.0, 0.0, 1.0];

/// A grey medium, isotropic, of extinction 0.09 a unit: 2/3 of the light is extinguished over a dozen units.
pub fn grey_medium() -> Medium {
    Medium::homogeneous([0.08; 3], [0.01; 3], Phase::Isotropic).expect("a sane medium")
}

/// Two components with phase functions of their own, and every channel extinguished differently.
pub fn coloured_medium() -> Medium {
    let component = |phase| Scattering { sigma_s: [0.1, 0.2, 0.3], phase };
    let components = vec![component(Phase::Rayleigh), component(Phase::HenyeyGreenstein { g: 0.5 })];
    Medium::new(components, [0.0; 3]).expect("a sane medium")
}

impl OwnedFrame {
    /// A view of the origin from six units before it, a light of that kind above it, maps of `map_side` texels along a
    /// side (a sun's three quarters as high as wide), the second of two cascades around the first one, and rays that end
    /// four to twelve units away, never all alike in a row. In [`grey_medium`].
    pub fn stock(kind: MapKind, size: [u32; 2], map_side: u32, filling: Filling) -> Self {
        let parallel = |half: f64| {
            let size = [map_side, (3 * map_side).div_ceil(4)];
            MapProjection::orthographic(ABOVE, DOWN, MAP_UP, [half; 2], size).expect("a sane map")
        };
        let cube = || {
            (0..6)
                .map(|face| MapProjection::cube_face(LAMP, face, map_side).expect("a sane face"))
                .collect::<Vec<_>>()
        };
        let (light, projections) = match kind {
            MapKind::Unshadowed => (Light::directional(DOWN, [1.0; 3]), vec![]),
            MapKind::Orthographic => (Light::directional(DOWN, [1.0; 3]), vec![parallel(5.0)]),
            MapKind::Cascades => (Light::directional(DOWN, [1.0; 3]), vec![parallel(2.0), parallel(5.0)]),
            MapKind::Spot => {
                let cone =
                    MapProjection::perspective(ABOVE, DOWN, MAP_UP, 0.5, map_side).expect("a sane map");
                (Light::spot(ABOVE, DOWN, [5.0; 3], 10.0, 26.0, 0.0), vec![cone])
            }
            MapKind::SpotCube => (Light::spot(LAMP, DOWN, [5.0; 3], 40.0, 88.0, 0.0), cube()),
            MapKind::Point => (Light::point(LAMP, [5.0; 3], 0.0), cube()),
            MapKind::Faces => {
                let turn = glam::DQuat::from_rotation_y(0.4);
                (Light::point(LAMP, [5.0; 3], 0.0), turned_faces(LAMP.into(), turn, 1.1, || map_side))
            }
        };
        let camera = Camera::perspective([0.1, 1.0, 6.0], [0.0; 3], [0.0, 1.0, 0.0], 70.0, size);
        let mut frame = Self {
            camera: camera.expect("a sane camera"),
            depth: (0..size[0] * size[1]).map(|n| 4.0 + (n % 9) as f32).collect(),
            light: light.expect("a sane light"),
            kind,
            projections,
            texels: vec![],
            medium: grey_medium(),
            texture: None,
            max_distance: 20.0,
        };
        frame.fill(filling);
        frame
    }

    /// With blue glass of 16 × 16 panes before the light: over the middle of a sun's map, or seen from the lamp.
    pub fn with_glass(mut self) -> Self {
        let projection = match self.light.position() {
            None => MapProjection::orthographic(ABOVE, DOWN, MAP_UP, [2.0; 2], [16; 2]),
            Some(lamp) => MapProjection::perspective(lamp.into(), DOWN, MAP_UP, 0.8, 16),
        };
        self.texture = Some((projection.expect("sane glass"), vec![[0.5, 1.0, 2.0]; 16 * 16]));
        self
    }
}

/// Open air with three boards in it under a sun: few edges, as in a picture.
pub fn boards(size: [u32; 2]) -> OwnedFrame {
    let down = [0.3, -1.0, -0.2];
    let projection =
        MapProjection::orthographic([0.0, 6.0, 0.0], down, [0.1, 0.0, 1.0], [5.0, 4.0], [80, 64]);
    let mut texels = vec![f32::INFINITY; 80 * 64];
    for (i, j, depth) in [(18..31, 10..50, 3.0), (44..47, 5..60, 4.2), (60..72, 21..33, 3.6)] {
        for row in j {
            texels[row * 80..][i.clone()].fill(depth);
        }
    }
    let camera = Camera::perspective([0.2, 0.1, 6.0], [0.1, 0.4, 0.0], [0.0, 1.0, 0.0], 60.0, size);
    OwnedFrame {
        camera: camera.expect("a sane camera"),
        // A wall that leans: longer rays to the right.
        depth: (0..size[0] * size[1]).map(|n| 9.0 + (n % size[0]) as f32 / size[0] as f32).collect(),
        light: Light::directional(down, [1.0, 0.9, 0.8]).expect("a sane light"),
        kind: MapKind::Orthographic,
        projections: vec![projection.expect("a sane map")],
        texels: vec![texels],
        medium: grey_medium(),
        texture: None,
        max_distance: 20.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_a_frame_with_its_map_and_its_glass() {
        for kind in MapKind::ALL {
            for filling in [Filling::Constant(0.0), Filling::Random { seed: 1, far: 9.0 }] {
                let frame = OwnedFrame::stock(kind, [7, 4], 12, filling);
                let layers = frame.with(|frame| {
                    assert_eq!((frame.size(), frame.texture().is_some()), ([7, 4], false));
                    frame.shadow().layers().count()
                });
                let expected = match kind {
                    MapKind::Unshadowed => 0,
                    MapKind::Orthographic | MapKind::Spot => 1,
                    MapKind::Cascades => 2,
                    MapKind::SpotCube | MapKind::Point | MapKind::Faces => 6,
                };
                assert_eq!(layers, expected, "{kind:?}");
                assert!(frame.with_glass().with(|frame| frame.texture().is_some()), "{kind:?}");
            }
        }
    }

    #[test]
    fn boards_shade_a_part_of_what_is_seen() {
        boards([31, 17]).with(|frame| {
            let eye = frame.camera().eye();
            let seen = (0..31).map(|x| eye + frame.camera().pixel_ray(x, 8).direction * 6.0);
            let lit = seen.filter(|&p| frame.shadow().is_lit(p)).count();
            assert!((5..28).contains(&lit), "{lit} of 31");
        });
    }
}
