//! Where the texels of a map are in the world: one projection for all kinds of maps.
//!
//! One [`MapProjection`] serves orthographic maps (sun, cascade), perspective ones (spot) and each face of a cube
//! (point light): three affine rows that turn a world point into texel coordinates and a depth that is **linear
//! along the light's axis**. Texels are half-open, row 0 on top (MODEL.md, Conventions). f64.

use glam::{DVec3, DVec4};

use crate::clip_rows::ClipRows;
use crate::clip_space::ClipSpace;
use crate::error::{ModelError, checked, checked_direction, checked_point, checked_size};

/// Where a map's texels are in the world: `texel_from_world`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapProjection {
    /// Rows for u, v (texels, right and down) and depth (world units along the axis); each dotted with (p, 1).
    rows: [DVec4; 3],
    perspective: bool,
    size: [u32; 2],
}

/// A ray in a map's space: each coordinate is `start + t·step` for the ray parameter t in world units.
///
/// Affine maps: `u`, `v`, `depth` as they are. Perspective maps: texel coordinates are `u/depth` and `v/depth`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapRay {
    /// `(u, v, depth)` at t = 0.
    pub start: DVec3,
    /// `(u, v, depth)` a world unit along the ray.
    pub step: DVec3,
}

impl MapProjection {
    /// A parallel projection along `forward` (the way the light travels) with row 0 towards `up`.
    ///
    /// The map covers `half_extent = [half width, half height]` world units around the ray through `origin`; depth
    /// is measured from the plane through `origin`, which must lie before the whole scene.
    pub fn orthographic(
        origin: [f64; 3],
        forward: [f64; 3],
        up: [f64; 3],
        half_extent: [f64; 2],
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let (right, up, forward) = frame_of(forward, up)?;
        let origin = checked_point("shadow map origin", origin)?;
        for extent in half_extent {
            checked("shadow map half extent", extent, |v| v > 0.0, "a finite number > 0")?;
        }
        let row =
            |axis: DVec3, scale: f64, shift: f64| (axis * scale).extend(shift - origin.dot(axis) * scale);
        let [half_u, half_v] = size.map(|n| 0.5 * f64::from(n));
        let rows = [
            row(right, half_u / half_extent[0], half_u),
            row(-up, half_v / half_extent[1], half_v),
            row(forward, 1.0, 0.0),
        ];
        Self { rows, perspective: false, size }.checked()
    }

    /// A perspective projection from `position` along `forward`, with row 0 towards `up` and `tan_half` the tangent
    /// of half its field of view; square.
    pub fn perspective(
        position: [f64; 3],
        forward: [f64; 3],
        up: [f64; 3],
        tan_half: f64,
        size: u32,
    ) -> Result<Self, ModelError> {
        let (right, up, forward) = frame_of(forward, up)?;
        let position = checked_point("shadow map position", position)?;
        checked("shadow map tan_half", tan_half, |v| v > 0.0, "a finite number > 0")?;
        Self::from_axes(position, right / tan_half, -up / tan_half, forward, size).checked()
    }

    /// Face 0 to 5 of a cube map around `position`: +X −X +Y −Y +Z −Z in wgpu's orientation.
    pub fn cube_face(position: [f64; 3], face: usize, size: u32) -> Result<Self, ModelError> {
        let position = checked_point("cube map position", position)?;
        let (forward, right, down) = CUBE_AXES[face % 6];
        Self::from_axes(position, right, down, forward, size).checked()
    }

