//! The sums by their definition, in the integers of the shaders: what they must give to the bit.

use crate::in_slice::problem::InSlice;

/// The answers of all asks. O(asks · runs).
pub fn answers_mirror(problem: &InSlice) -> Vec<[i32; 4]> {
    let mut answers = vec![[0i32; 4]; problem.asks.len()];
    for task in &problem.tasks {
        for ask in &problem.asks[task.first_ask as usize..][..task.ask_count as usize] {
            let lit = &problem.lit_columns[task.first_run as usize..][..task.run_count as usize];
            let prefixes = &problem.prefixes[task.first_prefix as usize..][..task.run_count as usize + 1];
            let column = task.first_column + ask.rank;
            let answer = &mut answers[ask.answer as usize];
            for run in 0..=ask.run as usize {
                let end = if run == ask.run as usize { ask.end } else { prefixes[run + 1] };
                if lit[run] > column {
                    *answer = std::array::from_fn(|term| {
                        answer[term].wrapping_add(end[term].wrapping_sub(prefixes[run][term]))
                    });
                }
            }
        }
    }
    answers
}
