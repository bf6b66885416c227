//! What an engine's clip space means: to which side row 0 lies, and how z/w grows with distance.
//!
//! A matrix alone does not say either: a y that points down looks like a mirrored image, and reversed z like forward z
//! of the other handedness. Handedness itself is no choice here: a matrix of a left-handed engine (w row 0 0 1 0) says so.

use glam::DVec4;

/// The clip space that an engine's matrices lead to. Start from the API's constant and say what differs:
/// `ClipSpace::WGPU.reversed()`.
///
/// | constant | row 0 of an image or a map is at | z/w from near to far | a texel holds |
/// | --- | --- | --- | --- |
/// | [`WGPU`](Self::WGPU), [`DIRECT3D`](Self::DIRECT3D), [`METAL`](Self::METAL) | y/w = +1 | 0 to 1 | z/w |
/// | [`VULKAN`](Self::VULKAN) | y/w = −1 | 0 to 1 | z/w |
/// | [`OPENGL`](Self::OPENGL) | y/w = −1 | −1 to 1 | (z/w + 1)/2 |
///
/// Vulkan with a flipped viewport (a negative height) is `WGPU`. OpenGL's textures and `glReadPixels` have row 0 at the
/// bottom of the picture, and so has an image that a technique returns for such a camera; for rows that were turned, add
/// [`with_row_0_at`](Self::with_row_0_at)`(1.0)`. OpenGL after `glClipControl(…, GL_ZERO_TO_ONE)`: `VULKAN`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClipSpace {
    /// y/w of the upper border of row 0: 1 or −1.
    row_0: f64,
    /// z/w at the near plane, and at the far plane.
    near: f64,
    far: f64,
}

impl ClipSpace {
    /// y up, z/w from 0 to 1.
    pub const WGPU: Self = Self { row_0: 1.0, near: 0.0, far: 1.0 };
    /// As [`Self::WGPU`].
    pub const DIRECT3D: Self = Self::WGPU;
    /// As [`Self::WGPU`].
    pub const METAL: Self = Self::WGPU;
    /// y down, z/w from 0 to 1.
    pub const VULKAN: Self = Self { row_0: -1.0, ..Self::WGPU };
    /// Rows from the bottom, z/w from −1 to 1.
    pub const OPENGL: Self = Self { row_0: -1.0, near: -1.0, far: 1.0 };

    /// The same with z/w falling from the near plane to the far plane, finite or infinite: reversed z.
    pub const fn reversed(self) -> Self {
        Self { near: self.far, far: self.near, ..self }
    }

    /// The same with row 0 at y/w = `y`, of which only the sign is read: +1 (wgpu, Direct3D, Metal) or −1.
    pub const fn with_row_0_at(self, y: f64) -> Self {
        Self { row_0: if y < 0.0 { -1.0 } else { 1.0 }, ..self }
    }

    /// Whether z/w falls with distance.
    pub fn is_reversed(&self) -> bool {
        self.near > self.far
    }

    /// The texel of a cleared map: no surface.
    pub fn cleared(&self) -> f32 {
        if self.is_reversed() { 0.0 } else { 1.0 }
    }

    /// +1 if z/w grows with distance, −1 if it falls.
    pub(crate) fn sign(&self) -> f64 {
        if self.is_reversed() { -1.0 } else { 1.0 }
    }

    /// z/w at the near plane.
    pub(crate) fn near(&self) -> f64 {
        self.near
    }

    /// z/w of a texel in [0, 1].
    pub(crate) fn z_of_texel(&self, texel: f64) -> f64 {
        if self.near.min(self.far) < 0.0 { 2.0 * texel - 1.0 } else { texel }
    }

    /// The texel that holds z/w, clamped to [0, 1] as devices do.
    pub(crate) fn texel_of_z(&self, z: f64) -> f64 {
        let texel = if self.near.min(self.far) < 0.0 { 0.5 * z + 0.5 } else { z };
        texel.clamp(0.0, 1.0)
    }

    /// The y row with y up, so that row 0 is at y = w.
    pub(crate) fn y_up(&self, y: DVec4) -> DVec4 {
        y * self.row_0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_z_in_every_space() {
        for space in [ClipSpace::WGPU, ClipSpace::VULKAN, ClipSpace::OPENGL] {
            for space in [space, space.reversed()] {
                assert_eq!(space.texel_of_z(space.far) as f32, space.cleared());
                assert_eq!(space.texel_of_z(space.near), 1.0 - space.texel_of_z(space.far));
                assert_eq!(space.z_of_texel(space.texel_of_z(0.25)), 0.25);
                assert_eq!(space.sign(), (space.far - space.near).signum());
                assert_eq!(space.reversed().reversed(), space);
            }
        }
    }
}