    /// The projection of an engine: column-major `clip_from_world` with row 0 at y/w = +1 and z/w that grows with distance
    /// from 0 on. Reversed z, and other clip spaces: [`Self::from_clip_from_world_in`].
    ///
    /// Parallel matrices (last row 0 0 0 1, to the rounding of f32) give depth from the z row, scaled so that it counts
    /// world units; others give depth from the w row, the distance along the light's axis, and their z row matters to
    /// encoded texels alone ([`ShadowDepthEncoding`](crate::ShadowDepthEncoding)). A common factor of all rows means nothing.
    ///
    /// # Errors
    ///
    /// Entries that are NaN or infinite, singular matrices, and such as see nothing (w < 0 everywhere).
    pub fn from_clip_from_world(clip_from_world: [[f64; 4]; 4], size: [u32; 2]) -> Result<Self, ModelError> {
        Self::from_clip_from_world_in(clip_from_world, ClipSpace::WGPU, size)
    }

    /// As [`Self::from_clip_from_world`], in the engine's clip space. Depth is counted from the near plane of a parallel
    /// map on, whichever way z/w runs, and from the lamp on of a perspective one.
    pub fn from_clip_from_world_in(
        clip_from_world: [[f64; 4]; 4],
        space: ClipSpace,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let mut clip = ClipRows::new(clip_from_world, "shadow map clip_from_world")?;
        clip.y = space.y_up(clip.y);
        let [half_u, half_v] = size.map(|n| 0.5 * f64::from(n));
        let parallel = clip.parallel()?;
        let ClipRows { x, y, z, w, .. } = parallel.unwrap_or(clip);
        let axis = if parallel.is_some() { z } else { w };
        clip.inverse_of(axis.truncate())?;
        let unit = 1.0 / axis.truncate().length();
        let rows = if parallel.is_some() {
            let depth = (axis - w * space.near()) * (space.sign() * unit);
            [(x + w) * half_u, (w - y) * half_v, depth]
        } else {
            // u/depth must be texels, so all three rows share the factor `unit`.
            [(x + w) * half_u * unit, (w - y) * half_v * unit, axis * unit]
        };
        Self { rows, perspective: parallel.is_none(), size }.checked()
    }

    /// The same stretch of the world with another number of texels.
    pub fn resized(&self, size: [u32; 2]) -> Result<Self, ModelError> {
        let [u, v, depth] = self.rows;
        let scale = |index: usize| f64::from(size[index]) / f64::from(self.size[index]);
        Self { rows: [u * scale(0), v * scale(1), depth], perspective: self.perspective, size }.checked()
    }

    /// The same rectangle, or the same cone, cut into other texels. An error if a side has none or too many.
    pub fn with_size(&self, size: [u32; 2]) -> Result<Self, ModelError> {
        let [across, down] = std::array::from_fn(|axis| f64::from(size[axis]) / f64::from(self.size[axis]));
        let [u, v, depth] = self.rows;
        Self { rows: [u * across, v * down, depth], perspective: self.perspective, size }.checked()
    }

    /// The texels `[x0, y0, x1, y1)` of this map as a map of their own: the same texels, the same depths. An error if there
    /// are none; texels outside of this map continue it.
    pub fn cropped(&self, [x0, y0, x1, y1]: [u32; 4]) -> Result<Self, ModelError> {
        let [u, v, depth] = self.rows;
        let unit = if self.perspective { depth } else { DVec4::W };
        let rows = [u - unit * f64::from(x0), v - unit * f64::from(y0), depth];
        let size = [x1.saturating_sub(x0), y1.saturating_sub(y0)];
        Self { rows, perspective: self.perspective, size }.checked()
    }

    /// For constants: what these rows mean is not checked.
    pub(crate) const fn from_rows_unchecked(rows: [DVec4; 3], perspective: bool, size: [u32; 2]) -> Self {
        Self { rows, perspective, size }
    }

    pub(crate) fn from_axes(position: DVec3, right: DVec3, down: DVec3, forward: DVec3, size: u32) -> Self {
        let half = 0.5 * f64::from(size);
        let row = |axis: DVec3| axis.extend(-position.dot(axis));
        let depth = row(forward);
        Self {
            rows: [(row(right) + depth) * half, (row(down) + depth) * half, depth],
            perspective: true,
            size: [size; 2],
        }
    }

