//! The f32 form against the exact one: lengths, places, lobes, cones, colours and extremes.

use fearless_simd::Simd;

use super::*;
use crate::camera::{Camera, ViewRay};
use crate::medium::Scattering;
use crate::ray_light::RayLight;

const AHEAD: ViewRay = ViewRay { origin: DVec3::ZERO, direction: DVec3::NEG_Z };

/// All that this CPU can run.
fn levels() -> Vec<Level> {
    let avx2 = Level::new().as_avx2().map(|simd| simd.level());
    [Level::new(), Level::baseline()].into_iter().chain(avx2).collect()
}

/// Largest error of sixteen intervals of as many rays, by the channel's exact value, or that of `scale` if it is
/// another light.
fn worst_error(
    light: &Light,
    scale: &Light,
    medium: &Medium,
    ray: impl Fn(usize) -> ViewRay,
    interval: impl Fn(usize) -> [f32; 2],
) -> f64 {
    let fast = LampIntegralF32::new(light, medium, DVec3::ZERO).unwrap();
    let [a, b] = [0, 1].map(|end| std::array::from_fn(|lane| interval(lane)[end]));
    let mut worst = 0.0f64;
    let exact: Vec<[DVec3; 2]> = (0..LANES)
        .map(|lane| {
            [light, scale].map(|light| {
                let exact = RayLight::new(light, medium, DVec3::ZERO, &ray(lane));
                exact.interval(a[lane].into(), b[lane].into())
            })
        })
        .collect();
    for level in levels() {
        let values = fast.intervals(level, &RayLanes::from_fn(&ray), &a, &b);
        for (lane, [exact, scale]) in exact.iter().enumerate() {
            for channel in 0..3 {
                let value = values[channel][lane];
                assert!(value.is_finite() && value >= 0.0, "{value}");
                // Where the light has crossed an optical depth of 87, f32 has no normal numbers left.
                if scale[channel] > 1e-30 {
                    worst = worst.max((f64::from(value) - exact[channel]).abs() / scale[channel]);
                }
            }
        }
    }
    worst
}

/// The largest so far, and what it was about.
#[derive(Debug, Default)]
struct Worst(f64, String);

impl Worst {
    fn see(&mut self, error: f64, of: impl Fn() -> String) {
        if error > self.0 {
            *self = Self(error, of());
        }
    }
}

/// Of the value: 6e-6 of it the quadrature's, the rest by rounding of σ·(t + d), up to 87·2⁻²⁴, and of ten factors.
const BOUND: f64 = 1.2e-5;

#[test]
fn the_bound_holds_over_the_stated_range() {
    let intervals =
        [[0.0f32, 1.0], [0.0, 0.125], [0.375, 0.75], [0.5, 0.503_906_25], [0.875, 1.0], [0.0, f32::INFINITY]];
    let mut worst = Worst::default();
    for g in [-0.99, -0.9, -0.5, 0.0, 0.4, 0.7, 0.95, 0.99] {
        for sigma_d in [1e-6f64, 1e-3, 0.1, 1.0, 5.0, 30.0, 200.0, 1e3] {
            for h in [0.0, 1e-5, 1e-3, 0.03, 0.1, 0.3, 1.0] {
                for closest in [-0.5, 0.01, 0.25, 0.5, 1.5] {
                    let phase = Phase::HenyeyGreenstein { g };
                    let medium = Medium::homogeneous([sigma_d; 3], [0.0; 3], phase).unwrap();
                    let light = Light::point([h, 0.0, -closest], [1.0; 3], 0.0).unwrap();
                    let mut see = |interval: &dyn Fn(usize) -> [f32; 2]| {
                        let error = worst_error(&light, &light, &medium, |_| AHEAD, interval);
                        worst.see(error, || {
                            format!("g {g} σD {sigma_d} h {h} t₀ {closest} {:?}", interval(0))
                        });
                    };
                    // Alone, and beside the others, whose length chooses the panels.
                    for interval in intervals {
                        see(&|_| interval);
                    }
                    see(&|lane| intervals[lane % intervals.len()]);
                }
            }
        }
    }
    println!("LampIntegralF32: worst relative error {:.2e} at {}", worst.0, worst.1);
    assert!(worst.0 < BOUND, "{worst:?}");
}

