//! EXR files that we write, and files as other renderers write them, made by the crate `exr`.

use exr::prelude::*;

use super::{ExrSource, read_exr, read_exr_with_source, write_exr};
use crate::{RadianceImage, SceneError, read_linear_rgb};

fn gradient() -> RadianceImage {
    let size = [5u32, 3];
    let pixel = |i: u32| [i as f32 * 0.1, 1e-30 * i as f32, 1e30];
    RadianceImage { size, pixels: (0..15).map(pixel).collect() }
}

fn message<T>(result: std::result::Result<T, SceneError>) -> String {
    result.err().expect("an error").to_string()
}

/// A part of 4 × 3 pixels, at that corner, whose channel c has c + 10·x + 100·y where (x, y) are the file's.
fn part(name: Option<&str>, corner: [i32; 2], channels: &[&str]) -> Layer<AnyChannels<FlatSamples>> {
    let channel = |(c, name): (usize, &&str)| {
        let value =
            |i: i32| c as f32 + 10.0 * (corner[0] + i % 4) as f32 + 100.0 * (corner[1] + i / 4) as f32;
        AnyChannel::new(*name, FlatSamples::F32((0..12).map(value).collect()))
    };
    let channels = AnyChannels::sort(channels.iter().enumerate().map(channel).collect());
    let mut attributes = LayerAttributes::default().with_position(Vec2(corner[0], corner[1]));
    attributes.layer_name = name.map(Text::from);
    Layer::new((4, 3), attributes, Encoding::SMALL_LOSSLESS, channels)
}

/// Writes parts into one file with that display window and reads the picture of it.
fn read(
    window: [i32; 4],
    parts: Vec<Layer<AnyChannels<FlatSamples>>>,
) -> std::result::Result<(RadianceImage, ExrSource), SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("foreign.exr");
    let [x, y, w, h] = window;
    let attributes = ImageAttributes::new(IntegerBounds::new((x, y), (w as usize, h as usize)));
    let image = Image::from_layers(attributes, parts);
    image.write().non_parallel().to_file(&path).unwrap();
    read_exr_with_source(&path)
}

const WHOLE: [i32; 4] = [0, 0, 4, 3];

#[test]
fn of_several_parts_and_layers_the_whole_picture_is_taken_and_named() {
    let rgb = ["R", "G", "B"];
    let at = [0, 0];
    // Channels are numbered as they are listed: the first has 0 at the corner.
    for (parts, first, text) in [
        (
            vec![part(Some("matte"), at, &["Y"]), part(Some("rgb"), at, &rgb)],
            0.0,
            "part 2 of 2 \"rgb\", channels R, G, B",
        ),
        (
            vec![part(Some("diffuse"), at, &rgb), part(Some("beauty"), at, &rgb)],
            0.0,
            "part 2 of 2 \"beauty\", channels R, G, B",
        ),
        (
            vec![part(None, at, &["diffuse.R", "diffuse.G", "diffuse.B", "R", "G", "B", "A", "Z"])],
            3.0,
            "part 1 of 1, channels R, G, B",
        ),
        (
            vec![part(
                None,
                at,
                &[
                    "L.DiffCol.R",
                    "L.DiffCol.G",
                    "L.DiffCol.B",
                    "L.Combined.R",
                    "L.Combined.G",
                    "L.Combined.B",
                ],
            )],
            3.0,
            "part 1 of 1, channels L.Combined.R, L.Combined.G, L.Combined.B",
        ),
        (vec![part(None, at, &["y", "a"])], 0.0, "part 1 of 1, channels y"),
        (vec![part(None, at, &["r", "g", "b"])], 0.0, "part 1 of 1, channels r, g, b"),
    ] {
        let (image, source) = read(WHOLE, parts).unwrap();
        assert_eq!((image.size, image.pixels[0][0], source.to_string().as_str()), ([4, 3], first, text));
        let grey = source.channels.len() == 1;
        assert_eq!(
            image.pixels[5],
            [
                110.0 + first,
                if grey { 110.0 } else { 111.0 + first },
                if grey { 110.0 } else { 112.0 + first }
            ]
        );
    }
    let two = vec![part(Some("diffuse"), at, &rgb), part(Some("specular"), at, &rgb)];
    let refused = message(read(WHOLE, two));
    assert!(
        refused.contains("several pictures (diffuse, specular)") && refused.contains("name it beauty"),
        "{refused}"
    );
    let xyz = message(read(WHOLE, vec![part(None, at, &["X", "Y", "Z"])]));
    assert!(xyz.contains("CIE XYZ"), "{xyz}");
}

#[test]
fn the_picture_is_that_of_the_display_window() {
    let rgb = ["R", "G", "B"];
    // Overscan: the data window begins one column and one row before the picture of 2 × 1 pixels.
    let (image, source) = read([0, 0, 2, 1], vec![part(None, [-1, -1], &rgb)]).unwrap();
    assert_eq!((image.size, image.pixels), ([2, 1], vec![[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]));
    assert!(
        source.to_string().ends_with("the 2x1 pixels of the display window out of a data window of 4x3"),
        "{source}"
    );
    // A crop: the picture is black around it; the display window need not begin at zero.
    let (image, source) = read([10, 20, 6, 5], vec![part(None, [11, 21], &rgb)]).unwrap();
    assert_eq!(image.size, [6, 5]);
    assert_eq!(
        (image.pixels[0], image.pixels[6 + 1], image.pixels[6 + 5]),
        ([0.0; 3], [2210.0, 2211.0, 2212.0], [0.0; 3])
    );
    assert!(source.to_string().ends_with("black where it has none"), "{source}");
    let outside = message(read([0, 0, 4, 3], vec![part(None, [90, 0], &rgb)]));
    assert!(outside.contains("outside of its display window"), "{outside}");
}

#[test]
fn luminance_and_chroma_become_rgb() {
    let rgb = [0.25f32, 0.5, 1.0];
    // Rec. 709: Y = 0.2126 R + 0.7152 G + 0.0722 B, to four digits.
    let y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    let channel = |name: &str, value: f32| AnyChannel::new(name, FlatSamples::F32(vec![value; 12]));
    let list = [channel("Y", y), channel("RY", (rgb[0] - y) / y), channel("BY", (rgb[2] - y) / y)];
    let channels = AnyChannels::sort(list.into_iter().collect());
    let layer = Layer::new((4, 3), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    let (image, source) = read(WHOLE, vec![layer]).unwrap();
    for (found, wanted) in image.pixels[7].into_iter().zip(rgb) {
        assert!((found - wanted).abs() < 1e-4, "{:?}", image.pixels[7]);
    }
    assert_eq!(source.to_string(), "part 1 of 1, channels Y, RY, BY");
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
