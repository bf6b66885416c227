//! What the technique predicts of its presets, whose spacing it measures on the frame itself.
//!
//! As of all techniques on slices, the model is one of the picture ([`epipolar::estimate`]); rows of lamps and of height fog cost
//! more than those of a sun in a uniform medium.

use epipolar::estimate::{MeasuredSlices, SliceModel};
use scatter_core::{CostModel, Estimate, NoEstimate, Outlook, UnitCost};

use crate::options::{Basis, Fetch, ID, Options};

/// Fitted as epipolar's own.
const OWN: MeasuredSlices = MeasuredSlices {
    id: ID,
    costs: CostModel {
        units: &[
            UnitCost { name: "frame", nanoseconds: 2e5 },
            UnitCost { name: "fitted-nanosecond", nanoseconds: 1.0 },
        ],
        thread_gain: 0.93,
    },
    slices: SliceModel {
        levels: [7.106, 7.358, 7.862],
        megapixels: -0.138,
        lamp: 0.447,
        missed: 0.314,
        roughness: -0.058,
        depth_breaks: 0.414,
        lit_share: -0.105,
        fog: 0.921,
        glass: 0.620,
    },
    worker_bytes: 6.0,
};

/// Time, error and memory of a frame.
pub fn predicted(options: &Options, outlook: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
    if options.target.is_some() && (options.basis != Basis::Moments || options.fetch != Fetch::Exact) {
        return Err(NoEstimate::because(
            "of its bases and fetches, basis=moments with fetch=exact alone was modelled",
        ));
    }
    OWN.predicted(options.target, outlook)
}
