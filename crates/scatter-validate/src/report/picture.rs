//! Radiance and differences of radiance as 8-bit pictures.

use scatter_scene::RadianceImage;

/// RGB, 8 bits a channel, `[y][x]`.
pub(super) type Pixels = Vec<u8>;

/// What is not a finite number: magenta, which no tone map gives.
const NOT_FINITE: [u8; 3] = [255, 0, 255];

/// The exposure at which an image's mean is a middle grey: `1 − exp(−mean·exposure) = 0.3`.
///
/// Half of an indoor picture can be black, so the mean is taken over what is lit at all.
pub fn exposure(image: &RadianceImage) -> f64 {
    let lit = || image.pixels.iter().flatten().map(|&v| f64::from(v)).filter(|v| v.is_finite() && *v > 0.0);
    let count = lit().count();
    if count == 0 { 1.0 } else { -(1.0f64 - 0.3).ln() * count as f64 / lit().sum::<f64>() }
}

/// `1 − exp(−L·exposure)`, then the sRGB curve.
pub(super) fn tone_mapped(image: &RadianceImage, exposure: f64) -> Pixels {
    image
        .pixels
        .iter()
        .flat_map(|rgb| {
            if rgb.iter().all(|v| v.is_finite()) {
                rgb.map(|v| srgb(1.0 - (-f64::from(v).max(0.0) * exposure).exp()))
            } else {
                NOT_FINITE
            }
        })
        .collect()
}

/// `(test − reference)/scale`, its channels' mean, on a signed scale: white is no difference, red too bright, blue
/// too dark; ±1 and beyond is the full colour.
pub(super) fn signed_difference(reference: &RadianceImage, test: &RadianceImage, scale: f64) -> Pixels {
    reference
        .pixels
        .iter()
        .zip(&test.pixels)
        .flat_map(|(r, t)| {
            let difference: f64 = (0..3).map(|c| f64::from(t[c]) - f64::from(r[c])).sum::<f64>() / 3.0;
            if difference.is_finite() {
                signed_colour(if scale > 0.0 { difference / scale } else { 0.0 })
            } else {
                NOT_FINITE
            }
        })
        .collect()
}

/// The colour of a signed value in [−1, 1]. The square root spreads small differences.
pub(super) fn signed_colour(value: f64) -> [u8; 3] {
    let size = value.abs().min(1.0).sqrt();
    let full = if value > 0.0 { [178.0, 24.0, 43.0] } else { [33.0, 102.0, 172.0] };
    full.map(|channel| (255.0 + (channel - 255.0) * size).round() as u8)
}

/// IEC 61966-2-1, rounded to 8 bits.
fn srgb(linear: f64) -> u8 {
    let curve = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * curve.clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: Vec<[f32; 3]>) -> RadianceImage {
        RadianceImage { size: [pixels.len() as u32, 1], pixels }
    }

    #[test]
    fn too_bright_is_red_too_dark_is_blue_equal_is_white_and_nan_is_magenta() {
        let reference = image(vec![[1.0; 3]; 4]);
        let test = image(vec![[2.0; 3], [0.0; 3], [1.0; 3], [1.0, f32::NAN, 1.0]]);
        let pixels = signed_difference(&reference, &test, 1.0);
        assert_eq!(pixels, [178, 24, 43, 33, 102, 172, 255, 255, 255, 255, 0, 255]);
    }

    #[test]
    fn the_mean_of_what_is_lit_becomes_thirty_percent_of_white() {
        let picture = image(vec![[0.0; 3], [5.0; 3], [5.0; 3]]);
        let pixels = tone_mapped(&picture, exposure(&picture));
        // sRGB of 0.3: 1.055·0.3^(1/2.4) − 0.055 = 0.5838, times 255.
        assert_eq!(pixels, [0, 0, 0, 149, 149, 149, 149, 149, 149]);
    }
}
