//! A renderer as tools see techniques: without options, the same for every target.

use scatter_core::{
    Estimate, NoEstimate, OptionError, Outlook, SceneFacts, Target, Technique, TechniqueInfo,
    VolumetricShadow,
};

/// A technique whose instances are copies of one renderer.
pub struct Optionless<R> {
    /// What tools see of it.
    pub info: &'static TechniqueInfo,
    /// What renders.
    pub renderer: R,
}

impl<R: VolumetricShadow + Copy + Sync + 'static> Technique for Optionless<R> {
    fn info(&self) -> &'static TechniqueInfo {
        self.info
    }

    fn configure(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        Ok(Box::new(self.renderer))
    }

    fn resolved(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _facts: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        Ok(Vec::new())
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        Vec::new()
    }

    fn estimate(
        &self,
        _target: Target,
        _overrides: &[(&str, &str)],
        _outlook: &Outlook<'_>,
    ) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because("it has no options and no model of its cost"))
    }
}
