//! A technique with a fault, made around a correct one.

use scatter_core::{
    Capabilities, Estimate, Frame, NoEstimate, OptionError, Outlook, RenderError, RenderStats, ScatterImage,
    SceneFacts, Target, Technique, TechniqueInfo, Unsupported, VolumetricShadow,
};

use super::fault::Fault;
use super::input_faults::with_wrong_input;
use super::output_faults::spoil;

/// A correct technique and what is wrong with it now.
#[derive(Clone, Copy)]
pub struct Mutant<'a> {
    /// The correct one.
    pub good: &'a dyn Technique,
    /// What is wrong.
    pub fault: Fault,
}

impl Technique for Mutant<'_> {
    fn info(&self) -> &'static TechniqueInfo {
        self.good.info()
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let good = self.good.configure(target, overrides, facts)?;
        Ok(Box::new(Instance { good, fault: self.fault, first: None, frames: 0 }))
    }

    fn resolved(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        self.good.resolved(target, overrides, facts)
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        self.good.ladder()
    }

    fn estimate(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        self.good.estimate(target, overrides, outlook)
    }

    fn bytes_of_own_maps(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        facts: &SceneFacts,
    ) -> Result<u64, OptionError> {
        self.good.bytes_of_own_maps(target, overrides, facts)
    }
}

struct Instance {
    good: Box<dyn VolumetricShadow>,
    fault: Fault,
    /// The first frame's answer.
    first: Option<ScatterImage>,
    frames: usize,
}

impl Instance {
    /// The frames that [`Fault::HalfRendersUnsupported`] pretends not to support: those with a lamp.
    fn pretends(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        let lamp = frame.light().position().is_some();
        if self.fault == Fault::HalfRendersUnsupported && lamp {
            return Err(Unsupported { reason: "a lamp".into() });
        }
        Ok(())
    }
}

impl VolumetricShadow for Instance {
    fn id(&self) -> &'static str {
        self.good.id()
    }

    fn capabilities(&self) -> Capabilities {
        self.good.capabilities()
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.pretends(frame)?;
        self.good.supports(frame)
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.frames += 1;
        if let (Fault::CachesTheFirstFrame, Some(first)) = (self.fault, &self.first)
            && first.size() == frame.size()
        {
            // Copied, so that nothing is allocated: this rule is not the one that it breaks.
            out.resize(first.size());
            let (inscattered, transmittance) = out.pixels_mut();
            inscattered.copy_from_slice(first.inscattered());
            transmittance.copy_from_slice(first.transmittance());
            return Ok(RenderStats::default());
        }
        let stats = with_wrong_input(self.fault, frame, |frame| self.good.render(frame, out))?;
        spoil(self.fault, self.frames, out);
        if self.fault == Fault::CachesTheFirstFrame && self.first.is_none() {
            self.first = Some(out.clone());
        }
        // Only now, when the work is done.
        self.pretends(frame)?;
        Ok(stats)
    }
}
