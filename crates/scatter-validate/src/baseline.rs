//! The technique that the others' times are divided into, at the cheapest setting of its one knob that reaches a
//! level (MODEL.md, Quality levels): the honest denominator of a speed-up.

use scatter_core::{Quality, Target, Technique};

use crate::figures::Figures;
use crate::judge_error::JudgeError;
use crate::judged_shot::MapJudgedShot;
use crate::measure::{Outcome, Renderer, measure};
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
    /// Whether that id is its own.
    pub fn is(&self, id: &str) -> bool {
        self.technique.info().id == id
    }

    /// The cheapest step count with which each of the levels is reached on a shot; `None` where not even the most
    /// steps do. `overrides` are further options.
    pub fn cheapest<const N: usize>(
        &self,
        levels: [Quality; N],
        judged: &MapJudgedShot,
        overrides: &[(&str, &str)],
    ) -> Result<[Option<u32>; N], JudgeError> {
        // A baseline that refuses the shot has no setting for it, and nothing is divided into its time.
        let shot = judged.shot();
        let mut renderer =
            Renderer::configured(self.technique, Target::Quality(Quality::default()), overrides, shot)??;
        if renderer.supports(shot)?.is_err() {
            return Ok([None; N]);
        }
        let mut search = StepSearch::new(self.most, |steps| self.figures_at(steps, judged, overrides));
        let mut found = [None; N];
        for (steps, level) in found.iter_mut().zip(levels) {
            *steps = search.cheapest(level.error())?.map(|(steps, _)| steps);
        }
        Ok(found)
    }

    fn figures_at(
        &self,
        steps: u32,
        judged: &MapJudgedShot,
        overrides: &[(&str, &str)],
    ) -> Result<Figures, JudgeError> {
        let (steps, shot) = (steps.to_string(), judged.shot());
        let mut options = overrides.to_vec();
        options.push((self.knob, &steps));
        let mut renderer =
            Renderer::configured(self.technique, Target::Quality(Quality::default()), &options, shot)??;
        match measure(shot, &mut renderer, 1)? {
            Outcome::Measured(image) => judged.figures(&image),
            Outcome::Unsupported(unsupported) => {
                Err(JudgeError::Baseline { shot: shot.name().to_string(), reason: unsupported.reason.into() })
            }
        }
    }
}
