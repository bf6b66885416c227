//! Which pixels belong to a fan, and between which two of its slices they lie.
//!
//! Pixels are taken by the fan's columns (rows for a steep fan; both are called columns here). In each column the
//! fan's pixels are one range, and its slices cut that range into gaps. Every decision is made once and by one
//! formula, so that each pixel of the image is in exactly one gap of one fan, whatever rounding does; the one that
//! the epipole hits, or as good as hits ([`Epipole::too_near`]), is in none.

use glam::DVec2;

use super::epipole::Epipole;
use super::slices::{Fan, Major, Slice};

/// The columns of a fan, and the range of its pixels in each: `ranges` has an entry a column.
///
/// Every pixel of the image is in exactly one gap of one fan, whatever rounding does, but for those that are
/// [too near](Epipole::too_near) to the epipole, which are in none: one at the most, as long as a pixel is wider than 1e-6
/// of a radian. O(columns).
#[derive(Debug, Clone, Default)]
pub struct FanPixels {
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// Per column the first pixel and the one after the last; indices along the minor axis.
    pub ranges: Vec<[i32; 2]>,
}

impl FanPixels {
    /// Finds the pixels of a fan in an image of `size`. Keeps its buffer.
    pub fn find(&mut self, epipole: &Epipole, size: [u32; 2], fan: &Fan, slices: &[Slice]) {
        let [length, breadth] = match fan.major {
            Major::X => size,
            Major::Y => [size[1], size[0]],
        };
        self.ranges.clear();
        self.ranges.reserve(size[0].max(size[1]) as usize);
        let away = |column: u32| {
            let step = fan.major.of(epipole.towards(DVec2::splat(f64::from(column) + 0.5)));
            if fan.ascending { step > 0.0 } else { step < 0.0 }
        };
        // Columns on the fan's side of the epipole are a prefix or a suffix.
        let edge = first_true(length, |column| away(column) == fan.ascending);
        self.columns = if fan.ascending { [edge, length] } else { [0, edge] };
        let own = &slices[fan.first..][..fan.count];
        let (first, last) =
            (Border::new(epipole, fan, &own[0]), Border::new(epipole, fan, &own[fan.count - 1]));
        for column in self.columns[0]..self.columns[1] {
            let from = first.first_pixel(column, breadth);
            let to = last.first_pixel(column, breadth);
            // Pixels of a fan are no farther from the epipole across its columns than along them.
            let near = fan.major.of(epipole.towards(DVec2::splat(f64::from(column) + 0.5)));
            let is_too_near = near.abs() <= epipole.too_near * epipole.image.z;
            self.ranges.push([from, if is_too_near { from } else { to.max(from) }]);
        }
    }
}

/// The first number below `count` for which a monotone predicate holds, or `count`.
fn first_true(count: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut from, mut to) = (0, count);
    while from < to {
        let middle = from + (to - from) / 2;
        if holds(middle) {
            to = middle;
        } else {
            from = middle + 1;
        }
    }
    from
}

/// A line between two fans. Both ask the same question of it: on which side of it is a pixel's centre?
struct Border<'a> {
    major: Major,
    slice: &'a Slice,
    direction: DVec2,
    /// Whether the minor coordinate grows counter-clockwise around the epipole.
    positive: bool,
}

impl<'a> Border<'a> {
    fn new(epipole: &Epipole, fan: &Fan, slice: &'a Slice) -> Self {
        Self {
            major: fan.major,
            slice,
            direction: epipole.towards(slice.exit),
            positive: (fan.major == Major::X) == fan.ascending,
        }
    }

