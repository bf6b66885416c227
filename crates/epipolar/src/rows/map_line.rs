//! A slice's line through one shadow map, texel by texel, and what a stored depth means in rectified coordinates.
//!
//! The half-plane of a slice meets a map in a straight line. It is walked along the map's major axis of that line,
//! one texel column a step, with `t` counting texels from where the line enters. Within a column the line crosses at
//! most one border between two texels, so a column has one cell or two, which end at the true crossings.

use crate::geometry::{SlicePlane, diamond_angle};

/// "No surface", as a depth that survives products with image coordinates in f32.
pub(crate) const FARTHEST: f32 = 1e25;

/// A line through a map in the order in which view rays cross its light rays (rectification: Baran et al. 2010, Section 3).
///
/// `t` counts texels along the map's major axis of the line, from where the line enters. Numbers are f32, relative to the eye
/// and to a depth of the map: texel coordinates up to 2¹⁶ with an error of 2⁻⁸ texels at the most, depths with one of 1e-7 of
/// the map's range; `depth_along` is f64.
#[derive(Debug, Clone, Copy, Default)]
pub struct MapLine {
    /// Columns of texels that it crosses.
    pub columns: u32,
    /// Length along the major axis \[texels\].
    pub length: f32,
    /// Part of the first texel column before the start, 0 to 1.
    pub consumed: f32,
    /// Texel index of the first column along the major axis.
    pub first: i32,
    /// Its change a column: 1 or −1.
    pub advance: i32,
    /// Distance in memory of texels that are neighbours along the major and the minor axis.
    pub strides: [usize; 2],
    /// Last texel index along the minor axis.
    pub last_minor: f32,
    /// Minor texel coordinate at t = 0, and its change a texel.
    pub minor: [f32; 2],
    /// How γ follows from t.
    pub gamma: Gamma,
    /// A depth near those of the map, subtracted first: keeps the digits of maps whose eye is far away.
    pub depth_base: f32,
    /// The view ray that a texel's surface ends, counted in lit columns: numerator and denominator, each as factors
    /// of `1, t, z, t·z`.
    pub lit_columns: [[f32; 4]; 2],
    /// How the depths of points of the slice run along it.
    pub depth_along: DepthAlong,
}

/// The light ray at a place on the line, as the number γ that orders light rays from the eye on.
#[derive(Debug, Clone, Copy)]
pub enum Gamma {
    /// Of a sun, the distance of the light ray from the eye: at t = 0, and its change a texel.
    Distance([f32; 2]),
    /// Of a lamp, [`diamond_angle`] of the light ray's direction: towards the eye and across, each at t = 0 and its change a
    /// texel.
    Diamond([[f32; 2]; 2]),
}

/// Depths of a map over a slice's plane: what a view ray becomes on a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthAlong {
    /// Of a parallel map: `start + across·q + to_light·p` at a point `(q, p)` of the plane, q = γ.
    Parallel {
        /// Depth of the eye.
        start: f64,
        /// Its change a unit across.
        across: f64,
        /// Its change a unit towards the light.
        to_light: f64,
        /// γ at t = 0, and its change a texel.
        light_ray: [f64; 2],
    },
    /// Of a perspective map: a light ray is at `across·z` from the axis and `distance − towards·z` towards the light, at
    /// depth z.
    Perspective {
        /// Of the lamp from the eye.
        distance: f64,
        /// Part of the light ray's direction towards the eye, at t = 0 and its change a texel.
        towards: [f64; 2],
        /// Part of it across the axis.
        across: [f64; 2],
    },
}

impl Default for DepthAlong {
    fn default() -> Self {
        Self::Parallel { start: 0.0, across: 0.0, to_light: 0.0, light_ray: [0.0; 2] }
    }
}

/// A view ray on a line through a map: `start + per_texel·t` is its depth there, or one over its depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRayLine {
    /// Value at t = 0.
    pub start: f64,
    /// Its change a texel.
    pub per_texel: f64,
    /// Whether the value is 1/depth: perspective maps, in which lines stay lines in the inverse of depth.
    pub is_inverse: bool,
}

impl ViewRayLine {
    /// The map's depth of the point in which the view ray crosses the light ray at t.
    #[inline(always)]
    pub fn depth(&self, t: f64) -> f64 {
        let value = self.start + self.per_texel * t;
        if self.is_inverse { 1.0 / value } else { value }
    }
}

/// A [`MapLine`] for a GPU: 32-bit numbers alone, no enums. Made from the f64 geometry that a CPU keeps.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MapLineRecord {
    /// [`MapLine::columns`], first texel, its change a column, and 1 for a lamp's line (γ is a diamond angle).
    pub columns: u32,
    /// Texel index of the first column along the major axis.
    pub first: i32,
    /// Its change a column: 1 or −1.
    pub advance: i32,
    /// 0: γ is a distance; 1: it is a diamond angle.
    pub gamma_kind: u32,
    /// Distance in memory of texels that are neighbours along the major and the minor axis.
    pub strides: [u32; 2],
    /// Minor texel coordinate at t = 0, and its change a texel.
    pub minor: [f32; 2],
    /// Length along the major axis \[texels\].
    pub length: f32,
    /// Part of the first texel column before the start, 0 to 1.
    pub consumed: f32,
    /// Last texel index along the minor axis.
    pub last_minor: f32,
    /// Subtracted from depths first.
    pub depth_base: f32,
    /// γ at t: `[start, per texel]` of a distance and two zeros, or of the parts towards the eye and across.
    pub gamma: [f32; 4],
    /// As [`MapLine::lit_columns`], numerator then denominator.
    pub lit_columns: [f32; 8],
}

