//! Visibility and colour at sixteen points, one of each of a packet's rays: nearest texel, f32.
//!
//! Map coordinates are linear in two numbers of the sample, so a look-up costs three fused multiply-adds a map: for
//! a sun `start + (i − i₀)·step` in the step index i, for a lamp the homogeneous `foot·cos φ + along·sin φ` (the
//! distance to the lamp times the direction, up to a factor that the division by depth removes).
//!
//! Accuracy. Starts are computed in f64 at a step inside of the map and rounded once, so texel coordinates carry
//! half an ulp of f32: 2⁻¹² texel at 4096 texels from each of start and step, 2⁻¹¹ in all. Depths are compared
//! without a bias: a point within 2⁻²³ of the stored depth may fall on either side.
//!
//! Layout. Row-major, as the engine has it: with packets of 4×4 pixels in tiles of 32×32 neighbouring rays share
//! their cache lines, and pages of 32×32 texels with lines of 4×4 cost more in index arithmetic than they saved in
//! misses (measured at 128, 512 and 2048 steps on a 4096² map), besides the copy.

use fearless_simd::i32x16;
use fearless_simd::prelude::*;
use scatter_core::ShadowLayer;

use super::lanes::{LANES, LaneMask, Lanes, load, splat};

/// Where a packet's rays run through one map: `[u, v, depth]` (cube: world axes from the lamp).
#[derive(Debug, Clone, Copy)]
pub struct MapLanes {
    /// Sun: the step index that `start` belongs to. Lamp: unused.
    pub origin: [f32; LANES],
    /// Sun: coordinates at `origin`. Lamp: at the foot of the perpendicular.
    pub start: [[f32; LANES]; 3],
    /// Sun: a step. Lamp: the lamp's distance from the ray, along the ray.
    pub step: [[f32; LANES]; 3],
}

impl Default for MapLanes {
    fn default() -> Self {
        // Outside of every map: u = −1 everywhere.
        Self { origin: [0.0; LANES], start: [[-1.0; LANES]; 3], step: [[0.0; LANES]; 3] }
    }
}

/// The samples of a packet, one on each ray.
pub trait Samples<S: Simd>: Copy {
    /// `[u, v, depth]` times [`Self::unit`].
    fn position(&self, simd: S, map: &MapLanes) -> [Lanes<S>; 3];
    /// The factor of [`Self::position`], > 0.
    fn unit(&self, simd: S) -> Lanes<S>;
    /// Depths times [`Self::unit`].
    fn scaled(&self, depth: Lanes<S>) -> Lanes<S>;
}

/// Samples under a sun.
#[derive(Clone, Copy)]
pub struct SunSamples<S: Simd> {
    /// Step indices with their fractions.
    pub index: Lanes<S>,
}

/// Samples near a lamp: `φ` is the angle at the lamp between the perpendicular on the ray and the sample.
#[derive(Clone, Copy)]
pub struct LampSamples<S: Simd> {
    /// cos φ, > 0.
    pub cos: Lanes<S>,
    /// sin φ.
    pub sin: Lanes<S>,
}

impl<S: Simd> Samples<S> for SunSamples<S> {
    #[inline(always)]
    fn position(&self, simd: S, map: &MapLanes) -> [Lanes<S>; 3] {
        let way = self.index - load(simd, &map.origin);
        std::array::from_fn(|axis| way.mul_add(load(simd, &map.step[axis]), load(simd, &map.start[axis])))
    }

    #[inline(always)]
    fn unit(&self, simd: S) -> Lanes<S> {
        splat(simd, 1.0)
    }

    #[inline(always)]
    fn scaled(&self, depth: Lanes<S>) -> Lanes<S> {
        depth
    }
}

impl<S: Simd> Samples<S> for LampSamples<S> {
    #[inline(always)]
    fn position(&self, simd: S, map: &MapLanes) -> [Lanes<S>; 3] {
        std::array::from_fn(|axis| {
            self.sin.mul_add(load(simd, &map.step[axis]), self.cos * load(simd, &map.start[axis]))
        })
    }

    #[inline(always)]
    fn unit(&self, _simd: S) -> Lanes<S> {
        self.cos
    }

    #[inline(always)]
    fn scaled(&self, depth: Lanes<S>) -> Lanes<S> {
        depth * self.cos
    }
}

/// Texels in rows.
#[derive(Debug, Clone, Copy)]
pub struct Grid<'a, T> {
    texels: &'a [T],
    width: i32,
    /// `log2(width)` where that is an integer: a shift is cheaper than a product on every instruction set.
    shift: Option<u32>,
    last: [f32; 2],
}

