//! Whether light reaches sixteen columns' samples at one distance: nearest texel, for every kind of shadow map.
//!
//! One fetch a froxel, as engines do it; a cube's face is chosen by the largest axis, of several maps the first that contains
//! the point decides (MODEL.md, Conventions).

use glam::DVec3;
use scatter_core::{CubeShadow, MAX_CASCADES, RayLanes, ShadowLayer, SpotLight};

use super::paths::{LANES, Lanes, Paths, Texels, Wide, projected};

const ALL: [bool; LANES] = [true; LANES];

/// The light's visibility along sixteen rays.
pub trait Occlusion {
    /// 1 where the rays' points at distance `t` are lit, else 0.
    fn lit(&self, t: f64) -> Lanes;
}

/// Nothing casts a shadow.
pub struct Clear;

impl Occlusion for Clear {
    #[inline(always)]
    fn lit(&self, _t: f64) -> Lanes {
        [1.0; LANES]
    }
}

/// One map, parallel or perspective.
pub struct OneMap<'a, const PERSPECTIVE: bool> {
    texels: Texels<'a, f32>,
    paths: Paths,
}

impl<'a, const PERSPECTIVE: bool> OneMap<'a, PERSPECTIVE> {
    /// Along these rays.
    #[inline(always)]
    pub fn new(layer: &ShadowLayer<'a>, eye: DVec3, rays: &RayLanes) -> Self {
        let texels = Texels::new(layer.texels(), layer.projection().size());
        Self { texels, paths: Paths::in_map(layer.projection(), eye, rays) }
    }

    /// Lit or not, and whether the map contains the point.
    #[inline(always)]
    fn look(&self, t: f64) -> (Lanes, [bool; LANES]) {
        let point = self.paths.at(t);
        let (stored, inside) = if PERSPECTIVE {
            let (u, v, seen) = projected(&point);
            self.texels.nearest(&u, &v, &seen, f32::INFINITY)
        } else {
            self.texels.nearest(&point[0], &point[1], &ALL, f32::INFINITY)
        };
        (compared(&point[2], &stored), inside)
    }
}

impl OneMap<'_, true> {
    /// As `look`, with points outside of the map taken to its nearest texel; behind the lamp all is dark.
    #[inline(always)]
    fn at_border(&self, t: f64) -> Lanes {
        let point = self.paths.at(t);
        let (mut u, mut v, seen) = projected(&point);
        let [last_u, last_v] = self.texels.last();
        for lane in 0..LANES {
            // `max` before `min`: what is no number becomes 0.
            u[lane] = u[lane].max(0.0).min(last_u);
            v[lane] = v[lane].max(0.0).min(last_v);
        }
        let (stored, _) = self.texels.nearest(&u, &v, &seen, -1.0);
        compared(&point[2].map(|depth| depth.max(0.0)), &stored)
    }
}

/// 1 where a depth is not behind the stored one.
#[inline(always)]
fn compared(depth: &Wide, stored: &Lanes) -> Lanes {
    let mut lit = [0.0; LANES];
    for lane in 0..LANES {
        lit[lane] = if depth[lane] <= f64::from(stored[lane]) { 1.0 } else { 0.0 };
    }
    lit
}

impl<const PERSPECTIVE: bool> Occlusion for OneMap<'_, PERSPECTIVE> {
    #[inline(always)]
    fn lit(&self, t: f64) -> Lanes {
        self.look(t).0
    }
}

/// The map of a spot's cone. Outside of the cone there is no light to be seen or not; where a column passes there, it says what
/// the nearest border of the map says, and a pixel between columns whose ray grazes the cone reads that. Inside of the cone
/// and outside of the map everything is lit (MODEL.md).
pub struct ConeMap<'a> {
    map: OneMap<'a, true>,
    from_lamp: Paths,
    axis: DVec3,
    cos_outer: f64,
}

impl<'a> ConeMap<'a> {
    /// Along these rays.
    #[inline(always)]
    pub fn new(layer: &ShadowLayer<'a>, spot: &SpotLight, eye: DVec3, rays: &RayLanes) -> Self {
        Self {
            map: OneMap::new(layer, eye, rays),
            from_lamp: Paths::from_lamp(spot.lamp().position(), eye, rays),
            axis: spot.direction(),
            cos_outer: spot.cos_outer(),
        }
    }
}

