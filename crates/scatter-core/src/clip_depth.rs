//! Distances along a camera's rays from z/w through the engine's whole matrix.
//!
//! Along the ray of a pixel both z and w are linear, z = z₀ + z₁·t and w = w₀ + w₁·t, so a stored z/w = ζ is at
//! t = (ζ·w₀ − z₀)/(z₁ − ζ·w₁): near planes may be oblique, far planes infinite. f64, one division a pixel.

use glam::DVec4;

use crate::camera::Camera;
use crate::clip_rows::ClipRows;
use crate::clip_space::ClipSpace;
use crate::depth_quotient::DepthQuotient;
use crate::error::ModelError;
use crate::ray_fan::RayFan;

/// How far the matrix may show a ray from its pixel \[pixels\]: what f32 rounds of a matrix far from the origin. Half a
/// pixel (rows or jitter of another frame) is refused.
const OFF_PIXEL: f64 = 0.25;

/// A depth buffer's matrix with the camera that it belongs to.
pub(crate) struct ClipDepth<'a> {
    camera: &'a Camera,
    clip: ClipRows,
    space: ClipSpace,
}

impl<'a> ClipDepth<'a> {
    /// An error if the matrix shows the camera's corners elsewhere, or if z/w runs the other way than the space says.
    pub(crate) fn new(
        camera: &'a Camera,
        clip_from_world: [[f64; 4]; 4],
        space: ClipSpace,
    ) -> Result<Self, ModelError> {
        let mut clip = ClipRows::new(clip_from_world, "depth buffer clip_from_world")?;
        clip.y = space.y_up(clip.y);
        let this = Self { camera, clip, space };
        let [width, height] = camera.size();
        for [x, y] in [[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]] {
            this.check_pixel(x, y)?;
        }
        Ok(this)
    }

    fn check_pixel(&self, x: u32, y: u32) -> Result<(), ModelError> {
        let ray = self.camera.pixel_ray(x, y);
        let (eye, clip) = (self.camera.eye(), &self.clip);
        let start = (eye + ray.origin).extend(1.0);
        // Any point of the ray; one that is as far as the eye from the origin keeps the digits that f32 left.
        let p = start + ray.direction.extend(0.0) * (1.0 + eye.length());
        let w = clip.w.dot(p);
        let [width, height] = self.camera.size().map(f64::from);
        let off_x = 0.5 * width * (clip.x.dot(p) / w + 1.0) - (f64::from(x) + 0.5);
        let off_y = 0.5 * height * (1.0 - clip.y.dot(p) / w) - (f64::from(y) + 0.5);
        if !(w > 0.0 && off_x.abs() <= OFF_PIXEL && off_y.abs() <= OFF_PIXEL) {
            return Err(clip.error(
                "it shows the camera's rays at other pixels",
                "give clip_from_view · view_from_world of the camera itself, and its clip space",
            ));
        }
        let row = |row: DVec4| [row.dot(start), row.dot(ray.direction.extend(0.0))];
        let ([z0, z1], [w0, w1]) = (row(clip.z), row(clip.w));
        // The sign of d(z/w)/dt.
        if (z1 * w0 - z0 * w1) * self.space.sign() > 0.0 {
            Ok(())
        } else {
            Err(clip.error(
                "its z/w runs the other way than the clip space says, or nowhere",
                "say ClipSpace::reversed() of a buffer with reversed z, and of no other",
            ))
        }
    }

    /// The same as a quotient: s = (z·w₀ − z₀)/(z₁ − z·w₁) along the ray `start + s·direction` of a
    /// [`RayFan`](crate::RayFan), whose z and w are affine in the pixel.
    pub(crate) fn quotient(&self, fan: &RayFan) -> DepthQuotient {
        let [z_of_texel_0, z_of_texel_1] = [0.0, 1.0].map(|texel| self.space.z_of_texel(texel));
        let scale = z_of_texel_1 - z_of_texel_0;
        let (origin, direction) = (fan.origin(), fan.direction());
        let coefficients = std::array::from_fn(|index| {
            let start = if index == 0 {
                (self.camera.eye() + origin[0]).extend(1.0)
            } else {
                origin[index].extend(0.0)
            };
            let of = |row: DVec4| [row.dot(start), row.dot(direction[index].extend(0.0))];
            let ([z0, z1], [w0, w1]) = (of(self.clip.z), of(self.clip.w));
            // z = z_of_texel_0 + scale·texel.
            [z_of_texel_0 * w0 - z0, scale * w0, z1 - z_of_texel_0 * w1, -scale * w1]
        });
        DepthQuotient { coefficients, cleared: Some(self.space.cleared()), along_ray: false }
    }

    /// The texels are in [0, 1].
    pub(crate) fn decode(&self, encoded: &[f32], out: &mut Vec<f32>) -> Result<(), ModelError> {
        let cleared = self.space.cleared();
        out.extend(encoded.iter().enumerate().map(|(index, &texel)| {
            let ([z0, z1], [w0, w1]) = self.along(index);
            let z = self.space.z_of_texel(texel.into());
            let t = (z * w0 - z0) / (z1 - z * w1);
            // Beyond infinity, where w would be negative: a far plane that f32 rounded.
            let none = texel == cleared || !(w0 + w1 * t >= 0.0);
            if none { f32::INFINITY } else { t.max(0.0) as f32 }
        }));
        Ok(())
    }

    pub(crate) fn encode(&self, along_ray: &[f32], out: &mut Vec<f32>) {
        out.extend(along_ray.iter().enumerate().map(|(index, &distance)| {
            let ([z0, z1], [w0, w1]) = self.along(index);
            let t = f64::from(distance);
            if t == f64::INFINITY {
                return self.space.cleared();
            }
            self.space.texel_of_z((z0 + z1 * t) / (w0 + w1 * t)) as f32
        }));
    }

    /// z and w along a pixel's ray: at its start, and a world unit.
    fn along(&self, index: usize) -> ([f64; 2], [f64; 2]) {
        let width = self.camera.size()[0] as usize;
        let ray = self.camera.pixel_ray((index % width) as u32, (index / width) as u32);
        let (start, step) = ((self.camera.eye() + ray.origin).extend(1.0), ray.direction.extend(0.0));
        let of = |row: DVec4| [row.dot(start), row.dot(step)];
        (of(self.clip.z), of(self.clip.w))
    }
}
