//! One layer of a light's map as the traversal reads it: the mirror of `TreeLayer` in `tree_layers.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use scatter_core::{AffineInPixel, MapFan, MapProjection, RayFan};

/// The finest level: blocks of 2² × 2² texels.
pub const FINEST: u32 = 2;

/// The coarsest level of any map: one block of a map of 8192 texels a side.
pub const COARSEST: u32 = 13;

/// Farthest that u and v are shifted \[texels\]: sums of it and an index stay in i32.
const FARTHEST_ORIGIN: f64 = 1e9;

/// A layer's rays and tree.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct TreeLayer {
    /// (u, v, depth) of a pixel's ray at s = 0: at the reference pixel, a column's, a row's; u and v count from `origin`.
    pub start: [[f32; 4]; 3],
    /// A unit of s.
    pub step: [[f32; 4]; 3],
    /// Columns and rows of texels.
    pub size: [u32; 2],
    /// The texel that u and v count from.
    pub origin: [i32; 2],
    /// 1 where u and v are to be divided by depth.
    pub perspective: u32,
    /// The coarsest level that is built.
    pub coarsest: u32,
    /// The first node of each level; of levels below [`FINEST`] and above `coarsest` 0.
    pub offsets: [u32; COARSEST as usize + 1],
}

impl TreeLayer {
    /// Of a map, seen by the rays of `fan`, whose reference pixel is the image's middle ([`crate::FrameUniform`]). The
    /// tree's first node is `first_node`; returns how many it has, too.
    pub fn new(fan: &RayFan, map: &MapProjection, size: [u32; 2], first_node: u32) -> (Self, u32) {
        let rays = fan.in_map(map);
        let [width, height] = map.size();
        let coarsest = width.max(height).next_power_of_two().ilog2().clamp(FINEST, COARSEST);
        let mut offsets = [0; COARSEST as usize + 1];
        let mut nodes = 0;
        for level in FINEST..=coarsest {
            offsets[level as usize] = first_node + nodes;
            nodes += width.div_ceil(1 << level) * height.div_ceil(1 << level);
        }
        let origin = origin_of(&rays, map.size());
        let middle = size.map(|n| f64::from(n / 2));
        let whole = DVec3::new(origin[0].into(), origin[1].into(), 0.0);
        let shift = if rays.perspective { DVec3::ZERO } else { whole };
        // Under a perspective map u is divided by the depth: it is shifted by as many depths.
        let rows = |at: &AffineInPixel, shift: DVec3| {
            let [first, columns, rows] = *at;
            let first = first + columns * middle[0] + rows * middle[1] - shift;
            [first, columns, rows].map(|row| {
                let row = if rays.perspective { row - whole * row.z } else { row };
                row.as_vec3().extend(0.0).to_array()
            })
        };
        let layer = Self {
            start: rows(&rays.start, shift),
            step: rows(&rays.step, DVec3::ZERO),
            size: map.size(),
            origin,
            perspective: rays.perspective.into(),
            coarsest,
            offsets,
        };
        (layer, nodes)
    }
}

/// The texel that u and v count from: the eye's under a parallel map, where a crossing is then right to two roundings
/// however far the eye is from the map's corner; else the map's middle.
fn origin_of(rays: &MapFan, size: [u32; 2]) -> [i32; 2] {
    let eye = rays.start[0].truncate().to_array();
    let middle = size.map(|n| f64::from(n / 2));
    let counts_from_eye = rays.one_start && !rays.perspective;
    [0, 1].map(|axis| {
        let place = if counts_from_eye { eye[axis].floor() } else { middle[axis] };
        place.clamp(-FARTHEST_ORIGIN, FARTHEST_ORIGIN) as i32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::Camera;

    /// Every level's nodes follow those of the level before, none shared, for odd sizes.
    #[test]
    fn levels_follow_each_other_without_gaps() {
        let camera = Camera::perspective([0.5, 0.2, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [9, 5]);
        let fan = RayFan::new(&camera.unwrap());
        for size in [[1, 1], [3, 5], [64, 4], [257, 130], [63, 65], [8192, 8191]] {
            let map =
                MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.0; 2], size);
            let (layer, count) = TreeLayer::new(&fan, &map.unwrap(), [9, 5], 77);
            let mut next = 77;
            for level in FINEST..=layer.coarsest {
                assert_eq!(layer.offsets[level as usize], next, "{size:?} {level}");
                let blocks = size.map(|n: u32| n.div_ceil(1 << level));
                next += blocks[0] * blocks[1];
            }
            assert_eq!(next - 77, count);
            assert!(size.iter().all(|n| n.div_ceil(1 << layer.coarsest) == 1));
        }
    }

    /// The rows of a layer against the map's own lookup, which knows nothing of shifts.
    #[test]
    fn a_layers_rays_are_the_maps_counted_from_its_origin() {
        let (eye, size) = ([0.4, 1.0, 3.0], [31, 17]);
        let cameras = [
            Camera::perspective(eye, [0.0; 3], [0.0, 1.0, 0.0], 70.0, size).unwrap(),
            Camera::orthographic(eye, [0.0; 3], [0.0, 1.0, 0.0], 2.0, size).unwrap(),
        ];
        let up = [0.0, 0.0, 1.0];
        let maps = [
            MapProjection::orthographic([0.0, 5.0, 0.0], [0.1, -1.0, 0.2], up, [3.0, 2.0], [90, 61]).unwrap(),
            MapProjection::perspective([0.0, 5.0, 0.0], [0.1, -1.0, 0.2], up, 0.9, 64).unwrap(),
        ];
        let mut worst = 0.0f64;
        for camera in &cameras {
            let fan = RayFan::new(camera);
            for map in &maps {
                let (layer, _) = TreeLayer::new(&fan, map, size, 0);
                for pixel in [[0, 0], [30, 3], [15, 8], [7, 16]] {
                    let place = [0, 1].map(|axis| f64::from(pixel[axis]) - f64::from(size[axis] / 2));
                    let s = 2.5;
                    let at = |n: usize| {
                        let of = |rows: &[[f32; 4]; 3]| {
                            f64::from(rows[0][n])
                                + f64::from(rows[1][n]) * place[0]
                                + f64::from(rows[2][n]) * place[1]
                        };
                        of(&layer.start) + s * of(&layer.step)
                    };
                    let depth = if map.is_perspective() { at(2) } else { 1.0 };
                    let found = [0, 1].map(|axis| at(axis) / depth + f64::from(layer.origin[axis]));
                    let ray = camera.pixel_ray(pixel[0], pixel[1]);
                    let way = s * fan.stretch(pixel);
                    let expected = map.texel_from_world(camera.eye() + ray.origin + ray.direction * way);
                    worst = worst.max((found[0] - expected.x).abs()).max((found[1] - expected.y).abs());
                    assert!((at(2) - expected.z).abs() < 1e-5);
                }
            }
        }
        println!("off by {worst:.1e} texels at the most");
        // Three roundings of numbers of up to 90 texels and, of the perspective map, 90 texels times a depth of 7.
        assert!(worst < 90.0 * 7.0 * 3.0 * 2f64.powi(-24), "{worst:e}");
    }
}
