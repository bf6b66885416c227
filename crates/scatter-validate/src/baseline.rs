//! The technique that the others' times are divided into, at the cheapest setting of its one knob that reaches a
//! level (MODEL.md, Quality levels): the honest denominator of a speed-up.

use scatter_core::{Quality, Target, Technique};

use crate::figures::Figures;
use crate::matrix::{MatrixError, SHADOW_MAP_TRUTH, against};
use crate::measure::{Measurement, Outcome, Renderer, measure};
use crate::staged_shot::StagedShot;
use crate::step_search::StepSearch;

/// A marcher and its step count.
#[derive(Clone, Copy)]
pub struct Baseline<'a> {
    /// The technique.
    pub technique: &'a dyn Technique,
    /// The option that counts its steps.
    pub knob: &'static str,
    /// Largest value of the knob.
    pub most: u32,
}

impl Baseline<'_> {
    /// The cheapest step count with which each of the levels is reached on a shot; `None` where not even the most
    /// steps do. `overrides` are further options.
    pub fn cheapest<const N: usize>(
        &self,
        levels: [Quality; N],
        shot: &StagedShot,
        truth: &Measurement,
        overrides: &[(&str, &str)],
    ) -> Result<[Option<u32>; N], MatrixError> {
        let mut search = StepSearch::new(self.most, |steps| self.figures_at(steps, shot, truth, overrides));
        let mut found = [None; N];
        for (steps, level) in found.iter_mut().zip(levels) {
            *steps = search.cheapest(level.error())?.map(|(steps, _)| steps);
        }
        Ok(found)
    }

    fn figures_at(
        &self,
        steps: u32,
        shot: &StagedShot,
        truth: &Measurement,
        overrides: &[(&str, &str)],
    ) -> Result<Figures, MatrixError> {
        let steps = steps.to_string();
        let mut options = overrides.to_vec();
        options.push((self.knob, &steps));
        let mut renderer =
            Renderer::configured(self.technique, Target::Quality(Quality::default()), &options, shot)??;
        match measure(shot, &mut renderer, 1)? {
            Outcome::Measured(image) => {
                against(shot, (SHADOW_MAP_TRUTH, truth), (self.technique.info().id, &image))
            }
            Outcome::Unsupported(unsupported) => Err(MatrixError::Baseline {
                shot: shot.name().to_string(),
                reason: unsupported.reason.into(),
            }),
        }
    }
}