impl Occlusion for ConeMap<'_> {
    #[inline(always)]
    fn lit(&self, t: f64) -> Lanes {
        let (mut lit, inside) = self.map.look(t);
        if inside == ALL {
            return lit;
        }
        let [x, y, z] = self.from_lamp.at(t);
        let mut outside = [false; LANES];
        for lane in 0..LANES {
            let distance = (x[lane] * x[lane] + y[lane] * y[lane] + z[lane] * z[lane]).sqrt();
            let along = self.axis.x * x[lane] + self.axis.y * y[lane] + self.axis.z * z[lane];
            outside[lane] = !inside[lane] && along <= self.cos_outer * distance;
        }
        let at_border = self.map.at_border(t);
        for lane in 0..LANES {
            lit[lane] = if outside[lane] { at_border[lane] } else { lit[lane] };
        }
        lit
    }
}

/// Cascades, or six faces with projections of their own.
pub struct SeveralMaps<'a, const PERSPECTIVE: bool> {
    layers: &'a [ShadowLayer<'a>],
    paths: [Paths; MAX_CASCADES],
}

impl<'a, const PERSPECTIVE: bool> SeveralMaps<'a, PERSPECTIVE> {
    /// Along these rays; at most [`MAX_CASCADES`] maps, which a frame checks.
    #[inline(always)]
    pub fn new(layers: &'a [ShadowLayer<'a>], eye: DVec3, rays: &RayLanes) -> Self {
        let mut paths = [Paths::NONE; MAX_CASCADES];
        for (paths, layer) in paths.iter_mut().zip(layers) {
            *paths = Paths::in_map(layer.projection(), eye, rays);
        }
        Self { layers, paths }
    }
}

impl<const PERSPECTIVE: bool> Occlusion for SeveralMaps<'_, PERSPECTIVE> {
    #[inline(always)]
    fn lit(&self, t: f64) -> Lanes {
        let (mut lit, mut decided) = ([1.0; LANES], [false; LANES]);
        for (layer, paths) in self.layers.iter().zip(&self.paths) {
            let texels = Texels::new(layer.texels(), layer.projection().size());
            let (found, inside) = OneMap::<PERSPECTIVE> { texels, paths: *paths }.look(t);
            let mut open = false;
            for lane in 0..LANES {
                lit[lane] = if inside[lane] && !decided[lane] { found[lane] } else { lit[lane] };
                decided[lane] |= inside[lane];
                open |= !decided[lane];
            }
            if !open {
                break;
            }
        }
        lit
    }
}

/// Six faces along the world's axes.
pub struct CubeMap<'a> {
    texels: &'a [f32],
    size: u32,
    paths: Paths,
}

impl<'a> CubeMap<'a> {
    /// Along these rays.
    #[inline(always)]
    pub fn new(cube: &CubeShadow<'a>, eye: DVec3, rays: &RayLanes) -> Self {
        let paths = Paths::from_lamp(cube.position(), eye, rays);
        Self { texels: cube.texels(), size: cube.size(), paths }
    }
}

impl Occlusion for CubeMap<'_> {
    #[inline(always)]
    fn lit(&self, t: f64) -> Lanes {
        let [x, y, z] = self.paths.at(t);
        let (half, last) = (0.5 * f64::from(self.size), f64::from(self.size) - 1.0);
        let mut index = [0u32; LANES];
        let mut depth = [0.0; LANES];
        for lane in 0..LANES {
            let (x, y, z) = (x[lane], y[lane], z[lane]);
            let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
            // The first axis wins a tie: `cube_face_of`.
            let is_x = ax >= ay && ax >= az;
            let is_y = !is_x && ay >= az;
            let along = if is_x {
                x
            } else if is_y {
                y
            } else {
                z
            };
            let sign = if along < 0.0 { -1.0 } else { 1.0 };
            // Right and down of the faces +X −X +Y −Y +Z −Z: −Z Z X X X −X and −Y −Y Z −Z −Y −Y.
            let right = if is_x {
                -sign * z
            } else if is_y {
                x
            } else {
                sign * x
            };
            let down = if is_y { sign * z } else { -y };
            depth[lane] = along.abs();
            let scale = half / depth[lane];
            // At the lamp itself the quotient is no number: `max` makes it 0.
            let column = (half + right * scale).max(0.0).min(last);
            let row = (half + down * scale).max(0.0).min(last);
            let axis = if is_x {
                0
            } else if is_y {
                2
            } else {
                4
            };
            let face = axis + u32::from(along < 0.0);
            index[lane] = (face * self.size + row as u32) * self.size + column as u32;
        }
        let mut stored = [0.0; LANES];
        for lane in 0..LANES {
            stored[lane] = self.texels[index[lane] as usize];
        }
        compared(&depth, &stored)
    }
}
