//! Image files but for EXR: a tone-mapped PNG to look at, masks and textures from PNG.
//!
//! Rows are stored from the top, as everywhere in Scatter. Sizes are checked against [`MAX_PIXELS`](crate::MAX_PIXELS) before anything
//! is allocated for them; files are written whole or not at all.

use std::io::{self, Cursor};
use std::path::Path;

use image::{DynamicImage, ImageDecoder};

use crate::atomic::write_atomically;
use crate::error::{Checked, Fault, SceneError};
use crate::exr_file::decode_exr;
use crate::radiance_image::{MAX_SAMPLE_BYTES, MAX_SIDE, RadianceImage, checked_image_size, checked_shape};
use crate::regular_file::read_file;

const DAMAGED: &str = "the file is cut off or damaged: write or copy it again";

/// Which pixels a comparison leaves out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    /// `[width, height]` in pixels, each ≥ 1.
    pub size: [u32; 2],
    /// `[row][column]`, row 0 on top; `true`: left out.
    pub excluded: Vec<bool>,
}

/// Writes a PNG to look at: `1 − exp(−exposure·L)` a channel, then the sRGB curve, 8 bits. `exposure` ≥ 0
/// \[1/radiance\]; radiance `1/exposure` becomes 63 % of linear white. Pixels with a NaN or an infinity are magenta.
pub fn write_png(path: &Path, image: &RadianceImage, exposure: f32) -> Result<(), SceneError> {
    checked_shape(image).map_err(|fault| fault.in_file(path))?;
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|&rgb| displayed(rgb, exposure)).collect();
    let png = encode_png(image.size, &bytes).map_err(|source| SceneError::write(path, source))?;
    write_atomically(path, |writer| writer.write_all(&png))
}

/// A PNG in memory, of 8-bit samples `[row][column][R, G, B]`, row 0 on top. An error if there are not `width·height·3`.
pub fn encode_png([width, height]: [u32; 2], rgb: &[u8]) -> io::Result<Vec<u8>> {
    let mut png = Cursor::new(Vec::new());
    let (colour, format) = (image::ColorType::Rgb8, image::ImageFormat::Png);
    if rgb.len() as u64 != u64::from(width) * u64::from(height) * 3 {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "give three samples a pixel"));
    }
    image::write_buffer_with_format(&mut png, rgb, width, height, colour, format)
        .map_err(io::Error::other)?;
    Ok(png.into_inner())
}

/// Reads a mask: pixels whose grey value is above 127 of 255 are left out.
pub fn read_mask(path: &Path) -> Result<Mask, SceneError> {
    let bytes = read_file(path)?;
    let image = decode_png(&bytes).map_err(|fault| fault.in_file(path))?;
    let size = [image.width(), image.height()];
    let excluded = image.into_luma8().into_raw().into_iter().map(|grey| grey > 127).collect();
    Ok(Mask { size, excluded })
}

/// Reads an EXR (linear as it is) or a PNG (sRGB, 8 or 16 bits, made linear; alpha is ignored) by its content.
pub fn read_linear_rgb(path: &Path) -> Result<RadianceImage, SceneError> {
    let bytes = read_file(path)?;
    let image = if bytes.starts_with(b"\x89PNG") {
        decode_png(&bytes).map(|image| {
            let size = [image.width(), image.height()];
            let samples = image.into_rgb16().into_raw();
            let linear = |v: u16| linear_from_srgb(f32::from(v) / 65535.0);
            let pixels = samples.as_chunks::<3>().0.iter().map(|rgb| rgb.map(linear)).collect();
            RadianceImage { size, pixels }
        })
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decode_exr(&bytes).map(|(image, _)| image)
    } else {
        Err(Fault::unsupported("", "this is neither an EXR nor a PNG", "convert it to one of them"))
    };
    image.map_err(|fault| fault.in_file(path))
}

pub(crate) fn decode_png(bytes: &[u8]) -> Checked<DynamicImage> {
    let fault = |error: image::ImageError| Fault::invalid("PNG", error.to_string(), DAMAGED);
    let mut limits = image::Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_SAMPLE_BYTES);
    let mut decoder =
        image::codecs::png::PngDecoder::with_limits(Cursor::new(bytes), limits.clone()).map_err(fault)?;
    let (width, height) = decoder.dimensions();
    checked_image_size("PNG header", [width.into(), height.into()])?;
    decoder.set_limits(limits).map_err(fault)?;
    DynamicImage::from_decoder(decoder).map_err(fault)
}

