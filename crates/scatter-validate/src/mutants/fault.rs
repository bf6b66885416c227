//! The faults, and the rung that must reject each.

/// What is wrong with a mutant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// g has the other sign: forward and backward scattering are swapped.
    GSignFlipped,
    /// A surface that is near reads as far, none as near.
    NearAndFarSwapped,
    /// Each shadow row is read one texel further along.
    MapReadOneTexelFurther,
    /// One column of the image is its neighbour's.
    OneColumnShifted,
    /// One pixel is 1 % too bright.
    OnePixelBrighter,
    /// Pixels are written column by column.
    WidthAndHeightSwapped,
    /// The image is upside down.
    RowZeroAtTheBottom,
    /// Rays end a sixty-fourth too early.
    LastStepDropped,
    /// The light's matrix is off by half a texel.
    MapShiftedByHalfATexel,
    /// Depth along the view direction is taken for the distance along the ray.
    DepthReadAsZ,
    /// The eye is off by a hundredth of a unit.
    EyeMoved,
    /// What absorbs scatters, and the other way round.
    ScatteringAndAbsorptionSwapped,
    /// The phase function integrates to 4π.
    PhaseNotNormalised,
    /// Radiance leaves encoded for a display.
    SrgbInsteadOfLinear,
    /// One channel serves all three.
    ChannelsCollapsed,
    /// Rays that hit nothing go on behind `max_distance`.
    MaxDistanceIgnored,
    /// The last cascade that contains a point decides.
    CascadesReversed,
    /// The coloured glass is not looked at.
    TextureIgnored,
    /// Height fog grows upwards.
    FogUpsideDown,
    /// Height fog has its base at height 0.
    FogBaseIgnored,
    /// One value is NaN.
    NanInOnePixel,
    /// One bit differs where there is more than one thread.
    OneBitByThreads,
    /// Every frame allocates.
    AllocatesEveryFrame,
    /// The first frame's answer is kept for all frames of its size.
    CachesTheFirstFrame,
    /// What is not supported is begun all the same.
    HalfRendersUnsupported,
}

const MAPS: &str = "shadow maps";
const HOUSE: &str = "house rules";

impl Fault {
    /// All of them.
    pub const ALL: [Self; 25] = [
        Self::GSignFlipped,
        Self::NearAndFarSwapped,
        Self::MapReadOneTexelFurther,
        Self::OneColumnShifted,
        Self::OnePixelBrighter,
        Self::WidthAndHeightSwapped,
        Self::RowZeroAtTheBottom,
        Self::LastStepDropped,
        Self::MapShiftedByHalfATexel,
        Self::DepthReadAsZ,
        Self::EyeMoved,
        Self::ScatteringAndAbsorptionSwapped,
        Self::PhaseNotNormalised,
        Self::SrgbInsteadOfLinear,
        Self::ChannelsCollapsed,
        Self::MaxDistanceIgnored,
        Self::CascadesReversed,
        Self::TextureIgnored,
        Self::FogUpsideDown,
        Self::FogBaseIgnored,
        Self::NanInOnePixel,
        Self::OneBitByThreads,
        Self::AllocatesEveryFrame,
        Self::CachesTheFirstFrame,
        Self::HalfRendersUnsupported,
    ];

