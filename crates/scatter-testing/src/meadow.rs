//! A meadow under floating leaves, seen by a person: a sun, a lamp and a spot over it, at any map size. For benches.

use scatter_core::{Camera, Light, MapProjection, Medium, Phase};

use crate::owned_frame::{MapKind, OwnedFrame};
use crate::random::Random;

/// A light of the meadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lighting {
    /// A sun through 30,000 leaves.
    Sun,
    /// A lamp eight units above the ground, behind blocks to all sides.
    Point,
    /// A spot in its place.
    Spot,
}

const SUN: [f64; 3] = [0.45, -0.8, 0.35];
const LAMP: [f64; 3] = [0.0, 8.0, 0.0];
const SPOT: [f64; 3] = [0.4, -0.5, 0.5];
const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// The meadow in an image of `size`, with maps of `side`² texels (six of them for the lamp).
pub fn meadow(lighting: Lighting, size: [u32; 2], side: u32) -> OwnedFrame {
    let camera =
        Camera::perspective([-20.0, 6.0, -30.0], [15.0, 5.0, 20.0], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let depth = (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
        .map(|(x, y)| {
            let down = -camera.pixel_ray(x, y).direction.y;
            if down > 0.0 { (6.0 / down) as f32 } else { f32::INFINITY }
        })
        .collect();
    let mut random = Random(1);
    let (kind, light, projections, texels) = match lighting {
        Lighting::Sun => {
            let origin = SUN.map(|c| -90.0 * c);
            let projection = MapProjection::orthographic(origin, SUN, UP, [60.0; 2], [side; 2]).unwrap();
            let texels = vec![leaves(&projection, &mut random)];
            (MapKind::Orthographic, Light::directional(SUN, [1.0; 3]), vec![projection], texels)
        }
        Lighting::Point => {
            let faces = (0..6).map(|face| MapProjection::cube_face(LAMP, face, side).unwrap()).collect();
            let texels = (0..6).map(|_| blocks(side, &mut random)).collect();
            (MapKind::Point, Light::point(LAMP, [10.0; 3], 0.0), faces, texels)
        }
        Lighting::Spot => {
            let projection = MapProjection::perspective(LAMP, SPOT, UP, 1.0, side).unwrap();
            let light = Light::spot(LAMP, SPOT, [10.0; 3], 30.0, 45.0, 0.0);
            (MapKind::Spot, light, vec![projection], vec![blocks(side, &mut random)])
        }
    };
    OwnedFrame {
        camera,
        depth,
        light: light.unwrap(),
        kind,
        projections,
        texels,
        medium: Medium::homogeneous([0.02; 3], [0.0; 3], Phase::HenyeyGreenstein { g: 0.6 }).unwrap(),
        texture: None,
        max_distance: 80.0,
    }
}

/// The ground, and discs above it.
fn leaves(projection: &MapProjection, random: &mut Random) -> Vec<f32> {
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
        let centre = [random.range(-50.0, 50.0), random.range(2.0, 14.0), random.range(-50.0, 50.0)];
        let p = projection.texel_from_world(centre.into());
        let radius = random.range(0.05, 0.35) * texels_per_unit;
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
fn blocks(side: u32, random: &mut Random) -> Vec<f32> {
    let coarse: Vec<f32> = (0..64 * 64)
        .map(|_| if random.below(2) == 0 { f32::INFINITY } else { random.range(1.0, 16.0) as f32 })
        .collect();
    (0..side * side).map(|k| coarse[(k / side * 64 / side * 64 + k % side * 64 / side) as usize]).collect()
}
