//! Curves without knots: series and moments, seen at equal distances.

use crate::curve::{DepthRange, TransmittanceCurve};

/// Parts of the range between which such a curve is taken as exponential. A cosine of 16 turns a range has four of them a
/// turn; more cost time, fewer lose what the series can show.
const PARTS: f64 = 64.0;

/// [`TransmittanceCurve::visit`] by samples at fixed depths, the same for all visits.
pub fn visit_samples(
    curve: &impl TransmittanceCurve,
    range: DepthRange,
    [from, to]: [f64; 2],
    mut each: impl FnMut(f64, f64),
) {
    each(from, curve.optical_depth(from));
    let (near, length) = (f64::from(range.near), range.length());
    if length > 0.0 {
        let mut part = ((from - near) / length * PARTS).floor().max(-1.0) + 1.0;
        while part <= PARTS {
            let depth = near + length * (part / PARTS);
            if !(depth < to) {
                break;
            }
            if depth > from {
                each(depth, curve.optical_depth(depth));
            }
            part += 1.0;
        }
    } else if from <= near && near < to {
        // All in one place: a step.
        each(near, 0.0);
        each(near, curve.optical_depth(f64::INFINITY));
    }
    each(to, curve.optical_depth(to));
}
