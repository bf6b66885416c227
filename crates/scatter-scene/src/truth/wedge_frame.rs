//! The wedge between the shadow planes of neighbouring view rays under a sun, and triangles in it.
//!
//! Coordinates relative to the eye: x along the wedge's middle, y across it, a towards the sun. Within the wedge the
//! distance c from its edge is between x and x over the cosine of half of its angle. All is conservative by
//! [`MARGIN`]: bounds of a triangle hold what the f64 cut of any plane of the wedge finds of it.

use glam::{DVec2, DVec3, Vec4};

use crate::tree::{Bvh, F32_ROUNDING, Node};

/// Widest wedge \[radians\]: beyond it the rays share too little.
const WIDEST: f64 = 0.05;
/// What a wedge is wider on each side than its planes' angles, which are known to 1e-15.
const ANGLE_MARGIN: f64 = 1e-11;
/// Margin of all comparisons, as a share of the coordinates behind a number: 4000 roundings of f64.
const MARGIN: f64 = 1e-12;
/// Smallest share of the product of two edges that a triangle's area, as the sun sees it, must be for its plane to be
/// used: the gradients' rounding is below 1e-9 of them then.
const STEEP: f64 = 1e-6;
/// Margin of a plane's height as a share of the coordinates, for each unit of its gradient.
const PLANE_MARGIN: f64 = 1e-8;

/// A wedge in space.
#[derive(Debug, Clone, Copy)]
pub(super) struct WedgeFrame {
    eye: DVec3,
    middle: DVec3,
    side: DVec3,
    sun: DVec3,
    /// Inner normals of both sides.
    walls: [DVec3; 2],
    /// Of half of the angle.
    tangent: f64,
    cosine: f64,
    /// Largest c of interest, and smallest a/c.
    pub farthest: f64,
    lowest_slope: f64,
}

/// A triangle's part in the wedge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Smallest and largest c, ≥ 0.
    pub c: [f64; 2],
    /// Largest a.
    pub highest: f64,
    /// Its corners `(x, y)` and its plane; `None` if the sun sees it nearly edge on.
    pub sheet: Option<Sheet>,
}

/// A triangle as a height a over `(x, y)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sheet {
    corners: [DVec2; 3],
    /// Height at the first corner.
    a: f64,
    gradient: DVec2,
    /// Of positions, and of heights.
    margin: [f64; 2],
}

/// Linear functions of the position that say whether a box meets the wedge where blockers matter, in f32.
#[derive(Debug, Clone, Copy)]
pub(super) struct WedgeBox {
    columns: [Vec4; 3],
    bias: Vec4,
    margin: Vec4,
    farthest: f32,
}

impl WedgeFrame {
    /// The wedge about the line through `eye` towards the `sun` (a unit vector) that holds the half planes in the
    /// directions `across` (unit vectors, perpendicular to the line). `farthest` is the largest distance from the line
    /// that counts, and `lowest_slope` the smallest height a, as a multiple of the distance. `None` if they do not lie
    /// in a narrow wedge.
    pub fn new(
        eye: DVec3,
        sun: DVec3,
        across: impl Iterator<Item = DVec3> + Clone,
        farthest: f64,
        lowest_slope: f64,
    ) -> Option<Self> {
        let middle = across.clone().sum::<DVec3>().try_normalize()?;
        let middle = (middle - sun * middle.dot(sun)).try_normalize()?;
        let side = sun.cross(middle);
        let largest = across.map(|u| u.dot(side).atan2(u.dot(middle)).abs()).fold(0.0, f64::max);
        let half = largest + ANGLE_MARGIN;
        if !(half <= 0.5 * WIDEST) {
            return None;
        }
        let (sine, cosine) = half.sin_cos();
        let walls = [middle * sine + side * cosine, middle * sine - side * cosine];
        Some(Self { eye, middle, side, sun, walls, tangent: sine / cosine, cosine, farthest, lowest_slope })
    }

    /// The functions for the boxes of a tree.
    pub fn box_test(&self, bvh: &Bvh) -> WedgeBox {
        // Distances from both walls; the distance along the middle; the height over the lowest ray, whose c is at most
        // x over the cosine.
        let slope = if self.lowest_slope < 0.0 { self.lowest_slope / self.cosine } else { self.lowest_slope };
        let rows = [self.walls[0], self.walls[1], self.middle, self.sun - slope * self.middle];
        let centre = bvh.centre - self.eye;
        let of_rows = |f: &dyn Fn(usize) -> f64| Vec4::from_array([0, 1, 2, 3].map(|row| f(row) as f32));
        let bias = of_rows(&|row| rows[row].dot(centre));
        // As in `shadow_plane::BoxShadow`.
        let cancelled = of_rows(&|row| MARGIN * rows[row].abs().dot(bvh.centre.abs() + self.eye.abs()));
        WedgeBox {
            columns: [0, 1, 2].map(|axis| of_rows(&|row| rows[row][axis])),
            bias,
            margin: bias.abs() * (8.0 * F32_ROUNDING) + cancelled,
            // Rounded up.
            farthest: self.farthest as f32 * (1.0 + f32::EPSILON) + f32::MIN_POSITIVE,
        }
    }

