//! A meadow under floating leaves, seen by a person: a sun, a lamp and a spot over it, at any map size.

use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, MapProjection, Medium, Phase, ShadowLayer, ShadowMap,
};

/// A light of the meadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lighting {
    Sun,
    Point,
    Spot,
}

/// Everything that a frame borrows.
pub struct Meadow {
    camera: Camera,
    distances: Vec<f32>,
    light: Light,
    projection: MapProjection,
    texels: Vec<f32>,
    medium: Medium,
}

const SUN: [f64; 3] = [0.45, -0.8, 0.35];
const LAMP: [f64; 3] = [0.0, 8.0, 0.0];
const SPOT: [f64; 3] = [0.4, -0.5, 0.5];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

impl Meadow {
    /// An image of `size`, maps of `side`² texels (six of them for the lamp), 30,000 leaves for the sun.
    pub fn new(lighting: Lighting, size: [u32; 2], side: u32) -> Self {
        let camera =
            Camera::perspective([-20.0, 6.0, -30.0], [15.0, 5.0, 20.0], [0.0, 1.0, 0.0], 60.0, size).unwrap();
        let distances = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
            .map(|(x, y)| {
                let down = -camera.pixel_ray(x, y).direction.y;
                if down > 0.0 { (6.0 / down) as f32 } else { f32::INFINITY }
            })
            .collect();
        let mut random = numbers();
        let (light, projection, texels) = match lighting {
            Lighting::Sun => {
                let origin = SUN.map(|c| -90.0 * c);
                let projection = MapProjection::orthographic(origin, SUN, UP, [60.0; 2], [side; 2]).unwrap();
                let texels = leaves(&projection, &mut random);
                (Light::directional(SUN, [1.0; 3]), projection, texels)
            }
            Lighting::Point => {
                let projection = MapProjection::cube_face(LAMP, 0, side).unwrap();
                let texels = (0..6).flat_map(|_| blocks(side, &mut random)).collect();
                (Light::point(LAMP, [10.0; 3], 0.0), projection, texels)
            }
            Lighting::Spot => {
                let projection = MapProjection::perspective(LAMP, SPOT, UP, 1.0, side).unwrap();
                let texels = blocks(side, &mut random);
                (Light::spot(LAMP, SPOT, [10.0; 3], 30.0, 45.0, 0.0), projection, texels)
            }
        };
        let medium = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::HenyeyGreenstein { g: 0.6 }).unwrap();
        Self { camera, distances, light: light.unwrap(), projection, texels, medium }
    }

    /// Builds the frame and hands it over.
    pub fn with<R>(&self, use_frame: impl FnOnce(&Frame<'_>) -> R) -> R {
        let depth = DepthMap::new(&self.distances, self.camera.size()).unwrap();
        let side = self.projection.size()[0];
        let shadow = match self.light {
            Light::Point(_) => ShadowMap::Cube(CubeShadow::new(LAMP, side, &self.texels).unwrap()),
            Light::Spot(_) => {
                ShadowMap::Perspective(ShadowLayer::new(self.projection, &self.texels).unwrap())
            }
            Light::Directional(_) => {
                ShadowMap::Orthographic(ShadowLayer::new(self.projection, &self.texels).unwrap())
            }
        };
        use_frame(&Frame::new(&self.camera, depth, &self.light, &shadow, &self.medium, 80.0).unwrap())
    }
}

/// Numbers in [0, 1): Knuth's MMIX generator.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64
    }
}

/// The ground, and discs above it.
fn leaves(projection: &MapProjection, random: &mut impl FnMut() -> f64) -> Vec<f32> {
    let side = projection.size()[0];
    let mut texels: Vec<f32> = (0..side * side)
        .map(|k| {
            let (from, step) =
                projection.light_ray(f64::from(k % side) + 0.5, f64::from(k / side) + 0.5).unwrap();
            (-from.y / step.y) as f32
        })
        .collect();
    let texels_per_unit = f64::from(side) / 120.0;
    for _ in 0..30_000 {
        let centre = [100.0 * (random() - 0.5), 2.0 + 12.0 * random(), 100.0 * (random() - 0.5)];
        let p = projection.texel_from_world(centre.into());
        let radius = (0.05 + 0.3 * random()) * texels_per_unit;
        let range = |c: f64| (c - radius).max(0.0) as u32..((c + radius).max(0.0) as u32).min(side);
        for j in range(p.y) {
            for i in range(p.x) {
                if (f64::from(i) - p.x).hypot(f64::from(j) - p.y) < radius {
                    let texel = &mut texels[(j * side + i) as usize];
                    *texel = texel.min(p.z as f32);
                }
            }
        }
    }
    texels
}

/// 64 × 64 blocks, every other one empty.
fn blocks(side: u32, random: &mut impl FnMut() -> f64) -> Vec<f32> {
    let coarse: Vec<f32> = (0..64 * 64)
        .map(|_| if random() < 0.5 { f32::INFINITY } else { (1.0 + 15.0 * random()) as f32 })
        .collect();
    (0..side * side).map(|k| coarse[(k / side * 64 / side * 64 + k % side * 64 / side) as usize]).collect()
}
