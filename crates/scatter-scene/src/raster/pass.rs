//! One depth pass as numbers: rows of clip coordinates composed in f64, and the way back from stored to linear depth.
//!
//! Everything is relative to a reference point where the projection is most sensitive (the lamp, the eye, the middle
//! of a parallel map), so that a vertex near it keeps its digits in f32. What the D32 image stores:
//!
//! - parallel maps: depth, affinely mapped so that the whole scene lies within (0, 1); nothing is clamped;
//! - perspective maps: `smallest/depth`. In a float that has the same relative precision at every distance, and it is
//!   affine in the image, so interpolation is exact but for rounding;
//! - an engine's matrix: half of its `z/w`, so that `z > w`, which the depth clamp would turn into `z = w`, can be
//!   told from it.

use glam::{DMat3, DVec3, DVec4};
use rayon::prelude::*;
use scatter_core::{Camera, MapProjection, Projection};

use super::doubt::{Screen, ScreenDepth};
use super::pipeline::PassBlock;

/// A depth pass.
#[derive(Debug, Clone, Copy)]
pub(super) struct DepthPass {
    pub block: PassBlock,
    pub size: [u32; 2],
    pub store: Store,
    /// Whether surfaces before the near plane count; they are cut away otherwise.
    pub clamp: bool,
    /// The same projection in f64.
    pub screen: Screen,
}

/// What the depth image holds.
#[derive(Debug, Clone, Copy)]
pub(super) enum Store {
    /// `(depth − nearest)/range`, cleared to 1.
    Affine { nearest: f64, range: f64 },
    /// `smallest/depth`, cleared to 0.
    Reciprocal { smallest: f64 },
    /// `½·z/w`, cleared to 1.
    Half,
}

/// The scene as the passes see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SceneBox {
    /// The origin of all vertices.
    pub centre: DVec3,
    /// Lowest and highest corner, world space.
    pub bounds: (DVec3, DVec3),
}

/// Share of the scene's depth before and behind it in a parallel map: rounding stays inside of (0, 1), and precision
/// loses nothing that counts.
const DEPTH_MARGIN: f64 = 1e-3;
/// Smallest depth of a perspective map, as a share of the farthest: nearer surfaces count at that depth. A float
/// reaches 2⁻¹²⁶, so this is not a matter of precision.
const SMALLEST_SHARE: f64 = 1e-12;

impl DepthPass {
    /// The pass of a shadow map. `None` if the projection has no inverse.
    pub fn of_map(scene: &SceneBox, map: &MapProjection) -> Option<Self> {
        let [width, height] = map.size().map(f64::from);
        let [u, v, depth] = map.rows();
        let (start, step) = map.light_ray(0.5 * width, 0.5 * height)?;
        if map.is_perspective() {
            let rows = [u * (2.0 / width) - depth, v * (2.0 / height) - depth, depth];
            return Some(Self::perspective(scene, start, rows, map.size()));
        }
        let reference = start + step * depth.dot(scene.centre.extend(1.0));
        let rows = [u * (2.0 / width) - DVec4::W, v * (2.0 / height) - DVec4::W, depth];
        let [low, high] = scene.extent(depth);
        let margin = DEPTH_MARGIN * scene.depth_scale(high - low);
        let store = [low - margin, (high - low) + 2.0 * margin];
        Some(Self::parallel(scene, reference, rows, store, map.size(), true))
    }

    /// The pass of a camera; its depth is along the view direction.
    pub fn of_camera(scene: &SceneBox, camera: &Camera) -> Self {
        let eye = camera.eye();
        let row = |axis: DVec3| axis.extend(-axis.dot(eye));
        let forward = row(camera.forward());
        // An oblique ray is followed back into the plane of the eye, across whose axes the window lies.
        let lean = match camera.parallel_direction() {
            Some(travel) if travel != camera.forward() => {
                travel / travel.dot(camera.forward()) - camera.forward()
            }
            _ => DVec3::ZERO,
        };
        let back = |axis: DVec3| row(axis - camera.forward() * axis.dot(lean));
        let (right, up) = (back(camera.right()), back(camera.up()));
        let window = camera.window();
        // y = (up − top·w)/(bottom − top) of the image's height, x = (right − left·w − shear·y)/(right − left) of its
        // width; clip coordinates are twice that, less w.
        let down = |w: DVec4| (up - w * window.top) * (2.0 / (window.bottom - window.top));
        let rows = |w: DVec4| down(w) - w;
        let columns = |w: DVec4| {
            let sheared = right - w * window.left - down(w) * (0.5 * camera.shear());
            sheared * (2.0 / (window.right - window.left)) - w
        };
        match camera.projection() {
            Projection::Perspective => {
                Self::perspective(scene, eye, [columns(forward), rows(forward), forward], camera.size())
            }
            Projection::Orthographic => {
                // Rays start in the plane of the eye, where depth is 0: what is behind it is cut away.
                let farthest = scene.extent(forward)[1].max(0.0);
                let range = farthest + DEPTH_MARGIN * scene.depth_scale(farthest);
                let store = [0.0, range];
                let rows = [columns(DVec4::W), rows(DVec4::W), forward];
                Self::parallel(scene, eye, rows, store, camera.size(), false)
            }
        }
    }

