//! The search for how far apart slices may be: the widest spacing whose measured error ([`measured`](super::measured)) keeps a
//! target, found in a few measurements.

/// Power of the spacing that errors fall with, before two measurements tell it.
pub const POWER: f64 = 0.75;

/// The search for the widest spacing that keeps an error target.
#[derive(Debug, Clone, Copy)]
pub struct SpacingSearch {
    /// The spacing that is to be measured next, or the one that was found.
    pub spacing: f64,
    finest: f64,
    widest: f64,
    /// What is aimed at beyond what was measured.
    beyond: f64,
    /// The last spacing that missed the target, and by how much.
    missed: Option<(f64, f64)>,
    goes_on: bool,
}

impl SpacingSearch {
    /// From a spacing on, up to the widest and down to the finest; beyond what was measured `beyond` of what is allowed is
    /// aimed at.
    pub fn new(spacing: f64, [finest, widest]: [f64; 2], beyond: f64) -> Self {
        Self { spacing, finest: finest.min(spacing), widest, beyond, missed: None, goes_on: finest < spacing }
    }

    /// Whether there is something to measure.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// Takes what was measured.
    ///
    /// Errors fall with a power of the spacing that the last two measurements tell: about 1 where a shadow's edge lies
    /// somewhere between slices, much less while halving finds most of what is there. The next spacing is measured again,
    /// so a guess need not be right. Between the last spacing that missed the target and the one that keeps it lies the one
    /// that just does; where none missed it errors are taken to grow with the spacing, as fast as they do anywhere, and less is aimed at.
    pub fn learn(&mut self, excess: f64) {
        /// What is aimed at between two measurements, of what is allowed.
        const WITH_ROOM: f64 = 0.8;
        /// Powers within which two measurements are believed.
        const POWERS: [f64; 2] = [0.5, 1.5];
        if excess > 1.0 {
            self.goes_on = self.spacing > self.finest;
            let power = self.missed.map_or(POWER, |(wider, worse)| {
                let power = (worse / excess).ln() / (wider / self.spacing).ln();
                power.clamp(POWERS[0], POWERS[1])
            });
            self.missed = Some((self.spacing, excess));
            let factor = (WITH_ROOM / excess).powf(1.0 / power).clamp(0.25, 0.8);
            self.spacing = (factor * self.spacing).max(self.finest);
            return;
        }
        self.goes_on = false;
        if excess >= WITH_ROOM {
            return;
        }
        let excess = excess.max(0.01);
        self.spacing = match self.missed {
            Some((wider, worse)) => {
                let part = (WITH_ROOM / excess).ln() / (worse / excess).ln();
                self.spacing * (wider / self.spacing).powf(part)
            }
            None => (self.spacing * (self.beyond / excess).max(1.0)).min(self.widest),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spacing that is found where the error is `worst·spacingᵖ` times what is allowed.
    fn found(first: f64, worst: f64, power: f64) -> (f64, u32) {
        let mut search = SpacingSearch::new(first, [0.125, 4.0], 0.5);
        let mut measured = 0;
        while search.goes_on() {
            measured += 1;
            search.learn(worst * search.spacing.powf(power));
        }
        (search.spacing, measured)
    }

    #[test]
    fn from_the_middle_it_goes_up_by_one_measurement_and_never_beyond_the_target() {
        for (worst, power, spacing) in [(0.0, 1.0, 4.0), (0.1, 1.0, 4.0), (0.2, 1.0, 2.5), (0.3, 1.0, 2.0)] {
            assert_eq!(found(2.0, worst, power), (spacing, 1), "{worst}");
        }
        // Errors that grow more slowly than the spacing leave room.
        let (spacing, measured) = found(2.0, 0.2, 0.7);
        assert!(measured == 1 && spacing > 3.0 && 0.2 * spacing.powf(0.7) < 0.8, "{spacing}");
        assert!(found(2.0, 0.7, 1.0).0 < 2.0);
    }

    #[test]
    fn the_search_finds_the_spacing_that_just_keeps_the_target() {
        for worst in [0.3f64, 0.7, 1.3, 2.0, 3.3, 5.0] {
            for power in [0.7, 1.0, 1.5] {
                let (spacing, measured) = found(4.0, worst, power);
                let excess = worst * spacing.powf(power);
                println!(
                    "{worst}·spacing^{power}: {spacing:.3} after {measured}, {excess:.3} of what is allowed"
                );
                let as_wide_as_can_be = excess > 0.749 || spacing == 4.0;
                let kept = excess <= 1.0 || spacing == 0.125;
                assert!(kept && as_wide_as_can_be && measured <= 5, "{worst} {power}");
            }
        }
        assert_eq!(found(4.0, 0.0, 1.0), (4.0, 1));
        assert_eq!(found(4.0, 1e6, 1.0).0, 0.125);
        assert!(found(4.0, f64::INFINITY, 1.0).0 == 0.125);
    }
}
