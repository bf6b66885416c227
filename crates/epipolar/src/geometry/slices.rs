//! Slices: the image lines through the epipole on which light is integrated, and their sinh distribution (Baran et
//! al. 2010, Section 8).
//!
//! Every slice leaves the image through a point of its border. On an edge at the pixel distance h from the epipole,
//! exits `h·sinh(α/h)` at equal steps of α are as far from each other, measured across the slices, as the spacing
//! asks for; closer to the epipole slices only get denser. At spacing 1 no pixel centre is farther than half a pixel
//! from a slice (shown by brute force in the tests).
//!
//! Beyond the paper: slices come in **fans**. A fan holds the slices that leave through one edge and are steeper, or
//! flatter, than 45°, with its two border lines included. In a flat fan every slice has one point per pixel column,
//! so that pixels lie between two slices of their own column and can be interpolated along it; in a steep fan the
//! same holds for rows. Each pixel belongs to exactly one fan.

use glam::DVec2;

use super::epipole::Epipole;

/// Which of the two image axes a fan's slices are counted along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Major {
    /// Flat slices: one point a column, interpolated down the column.
    X,
    /// Steep slices: one point a row, interpolated along the row.
    Y,
}

impl Major {
    /// The component along the slice.
    pub fn of(self, p: DVec2) -> f64 {
        match self {
            Self::X => p.x,
            Self::Y => p.y,
        }
    }

    /// The component across the slice.
    pub fn minor_of(self, p: DVec2) -> f64 {
        match self {
            Self::X => p.y,
            Self::Y => p.x,
        }
    }
}

/// One image line through the epipole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slice {
    /// Where it leaves the image, in pixels.
    pub exit: DVec2,
    /// Change of the minor coordinate per pixel of the major one, |slope| ≤ 1 to rounding.
    pub slope: f64,
}

impl Slice {
    /// The slice that leaves the image at `exit`.
    pub fn through(epipole: &Epipole, major: Major, exit: DVec2) -> Self {
        let direction = epipole.towards(exit);
        Self { exit, slope: major.minor_of(direction) / major.of(direction) }
    }

    /// The minor coordinate at a major coordinate, in pixels.
    pub fn minor_at(&self, major: Major, along: f64) -> f64 {
        major.minor_of(self.exit) + self.slope * (along - major.of(self.exit))
    }
}

/// Slices that leave through one edge of the image on one side of the 45° lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fan {
    /// The axis along which its slices are counted.
    pub major: Major,
    /// Whether the major coordinate grows away from the epipole.
    pub ascending: bool,
    /// Index of its first slice; slices are sorted by their minor coordinate.
    pub first: usize,
    /// Number of its slices, ≥ 2.
    pub count: usize,
}

/// All slices of a frame, in fans; buffers are kept from frame to frame (Baran et al. 2010, Section 8).
///
/// Exits are at `h·sinh(α/h)` on an edge h pixels from the epipole: no pixel's centre is farther than half the spacing from a
/// slice (shown by brute force in the tests), with 13 % fewer slices than uniform exits for an epipole in the middle
/// of a 4:3 image and half of them for one near a corner. Fans, which the paper does not have, are the slices through one edge
/// on one side of the 45° lines: in each of their columns pixels lie between two slices. O(slices).
#[derive(Debug, Clone, Default)]
pub struct SliceSet {
    /// The fans, in any order.
    pub fans: Vec<Fan>,
    /// Their slices, fan after fan.
    pub slices: Vec<Slice>,
}

/// Distances beyond which an edge and the epipole are infinitely far apart, in image sizes. Larger, and the sinh
/// formula loses exits to rounding (1e-16·h); smaller, and slices are uniform where they need not be.
const FAR: f64 = 1e7;

impl SliceSet {
    /// Distributes slices over an image of `size` pixels, at most `spacing` pixels apart (> 0).
    ///
    /// Allocates only where an image is larger or a spacing finer than all before.
    pub fn distribute(&mut self, epipole: &Epipole, size: [u32; 2], spacing: f64) {
        self.reserve(size, spacing);
        self.lay(epipole, size, spacing);
    }

    fn lay(&mut self, epipole: &Epipole, size: [u32; 2], spacing: f64) {
        self.fans.clear();
        self.slices.clear();
        each_fan(epipole, size, |edge, range| self.add_fan(epipole, edge, range, spacing));
    }

    /// Distributes about `count` slices, evenly in angle where they are dense: at the finest spacing that takes no more of
    /// them. Returns that spacing \[pixels\].
    ///
    /// Every fan has two slices at least, so fewer than two dozen cannot always be had: then it is the coarsest spacing,
    /// the image's diagonal. Cost: sixty counts of a few exits each, then one distribution.
    pub fn distribute_count(&mut self, epipole: &Epipole, size: [u32; 2], count: usize) -> f64 {
        let [width, height] = size.map(f64::from);
        // The number of slices falls with the spacing, in steps: bisection over octaves, to the last bits of the quotient.
        let (mut fine, mut coarse) = ((1.0 / count.max(1) as f64).min(1e-3), width.hypot(height).max(1.0));
        for _ in 0..60 {
            let middle = (fine * coarse).sqrt();
            let mut taken = 0;
            each_fan(epipole, size, |edge, range| {
                taken += ExitSteps::new(epipole, edge, range, middle).count + 1;
            });
            if taken <= count { coarse = middle } else { fine = middle }
        }
        // No more than were asked for, but for the two of every fan: room that does not depend on where the epipole is.
        self.slices.reserve(count.max(2 * MOST_FANS).saturating_sub(self.slices.len()));
        self.fans.reserve(MOST_FANS.saturating_sub(self.fans.len()));
        self.lay(epipole, size, coarse);
        coarse
    }

