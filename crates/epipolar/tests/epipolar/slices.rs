//! Slices at the size of the paper's images: no pixel far from its slice, and how many of them that takes.

use std::f64::consts::SQRT_2;

use epipolar::geometry::{Epipole, FanPixels, Major, SliceSet};
use glam::{DVec2, DVec3};

const SIZE: [u32; 2] = [1280, 960];

fn epipole(x: f64, y: f64) -> Epipole {
    Epipole { image: DVec3::new(x, y, 1.0), to_light: DVec3::Z, outward: true, too_near: 0.03 }
}

/// The farthest distance of a pixel's centre from the nearest slice of its fan, in pixels, measured across the slice;
/// and how many pixels have a fan.
fn farthest(epipole: &Epipole, spacing: f64) -> (f64, usize) {
    let mut set = SliceSet::default();
    set.distribute(epipole, SIZE, spacing);
    let mut pixels = FanPixels::default();
    let (mut worst, mut count) = (0.0f64, 0);
    for fan in &set.fans {
        pixels.find(epipole, SIZE, fan, &set.slices);
        let slices = &set.slices[fan.first..][..fan.count];
        for (column, range) in (pixels.columns[0]..pixels.columns[1]).zip(&pixels.ranges) {
            let along = f64::from(column) + 0.5;
            let mut next = 0;
            for pixel in range[0]..range[1] {
                let across = f64::from(pixel) + 0.5;
                while next < slices.len() && slices[next].minor_at(fan.major, along) < across {
                    next += 1;
                }
                let nearest = slices[next.saturating_sub(1)..(next + 1).min(slices.len())]
                    .iter()
                    .map(|slice| (slice.minor_at(fan.major, along) - across).abs() / slice.slope.hypot(1.0))
                    .fold(f64::INFINITY, f64::min);
                worst = worst.max(nearest);
                count += 1;
            }
        }
    }
    (worst, count)
}

#[test]
fn no_pixel_centre_is_farther_than_half_the_spacing_from_its_slice() {
    /// Neighbouring exits `h·sinh(α/h)` are `2h·tanh(1/2h)·cosh(α/h) ≤ cosh(α/h)` apart, and the pixel half way
    /// between them has half of that across the slice; slices turn by `1/(h·cosh)` from one to the next, which adds
    /// the third order of it where h is below a pixel. f64 with exits at 1e6·sinh: 1e-9.
    const TURNING: f64 = 2e-3;
    let epipoles = [
        ("centre", 640.0, 480.0),
        ("inside", 300.3, 777.7),
        ("on a pixel's centre", 300.5, 777.5),
        ("on a pixel's corner", 301.0, 777.0),
        ("corner", 0.0, 0.0),
        ("other corner", 1280.0, 960.0),
        ("near a corner", 20.0, 20.0),
        ("on the left border", 0.0, 333.3),
        ("on the lower border", 900.1, 960.0),
        ("a thousandth outside", -1e-3, 333.3),
        ("beside", 1700.0, 400.0),
        ("1e6 pixels to the right", 1e6, 480.3),
        ("1e6 pixels away", -1e6, -1e6),
    ];
    for (name, x, y) in epipoles {
        for spacing in [1.0, 4.0] {
            let epipole = epipole(x, y);
            let (worst, count) = farthest(&epipole, spacing);
            println!("{name}, spacing {spacing}: {:.5} of the spacing", worst / spacing);
            assert!(worst <= spacing * (0.5 + TURNING), "{name}, spacing {spacing}: {worst}");
            // The pixel that the epipole hits exactly has no direction.
            let hit = usize::from(name == "on a pixel's centre");
            assert_eq!(count, 1280 * 960 - hit, "{name}");
            // Not idle either: sinh slices are as far apart as they may be, but where an edge needs a single one.
            assert!(worst > 0.3 * spacing, "{name}, spacing {spacing}: {worst}");
        }
    }
}

/// Slices by the sinh formula alone, over whole edges, for an epipole inside: `Σ h·(asinh(b/h) − asinh(a/h))`.
fn by_formula(x: f64, y: f64) -> f64 {
    let [width, height] = SIZE.map(f64::from);
    let edge = |h: f64, foot: f64, length: f64| h * (((length - foot) / h).asinh() + (foot / h).asinh());
    edge(x, y, height) + edge(width - x, y, height) + edge(y, x, width) + edge(height - y, x, width)
}

#[test]
fn sinh_spacing_saves_slices_beside_a_uniform_perimeter() {
    // The paper's rule of one slice a pixel of the perimeter.
    let uniform = 2.0 * f64::from(SIZE[0] + SIZE[1]);
    // Shares of it that the formula gives, worked out by hand for the centre: 640·2·ln 2 twice (asinh ¾ = ln 2) and
    // 480·2·ln 3 twice (asinh 4/3 = ln 3).
    let centre = 2.0 * (1280.0 * 2f64.ln() + 960.0 * 3f64.ln());
    assert!((by_formula(640.0, 480.0) - centre).abs() < 1e-9);
    for (x, y, share) in [(640.0, 480.0, 0.867), (20.0, 20.0, 0.484), (1.0, 1.0, 0.437)] {
        let mut set = SliceSet::default();
        set.distribute(&epipole(x, y), SIZE, 1.0);
        let (found, formula) = (set.slices.len() as f64, by_formula(x, y));
        println!(
            "epipole ({x}, {y}): {found} slices in {} fans, formula {formula:.1}, share of uniform {:.4}",
            set.fans.len(),
            found / uniform
        );
        assert!((formula / uniform - share).abs() < 5e-4, "{}", formula / uniform);
        // Every fan rounds its steps up, and has one slice more than steps: its border, which its neighbour has too.
        assert!(found >= formula && found <= formula + 2.0 * set.fans.len() as f64);
        assert!(set.fans.len() <= 12);
    }
    // Uniform exits that keep the spacing everywhere need no fewer than the perimeter, but the exits of slices at 45°
    // are √2 apart: what uniform spacing across slices would save at best.
    assert!(centre / uniform > 1.0 / SQRT_2);
}

#[test]
fn slices_of_a_fan_ascend_across_it_in_every_column() {
    for (x, y) in [(640.3, 480.7), (-3.3, 20.1), (1e6, -1e5)] {
        let epipole = epipole(x, y);
        let mut set = SliceSet::default();
        set.distribute(&epipole, [161, 119], 1.0);
        let mut pixels = FanPixels::default();
        for fan in &set.fans {
            pixels.find(&epipole, [161, 119], fan, &set.slices);
            let slices = &set.slices[fan.first..][..fan.count];
            for column in pixels.columns[0]..pixels.columns[1] {
                let along = f64::from(column) + 0.5;
                for pair in slices.windows(2) {
                    assert!(pair[0].minor_at(fan.major, along) <= pair[1].minor_at(fan.major, along));
                    assert!(pair[0].slope.abs() <= 1.0 + 1e-9);
                }
            }
            let flat = slices.iter().all(|slice| {
                let away = epipole.towards(DVec2::from(slice.exit.to_array()));
                let ratio = Major::X.of(away).abs() - Major::Y.of(away).abs();
                (ratio * if fan.major == Major::X { 1.0 } else { -1.0 }) >= -1e-6 * away.length()
            });
            assert!(flat, "a fan's slices are all flat or all steep");
        }
    }
}
