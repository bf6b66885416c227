//! The paper's ring: pixels around the epipole are left to be walked through the map, ray by ray (Baran et al. 2010,
//! Section 6). It cost the paper three quarters of its time; bands of 1/sin β are the default.

use crate::driver::{EMPTY, SliceQueries, SliceView};

/// Half angle of the ring around the epipole that the paper marches (Section 6: "about two degrees").
pub(crate) const RING_DEGREES: f64 = 2.0;

/// Empties the shares of a slice's queries whose angle to the light has a smaller sine.
#[inline(always)]
pub(crate) fn leave_ring(ring_sine: f32, slice: &SliceView<'_>, queries: &mut SliceQueries, channels: usize) {
    for channel in 0..channels {
        let (columns, shares) = queries.shares_mut(channel);
        for (share, &column) in shares.iter_mut().zip(columns) {
            *share = if slice.sines()[column as usize] < ring_sine { EMPTY } else { *share };
        }
    }
}
