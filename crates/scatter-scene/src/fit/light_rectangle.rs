//! Rectangles and rays in the plane across a sun's direction.

use glam::DVec2;

/// The sides of a rectangle lie on a grid of this share of its size (rounded up to a power of two), outwards. The depth of
/// a single pixel decides where a side lies; without a grid its last bit would move every texel of the map, and with
/// them the thinnest shafts. Larger: texels are wasted. Smaller: rounding moves the map more often.
const FIT_GRID: f64 = 1.0 / 4096.0;

/// A view ray as the sun sees it: `start + t·step`.
#[derive(Debug, Clone, Copy)]
pub struct FlatRay {
    pub start: DVec2,
    pub step: DVec2,
}

impl FlatRay {
    /// Where the ray is at t. An endless stretch that stays in a rectangle does not move at all: any finite t will do.
    pub fn at(&self, t: f64) -> DVec2 {
        self.start + self.step * t.min(f64::MAX)
    }
}

/// A rectangle in light space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    pub low: DVec2,
    pub high: DVec2,
}

impl Rectangle {
    pub const EMPTY: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    pub fn with(self, p: DVec2) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    pub fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn is_empty(&self) -> bool {
        !(self.low.x <= self.high.x && self.low.y <= self.high.y)
    }

    /// The rectangle with its sides moved outwards to the grid of [`FIT_GRID`].
    pub fn on_grid(&self) -> Self {
        let size = (self.high - self.low).max_element();
        let step = size.log2().ceil().exp2() * FIT_GRID;
        if !step.is_normal() {
            return *self;
        }
        Self { low: (self.low / step).floor() * step, high: (self.high / step).ceil() * step }
    }

    /// The part of the stretch `[from, to]` of a ray inside of the rectangle (Liang and Barsky 1984).
    pub fn clip(&self, ray: &FlatRay, [from, to]: [f64; 2]) -> Option<[f64; 2]> {
        if self.is_empty() {
            return None;
        }
        let FlatRay { start, step } = *ray;
        let (mut enter, mut leave) = (from, to);
        for axis in 0..2 {
            let (low, high) = (self.low[axis] - start[axis], self.high[axis] - start[axis]);
            if step[axis] == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = (low / step[axis], high / step[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some([enter, leave])
    }
}
