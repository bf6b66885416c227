//! How often a strand dims a light ray, and where: once a pass, not once a segment.
//!
//! The segments of a strand that are nearer to the ray than their radius form runs of neighbours along the strand; each run
//! is a pass, at the place of its closest approach. So a joint, where two segments are near, counts once. Passes of one
//! strand that lie within two radii of one that counted are the same pass: a kink that leaves the radius for a moment. They
//! are taken in the order in which the light meets them.

use super::occluders::Occluders;

/// A segment that is nearer to a light ray than its radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NearSegment {
    /// Its number among the segments.
    pub segment: u32,
    /// Square of its distance from the ray.
    pub distance_sq: f64,
    /// Where it is nearest, along the ray in the direction of the light \[world units\].
    pub along: f64,
}

/// Calls `each(along, opacity)` for every pass, strand by strand, within a strand in the order of the light. `near` ascends
/// by segment; `runs` is a buffer.
pub(crate) fn each_pass(
    occluders: &Occluders,
    near: &[NearSegment],
    runs: &mut Vec<NearSegment>,
    mut each: impl FnMut(f64, f64),
) {
    let strand_of = |near: &NearSegment| occluders.segment(near.segment).strand;
    for strand in near.chunk_by(|a, b| strand_of(a) == strand_of(b)) {
        if let [only] = strand {
            each(only.along, occluders.segment(only.segment).opacity);
            continue;
        }
        runs.clear();
        for run in strand.chunk_by(|a, b| b.segment - a.segment <= 1) {
            // Of equally near ones that which the light meets first: all along a stretch that is parallel to the ray.
            let nearest = run
                .iter()
                .min_by(|a, b| a.distance_sq.total_cmp(&b.distance_sq).then(a.along.total_cmp(&b.along)));
            runs.extend(nearest);
        }
        runs.sort_unstable_by(|a, b| a.along.total_cmp(&b.along).then(a.segment.cmp(&b.segment)));
        let mut counted = f64::NEG_INFINITY;
        for run in runs.iter() {
            let segment = occluders.segment(run.segment);
            if run.along - counted > 2.0 * segment.radius {
                counted = run.along;
                each(run.along, segment.opacity);
            }
        }
    }
}
