//! The depth map that every technique reads, and its conversions from what engines hold.
//!
//! A [`DepthMap`] stores the distance **along the ray** in world units, `+∞` for "no surface". Engines hold a depth
//! buffer: forward or reversed z, finite or infinite far plane, z in [0, 1] (wgpu, Vulkan, Direct3D, Metal), or a
//! linear view-space z. [`DepthEncoding`] converts both ways for perspective and orthographic cameras: by near and far
//! planes, or by the engine's matrix, which may then have an oblique near plane, too.

use crate::camera::{Camera, Projection};
use crate::clip_depth::ClipDepth;
use crate::clip_space::ClipSpace;
use crate::depth_quotient::DepthQuotient;
use crate::error::{ModelError, checked, checked_len, checked_size, checked_texels};
use crate::ray_fan::RayFan;

/// Distances along the pixels' rays \[world units\], ≥ 0 or `+∞`; `[y][x]`, row 0 on top.
#[derive(Debug, Clone, Copy)]
pub struct DepthMap<'a> {
    texels: &'a [f32],
    size: [u32; 2],
}

impl<'a> DepthMap<'a> {
    /// Borrows distances along the ray; checks every texel once.
    pub fn new(texels: &'a [f32], size: [u32; 2]) -> Result<Self, ModelError> {
        checked_len("depth map", texels.len(), checked_size("depth map", size)?)?;
        let range = "a distance along the ray ≥ 0, or +∞ for no surface";
        checked_texels("depth map", texels, size[0], |t| t >= 0.0, range)?;
        Ok(Self { texels, size })
    }

    /// The distance at pixel `(x, y)`.
    pub fn at(&self, x: u32, y: u32) -> f32 {
        self.texels[y as usize * self.size[0] as usize + x as usize]
    }

    /// All distances, `[y][x]`.
    pub fn texels(&self) -> &'a [f32] {
        self.texels
    }

    /// `[width, height]`.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}

/// How an engine's depth buffer encodes distance. All z are in [0, 1]; the cleared value means "no surface". (OpenGL stores
/// its z/w of −1 to 1 as 0 to 1, which is `Forward`.) Near, far and view z are counted from the eye along the camera's
/// [`forward`](Camera::forward): of a matrix whose eye lies before or behind the view's origin, or whose near plane is
/// oblique, use `Clip`, which reads the matrix itself. Its twin for shadow maps is
/// [`ShadowDepthEncoding`](crate::ShadowDepthEncoding).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthEncoding {
    /// 0 at `near`, 1 at `far` (cleared: 1).
    Forward {
        /// Near plane \[world units\], > 0 (perspective) or any (orthographic).
        near: f64,
        /// Far plane \[world units\], > near.
        far: f64,
    },
    /// 1 at `near`, 0 at `far` (cleared: 0).
    Reversed {
        /// Near plane, as in `Forward`.
        near: f64,
        /// Far plane, as in `Forward`.
        far: f64,
    },
    /// 0 at `near`, 1 at infinity (cleared: 1). Perspective cameras only.
    ForwardInfinite {
        /// Near plane \[world units\], > 0.
        near: f64,
    },
    /// 1 at `near`, 0 at infinity (cleared: 0). Perspective cameras only.
    ReversedInfinite {
        /// Near plane \[world units\], > 0.
        near: f64,
    },
    /// z/w through the matrix that the depth buffer was rendered with, which must be the camera's own: any near and far
    /// plane, oblique ones too (cleared: 1, or 0 of reversed z).
    Clip {
        /// `clip_from_view · view_from_world`, column-major; multiply in f64 where the eye is far from the origin.
        clip_from_world: [[f64; 4]; 4],
        /// Where row 0 is and how z runs.
        space: ClipSpace,
    },
    /// Distance along the view direction \[world units\], `+∞` for no surface.
    ViewZ,
    /// Distance along the ray \[world units\], `+∞` for no surface: what a [`DepthMap`] holds.
    AlongRay,
}

