//! Which technique for which scene: the fastest to each quality level, shot by shot, and who is never the fastest.

use scatter_core::Quality;
use serde::Serialize;

use super::levels::{LevelRow, Reached};

/// The fastest technique to one level on one shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Winner {
    /// The shot's name.
    pub shot: String,
    /// The level.
    pub level: String,
    /// The technique's id; none if nothing reaches the level.
    pub method: Option<String>,
    /// What it takes.
    pub reached: Option<Reached>,
    /// The next technique, and its time over the winner's.
    pub next: Option<(String, f64)>,
}

/// How often a technique is the fastest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Wins {
    /// The technique's id.
    pub method: String,
    /// Pairs of shots and levels on which nothing is faster, by level.
    pub by_level: [usize; 3],
}

/// A row a shot and level, shots in the order of `rows`, levels from the coarsest; by times on one thread.
pub fn winners(rows: &[LevelRow]) -> Vec<Winner> {
    let mut shots: Vec<&str> = Vec::new();
    for row in rows {
        if !shots.contains(&row.shot.as_str()) {
            shots.push(&row.shot);
        }
    }
    shots.into_iter().flat_map(|shot| Quality::ALL.map(|level| winner(rows, shot, level))).collect()
}

fn winner(rows: &[LevelRow], shot: &str, level: Quality) -> Winner {
    let level = level.to_string();
    let of_pair = rows.iter().filter(|row| row.shot == shot && row.level == level);
    let mut reached: Vec<(&str, &Reached)> =
        of_pair.filter_map(|row| Some((row.method.as_str(), row.reached.as_ref()?))).collect();
    reached.sort_by(|(_, a), (_, b)| a.one_thread_ms.total_cmp(&b.one_thread_ms));
    let first = reached.first();
    let next = first
        .zip(reached.get(1))
        .map(|((_, first), (method, next))| (method.to_string(), next.one_thread_ms / first.one_thread_ms));
    Winner {
        shot: shot.into(),
        method: first.map(|(method, _)| method.to_string()),
        reached: first.map(|(_, reached)| (*reached).clone()),
        next,
        level,
    }
}

/// How often each technique of `rows` is the fastest, in their order.
pub fn wins(rows: &[LevelRow]) -> Vec<Wins> {
    let winners = winners(rows);
    let mut wins: Vec<Wins> = Vec::new();
    for row in rows {
        if wins.iter().any(|wins| wins.method == row.method) {
            continue;
        }
        let count = |level: Quality| {
            let level = level.to_string();
            let has_won =
                |winner: &&Winner| winner.level == level && winner.method.as_ref() == Some(&row.method);
            winners.iter().filter(has_won).count()
        };
        wins.push(Wins { method: row.method.clone(), by_level: Quality::ALL.map(count) });
    }
    wins
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::level_rows;
    use crate::tradeoff::trade::tests::trade;

    #[test]
    fn the_fastest_of_those_that_reach_a_level_wins_and_the_next_stands_beside_it() {
        // `rough` takes 1 ms and reaches nothing; the marcher needs 10, 50 and 200 ms, `exact` always 20.
        let winners = winners(&level_rows(&trade()));
        let found: Vec<_> =
            winners.iter().map(|winner| (winner.method.as_deref(), winner.next.clone())).collect();
        let next = |method: &str, ratio| Some((method.to_string(), ratio));
        assert_eq!(
            found,
            [
                (Some("march"), next("exact", 2.0)),
                (Some("exact"), next("march", 2.5)),
                (Some("exact"), next("march", 10.0)),
            ]
        );
    }

    #[test]
    fn who_wins_nowhere_is_counted_with_nothing() {
        let wins = wins(&level_rows(&trade()));
        let counts: Vec<_> = wins.iter().map(|wins| (wins.method.as_str(), wins.by_level)).collect();
        assert_eq!(counts, [("march", [1, 0, 0]), ("exact", [0, 1, 1]), ("rough", [0, 0, 0])]);
    }

    #[test]
    fn a_level_that_nobody_reaches_has_no_winner() {
        let mut rows = level_rows(&trade());
        for row in &mut rows {
            row.reached = None;
        }
        assert!(winners(&rows).iter().all(|winner| winner.method.is_none() && winner.next.is_none()));
        assert!(wins(&rows).iter().all(|wins| wins.by_level == [0; 3]));
    }
}