    fn checked(self) -> Result<Self, ModelError> {
        checked_size("shadow map", self.size)?;
        if self.rows.iter().all(|row| row.is_finite()) {
            Ok(self)
        } else {
            Err(ModelError::Degenerate {
                what: "shadow map projection",
                problem: "a row overflows",
                cure: "give a projection within the range of f64",
            })
        }
    }

    /// The ray `start + t·direction` (world space) in this map's space. `start` may be given relative to
    /// `reference`, which keeps all digits when both are far from the origin.
    pub fn ray(&self, reference: DVec3, start: DVec3, direction: DVec3) -> MapRay {
        let at = |row: DVec4| {
            // The reference and the row's shift nearly cancel far from the origin: add them first.
            (row.truncate().dot(reference) + row.w) + row.truncate().dot(start)
        };
        let along = |row: DVec4| row.truncate().dot(direction);
        MapRay {
            start: DVec3::new(at(self.rows[0]), at(self.rows[1]), at(self.rows[2])),
            step: DVec3::new(along(self.rows[0]), along(self.rows[1]), along(self.rows[2])),
        }
    }

    /// `(u, v, depth)` of a world point: texel coordinates (texel `(i, j)` covers [i, i+1) × [j, j+1)) and linear
    /// depth. Behind a perspective map depth is ≤ 0 and u, v mean nothing.
    pub fn texel_from_world(&self, p_world: DVec3) -> DVec3 {
        let ray = self.ray(p_world, DVec3::ZERO, DVec3::ZERO).start;
        if self.perspective { DVec3::new(ray.x / ray.z, ray.y / ray.z, ray.z) } else { ray }
    }

    /// The light ray through the map point `(u, v)`: a world point at depth 0 (the light itself for a perspective
    /// map) and the world step for a unit of depth. `None` if the projection has no inverse.
    pub fn light_ray(&self, u: f64, v: f64) -> Option<(DVec3, DVec3)> {
        let linear =
            glam::DMat3::from_cols(self.rows[0].truncate(), self.rows[1].truncate(), self.rows[2].truncate());
        let inverse = linear.transpose().inverse();
        let shift = DVec3::new(self.rows[0].w, self.rows[1].w, self.rows[2].w);
        let (origin, step) = if self.perspective {
            (inverse * -shift, inverse * DVec3::new(u, v, 1.0))
        } else {
            (inverse * (DVec3::new(u, v, 0.0) - shift), inverse * DVec3::Z)
        };
        (origin.is_finite() && step.is_finite()).then_some((origin, step))
    }

    /// Where the light rays of a perspective map start (world space); `None` for a parallel map and for a projection
    /// without an inverse.
    pub fn centre(&self) -> Option<DVec3> {
        if self.perspective { self.light_ray(0.5, 0.5).map(|(centre, _)| centre) } else { None }
    }

    /// The three rows of `texel_from_world`: u, v, depth, each to be dotted with (p, 1).
    pub fn rows(&self) -> [DVec4; 3] {
        self.rows
    }

    /// Whether u and v are to be divided by depth.
    pub fn is_perspective(&self) -> bool {
        self.perspective
    }

