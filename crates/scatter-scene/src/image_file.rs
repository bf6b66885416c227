//! Image files: radiance as EXR, a tone-mapped PNG to look at, masks and textures from PNG.
//!
//! Rows are stored from the top, as everywhere in Scatter. Sizes are checked against [`MAX_PIXELS`] before anything
//! is allocated for them; files are written whole or not at all.

use std::io::{self, Cursor};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::SampleType;
use exr::prelude::{
    Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, SpecificChannels, Vec2,
    WritableImage,
};
use image::{DynamicImage, ImageDecoder};

use crate::atomic::write_atomically;
use crate::error::{Checked, Fault, SceneError};
use crate::load::read_file;

/// Longest side of an image that is read or rendered, in pixels.
pub const MAX_SIDE: u32 = 16_384;

/// Most pixels of an image that is read or rendered: 3 GiB of RGB f32.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Most bytes of an image file's samples, all channels together: a layered EXR holds many that are not ours.
const MAX_SAMPLE_BYTES: u64 = 6 << 30;

const DAMAGED: &str = "the file is cut off or damaged: write or copy it again";

/// Linear RGB radiance.
#[derive(Debug, Clone, PartialEq)]
pub struct RadianceImage {
    /// `[width, height]` in pixels, each ≥ 1.
    pub size: [u32; 2],
    /// `[row][column]`, row 0 on top; any f32, NaN included.
    pub pixels: Vec<[f32; 3]>,
}

/// Which pixels a comparison leaves out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    /// `[width, height]` in pixels, each ≥ 1.
    pub size: [u32; 2],
    /// `[row][column]`, row 0 on top; `true`: left out.
    pub excluded: Vec<bool>,
}

/// Writes channels R, G, B as float32, losslessly (run-length encoding: the fastest one that saves space).
pub fn write_exr(path: &Path, image: &RadianceImage) -> Result<(), SceneError> {
    let [width, height] = checked_shape(image).map_err(|fault| fault.in_file(path))?;
    let pixel = |at: Vec2<usize>| {
        let [r, g, b] = image.pixels[at.y() * width + at.x()];
        (r, g, b)
    };
    let attributes = LayerAttributes::default();
    let layer =
        Layer::new((width, height), attributes, Encoding::FAST_LOSSLESS, SpecificChannels::rgb(pixel));
    let exr = Image::from_layer(layer);
    write_atomically(path, |writer| {
        exr.write().non_parallel().to_buffered(writer).map_err(|error| match error {
            exr::error::Error::Io(error) => error,
            other => io::Error::other(other),
        })
    })
}

/// Reads the first layer's R, G, B (or Y, as grey) of any float or half type.
pub fn read_exr(path: &Path) -> Result<RadianceImage, SceneError> {
    let bytes = read_file(path)?;
    decode_exr(&bytes).map_err(|fault| fault.in_file(path))
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
        decode_exr(&bytes)
    } else {
        Err(Fault::unsupported("", "this is neither an EXR nor a PNG", "convert it to one of them"))
    };
    image.map_err(|fault| fault.in_file(path))
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

fn checked_shape(image: &RadianceImage) -> Checked<[usize; 2]> {
    let size = checked_image_size("", image.size.map(u64::from))?.map(|side| side as usize);
    if image.pixels.len() == size[0] * size[1] {
        return Ok(size);
    }
    let problem = format!("{} pixels for {} by {}", image.pixels.len(), size[0], size[1]);
    Err(Fault::invalid("", problem, "give width times height pixels"))
}

