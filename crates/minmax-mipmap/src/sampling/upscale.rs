//! From one pixel in 2×2 or 4×4 to all of them: bilateral interpolation by depth (Yusov 2012, Section 6.8).

use epipolar::driver::Shares;
use scatter_core::Frame;

use super::bilateral::{LEAST_WEIGHT, weight};
use super::lattice::Lattice;

/// What all rows of a frame share.
#[derive(Clone, Copy)]
pub struct UpscalePass<'a> {
    /// The frame.
    pub frame: &'a Frame<'a>,
    /// Shares of the lattice's pixels; the others' are written here.
    pub shares: &'a Shares,
    /// What pixels would have without a shadow; `None` where every ray sees light.
    pub lights: Option<&'a [f32]>,
    /// Which pixels are known.
    pub lattice: Lattice,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
    /// Relative difference of depths within which pixels count in full.
    pub threshold: f32,
    /// Whether pixels that no neighbour serves are listed.
    pub correction: bool,
}

impl UpscalePass<'_> {
    /// What weighs a pixel's share.
    #[inline(always)]
    fn light(&self, place: usize) -> f32 {
        self.lights.map_or(1.0, |lights| lights[place])
    }

    /// Fills the pixels of row `y` that are not of the lattice, or lists those that are to be marched.
    #[inline(always)]
    pub fn row(&self, y: u32, left: &mut Vec<[u32; 2]>) {
        let [width, height] = self.frame.size();
        let (lattice, depth) = (self.lattice, self.frame.depth().texels());
        let limit = self.frame.max_distance() as f32;
        let (rows, down) = lattice.around(y, height);
        let known_row = lattice.holds(y, height);
        for x in 0..width {
            if known_row && lattice.holds(x, width) {
                continue;
            }
            let (columns, across) = lattice.around(x, width);
            let place = |x: u32, y: u32| y as usize * width as usize + x as usize;
            let own = place(x, y);
            if self.light(own) == 0.0 {
                (0..self.channels).for_each(|channel| self.shares.put(own, channel, 0.0));
                continue;
            }
            let end = depth[own].min(limit);
            let mut sums = [0.0f32; 3];
            let (mut served, mut sum) = (0.0, 0.0);
            let mut best = (f32::NEG_INFINITY, own);
            for (row, side) in rows.into_iter().zip([1.0 - down, down]) {
                for (column, part) in columns.into_iter().zip([1.0 - across, across]) {
                    let known = place(column, row);
                    let mut share = [0.0f32];
                    self.shares.read(known, 0, &mut share);
                    let light = self.light(known);
                    // The pixel that the epipole hits is not known, and what sees no light has no share.
                    if share[0] < 0.0 || light == 0.0 {
                        continue;
                    }
                    let other = depth[known].min(limit);
                    let own = side * part * weight(end, other, self.threshold);
                    let weight = own * light;
                    served += own;
                    let near = if end == other { 1.0 } else { end.min(other) / end.max(other) };
                    if near > best.0 {
                        best = (near, known);
                    }
                    sum += weight;
                    sums[0] += weight * share[0];
                    for (channel, sum) in sums[..self.channels].iter_mut().enumerate().skip(1) {
                        self.shares.read(known, channel, &mut share);
                        *sum += weight * share[0];
                    }
                }
            }
            if served >= LEAST_WEIGHT && sum > 0.0 {
                for (channel, value) in sums[..self.channels].iter().enumerate() {
                    self.shares.put(own, channel, value / sum);
                }
            } else if self.correction || best.1 == own {
                left.push([x, y]);
            } else {
                for channel in 0..self.channels {
                    let mut share = [0.0f32];
                    self.shares.read(best.1, channel, &mut share);
                    self.shares.put(own, channel, share[0]);
                }
            }
        }
    }
}
