//! What every pixel would have without a shadow, around a spot: rays that miss its cone, or end before it, see no light, and what is
//! no light has no share that could be interpolated.
//!
//! Shares between rays of a cone are therefore interpolated as quotients of two sums: of what the rays have, and of what they would
//! have without a shadow. A ray without light counts for nothing in either.

use scatter_core::{
    Frame, Level, Light, LightIntegralF32, RayLanes, at_level, parallel, transmittances_of_pixels_f32,
};

const LANES: usize = RayLanes::COUNT;

/// The most that counts, so that sums of a few stay finite.
const MOST: f32 = 1e30;

/// Light that weighs a ray's share: 0 where there is none.
#[inline(always)]
pub fn weight_of(light: f32) -> f32 {
    // Not a number is no light, either.
    if light > 0.0 { light.min(MOST) } else { 0.0 }
}

/// Light of the pixels; a buffer.
#[derive(Debug, Default)]
pub struct PixelLights {
    lights: Vec<f32>,
}

impl PixelLights {
    /// Of a frame: one a pixel around a spot, none elsewhere, where every ray sees light. O(pixels).
    pub fn rebuild(&mut self, frame: &Frame<'_>, simd: Level) {
        if !matches!(frame.light(), Light::Spot(_)) {
            self.lights.clear();
            return;
        }
        let [width, height] = frame.size().map(|side| side as usize);
        self.lights.resize(width * height, 0.0);
        let light = LightIntegralF32::new(frame.setup());
        parallel::for_each_row(&mut self.lights, width, |y, row| {
            at_level!(simd, fill_row(frame, (&light, simd), y, row));
        });
    }

    /// The light of every pixel; `None` where every ray sees light.
    pub fn all(&self) -> Option<&[f32]> {
        (!self.lights.is_empty()).then_some(&*self.lights)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.lights.capacity() * size_of::<f32>()
    }
}

#[inline(always)]
fn fill_row(frame: &Frame<'_>, (light, simd): (&LightIntegralF32<'_>, Level), y: usize, row: &mut [f32]) {
    let depth = &frame.depth().texels()[y * row.len()..][..row.len()];
    let limit = frame.max_distance() as f32;
    for (index, (row, depth)) in row.chunks_mut(LANES).zip(depth.chunks(LANES)).enumerate() {
        let mut ends = [0.0f32; LANES];
        ends.iter_mut().zip(depth).for_each(|(end, depth)| *end = depth.min(limit));
        let at = ((index * LANES) as u32, y as u32);
        let through = transmittances_of_pixels_f32(frame.setup(), at, &ends);
        let radiance = light.whole_rays(simd, frame.setup(), at, &ends, &through);
        for (lane, own) in row.iter_mut().enumerate() {
            *own = weight_of(radiance[0][lane] + radiance[1][lane] + radiance[2][lane]);
        }
    }
}
