//! The paper's way back to pixels: a slice is integrated for one view ray a column, and pixels interpolate between the
//! results (Baran et al. 2010, Section 4: rectified images are resampled). Blurs over depth edges; kept to be measured.

use crate::driver::{Borders, Offsets, PixelsBetween, SliceQueries};

impl SliceQueries {
    /// Only one view ray a column asks, as long as that of the pixel nearest to the slice, for all beside it.
    pub(crate) fn merge_rectified(
        &mut self,
        gaps: [&mut PixelsBetween; 2],
        lines: [&Borders; 3],
        offsets: Offsets,
        first_offset: usize,
        channels: usize,
    ) {
        let [before, behind] = gaps;
        self.clear(before.len() + behind.len(), channels);
        let mut taken = [0, 0];
        for offset in (offsets.start..offsets.end).step_by(offsets.stride) {
            let [start, own, end] = lines.map(|line| line.pixels[offset]);
            let counts = [own - start, end - own].map(|count| count.max(0) as usize);
            let all = counts[0] + counts[1];
            if all == 0 {
                continue;
            }
            let nearest = (lines[1].minors[offset].round() as i32 - start).clamp(0, all as i32 - 1) as usize;
            let query = self.len() as u32;
            let end = if nearest < counts[0] {
                before.ends()[taken[0] + nearest]
            } else {
                behind.ends()[taken[1] + nearest - counts[0]]
            };
            self.push((offset - first_offset) as u32, end);
            for (side, gap) in [&mut *before, &mut *behind].into_iter().enumerate() {
                let (_, asked) = gap.asked_mut();
                asked[taken[side]..][..counts[side]].fill(query);
                taken[side] += counts[side];
            }
        }
    }
}
