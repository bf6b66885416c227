//! What a technique returns: in-scattered radiance and transmittance of every pixel.

use crate::error::{ModelError, checked_len};

/// In-scattered RGB radiance and RGB transmittance, `[y][x]`, row 0 on top.
///
/// An engine composes `inscattered + transmittance · surface`. A technique overwrites and resizes it; the second
/// frame of the same size allocates nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScatterImage {
    size: [u32; 2],
    inscattered: Vec<[f32; 3]>,
    transmittance: Vec<[f32; 3]>,
}

impl ScatterImage {
    /// An empty image; [`Self::resize`] gives it pixels.
    pub fn new() -> Self {
        Self::default()
    }

    /// Gives the image a size; all radiance 0, all transmittance 1. Allocates only where it grows.
    pub fn resize(&mut self, size: [u32; 2]) {
        let count = size[0] as usize * size[1] as usize;
        self.size = size;
        self.inscattered.clear();
        self.inscattered.resize(count, [0.0; 3]);
        self.transmittance.clear();
        self.transmittance.resize(count, [1.0; 3]);
    }

    /// Both buffers with the given size and whatever they held before, for a technique that writes every pixel. Saves
    /// the time to clear them, 24 bytes a pixel, where the size is the last frame's.
    pub fn overwritten(&mut self, size: [u32; 2]) -> (&mut [[f32; 3]], &mut [[f32; 3]]) {
        if self.size != size {
            self.resize(size);
        }
        self.pixels_mut()
    }

    /// `[width, height]`.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// In-scattered radiance \[W/(m²·sr)\] at pixel `(x, y)`.
    pub fn at(&self, x: u32, y: u32) -> [f32; 3] {
        self.inscattered[y as usize * self.size[0] as usize + x as usize]
    }

    /// In-scattered radiance of all pixels, `[y][x]`.
    pub fn inscattered(&self) -> &[[f32; 3]] {
        &self.inscattered
    }

    /// Transmittance of all pixels, `[y][x]`, 0 to 1.
    pub fn transmittance(&self) -> &[[f32; 3]] {
        &self.transmittance
    }

    /// Both buffers, for a technique to fill.
    pub fn pixels_mut(&mut self) -> (&mut [[f32; 3]], &mut [[f32; 3]]) {
        (&mut self.inscattered, &mut self.transmittance)
    }

    /// Adds the in-scattered radiance of another light of the same frame.
    pub fn add(&mut self, other: &Self) -> Result<(), ModelError> {
        checked_len("image to add", other.inscattered.len(), self.inscattered.len())?;
        if self.size != other.size {
            return Err(ModelError::Mismatch(
                "the images to add differ in size; render both at one size".into(),
            ));
        }
        for (sum, more) in self.inscattered.iter_mut().zip(&other.inscattered) {
            for (s, m) in sum.iter_mut().zip(more) {
                *s += m;
            }
        }
        Ok(())
    }

    /// Bytes that the two buffers hold.
    pub fn memory_bytes(&self) -> u64 {
        ((self.inscattered.capacity() + self.transmittance.capacity()) * size_of::<[f32; 3]>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_lights_add_their_radiance_and_share_their_transmittance() {
        let mut sum = ScatterImage::new();
        sum.resize([3, 1]);
        sum.pixels_mut().0[2] = [1.0, 2.0, 3.0];
        sum.pixels_mut().1[2] = [0.5; 3];
        let more = sum.clone();
        sum.add(&more).unwrap();
        assert_eq!(sum.at(2, 0), [2.0, 4.0, 6.0]);
        assert_eq!(sum.transmittance()[2], [0.5; 3]);
        let mut other = ScatterImage::new();
        other.resize([1, 3]);
        assert!(sum.add(&other).is_err());
    }
}