#[test]
fn panels_of_any_length_keep_the_bound() {
    // Lengths in ln r from 0.01 to 16 in small steps: each rule is used up to its end, and beyond by the next.
    let mut worst = Worst::default();
    for g in [-0.99, 0.0, 0.5, 0.99] {
        for sigma in [1e-6, 0.3, 2.0, 8.0] {
            let phase = Phase::HenyeyGreenstein { g };
            let medium = Medium::homogeneous([sigma; 3], [0.0; 3], phase).unwrap();
            for begin in [-100.0f32, -5.0, -0.7, 0.0, 2.0, 30.0] {
                let light = Light::point([1.0, 0.0, -101.0], [1.0; 3], 0.0).unwrap();
                let from = 101.0 + begin;
                for step in 0..320 {
                    let log_r = begin.asinh() + 0.01 + 0.05 * step as f32;
                    let interval = [from, 101.0 + log_r.sinh()];
                    // σ·(t + d) up to 45 or so: what is left is f32's.
                    let sigma_limit = 40.0 / (f64::from(from) + f64::from(begin).hypot(1.0));
                    if sigma > sigma_limit || interval[1] <= from {
                        continue;
                    }
                    let error = worst_error(&light, &light, &medium, |_| AHEAD, |_| interval);
                    worst.see(error, || format!("g {g} σ {sigma} {interval:?}"));
                }
            }
        }
    }
    println!("LampIntegralF32: worst error of a panel {:.2e} at {}", worst.0, worst.1);
    assert!(worst.0 < BOUND, "{worst:?}");
}

/// Air with two kinds of particles, a clear channel and one that is a thousand times as thick.
fn coloured_air(g: f64) -> Medium {
    Medium::new(
        vec![
            Scattering { sigma_s: [0.05, 0.0, 3.0], phase: Phase::Rayleigh },
            Scattering { sigma_s: [0.1, 0.0, 50.0], phase: Phase::HenyeyGreenstein { g } },
            Scattering { sigma_s: [0.01, 0.0, 0.0], phase: Phase::Isotropic },
        ],
        [0.01, 0.0, 0.0],
    )
    .unwrap()
}

#[test]
fn coloured_air_and_endless_rays_agree_with_the_exact_form() {
    let mut worst = Worst::default();
    for g in [-0.9, 0.8, 0.99] {
        for x in [0.0, 1e-4, 0.05, 2.0] {
            let light = Light::point([x, 0.0, -2.0], [3.0, 2.0, 1.0], 0.0).unwrap();
            for medium in [
                coloured_air(g),
                Medium::homogeneous([0.1; 3], [0.3; 3], Phase::Rayleigh).unwrap(),
                Medium::homogeneous([0.01, 0.02, 0.04], [0.0; 3], Phase::HenyeyGreenstein { g }).unwrap(),
                Medium::homogeneous([1e-9; 3], [0.0; 3], Phase::HenyeyGreenstein { g }).unwrap(),
            ] {
                for interval in [[0.0, f32::INFINITY], [0.0, 1e6], [0.0, 100.0], [1.5, 40.0], [8.0, 9.0]] {
                    let error = worst_error(&light, &light, &medium, |_| AHEAD, |_| interval);
                    worst.see(error, || format!("g {g} x {x} {interval:?} {:?}", medium.sigma_t()));
                }
            }
        }
    }
    println!("LampIntegralF32: worst error in coloured air {:.2e} at {}", worst.0, worst.1);
    assert!(worst.0 < BOUND, "{worst:?}");
}

#[test]
fn pictures_with_the_lamp_in_view_are_exact_around_it_too() {
    let up = [0.0, 1.0, 0.0];
    let mut worst = Worst::default();
    for lamp in [[0.0, 0.0, -5.0], [1e-4, 2e-5, -5.0], [0.5, 0.3, 2.0], [0.0, 0.0, 3.0]] {
        // Odd sizes: the middle pixel looks straight at the lamp or away from it.
        let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], up, 60.0, [47, 33]).unwrap();
        for g in [-0.7, 0.0, 0.95] {
            let phase = Phase::HenyeyGreenstein { g };
            let medium = Medium::homogeneous([0.1; 3], [0.02; 3], phase).unwrap();
            for radius in [0.0, 0.25] {
                let light = Light::point(lamp, [1.0; 3], radius).unwrap();
                for y in 0..33 {
                    for x in (0..47).step_by(LANES) {
                        let ray = |lane: usize| camera.pixel_ray(x + lane as u32, y);
                        let end = |lane: usize| [0.0, 0.5 + (lane as u32 + x * y) as f32 * 0.05];
                        let error = worst_error(&light, &light, &medium, ray, end);
                        worst.see(error, || format!("lamp {lamp:?} g {g} radius {radius} ({x}, {y})"));
                    }
                }
            }
        }
    }
    println!("LampIntegralF32: worst error of a pixel {:.2e} at {}", worst.0, worst.1);
    assert!(worst.0 < BOUND, "{worst:?}");
}

