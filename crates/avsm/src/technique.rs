//! The technique: fog lit through smoke and hair.

use glam::DVec3;
use scatter_core::{
    CameraKind, Capabilities, ExtinctionKind, Frame, Level, LightKind, Limits, MAX_CASCADES, MapKind,
    PhaseKind, RenderError, RenderStats, ScatterImage, SceneFacts, ShadowMap, StageClock, VolumetricShadow,
    parallel, simd_level,
};

use crate::map::curve_maps::CurveMaps;
use crate::options::{ID, Opaque, Options};
use crate::ray::dimmed_light::DimmedLight;
use crate::ray::lit_parts::ShadowPyramids;
use crate::ray::ray_sum::RaySum;

/// Rows of the image that one thread renders at a time.
const BAND: usize = 4;

const ALL_LIGHTS: &[LightKind] = &[LightKind::Directional, LightKind::Point, LightKind::Spot];

/// What it renders: all of the model.
pub const CAPABILITIES: Capabilities = Capabilities {
    lights: ALL_LIGHTS,
    textures: ALL_LIGHTS,
    maps: &[
        MapKind::Unshadowed,
        MapKind::Orthographic,
        MapKind::Perspective,
        MapKind::Cube,
        MapKind::Faces,
        MapKind::Cascades,
    ],
    cameras: &[CameraKind::Perspective, CameraKind::OffCentre, CameraKind::Orthographic],
    extinctions: &[ExtinctionKind::Grey, ExtinctionKind::Rgb],
    phases: &[PhaseKind::Isotropic, PhaseKind::Rayleigh, PhaseKind::HenyeyGreenstein],
    phase_sums: true,
    height_fog: ALL_LIGHTS,
    translucent: ALL_LIGHTS,
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: MAX_CASCADES, layer_texels: u64::MAX },
};

/// Fog lit through translucent occluders, by a transmittance curve in each texel of a light's map (Salvi et al. 2010).
///
/// Each view ray is cut into the lit parts that the opaque shadow map leaves, exactly; these into the crossings of the curve
/// map's texels, and those at the knots of the texel's curve. A sun in a uniform medium has a closed form for each piece;
/// lamps and height fog are integrated by core's quadrature. What no occluder dims is
/// one interval, however many texels it crosses.
///
/// On a frame without translucent occluders, and with [`Opaque::Map`], it is the exact walk through the shadow map by another
/// route: correct, and slower than `minmax-mipmap`, which is the technique for such frames.
#[derive(Debug)]
pub struct Avsm {
    options: Options,
    simd: Level,
    shadow: ShadowPyramids,
    curves: CurveMaps,
    counts: Vec<u64>,
}

impl Avsm {
    /// With the widest registers of the CPU that it runs on, or the portable ones if the environment says
    /// `SCATTER_SIMD=baseline`.
    pub fn new(options: Options) -> Self {
        Self::with_simd(options, simd_level())
    }

    /// With the instructions of a level: `Level::baseline()` uses nothing but what every CPU of the target has.
    pub fn with_simd(options: Options, simd: Level) -> Self {
        Self {
            options,
            simd,
            shadow: ShadowPyramids::default(),
            curves: CurveMaps::new(),
            counts: Vec::new(),
        }
    }

    /// The curves of the last frame: how much light reaches its surfaces.
    pub fn curves(&self) -> &CurveMaps {
        &self.curves
    }

    /// The radiance of a pixel, and how many texels of curves it looked at.
    fn pixel(&self, frame: &Frame<'_>, [x, y]: [u32; 2]) -> (DVec3, u64) {
        let ray = frame.camera().pixel_ray(x, y);
        let eye = frame.camera().eye();
        let mut sum = RaySum::new(DimmedLight::new(frame, &ray, self.simd));
        let end = frame.ray_end(x, y);
        let mut looked = 0;
        let part = |a: f64, b: f64| looked += self.curves.walk(eye, &ray, [a, b], &mut sum);
        match (self.options.opaque, frame.shadow()) {
            (Opaque::Curve, _) | (_, ShadowMap::Unshadowed) => {
                let mut part = part;
                part(0.0, end);
            }
            _ => self.shadow.lit_parts(frame, &ray, end, part),
        }
        (sum.finish(), looked)
    }
}

impl VolumetricShadow for Avsm {
    fn id(&self) -> &'static str {
        ID
    }

    fn capabilities(&self) -> Capabilities {
        CAPABILITIES
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let facts = SceneFacts::of(frame);
        clock.lap(&mut stats, "facts");
        if self.options.opaque == Opaque::Map {
            self.shadow.build(frame).map_err(scatter_core::MapError::from)?;
        }
        clock.lap(&mut stats, "min-max blocks");
        self.curves.build(frame, &self.options)?;
        clock.lap(&mut stats, "curves");

        let [width, height] = frame.size().map(|side| side as usize);
        let mut counts = std::mem::take(&mut self.counts);
        counts.clear();
        counts.resize(height.div_ceil(BAND), 0);
        let technique = &*self;
        let (inscattered, transmittance) = out.overwritten(frame.size());
        parallel::for_each_band(
            (inscattered, transmittance, &mut counts),
            [width * BAND, 1],
            |band, inscattered, transmittance, looked| {
                for (pixel, (radiance, through)) in inscattered.iter_mut().zip(transmittance).enumerate() {
                    let place = [(pixel % width) as u32, (band * BAND + pixel / width) as u32];
                    let (sum, texels) = technique.pixel(frame, place);
                    *radiance = sum.as_vec3().to_array();
                    *through = frame.transmittance(place[0], place[1]).map(|t| t as f32);
                    looked[0] += texels;
                }
            },
        );
        clock.lap(&mut stats, "rays");

        stats.counts.push("rays", (width * height) as u64);
        stats.counts.push("curve texels", counts.iter().sum());
        stats.counts.push("curve bytes", self.curves.curve_bytes());
        self.counts = counts;
        stats.push_modelled(&facts);
        stats.memory_bytes = self.shadow.memory_bytes()
            + self.curves.memory_bytes()
            + (self.counts.capacity() * size_of::<u64>()) as u64;
        Ok(stats)
    }
}
