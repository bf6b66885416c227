//! The scenes that the extremes are made from: one a kind of light, small, of odd sizes, each with lit and shadowed
//! stretches on most rays. A row changes one thing of them.

use glam::DVec3;
use scatter_core::{Camera, HeightFalloff, Light, Medium, ModelError, Phase, Projection, ViewRay};

use crate::scenario::{MapFrame, MapLayer, Scenario, Shadow, texels_of};

/// Pixels of most images: odd, wider than high, more than one packet of 4 or 8 pixels.
pub const SIZE: [u32; 2] = [13, 9];
/// Where most rays end that hit nothing \[world units\].
const FAR: f64 = 30.0;
/// The eye.
pub const EYE: DVec3 = DVec3::new(0.37, 1.63, 5.1);
/// What the camera looks at: where the shadows are.
pub const TARGET: DVec3 = DVec3::new(0.1, 1.1, 0.0);
const UP: [f64; 3] = [0.0, 1.0, 0.0];
/// The way of the light of [`sun`].
pub const SUN: DVec3 = DVec3::new(0.35, -1.0, 0.21);
/// The lamp of [`point`].
pub const LAMP: DVec3 = DVec3::new(-1.2, 2.6, 1.4);

/// A scene with its name.
pub type NamedScene = (&'static str, fn() -> Result<Scenario, ModelError>);

/// The kinds of light, each with its scene.
pub const SCENES: [NamedScene; 3] = [("sun", sun), ("point", point), ("spot", spot)];

/// The camera of most rows.
pub fn camera(size: [u32; 2]) -> Result<Camera, ModelError> {
    Camera::perspective(EYE.to_array(), TARGET.to_array(), UP, 60.0, size)
}

/// A little forward scattering, σt = 0.06: optical depths of about 1.
fn medium() -> Result<Medium, ModelError> {
    Medium::homogeneous([0.05; 3], [0.01; 3], Phase::henyey_greenstein(0.3)?)
}

/// Under a sun from above.
pub fn sun() -> Result<Scenario, ModelError> {
    sun_along(SUN, camera(SIZE)?)
}

/// Under a sun of any direction, its map around the target.
pub fn sun_along(direction: DVec3, camera: Camera) -> Result<Scenario, ModelError> {
    let light = Light::directional(direction.to_array(), [3.0, 3.0, 3.0])?;
    let frame = sun_frame(direction, TARGET, [7.3, 6.1], [24, 21]);
    // Depths around that of the target, 20; a third of the blocks holds nothing.
    let map = MapLayer::filled(frame, |i, j| block(i / 2, j / 2, 14.0, 12.0));
    scenario(camera, light, Shadow::Parallel(vec![map]))
}

/// The frame of a sun's map around a point, its plane 20 units before it; shifted by an odd part of a texel, so that
/// nothing lies on a texel's border by chance.
pub fn sun_frame(direction: DVec3, centre: DVec3, half: [f64; 2], size: [u32; 2]) -> MapFrame {
    let frame = MapFrame::along(DVec3::ZERO, direction, half, size, false);
    let shift = (frame.right() * 0.2371 + frame.up * 0.1173) * half[0] / f64::from(size[0]);
    MapFrame { origin: centre - 20.0 * frame.forward + shift, ..frame }
}

/// Beside a lamp.
pub fn point() -> Result<Scenario, ModelError> {
    point_at(LAMP, camera(SIZE)?)
}

/// Beside a lamp of any position.
pub fn point_at(position: DVec3, camera: Camera) -> Result<Scenario, ModelError> {
    let light = Light::point(position.to_array(), [20.0; 3], 0.0)?;
    let side = 11;
    let faces =
        (0..6).flat_map(|face| texels_of([side; 2], move |i, j| block(i + 5 * face, j + face, 0.4, 3.0)));
    scenario(camera, light, Shadow::Cube { side, texels: faces.collect() })
}

/// Under a lamp with a cone.
pub fn spot() -> Result<Scenario, ModelError> {
    let position = DVec3::new(1.5, 4.1, 2.2);
    spot_at(position, DVec3::new(0.05, 0.3, 0.1) - position, camera(SIZE)?)
}

/// Under a lamp with a cone of any place and direction.
pub fn spot_at(position: DVec3, direction: DVec3, camera: Camera) -> Result<Scenario, ModelError> {
    let outer: f64 = 35.0;
    let light = Light::spot(position.to_array(), direction.to_array(), [40.0; 3], 20.0, outer, 0.0)?;
    let frame = MapFrame::along(position, direction, [outer.to_radians().tan(); 2], [17; 2], true);
    let map = MapLayer::filled(frame, |i, j| block(i / 2, j / 2, 0.5, 6.0));
    scenario(camera, light, Shadow::Perspective(map))
}

/// Depths of a block of texels: `least` to `least + range`, or nothing in a third of the blocks.
fn block(i: u32, j: u32, least: f32, range: f32) -> f32 {
    // SplitMix64's finaliser: the same scene on every machine.
    let mut z = u64::from(i) << 32 | u64::from(j);
    z = (z ^ (z >> 30)).wrapping_add(0x9E37_79B9).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    let share = ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32;
    if share > 0.66 { f32::INFINITY } else { least + range * share / 0.66 }
}

/// A ground at y = 0 behind everything, in the medium of all scenes.
fn scenario(camera: Camera, light: Light, shadow: Shadow) -> Result<Scenario, ModelError> {
    let distances = ground(&camera);
    let medium = medium()?;
    Ok(Scenario {
        camera,
        distances,
        light,
        shadow,
        glass: None,
        smoke: None,
        medium,
        max_distance: FAR,
        rays: None,
    })
}

/// Distances to the plane y = 0 along the pixels' rays; `+∞` above the horizon.
pub fn ground(camera: &Camera) -> Vec<f32> {
    texels_of(camera.size(), |x, y| ground_at(camera.eye(), camera.pixel_ray(x, y)) as f32)
}

/// Distance to the plane y = 0.
pub fn ground_at(eye: DVec3, ray: ViewRay) -> f64 {
    let distance = -(eye + ray.origin).y / ray.direction.y;
    if ray.direction.y < -1e-9 && distance >= 0.0 { distance } else { f64::INFINITY }
}

impl Scenario {
    /// The same world seen by another camera.
    pub fn seen_by(self, camera: Camera) -> Self {
        Self { distances: ground(&camera), camera, rays: None, ..self }
    }

    /// The same world, every ray ending at `distance`.
    pub fn ending_at(self, distance: f32) -> Self {
        Self { distances: vec![distance; self.distances.len()], max_distance: distance.into(), ..self }
    }

    /// The same world in a medium of one grey component.
    pub fn in_medium(self, sigma_s: f64, sigma_a: f64, phase: Phase) -> Result<Self, ModelError> {
        Ok(Self { medium: Medium::homogeneous([sigma_s; 3], [sigma_a; 3], phase)?, ..self })
    }

    /// The same world with its medium as height fog.
    pub fn in_fog(self, up: DVec3, base_height: f64, scale_height: f64) -> Result<Self, ModelError> {
        let falloff = HeightFalloff::new(up.to_array(), base_height, scale_height)?;
        Ok(Self { medium: self.medium.with_height_falloff(falloff), ..self })
    }

    /// The same world with the fog's up and base height moved; a uniform medium stays.
    pub fn with_fog_moved(
        self,
        change: impl Fn(DVec3, f64, f64) -> (DVec3, f64, f64),
    ) -> Result<Self, ModelError> {
        match self.medium.height_falloff() {
            None => Ok(self),
            Some(falloff) => {
                let (up, base, scale) = change(falloff.up(), falloff.base_height(), falloff.scale_height());
                self.in_fog(up, base, scale)
            }
        }
    }

    /// The same world with every texel of its maps changed: `depth(old, column, row)`.
    pub fn with_depths(mut self, depth: impl Fn(f32, u32, u32) -> f32) -> Self {
        let change = |texels: &mut [f32], width: u32| {
            for (index, texel) in texels.iter_mut().enumerate() {
                let index = index as u32;
                *texel = depth(*texel, index % width, index / width);
            }
        };
        match &mut self.shadow {
            Shadow::None => {}
            Shadow::Parallel(layers) => {
                layers.iter_mut().for_each(|map| change(&mut map.texels, map.frame.size[0]));
            }
            Shadow::Perspective(map) => change(&mut map.texels, map.frame.size[0]),
            Shadow::Cube { side, texels } => change(texels, *side),
        }
        self
    }

    /// The same world with maps of `side` × `side` texels.
    pub fn with_map_side(mut self, side: u32) -> Self {
        let resized = |map: &mut MapLayer| {
            map.frame.size = [side; 2];
            map.frame.half[1] = map.frame.half[0];
            map.texels = texels_of([side; 2], |i, j| block(i, j, 0.5, 24.0));
        };
        match &mut self.shadow {
            Shadow::None => {}
            Shadow::Parallel(layers) => layers.iter_mut().for_each(resized),
            Shadow::Perspective(map) => resized(map),
            Shadow::Cube { side: own, texels } => {
                *own = side;
                *texels = (0..6)
                    .flat_map(|face| texels_of([side; 2], move |i, j| block(i + 3 * face, j, 0.5, 3.0)))
                    .collect();
            }
        }
        self
    }

    /// The whole world moved by `shift`.
    pub fn moved(mut self, shift: DVec3) -> Result<Self, ModelError> {
        let camera = &self.camera;
        let eye = (camera.eye() + shift).to_array();
        let target = (camera.eye() + shift + camera.forward()).to_array();
        let (up, size, window) = (camera.up().to_array(), camera.size(), camera.window());
        self.camera = match camera.projection() {
            Projection::Perspective => Camera::perspective_off_centre(eye, target, up, window, size)?,
            Projection::Orthographic => {
                Camera::orthographic(eye, target, up, window.top - window.bottom, size)?
            }
        };
        self.light = light_with(&self.light, |position| position + shift, |direction| direction)?;
        let move_frame = |frame: &mut MapFrame| frame.origin += shift;
        match &mut self.shadow {
            Shadow::Parallel(layers) => layers.iter_mut().for_each(|map| move_frame(&mut map.frame)),
            Shadow::Perspective(map) => move_frame(&mut map.frame),
            Shadow::None | Shadow::Cube { .. } => {}
        }
        if let Some(glass) = &mut self.glass {
            move_frame(&mut glass.frame);
        }
        self.with_fog_moved(|up, base, scale| (up, base + up.dot(shift), scale))
    }
}

/// The light at another place, with another direction.
pub fn light_with(
    light: &Light,
    place: impl Fn(DVec3) -> DVec3,
    turn: impl Fn(DVec3) -> DVec3,
) -> Result<Light, ModelError> {
    let strength = light.strength();
    match light {
        Light::Directional(sun) => Light::directional(turn(sun.direction()).to_array(), strength),
        Light::Point(lamp) => Light::point(place(lamp.position()).to_array(), strength, lamp.radius()),
        Light::Spot(spot) => Light::spot(
            place(spot.lamp().position()).to_array(),
            turn(spot.direction()).to_array(),
            strength,
            spot.cos_inner().clamp(-1.0, 1.0).acos().to_degrees(),
            spot.outer().to_degrees(),
            spot.lamp().radius(),
        ),
    }
}
