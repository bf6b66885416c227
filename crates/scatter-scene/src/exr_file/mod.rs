//! EXR files: radiance as we write it, and pictures of other renderers with their parts, layers and windows.
//!
//! Of a file with several pictures, one is taken: R, G, B before luminance and chroma before grey, and among equals the
//! one without a layer's name or with one that means the whole picture (`beauty`, `Combined`). Where none stands out,
//! the file is refused: a diffuse layer is no picture. The picture is that of the display window: pixels of the data
//! window beyond it go, and where it is larger than the data window, it is black. Luminance and chroma become RGB by the
//! file's primaries. Source: the technical introduction to OpenEXR, "Luminance/Chroma Images".

use std::fmt;
use std::io::{self, Cursor};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{Chromaticities, SampleType};
use exr::meta::header::Header;
use exr::prelude::{
    Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers, SpecificChannels, Vec2,
    WritableImage,
};
use glam::{DMat3, DVec3};

use crate::atomic::write_atomically;
use crate::error::{Checked, Fault, SceneError, one_line};
use crate::radiance_image::{MAX_SAMPLE_BYTES, RadianceImage, checked_image_size, checked_shape};
use crate::regular_file::read_file;

const DAMAGED: &str = "the file is cut off or damaged: write or copy it again";

/// Layers that hold the whole picture, by the last word of their name.
const WHOLE: [&str; 12] = [
    "beauty",
    "combined",
    "rgb",
    "rgba",
    "color",
    "colour",
    "main",
    "default",
    "image",
    "composite",
    "final",
    "radiance",
];

/// Rec. 709 and D65, as files without the attribute have it.
const REC_709: [[f64; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// What of an EXR file was taken. `Display` is one line: `part 2 of 3 "rgb", channels R, G, B`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExrSource {
    /// The part, from 1.
    pub part: usize,
    /// How many parts the file has.
    pub part_count: usize,
    /// The part's name; empty without one.
    pub part_name: String,
    /// The channels' full names: red, green and blue, or luminance and chroma, or grey.
    pub channels: Vec<String>,
    /// What else there is to say, a few words each: windows that differ, unusual primaries.
    pub remarks: Vec<String>,
}

impl fmt::Display for ExrSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "part {} of {}", self.part, self.part_count)?;
        if !self.part_name.is_empty() {
            write!(f, " \"{}\"", one_line(&self.part_name))?;
        }
        write!(f, ", channels {}", one_line(&self.channels.join(", ")))?;
        self.remarks.iter().try_for_each(|remark| write!(f, ", {remark}"))
    }
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

/// Reads the picture of an EXR file; [`read_exr_with_source`] says which one it is.
pub fn read_exr(path: &Path) -> Result<RadianceImage, SceneError> {
    read_exr_with_source(path).map(|(image, _)| image)
}

/// Reads the picture of an EXR file of half or float samples, and says which of its parts and channels it is.
///
/// An error where no picture stands out among several, for subsampled and for integer channels, for deep data, and for
/// CIE XYZ.
pub fn read_exr_with_source(path: &Path) -> Result<(RadianceImage, ExrSource), SceneError> {
    let bytes = read_file(path)?;
    decode_exr(&bytes).map_err(|fault| fault.in_file(path))
}

/// How three channels become RGB.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Rgb,
    /// Y, RY, BY.
    LuminanceChroma,
    Grey,
}

/// A picture that a file holds.
#[derive(Debug, Clone)]
struct Picture {
    kind: Kind,
    /// Smaller is better.
    rank: u8,
    part: usize,
    /// For messages: `beauty`.
    name: String,
    /// Positions in the part's list of channels: of grey only the first counts.
    channels: [usize; 3],
}

pub(crate) fn decode_exr(bytes: &[u8]) -> Checked<(RadianceImage, ExrSource)> {
    let fault = |error: exr::error::Error| Fault::invalid("EXR", error.to_string(), DAMAGED);
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(fault)?;
    check_headers(&meta.headers, bytes.len())?;
    let picture = chosen(&meta.headers)?;
    let read = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let read = read.all_layers().all_attributes().non_parallel();
    let image = read.from_buffered(Cursor::new(bytes)).map_err(fault)?;
    let header = &meta.headers[picture.part];
    let lost = || Fault::invalid("EXR", "a part of its header is missing from its body", DAMAGED);
    let layer = image.layer_data.get(picture.part).ok_or_else(lost)?;
    let list = &layer.channel_data.list;
    let [first, second, third] = picture.channels.map(|channel| list.get(channel).map(|c| &c.sample_data));
    let (Some(first), Some(second), Some(third)) = (first, second, third) else { return Err(lost()) };
    let size = [layer.size.x() as u64, layer.size.y() as u64];
    let size = checked_image_size("EXR header", size)?;
    let count = size[0] as usize * size[1] as usize;
    if [first, second, third].iter().any(|samples| samples.len() != count) {
        return Err(lost());
    }
    if [first, second, third].iter().any(|samples| matches!(samples, FlatSamples::U32(_))) {
        return Err(Fault::unsupported("EXR", "a channel holds integers", "write half or float samples"));
    }
    let primaries = primaries(header.shared_attributes.chromaticities.as_ref());
    let luminance = luminance_weights(primaries);
    let pixel = |i: usize| {
        let [a, b, c] = [first, second, third].map(|samples| samples.value_by_flat_index(i).to_f32());
        if picture.kind == Kind::LuminanceChroma {
            rgb_from_luminance_chroma([a, b, c], luminance)
        } else {
            [a, b, c]
        }
    };
    let mut source = ExrSource {
        part: picture.part + 1,
        part_count: meta.headers.len(),
        part_name: header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default(),
        channels: picture.channels.iter().map(|&channel| list[channel].name.to_string()).collect(),
        remarks: Vec::new(),
    };
    source.channels.dedup();
    let differs = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) > 1e-3;
    if primaries.iter().zip(&REC_709).any(differs) {
        source
            .remarks
            .push("whose primaries are not those of Rec. 709 (the values are taken as they are)".into());
    }
    let image = windowed(header, size, pixel, &mut source.remarks)?;
    Ok((image, source))
}