    /// The pass of an engine's matrix, given by its rows, y up.
    pub fn of_clip(scene: &SceneBox, [x, y, z, w]: [DVec4; 4], size: [u32; 2]) -> Self {
        let linear = DMat3::from_cols(x.truncate(), y.truncate(), w.truncate()).transpose();
        // The centre of projection, if it is a place near the scene: there f32 needs the digits most.
        let centre = linear.inverse() * -DVec3::new(x.w, y.w, w.w);
        let radius = (scene.bounds.1 - scene.bounds.0).length();
        let near = centre.is_finite() && centre.distance(scene.centre) <= 4.0 * radius;
        let reference = if near { centre } else { scene.centre };
        let scale = 1.0 / scene.largest(&[x, y, w]);
        let rows = [x * scale, -y * scale, z * (0.5 * scale), w * scale];
        let screen = Screen {
            rows: texel_rows(reference, [x, -y, z, w], size),
            reference,
            size,
            depth: ScreenDepth::Itself,
            range: 1.0,
            rounding: rounding(&rows.map(|row| relative(row, reference)), scene.reach_of(reference), size),
        };
        let block = block(scene, reference, rows);
        Self { block, size, store: Store::Half, clamp: true, screen }
    }

    fn perspective(scene: &SceneBox, centre: DVec3, [x, y, depth]: [DVec4; 3], size: [u32; 2]) -> Self {
        // Clip coordinates mean the same at any scale; at this one they are at most about 1.
        let farthest = scene.largest(&[depth]);
        let smallest = SMALLEST_SHARE * farthest;
        let scale = 1.0 / farthest;
        let rows = [x * scale, y * scale, DVec4::W * (smallest * scale), depth * scale];
        let screen = Screen {
            rows: texel_rows(centre, [x, y, -DVec4::W, depth], size),
            reference: centre,
            size,
            depth: ScreenDepth::MinusReciprocal,
            range: farthest,
            rounding: rounding(&rows.map(|row| relative(row, centre)), scene.reach_of(centre), size),
        };
        let block = block(scene, centre, rows);
        Self { block, size, store: Store::Reciprocal { smallest }, clamp: true, screen }
    }

    fn parallel(
        scene: &SceneBox,
        reference: DVec3,
        [x, y, depth]: [DVec4; 3],
        [nearest, range]: [f64; 2],
        size: [u32; 2],
        clamp: bool,
    ) -> Self {
        let z = (depth - DVec4::W * nearest) / range;
        let rows = [x, y, z, DVec4::W];
        let screen = Screen {
            rows: texel_rows(reference, [x, y, depth, DVec4::W], size),
            reference,
            size,
            depth: ScreenDepth::Itself,
            range,
            rounding: rounding(&rows.map(|row| relative(row, reference)), scene.reach_of(reference), size),
        };
        let block = block(scene, reference, rows);
        Self { block, size, store: Store::Affine { nearest, range }, clamp, screen }
    }
}

/// The rows relative to the reference, and the reference relative to the scene's centre, as the shader reads them.
fn block(scene: &SceneBox, reference: DVec3, rows: [DVec4; 4]) -> PassBlock {
    let [x, y, z, w] = rows.map(|row| relative(row, reference).as_vec4().to_array());
    let [high, low] = split(reference - scene.centre);
    PassBlock { x, y, z, w, reference_high: high, padding_0: 0.0, reference_low: low, padding_1: 0.0 }
}

/// A row over world points as one over points relative to the reference. The shift and the reference's part nearly
/// cancel far from the origin: nothing is added before them.
fn relative(row: DVec4, reference: DVec3) -> DVec4 {
    row.truncate().extend(row.truncate().dot(reference) + row.w)
}

/// Rows `(x, y, v, w)` of clip coordinates as the [`Screen`] has them: relative to the reference, x and y in texels.
fn texel_rows(reference: DVec3, [x, y, v, w]: [DVec4; 4], [width, height]: [u32; 2]) -> [DVec4; 4] {
    let texels = |row: DVec4, count: u32| (row + w) * (0.5 * f64::from(count));
    [texels(x, width), texels(y, height), v, w].map(|row| relative(row, reference))
}

