//! A slice's line through one shadow map, texel by texel, and what a stored depth means in rectified coordinates.
//!
//! The half-plane of a slice meets a map in a straight line. It is walked along the map's major axis of that line,
//! one texel column a step, with `t` counting texels from where the line enters. Within a column the line crosses at
//! most one border between two texels, so a column has one cell or two, which end at the true crossings.

use glam::{DVec2, DVec3};
use scatter_core::MapProjection;

use crate::slice_plane::SlicePlane;

/// A line through a map in the order in which view rays cross its light rays.
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
}

/// The light ray at a place on the line, as the number γ that orders light rays from the eye on.
#[derive(Debug, Clone, Copy)]
pub enum Gamma {
    /// Of a sun, the distance of the light ray from the eye: at t = 0, and its change a texel.
    Distance([f32; 2]),
    /// Of a lamp, [`turn`] of the light ray's direction: towards the eye and across, each at t = 0 and its change a
    /// texel.
    Turn([[f32; 2]; 2]),
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
            Self::Turn([towards, across]) => turn(towards[0] + towards[1] * t, across[0] + across[1] * t),
        }
    }
}

/// A number from 0 (towards the eye) over 1 (across) to 2 (away from it) that grows with the angle of a direction with
/// `across` ≥ 0: exact in its order, smooth, and without an arc tangent. Small angles keep all their digits.
#[inline(always)]
pub fn turn(towards: f32, across: f32) -> f32 {
    let size = (towards.abs() + across).max(f32::MIN_POSITIVE);
    let part = across / size;
    if towards >= 0.0 { part } else { 2.0 - part }
}

/// The direction `[towards, across]` with that [`turn`].
pub fn direction_of_turn(turn: f64) -> DVec2 {
    DVec2::new(1.0 - turn, turn.min(2.0 - turn).max(0.0))
}

/// How the columns of a slice are numbered: from the light on.
#[derive(Debug, Clone, Copy)]
pub struct ColumnOrder {
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// Whether light crosses the columns in ascending order.
    pub ascending: bool,
}

impl ColumnOrder {
    /// Number of columns.
    pub fn count(&self) -> usize {
        (self.columns[1] - self.columns[0]) as usize
    }

    /// The place of a column in the order of light.
    pub fn rank(&self, column: u32) -> u32 {
        if self.ascending { column - self.columns[0] } else { self.columns[1] - 1 - column }
    }

    /// Rows that give the number of columns before a point of the plane, from the rows that give its column: the
    /// columns c with c + ½ on the light's side of x are `⌊x + ½ − first⌋`, or `⌊last + ½ − x⌋` in descending order.
    fn lit_rows(&self, [numerator, depth]: [DVec2; 2]) -> [DVec2; 2] {
        let [first, end] = self.columns.map(f64::from);
        if self.ascending {
            [numerator + depth * (0.5 - first), depth]
        } else {
            [depth * (end + 0.5) - numerator, depth]
        }
    }
}

impl MapLine {
    /// The line of a slice under a sun through a parallel map, up to the light ray at `reach` ≥ 0; `None` if it does
    /// not meet the map.
    pub fn sun(
        projection: &MapProjection,
        eye: DVec3,
        plane: &SlicePlane,
        order: ColumnOrder,
        reach: f64,
    ) -> Option<Self> {
        let ray = projection.ray(eye, DVec3::ZERO, plane.across);
        let along_light = projection.ray(eye, DVec3::ZERO, -plane.to_light).step.z;
        let size = projection.size().map(f64::from);
        let (mut from, mut to) = (0.0f64, reach);
        for (axis, &count) in size.iter().enumerate() {
            let (start, step) = (ray.start[axis], ray.step[axis]);
            if step == 0.0 {
                if !(start >= 0.0 && start < count) {
                    return None;
                }
                continue;
            }
            let (a, b) = (-start / step, (count - start) / step);
            from = from.max(a.min(b));
            to = to.min(a.max(b));
        }
        if !(from < to) {
            return None;
        }
        let major = usize::from(ray.step.y.abs() > ray.step.x.abs());
        let speed = ray.step[major].abs();
        // A light ray a texel apart; in a map without extent along the slice the line stays in one texel.
        let per_texel = if speed > 0.0 { 1.0 / speed } else { 0.0 };
        let [numerator, depth] = order.lit_rows(plane.column_from_plane());
        let depth_base = ray.start.z as f32;
        let start_depth = ray.start.z - f64::from(depth_base);
        let factors = |row: DVec2| {
            // q = γ and p = (z₀ + z₁·γ − z) / (depth per unit of light).
            let light = row.y / along_light;
            let per_gamma = row.x + light * ray.step.z;
            [per_gamma * from + light * start_depth, per_gamma * per_texel, -light, 0.0]
        };
        Self::walk_from(
            projection.size(),
            major,
            [ray.start.x, ray.start.y].map_with([ray.step.x, ray.step.y], |start, step| start + step * from),
            [ray.step.x, ray.step.y].map(|step| step * per_texel),
            speed * (to - from),
        )
        .map(|line| Self {
            gamma: Gamma::Distance([from as f32, per_texel as f32]),
            depth_base,
            lit_columns: [factors(numerator), factors(depth)].map(|row| row.map(|f| f as f32)),
            ..line
        })
    }

