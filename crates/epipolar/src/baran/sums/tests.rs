//! Tree = sweep = cursor = the definition, to the bit where sums are exact, over random slices.

use proptest::prelude::*;

use super::problem::{Queries, Runs};
use super::*;
use crate::rows::{Row, RunIndex};

/// A random slice: whole numbers as weights, so that every order of summation gives the same f32 to the bit.
#[derive(Debug, Clone)]
struct Slice {
    lit: Vec<u32>,
    widths: Vec<u16>,
    tints: Vec<u8>,
    queries: Vec<(u32, u16)>,
    columns: u32,
    first: u32,
    ascending: bool,
}

fn slices() -> impl Strategy<Value = Slice> {
    (1u32..40, 0u32..9, 1usize..90, 0usize..70, any::<bool>()).prop_flat_map(
        |(columns, first, runs, queries, ascending)| {
            // Light rays may end before the first column and behind the last one.
            (
                prop::collection::vec(0..first + columns + 20, runs),
                prop::collection::vec(0u16..40, runs),
                prop::collection::vec(0u8..4, runs),
                prop::collection::vec((first..first + columns, any::<u16>()), queries),
            )
                .prop_map(move |(lit, widths, tints, mut queries)| {
                    queries.sort_by_key(|&(rank, _)| rank);
                    if !ascending {
                        queries.reverse();
                    }
                    Slice { lit, widths, tints, queries, columns, first, ascending }
                })
        },
    )
}

fn results(slice: &Slice, tinted: bool) -> Vec<Vec<[f32; 2]>> {
    let mut prefix = vec![[0.0f32; 2]];
    for &width in &slice.widths {
        let last = prefix[prefix.len() - 1];
        prefix.push([last[0] + 4.0 * f32::from(width), last[1] - f32::from(width)]);
    }
    let tints: Vec<f32> = slice.tints.iter().map(|&t| f32::from(t)).collect();
    let (mut ranks, mut runs, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    for &(rank, place) in &slice.queries {
        let run = usize::from(place) % slice.lit.len();
        // A quarter, half or three quarters of the run: fractional, and still exact.
        let part = f32::from(place % 4) / 4.0;
        let (a, b) = (prefix[run], prefix[run + 1]);
        ranks.push(rank);
        runs.push(run as u32);
        ends.push([a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])]);
    }
    let problem = Problem {
        runs: Runs {
            lit: &slice.lit,
            prefix: &prefix,
            colour: tinted.then_some(tints.as_slice()),
            columns: [slice.first, slice.first + slice.columns],
        },
        queries: Queries { ranks: &ranks, runs: &runs },
        ends: &ends,
        ascending: slice.ascending,
    };
    let mut scratch = SumScratch::default();
    scratch.reserve(slice.lit.len(), slice.columns as usize, ranks.len(), 2);
    // What an earlier slice left behind must not matter.
    scratch.sums.fill(7.0);
    scratch.blocks.fill(7.0);
    scratch.heads.fill(3);
    SumAlgorithm::ALL
        .iter()
        .map(|&algorithm| {
            let mut out = vec![[f32::NAN; 2]; ranks.len()];
            sum_lit_runs(algorithm, &problem, &mut scratch, &mut out);
            out
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn tree_sweep_cursor_and_the_definition_are_equal(slice in slices(), tinted in any::<bool>()) {
        let results = results(&slice, tinted);
        for other in &results[1..] {
            prop_assert_eq!(&results[0], other);
        }
        // The definition once more, from the random numbers alone.
        for (query, &(rank, place)) in slice.queries.iter().enumerate() {
            let end = usize::from(place) % slice.lit.len();
            let weight = |run: usize| if tinted { f32::from(slice.tints[run]) } else { 1.0 };
            let mut sum = 0.0;
            for run in 0..=end {
                let part = if run == end { f32::from(place % 4) / 4.0 } else { 1.0 };
                if slice.lit[run] > rank {
                    sum += weight(run) * part * f32::from(slice.widths[run]);
                }
            }
            prop_assert_eq!(results[0][query], [4.0 * sum, -sum]);
        }
    }

    #[test]
    fn the_index_finds_the_run_that_holds_a_light_ray(
        widths in prop::collection::vec(0.0f32..3.0, 1..300),
        places in prop::collection::vec(0.0f32..1.0, 50),
        queries in 0usize..9000,
    ) {
        let mut row = Row::default();
        row.clear(widths.len());
        let mut gamma = 0.0;
        for (index, width) in widths.iter().enumerate() {
            row.push(gamma, index as u32);
            gamma += width;
        }
        row.finish();
        let mut index = RunIndex::default();
        index.fill(row.starts(), gamma.max(1e-3) * 0.8, queries);
        let gammas: Vec<f32> = places.iter().map(|place| place * gamma).collect();
        let mut runs = vec![0; gammas.len()];
        index.find(row.starts(), &gammas, &mut runs);
        for (&gamma, &run) in gammas.iter().zip(&runs) {
            let run = run as usize;
            prop_assert!(row.starts()[run] <= gamma && gamma < row.starts()[run + 1]);
        }
    }
}
