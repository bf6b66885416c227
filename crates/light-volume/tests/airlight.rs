//! A lamp's airlight, three ways, against core's quadrature in f64: what each is off by, near the lamp and far from it, in thin and
//! thick air, over whole rays and short intervals.

use light_volume::airlight::{SunTable, exact_airlight};
use scatter_core::{LampIntegralF32, LampRay, Light, Medium, Phase, RayLanes, ViewRay, airlight, simd_level};
use scatter_testing::Random;

#[test]
fn what_each_closed_form_is_off_by() {
    let tables = [64, 256].map(|side| (side, SunTable::new(side, 10.0)));
    println!("median and worst relative error of 1600 intervals:");
    for (what, sigma_of, closest, length) in [
        ("thin, whole rays", 0.02, [0.05, 0.9], [5.0, 20.0]),
        ("thick, whole rays", 1.0, [0.05, 0.9], [5.0, 20.0]),
        ("past the lamp at 1/1000", 0.1, [1e-3, 2e-3], [5.0, 20.0]),
        ("intervals of a texel", 0.1, [0.05, 0.9], [0.01, 0.03]),
        ("lamp behind the eye", 0.1, [2.0, 3.0], [5.0, 20.0]),
    ] {
        let mut random = Random(3);
        let mut errors: [Vec<f64>; 4] = Default::default();
        let medium = Medium::homogeneous([sigma_of; 3], [0.0; 3], Phase::Isotropic).unwrap();
        for _ in 0..100 {
            // A lamp six units away at an angle; 2 and more: behind.
            let angle = random.range(closest[0], closest[1]);
            let direction = glam::DVec3::new(angle.sin(), 0.0, -angle.cos());
            let position = direction * 6.0;
            let light = Light::point(position.to_array(), [1.0; 3], 0.0).unwrap();
            let integral = LampIntegralF32::new(&light, &medium, glam::DVec3::ZERO).unwrap();
            let ray = |_| ViewRay { origin: glam::DVec3::ZERO, direction: glam::DVec3::NEG_Z };
            let (mut a, mut b) = ([0.0f32; 16], [0.0f32; 16]);
            for lane in 0..16 {
                a[lane] = if length[1] < 1.0 { random.range(0.0, 12.0) as f32 } else { 0.0 };
                b[lane] = a[lane] + random.range(length[0], length[1]) as f32;
            }
            let lamp = LampRay::new(glam::DVec3::ZERO, glam::DVec3::NEG_Z, position, 0.0);
            let quadrature = integral.intervals(simd_level(), &RayLanes::from_fn(ray), &a, &b)[0];
            for lane in 0..16 {
                let (from, to) = (f64::from(a[lane]), f64::from(b[lane]));
                let exact = airlight(sigma_of, lamp, from, to);
                let source = sigma_of / (4.0 * std::f64::consts::PI);
                let off = |value: f64| (value / exact - 1.0).abs();
                errors[0].push(off(f64::from(quadrature[lane]) / source));
                errors[1].push(off(exact_airlight(sigma_of, lamp, from, to)));
                for (errors, (_, table)) in errors[2..].iter_mut().zip(&tables) {
                    errors.push(off(table.airlight(sigma_of as f32, lamp, a[lane], b[lane]).into()));
                }
            }
        }
        let figures = errors.map(|mut errors| {
            errors.sort_by(f64::total_cmp);
            [errors[errors.len() / 2], errors[errors.len() - 1]]
        });
        println!("{what}: quadrature, exponential integral, tables of 64², 256²: {figures:?}");
        // What core states of its quadrature, and what cancels of the exponential integral over a texel.
        assert!(figures[0][1] < 2.3e-5, "{what}: {figures:?}");
        assert!(figures[1][1] < 1e-8, "{what}: {figures:?}");
    }
}
