//! Random scenes with maps and views that rows are hard on: regular texels, light from before, behind and across.

use glam::DVec3;
use proptest::prelude::*;
use scatter_core::{Camera, Light, MapProjection};

use crate::random_scene::{MapKind, Random, Recipe, Scene};

/// What the texels of the random scene's maps are replaced by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texels {
    Random,
    Constant,
    Checkerboard,
    Slabs,
    /// Slabs of two tiles and more.
    WideSlabs,
    /// Blocks of all of these, no multiple of a tile.
    Mixed,
}

/// Where the camera looks, seen from the light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facing {
    Anywhere,
    Towards,
    Away,
    /// The light is parallel to the image plane, the epipole at infinity.
    Across,
}

/// One of them.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub seed: u64,
    pub kind: MapKind,
    pub texels: Texels,
    pub facing: Facing,
    pub outside: bool,
}

/// Small maps, smaller than a tile.
pub fn cases() -> impl Strategy<Value = Case> {
    let kind = prop_oneof![
        3 => Just(MapKind::Orthographic),
        2 => Just(MapKind::Cascades),
        2 => Just(MapKind::Spot),
        1 => Just(MapKind::SpotCube),
        2 => Just(MapKind::Point)
    ];
    let texels = prop_oneof![
        2 => Just(Texels::Random),
        1 => Just(Texels::Constant),
        1 => Just(Texels::Checkerboard),
        1 => Just(Texels::Slabs)
    ];
    let facing =
        prop_oneof![Just(Facing::Anywhere), Just(Facing::Towards), Just(Facing::Away), Just(Facing::Across)];
    (any::<u64>(), kind, texels, facing, any::<bool>())
        .prop_map(|(seed, kind, texels, facing, outside)| Case { seed, kind, texels, facing, outside })
}

impl Case {
    pub fn scene(self) -> Scene {
        self.scene_of([11, 7], None)
    }

    /// For an image of `size`, and maps of one size where that is given; maps with perspective are square, of their
    /// width.
    pub fn scene_of(self, size: [u32; 2], map: Option<[u32; 2]>) -> Scene {
        let mut scene = Scene::random(self.seed, Recipe { size, ..Recipe::of(self.kind) });
        if let Some(map) = map {
            scene.projections = projections(&scene, map);
            scene.texels = vec![vec![0.0; (map[0] * map[1]) as usize]; scene.projections.len()];
            if scene.projections[0].is_perspective() {
                scene.texels.iter_mut().for_each(|texels| texels.resize((map[0] * map[0]) as usize, 0.0));
            }
        }
        let mut random = Random(self.seed ^ 0x5EED);
        // Ten units away is outside of every map, and inside of it is half of the time within.
        let eye = random.direction() * if self.outside { 10.0 } else { random.range(0.5, 3.0) };
        let to_light = scene.light.position().map_or_else(
            || match &scene.light {
                Light::Directional(sun) => -sun.direction(),
                _ => DVec3::Y,
            },
            |lamp| (lamp - eye).normalize(),
        );
        let slightly = random.direction() * random.range(0.0, 0.5);
        let forward = match self.facing {
            Facing::Anywhere => (random.direction() * 0.4 - eye).normalize(),
            Facing::Towards => to_light + slightly,
            Facing::Away => slightly - to_light,
            Facing::Across => to_light.cross(random.direction()),
        };
        let up = random.direction();
        let degrees = random.range(30.0, 110.0);
        scene.camera =
            Camera::perspective(eye.into(), (eye + forward).into(), up.into(), degrees, size).unwrap();
        scene.max_distance = random.range(3.0, 6.0) + if self.outside { 9.0 } else { 0.0 };
        let sizes: Vec<_> = scene.projections.iter().map(|projection| projection.size()).collect();
        let (near, far) = (random.range(0.5, 5.0) as f32, random.range(1.0, 9.0) as f32);
        let slab = if self.texels == Texels::WideSlabs { 32 } else { 1 } + random.below(4) as usize;
        for (texels, [width, _]) in scene.texels.iter_mut().zip(sizes) {
            for (index, texel) in texels.iter_mut().enumerate() {
                let (i, j) = (index % width as usize, index / width as usize);
                let kind = match self.texels {
                    Texels::Mixed => match (i / 23 + 2 * (j / 19)) % 5 {
                        0 => Texels::Constant,
                        1 => Texels::Checkerboard,
                        2 => Texels::Slabs,
                        3 => Texels::WideSlabs,
                        _ => Texels::Random,
                    },
                    kind => kind,
                };
                let first = match kind {
                    Texels::Constant | Texels::Mixed => true,
                    Texels::Checkerboard => (i + j).is_multiple_of(2),
                    Texels::Slabs | Texels::WideSlabs => (i / slab).is_multiple_of(2),
                    // Those of a small scene are random already.
                    Texels::Random if map.is_none() => continue,
                    Texels::Random => {
                        *texel = random.range(0.05, 9.0) as f32;
                        random.below(4) > 0
                    }
                };
                *texel = match (kind, first) {
                    (Texels::Random, true) => *texel,
                    (Texels::Checkerboard, false) => far,
                    (_, true) => near,
                    (_, false) => f32::INFINITY,
                };
            }
        }
        scene
    }
}

/// The projections of a scene's kind of light, as its own, with another number of texels.
fn projections(scene: &Scene, size: [u32; 2]) -> Vec<MapProjection> {
    let up = [0.3, 0.1, 0.9];
    let lamp = scene.lamp.into();
    match &scene.light {
        Light::Directional(sun) => {
            // One map, or cascades: the second is turned against the first, the third holds both.
            let map = |aside: f64, up: [f64; 3], extent: [f64; 2]| {
                let origin = aside * sun.direction().any_orthonormal_vector() - 4.1 * sun.direction();
                MapProjection::orthographic(origin.into(), sun.direction().into(), up, extent, size).unwrap()
            };
            match scene.kind {
                MapKind::Cascades => vec![
                    map(0.7, up, [0.9, 1.1]),
                    map(-0.4, [0.9, 0.2, -0.3], [1.5, 1.2]),
                    map(0.1, up, [2.7, 2.2]),
                ],
                _ => vec![map(0.0, up, [2.7, 2.2])],
            }
        }
        Light::Spot(spot) if scene.kind == MapKind::Spot => {
            vec![MapProjection::perspective(lamp, spot.direction().into(), up, 0.9, size[0]).unwrap()]
        }
        _ => (0..6).map(|face| MapProjection::cube_face(lamp, face, size[0]).unwrap()).collect(),
    }
}
