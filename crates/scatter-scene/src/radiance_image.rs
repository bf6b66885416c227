//! Images of radiance in memory, and how large an image may be.

use crate::error::{Checked, Fault};

/// Longest side of an image that is read or rendered, in pixels.
pub const MAX_SIDE: u32 = 16_384;

/// Most pixels of an image that is read or rendered: 3 GiB of RGB f32.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Most bytes of an image file's samples, all channels together: a layered EXR holds many that are not ours.
pub(crate) const MAX_SAMPLE_BYTES: u64 = 6 << 30;

/// Linear RGB radiance.
#[derive(Debug, Clone, PartialEq)]
pub struct RadianceImage {
    /// `[width, height]` in pixels, each ≥ 1.
    pub size: [u32; 2],
    /// `[row][column]`, row 0 on top; any f32, NaN included.
    pub pixels: Vec<[f32; 3]>,
}

pub(crate) fn checked_shape(image: &RadianceImage) -> Checked<[usize; 2]> {
    let size = checked_image_size("", image.size.map(u64::from))?.map(|side| side as usize);
    if image.pixels.len() == size[0] * size[1] {
        return Ok(size);
    }
    let problem = format!("{} pixels for {} by {}", image.pixels.len(), size[0], size[1]);
    Err(Fault::invalid("", problem, "give width times height pixels"))
}

/// An error unless the size is sane for an image.
pub(crate) fn checked_image_size(place: &str, size: [u64; 2]) -> Checked<[u32; 2]> {
    let [width, height] = size;
    let limit = u64::from(MAX_SIDE);
    let is_sane =
        (1..=limit).contains(&width) && (1..=limit).contains(&height) && width * height <= MAX_PIXELS;
    if is_sane {
        // Both are at most MAX_SIDE.
        return Ok([width as u32, height as u32]);
    }
    let problem = format!("the image has {width} by {height} pixels");
    let cure = format!("give 1 to {MAX_SIDE} pixels a side and at most {MAX_PIXELS} in all");
    Err(Fault::too_large(place, problem, cure))
}