    /// Makes room for slices at a spacing, wherever the epipole is; returns for how many.
    pub fn reserve(&mut self, size: [u32; 2], spacing: f64) -> usize {
        let [width, height] = size.map(f64::from);
        // Uniform exits need no more than a slice a step of the perimeter and a few for the ends of fans; sinh needs
        // fewer. Diagonal uniform exits of an infinitely far epipole need less than the perimeter, too.
        let most = (2.0 * (width + height) / spacing).ceil() as usize + 4 * MOST_FANS;
        self.slices.reserve(most.saturating_sub(self.slices.len()));
        self.fans.reserve(MOST_FANS.saturating_sub(self.fans.len()));
        most
    }

    fn add_fan(&mut self, epipole: &Epipole, edge: &Edge, [from, to]: [f64; 2], spacing: f64) {
        let middle = epipole.towards(edge.point(0.5 * (from + to)));
        let flat = middle.x.abs() >= middle.y.abs();
        let major = if flat { Major::X } else { Major::Y };
        let first = self.slices.len();
        let steps = ExitSteps::new(epipole, edge, [from, to], spacing);
        for index in 0..=steps.count {
            self.slices.push(Slice::through(epipole, major, edge.point(steps.exit(index))));
        }
        let count = self.slices.len() - first;
        // Sorted by the minor coordinate where the middle one leaves: exits may run the other way round.
        let fan = &mut self.slices[first..];
        let probe = major.of(fan[count / 2].exit);
        if fan[0].minor_at(major, probe) > fan[count - 1].minor_at(major, probe) {
            fan.reverse();
        }
        self.fans.push(Fan { major, ascending: major.of(middle) > 0.0, first, count });
    }
}

/// Four edges, each cut at most twice.
const MOST_FANS: usize = 12;

/// Calls `fan` for every part of an image's border through which slices leave on one side of the 45° lines, with its edge
/// and its range along it.
fn each_fan(epipole: &Epipole, size: [u32; 2], mut fan: impl FnMut(&Edge, [f64; 2])) {
    let [width, height] = size.map(f64::from);
    let edges = [
        Edge { at: width, length: height, axis: Major::X, ascending: true },
        Edge { at: 0.0, length: height, axis: Major::X, ascending: false },
        Edge { at: height, length: width, axis: Major::Y, ascending: true },
        Edge { at: 0.0, length: width, axis: Major::Y, ascending: false },
    ];
    for edge in &edges {
        let corners = [edge.point(0.0), edge.point(edge.length)];
        let ahead = edge.axis.of(epipole.towards(corners[0])) * if edge.ascending { 1.0 } else { -1.0 };
        if !(ahead > 0.0) {
            continue; // Light leaves through other edges.
        }
        let across = corners.map(|corner| edge.axis.minor_of(epipole.towards(corner)));
        // Ends of the flat part, where the slices are at 45°: |across| = ahead, and `across` grows by w a pixel.
        let w = epipole.image.z;
        let mut cuts = [0.0, edge.length, edge.length, edge.length];
        let mut count = 1;
        for target in [-ahead, ahead] {
            if across[0] < target && target < across[1] {
                cuts[count] = ((target - across[0]) / w).clamp(0.0, edge.length);
                count += 1;
            }
        }
        cuts[count] = edge.length;
        for piece in 0..count {
            let range = [cuts[piece], cuts[piece + 1]];
            if range[1] > range[0] {
                fan(edge, range);
            }
        }
    }
}

/// One edge of the image.
struct Edge {
    at: f64,
    length: f64,
    /// The axis that it is perpendicular to.
    axis: Major,
    /// Whether it is the edge with the larger coordinate.
    ascending: bool,
}

impl Edge {
    fn point(&self, along: f64) -> DVec2 {
        match self.axis {
            Major::X => DVec2::new(self.at, along),
            Major::Y => DVec2::new(along, self.at),
        }
    }
}

/// Exits on a part of an edge.
struct ExitSteps {
    count: usize,
    range: [f64; 2],
    sinh: Option<Sinh>,
}

struct Sinh {
    /// Pixel distance of the edge's line from the epipole.
    h: f64,
    /// Edge coordinate of the epipole's foot.
    foot: f64,
    alpha: [f64; 2],
}

impl ExitSteps {
    fn new(epipole: &Epipole, edge: &Edge, range: [f64; 2], spacing: f64) -> Self {
        let w = epipole.image.z;
        let towards = epipole.towards(edge.point(range[0]));
        let (ahead, across) = (edge.axis.of(towards).abs(), edge.axis.minor_of(towards));
        let far = w * FAR * edge.length.max(1.0) <= towards.length();
        let (length, sinh) = if far {
            // All slices are parallel: the spacing across them is the exits' times cos θ.
            ((range[1] - range[0]) * ahead / towards.length(), None)
        } else {
            let (h, foot) = (ahead / w, range[0] - across / w);
            let alpha = range.map(|exit| ((exit - foot) / h).asinh());
            (h * (alpha[1] - alpha[0]), Some(Sinh { h, foot, alpha }))
        };
        Self { count: (length / spacing).ceil().max(1.0) as usize, range, sinh }
    }

    fn exit(&self, index: usize) -> f64 {
        let [from, to] = self.range;
        let part = index as f64 / self.count as f64;
        match &self.sinh {
            // The ends are met exactly: neighbouring fans share them.
            _ if index == 0 => from,
            _ if index == self.count => to,
            None => from + (to - from) * part,
            Some(sinh) => {
                let alpha = sinh.alpha[0] + (sinh.alpha[1] - sinh.alpha[0]) * part;
                (sinh.foot + sinh.h * alpha.sinh()).clamp(from, to)
            }
        }
    }
}