/// An error for what is too large, and for what the crate `exr` cannot read rightly.
fn check_headers(headers: &[Header], byte_count: usize) -> Checked<()> {
    let mut sample_bytes = 0u64;
    for header in headers {
        let [width, height] = [header.layer_size.x() as u64, header.layer_size.y() as u64];
        checked_image_size("EXR header", [width, height])?;
        let pixel_bytes = header.channels.list.iter().map(|channel| match channel.sample_type {
            SampleType::F16 => 2,
            SampleType::F32 | SampleType::U32 => 4,
        });
        sample_bytes = sample_bytes.saturating_add((width * height).saturating_mul(pixel_bytes.sum()));
        // Every chunk has 8 bytes in the offset table and at least a coordinate and a length of its own.
        if header.chunk_count.saturating_mul(16) > byte_count {
            return Err(Fault::invalid("EXR header", "it announces more than the file holds", DAMAGED));
        }
        if header.deep {
            let cure = "write the picture as a flat image, in a file of its own";
            return Err(Fault::unsupported("EXR", "it holds deep data", cure));
        }
        if header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
            let is_chroma = header.channels.list.iter().any(|channel| channel.name.eq_case_insensitive("RY"));
            let problem = if is_chroma {
                "it holds luminance and subsampled chroma (channels Y, RY, BY)"
            } else {
                "a channel is subsampled"
            };
            return Err(Fault::unsupported("EXR", problem, "write R, G, B at full resolution"));
        }
    }
    if sample_bytes > MAX_SAMPLE_BYTES {
        let problem = format!("it announces {sample_bytes} bytes of samples");
        return Err(Fault::too_large("EXR header", problem, "write fewer layers and channels"));
    }
    Ok(())
}

/// The picture that stands out.
fn chosen(headers: &[Header]) -> Checked<Picture> {
    let mut pictures: Vec<Picture> =
        headers.iter().enumerate().flat_map(|(part, header)| pictures_of(part, header)).collect();
    // Stable: the file's order among equals.
    pictures.sort_by_key(|picture| (picture.kind, picture.rank));
    let Some(best) = pictures.first() else {
        let is_xyz = headers.iter().any(|header| {
            ["X", "Y", "Z"].iter().all(|n| header.channels.list.iter().any(|c| c.name.eq_case_insensitive(n)))
        });
        let problem = if is_xyz {
            "it holds CIE XYZ (channels X, Y, Z)"
        } else {
            "it has no channels R, G, B and no Y"
        };
        return Err(Fault::unsupported("EXR", problem, "write RGB or Y"));
    };
    let equals: Vec<&str> = pictures
        .iter()
        .filter(|picture| (picture.kind, picture.rank) == (best.kind, best.rank))
        .map(|picture| picture.name.as_str())
        .collect();
    if equals.len() > 1 && best.rank > 1 {
        let problem =
            format!("it holds several pictures ({}), and none is the whole by its name", equals.join(", "));
        return Err(Fault::unsupported(
            "EXR",
            problem,
            "write the one that is meant alone, or name it beauty",
        ));
    }
    Ok(best.clone())
}