    /// A triangle's part in the wedge; `None` if nothing of it counts. `corners` in world space.
    pub fn part(&self, corners: [DVec3; 3]) -> Option<Part> {
        let largest =
            corners.iter().map(|p| p.abs().max_element()).fold(self.eye.abs().max_element(), f64::max);
        let margin = MARGIN * largest;
        let q = corners.map(|p| p - self.eye);
        // Cut by both walls, in order: each adds a corner at the most.
        let mut polygon = [DVec3::ZERO; 5];
        polygon[..3].copy_from_slice(&q);
        let mut count = 3;
        for wall in self.walls {
            count = cut_by(&mut polygon, count, wall, margin);
        }
        if count == 0 {
            return None;
        }
        let (mut x, mut a) = ([f64::INFINITY, f64::NEG_INFINITY], [f64::INFINITY, f64::NEG_INFINITY]);
        for p in &polygon[..count] {
            let (along, height) = (p.dot(self.middle), p.dot(self.sun));
            x = [x[0].min(along), x[1].max(along)];
            a = [a[0].min(height), a[1].max(height)];
        }
        let c = [(x[0] - margin).max(0.0), (x[1] + 2.0 * margin) / self.cosine];
        let highest = a[1] + margin;
        let lowest_c = if self.lowest_slope < 0.0 { c[1] } else { c[0] };
        if c[1] < 0.0 || c[0] > self.farthest || highest < self.lowest_slope * lowest_c - margin {
            return None;
        }
        Some(Part { c, highest, sheet: self.sheet(q, margin) })
    }

    fn sheet(&self, q: [DVec3; 3], margin: f64) -> Option<Sheet> {
        let corners = q.map(|q| DVec2::new(q.dot(self.middle), q.dot(self.side)));
        let (first, second) = (q[1] - q[0], q[2] - q[0]);
        let normal = first.cross(second);
        let area = normal.dot(self.sun);
        if !(area.abs() > STEEP * first.length() * second.length()) {
            return None;
        }
        let gradient = DVec2::new(normal.dot(self.middle), normal.dot(self.side)) / -area;
        let height = (PLANE_MARGIN / MARGIN) * margin * (1.0 + gradient.abs().element_sum());
        Some(Sheet { corners, a: q[0].dot(self.sun), gradient, margin: [margin, height] })
    }

    /// The corners `(x, y)` of a quadrilateral that holds all places of the wedge with c between two bounds.
    pub fn cell(&self, [low, high]: [f64; 2]) -> [DVec2; 4] {
        let low = low * self.cosine;
        let (near, far) = (low * self.tangent, high * self.tangent);
        [DVec2::new(low, -near), DVec2::new(low, near), DVec2::new(high, -far), DVec2::new(high, far)]
    }
}

/// Cuts a convex polygon by `normal·p ≥ −margin`; returns the number of its corners.
fn cut_by(polygon: &mut [DVec3; 5], count: usize, normal: DVec3, margin: f64) -> usize {
    let from = *polygon;
    let inside = |p: DVec3| normal.dot(p) + margin;
    let mut kept = 0;
    for index in 0..count {
        let (p, q) = (from[index], from[(index + 1) % count]);
        let (d, e) = (inside(p), inside(q));
        if d >= 0.0 {
            polygon[kept] = p;
            kept += 1;
        }
        if (d >= 0.0) != (e >= 0.0) {
            polygon[kept] = p + (q - p) * (d / (d - e));
            kept += 1;
        }
    }
    kept
}

impl Sheet {
    /// Smallest and largest height over a cell, without regard to the triangle's edges.
    pub fn heights(&self, cell: &[DVec2; 4]) -> [f64; 2] {
        let heights = cell.map(|p| self.a + self.gradient.dot(p - self.corners[0]));
        let low = heights.into_iter().fold(f64::INFINITY, f64::min);
        let high = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        [low - self.margin[1], high + self.margin[1]]
    }

    /// Whether the triangle, as the sun sees it, holds all of a cell.
    pub fn covers(&self, cell: &[DVec2; 4]) -> bool {
        let [a, b, c] = self.corners;
        let turn = (b - a).perp_dot(c - a).signum();
        [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| {
            let edge = (to - from) * turn;
            // 100 times, for the cut's own rounding of the edge.
            let room = 100.0 * self.margin[0] * edge.length();
            cell.iter().all(|p| edge.perp_dot(*p - from) > room)
        })
    }
}

impl WedgeBox {
    /// Whether something in the box may count.
    #[inline(always)]
    pub fn may_hold(&self, node: &Node) -> bool {
        let (c, h) = (node.centre(), node.half());
        let [x, y, z] = self.columns;
        let middle = x * c.x + y * c.y + z * c.z + self.bias;
        let reach = x.abs() * h.x + y.abs() * h.y + z.abs() * h.z + self.margin;
        let (low, high) = (middle - reach, middle + reach);
        // Comparisons with NaN (an overflow) keep the box.
        !(high.min_element() < 0.0 || low.z > self.farthest)
    }
}
