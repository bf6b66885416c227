//! Rooms whose walls are one sheet: the sun meets them from outside, and rays end inside on the very surface that its map holds.
//! Between its steps the last bit of a ray is lit or not, other for every pixel; in the dark that is all there is.

use epipolar::{Epipolar, Options};
use glam::DVec3;
use raymarch_ref::ShadowMapWalk;
use scatter_core::{Camera, HeightFalloff, Light, MapProjection, Medium, Phase, Quality};
use scatter_testing::{MapKind, OwnedFrame, values};

/// Where rays meet the room, of which they are inside or outside: a floor, a ceiling and a wall with a square window.
fn first_hit(origin: DVec3, direction: DVec3) -> f32 {
    let mut nearest = f64::INFINITY;
    let planes = [(0, 2.0), (1, -1.0), (1, 1.5)];
    for (axis, at) in planes {
        let t = (at - origin[axis]) / direction[axis];
        let p = origin + direction * t;
        let in_the_room = p.x <= 2.0 + 1e-9 && (-1.0 - 1e-9..=1.5 + 1e-9).contains(&p.y);
        let in_the_window = axis == 0 && (p.y - 0.2).abs() < 0.5 && (p.z - 0.1).abs() < 0.5;
        if t > 1e-9 && t < nearest && in_the_room && !in_the_window {
            nearest = t;
        }
    }
    nearest as f32
}

fn room(size: [u32; 2], map: [u32; 2]) -> OwnedFrame {
    let eye = DVec3::new(-1.25, 0.125, -0.75);
    let camera = Camera::perspective(eye.into(), [2.0, 0.6, 0.7], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let travels = DVec3::new(-0.75, -0.5, -0.0625).normalize();
    let origin = DVec3::new(0.5, 0.0, 0.0) - travels * 20.0;
    let projection =
        MapProjection::orthographic(origin.into(), travels.into(), [0.0, 1.0, 0.0], [5.0; 2], map).unwrap();
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
    let depth = pixels.map(|[x, y]| first_hit(eye, camera.pixel_ray(x, y).direction)).collect();
    let texels = (0..map[1]).flat_map(|j| (0..map[0]).map(move |i| [i, j]));
    let texels = texels.map(|[i, j]| {
        let (start, step) = projection.light_ray(f64::from(i) + 0.5, f64::from(j) + 0.5).unwrap();
        first_hit(start, step)
    });
    OwnedFrame {
        camera,
        depth,
        light: Light::directional(travels.into(), [10.0, 9.0, 7.5]).unwrap(),
        kind: MapKind::Orthographic,
        projections: vec![projection],
        texels: vec![texels.collect()],
        medium: Medium::homogeneous([0.05; 3], [0.01; 3], Phase::Isotropic).unwrap(),
        texture: None,
        max_distance: 100.0,
    }
}

/// p99 of the relative errors, those of what is darker than a hundredth of the mean relative to that (MODEL.md, "Error figures").
fn p99(found: &[[f64; 3]], truth: &[[f64; 3]]) -> f64 {
    let mean = truth.iter().flatten().sum::<f64>() / (3 * truth.len()) as f64;
    let pairs = found.iter().flatten().zip(truth.iter().flatten());
    let mut errors: Vec<f64> = pairs.map(|(&f, &t)| (f - t).abs() / t.max(0.01 * mean)).collect();
    errors.sort_unstable_by(f64::total_cmp);
    errors[(0.99 * (errors.len() - 1) as f64).ceil() as usize]
}

/// Without cut rays, and with slices a quarter of the preset's scale apart at the closest: 0.24, 0.060 and 0.013 in the uniform medium,
/// 0.14 and 0.046 in fog.
#[test]
fn presets_keep_their_level_where_the_dark_ends_on_steps_of_the_map() {
    let size = [331, 247];
    let uniform = room(size, [2003, 1987]);
    let falloff = HeightFalloff::new([0.0, 1.0, 0.0], -1.0, 1.5).unwrap();
    let fog = OwnedFrame { medium: uniform.medium.clone().with_height_falloff(falloff), ..uniform.clone() };
    for (name, frame, levels) in
        [("uniform", &uniform, &Quality::ALL[..]), ("fog", &fog, &[Quality::Preview, Quality::Game])]
    {
        let truth = values(&frame.render(&mut ShadowMapWalk::new()));
        for &level in levels {
            let found = values(&frame.render(&mut Epipolar::new(Options::for_quality(level, size))));
            let p99 = p99(&found, &truth);
            println!("{name}, {level}: p99 {p99:.5} of {}", level.error());
            assert!(p99 <= level.error(), "{name}, {level}: {p99}");
        }
    }
}
