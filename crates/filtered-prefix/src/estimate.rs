//! What the technique predicts of itself.
use scatter_core::{Estimate, NoEstimate, Outlook};

use crate::options::Options;

/// Not measured yet.
pub fn predicted(_options: &Options, _outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    Err(NoEstimate::because("no model"))
}
