//! The coloured windows of `nave`: a picture as the sun sees it, laid over the lancets of the south wall.
//!
//! For each texel the light ray through it is followed to the glass, the plane in the middle of the wall; what
//! stands there is painted: medallions on a coloured ground, with a pale border.

use glam::DVec3;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Columns and rows of the picture: texels of 62 mm.
const SIZE: [u32; 2] = [480, 144];

/// Where the shot file puts the picture: its centre, and half its extents \[m\]. The glass is the plane through
/// the centre across z.
const CENTRE: DVec3 = DVec3::new(0.0, 5.0, 6.3);
const HALF_EXTENTS: [f64; 2] = [15.0, 4.5];

/// Windows: two lancets a bay on either side of a mullion \[m\].
pub(super) const LANCET: f64 = 0.65;
pub(super) const MULLION: f64 = 0.3;
/// Distance of a lancet's middle from the bay's.
const LANCET_MIDDLE: f64 = (MULLION + LANCET) / 2.0;

/// The way the light travels in the shot file.
const DIR_FROM_SUN: DVec3 = DVec3::new(-0.2, -0.58, -0.78);

/// sRGB colours.
const PALE: [u8; 3] = [244, 232, 196];
const GOLD: [u8; 3] = [250, 196, 60];
const BLUE: [u8; 3] = [48, 92, 245];
const RUBY: [u8; 3] = [236, 40, 52];
const GREEN: [u8; 3] = [60, 200, 96];
const VIOLET: [u8; 3] = [168, 70, 226];

/// The picture as a PNG file: rows from the top, up being +y as far as the light's direction allows.
pub(super) fn png_bytes() -> Vec<u8> {
    let mut bytes = Vec::new();
    // A picture of this size in memory can always be encoded: a failure would be a fault in these lines.
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::NoFilter)
        .write_image(&texels(), SIZE[0], SIZE[1], ExtendedColorType::Rgb8)
        .expect("a picture in memory can be encoded");
    bytes
}

/// The picture's sRGB bytes, `[row][column]`, row 0 on top.
fn texels() -> Vec<u8> {
    let forward = DIR_FROM_SUN.normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let step = |axis: usize| 2.0 * HALF_EXTENTS[axis] / f64::from(SIZE[axis]);
    let mut texels = Vec::with_capacity(3 * (SIZE[0] * SIZE[1]) as usize);
    for row in 0..SIZE[1] {
        for column in 0..SIZE[0] {
            let u = (f64::from(column) + 0.5) * step(0) - HALF_EXTENTS[0];
            let v = HALF_EXTENTS[1] - (f64::from(row) + 0.5) * step(1);
            let on_map = CENTRE + u * right + v * up;
            let on_glass = on_map + forward * ((CENTRE.z - on_map.z) / forward.z);
            texels.extend(glass(on_glass.x, on_glass.y));
        }
    }
    texels
}

/// Colour of the glass at this place of the south wall: one design for each half bay of two metres.
fn glass(x: f64, y: f64) -> [u8; 3] {
    let half_bay = (x / 2.0).floor();
    // Distance from the lancet's own middle, which is closer to the bay's middle than to its border.
    let is_left = half_bay.rem_euclid(2.0) == 0.0;
    let middle = if is_left { 2.0 - LANCET_MIDDLE } else { LANCET_MIDDLE };
    let from_middle = x - 2.0 * half_bay - middle;

    let number = half_bay as i64 + 64;
    let ground = [BLUE, RUBY, GREEN, BLUE, VIOLET][number.rem_euclid(5) as usize];
    let medallion_height = 0.8;
    let medallion = ((y - 2.2) / medallion_height).floor();
    let from_centre_y = y - 2.2 - (medallion + 0.5) * medallion_height;
    let radius_sq = from_middle * from_middle + from_centre_y * from_centre_y;
    if from_middle.abs() > 0.27 {
        PALE
    } else if radius_sq < 0.15 * 0.15 {
        [RUBY, GOLD, BLUE, GREEN][(medallion as i64 + number).rem_euclid(4) as usize]
    } else if radius_sq < 0.24 * 0.24 {
        GOLD
    } else {
        ground
    }
}

#[cfg(test)]
mod tests {
    use super::super::BuiltinShot;
    use super::*;
    use scatter_core::{LightTexture, MapProjection};

    #[test]
    fn the_shot_file_puts_the_picture_where_it_was_painted() {
        let files = BuiltinShot::find("nave").unwrap().files();
        let table: toml::Table = String::from_utf8(files.shot.bytes).unwrap().parse().unwrap();
        let numbers = |table: &toml::Value, key: &str| -> Vec<f64> {
            table[key].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
        };
        assert_eq!(numbers(&table["light"], "direction"), DIR_FROM_SUN.to_array());
        let texture = &table["light"]["texture"];
        assert_eq!(numbers(texture, "center"), CENTRE.to_array());
        assert_eq!(numbers(texture, "half_extents"), HALF_EXTENTS);
        assert_eq!(numbers(texture, "up"), [0.0, 1.0, 0.0]);
        assert_eq!(texture["image"].as_str(), Some(files.others[0].name.as_str()));
    }

    #[test]
    fn light_through_a_pane_carries_its_colour_into_the_hall() {
        // Read back and placed by the core: four metres further down the light, well within a pane.
        let picture = image::load_from_memory(&png_bytes()).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (SIZE[0], SIZE[1]));
        let texels: Vec<[f32; 3]> = picture.pixels().map(|pixel| pixel.0.map(f32::from)).collect();
        let projection = MapProjection::orthographic(
            CENTRE.to_array(),
            DIR_FROM_SUN.to_array(),
            [0.0, 1.0, 0.0],
            HALF_EXTENTS,
            SIZE,
        )
        .unwrap();
        let texture = LightTexture::new(projection, &texels).unwrap();
        for bay in 0..8 {
            for middle in [-LANCET_MIDDLE, LANCET_MIDDLE] {
                for medallion in 0..6 {
                    let x = -14.0 + 4.0 * f64::from(bay) + middle;
                    let y = 2.2 + 0.8 * (f64::from(medallion) + 0.5);
                    let found = texture.lookup(DVec3::new(x, y, CENTRE.z) + 4.0 * DIR_FROM_SUN);
                    let panes = [RUBY, GOLD, BLUE, GREEN].map(|colour| colour.map(f32::from));
                    assert!(panes.contains(&found), "({x}, {y}): {found:?}");
                }
            }
        }
    }

    #[test]
    fn neighbours_have_different_panes() {
        let lancets: Vec<Vec<[u8; 3]>> = (0..4)
            .map(|half_bay| {
                let x = 2.0 * f64::from(half_bay) + if half_bay % 2 == 0 { 1.5 } else { 0.5 };
                (0..60).map(|i| glass(x, 2.2 + 0.08 * f64::from(i))).collect()
            })
            .collect();
        for pair in lancets.windows(2) {
            assert_ne!(pair[0], pair[1]);
        }
        let mut colours = lancets.concat();
        colours.sort_unstable();
        colours.dedup();
        assert!(colours.len() >= 5, "{colours:?}");
    }
}
