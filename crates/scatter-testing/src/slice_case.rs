//! Random frames with maps and views that epipolar slices are hard on: regular texels, light from before, behind and
//! across, the eye inside of the map and outside.

use glam::DQuat;
use proptest::prelude::*;
use scatter_core::{Camera, Light, MapProjection};

use crate::owned_frame::{MapKind, OwnedFrame};
use crate::random::Random;
use crate::random_frame::{Recipe, turned_faces};

/// What the texels of the random frame's maps are replaced by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texels {
    /// Nothing: they are random already.
    Random,
    /// One near depth.
    Constant,
    /// A near and a far depth in turn.
    Checkerboard,
    /// Columns of one to four texels, every other one empty.
    Slabs,
    /// Slabs of 32 texels and more: two tiles of 16.
    WideSlabs,
    /// Blocks of 23 × 19 texels of all of these, no multiple of a tile.
    Mixed,
}

/// Where the camera looks, seen from the light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Facing {
    /// Near the origin.
    Anywhere,
    /// The epipole is on screen, or not far from it.
    Towards,
    /// The anti-epipole is.
    Away,
    /// The light is parallel to the image plane, the epipole at infinity.
    Across,
}

/// One of these frames: what it is drawn from, small enough to be printed.
#[derive(Debug, Clone, Copy)]
pub struct SliceCase {
    /// Seed of everything that is not named here.
    pub seed: u64,
    /// The light's map.
    pub kind: MapKind,
    /// What is in it.
    pub texels: Texels,
    /// Where the camera looks.
    pub facing: Facing,
    /// Whether the eye is ten units away, outside of every map, or within three.
    pub outside: bool,
}

/// Cases with maps of every kind, by weights. Their maps are smaller than a tile of 16 texels.
pub fn slice_cases() -> impl Strategy<Value = SliceCase> {
    let kind = prop_oneof![
        3 => Just(MapKind::Orthographic),
        2 => Just(MapKind::Cascades),
        1 => Just(MapKind::Faces),
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
        .prop_map(|(seed, kind, texels, facing, outside)| SliceCase { seed, kind, texels, facing, outside })
}

impl SliceCase {
    /// The frame, of 11 × 7 pixels.
    pub fn frame(self) -> OwnedFrame {
        self.frame_of([11, 7], None)
    }

    /// The frame with an image of `size`, and maps of one size where that is given; maps with perspective are square, of
    /// their width.
    pub fn frame_of(self, size: [u32; 2], map: Option<[u32; 2]>) -> OwnedFrame {
        let mut frame = OwnedFrame::random(self.seed, Recipe { size, ..Recipe::of(self.kind) });
        if let Some(map) = map {
            frame.projections = projections(&frame, map);
            frame.texels = vec![vec![0.0; (map[0] * map[1]) as usize]; frame.projections.len()];
            if frame.projections[0].is_perspective() {
                frame.texels.iter_mut().for_each(|texels| texels.resize((map[0] * map[0]) as usize, 0.0));
            }
        }
        let mut random = Random(self.seed ^ 0x5EED);
        frame.camera = self.camera(&frame.light, size, &mut random);
        frame.max_distance = random.range(3.0, 6.0) + if self.outside { 9.0 } else { 0.0 };
        self.fill(&mut frame, &mut random, map.is_some());
        frame
    }

    fn camera(self, light: &Light, size: [u32; 2], random: &mut Random) -> Camera {
        // Ten units away is outside of every map, and inside of it is half of the time within.
        let eye = random.direction() * if self.outside { 10.0 } else { random.range(0.5, 3.0) };
        let to_light = match light {
            Light::Directional(sun) => -sun.direction(),
            lamp => (lamp.position().expect("a lamp has a position") - eye).normalize(),
        };
        let slightly = random.direction() * random.range(0.0, 0.5);
        let forward = match self.facing {
            Facing::Anywhere => (random.direction() * 0.4 - eye).normalize(),
            Facing::Towards => to_light + slightly,
            Facing::Away => slightly - to_light,
            Facing::Across => to_light.cross(random.direction()),
        };
        let up = random.direction();
        let degrees = random.range(30.0, 110.0);
        Camera::perspective(eye.into(), (eye + forward).into(), up.into(), degrees, size).unwrap()
    }

    /// Replaces the texels of all maps; random ones only where the map `is_new`.
    fn fill(self, frame: &mut OwnedFrame, random: &mut Random, is_new: bool) {
        let (near, far) = (random.range(0.5, 5.0) as f32, random.range(1.0, 9.0) as f32);
        let slab = if self.texels == Texels::WideSlabs { 32 } else { 1 } + random.below(4) as usize;
        for (texels, projection) in frame.texels.iter_mut().zip(&frame.projections) {
            let width = projection.size()[0] as usize;
            for (index, texel) in texels.iter_mut().enumerate() {
                let (i, j) = (index % width, index / width);
                *texel = match self.texels.at(i, j) {
                    Texels::Constant | Texels::Mixed => near,
                    Texels::Checkerboard => {
                        if (i + j).is_multiple_of(2) {
                            near
                        } else {
                            far
                        }
                    }
                    Texels::Slabs | Texels::WideSlabs if (i / slab).is_multiple_of(2) => near,
                    Texels::Slabs | Texels::WideSlabs => f32::INFINITY,
                    Texels::Random if !is_new => *texel,
                    Texels::Random => {
                        let depth = random.range(0.05, 9.0) as f32;
                        if random.below(4) > 0 { depth } else { f32::INFINITY }
                    }
                };
            }
        }
    }
}

impl Texels {
    /// What stands in column `i` of row `j`.
    fn at(self, i: usize, j: usize) -> Self {
        match self {
            Self::Mixed => match (i / 23 + 2 * (j / 19)) % 5 {
                0 => Self::Constant,
                1 => Self::Checkerboard,
                2 => Self::Slabs,
                3 => Self::WideSlabs,
                _ => Self::Random,
            },
            same => same,
        }
    }
}

/// The projections of a frame's kind of light, as its own, with another number of texels.
fn projections(frame: &OwnedFrame, size: [u32; 2]) -> Vec<MapProjection> {
    let up = [0.3, 0.1, 0.9];
    match &frame.light {
        Light::Directional(sun) => {
            // One map, or cascades: the second is turned against the first, the third holds both.
            let map = |aside: f64, up: [f64; 3], extent: [f64; 2]| {
                let origin = aside * sun.direction().any_orthonormal_vector() - 4.1 * sun.direction();
                MapProjection::orthographic(origin.into(), sun.direction().into(), up, extent, size).unwrap()
            };
            match frame.kind {
                MapKind::Cascades => vec![
                    map(0.7, up, [0.9, 1.1]),
                    map(-0.4, [0.9, 0.2, -0.3], [1.5, 1.2]),
                    map(0.1, up, [2.7, 2.2]),
                ],
                _ => vec![map(0.0, up, [2.7, 2.2])],
            }
        }
        Light::Spot(spot) if frame.kind == MapKind::Spot => {
            let (lamp, forward) = (spot.lamp().position().into(), spot.direction().into());
            vec![MapProjection::perspective(lamp, forward, up, 0.9, size[0]).unwrap()]
        }
        light if frame.kind == MapKind::Faces => {
            let lamp = light.position().expect("faces are a lamp's");
            turned_faces(lamp, DQuat::from_rotation_x(0.5), 1.1, || size[0])
        }
        light => {
            let lamp = light.position().expect("a cube map is a lamp's").into();
            (0..6).map(|face| MapProjection::cube_face(lamp, face, size[0]).unwrap()).collect()
        }
    }
}
