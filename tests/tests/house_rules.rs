//! The rules of the house for every technique, and that each check can fail: a technique that is broken in one way is
//! caught by the check that is there for it.

use scatter::{TECHNIQUES, Technique};
use scatter_validate::Contender;
use scatter_validate::checks::HouseRule;
use scatter_validate::checks::counting_allocator::CountingAllocator;
use scatter_validate::mutants::{Fault, Mutant};
use scatter_validate::stress::cell::Cell;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Rules that `contender` breaks, with what the checks say.
fn broken_rules(contender: &Contender<'_>) -> Vec<(HouseRule, String)> {
    HouseRule::ALL
        .into_iter()
        .filter_map(|rule| match rule.run(contender) {
            Cell::Ok { .. } => None,
            cell => Some((rule, cell.to_string())),
        })
        .collect()
}

#[test]
fn every_technique_keeps_every_rule() {
    for contender in Contender::all(TECHNIQUES) {
        assert_eq!(broken_rules(&contender), [], "{}", contender.id());
    }
}

/// A mutant of the first technique, the marcher, at its film preset: its ladder ends too fine for a test.
#[track_caller]
fn assert_only_this_rule_breaks(fault: Fault, rule: HouseRule, word: &str) {
    struct Preset(&'static dyn Technique);
    impl Technique for Preset {
        fn info(&self) -> &'static scatter::TechniqueInfo {
            self.0.info()
        }
        fn configure(
            &self,
            target: scatter::Target,
            overrides: &[(&str, &str)],
            facts: &scatter::SceneFacts,
        ) -> Result<Box<dyn scatter::VolumetricShadow>, scatter::OptionError> {
            self.0.configure(target, overrides, facts)
        }
        fn resolved(
            &self,
            target: scatter::Target,
            overrides: &[(&str, &str)],
            facts: &scatter::SceneFacts,
        ) -> Result<Vec<(&'static str, String)>, scatter::OptionError> {
            self.0.resolved(target, overrides, facts)
        }
        fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
            self.0.ladder().into_iter().take(3).collect()
        }
        fn estimate(
            &self,
            target: scatter::Target,
            overrides: &[(&str, &str)],
            outlook: &scatter::Outlook<'_>,
        ) -> Result<scatter::Estimate, scatter::NoEstimate> {
            self.0.estimate(target, overrides, outlook)
        }
    }
    let good = Preset(TECHNIQUES[0]);
    let mutant = Mutant { good: &good, fault };
    let broken = broken_rules(&Contender::Technique(&mutant));
    assert!(broken.len() == 1 && broken[0].0 == rule, "{broken:?}");
    assert!(broken[0].1.contains(word), "{broken:?}");
}

#[test]
fn a_nan_in_one_pixel_is_caught() {
    // Of 21 × 37 pixels the middle one, its second channel.
    assert_only_this_rule_breaks(
        Fault::NanInOnePixel,
        HouseRule::Finite,
        "radiance NaN in channel 1 of pixel (10, 18)",
    );
}

#[test]
fn one_bit_that_depends_on_the_number_of_threads_is_caught() {
    assert_only_this_rule_breaks(Fault::OneBitByThreads, HouseRule::Threads, "1 and 2 threads: radiance at");
}

#[test]
fn an_allocation_in_the_second_frame_is_caught() {
    assert_only_this_rule_breaks(
        Fault::AllocatesEveryFrame,
        HouseRule::SecondFrame,
        "1 allocations in the second frame",
    );
}

#[test]
fn a_cache_of_the_first_answer_is_caught() {
    assert_only_this_rule_breaks(
        Fault::CachesTheFirstFrame,
        HouseRule::NoStaleState,
        "after sun, and alone: radiance",
    );
}

#[test]
fn a_frame_that_is_half_rendered_before_it_is_refused_is_caught() {
    assert_only_this_rule_breaks(
        Fault::HalfRendersUnsupported,
        HouseRule::Refusal,
        "render() has touched the image",
    );
}