impl DepthEncoding {
    /// Fills `out` with distances along the ray, one a texel of the engine's buffer.
    ///
    /// f64 inside; the error is that of the f32 texels in and out. Values outside of [0, 1], NaN and negative
    /// distances are errors that name the first such texel.
    pub fn decode(&self, camera: &Camera, encoded: &[f32], out: &mut Vec<f32>) -> Result<(), ModelError> {
        self.checked(camera)?;
        let size = camera.size();
        checked_len("depth buffer", encoded.len(), checked_size("depth buffer", size)?)?;
        if matches!(self, Self::ViewZ | Self::AlongRay) {
            let range = "a distance ≥ 0, or +∞ for no surface";
            checked_texels("depth buffer", encoded, size[0], |t| t >= 0.0, range)?;
        } else {
            checked_texels(
                "depth buffer",
                encoded,
                size[0],
                |t| (0.0..=1.0).contains(&t),
                "a depth in [0, 1]",
            )?;
        }
        out.clear();
        if let Self::Clip { clip_from_world, space } = *self {
            return ClipDepth::new(camera, clip_from_world, space)?.decode(encoded, out);
        }
        out.extend(encoded.iter().enumerate().map(|(index, &texel)| {
            let stretch = stretch_of(camera, index, self);
            (self.view_z(camera.projection(), texel.into()) * stretch).max(0.0) as f32
        }));
        Ok(())
    }

    /// The inverse of [`Self::decode`]: what an engine's buffer would hold for distances along the ray.
    pub fn encode(&self, camera: &Camera, along_ray: &[f32], out: &mut Vec<f32>) -> Result<(), ModelError> {
        self.checked(camera)?;
        let map = DepthMap::new(along_ray, camera.size())?;
        out.clear();
        if let Self::Clip { clip_from_world, space } = *self {
            ClipDepth::new(camera, clip_from_world, space)?.encode(map.texels(), out);
            return Ok(());
        }
        out.extend(map.texels().iter().enumerate().map(|(index, &distance)| {
            let view_z = f64::from(distance) / stretch_of(camera, index, self);
            self.texel(camera.projection(), view_z) as f32
        }));
        Ok(())
    }

    /// What a texel means as a quotient, for shaders. Errors as those of [`Self::decode`], but for texels.
    pub fn quotient(&self, camera: &Camera) -> Result<DepthQuotient, ModelError> {
        self.checked(camera)?;
        let fan = RayFan::new(camera);
        let plain = |coefficients: [f64; 4], cleared: Option<f32>| DepthQuotient {
            coefficients: [coefficients, [0.0; 4], [0.0; 4]],
            cleared,
            along_ray: *self == Self::AlongRay,
        };
        // View z is s of a perspective camera; along a parallel camera's rays a unit of s is this much of it.
        let slant = camera.parallel_direction().map_or(1.0, |way| way.dot(camera.forward()));
        let perspective = camera.projection() == Projection::Perspective;
        Ok(match *self {
            Self::Forward { near, far } if perspective => {
                plain([near * far, 0.0, far, near - far], Some(1.0))
            }
            Self::Reversed { near, far } if perspective => {
                plain([near * far, 0.0, near, far - near], Some(0.0))
            }
            Self::Forward { near, far } => plain([near, far - near, slant, 0.0], Some(1.0)),
            Self::Reversed { near, far } => plain([far, near - far, slant, 0.0], Some(0.0)),
            Self::ForwardInfinite { near } => plain([near, 0.0, 1.0, -1.0], Some(1.0)),
            Self::ReversedInfinite { near } => plain([near, 0.0, 0.0, 1.0], Some(0.0)),
            Self::Clip { clip_from_world, space } => {
                ClipDepth::new(camera, clip_from_world, space)?.quotient(&fan)
            }
            Self::ViewZ | Self::AlongRay => plain([0.0, 1.0, slant, 0.0], None),
        })
    }

