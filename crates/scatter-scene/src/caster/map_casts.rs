//! Depth maps and shadow maps by one ray a pixel or texel, in parallel, f64 up to the stored f32.

use glam::{DMat4, DVec3, DVec4};
use rayon::prelude::*;
use scatter_core::{Camera, MapError, MapProjection, MapSource, ModelError};

use super::ray_plane::RayPlane;
use super::scene_caster::SceneCaster;

impl SceneCaster {
    /// Fills `out`, `[y][x]`, with the distance along each pixel's ray to its first surface, at any distance; `+∞` for
    /// no surface. Resizes `out` to the camera's image.
    pub fn depth_map(&self, camera: &Camera, out: &mut Vec<f32>) {
        fill_rows(out, camera.size(), |x, y| self.pixel_distance(camera, x, y));
    }

    /// One value of [`Self::depth_map`].
    pub(crate) fn pixel_distance(&self, camera: &Camera, x: u32, y: u32) -> f32 {
        let ray = camera.pixel_ray(x, y);
        let plane = RayPlane::any(camera.eye(), ray.origin, ray.direction);
        self.first_crossing(&plane, f64::INFINITY).map_or(f32::INFINITY, |t| t as f32)
    }

    /// Fills `out`, `[row][column]`, with the depth of the first surface along the light ray through each texel's
    /// centre; `+∞` for no surface. Resizes `out`.
    ///
    /// Surfaces before the near plane of a parallel map count, at depth 0: they shadow all that the map sees.
    pub fn shadow_map(&self, projection: &MapProjection, out: &mut Vec<f32>) -> Result<(), ModelError> {
        let [width, height] = projection.size();
        out.clear();
        out.resize(width as usize * height as usize, f32::INFINITY);
        self.shadow_texels(projection, out)
    }

    /// Fills `out`, `[face][row][column]`, with the six faces around `position`. Resizes `out`.
    pub fn cube_map(&self, position: [f64; 3], size: u32, out: &mut Vec<f32>) -> Result<(), ModelError> {
        let faces = (0..6)
            .map(|face| MapProjection::cube_face(position, face, size))
            .collect::<Result<Vec<_>, _>>()?;
        let area = size as usize * size as usize;
        out.clear();
        out.resize(6 * area, f32::INFINITY);
        faces.iter().zip(out.chunks_mut(area)).try_for_each(|(face, texels)| self.shadow_texels(face, texels))
    }

    fn shadow_texels(&self, projection: &MapProjection, out: &mut [f32]) -> Result<(), ModelError> {
        if projection.light_ray(0.5, 0.5).is_none() {
            return Err(ModelError::Degenerate {
                what: "shadow map projection",
                problem: "it is singular",
                cure: "give a projection with an inverse",
            });
        }
        fill_texels(out, projection.size(), |column, row| self.texel_depth(projection, column, row));
        Ok(())
    }

    /// One value of [`Self::shadow_map`].
    pub(crate) fn texel_depth(&self, projection: &MapProjection, column: u32, row: u32) -> f32 {
        let ray = projection.light_ray(f64::from(column) + 0.5, f64::from(row) + 0.5);
        let Some((origin, step)) = ray else { return f32::INFINITY };
        let world_per_depth = step.length();
        let along = step / world_per_depth;
        let depth = if projection.is_perspective() {
            self.closest_hit(origin, along, f64::INFINITY)
        } else {
            self.first_on_line(origin, along, f64::INFINITY)
        };
        depth.map_or(f32::INFINITY, |t| (t / world_per_depth).max(0.0) as f32)
    }

    /// The first surface on the whole line through `origin` that is not beyond `limit`: a distance from `origin`,
    /// negative behind it.
    fn first_on_line(&self, origin: DVec3, along: DVec3, limit: f64) -> Option<f64> {
        if self.has_strays() {
            // A start before all strays would leave the rest no digits.
            let plane = RayPlane::any(origin, DVec3::ZERO, along);
            return self.first_crossing_from(&plane, f64::NEG_INFINITY, limit);
        }
        // A start before the scene: its sphere's near side, and a little more.
        let (centre, radius) = self.sphere();
        let to_centre = (centre - origin).dot(along);
        let back = (to_centre - 1.01 * radius - 1e-6 * to_centre.abs()).min(0.0);
        self.closest_hit(origin + back * along, along, limit - back).map(|t| t + back)
    }
}

impl MapSource for SceneCaster {
    fn depth_map(&self, camera: &Camera, out: &mut Vec<f32>) -> Result<(), MapError> {
        Self::depth_map(self, camera, out);
        Ok(())
    }