#[test]
fn cones_agree_with_the_exact_form_wherever_their_edges_fall() {
    let mut worst = Worst::default();
    let g = [0.0, 0.0, 0.6, -0.95, 0.99];
    for n in 0..1500 {
        let a = f64::from(n);
        let axis = [a.sin(), (1.7 * a).cos(), (0.6 * a).sin()];
        let outer = match n % 7 {
            0 => 90.0,
            1 => 0.02,
            _ => 5.0 + 80.0 * (0.5 + 0.5 * (0.9 * a).sin()),
        };
        // From no core at all to edges that coincide.
        let inner = outer * [0.0, 0.5, 0.9, 1.0][n as usize % 4];
        let position = [a.cos(), 1.0 - (n % 3) as f64, -3.0];
        let light = Light::spot(position, axis, [1.0; 3], inner, outer, 0.0).unwrap();
        let Light::Spot(spot) = &light else { unreachable!() };
        let bare = Light::point(position, [1.0; 3], 0.0).unwrap();
        let sigma = [1e-6, 0.1, 3.0][n as usize / 4 % 3];
        let medium = match n % 5 {
            0 => Medium::homogeneous([sigma; 3], [0.0; 3], Phase::Isotropic).unwrap(),
            1 => coloured_air(0.8),
            kind => {
                Medium::homogeneous([sigma; 3], [0.0; 3], Phase::HenyeyGreenstein { g: g[kind as usize] })
                    .unwrap()
            }
        };
        let ray = |lane: usize| match lane {
            // Along the cone's own directions, and to the lamp.
            0 => ViewRay { origin: DVec3::ZERO, direction: spot.direction() },
            1 => ViewRay { origin: DVec3::ZERO, direction: -spot.direction() },
            2 => ViewRay { origin: DVec3::ZERO, direction: DVec3::from(position).normalize() },
            _ => {
                let turn = DVec3::new(0.1 * (lane as f64).sin(), 0.1 * (lane as f64).cos(), -1.0);
                ViewRay { origin: DVec3::ZERO, direction: turn.normalize() }
            }
        };
        let bound = BOUND + 8.0 * 2f64.powi(-24) * spot.cone_slope();
        for interval in [[0.0f32, 10.0], [1.0, 2.5], [2.5, 3.5], [0.0, f32::INFINITY]] {
            let error = worst_error(&light, &bare, &medium, ray, |_| interval);
            worst.see(error / bound, || format!("{n}: {light:?} {interval:?}"));
        }
    }
    println!("LampIntegralF32: worst error with cones {:.2} of its bound at {}", worst.0, worst.1);
    assert!(worst.0 < 1.0, "{worst:?}");
}

