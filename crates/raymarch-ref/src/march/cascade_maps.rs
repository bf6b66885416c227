//! Cascades: which of them a packet's samples can lie in, found before the march, step range by step range.
//!
//! A cascade is a prism along the light, so each ray of a packet is inside of it in one interval. From where the first
//! ray enters to where the last one does, and likewise where they leave, rays are in different maps; between these
//! few steps all of them look into one map, as if there were no other. Looking for the map at every sample instead took
//! 1.2 times as long (128 steps, four cascades; the same bits).

use fearless_simd::prelude::*;
use scatter_core::{MAX_CASCADES, ShadowLayer};

use super::lanes::{LaneMask, splat};
use super::lookups::{Grid, MapLanes, Samples, Visibility};
use super::sun_paths::StepReach;

/// Each cascade has four borders in the steps; the end is one more.
const MOST_STRETCHES: usize = 4 * MAX_CASCADES + 1;

/// Neighbouring steps with the same maps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Stretch {
    /// The step behind the last one.
    end: u32,
    /// A bit for each cascade that may decide about a sample.
    candidates: u16,
    /// Whether the last candidate holds all samples that those before it do not.
    closed: bool,
}

/// The steps of a packet, cut where its rays enter and leave cascades.
#[derive(Debug, Clone)]
pub struct Stretches {
    list: [Stretch; MOST_STRETCHES],
    len: usize,
}

impl Stretches {
    /// `reaches`: where the rays meet each cascade, in the list's order; at most [`MAX_CASCADES`].
    #[inline(always)]
    pub fn new(reaches: &[StepReach], steps: u32) -> Self {
        let mut stretches = Self { list: [Stretch::default(); MOST_STRETCHES], len: 0 };
        let mut at = 0;
        while at < steps {
            let mut stretch = Stretch { end: steps, candidates: 0, closed: false };
            for (index, StepReach { any, all }) in reaches.iter().enumerate() {
                if at < any[0] && any[0] < any[1] {
                    stretch.end = stretch.end.min(any[0]);
                }
                if at < any[0] || at >= any[1] {
                    continue;
                }
                stretch.candidates |= 1 << index;
                stretch.closed = all[0] <= at && at < all[1];
                if stretch.closed {
                    stretch.end = stretch.end.min(all[1]);
                    break;
                }
                stretch.end = stretch.end.min(any[1]);
                if at < all[0] && all[0] < all[1] {
                    stretch.end = stretch.end.min(all[0]);
                }
            }
            stretches.list[stretches.len] = stretch;
            stretches.len += 1;
            at = stretch.end;
        }
        stretches
    }

    /// The stretch that `step` belongs to, and its first step.
    #[inline(always)]
    fn at(&self, step: u32) -> (u32, Stretch) {
        let mut start = 0;
        for stretch in &self.list[..self.len] {
            if step < stretch.end {
                return (start, *stretch);
            }
            start = stretch.end;
        }
        (start, Stretch { end: u32::MAX, ..Stretch::default() })
    }
}

/// Several parallel maps; the first that contains a sample decides.
#[derive(Clone, Copy)]
pub struct CascadeMaps<'a> {
    layers: &'a [ShadowLayer<'a>],
    /// The packet's rays in each; of maps that no ray meets they are not read.
    lanes: &'a [MapLanes],
    stretches: &'a Stretches,
    /// What this look-up serves.
    here: Stretch,
    /// The map, if there is only one here, and the rays in it.
    only: Option<(Grid<'a, f32>, &'a MapLanes)>,
}

impl<'a> CascadeMaps<'a> {
    /// For the steps of [`Visibility::stretch`] only.
    pub fn new(layers: &'a [ShadowLayer<'a>], lanes: &'a [MapLanes], stretches: &'a Stretches) -> Self {
        Self { layers, lanes, stretches, here: Stretch::default(), only: None }
    }

    #[inline(always)]
    fn grid(&self, index: usize) -> Grid<'a, f32> {
        Grid::new(self.layers[index].texels(), self.layers[index].projection().size())
    }
}

impl<S: Simd> Visibility<S> for CascadeMaps<'_> {
    #[inline(always)]
    fn stretch(&self, step: u32) -> (Self, [u32; 2]) {
        let (start, here) = self.stretches.at(step);
        let only = (here.closed && here.candidates.is_power_of_two()).then(|| {
            let index = here.candidates.trailing_zeros() as usize;
            (self.grid(index), &self.lanes[index])
        });
        (Self { here, only, ..*self }, [start, here.end])
    }

    #[inline(always)]
    fn lit<P: Samples<S>>(&self, simd: S, samples: P) -> LaneMask<S> {
        if let Some((grid, lanes)) = self.only {
            let [u, v, depth] = samples.position(simd, lanes);
            return depth.simd_le(grid.depth(simd, grid.index(simd, u, v)));
        }
        let zero = splat(simd, 0.0);
        let mut open = zero.simd_eq(zero);
        let mut lit = open;
        let mut candidates = self.here.candidates;
        while candidates != 0 {
            let index = candidates.trailing_zeros() as usize;
            candidates &= candidates - 1;
            let grid = self.grid(index);
            let [u, v, depth] = samples.position(simd, &self.lanes[index]);
            let here = if candidates == 0 && self.here.closed {
                open
            } else {
                open & grid.contains(simd, u, v, splat(simd, 1.0))
            };
            if here.any_true() {
                let shadowed = depth.simd_gt(grid.depth(simd, grid.index(simd, u, v)));
                lit &= !(here & shadowed);
                open &= !here;
                if open.all_false() {
                    break;
                }
            }
        }
        lit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator of numbers below `n`.
    fn draw(state: &mut u64, n: u32) -> u32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) % u64::from(n)) as u32
    }

    #[test]
    fn stretches_cover_all_steps_with_the_first_maps_that_hold_them() {
        let mut state = 1;
        let mut most = 0;
        for case in 0..20_000 {
            let steps = 1 + draw(&mut state, 90);
            let count = 1 + draw(&mut state, MAX_CASCADES as u32) as usize;
            let mut reaches = [StepReach::default(); MAX_CASCADES];
            for reach in &mut reaches[..count] {
                let mut borders: [u32; 4] = std::array::from_fn(|_| draw(&mut state, steps + 1));
                borders.sort_unstable();
                let [a, b, c, d] = borders;
                *reach = match draw(&mut state, 4) {
                    // Missed by all rays, and nowhere met by all of them at once (whose ends cross).
                    0 => StepReach::default(),
                    1 => StepReach { any: [a, d], all: [c, b] },
                    _ => StepReach { any: [a, d], all: [b, c] },
                };
            }
            let stretches = Stretches::new(&reaches[..count], steps);
            most = most.max(stretches.len);
            for step in 0..steps {
                let (start, stretch) = stretches.at(step);
                assert!(start <= step && step < stretch.end && stretch.end <= steps, "case {case}");
                let mut expected = Stretch { end: stretch.end, ..Stretch::default() };
                for (index, StepReach { any, all }) in reaches[..count].iter().enumerate() {
                    if any[0] <= step && step < any[1] {
                        expected.candidates |= 1 << index;
                        expected.closed = all[0] <= step && step < all[1];
                        if expected.closed {
                            break;
                        }
                    }
                }
                assert_eq!(stretch, expected, "case {case}, step {step}: {:?}", &reaches[..count]);
            }
        }
        println!("at most {most} stretches of {MOST_STRETCHES}");
    }
}
