//! How far each technique's result moves where mathematics says that it does not.

use scatter::Technique;

/// Shares of a pixel's unoccluded value (a spot's: without its cone).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Settings without choices that rounding could tip over: no measured spacing, no refinement by a threshold.
    pub overrides: &'static [(&'static str, &'static str)],
    /// Largest change where the strength, the scattering at fixed extinction, or the unit of length is scaled.
    pub scaled: f64,
    /// Largest change where scene, camera and light are moved together or mirrored.
    pub moved: f64,
    /// Largest difference between the image of two lights in one place and the sum of their images, at any options.
    pub added: f64,
    /// Largest excess over the closed form where nothing shadows.
    pub lit: f64,
    /// Why the numbers are what they are.
    pub derivation: &'static str,
}

impl Rounding {
    /// Of an exact technique in f64 that writes f32 pixels.
    pub const F64: Self = Self {
        overrides: &[],
        scaled: 2e-6,
        moved: 2e-6,
        added: 2e-6,
        lit: 2e-6,
        derivation: "f64 throughout; pixels are written and depths are read in f32: 2⁻²³ of a pixel, and 2⁻²⁴ of a \
                     ray's length, which at most doubles that. Ten times as much is allowed",
    };

    /// Of a technique.
    pub fn of(technique: &dyn Technique) -> Self {
        match technique.info().id {
            "raymarch" => Self {
                overrides: &[("steps", "4096")],
                scaled: 1e-4,
                moved: 2.0 / 4096.0,
                added: 1e-4,
                lit: 1e-3,
                derivation: "",
            },
            _ => Self {
                overrides: &[("spacing", "0.25"), ("halvings", "0"), ("rank", "8")],
                scaled: 1e-4,
                moved: 1e-4,
                added: 1e-6,
                lit: 4e-5,
                derivation: "",
            },
        }
    }
}