/// How far the shader's and the viewport's f32 arithmetic moves a vertex that the map sees \[texels\].
///
/// A coordinate of clip space is a sum of products: three roundings of the point, one of each product, three of the
/// sum, three of the division and the viewport. All are relative to the largest term, which is `row·p`, at the most
/// `spread·|row|` when `p` is as far from the reference as anything at w = 1. Ten half ulps, of half the map's side.
fn rounding(rows: &[DVec4; 4], reach: f64, size: [u32; 2]) -> f64 {
    let [x, y, _, w] = rows;
    // p/w is bounded by what a corner of the image sees, where p starts at the centre of projection; and in a parallel
    // map, or one from afar, by the scene itself.
    let linear = DMat3::from_cols(x.truncate(), y.truncate(), w.truncate()).transpose().inverse();
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let seen = corners.iter().map(|&(i, j)| (linear * DVec3::new(i, j, 1.0)).length()).fold(0.0, f64::max);
    // NaN, for a singular matrix, is no number and loses.
    let spread = seen.min(reach / w.w.abs());
    let largest = [x, y].iter().map(|row| row.truncate().length() * spread).fold(1.0, f64::max);
    const ROUNDINGS: f64 = 10.0;
    ROUNDINGS * largest * 0.5 * f64::from(f32::EPSILON) * 0.5 * f64::from(size[0].max(size[1]))
}

/// A point as a sum of two f32.
pub(super) fn split(p: DVec3) -> [[f32; 3]; 2] {
    let high = p.as_vec3();
    [high.to_array(), (p - high.as_dvec3()).as_vec3().to_array()]
}

impl SceneBox {
    fn corners(&self) -> impl Iterator<Item = DVec4> + '_ {
        let (low, high) = self.bounds;
        (0..8).map(move |corner: u32| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec4::new(pick(0), pick(1), pick(2), 1.0)
        })
    }

    /// Smallest and largest value of a row over the scene.
    fn extent(&self, row: DVec4) -> [f64; 2] {
        self.corners().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
            let value = row.dot(p);
            [low.min(value), high.max(value)]
        })
    }

    /// Distance from a point to the farthest corner.
    fn reach_of(&self, p: DVec3) -> f64 {
        self.corners().map(|corner| corner.truncate().distance(p)).fold(0.0, f64::max)
    }

    /// A length > 0 to scale a parallel map's depths by: a scene may be flat as the map sees it, or a point.
    fn depth_scale(&self, extent: f64) -> f64 {
        let diagonal = (self.bounds.1 - self.bounds.0).length();
        let scale = extent.max(1e-3 * diagonal);
        if scale > 0.0 { scale } else { 1.0 }
    }

    /// Largest absolute value of any of the rows over the scene; > 0.
    fn largest(&self, rows: &[DVec4]) -> f64 {
        let all = rows.iter().flat_map(|row| self.extent(*row)).map(f64::abs);
        all.fold(f64::MIN_POSITIVE, f64::max)
    }
}

impl Store {
    /// What the image is cleared to: no surface.
    pub fn cleared(&self) -> f32 {
        match self {
            Self::Affine { .. } | Self::Half => 1.0,
            Self::Reciprocal { .. } => 0.0,
        }
    }

    /// Whether nearer surfaces have larger values.
    pub fn is_reversed(&self) -> bool {
        matches!(self, Self::Reciprocal { .. })
    }

    /// Fills `out` with depths in the map's convention; `+∞` where nothing was drawn.
    pub fn decode(&self, stored: &[f32], out: &mut [f32]) {
        match *self {
            Self::Affine { nearest, range } => each(stored, out, |v| {
                let depth = (nearest + f64::from(v) * range).max(0.0) as f32;
                if v < 1.0 { depth } else { f32::INFINITY }
            }),
            // 1/0 is the ∞ that is wanted.
            Self::Reciprocal { smallest } => each(stored, out, |v| (smallest / f64::from(v)) as f32),
            Self::Half => each(stored, out, |v| if v <= 0.5 { 2.0 * v } else { f32::INFINITY }),
        }
    }
}

