//! The techniques that a view renders by.

use scatter_kernels::epipolar::EpipolarSettings;

/// Which technique a view renders by.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Technique {
    /// Brute force: one look-up a step.
    RayMarch {
        /// Steps a ray, 1 to 65,536.
        steps: u32,
        /// Seed of a jittered march; `None` samples the middle of each step.
        jitter: Option<u32>,
        /// Steps of equal length near lamps, too, instead of equal angles.
        uniform: bool,
    },
    /// Exact shadows by min/max trees of the maps: no step, no error but rounding. No lamps in height fog.
    MinmaxMipmap,
    /// Epipolar slices, even ones: suns without glass, seen by perspective cameras.
    Epipolar(EpipolarSettings),
}
