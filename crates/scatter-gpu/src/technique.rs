//! The techniques that a view renders by.

/// Which technique a view renders by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
}
