//! Options of the technique: which curve, how large its maps are, and what lies in them.

use scatter_core::Quality;

pub use crate::curve::Between;
pub use crate::curves::avsm::Removal;

/// The technique's id.
pub const ID: &str = "avsm";

/// Largest side of a curve map \[texels\]: 16 nodes of it are 537 MB a layer.
pub const MOST_CURVES: u32 = scatter_core::MemoryBound::LARGEST_CURVES as u32;

/// Options of [`Avsm`](crate::Avsm). On a frame without translucent occluders only [`Self::opaque`] matters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The transmittance curve of a texel.
    pub curve: Curve,
    /// Nodes of an adaptive curve.
    pub nodes: Nodes,
    /// By which rule an adaptive curve loses nodes.
    pub removal: Removal,
    /// How adaptive curves run between their nodes.
    pub between: Between,
    /// Moments of a curve of moments.
    pub moments: Moments,
    /// Largest error of a deep shadow map's transmittance, 1e-6 to 1.
    pub threshold: f32,
    /// Texels along the longer side of a curve map, 1 to [`MOST_CURVES`]; of cube faces and cascades each. Captured layers have
    /// their own size.
    pub curves: u32,
    /// Whose texels those of a source's curve maps are.
    pub texels: Texels,
    /// Where opaque surfaces are.
    pub opaque: Opaque,
}

/// A transmittance curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Curve {
    /// Adaptive, of a fixed number of nodes (Salvi et al. 2010).
    #[default]
    Avsm,
    /// A deep shadow map: as many nodes as keep a threshold (Lokovic and Veach 2000).
    Deep,
    /// An opacity shadow map of 32 slices (Kim and Neumann 2001).
    Opacity,
    /// A Fourier opacity map of 16 pairs of terms (Jansen and Bavoil 2010).
    Fourier,
    /// Power moments (Münstermann et al. 2018).
    Moments,
    /// All nodes: the truth of the captured segments.
    Uncompressed,
}

/// Nodes of an adaptive curve, 8 bytes each a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Nodes {
    /// 2 MB at 256².
    Four,
    /// 4 MB at 256².
    #[default]
    Eight,
    /// 6 MB at 256².
    Twelve,
    /// 8 MB at 256².
    Sixteen,
}

/// Power moments of a texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Moments {
    /// Four.
    Four,
    /// Six.
    #[default]
    Six,
    /// Eight.
    Eight,
}

/// Whose texels the curve maps of a source's occluders have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Texels {
    /// Their own: a map around the occluders under a sun, the shadow map's cone or faces around lamps.
    Own,
    /// The shadow map's, those that the occluders cover, where these are no more than twice [`Options::curves`] along the longer
    /// side; else their own. Hair that is thinner than a texel is then hit and missed as shadow-map truth hits and misses
    /// it.
    #[default]
    ShadowMap,
}

/// Where opaque surfaces are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Opaque {
    /// In the frame's shadow map, at its own resolution.
    #[default]
    Map,
    /// In the curves: the shadow map's depth on the light ray through each texel's centre.
    Curve,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            curve: Curve::Avsm,
            nodes: Nodes::Eight,
            removal: Removal::Exponential,
            between: Between::Exponential,
            moments: Moments::Six,
            threshold: 0.002,
            curves: 256,
            texels: Texels::ShadowMap,
            opaque: Opaque::Map,
        }
    }
}

impl Options {
    /// What a level chooses: the shadow map's texels where they are few enough; for film 16 nodes, and 512 texels a side where
    /// the curve maps have texels of their own.
    ///
    /// What bounds the error on hair is neither nodes nor their rule but the light rays between texel centres, which hit or
    /// miss it: a map of its own is one more sample of that, however many nodes it has (README, "What it finds").
    pub fn for_quality(level: Quality) -> Self {
        match level {
            Quality::Film => Self { nodes: Nodes::Sixteen, curves: 512, ..Self::default() },
            _ => Self::default(),
        }
    }
}
