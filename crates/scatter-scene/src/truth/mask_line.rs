//! The texels of a mask along a straight line, exactly: the stretches of the line on which a texel is there.
//!
//! A walk from texel to texel (Amanatides and Woo 1987). Each border's place on the line is computed from its number
//! alone, so no error adds up; whole blocks of a mask that look the same are left in one step. It takes at most as many
//! steps as the line crosses borders between texels, and holds nothing.

use glam::DVec2;

use crate::cutout::{AlphaMask, BLOCK, Wrap};

/// Calls `run(first, last)` for each maximal stretch of `[range[0], range[1]]`, ascending, on which `a + (b − a)·s`
/// (texels, before wrapping) lies on texels that are there. A stretch that reaches an end of the range has that very
/// number.
pub(super) fn runs(mask: &AlphaMask, a: DVec2, b: DVec2, range: [f64; 2], mut run: impl FnMut(f64, f64)) {
    let mut axes = [0, 1].map(|i| Axis::new(a[i], b[i] - a[i], range[0], mask.size()[i], mask.wrap()[i]));
    let mut at = range[0];
    let mut begin = None;
    loop {
        let [column, row] = [axes[0].shown(), axes[1].shown()];
        let block = mask.block(column, row);
        let is_there = block >> (BLOCK * (row % BLOCK) + column % BLOCK) & 1 != 0;
        if is_there {
            begin.get_or_insert(at);
        } else if let Some(begin) = begin.take() {
            run(begin, at);
        }
        let is_uniform = block == 0 || block == u64::MAX;
        let steps = axes.map(|axis| if is_uniform { axis.steps_in_block() } else { 1 });
        let ends = [axes[0].border(steps[0]), axes[1].border(steps[1])];
        let first = usize::from(ends[1] < ends[0]);
        // Not back, whatever the rounding of two borders that are one place on the line.
        at = ends[first].max(at);
        if !(at < range[1]) {
            break;
        }
        axes[first].step(steps[first]);
        if steps[1 - first] > 1 {
            let other = &mut axes[1 - first];
            other.step(other.crossed(at, steps[1 - first] - 1));
        }
    }
    if let Some(begin) = begin {
        run(begin, range[1]);
    }
}

/// One coordinate of the line.
#[derive(Debug, Clone, Copy)]
struct Axis {
    start: f64,
    /// Change over the whole line, and its reciprocal.
    change: f64,
    per_change: f64,
    /// The whole number of the texel, before wrapping.
    cell: f64,
    /// The same within a period: of a mirrored texture the second half counts backwards.
    within: u32,
    count: u32,
    wrap: Wrap,
}

impl Axis {
    fn new(start: f64, change: f64, at: f64, count: u32, wrap: Wrap) -> Self {
        let place = start + change * at;
        // On a border, the texel that the line goes on in.
        let cell = if change < 0.0 { place.ceil() - 1.0 } else { place.floor() };
        let last = f64::from(count - 1);
        let (cell, within) = match wrap {
            Wrap::Repeat => (cell, cell.rem_euclid(f64::from(count))),
            Wrap::MirroredRepeat => (cell, cell.rem_euclid(2.0 * f64::from(count))),
            // All that lies beyond an end is its last texel.
            Wrap::ClampToEdge => (cell.clamp(0.0, last), cell.clamp(0.0, last)),
        };
        Self { start, change, per_change: 1.0 / change, cell, within: within as u32, count, wrap }
    }

    /// The texel of the texture.
    #[inline]
    fn shown(&self) -> u32 {
        if self.within < self.count { self.within } else { 2 * self.count - 1 - self.within }
    }

    /// Steps until the line leaves the block of texels that shows, or the texture.
    fn steps_in_block(&self) -> u32 {
        let shown = self.shown();
        // Whether the texture's texels are met in their order.
        if (self.change > 0.0) == (self.within < self.count) {
            (BLOCK - shown % BLOCK).min(self.count - shown)
        } else {
            shown % BLOCK + 1
        }
    }

    /// Where on the line the texel `steps` further begins; ∞ if there is none.
    #[inline]
    fn border(&self, steps: u32) -> f64 {
        let steps = f64::from(steps);
        let border = if self.change > 0.0 {
            self.cell + steps
        } else if self.change < 0.0 {
            self.cell + 1.0 - steps
        } else {
            return f64::INFINITY;
        };
        let is_an_end = border <= 0.0 || border >= f64::from(self.count);
        if is_an_end && self.wrap == Wrap::ClampToEdge {
            return f64::INFINITY;
        }
        (border - self.start) * self.per_change
    }

    /// How many borders lie before this place, at most `most`.
    fn crossed(&self, at: f64, most: u32) -> u32 {
        let place = self.start + self.change * at;
        let crossed = if self.change > 0.0 {
            place.floor() - self.cell
        } else if self.change < 0.0 {
            self.cell + 1.0 - place.ceil()
        } else {
            0.0
        };
        // Rounding may say −1: none.
        (crossed as u32).min(most)
    }

