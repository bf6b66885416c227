//! Properties over random worlds that count who took part: a technique that refuses every frame has proved nothing.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;

use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use scatter_core::ScatterImage;
use scatter_testing::Comparison;

/// Who rendered how many images, who refused how many frames and why, and how near each came to what it was allowed.
#[derive(Debug, Default)]
pub struct Tally(RefCell<BTreeMap<&'static str, Entry>>);

#[derive(Debug, Default)]
struct Entry {
    rendered: usize,
    refused: usize,
    reason: Option<String>,
    /// Largest deviation over the allowed one.
    margin: f64,
}

impl Tally {
    /// Counts an image, or the reason why there is none.
    pub fn count(&self, id: &'static str, image: Result<ScatterImage, String>) -> Option<ScatterImage> {
        let mut entries = self.0.borrow_mut();
        let entry = entries.entry(id).or_default();
        match image {
            Ok(image) => {
                entry.rendered += 1;
                Some(image)
            }
            Err(reason) => {
                entry.refused += 1;
                entry.reason = Some(reason);
                None
            }
        }
    }

    /// Fails the case unless at most `flips` values are out of tolerance; notes how near the others came.
    pub fn expect(
        &self,
        id: &'static str,
        what: &str,
        comparison: &Comparison,
        flips: usize,
    ) -> Result<(), TestCaseError> {
        prop_assert!(comparison.differing <= flips, "{id}, {what}: {comparison}");
        if let Some(entry) = self.0.borrow_mut().get_mut(id)
            && comparison.is_close()
        {
            entry.margin = entry.margin.max(comparison.largest() / comparison.allowed);
        }
        Ok(())
    }

    /// Panics if somebody who was asked rendered nothing, or if nobody was asked.
    #[track_caller]
    pub fn assert_everybody_took_part(&self) {
        let entries = self.0.borrow();
        assert!(!entries.is_empty(), "nothing was rendered");
        let idle: Vec<_> = entries.iter().filter(|(_, entry)| entry.rendered == 0).collect();
        assert!(idle.is_empty(), "refused every frame: {idle:?}");
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (id, Entry { rendered, refused, reason, margin }) in self.0.borrow().iter() {
            write!(f, "{id}: {rendered} images, largest deviation {margin:.3} of the allowed one")?;
            if let Some(reason) = reason {
                write!(f, "; {refused} frames refused (the last one: {reason})")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Runs a property on that many values (or on `PROPTEST_CASES`, for a long run), prints who took part, and fails if
/// somebody refused every frame.
#[track_caller]
pub fn for_all<S: Strategy>(
    cases: u32,
    values: S,
    property: impl Fn(S::Value, &Tally) -> Result<(), TestCaseError>,
) {
    // Failures shrink for long; the worlds are small enough to read as they are.
    let usual = ProptestConfig::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { usual.cases } else { cases };
    let config = ProptestConfig { cases, max_shrink_iters: 200, failure_persistence: None, ..usual };
    let tally = Tally::default();
    if let Err(error) = TestRunner::new(config).run(&values, |value| property(value, &tally)) {
        panic!("{error}");
    }
    print!("{tally}");
    tally.assert_everybody_took_part();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "refused every frame")]
    fn who_refuses_every_frame_fails() {
        for_all(3, Just(()), |(), tally| {
            tally.count("willing", Ok(ScatterImage::new()));
            tally.count("idle", Err("on strike".into()));
            Ok(())
        });
    }

    #[test]
    #[should_panic(expected = "nothing was rendered")]
    fn a_property_that_asks_nobody_fails() {
        for_all(3, Just(()), |(), _| Ok(()));
    }
}