impl<'a, T: Copy> Grid<'a, T> {
    /// Rows of `size[0]` texels; several maps of that size may follow each other.
    pub fn new(texels: &'a [T], size: [u32; 2]) -> Self {
        let shift = size[0].is_power_of_two().then(|| size[0].trailing_zeros());
        Self { texels, width: size[0] as i32, shift, last: size.map(|n| (n - 1) as f32) }
    }

    /// Indices of the texels at `(u, v)`, clamped to the last column and row; coordinates above −1 count as 0.
    #[inline(always)]
    pub fn index<S: Simd>(&self, simd: S, u: Lanes<S>, v: Lanes<S>) -> i32x16<S> {
        let column: i32x16<S> = u.min(splat(simd, self.last[0])).to_int();
        let row: i32x16<S> = v.min(splat(simd, self.last[1])).to_int();
        match self.shift {
            Some(shift) => (row << shift) + column,
            None => row * i32x16::splat(simd, self.width) + column,
        }
    }

    /// The texels with these indices; indices out of range (of lanes that are not looked at) give the last one.
    #[inline(always)]
    fn fetch(&self, index: [i32; LANES]) -> [T; LANES] {
        let last = self.texels.len() - 1;
        // As u32: a map of more than 2³¹ texels wraps around to its right index.
        std::array::from_fn(|lane| self.texels[(index[lane] as u32 as usize).min(last)])
    }

    /// Whether `(u, v)` lies on the map (half-open).
    #[inline(always)]
    pub fn contains<S: Simd>(&self, simd: S, u: Lanes<S>, v: Lanes<S>, unit: Lanes<S>) -> LaneMask<S> {
        let zero = splat(simd, 0.0);
        u.simd_ge(zero)
            & v.simd_ge(zero)
            & u.simd_lt(unit * (self.last[0] + 1.0))
            & v.simd_lt(unit * (self.last[1] + 1.0))
    }
}

impl Grid<'_, f32> {
    /// The texels as depths.
    #[inline(always)]
    pub fn depth<S: Simd>(&self, simd: S, index: i32x16<S>) -> Lanes<S> {
        self.fetch(index.into()).simd_into(simd)
    }
}

/// What decides whether light reaches the samples.
pub trait Visibility<S: Simd>: Copy {
    /// The same for the neighbouring steps of `step` under a sun in which it looks alike, and these steps: first and one
    /// behind the last. [`Self::lit`] of what is returned serves samples in these steps.
    #[inline(always)]
    fn stretch(&self, _step: u32) -> (Self, [u32; 2]) {
        (*self, [0, u32::MAX])
    }

    /// Which samples are lit.
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S>;
}

/// Nothing casts a shadow.
#[derive(Clone, Copy)]
pub struct Clear;

impl<S: Simd> Visibility<S> for Clear {
    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, _samples: P) -> LaneMask<S> {
        let zero = splat(simd, 0.0);
        zero.simd_eq(zero)
    }
}

/// One parallel map. `INSIDE`: every sample of the packet lies on the map, so that no border is asked for.
#[derive(Clone, Copy)]
pub struct ParallelMap<'a, const INSIDE: bool> {
    /// The depths.
    pub grid: Grid<'a, f32>,
    /// The packet's rays.
    pub lanes: &'a MapLanes,
}

impl<S: Simd, const INSIDE: bool> Visibility<S> for ParallelMap<'_, INSIDE> {
    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S> {
        let [u, v, depth] = samples.position(simd, self.lanes);
        let lit = depth.simd_le(self.grid.depth(simd, self.grid.index(simd, u, v)));
        if INSIDE { lit } else { lit | !self.grid.contains(simd, u, v, splat(simd, 1.0)) }
    }
}

/// One perspective map. `INSIDE` as in [`ParallelMap`].
#[derive(Clone, Copy)]
pub struct PerspectiveMap<'a, const INSIDE: bool> {
    /// The depths.
    pub grid: Grid<'a, f32>,
    /// The packet's rays.
    pub lanes: &'a MapLanes,
}

impl<S: Simd, const INSIDE: bool> Visibility<S> for PerspectiveMap<'_, INSIDE> {
    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S> {
        let [u, v, depth] = samples.position(simd, self.lanes);
        let per_depth = splat(simd, 1.0) / depth;
        let index = self.grid.index(simd, u * per_depth, v * per_depth);
        let lit = depth.simd_le(samples.scaled(self.grid.depth(simd, index)));
        if INSIDE {
            lit
        } else {
            let before = depth.simd_gt(splat(simd, 0.0));
            lit | !(before & self.grid.contains(simd, u, v, depth))
        }
    }
}

/// Six faces with projections of their own; the first that contains a sample decides.
#[derive(Clone, Copy)]
pub struct FaceMaps<'a> {
    /// The faces.
    pub faces: &'a [ShadowLayer<'a>; 6],
    /// The packet's rays in each.
    pub lanes: &'a [MapLanes],
}