    fn checked(&self, camera: &Camera) -> Result<(), ModelError> {
        let perspective = camera.projection() == Projection::Perspective;
        let near_range = "a finite number > 0 (perspective), any finite number (orthographic)";
        match *self {
            Self::Forward { near, far } | Self::Reversed { near, far } => {
                checked("depth near", near, |v| v > 0.0 || !perspective, near_range)?;
                checked("depth far", far, |v| v > near, "a finite number > near")?;
            }
            Self::ForwardInfinite { near } | Self::ReversedInfinite { near } => {
                checked("depth near", near, |v| v > 0.0, near_range)?;
                if !perspective {
                    return Err(ModelError::Mismatch(
                        "an orthographic depth buffer has no infinite far plane; use Forward or Reversed"
                            .into(),
                    ));
                }
            }
            Self::Clip { .. } | Self::ViewZ | Self::AlongRay => {}
        }
        Ok(())
    }

    /// Distance along the view direction of a texel in [0, 1]; the cleared value is `+∞`.
    fn view_z(&self, projection: Projection, z: f64) -> f64 {
        let cleared = match self {
            Self::Forward { .. } | Self::ForwardInfinite { .. } => z == 1.0,
            Self::Reversed { .. } | Self::ReversedInfinite { .. } => z == 0.0,
            Self::Clip { .. } | Self::ViewZ | Self::AlongRay => return z,
        };
        if cleared {
            return f64::INFINITY;
        }
        match (*self, projection) {
            // z = far·(v − near) / (v·(far − near)), solved for v; the denominator is > 0 for z < 1.
            (Self::Forward { near, far }, Projection::Perspective) => near * far / (far - z * (far - near)),
            (Self::Reversed { near, far }, Projection::Perspective) => near * far / (near + z * (far - near)),
            (Self::Forward { near, far }, Projection::Orthographic) => near + z * (far - near),
            (Self::Reversed { near, far }, Projection::Orthographic) => far - z * (far - near),
            (Self::ForwardInfinite { near }, _) => near / (1.0 - z),
            (Self::ReversedInfinite { near }, _) => near / z,
            (Self::Clip { .. } | Self::ViewZ | Self::AlongRay, _) => z,
        }
    }

    /// The inverse of [`Self::view_z`], clamped to [0, 1] before near and beyond far.
    fn texel(&self, projection: Projection, view_z: f64) -> f64 {
        let forward = |near: f64, far: f64| match projection {
            _ if view_z == f64::INFINITY => 1.0,
            Projection::Perspective => far * (view_z - near) / (view_z * (far - near)),
            Projection::Orthographic => (view_z - near) / (far - near),
        };
        match *self {
            Self::Forward { near, far } => forward(near, far).clamp(0.0, 1.0),
            // Not 1 − forward: that would lose the precision at large distances that reversed z is there for.
            Self::Reversed { near, far } => match projection {
                _ if view_z == f64::INFINITY => 0.0,
                Projection::Perspective => near * (far - view_z) / (view_z * (far - near)),
                Projection::Orthographic => (far - view_z) / (far - near),
            }
            .clamp(0.0, 1.0),
            Self::ForwardInfinite { near } => (1.0 - near / view_z).clamp(0.0, 1.0),
            Self::ReversedInfinite { near } => (near / view_z).clamp(0.0, 1.0),
            Self::Clip { .. } | Self::ViewZ | Self::AlongRay => view_z,
        }
    }
}