#[test]
fn fading_panels_of_any_length_keep_the_bound() {
    let mut worst = Worst::default();
    for n in 0..6000 {
        // Numbers without a pattern, in [0, 1).
        let number =
            |i: u32| (f64::from(n) * [0.618_034, 0.754_878, 0.569_84, 0.819_173][i as usize]).fract();
        let (angle, outer) = (0.05 + 3.0 * number(0), 20.0 + 70.0 * number(1));
        let inner = outer * [0.0, 0.0, 0.5, 0.8][n as usize % 4];
        let axis = [(1.3 * f64::from(n)).sin(), (0.7 * f64::from(n)).cos(), (0.4 * f64::from(n)).sin()];
        let position = [0.0, 0.0, -3.0];
        let light = Light::spot(position, axis, [1.0; 3], inner, outer, 0.0).unwrap();
        let bare = Light::point(position, [1.0; 3], 0.0).unwrap();
        let phase = Phase::HenyeyGreenstein { g: [0.0, 0.7, -0.9, 0.99][n as usize / 4 % 4] };
        let sigma = [1e-6, 0.2, 1.0][n as usize / 16 % 3];
        let medium = Medium::homogeneous([sigma; 3], [0.0; 3], phase).unwrap();
        // Sixteen rays around the lamp: as many cuts through the cone, at the same distance.
        let ray = |lane: usize| {
            let (sin, cos) = (0.39 * lane as f64).sin_cos();
            let direction = DVec3::new(angle.sin() * cos, angle.sin() * sin, -angle.cos());
            ViewRay { origin: DVec3::ZERO, direction }
        };
        // Of a length up to 4.5 in ln r, somewhere on the ray.
        let (closest, distance) = (3.0 * angle.cos(), 3.0 * angle.sin());
        let first = (-closest / distance).asinh() + 2.0 * number(2);
        let ends = [first, first + 0.05 + 4.5 * number(3)].map(|w| (closest + distance * w.sinh()) as f32);
        let Light::Spot(spot) = &light else { unreachable!() };
        let bound = BOUND + 8.0 * 2f64.powi(-24) * spot.cone_slope();
        let error = worst_error(&light, &bare, &medium, ray, |_| ends.map(|t| t.max(0.0)));
        worst.see(error / bound, || format!("{n}: {light:?} {ends:?} {angle}"));
    }
    println!("LampIntegralF32: worst error of a fading panel {:.2} of its bound at {}", worst.0, worst.1);
    assert!(worst.0 < 1.0, "{worst:?}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let camera = Camera::perspective([0.0; 3], [0.3, 0.1, -1.0], [0.0, 1.0, 0.0], 60.0, [48, 21]).unwrap();
    let position = [0.5, 0.3, -3.0];
    let lobe = Medium::homogeneous([0.3; 3], [0.0; 3], Phase::HenyeyGreenstein { g: 0.6 }).unwrap();
    for light in [
        Light::point(position, [3.0, 2.0, 1.0], 0.0).unwrap(),
        Light::spot(position, [0.2, -1.0, -0.3], [3.0, 2.0, 1.0], 20.0, 35.0, 0.0).unwrap(),
    ] {
        for medium in [&lobe, &coloured_air(0.6)] {
            let fast = LampIntegralF32::new(&light, medium, DVec3::ZERO).unwrap();
            let image = |level: Level| -> Vec<u32> {
                let mut bits = Vec::new();
                for y in 0..21 {
                    for x in (0..48).step_by(LANES) {
                        let rays = RayLanes::of_pixels(&camera, x, y);
                        let ends = std::array::from_fn(|lane| 2.0 + (lane as u32 + x * y) as f32 * 0.01);
                        let rgb = fast.intervals(level, &rays, &[0.0; LANES], &ends);
                        bits.extend(rgb.as_flattened().iter().map(|value| value.to_bits()));
                    }
                }
                bits
            };
            let images: Vec<_> = levels().into_iter().map(image).collect();
            assert!(images.windows(2).all(|pair| pair[0] == pair[1]));
        }
    }
}

#[test]
fn empty_intervals_are_zero_and_extremes_are_finite() {
    for g in [-0.99, 0.0, 0.99] {
        for sigma in [0.0, 1e-30, 1e-9, 1.0, 1e9, 1e30] {
            let phase = Phase::HenyeyGreenstein { g };
            let medium = Medium::homogeneous([sigma; 3], [0.0; 3], phase).unwrap();
            for scale in [1e-12, 1.0, 1e5, 1e12] {
                for x in [0.0, 1e-9, 1.0] {
                    let light =
                        Light::spot([x * scale, 0.0, -scale], [0.3, 0.1, 1.0], [1e6; 3], 10.0, 60.0, 0.0);
                    let bare = Light::point([x * scale, 0.0, -scale], [1e6; 3], 0.0);
                    for light in [light.unwrap(), bare.unwrap()] {
                        let fast = LampIntegralF32::new(&light, &medium, DVec3::ZERO).unwrap();
                        let ends = [0.0, 1e-30, 1e-6, 1.0, 1e6, 1e30, f32::MAX, f32::INFINITY];
                        let a = std::array::from_fn(|lane| if lane < 8 { 0.0 } else { ends[lane - 8] });
                        let b: [f32; LANES] = std::array::from_fn(|lane| ends[lane % 8]);
                        for level in levels() {
                            let rgb = fast.intervals(level, &RayLanes::from_fn(|_| AHEAD), &a, &b);
                            for value in rgb.as_flattened() {
                                assert!(
                                    value.is_finite() && *value >= 0.0,
                                    "{g} {sigma} {scale} {x} {rgb:?}"
                                );
                            }
                            // [0, 0], and the eight empty ones.
                            for lane in [0, 8, 9, 10, 11, 12, 13, 14, 15] {
                                assert_eq!(rgb[1][lane], 0.0);
                            }
                        }
                    }
                }
            }
        }
    }
}