fn displayed(rgb: [f32; 3], exposure: f32) -> [u8; 3] {
    if rgb.iter().any(|v| !v.is_finite()) {
        return [255, 0, 255];
    }
    // A float-to-int cast saturates: negative radiance is black.
    rgb.map(|v| (255.0 * srgb_from_linear(1.0 - (-exposure * v.max(0.0)).exp()) + 0.5) as u8)
}

/// IEC 61966-2-1.
fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// IEC 61966-2-1.
fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{read_exr, write_exr};

    fn gradient() -> RadianceImage {
        let size = [5u32, 3];
        let pixel = |i: u32| [i as f32 * 0.1, 1e-30 * i as f32, 1e30];
        RadianceImage { size, pixels: (0..15).map(pixel).collect() }
    }

    fn message<T>(result: Result<T, SceneError>) -> String {
        result.err().expect("an error").to_string()
    }

    #[test]
    fn the_tone_curve_maps_known_radiances_and_shows_what_is_not_finite() {
        assert_eq!(displayed([0.0, -3.0, 1e30], 2.0), [0, 0, 255]);
        // 1 − e^{−1} = 0.632121; 1.055 · 0.632121^{1/2.4} − 0.055 = 0.81648; times 255 is 208.2.
        assert_eq!(displayed([0.5, 0.5, 0.5], 2.0), [208; 3]);
        assert_eq!(displayed([f32::NAN, 0.0, 0.0], 1.0), [255, 0, 255]);
    }

    #[test]
    fn a_png_has_row_0_on_top_and_comes_back_as_mask_and_as_linear_texture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.png");
        // 128 of 255 is the first grey that masks; the alpha channel does not matter.
        let grey: [u8; 12] = [127, 9, 128, 200, 0, 9, 0, 255, 255, 0, 1, 255];
        image::save_buffer(&path, &grey, 3, 2, image::ColorType::La8).unwrap();
        let mask = read_mask(&path).unwrap();
        assert_eq!((mask.size, mask.excluded), ([3, 2], vec![false, true, false, false, true, false]));
        let linear = read_linear_rgb(&path).unwrap().pixels;
        assert_eq!(linear[4], [1.0; 3]);
        // ((128/255 + 0.055)/1.055)^2.4 by hand.
        assert!((linear[1][0] - 0.215_86).abs() < 1e-5, "{:?}", linear[1]);
        let image = RadianceImage { size: [2, 3], pixels: (0..6).map(|i| [i as f32, 0.0, 0.0]).collect() };
        write_png(&path, &image, 1e30).unwrap();
        let mask = read_mask(&path).unwrap();
        // Only pixel 0 is black, at the top left; red's luma is below the threshold.
        assert_eq!(mask.size, [2, 3]);
        let read = read_linear_rgb(&path).unwrap().pixels;
        assert_eq!((read[0], read[1]), ([0.0; 3], [1.0, 0.0, 0.0]));
    }

    #[test]
    fn absurd_sizes_are_refused_before_anything_is_allocated() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("huge.exr");
        write_exr(&path, &gradient()).unwrap();
        let sound = std::fs::read(&path).unwrap();
        // Windows are four i32; the data window follows its name, type and length.
        let at =
            sound.windows(10).position(|w| w == b"dataWindow").unwrap() + "dataWindow\0box2i\0".len() + 4;
        for (x, y) in [(i32::MAX - 1, i32::MAX - 1), (16_383, 16_383), (-2, 5), (70_000, 2)] {
            let mut bytes = sound.clone();
            bytes[at + 8..at + 12].copy_from_slice(&x.to_le_bytes());
            bytes[at + 12..at + 16].copy_from_slice(&y.to_le_bytes());
            std::fs::write(&path, &bytes).unwrap();
            assert!(message(read_exr(&path)).contains("huge.exr: EXR"), "{x} {y}");
        }
        let path = folder.path().join("huge.png");
        write_png(&path, &gradient(), 1.0).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        std::fs::write(&path, &bytes).unwrap();
        assert!(message(read_mask(&path)).contains("huge.png: PNG"));
        let wrong = RadianceImage { size: [4, 4], pixels: vec![[0.0; 3]; 15] };
        assert!(message(write_exr(&path, &wrong)).contains("15 pixels for 4 by 4"));
    }
}
