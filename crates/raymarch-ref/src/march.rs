//! The ray marcher: the opponent that every technique races, as fast as it can be made on a CPU.
//!
//! Every ray is cut into steps; visibility is looked up once a step, and each step's integral is taken in closed
//! form (never `f·Δt`). Packets of 4×4 pixels march side by side in the lanes of the widest registers that the CPU
//! has (chosen when the marcher is made; `SCATTER_SIMD=baseline` forces the portable path), tile by tile on the
//! caller's rayon pool. What a frame does not have (shadow, colour, extinction, anisotropy, cone) costs nothing.
//!
//! Rays end where what is left of the transmittance is below f32's rounding ([`NEGLIGIBLE_OPTICAL_DEPTH`]), so that
//! steps are not spent in the dark and endless rays can be marched.

mod angle_span;
mod cascade_maps;
mod estimate;
mod fog_lamp_lanes;
mod fog_sun_packet;
mod fog_window;
mod lamp_packet;
mod lanes;
mod lookups;
mod options;
mod packet;
mod plan;
mod sun_packet;
mod sun_paths;
mod tool;

use scatter_core::{
    Capabilities, Frame, Level, Limits, OptionError, RenderError, RenderStats, ScatterImage, SceneFacts,
    ShadowMap, StageClock, VolumetricShadow, at_level, parallel, simd_level,
};

use lamp_packet::PhaseTerm;
use lookups::MapLanes;
pub use options::{Distribution, MOST_STEPS, Options};
use packet::{PACKET_SIDE, TILE_SIDE};
use plan::Plan;
pub use tool::{RayMarchTechnique, TECHNIQUE};

/// The id of [`RayMarch`].
pub const MARCH_ID: &str = "raymarch";

/// Where a ray ends for the marcher: e⁻¹⁷ = 4e-8 of the light is left, half an ulp of f32. Smaller values lose
/// light, larger ones spend steps on what no f32 sum can hold.
pub(crate) const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// All of the model. Texel indices are u32, over the six faces of a cube together.
pub(crate) const CAPABILITIES: Capabilities = Capabilities {
    limits: Limits { layer_texels: u32::MAX as u64 / 6, ..crate::EVERYTHING.limits },
    ..crate::EVERYTHING
};

/// The marcher. Every light, medium, map and camera of the model.
#[derive(Debug, Clone)]
pub struct RayMarch {
    options: Options,
    simd: Level,
    /// Rays of a packet in each cascade or face, one set a band.
    layer_lanes: Vec<MapLanes>,
    terms: Vec<PhaseTerm>,
}

impl RayMarch {
    /// A marcher for the CPU that it runs on, or for any one if the environment says `SCATTER_SIMD=baseline`.
    pub fn new(options: Options) -> Result<Self, OptionError> {
        Ok(Self::with_simd(options.checked()?, simd_level()))
    }

    /// A marcher that uses nothing but what every CPU of the target has.
    pub fn portable(options: Options) -> Result<Self, OptionError> {
        Ok(Self::with_simd(options.checked()?, Level::baseline()))
    }

    /// With options that the table has checked.
    fn unchecked(options: Options) -> Self {
        Self::with_simd(options, simd_level())
    }

    fn with_simd(options: Options, simd: Level) -> Self {
        Self { options, simd, layer_lanes: Vec::new(), terms: Vec::new() }
    }

    /// Its options.
    pub fn options(&self) -> Options {
        self.options
    }
}

impl VolumetricShadow for RayMarch {
    fn id(&self) -> &'static str {
        MARCH_ID
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        let [width, height] = frame.size();
        let band_count = height.div_ceil(TILE_SIDE) as usize;
        // One set of lanes a band even with one map, so that bands and sets go together.
        let lanes_per_band = match frame.shadow() {
            map @ (ShadowMap::Cascades(_) | ShadowMap::Faces(_)) => map.layer_count().max(1),
            _ => 1,
        };
        self.layer_lanes.resize(band_count * lanes_per_band, MapLanes::default());
        let plan = Plan::new(frame, &self.options, &facts, &mut self.terms);
        clock.lap(&mut stats, "facts");

        let simd = self.simd;
        let band_pixels = (width * TILE_SIDE) as usize;
        let (inscattered, transmittance) = out.overwritten(frame.size());
        parallel::for_each_band(
            (inscattered, transmittance, &mut self.layer_lanes),
            [band_pixels, lanes_per_band],
            |index, inscattered, transmittance, layer_lanes| {
                let y = index as u32 * TILE_SIDE;
                for tile_x in (0..width).step_by(TILE_SIDE as usize) {
                    for py in (y..height.min(y + TILE_SIDE)).step_by(PACKET_SIDE as usize) {
                        for px in (tile_x..width.min(tile_x + TILE_SIDE)).step_by(PACKET_SIDE as usize) {
                            let first = (py - y) as usize * width as usize + px as usize;
                            let rows = (&mut inscattered[first..], &mut transmittance[first..]);
                            at_level!(simd, vectors => plan.march(vectors, [px, py], rows, layer_lanes));
                        }
                    }
                }
            },
        );
        clock.lap(&mut stats, "march");

        let samples = if plan.marches() { u64::from(self.options.steps) } else { 0 };
        let pixels = u64::from(width) * u64::from(height);
        stats.counts.push("rays", pixels);
        stats.counts.push("steps", samples);
        stats.counts.push("shadow-map fetches", if facts.casts_shadow { pixels * samples } else { 0 });
        stats.push_modelled(&facts);
        stats.memory_bytes = (self.layer_lanes.capacity() * size_of::<MapLanes>()
            + self.terms.capacity() * size_of::<PhaseTerm>()) as u64;
        Ok(stats)
    }
}