    /// A few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::GSignFlipped => "g's sign flipped",
            Self::NearAndFarSwapped => "near and far (min and max) swapped",
            Self::MapReadOneTexelFurther => "shadow rows off by one texel",
            Self::OneColumnShifted => "one image column shifted",
            Self::OnePixelBrighter => "one pixel 1 % too bright",
            Self::WidthAndHeightSwapped => "width and height swapped",
            Self::RowZeroAtTheBottom => "row 0 at the bottom",
            Self::LastStepDropped => "last 64th of the ray dropped",
            Self::MapShiftedByHalfATexel => "light matrix off by half a texel",
            Self::DepthReadAsZ => "depth read as z, not along the ray",
            Self::EyeMoved => "eye moved by 1e-2",
            Self::ScatteringAndAbsorptionSwapped => "scattering and absorption swapped",
            Self::PhaseNotNormalised => "phase function not normalised",
            Self::SrgbInsteadOfLinear => "sRGB instead of linear",
            Self::ChannelsCollapsed => "one channel for all three",
            Self::MaxDistanceIgnored => "max_distance ignored",
            Self::CascadesReversed => "last cascade first",
            Self::TextureIgnored => "coloured glass ignored",
            Self::FogUpsideDown => "height fog upside down",
            Self::FogBaseIgnored => "height fog's base at height 0",
            Self::NanInOnePixel => "NaN in one pixel",
            Self::OneBitByThreads => "one bit by the number of threads",
            Self::AllocatesEveryFrame => "allocates in every frame",
            Self::CachesTheFirstFrame => "answers with the first frame",
            Self::HalfRendersUnsupported => "half-renders what it cannot do",
        }
    }

    /// Whether it shows as a frame that is wrong in one thing.
    pub fn is_of_input(self) -> bool {
        matches!(
            self,
            Self::GSignFlipped
                | Self::NearAndFarSwapped
                | Self::MapReadOneTexelFurther
                | Self::LastStepDropped
                | Self::MapShiftedByHalfATexel
                | Self::DepthReadAsZ
                | Self::EyeMoved
                | Self::ScatteringAndAbsorptionSwapped
                | Self::MaxDistanceIgnored
                | Self::CascadesReversed
                | Self::TextureIgnored
                | Self::FogUpsideDown
                | Self::FogBaseIgnored
        )
    }

    /// Group and name of the row that must reject it.
    ///
    /// Rows without a shadow are exact for everybody, so that a small fault shows; faults of look-ups need maps whose
    /// neighbouring texels differ.
    pub fn rung(self) -> (&'static str, &'static str) {
        match self {
            Self::GSignFlipped => ("phase functions", "g = 0.5, sun"),
            Self::NearAndFarSwapped => (MAPS, "63x63 texels, sun"),
            Self::MapReadOneTexelFurther => (MAPS, "checkerboard of 0 and ∞, sun"),
            Self::OneColumnShifted => ("ray length D", "0, 1e-6, 1, 1e6 and ∞ side by side, sun"),
            Self::OnePixelBrighter => (MAPS, "all far: no surface, sun"),
            Self::WidthAndHeightSwapped | Self::RowZeroAtTheBottom => ("camera", "off-centre, sun"),
            Self::LastStepDropped => ("sun, known integrals", "σ = 0.1, s = 20"),
            Self::MapShiftedByHalfATexel => (MAPS, "every other column dark, sun"),
            Self::DepthReadAsZ => (MAPS, "all far: no surface, point"),
            Self::EyeMoved => ("the eye", "1.5e-3 units from a lamp"),
            Self::ScatteringAndAbsorptionSwapped => ("phase functions", "g = 0, sun"),
            Self::PhaseNotNormalised => ("sun, known integrals", "σ = 0.1, s = ∞"),
            Self::SrgbInsteadOfLinear => ("sun, known integrals", "σ = 1e3, s = 1e6"),
            Self::ChannelsCollapsed => ("phase functions", "RGB air: Rayleigh + g = 0.76, sun"),
            Self::MaxDistanceIgnored => (MAPS, "all far: no surface, sun"),
            Self::CascadesReversed => (MAPS, "three cascades"),
            Self::TextureIgnored => (MAPS, "coloured glass, sun"),
            Self::FogUpsideDown | Self::FogBaseIgnored => ("height fog", "tilted up, sun"),
            Self::NanInOnePixel => (HOUSE, "no NaN, no infinity, nothing negative"),
            Self::OneBitByThreads => (HOUSE, "same bits for 1, 2 and 3 threads"),
            Self::AllocatesEveryFrame => (HOUSE, "second frame allocates nothing"),
            Self::CachesTheFirstFrame => (HOUSE, "no frame leaves a trace in the next"),
            Self::HalfRendersUnsupported => (HOUSE, "unsupported is said before any work"),
        }
    }
}