    /// Goes on by so many texels.
    #[inline]
    fn step(&mut self, steps: u32) {
        let period = if self.wrap == Wrap::MirroredRepeat { 2 * self.count } else { self.count };
        if self.change > 0.0 {
            self.cell += f64::from(steps);
            self.within += steps;
            if self.within >= period {
                self.within -= period;
            }
        } else {
            self.cell -= f64::from(steps);
            self.within =
                if self.within >= steps { self.within - steps } else { self.within + period - steps };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn runs_of(mask: &AlphaMask, a: DVec2, b: DVec2, range: [f64; 2]) -> Vec<(f64, f64)> {
        let mut all = Vec::new();
        runs(mask, a, b, range, |first, last| all.push((first, last)));
        all
    }

    #[test]
    fn borders_of_a_row_lie_where_its_texels_end() {
        // There, gone, gone, there; along the row from −1 to 5, then back.
        let row = [true, false, false, true];
        let at = |wrap: Wrap, from: f64, to: f64| {
            let mask = AlphaMask::new([4, 1], [wrap, Wrap::Repeat], |column, _| row[column as usize]);
            runs_of(&mask, DVec2::new(from, 0.5), DVec2::new(to, 0.5), [0.0, 1.0])
        };
        let sixth = |k: f64| k * (1.0 / 6.0);
        let (one, three, five) = (sixth(1.0), sixth(2.0), sixth(4.0));
        // Repeated: texels −1 (there), 0, 1, 2, 3, 4 (texel 0).
        assert_eq!(at(Wrap::Repeat, -1.0, 5.0), [(0.0, three), (five, 1.0)]);
        assert_eq!(at(Wrap::MirroredRepeat, -1.0, 5.0), [(0.0, three), (five, 1.0)]);
        assert_eq!(at(Wrap::ClampToEdge, -1.0, 5.0), [(0.0, three), (five, 1.0)]);
        // Backwards from 6: repeated 5 (gone), 4, 3 (there), 2, 1, then 0 from 1 to 0; mirrored 5 is texel 2, 4 is 3.
        assert_eq!(at(Wrap::Repeat, 6.0, 0.0), [(one, sixth(3.0)), (sixth(5.0), 1.0)]);
        assert_eq!(at(Wrap::MirroredRepeat, 6.0, 0.0), [(one, sixth(3.0)), (sixth(5.0), 1.0)]);
        assert_eq!(at(Wrap::ClampToEdge, 6.0, 0.0), [(0.0, sixth(3.0)), (sixth(5.0), 1.0)]);
        // A line that stands still sees one texel or none.
        assert_eq!(at(Wrap::Repeat, 0.5, 0.5), [(0.0, 1.0)]);
        assert_eq!(at(Wrap::Repeat, 1.5, 1.5), []);
    }

    #[test]
    fn a_mask_that_is_all_there_gives_the_whole_range() {
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            let mask = AlphaMask::new([13, 5], [wrap; 2], |_, _| true);
            let (a, b) = (DVec2::new(-7.3, 2.2), DVec2::new(400.1, -90.7));
            assert_eq!(runs_of(&mask, a, b, [0.123, 0.456]), [(0.123, 0.456)]);
        }
    }

    #[test]
    fn a_million_texels_take_a_step_for_each() {
        let mask = AlphaMask::new([2, 1], [Wrap::Repeat; 2], |column, _| column == 0);
        let (mut count, mut length) = (0, 0.0);
        runs(&mask, DVec2::new(0.0, 0.5), DVec2::new(1e6, 0.5), [0.0, 1.0], |first, last| {
            count += 1;
            length += last - first;
        });
        assert_eq!(count, 500_000);
        assert!((length - 0.5).abs() < 1e-9, "{length}");
    }

    fn wraps() -> impl Strategy<Value = Wrap> {
        prop::sample::select(vec![Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge])
    }

    proptest! {
        /// Samples between the borders agree with a look-up of each place alone, whatever the mask and the line.
        #[test]
        fn the_walk_is_what_samples_see(
            size in (1u32..40, 1u32..40),
            wrap in (wraps(), wraps()),
            coarse in 1u32..12,
            seed in 0u32..1000,
            ends in ((-60.0f64..60.0, -60.0f64..60.0), (-60.0f64..60.0, -60.0f64..60.0)),
            whole in any::<bool>(),
            straight in 0u32..4,
        ) {
            // Patches of `coarse` texels, so that some blocks are uniform and others are not.
            let there = |column: u32, row: u32| {
                let patch = (column / coarse).wrapping_mul(0x9e37_79b9) ^ (row / coarse).wrapping_mul(0x85eb_ca6b);
                (patch ^ seed).wrapping_mul(0xc2b2_ae35) >> 31 == 0
            };
            let mask = AlphaMask::new([size.0, size.1], [wrap.0, wrap.1], there);
            // Lines along an axis, and between corners of texels, too.
            let snapped = |x: f64| if whole { x.round() } else { x };
            let a = DVec2::new(snapped(ends.0.0), snapped(ends.0.1));
            let mut b = DVec2::new(snapped(ends.1.0), snapped(ends.1.1));
            if straight == 0 { b.x = a.x; }
            if straight == 1 { b.y = a.y; }
            let range = [0.1, 0.9];
            let runs = runs_of(&mask, a, b, range);
            prop_assert!(runs.iter().all(|(first, last)| range[0] <= *first && first <= last && *last <= range[1]));
            prop_assert!(runs.windows(2).all(|pair| pair[0].1 <= pair[1].0));
            for index in 0..500 {
                let s = range[0] + (range[1] - range[0]) * (f64::from(index) + 0.37) / 500.0;
                let place = a + (b - a) * s;
                // Not within rounding of a border.
                let near = |x: f64, d: f64| (x - x.round()).abs() < 1e-9 && d != 0.0;
                // A line along a border belongs to the texel of larger coordinates, as every place does.
                if near(place.x, b.x - a.x) || near(place.y, b.y - a.y) {
                    continue;
                }
                let found = runs.iter().any(|(first, last)| *first < s && s < *last);
                prop_assert_eq!(found, mask.is_there_at(place), "at {} of {:?}", s, runs);
            }
        }
    }
}