    /// The line of a slice under a lamp through a perspective map, one face of a cube or a spot's, up to the light ray
    /// with [`turn`] `reach`; `None` if it does not meet the map. `distance` is that of the lamp from the eye.
    pub fn lamp(
        projection: &MapProjection,
        plane: &SlicePlane,
        order: ColumnOrder,
        distance: f64,
        reach: f64,
    ) -> Option<Self> {
        // Homogeneous texels of the directions towards the eye and across: a light ray `p·towards + q·across` is seen
        // at `p·a + q·e`.
        let image = |direction: DVec3| projection.ray(DVec3::ZERO, DVec3::ZERO, direction).step;
        let (a, e) = (image(-plane.to_light), image(plane.across));
        let line = a.cross(e);
        // The way that the texel goes as γ grows.
        let heading = DVec2::new(line.y, -line.x);
        let major = usize::from(heading.y.abs() > heading.x.abs());
        let speed = heading[major].abs();
        if !(speed > 0.0) {
            return None;
        }
        // A slice may run along the edge between two faces of a cube: rounding must not leave it to neither. [texels]
        const EDGE: f64 = 1e-9;
        let size = DVec2::from(projection.size().map(f64::from));
        let normal = line.truncate();
        let middle = 0.5 * size;
        let base = middle - normal * ((normal.dot(middle) + line.z) / normal.length_squared());
        let step = heading / speed;
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (axis, &count) in size.as_ref().iter().enumerate() {
            if step[axis] == 0.0 {
                if !(base[axis] >= -EDGE && base[axis] <= count + EDGE) {
                    return None;
                }
                continue;
            }
            let (one, other) = ((-EDGE - base[axis]) / step[axis], (count + EDGE - base[axis]) / step[axis]);
            from = from.max(one.min(other));
            to = to.min(one.max(other));
        }
        // The light ray through a texel, at depth 1: both parts are linear along the line.
        let determinant = a.z * e[major] - e.z * a[major];
        let towards = |at: f64| (e[major] - e.z * at) / determinant;
        let across = |at: f64| (a.z * at - a[major]) / determinant;
        let along = |part: &dyn Fn(f64) -> f64| {
            let start = part(base[major]);
            [start, part(base[major] + step[major]) - start]
        };
        let (mut p, mut q) = (along(&towards), along(&across));
        // Light rays of this half-plane: across ≥ 0.
        let zero = -q[0] / q[1];
        if q[1] > 0.0 {
            from = from.max(zero);
        } else if q[1] < 0.0 {
            to = to.min(zero);
        } else if q[0] < 0.0 {
            return None;
        }
        let last = direction_of_turn(reach);
        let seen = a * last.x + e * last.y;
        if seen.z > 0.0 {
            to = to.min((seen[major] / seen.z - base[major]) / step[major]);
        } else if a.z < 0.0 {
            return None; // The map sees later light rays alone.
        }
        if !(from < to) {
            return None;
        }
        for part in [&mut p, &mut q] {
            part[0] += part[1] * from;
        }
        let [numerator, depth] = order.lit_rows(plane.column_from_plane());
        // A point at depth z of the map: across q·z, to the light L − p·z.
        let factors =
            |row: DVec2| [row.y * distance, 0.0, row.x * q[0] - row.y * p[0], row.x * q[1] - row.y * p[1]];
        let start = base + step * from;
        Self::walk_from(projection.size(), major, start.to_array(), step.to_array(), to - from).map(|line| {
            Self {
                gamma: Gamma::Turn([p, q].map(|part| part.map(|f| f as f32))),
                lit_columns: [factors(numerator), factors(depth)].map(|row| row.map(|f| f as f32)),
                ..line
            }
        })
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
    fn walk_from(size: [u32; 2], major: usize, start: [f64; 2], step: [f64; 2], length: f64) -> Option<Self> {
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

/// Two arrays of two, element by element.
trait MapWith {
    fn map_with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;
}

impl MapWith for [f64; 2] {
    fn map_with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        [f(self[0], other[0]), f(self[1], other[1])]
    }
}
