//! The cheapest step count with which a marcher reaches a quality level, by bisection to within 10 %.
//!
//! "Reaches" is MODEL.md's: p99 and relative RMSE against shadow-map truth both within the level, nothing
//! non-finite. The error of a marcher falls with its steps, but not monotonically: what is found is a step count
//! that reaches the level next to one, at most 10 % smaller, that does not.

use std::collections::BTreeMap;

use crate::figures::Figures;

/// Whether an image with these figures reaches a level of that error.
pub fn reaches(figures: &Figures, level_error: f64) -> bool {
    figures.non_finite == 0 && figures.p99 <= level_error && figures.rel_rmse <= level_error
}

/// The search on one shot; what was tried for one level is not rendered again for the next.
pub struct StepSearch<F> {
    figures_at: F,
    most: u32,
    tried: BTreeMap<u32, Figures>,
}

impl<E, F: FnMut(u32) -> Result<Figures, E>> StepSearch<F> {
    /// Searches from 1 to `most` steps; `figures_at` renders with a step count and compares.
    pub fn new(most: u32, figures_at: F) -> Self {
        Self { figures_at, most: most.max(1), tried: BTreeMap::new() }
    }

    /// The cheapest step count that reaches the level, with its figures; `None` if not even `most` steps do.
    pub fn cheapest(&mut self, level_error: f64) -> Result<Option<(u32, Figures)>, E> {
        // Doubling from a coarse march finds the octave; finer ones are what costs time.
        let (mut misses, mut reached) = (0, FIRST_TRY.min(self.most));
        while !reaches(&self.at(reached)?, level_error) {
            if reached == self.most {
                return Ok(None);
            }
            misses = reached;
            reached = reached.saturating_mul(2).min(self.most);
        }
        while reached > misses + 1 && f64::from(reached) > CLOSENESS * f64::from(misses) {
            // The geometric middle: the closeness is a ratio.
            let middle = ((f64::from(misses.max(1)) * f64::from(reached)).sqrt().round() as u32)
                .clamp(misses + 1, reached - 1);
            if reaches(&self.at(middle)?, level_error) {
                reached = middle;
            } else {
                misses = middle;
            }
        }
        Ok(Some((reached, self.at(reached)?)))
    }

    fn at(&mut self, steps: u32) -> Result<Figures, E> {
        if let Some(figures) = self.tried.get(&steps) {
            return Ok(*figures);
        }
        let figures = (self.figures_at)(steps)?;
        self.tried.insert(steps, figures);
        Ok(figures)
    }
}

/// Steps of the first try: fewer reach a level on open terrain alone, and cost next to nothing to find.
const FIRST_TRY: u32 = 16;
/// How close the bracket gets: MODEL.md asks for within 10 %.
const CLOSENESS: f64 = 1.1;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::figures;

    /// A marcher whose p99 is `scale/n` and rel_rmse half of that.
    fn search(scale: f64, most: u32) -> (Vec<u32>, [Option<u32>; 3]) {
        let mut tried = Vec::new();
        let mut search = StepSearch::new(most, |n| {
            tried.push(n);
            Ok::<_, ()>(figures(0.5 * scale / f64::from(n), scale / f64::from(n)))
        });
        let found = [0.10, 0.03, 0.01].map(|level| search.cheapest(level).unwrap().map(|(n, _)| n));
        (tried, found)
    }

    #[test]
    fn the_count_is_within_ten_percent_of_the_smallest_that_reaches_the_level() {
        for scale in [0.01, 0.35, 3.0, 12.34, 80.0] {
            let (_, found) = search(scale, 1 << 16);
            for (n, level) in found.into_iter().zip([0.10, 0.03, 0.01]) {
                let (n, exact) = (f64::from(n.unwrap()), (scale / level).max(1.0).ceil());
                assert!(
                    n >= exact && n <= (CLOSENESS * exact).max(exact + 1.0),
                    "{scale} {level}: {n} {exact}"
                );
            }
        }
    }

    #[test]
    fn nothing_is_rendered_twice() {
        let (mut tried, _) = search(12.34, 1 << 16);
        let count = tried.len();
        tried.sort_unstable();
        tried.dedup();
        assert_eq!(tried.len(), count);
    }

    #[test]
    fn a_level_out_of_reach_is_none() {
        let (_, [preview, game, film]) = search(100.0, 5000);
        assert!(preview.is_some() && game.is_some());
        assert_eq!(film, None, "10,000 steps are needed and 5000 allowed");
    }

    #[test]
    fn both_figures_count_and_a_nan_never_reaches_a_level() {
        assert!(reaches(&figures(0.03, 0.03), 0.03));
        assert!(!reaches(&figures(0.031, 0.0), 0.03) && !reaches(&figures(0.0, 0.031), 0.03));
        let mut broken = figures(0.0, 0.0);
        broken.non_finite = 1;
        assert!(!reaches(&broken, 0.03));
        assert!(!reaches(&figures(f64::NAN, 0.0), 0.03));
    }
}
