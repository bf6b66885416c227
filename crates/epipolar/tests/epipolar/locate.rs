//! From a number of slices to slices, and from pixels back to the slices that they lie between.

use epipolar::geometry::{Epipole, FanPixels, Major, SliceMap, SliceSet};
use glam::{DVec2, DVec3};

const SIZE: [u32; 2] = [83, 57];

/// Epipoles inside, on a pixel's centre, on the border, outside, far away and at infinity.
fn epipoles() -> Vec<Epipole> {
    let places = [
        (40.2, 30.7, 1.0),
        (40.5, 30.5, 1.0),
        (0.0, 12.0, 1.0),
        (-30.0, 70.0, 1.0),
        (1e6, 3.0, 1.0),
        (1.0, 0.3, 0.0),
        (0.0, -1.0, 0.0),
    ];
    places
        .map(|(x, y, w)| Epipole {
            image: DVec3::new(x, y, w),
            to_light: DVec3::Z,
            outward: true,
            too_near: 0.03,
        })
        .into()
}

#[test]
fn every_pixel_is_found_between_its_two_slices_at_its_part_of_the_gap() {
    for epipole in epipoles() {
        for spacing in [0.5, 3.0] {
            let mut slices = SliceSet::default();
            slices.distribute(&epipole, SIZE, spacing);
            let mut pixels = vec![FanPixels::default(); slices.fans.len()];
            for (pixels, fan) in pixels.iter_mut().zip(&slices.fans) {
                pixels.find(&epipole, SIZE, fan, &slices.slices);
            }
            let map = SliceMap { slices: &slices, pixels: &pixels };
            for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let Some(place) = map.locate([x, y]) else {
                    assert_eq!(
                        epipole.towards(centre),
                        DVec2::ZERO,
                        "only the epipole's own pixel is nowhere"
                    );
                    continue;
                };
                let fan = slices.fans[place.fan];
                assert!((fan.first..fan.first + fan.count - 1).contains(&place.slice));
                let (along, across) =
                    if fan.major == Major::X { (centre.x, centre.y) } else { (centre.y, centre.x) };
                let [before, behind] =
                    [0, 1].map(|next| slices.slices[place.slice + next].minor_at(fan.major, along));
                // Minor coordinates up to 100 in f32, in a quotient by the gap's width.
                let tolerance = 4.0 * 100.0 * f64::from(f32::EPSILON);
                assert!(before <= across + tolerance && across <= behind + tolerance, "{epipole:?} {x} {y}");
                let part = f64::from(place.part) * (behind - before);
                assert!((part - (across - before)).abs() <= tolerance, "{epipole:?} {x} {y}: {part}");
            }
        }
    }
}

#[test]
fn a_given_number_of_slices_is_kept_and_nearly_used_up() {
    let size = [1280, 960];
    for epipole in epipoles() {
        for count in [64, 100, 512, 1024, 4096] {
            let mut slices = SliceSet::default();
            let spacing = slices.distribute_count(&epipole, size, count);
            let found = slices.slices.len();
            assert!(found <= count, "{epipole:?}: {found} of {count}");
            // A fan takes whole steps, so that a finer spacing would take more, by one a fan at the least.
            slices.distribute(&epipole, size, spacing * (1.0 - 1e-6));
            assert!(
                slices.slices.len() > count,
                "{epipole:?}: {count} slices could be closer than {spacing}"
            );
        }
        let mut slices = SliceSet::default();
        slices.distribute_count(&epipole, size, 0);
        assert!(slices.slices.len() <= 24, "two a fan and no more");
    }
}
