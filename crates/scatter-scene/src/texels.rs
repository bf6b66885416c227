//! Texture images, as far as shadows need them: the channels of PNG and JPEG files as fractions.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder};

use crate::error::{Checked, Fault};
use crate::radiance_image::{MAX_SAMPLE_BYTES, MAX_SIDE, checked_image_size};

/// A decoded texture of 16 bits a channel; 8 bits are widened so that the fractions stay the same.
pub(crate) struct Texels {
    /// `[columns, rows]`, each at least 1.
    pub size: [u32; 2],
    /// Whether the file has an alpha channel.
    pub has_alpha: bool,
    /// `[row][column][R, G, B, A]`, row 0 on top.
    samples: Vec<u16>,
}

impl Texels {
    /// Alpha in 0 to 1; 1 where the file has none.
    pub(crate) fn alpha(&self, column: u32, row: u32) -> f64 {
        self.channel(3, column, row)
    }

    /// Red (0), green, blue or alpha (3) in 0 to 1, as stored (no sRGB curve is undone).
    pub(crate) fn channel(&self, channel: usize, column: u32, row: u32) -> f64 {
        let texel = row as usize * self.size[0] as usize + column as usize;
        f64::from(self.samples[4 * texel + channel]) / 65535.0
    }

    /// Whether all texels are there, or none; `None` if some are.
    pub(crate) fn uniform(&self, is_there: impl Fn(u32, u32) -> bool) -> Option<bool> {
        let first = is_there(0, 0);
        let all = |row| (0..self.size[0]).all(|column| is_there(column, row) == first);
        (0..self.size[1]).all(all).then_some(first)
    }
}

/// Decodes a PNG or JPEG by its content.
pub(crate) fn decode_texels(bytes: &[u8]) -> Checked<Texels> {
    let image = if bytes.starts_with(b"\x89PNG") {
        crate::image_file::decode_png(bytes)?
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        decode_jpeg(bytes)?
    } else {
        let problem = format!("the image is {}", kind(bytes));
        return Err(Fault::unsupported("", problem, "save it as PNG or JPEG"));
    };
    let size = [image.width(), image.height()];
    let has_alpha = image.color().has_alpha();
    Ok(Texels { size, has_alpha, samples: image.into_rgba16().into_raw() })
}

/// Whether an image has an alpha channel, by its header alone; what cannot be read may have one.
pub(crate) fn has_alpha(bytes: &[u8]) -> bool {
    if bytes.starts_with(b"\xff\xd8\xff") {
        return false;
    }
    match image::codecs::png::PngDecoder::new(Cursor::new(bytes)) {
        Ok(decoder) => decoder.color_type().has_alpha(),
        Err(_) => true,
    }
}

fn decode_jpeg(bytes: &[u8]) -> Checked<DynamicImage> {
    let fault = |error: image::ImageError| {
        Fault::invalid("JPEG", error.to_string(), "the file is cut off or damaged: write or copy it again")
    };
    let mut decoder = image::codecs::jpeg::JpegDecoder::new(Cursor::new(bytes)).map_err(fault)?;
    let (width, height) = decoder.dimensions();
    checked_image_size("JPEG header", [width.into(), height.into()])?;
    let mut limits = image::Limits::no_limits();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_SAMPLE_BYTES);
    decoder.set_limits(limits).map_err(fault)?;
    DynamicImage::from_decoder(decoder).map_err(fault)
}

fn kind(bytes: &[u8]) -> &'static str {
    let at = |offset: usize, magic: &[u8]| bytes.get(offset..).is_some_and(|rest| rest.starts_with(magic));
    match () {
        () if at(8, b"WEBP") => "a WebP",
        () if at(0, b"\xabKTX") => "a KTX",
        () if at(0, b"DDS ") => "a DDS",
        () if at(0, b"GIF8") => "a GIF",
        () if at(0, b"BM") => "a BMP",
        () if at(0, b"II*\0") || at(0, b"MM\0*") => "a TIFF",
        () if at(4, b"ftypavif") => "an AVIF",
        () if at(0, b"\x76\x2f\x31\x01") => "an EXR",
        () if bytes.is_empty() => "empty",
        () => "of a kind that is not known",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(image: &DynamicImage, format: image::ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn alpha_of_every_depth_is_the_same_fraction_and_a_jpeg_has_none() {
        let png = image::ImageFormat::Png;
        let eight = image::RgbaImage::from_fn(3, 2, |x, y| image::Rgba([9, 8, 7, (x * 50 + y * 100) as u8]));
        let texels = decode_texels(&encoded(&eight.into(), png)).unwrap();
        assert_eq!((texels.size, texels.has_alpha), ([3, 2], true));
        for (x, y) in [(0, 0), (2, 0), (1, 1)] {
            assert_eq!(texels.alpha(x, y), f64::from(x * 50 + y * 100) / 255.0);
        }
        assert_eq!(texels.channel(0, 1, 1), 9.0 / 255.0);
        let sixteen = image::ImageBuffer::from_fn(2, 1, |x, _| image::LumaA([0u16, 12345 + x as u16]));
        let texels = decode_texels(&encoded(&DynamicImage::ImageLumaA16(sixteen), png)).unwrap();
        assert_eq!(texels.alpha(1, 0), 12346.0 / 65535.0);
        let opaque = DynamicImage::new_rgb8(4, 5);
        for format in [png, image::ImageFormat::Jpeg] {
            let texels = decode_texels(&encoded(&opaque, format)).unwrap();
            assert_eq!((texels.size, texels.has_alpha, texels.alpha(3, 4)), ([4, 5], false, 1.0));
            assert_eq!(texels.uniform(|x, y| texels.alpha(x, y) >= 0.5), Some(true));
        }
    }

    #[test]
    fn other_kinds_are_named_and_damaged_files_are_faults() {
        let message = |bytes: &[u8]| decode_texels(bytes).err().unwrap().to_string();
        assert!(message(b"RIFF\0\0\0\0WEBPVP8 ").contains("a WebP; save it as PNG or JPEG"));
        assert!(message(b"\xabKTX 20\xbb").contains("KTX"));
        assert!(message(b"").contains("empty"));
        let jpeg = encoded(&DynamicImage::new_rgb8(64, 64), image::ImageFormat::Jpeg);
        assert!(message(&jpeg[..20]).contains("JPEG"));
    }
}
