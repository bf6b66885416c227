//! A light's colour texture along a slice: where the colour of its light rays changes (Yusov 2012, Section 6.4).
//!
//! A textured light cannot skip lit runs: each is cut at every texel of the texture whose colour differs from the one before.

use epipolar::driver::SliceView;
use scatter_core::{Frame, LightTexture};

use super::traversal::SliceRay;

/// Colours along one slice, from the eye on; white where the texture does not reach. A buffer.
#[derive(Debug, Default)]
pub struct SliceColours {
    /// The light ray at which each begins.
    starts: Vec<f32>,
    colours: Vec<[f32; 3]>,
}

impl SliceColours {
    /// Room for the frame's texture.
    pub fn reserve(&mut self, frame: &Frame<'_>) {
        let texels = frame
            .texture()
            .map_or(0, |texture| texture.projection().size()[0].max(texture.projection().size()[1]));
        let most = 2 * texels as usize + 4;
        self.starts.clear();
        self.starts.reserve(most);
        self.colours.clear();
        self.colours.reserve(most);
    }

    /// Reads the texture along a slice.
    pub fn lay(&mut self, slice: &SliceView<'_>, texture: &LightTexture<'_>) {
        self.starts.clear();
        self.colours.clear();
        self.push(0.0, [1.0; 3]);
        if let Some(line) = slice.texture_line(texture) {
            line.for_each_texel(|start, texel| self.push(start, texture.texels()[texel]));
            self.push(line.gamma.at(line.length), [1.0; 3]);
        }
    }

    fn push(&mut self, start: f32, colour: [f32; 3]) {
        if self.colours.last() != Some(&colour) {
            self.starts.push(start);
            self.colours.push(colour);
        }
    }

    /// Calls `each(a, b, colour)` for the pieces of a lit run of a ray.
    #[inline(always)]
    pub fn pieces(
        &self,
        slice: &SliceView<'_>,
        ray: &SliceRay,
        [from, to]: [f64; 2],
        mut each: impl FnMut([f64; 2], [f32; 3]),
    ) {
        let gamma = slice.light.light_ray(from, ray.sine, ray.cosine);
        let first = self.starts.partition_point(|&start| f64::from(start) <= gamma).max(1) - 1;
        let mut at = from;
        for (index, &colour) in self.colours.iter().enumerate().skip(first) {
            let end = self
                .starts
                .get(index + 1)
                .map_or(f64::INFINITY, |&start| slice.light.distance(f64::from(start), ray.sine, ray.cosine));
            let end = end.min(to);
            if end > at {
                each([at, end], colour);
                at = end;
            }
            if end >= to {
                break;
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.starts.capacity() * size_of::<f32>() + self.colours.capacity() * size_of::<[f32; 3]>()
    }
}