    fn shadow_map(&self, projection: &MapProjection, out: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(Self::shadow_map(self, projection, out)?)
    }

    fn cube_map(&self, position: [f64; 3], size: u32, out: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(Self::cube_map(self, position, size, out)?)
    }

    fn clip_map(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        out: &mut Vec<f32>,
    ) -> Result<(), MapError> {
        let lines = TexelLines::new(&DMat4::from_cols_array_2d(&clip_from_world), size)?;
        fill_rows(out, size, |column, row| lines.first_depth(self, column, row));
        Ok(())
    }
}

/// The world lines that the texels of a general projection see.
pub(crate) struct TexelLines {
    clip_from_world: DMat4,
    world_from_clip: DMat4,
    size: [u32; 2],
}

impl TexelLines {
    /// An error for a size of 0 and for a matrix that is singular or not finite.
    pub(crate) fn new(clip_from_world: &DMat4, size: [u32; 2]) -> Result<Self, MapError> {
        if size.contains(&0) {
            let field = "map size".to_string();
            return Err(ModelError::OutOfRange { field, value: 0.0, range: "at least 1x1 texels" }.into());
        }
        // Rows may differ by many powers of ten (world units against a far plane), so the determinant says little.
        let world_from_clip = clip_from_world.inverse();
        let usable = clip_from_world.is_finite()
            && clip_from_world.determinant() != 0.0
            && world_from_clip.is_finite();
        if usable {
            Ok(Self { clip_from_world: *clip_from_world, world_from_clip, size })
        } else {
            Err(MapError::singular_matrix())
        }
    }

    /// The smallest `z/w` of a surface on the texel's line with w > 0 and z ≤ w, at least 0.
    ///
    /// With `H(z) = world_from_clip·(x, y, z, 1)` the line is `H.xyz/H.w`, and w of clip space is `1/H.w`. Its
    /// direction of growing z, `H'.xyz·H.w − H.xyz·H'.w`, does not depend on z; w > 0 is the half-line before or
    /// behind the pole of H.w, which is the centre of projection where it lies at infinite z.
    pub(crate) fn first_depth(&self, caster: &SceneCaster, column: u32, row: u32) -> f32 {
        let x = (f64::from(column) + 0.5) / f64::from(self.size[0]) * 2.0 - 1.0;
        let y = 1.0 - (f64::from(row) + 0.5) / f64::from(self.size[1]) * 2.0;
        let at = |z: f64| self.world_from_clip * DVec4::new(x, y, z, 1.0);
        let slope = self.world_from_clip.z_axis;
        let (near, far) = (at(0.0), at(1.0));
        let direction = slope.truncate() * near.w - near.truncate() * slope.w;
        if !(direction.length() > 0.0) || !direction.is_finite() {
            return f32::INFINITY;
        }
        let along = direction.normalize();
        // Rounding of an inverse whose exact w row is (0, 0, 0, 1).
        let parallel = slope.w.abs() <= 1e-13 * near.w.abs();
        if parallel && near.w <= 0.0 {
            return f32::INFINITY;
        }
        let limit_from = |origin: DVec3| {
            let end = far.truncate() / far.w - origin;
            if far.w > 0.0 { end.dot(along) } else { f64::INFINITY }
        };
        let hit = if !parallel && slope.w < 0.0 {
            // From the centre of projection outward.
            let centre = slope.truncate() / slope.w;
            let limit = limit_from(centre);
            caster.closest_hit(centre, along, limit).map(|t| centre + t * along)
        } else if far.w > 0.0 {
            // From infinity, towards the far plane z = w.
            let origin = far.truncate() / far.w;
            caster.first_on_line(origin, along, 0.0).map(|t| origin + t * along)
        } else {
            None
        };
        let depth = hit.map(|p| {
            let clip = self.clip_from_world * p.extend(1.0);
            clip.z / clip.w
        });
        depth.map_or(f32::INFINITY, |depth| depth.clamp(0.0, 1.0) as f32)
    }
}

/// Fills `[y][x]` after resizing.
fn fill_rows(out: &mut Vec<f32>, size: [u32; 2], texel: impl Fn(u32, u32) -> f32 + Sync) {
    out.clear();
    out.resize(size[0] as usize * size[1] as usize, f32::INFINITY);
    fill_texels(out, size, texel);
}

/// Fills `[y][x]` with `texel(x, y)`, rows in parallel.
fn fill_texels(out: &mut [f32], size: [u32; 2], texel: impl Fn(u32, u32) -> f32 + Sync) {
    out.par_chunks_mut(size[0].max(1) as usize).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = texel(x as u32, y as u32);
        }
    });
}
