//! Epipolar slices on the GPU as tools see them.

use scatter_core::{
    Configurable, Estimate, MemoryBound, NoEstimate, OptionError, OptionRange, OptionTable, Outlook,
    Rounding, SceneFacts, Target, TechniqueInfo, VolumetricShadow, option_row,
};
use scatter_kernels::epipolar::EpipolarSettings;

use super::technique::{EPIPOLAR_GPU_ID, GpuTechnique, NOT_MODELLED};
use crate::capabilities;
use crate::technique::Technique;

/// Epipolar slices for tools.
pub(super) struct Epipolar;

static TABLE: OptionTable<EpipolarSettings> = OptionTable {
    technique: EPIPOLAR_GPU_ID,
    rows: &[
        option_row!(
            "spacing",
            "distance of slices",
            "pixels",
            OptionRange::Real([1.0 / 256.0, 16.0]),
            spacing as f64
        ),
        option_row!(
            "towards",
            "share of the spacing that is left with the light in the middle of the picture",
            "",
            OptionRange::Real([1.0 / 16.0, 1.0]),
            towards_light as f64
        ),
        option_row!(
            "fewest",
            "slices a radian, at least, whatever the spacing is set to",
            "",
            OptionRange::Real([1.0, 1e4]),
            fewest_slices as f64
        ),
        option_row!(
            "factors",
            "largest error of the factorised integrand, of a pixel's unoccluded radiance",
            "",
            OptionRange::Real([1e-4, 0.1]),
            factor_error as f64
        ),
    ],
};

static INFO: TechniqueInfo = TechniqueInfo {
    id: EPIPOLAR_GPU_ID,
    summary: "visibility summed along even epipolar slices on the GPU, in integers",
    paper: "Baran et al. 2010; the twin of epipolar",
    misses: "what is thinner than the gap between two slices",
    capabilities: capabilities::EPIPOLAR,
    rounding: Rounding {
        overrides: &[("spacing", "0.25"), ("factors", "0.0001")],
        scaled: 2e-3,
        moved: 2e-3,
        added: 1e-6,
        lit: 1e-4,
        derivation: "four terms of the factorisation are off by up to 1.3e-3 of a pixel, by another amount where a changed view \
                     changes the bands; sums are integers; lit pixels are the closed form in f32",
    },
    // Images, distances and depth as of the others, answers of three channels; rows of a batch; slices, lines and tasks, of which a
    // small image has as many as a large one.
    memory: MemoryBound { fixed: 256 << 20, a_pixel: 160, a_texel: 8 },
    options: &TABLE,
};

impl Configurable for Epipolar {
    type Options = EpipolarSettings;

    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn table(&self) -> &'static OptionTable<EpipolarSettings> {
        &TABLE
    }

    fn choose(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<EpipolarSettings, OptionError> {
        match target {
            Target::Quality(level) => Ok(EpipolarSettings::for_quality(level, facts.size)),
            Target::Error(_) if overrides.iter().any(|(key, _)| *key == "spacing") => {
                Ok(EpipolarSettings::default())
            }
            Target::Error(error) => Err(OptionError::BadValue {
                technique: EPIPOLAR_GPU_ID,
                key: "error",
                value: error.to_string(),
                range: "a quality level, or spacing: between even slices no error is promised".into(),
            }),
        }
    }

    fn instance(&self, options: EpipolarSettings) -> Box<dyn VolumetricShadow> {
        Box::new(GpuTechnique::new(Technique::Epipolar(options)))
    }

    fn predict(&self, _options: &EpipolarSettings, _outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because(NOT_MODELLED))
    }

    fn rungs(&self) -> Vec<Vec<(&'static str, f64)>> {
        [8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625]
            .map(|spacing| vec![("spacing", spacing)])
            .into()
    }
}