    /// The first pixel of a column behind the line. A centre on the line is counter-clockwise of it.
    fn first_pixel(&self, column: u32, breadth: u32) -> i32 {
        let along = f64::from(column) + 0.5;
        let guess =
            (self.slice.minor_at(self.major, along) - 0.5).ceil().clamp(0.0, f64::from(breadth)) as i32;
        let behind = |pixel: i32| {
            let across = f64::from(pixel) + 0.5;
            let centre = match self.major {
                Major::X => DVec2::new(along, across),
                Major::Y => DVec2::new(across, along),
            };
            (self.direction.perp_dot(centre - self.slice.exit) >= 0.0) == self.positive
        };
        // The guess is wrong only where rounding decides: by one pixel.
        if guess < breadth as i32 && !behind(guess) {
            guess + 1
        } else if guess > 0 && behind(guess - 1) {
            guess - 1
        } else {
            guess
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::slices::SliceSet;
    use super::*;

    fn epipole(x: f64, y: f64, w: f64) -> Epipole {
        Epipole { image: DVec3::new(x, y, w), to_light: DVec3::Z, outward: true, too_near: 0.03 }
    }

    /// Epipoles inside, on pixel centres and corners, on the border, outside, far outside, at infinity.
    fn epipoles() -> Vec<Epipole> {
        let mut all = Vec::new();
        for (x, y) in [
            (20.3, 11.7),
            (20.5, 11.5),
            (20.5 + 1e-9, 11.5 - 3e-10),
            (20.49, 11.525),
            (20.4, 11.49),
            (20.0, 11.0),
            (0.0, 0.0),
            (41.0, 0.0),
            (0.0, 9.3),
            (41.0, 23.0),
            (1e-3, 5.0),
            (-1e-3, 5.0),
            (20.0, -30.0),
            (-500.0, 11.5),
            (1e6, 3.0),
            (-1e6, -1e6),
            (3e9, -2e9),
            (1e15, 1e3),
        ] {
            all.push(epipole(x, y, 1.0));
        }
        for (x, y) in [(1.0, 0.0), (0.0, -1.0), (3.0, 2.0), (-1.0, 1.0), (-2.0, -3.0)] {
            all.push(epipole(x, y, 0.0));
        }
        all
    }

    #[test]
    fn every_pixel_is_in_exactly_one_gap_next_to_its_two_slices() {
        let size = [41, 23];
        for spacing in [1.0, 0.5, 0.25] {
            for epipole in epipoles() {
                let mut set = SliceSet::default();
                set.distribute(&epipole, size, spacing);
                let mut owners = vec![0; 41 * 23];
                let mut pixels = FanPixels::default();
                for fan in &set.fans {
                    pixels.find(&epipole, size, fan, &set.slices);
                    let own = &set.slices[fan.first..][..fan.count];
                    for (column, range) in (pixels.columns[0]..pixels.columns[1]).zip(&pixels.ranges) {
                        for pixel in range[0]..range[1] {
                            let (x, y) = match fan.major {
                                Major::X => (column, pixel as u32),
                                Major::Y => (pixel as u32, column),
                            };
                            owners[(y * 41 + x) as usize] += 1;
                            // Half the spacing across slices, or a slice on either side: both nearest ones are
                            // within the spacing, measured across.
                            let along = f64::from(column) + 0.5;
                            let across = f64::from(pixel) + 0.5;
                            let nearest = own
                                .iter()
                                .map(|slice| {
                                    let gap = (slice.minor_at(fan.major, along) - across).abs();
                                    gap / (1.0 + slice.slope * slice.slope).sqrt()
                                })
                                .fold(f64::INFINITY, f64::min);
                            assert!(
                                nearest <= 0.5 * spacing * (1.0 + 1e-3) + 1e-6,
                                "{epipole:?} {spacing}: pixel {x} {y} is {nearest} from its slice"
                            );
                            assert!(own.iter().all(|slice| slice.slope.abs() < 1.0 + 1e-6));
                        }
                    }
                }
                let hit = epipole.is_too_near(epipole.towards(DVec2::new(20.5, 11.5)));
                for (index, &owner) in owners.iter().enumerate() {
                    let expected = usize::from(!(hit && index == 11 * 41 + 20));
                    assert_eq!(owner, expected, "{epipole:?} {spacing}: pixel {} {}", index % 41, index / 41);
                }
            }
        }
    }
}