/// Distance along the ray over distance along the view direction: 1 / cos of the angle between them.
fn stretch_of(camera: &Camera, index: usize, encoding: &DepthEncoding) -> f64 {
    if *encoding == DepthEncoding::AlongRay {
        return 1.0;
    }
    let width = camera.size()[0] as usize;
    let ray = camera.pixel_ray((index % width) as u32, (index / width) as u32);
    1.0 / ray.direction.dot(camera.forward())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [7, 5];

    fn cameras() -> [Camera; 2] {
        let (eye, target, up) = ([1.0, 2.0, 3.0], [0.0, 1.0, -4.0], [0.0, 1.0, 0.0]);
        [
            Camera::perspective(eye, target, up, 100.0, SIZE).unwrap(),
            Camera::orthographic(eye, target, up, 10.0, SIZE).unwrap(),
        ]
    }

    fn encodings() -> [DepthEncoding; 6] {
        let (near, far) = (0.25, 200.0);
        [
            DepthEncoding::Forward { near, far },
            DepthEncoding::Reversed { near, far },
            DepthEncoding::ForwardInfinite { near },
            DepthEncoding::ReversedInfinite { near },
            DepthEncoding::ViewZ,
            DepthEncoding::AlongRay,
        ]
    }

    #[test]
    fn every_round_trip_returns_the_distance() {
        let distances: Vec<f32> =
            (0..35).map(|i| if i % 11 == 10 { f32::INFINITY } else { 1.0 + i as f32 * 1.5 }).collect();
        for camera in cameras() {
            for encoding in encodings() {
                let (mut encoded, mut decoded) = (Vec::new(), Vec::new());
                if encoding.encode(&camera, &distances, &mut encoded).is_err() {
                    assert_eq!(camera.projection(), Projection::Orthographic, "{encoding:?}");
                    continue;
                }
                encoding.decode(&camera, &encoded, &mut decoded).unwrap();
                for (a, b) in distances.iter().zip(&decoded) {
                    // Forward z near 1 moves by 2⁻²⁵ when it is rounded to f32; dv = v²/near·dz with v ≤ 60, near = ¼.
                    let tolerance = 60.0 * 60.0 / 0.25 * 2f32.powi(-24) + a * 1e-6;
                    assert!(a == b || (a - b).abs() <= tolerance, "{encoding:?}: {a} became {b}");
                }
            }
        }
    }

    #[test]
    fn known_depths_decode_to_known_distances() {
        // The middle pixel looks along the view direction, so that stretch = 1.
        let camera = &cameras()[0];
        let middle = 2 * 7 + 3;
        let at = |encoding: DepthEncoding, z: f32| {
            let mut out = Vec::new();
            encoding.decode(camera, &[z; 35], &mut out).unwrap();
            out[middle]
        };
        let (near, far) = (1.0, 3.0);
        assert!((at(DepthEncoding::Forward { near, far }, 0.75) - 2.0).abs() < 1e-6);
        assert!((at(DepthEncoding::Reversed { near, far }, 0.25) - 2.0).abs() < 1e-6);
        assert!((at(DepthEncoding::ReversedInfinite { near }, 0.25) - 4.0).abs() < 1e-6);
        assert!((at(DepthEncoding::ForwardInfinite { near }, 0.75) - 4.0).abs() < 1e-6);
        assert_eq!(at(DepthEncoding::ReversedInfinite { near }, 0.0), f32::INFINITY);
        assert_eq!(at(DepthEncoding::Forward { near, far }, 1.0), f32::INFINITY);
    }

    #[test]
    fn a_bad_texel_is_named() {
        let mut texels = [1.0f32; 35];
        texels[2 * 7 + 4] = -0.5;
        let error = DepthMap::new(&texels, SIZE).unwrap_err().to_string();
        assert!(error.contains("(4, 2)"), "{error}");
        texels[2 * 7 + 4] = f32::NAN;
        assert!(DepthMap::new(&texels, SIZE).is_err());
        let mut out = Vec::new();
        let encoding = DepthEncoding::ReversedInfinite { near: 0.1 };
        assert!(encoding.decode(&cameras()[0], &texels, &mut out).is_err());
        assert!(DepthMap::new(&texels[1..], SIZE).unwrap_err().to_string().contains("34"));
    }
}