impl From<&MapLine> for MapLineRecord {
    fn from(line: &MapLine) -> Self {
        let (gamma_kind, gamma) = match line.gamma {
            Gamma::Distance([start, per_texel]) => (0, [start, per_texel, 0.0, 0.0]),
            Gamma::Diamond([[p0, p1], [q0, q1]]) => (1, [p0, p1, q0, q1]),
        };
        let [[a, b, c, d], [e, f, g, h]] = line.lit_columns;
        Self {
            columns: line.columns,
            first: line.first,
            advance: line.advance,
            gamma_kind,
            // A map has fewer than 2³² texels.
            strides: line.strides.map(|stride| stride as u32),
            minor: line.minor,
            length: line.length,
            consumed: line.consumed,
            last_minor: line.last_minor,
            depth_base: line.depth_base,
            gamma,
            lit_columns: [a, b, c, d, e, f, g, h],
        }
    }
}

impl Default for Gamma {
    fn default() -> Self {
        Self::Distance([0.0; 2])
    }
}

impl Gamma {
    /// γ at t.
    #[inline(always)]
    pub fn at(&self, t: f32) -> f32 {
        match self {
            Self::Distance([start, per_texel]) => start + per_texel * t,
            Self::Diamond([towards, across]) => {
                diamond_angle(towards[0] + towards[1] * t, across[0] + across[1] * t)
            }
        }
    }
}

impl MapLine {
    /// γ where the line begins and where it ends.
    pub fn gamma_span(&self) -> [f32; 2] {
        [self.gamma.at(0.0), self.gamma.at(self.length)]
    }

    /// The view ray of a column on this line: its depth in the map, or one over it, is linear in t.
    pub fn view_ray(&self, plane: &SlicePlane, column: f64) -> ViewRayLine {
        let ray = plane.view_ray(column);
        match self.depth_along {
            // p = q·(ray.y/ray.x) on the view ray.
            DepthAlong::Parallel { start, across, to_light, light_ray: [from, per_texel] } => {
                let per_gamma = across + to_light * ray.y / ray.x;
                ViewRayLine {
                    start: start + per_gamma * from,
                    per_texel: per_gamma * per_texel,
                    is_inverse: false,
                }
            }
            // Both on the light ray at depth z and on the view ray: across·z·ray.y = ray.x·(distance − towards·z).
            DepthAlong::Perspective { distance, towards, across } => {
                let inverse = |n: usize| (across[n] * ray.y + towards[n] * ray.x) / (distance * ray.x);
                ViewRayLine { start: inverse(0), per_texel: inverse(1), is_inverse: true }
            }
        }
    }

    /// The view coordinate of a surface: how many of a slice's `columns` columns, counted from the light and fractional,
    /// see the light ray at t lit if it ends at a stored depth (`+∞` for no surface). 0 to `columns`.
    #[inline(always)]
    pub fn view_coordinate(&self, t: f32, depth: f32, columns: f32) -> f32 {
        let z = depth.min(FARTHEST) - self.depth_base;
        let [n, d] = self.lit_columns;
        let numerator = (n[0] + z * n[2]) + (n[1] + z * n[3]) * t;
        let denominator = (d[0] + z * d[2]) + (d[1] + z * d[3]) * t;
        // Behind the camera all columns see it lit, or none. Compared with the denominator, for one that should be 0 (the
        // light is parallel to the image plane) may have any sign.
        let behind = if numerator < denominator { 0.0 } else { columns };
        let lit = if denominator > 0.0 { numerator / denominator } else { behind };
        lit.max(0.0).min(columns)
    }

    /// Calls `visit(γ, index)` for every texel that the line crosses, with γ where it enters it.
    pub fn for_each_texel(&self, mut visit: impl FnMut(f32, usize)) {
        let [minor, slope] = self.minor;
        let clamped = |minor: f32| minor.floor().max(0.0).min(self.last_minor);
        for column in 0..self.columns as i32 {
            let from = (column as f32 - self.consumed).max(0.0).min(self.length);
            let to = (column as f32 + 1.0 - self.consumed).min(self.length);
            let (a, b) = (clamped(minor + slope * from), clamped(minor + slope * to));
            let major = (self.first + self.advance * column) as usize * self.strides[0];
            visit(self.gamma.at(from), major + a as usize * self.strides[1]);
            if a != b {
                let crossing = ((a.max(b) - minor) / slope).max(from).min(to);
                visit(self.gamma.at(crossing), major + b as usize * self.strides[1]);
            }
        }
    }

    /// The texels that a line crosses, from `start` on with `step` a unit of t.
    pub(super) fn walk_from(
        size: [u32; 2],
        major: usize,
        start: [f64; 2],
        step: [f64; 2],
        length: f64,
    ) -> Option<Self> {
        let minor = 1 - major;
        let count = f64::from(size[major]);
        let at = start[major].clamp(0.0, count);
        let ascends = step[major] >= 0.0;
        let (first, consumed) = if ascends {
            let first = at.floor().min(count - 1.0);
            (first, at - first)
        } else {
            let first = (at.ceil() - 1.0).max(0.0);
            (first, first + 1.0 - at)
        };
        let width = size[0] as usize;
        let strides = if major == 0 { [1, width] } else { [width, 1] };
        let room = if ascends { count - first } else { first + 1.0 };
        let columns = (consumed + length).ceil().clamp(1.0, room);
        Some(Self {
            columns: columns as u32,
            length: length as f32,
            consumed: consumed as f32,
            first: first as i32,
            advance: if ascends { 1 } else { -1 },
            strides,
            last_minor: (size[minor] - 1) as f32,
            minor: [start[minor] as f32, step[minor] as f32],
            ..Self::default()
        })
    }
}
