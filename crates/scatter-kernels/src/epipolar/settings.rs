//! How finely `epipolar` works on a GPU: the distance of slices and the error of the factors.

use scatter_core::Quality;

use crate::plan::MOST_BINDING_BYTES;

/// Settings of a view that renders by `epipolar`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpipolarSettings {
    /// Distance of slices \[camera pixels\], 1/256 to 16. They are even: nothing is refined.
    pub spacing: f64,
    /// Share of the spacing that is left with the light in the middle of the picture, 1/16 to 1; it grows to 1 where the light is
    /// 1.25 pictures beside the middle. Leaves before a sun are lit along their view rays.
    pub towards_light: f64,
    /// Slices a radian of the image's middle, at least: what lies between two slices is a part of the view.
    pub fewest_slices: f64,
    /// Largest error of the factorised integrand, of a pixel's unoccluded radiance, in (0, 1).
    pub factor_error: f64,
    /// Rows of slices that are integrated at a time \[bytes\], up to 128 MiB; at least two slices' are. Less memory, more passes.
    pub batch_bytes: u64,
}

/// Rows of one batch \[bytes\] by default: half of what WebGPU guarantees.
const BATCH_BYTES: u64 = 64 << 20;

/// Image diagonal \[pixels\] at which a level's spacing is stated: 1280×960, as of the CPU's presets.
const TUNED_DIAGONAL: f64 = 1600.0;

/// Image diagonal \[pixels\] below which slices are twice as close.
const LEAST_LARGE_DIAGONAL: f64 = 400.0;

/// Finest spacing \[pixels\]. A finer one would ask for more slices than pixels are worth.
pub(super) const FINEST_SPACING: f64 = 1.0 / 256.0;

/// Least share of it towards the light.
pub(super) const LEAST_TOWARDS_LIGHT: f64 = 1.0 / 16.0;

/// That share of the presets: with 1 `sunset` is at p99 7.4 % at `game`, which asks for 3 (3.7 and 3.1 with the camera turned by
/// 40 and 55 degrees, 2.8 by 75).
const TOWARDS_LIGHT: f64 = 0.45;

/// Coarsest spacing \[pixels\].
pub(super) const COARSEST_SPACING: f64 = 16.0;

impl Default for EpipolarSettings {
    fn default() -> Self {
        Self::for_quality(Quality::default(), [1280, 960])
    }
}

impl EpipolarSettings {
    /// The preset of a level for images of a size. A scene's shadows are as fine as the image as a whole, so slices of smaller
    /// images are closer together in pixels. Chosen on the built-in shots at 160×120 (README): even slices take what their finest
    /// shadows take, everywhere.
    pub fn for_quality(level: Quality, size: [u32; 2]) -> Self {
        let (spacing, factor_error) = match level {
            Quality::Preview => (1.25, 2e-2),
            Quality::Game => (0.5, 6e-3),
            Quality::Film => (0.25, 2e-3),
        };
        let diagonal = f64::from(size[0]).hypot(f64::from(size[1]));
        // In a small picture few pixels are a hundredth of it.
        let spacing = if diagonal < LEAST_LARGE_DIAGONAL { 0.5 * spacing } else { spacing };
        let scale = (diagonal / TUNED_DIAGONAL).min(1.0);
        let spacing = (spacing * scale).clamp(FINEST_SPACING, COARSEST_SPACING);
        let towards_light = TOWARDS_LIGHT;
        Self { spacing, towards_light, fewest_slices: 400.0, factor_error, batch_bytes: BATCH_BYTES }
    }

    /// What is out of range of them, in a sentence.
    pub fn check(&self) -> Result<(), String> {
        let Self { spacing, towards_light, fewest_slices, factor_error, batch_bytes } = *self;
        if !(FINEST_SPACING..=COARSEST_SPACING).contains(&spacing) {
            return Err(format!("a spacing of {spacing} pixels; give 1/256 to 16"));
        }
        if !(LEAST_TOWARDS_LIGHT..=1.0).contains(&towards_light) {
            return Err(format!("{towards_light} of the spacing towards the light; give 1/16 to 1"));
        }
        if !(fewest_slices > 0.0 && fewest_slices <= 1e6) {
            return Err(format!("at least {fewest_slices} slices a radian; give more than 0, at most 1e6"));
        }
        if !(factor_error > 0.0 && factor_error < 1.0) {
            return Err(format!("a factor error of {factor_error}; give a number between 0 and 1"));
        }
        if batch_bytes > MOST_BINDING_BYTES {
            return Err(format!("batches of {batch_bytes} bytes; give at most {MOST_BINDING_BYTES}"));
        }
        Ok(())
    }
}
