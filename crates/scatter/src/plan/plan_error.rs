//! Why there is no plan.

use scatter_core::OptionError;

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The budget is no number in its range.
    #[error("{what} {value} is no budget; give {cure}")]
    BadBudget {
        /// Which one.
        what: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        cure: &'static str,
    },
    /// No technique of this build renders the frame within the budget.
    #[error(
        "no technique of this build does it: {reasons}; loosen the budget, or build with more techniques"
    )]
    Nothing {
        /// Each technique's reason.
        reasons: String,
    },
    /// A technique does not take its own options: a defect of it.
    #[error(transparent)]
    Options(#[from] OptionError),
}