/// How far beyond its borders a face is read, in its clamped texels \[share of its width\]: what f32 rounds between two
/// faces that abut must not be lit by belonging to neither.
const FACE_SLACK: f32 = 1e-6;

impl<S: Simd> Visibility<S> for FaceMaps<'_> {
    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S> {
        let zero = splat(simd, 0.0);
        let mut open = zero.simd_eq(zero);
        let mut lit = open;
        for (face, lanes) in self.faces.iter().zip(self.lanes) {
            let grid = Grid::new(face.texels(), face.projection().size());
            let [u, v, depth] = samples.position(simd, lanes);
            let width = depth * (grid.last[0] + 1.0);
            let slack = width * FACE_SLACK;
            let inside = depth.simd_gt(zero)
                & u.simd_ge(-slack)
                & v.simd_ge(-slack)
                & u.simd_lt(width + slack)
                & v.simd_lt(width + slack);
            let here = open & inside;
            if here.any_true() {
                let per_depth = splat(simd, 1.0) / depth;
                // Just outside is the border's texel.
                let index = grid.index(simd, (u * per_depth).max(zero), (v * per_depth).max(zero));
                let shadowed = depth.simd_gt(samples.scaled(grid.depth(simd, index)));
                lit &= !(here & shadowed);
                open &= !here;
                if open.all_false() {
                    break;
                }
            }
        }
        lit
    }
}

/// Six faces around a lamp; positions are along the world's axes, from the lamp.
#[derive(Clone, Copy)]
pub struct CubeMap<'a> {
    /// The depths of all faces, one after the other.
    pub grid: Grid<'a, f32>,
    /// The packet's rays.
    pub lanes: &'a MapLanes,
}

impl<S: Simd> Visibility<S> for CubeMap<'_> {
    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S> {
        let [x, y, z] = samples.position(simd, self.lanes);
        let zero = splat(simd, 0.0);
        let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
        // The first of the largest components, as cube_face_of has it.
        let on_x = ax.simd_ge(ay) & ax.simd_ge(az);
        let on_y = !on_x & ay.simd_ge(az);
        let depth = on_x.select(ax, on_y.select(ay, az));
        // wgpu's faces: right is (−z, z, x, x, x, −x), down (−y, −y, z, −z, −y, −y) for +X −X +Y −Y +Z −Z.
        let one = splat(simd, 1.0);
        let right = on_x.select(-(z * one.copysign(x)), on_y.select(x, x * one.copysign(z)));
        let down = on_y.select(z * one.copysign(y), -y);
        let negative = on_x.select(x, on_y.select(y, z)).simd_lt(zero);
        let axis = on_x.select(splat(simd, 0.0), on_y.select(splat(simd, 2.0), splat(simd, 4.0)));
        let face = axis + super::lanes::one_where(simd, negative);
        let half = 0.5 * (self.grid.last[0] + 1.0);
        let per_depth = splat(simd, half) / depth;
        let u = right.mul_add(per_depth, splat(simd, half));
        let v = down.mul_add(per_depth, splat(simd, half));
        let side = self.grid.width;
        let face: i32x16<S> = face.to_int();
        let index = face * i32x16::splat(simd, side.wrapping_mul(side)) + self.grid.index(simd, u, v);
        depth.simd_le(samples.scaled(self.grid.depth(simd, index)))
    }
}

/// The colour texture of the light.
#[derive(Clone, Copy)]
pub struct TextureLookup<'a> {
    /// The colours.
    pub grid: Grid<'a, [f32; 3]>,
    /// Whether u and v are to be divided by depth.
    pub perspective: bool,
    /// The packet's rays.
    pub lanes: &'a MapLanes,
}

impl TextureLookup<'_> {
    /// The colours at the samples, white outside of the texture.
    #[inline(always)]
    pub fn colour<S: Simd, P: Samples<S>>(&self, simd: S, samples: P) -> [Lanes<S>; 3] {
        let [u, v, depth] = samples.position(simd, self.lanes);
        let unit = if self.perspective { depth } else { samples.unit(simd) };
        let inverse = splat(simd, 1.0) / unit;
        let index = self.grid.index(simd, u * inverse, v * inverse);
        let inside = unit.simd_gt(splat(simd, 0.0)) & self.grid.contains(simd, u, v, unit);
        let texels = self.grid.fetch(index.into());
        std::array::from_fn(|channel| {
            let values: [f32; LANES] = std::array::from_fn(|lane| texels[lane][channel]);
            inside.select(values.simd_into(simd), splat(simd, 1.0))
        })
    }
}