fn each(stored: &[f32], out: &mut [f32], decode: impl Fn(f32) -> f32 + Sync) {
    // Long enough to be worth a task, short enough to share.
    const CHUNK: usize = 1 << 16;
    out.par_chunks_mut(CHUNK).zip(stored.par_chunks(CHUNK)).for_each(|(out, stored)| {
        for (out, &stored) in out.iter_mut().zip(stored) {
            *out = decode(stored);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clip coordinates of a world point as the shader's arithmetic gives them, in f32.
    fn clip(pass: &DepthPass, scene: &SceneBox, p: DVec3) -> [f64; 4] {
        let [high, low] = split(p - scene.centre);
        let b = &pass.block;
        let q: [f32; 3] =
            std::array::from_fn(|i| (high[i] - b.reference_high[i]) + (low[i] - b.reference_low[i]));
        [b.x, b.y, b.z, b.w].map(|r| f64::from(r[0] * q[0] + r[1] * q[1] + r[2] * q[2] + r[3]))
    }

    /// Texel coordinates and decoded depth of a world point.
    fn texel(pass: &DepthPass, scene: &SceneBox, p: DVec3) -> DVec3 {
        let [x, y, z, w] = clip(pass, scene, p);
        let [width, height] = pass.size.map(f64::from);
        let mut depth = [0.0];
        pass.store.decode(&[(z / w) as f32], &mut depth);
        DVec3::new((x / w + 1.0) * 0.5 * width, (y / w + 1.0) * 0.5 * height, depth[0].into())
    }

    fn scene_at(centre: DVec3) -> SceneBox {
        SceneBox {
            centre,
            bounds: (centre - DVec3::new(30.0, 8.0, 20.0), centre + DVec3::new(30.0, 8.0, 20.0)),
        }
    }

    #[test]
    fn the_shaders_arithmetic_places_points_where_the_projection_does() {
        for centre in [DVec3::ZERO, DVec3::new(1e6, -2e5, 3e6)] {
            let scene = scene_at(centre);
            let at = |x: f64, y: f64, z: f64| (centre + DVec3::new(x, y, z)).to_array();
            let (forward, up) = ([0.3, -0.9, 0.2], [0.0, 0.0, 1.0]);
            let maps = [
                MapProjection::orthographic(at(-10.0, 90.0, 0.0), forward, up, [9.0, 7.0], [4096, 1024]),
                MapProjection::perspective(at(1.0, 2.0, 3.0), forward, up, 1.3, 4096),
                MapProjection::cube_face(at(1.0, 2.0, 3.0), 3, 4096),
            ];
            for map in maps.map(Result::unwrap) {
                let pass = DepthPass::of_map(&scene, &map).unwrap();
                for (i, j, share) in [(3.5, 1000.5, 0.2), (4000.5, 7.5, 0.9), (2048.5, 511.5, 0.001)] {
                    let (start, step) = map.light_ray(i, j).unwrap();
                    let p = start + step * (20.0 * share);
                    let found = texel(&pass, &scene, p);
                    let exact = map.texel_from_world(p);
                    // f32 arithmetic on coordinates of at most 4096 texels and a scene of about 100 units, and a
                    // world point that is itself good to 5e-10 at 3e6 units: below 1/256 of a texel.
                    assert!((found - exact).truncate().abs().max_element() < 2e-3, "{found} {exact}");
                    assert!((found.z - exact.z).abs() < 1e-5 * exact.z.max(1.0), "{found} {exact}");
                }
            }
        }
    }

    #[test]
    fn a_point_next_to_a_lamp_keeps_its_place() {
        // A ten-thousandth of the scene away: an f32 vertex alone would be off by several texels.
        let scene = scene_at(DVec3::ZERO);
        let lamp = DVec3::new(29.1, 7.3, -19.7);
        let map = MapProjection::cube_face(lamp.to_array(), 4, 4096).unwrap();
        let pass = DepthPass::of_map(&scene, &map).unwrap();
        let p = lamp + DVec3::new(1.1e-3, -0.7e-3, 3e-3);
        let (found, exact) = (texel(&pass, &scene, p), map.texel_from_world(p));
        assert!((found - exact).truncate().abs().max_element() < 2e-3, "{found} {exact}");
        assert!((found.z / exact.z - 1.0).abs() < 1e-6, "{found} {exact}");
    }

    #[test]
    fn cameras_see_points_in_the_pixels_of_their_rays() {
        let centre = DVec3::new(1e5, 0.0, -4e4);
        let scene = scene_at(centre);
        let (eye, target) = (centre.to_array(), (centre + DVec3::new(3.0, -1.0, 8.0)).to_array());
        let cameras = [
            Camera::perspective(eye, target, [0.0, 1.0, 0.0], 70.0, [63, 41]).unwrap().shifted(0.3, 0.1),
            Camera::orthographic(eye, target, [0.0, 1.0, 0.0], 12.0, [63, 41]).unwrap(),
        ];
        for camera in cameras {
            let pass = DepthPass::of_camera(&scene, &camera);
            for (x, y, t) in [(0, 0, 4.0), (62, 3, 9.0), (30, 40, 0.5)] {
                let ray = camera.pixel_ray(x, y);
                let p = camera.eye() + ray.origin + ray.direction * t;
                let exact = DVec3::new(
                    f64::from(x) + 0.5,
                    f64::from(y) + 0.5,
                    t * ray.direction.dot(camera.forward()),
                );
                let found = texel(&pass, &scene, p);
                assert!((found - exact).abs().max_element() < 1e-5 * 63.0, "{found} {exact}");
            }
        }
    }
}
