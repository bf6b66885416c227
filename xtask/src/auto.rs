//! The planner behind `--method auto`: the budget of the command line, and this machine.

use scatter::{Budget, Frame, Machine, plan};
use scatter_validate::{PlannedPass, Planner};

/// Plans frames within a budget.
pub struct AutoPlanner {
    /// Of the whole shot.
    pub budget: Budget,
    /// What times are predicted for.
    pub machine: Machine,
}

impl AutoPlanner {
    /// The budget of one of so many lights: a time is divided among them.
    pub fn of_light(&self, light_count: usize) -> Budget {
        match self.budget {
            Budget::Time(time) => Budget::Time(time / light_count.max(1) as f64),
            budget => budget,
        }
    }
}

impl Planner for AutoPlanner {
    fn plan(&self, frame: &Frame<'_>, light_count: usize) -> Result<PlannedPass, String> {
        let plan =
            plan(frame, self.of_light(light_count), &self.machine).map_err(|error| error.to_string())?;
        Ok(PlannedPass {
            technique: plan.technique,
            target: plan.target,
            overrides: plan.overrides,
            instance: plan.instance,
        })
    }
}
