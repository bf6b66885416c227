//! The stress matrix for every technique, and that it can fail: every mutant is rejected by the rung that is named.

use scatter::TECHNIQUES;
use scatter_validate::Contender;
use scatter_validate::checks::counting_allocator::CountingAllocator;
use scatter_validate::mutants::run_mutants;
use scatter_validate::mutants::table::table as table_of_mutants;
use scatter_validate::stress::row::Trial;
use scatter_validate::stress::rows::all_rows;
use scatter_validate::stress::run;
use scatter_validate::stress::table::remarks;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

#[test]
fn no_technique_gives_a_wrong_number_for_any_extreme() {
    let contenders = Contender::all(TECHNIQUES);
    let methods: Vec<&str> = contenders.iter().map(Contender::id).collect();
    // The rules of the house have a test of their own.
    let rows = all_rows().into_iter().filter(|row| !matches!(row.trial, Trial::House(_)));
    let results: Vec<_> = rows.map(|row| run(row, &contenders)).collect();
    assert!(results.len() > 250, "only {} rows", results.len());
    assert!(!results.iter().any(|row| row.has_failed()), "{}", remarks(&results, &methods));
}

#[test]
fn every_mutant_is_rejected_and_every_correct_technique_passes_the_same_rung() {
    let contenders = Contender::all(TECHNIQUES);
    let methods: Vec<&str> = contenders.iter().map(Contender::id).collect();
    let results = run_mutants(&contenders, &mut |_| {});
    let survivors = results.iter().filter(|result| !result.is_rejected()).count();
    assert_eq!(survivors, 0, "{}", table_of_mutants(&results, &methods));
}