fn decode_exr(bytes: &[u8]) -> Checked<RadianceImage> {
    let fault = |error: exr::error::Error| Fault::invalid("EXR", error.to_string(), DAMAGED);
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fault)?;
    let mut sample_bytes = 0u64;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.x() as u64, header.layer_size.y() as u64];
        checked_image_size("EXR header", [width, height])?;
        let pixel_bytes = header.channels.list.iter().map(|channel| match channel.sample_type {
            SampleType::F16 => 2,
            SampleType::F32 | SampleType::U32 => 4,
        });
        sample_bytes = sample_bytes.saturating_add((width * height).saturating_mul(pixel_bytes.sum()));
        // Every chunk has 8 bytes in the offset table and at least a coordinate and a length of its own.
        if header.chunk_count.saturating_mul(16) > bytes.len() {
            return Err(Fault::invalid("EXR header", "it announces more than the file holds", DAMAGED));
        }
    }
    if sample_bytes > MAX_SAMPLE_BYTES {
        let problem = format!("it announces {sample_bytes} bytes of samples");
        return Err(Fault::too_large("EXR header", problem, "write fewer layers and channels"));
    }
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let read = read.first_valid_layer().all_attributes().non_parallel();
    let layer = read.from_buffered(Cursor::new(bytes)).map_err(fault)?.layer_data;
    let channel = |name: &str| {
        let found = layer.channel_data.list.iter().find(|channel| channel.name.eq_case_insensitive(name));
        found.map(|channel| &channel.sample_data)
    };
    let channels = match (channel("R"), channel("G"), channel("B"), channel("Y")) {
        (Some(r), Some(g), Some(b), _) => [r, g, b],
        (_, _, _, Some(y)) => [y; 3],
        _ => return Err(Fault::unsupported("EXR", "it has no channels R, G, B and no Y", "write RGB or Y")),
    };
    let size = [layer.size.x() as u64, layer.size.y() as u64];
    let size = checked_image_size("EXR header", size)?;
    let count = size[0] as usize * size[1] as usize;
    if channels.iter().any(|samples| samples.len() != count) {
        return Err(Fault::unsupported(
            "EXR",
            "a channel is subsampled",
            "write all channels at full resolution",
        ));
    }
    if channels.iter().any(|samples| matches!(samples, FlatSamples::U32(_))) {
        return Err(Fault::unsupported("EXR", "a channel holds integers", "write half or float samples"));
    }
    let pixels =
        (0..count).map(|i| channels.map(|samples| samples.value_by_flat_index(i).to_f32())).collect();
    Ok(RadianceImage { size, pixels })
}

fn decode_png(bytes: &[u8]) -> Checked<DynamicImage> {
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

    fn gradient() -> RadianceImage {
        let size = [5u32, 3];
        let pixel = |i: u32| [i as f32 * 0.1, 1e-30 * i as f32, 1e30];
        RadianceImage { size, pixels: (0..15).map(pixel).collect() }
    }

    fn message<T>(result: Result<T, SceneError>) -> String {
        result.err().expect("an error").to_string()
    }

    #[test]
    fn exr_keeps_every_bit_and_nan_and_infinity() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut image = gradient();
        image.pixels[7] = [f32::NAN, f32::INFINITY, -0.0];
        write_exr(&path, &image).unwrap();
        let read = read_exr(&path).unwrap();
        let bits = |image: &RadianceImage| -> Vec<[u32; 3]> {
            image.pixels.iter().map(|rgb| rgb.map(f32::to_bits)).collect()
        };
        assert_eq!((read.size, bits(&read)), (image.size, bits(&image)));
        assert_eq!(read_linear_rgb(&path).unwrap().size, [5, 3]);
    }

    #[test]
    fn half_floats_and_grey_are_read_and_other_channels_refused() {
        use exr::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("y.exr");
        let write = |name: &str, samples: FlatSamples| {
            let channels = AnyChannels::sort([AnyChannel::new(name, samples)].into_iter().collect());
            let layer = Layer::new((3, 2), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
            Image::from_layer(layer).write().non_parallel().to_file(&path).unwrap();
        };
        write("Y", FlatSamples::F16((0..6).map(|i| f16::from_f32(i as f32)).collect()));
        let grey = read_exr(&path).unwrap();
        assert_eq!((grey.size, grey.pixels[4]), ([3, 2], [4.0; 3]));
        write("Z", FlatSamples::F32(vec![0.0; 6]));
        assert!(message(read_exr(&path)).contains("no channels R, G, B"));
        write("Y", FlatSamples::U32(vec![0; 6]));
        assert!(message(read_exr(&path)).contains("integers"));
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
