//! Front-to-back sums along the depth of the grid, of what is lit and of what there would be without shadows.

use super::paths::{LANES, Lanes};

/// Running sums of sixteen columns, in `C` channels.
#[derive(Debug, Clone, Copy)]
pub struct Sums<const C: usize> {
    /// Unoccluded light times visibility.
    pub lit: [Lanes; C],
    /// Unoccluded light.
    pub all: [Lanes; C],
}

/// The unoccluded light of one slice after the other, of sixteen columns.
pub trait SliceLight<const C: usize> {
    /// Adds the light of a slice, the next one at each call, of which `visible` reaches it.
    fn add(&mut self, slice: usize, visible: &[Lanes; C], sums: &mut Sums<C>);

    /// Radiance \[W/(m²·sr)\] of a unit of the sums so far.
    fn radiance(&self) -> [Lanes; C];
}

impl<const C: usize> Sums<C> {
    /// Nothing yet.
    pub const ZERO: Self = Self { lit: [[0.0; LANES]; C], all: [[0.0; LANES]; C] };

    /// Adds a slice of these weights.
    #[inline(always)]
    pub fn add(&mut self, channel: usize, weights: &Lanes, visible: &Lanes) {
        for lane in 0..LANES {
            // Without shadows both sums see the same additions: their quotient is 1 to the last bit.
            self.lit[channel][lane] += weights[lane] * visible[lane];
            self.all[channel][lane] += weights[lane];
        }
    }

    /// The share of the light so far that is lit; `visible` of the last slice where there is no light yet.
    #[inline(always)]
    pub fn share(&self, channel: usize, visible: &Lanes) -> Lanes {
        let mut share = [0.0; LANES];
        for lane in 0..LANES {
            let (lit, all) = (self.lit[channel][lane], self.all[channel][lane]);
            share[lane] = if all > 0.0 { lit / all } else { visible[lane] };
        }
        share
    }
}