/// The pictures of a part: one for each layer that has the channels of one.
fn pictures_of(part: usize, header: &Header) -> Vec<Picture> {
    let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
    let names: Vec<String> = header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
    let split = |name: &str| match name.rsplit_once('.') {
        Some((layer, channel)) => (layer.to_owned(), channel.to_ascii_uppercase()),
        None => (String::new(), name.to_ascii_uppercase()),
    };
    let split: Vec<(String, String)> = names.iter().map(|name| split(name)).collect();
    let mut layers: Vec<&String> = split.iter().map(|(layer, _)| layer).collect();
    layers.sort();
    layers.dedup();
    let picture = |layer: &String| {
        let find = |names: [&str; 2]| {
            split.iter().position(|(of, name)| of == layer && names.contains(&name.as_str()))
        };
        let y = find(["Y", "Y"]);
        let (kind, channels) = match (find(["R", "RED"]), find(["G", "GREEN"]), find(["B", "BLUE"])) {
            (Some(r), Some(g), Some(b)) => (Kind::Rgb, [r, g, b]),
            _ => match (find(["RY", "R-Y"]), y, find(["BY", "B-Y"])) {
                (Some(ry), Some(y), Some(by)) => (Kind::LuminanceChroma, [y, ry, by]),
                // X, Y, Z are CIE's, or a position.
                (_, Some(y), _) if find(["X", "X"]).is_none() => (Kind::Grey, [y; 3]),
                _ => return None,
            },
        };
        let name = match (part_name.is_empty(), layer.is_empty()) {
            (_, true) => part_name.clone(),
            (true, false) => layer.clone(),
            (false, false) => format!("{part_name}.{layer}"),
        };
        let last = name.rsplit(['.', '/', ':']).next().unwrap_or_default().to_ascii_lowercase();
        let rank = match () {
            () if WHOLE.contains(&last.as_str()) => 0,
            () if name.is_empty() => 1,
            () if layer.is_empty() => 2,
            () => 3,
        };
        Some(Picture { kind, rank, part, name, channels })
    };
    layers.into_iter().filter_map(picture).collect()
}

/// The display window's part of the data window's pixels, black where there are none.
fn windowed(
    header: &Header,
    size: [u32; 2],
    pixel: impl Fn(usize) -> [f32; 3],
    remarks: &mut Vec<String>,
) -> Checked<RadianceImage> {
    let display = header.shared_attributes.display_window;
    let shown = [display.size.x() as u64, display.size.y() as u64];
    let shown = checked_image_size("EXR display window", shown)?;
    let data = header.own_attributes.layer_position;
    // Where the data window's corner stands in the picture.
    let offset = [
        i64::from(data.x()) - i64::from(display.position.x()),
        i64::from(data.y()) - i64::from(display.position.y()),
    ];
    if offset == [0, 0] && shown == size {
        let pixels = (0..size[0] as usize * size[1] as usize).map(pixel).collect();
        return Ok(RadianceImage { size, pixels });
    }
    let column_of = |x: u32| u32::try_from(i64::from(x) - offset[0]).ok().filter(|column| *column < size[0]);
    let row_of = |y: u32| u32::try_from(i64::from(y) - offset[1]).ok().filter(|row| *row < size[1]);
    if (0..shown[0]).all(|x| column_of(x).is_none()) || (0..shown[1]).all(|y| row_of(y).is_none()) {
        let problem = "its data window lies outside of its display window";
        return Err(Fault::unsupported("EXR", problem, "write the picture's own pixels"));
    }
    let [w, h] = shown;
    remarks.push(format!(
        "the {w}x{h} pixels of the display window out of a data window of {}x{}",
        size[0], size[1]
    ));
    let is_smaller = column_of(0).is_none()
        || column_of(w - 1).is_none()
        || row_of(0).is_none()
        || row_of(h - 1).is_none();
    if is_smaller {
        remarks.push("black where it has none".into());
    }
    let at = |x: u32, y: u32| match (column_of(x), row_of(y)) {
        (Some(column), Some(row)) => pixel(row as usize * size[0] as usize + column as usize),
        _ => [0.0; 3],
    };
    let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
    Ok(RadianceImage { size: shown, pixels })
}

fn primaries(chromaticities: Option<&Chromaticities>) -> [[f64; 2]; 4] {
    let pair = |v: Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    chromaticities.map_or(REC_709, |c| [pair(c.red), pair(c.green), pair(c.blue), pair(c.white)])
}

/// Luminance of each primary where white has 1; Rec. 709's where the primaries make no sense.
fn luminance_weights(primaries: [[f64; 2]; 4]) -> [f64; 3] {
    let weights = |[red, green, blue, white]: [[f64; 2]; 4]| {
        let xyz = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
        let strengths = DMat3::from_cols(xyz(red), xyz(green), xyz(blue)).inverse() * (xyz(white) / white[1]);
        [strengths.x * red[1], strengths.y * green[1], strengths.z * blue[1]]
    };
    let found = weights(primaries);
    if found.iter().all(|weight| weight.is_finite() && *weight > 0.0) { found } else { weights(REC_709) }
}

/// RY = (R − Y)/Y, BY = (B − Y)/Y, and Y is the weighted sum.
fn rgb_from_luminance_chroma([y, ry, by]: [f32; 3], weights: [f64; 3]) -> [f32; 3] {
    let [y, ry, by] = [y, ry, by].map(f64::from);
    let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
    let g = (y - r * weights[0] - b * weights[2]) / weights[1];
    [r as f32, g as f32, b as f32]
}

#[cfg(test)]
mod tests;