    /// `[width, height]` in texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

/// Forward, right (u) and down (v) of the cube faces +X −X +Y −Y +Z −Z, as wgpu, Vulkan and Direct3D have them.
pub(crate) const CUBE_AXES: [(DVec3, DVec3, DVec3); 6] = [
    (DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y),
    (DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y),
    (DVec3::Y, DVec3::X, DVec3::Z),
    (DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z),
    (DVec3::Z, DVec3::X, DVec3::NEG_Y),
    (DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y),
];

/// The cube face, 0 to 5, that a direction from the light falls on: the axis of its largest component, the first of
/// them where they tie.
pub fn cube_face_of(direction: DVec3) -> usize {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    2 * axis + usize::from(direction[axis] < 0.0)
}

/// Right, up and forward of a map that looks along `forward`.
fn frame_of(forward: [f64; 3], up: [f64; 3]) -> Result<(DVec3, DVec3, DVec3), ModelError> {
    let forward = checked_direction("shadow map forward", forward)?;
    let up = checked_direction("shadow map up", up)?;
    let right = forward.cross(up);
    if right.length() < 1e-9 {
        return Err(ModelError::Degenerate {
            what: "shadow map up",
            problem: "it is parallel to the light",
            cure: "give another up vector",
        });
    }
    let right = right.normalize();
    Ok((right, right.cross(forward), forward))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_size_cuts_the_same_rectangle() {
        let (position, forward, up) = ([1.0, 2.0, 3.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
        for map in [
            MapProjection::orthographic(position, forward, up, [4.0, 3.0], [16, 9]).unwrap(),
            MapProjection::perspective(position, forward, up, 0.8, 12).unwrap(),
        ] {
            let finer = map.with_size([48, 36]).unwrap();
            let p = DVec3::new(0.5, -1.0, 4.0);
            let (coarse, fine) = (map.texel_from_world(p), finer.texel_from_world(p));
            let [width, height] = map.size().map(f64::from);
            assert!(
                (fine.x / 48.0 - coarse.x / width).abs() < 1e-14
                    && (fine.y / 36.0 - coarse.y / height).abs() < 1e-14
            );
            assert_eq!(fine.z, coarse.z);
            assert!(map.with_size([0, 3]).is_err());
        }
    }

    #[test]
    fn a_part_of_a_map_has_its_texels() {
        let (position, forward, up) = ([1.0, 2.0, 3.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
        for map in [
            MapProjection::orthographic(position, forward, up, [4.0, 3.0], [16, 9]).unwrap(),
            MapProjection::perspective(position, forward, up, 0.8, 12).unwrap(),
        ] {
            let part = map.cropped([3, 2, 9, 7]).unwrap();
            let p = DVec3::new(0.5, -1.0, 4.0);
            let moved = map.texel_from_world(p) - part.texel_from_world(p) - DVec3::new(3.0, 2.0, 0.0);
            assert!(moved.length() < 1e-13 && part.size() == [6, 5], "{moved}");
            assert!(map.cropped([4, 2, 4, 7]).is_err() && map.cropped([4, 2, 3, 7]).is_err());
        }
    }

    #[test]
    fn the_top_left_texel_lies_up_and_left_of_the_axis() {
        let map =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [2.0, 1.0], [8, 4])
                .unwrap();
        // Looking along −z with y up, right is +x.
        let p = map.texel_from_world(DVec3::new(-1.75, 0.75, -3.0));
        assert!((p - DVec3::new(0.5, 0.5, 3.0)).length() < 1e-15, "{p}");
    }

    #[test]
    fn a_resized_map_sees_the_same_stretch() {
        let half =
            MapProjection::perspective([1.0, 2.0, 3.0], [0.3, -0.8, 0.1], [0.0, 0.0, 1.0], 0.7, 32).unwrap();
        let map = half.resized([64, 96]).unwrap();
        let p = DVec3::new(1.2, -2.0, 2.9);
        let (a, b) = (half.texel_from_world(p), map.texel_from_world(p));
        assert!((b - a * DVec3::new(2.0, 3.0, 1.0)).length() < 1e-12 && map.size() == [64, 96], "{a} {b}");
        assert!(half.resized([0, 4]).is_err());
    }

    #[test]
    fn engine_matrices_place_texels_where_the_named_constructors_do() {
        let (eye, forward, up) = ([1.0, 5.0, -2.0], [0.3, -0.8, 0.1], [0.0, 0.0, 1.0]);
        let view = crate::engine_matrices::look_to(eye.into(), DVec3::from(forward).normalize(), up.into());
        let clip = crate::engine_matrices::orthographic([3.0, 2.0], 10.0) * view;
        let a = MapProjection::from_clip_from_world(clip.to_cols_array_2d(), [33, 17]).unwrap();
        let b = MapProjection::orthographic(eye, forward, up, [3.0, 2.0], [33, 17]).unwrap();
        let clip =
            crate::engine_matrices::perspective_infinite_reversed(2.0 * 0.7f64.atan(), 1.0, 0.1) * view;
        let c = MapProjection::from_clip_from_world(clip.to_cols_array_2d(), [33, 33]).unwrap();
        let d = MapProjection::perspective(eye, forward, up, 0.7, 33).unwrap();
        for p in [DVec3::new(1.5, 3.0, -1.0), DVec3::new(2.0, -4.0, -2.5)] {
            for (m, n) in [(&a, &b), (&c, &d)] {
                let (x, y) = (m.texel_from_world(p), n.texel_from_world(p));
                assert!((x - y).length() < 1e-12, "{x} {y}");
            }
        }
    }

    #[test]
    fn light_rays_pass_through_their_texel_at_every_depth() {
        let ortho = MapProjection::orthographic(
            [1.0, 2.0, 3.0],
            [0.3, -0.8, 0.1],
            [0.0, 0.0, 1.0],
            [3.0, 2.0],
            [33, 17],
        );
        let spot = MapProjection::perspective([1.0, 2.0, 3.0], [0.3, -0.8, 0.1], [0.0, 0.0, 1.0], 0.7, 33);
        for map in [ortho.unwrap(), spot.unwrap()] {
            let (origin, step) = map.light_ray(4.5, 11.5).unwrap();
            for depth in [0.5, 7.0, 1e4] {
                let p = map.texel_from_world(origin + step * depth);
                assert!((p - DVec3::new(4.5, 11.5, depth)).length() < 1e-9 * depth.max(1.0), "{p}");
            }
        }
    }

    #[test]
    fn cube_faces_have_the_orientation_of_wgpu() {
        // From the cube map rules of Direct3D: +X has u along −z and v along −y, and so on.
        let near = |face: usize, direction: [f64; 3]| {
            let map = MapProjection::cube_face([0.0; 3], face, 16).unwrap();
            map.texel_from_world(DVec3::from(direction))
        };
        assert_eq!(near(0, [1.0, 0.0, -0.5]), DVec3::new(12.0, 8.0, 1.0));
        assert_eq!(near(0, [1.0, -0.5, 0.0]), DVec3::new(8.0, 12.0, 1.0));
        assert_eq!(near(1, [-1.0, 0.0, 0.5]), DVec3::new(12.0, 8.0, 1.0));
        assert_eq!(near(2, [0.5, 1.0, 0.0]), DVec3::new(12.0, 8.0, 1.0));
        assert_eq!(near(2, [0.0, 1.0, 0.5]), DVec3::new(8.0, 12.0, 1.0));
        assert_eq!(near(3, [0.0, -1.0, -0.5]), DVec3::new(8.0, 12.0, 1.0));
        assert_eq!(near(4, [0.5, 0.0, 1.0]), DVec3::new(12.0, 8.0, 1.0));
        assert_eq!(near(5, [-0.5, 0.0, -1.0]), DVec3::new(12.0, 8.0, 1.0));
    }

    #[test]
    fn every_direction_lies_inside_of_its_cube_face() {
        for i in 0..1000 {
            let angle = f64::from(i);
            let direction = DVec3::new(angle.sin(), (1.7 * angle).cos(), (2.3 * angle).sin());
            let map = MapProjection::cube_face([0.0; 3], cube_face_of(direction), 10).unwrap();
            let p = map.texel_from_world(direction);
            assert!(
                p.z > 0.0 && (0.0..=10.0).contains(&p.x) && (0.0..=10.0).contains(&p.y),
                "{direction}: {p}"
            );
        }
    }
}
