//! Sixteen columns' rays in the space of a map, and nearest texels at one distance along all of them.
//!
//! f64 throughout: a froxel far from its map, or an eye far from the origin, loses no texel to rounding. Loops over lanes have
//! no branch; the compiler makes vectors of them.

use glam::DVec3;
use scatter_core::{MapProjection, RayLanes};

/// Columns side by side.
pub const LANES: usize = RayLanes::COUNT;

/// A number for each of sixteen columns.
pub type Lanes = [f32; LANES];

/// The same in f64.
pub type Wide = [f64; LANES];

/// `[u, v, depth]` of each ray: `start + t·step`.
#[derive(Debug, Clone, Copy)]
pub struct Paths {
    start: [Wide; 3],
    step: [Wide; 3],
}

impl Paths {
    /// Nowhere yet.
    pub const NONE: Self = Self { start: [[0.0; LANES]; 3], step: [[0.0; LANES]; 3] };

    /// In a map's space: texels and depth; in a perspective map texels are `u/depth` and `v/depth`.
    #[inline(always)]
    pub fn in_map(map: &MapProjection, eye: DVec3, rays: &RayLanes) -> Self {
        let rows = map.rows();
        let mut paths = Self::NONE;
        for (axis, row) in rows.into_iter().enumerate() {
            // The eye and the row's shift nearly cancel far from the origin: they are added first.
            let at_eye = row.truncate().dot(eye) + row.w;
            paths.set(axis, row.truncate(), at_eye, rays);
        }
        paths
    }

    /// In world axes, from a lamp on.
    #[inline(always)]
    pub fn from_lamp(lamp: DVec3, eye: DVec3, rays: &RayLanes) -> Self {
        let mut paths = Self::NONE;
        for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            paths.set(axis, unit, eye[axis] - lamp[axis], rays);
        }
        paths
    }

    #[inline(always)]
    fn set(&mut self, axis: usize, row: DVec3, at_eye: f64, rays: &RayLanes) {
        let ([ox, oy, oz], [dx, dy, dz]) = (&rays.origin, &rays.direction);
        for lane in 0..LANES {
            self.start[axis][lane] = at_eye + (row.x * ox[lane] + row.y * oy[lane] + row.z * oz[lane]);
            self.step[axis][lane] = row.x * dx[lane] + row.y * dy[lane] + row.z * dz[lane];
        }
    }

    /// The rays' points at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: f64) -> [Wide; 3] {
        let mut point = [[0.0; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                point[axis][lane] = self.start[axis][lane] + t * self.step[axis][lane];
            }
        }
        point
    }
}

/// Texels of one map: row-major, as the engine has it.
#[derive(Debug, Clone, Copy)]
pub struct Texels<'a, T> {
    texels: &'a [T],
    width: u32,
    size: [f64; 2],
}

impl<'a, T: Copy> Texels<'a, T> {
    /// `[row][column]`, of that size, not empty.
    pub fn new(texels: &'a [T], size: [u32; 2]) -> Self {
        Self { texels, width: size[0], size: size.map(f64::from) }
    }

    /// The last column and row.
    #[inline(always)]
    pub fn last(&self) -> [f64; 2] {
        self.size.map(|side| side - 1.0)
    }

    /// The nearest texels of points in texels; `outside` where there is none. `seen` leaves points out.
    #[inline(always)]
    pub fn nearest(
        &self,
        u: &Wide,
        v: &Wide,
        seen: &[bool; LANES],
        outside: T,
    ) -> ([T; LANES], [bool; LANES]) {
        let mut index = [0u32; LANES];
        let mut inside = [false; LANES];
        for lane in 0..LANES {
            let (u, v) = (u[lane], v[lane]);
            inside[lane] = u >= 0.0 && v >= 0.0 && u < self.size[0] && v < self.size[1] && seen[lane];
            // Casts truncate, which is the floor of what is inside.
            let texel = (v as u32).wrapping_mul(self.width).wrapping_add(u as u32);
            index[lane] = if inside[lane] { texel } else { 0 };
        }
        let mut found = [outside; LANES];
        for lane in 0..LANES {
            let texel = self.texels[index[lane] as usize];
            found[lane] = if inside[lane] { texel } else { outside };
        }
        (found, inside)
    }
}

/// `u/depth`, `v/depth`, and whether the point lies before the map's centre.
#[inline(always)]
pub fn projected([u, v, depth]: &[Wide; 3]) -> (Wide, Wide, [bool; LANES]) {
    let (mut across, mut down, mut seen) = ([0.0; LANES], [0.0; LANES], [false; LANES]);
    for lane in 0..LANES {
        let inverse = 1.0 / depth[lane];
        across[lane] = u[lane] * inverse;
        down[lane] = v[lane] * inverse;
        seen[lane] = depth[lane] > 0.0;
    }
    (across, down, seen)
}
