//! The tables: all settings of a shot, the time to each level, slopes, flicker.

use scatter_core::Quality;

use super::levels::{LevelRow, Reached};
use super::motion::MotionRow;
use super::scaling::{ScalingRow, Slope};
use super::trade::{Rung, ShotTrade};
use super::winners::{Winner, winners, wins};
use crate::columns::Columns;
use crate::figures::Figures;
use crate::table::{milliseconds, percent};

/// Every setting of every technique on one shot, a technique's fastest first; `*` marks the front.
pub fn rung_table(trade: &ShotTrade) -> Columns {
    const HEADER: [&str; 12] = [
        "shot",
        "method",
        "setting",
        "1 thr ms",
        "all ms",
        "rel_rmse %",
        "p99 %",
        "bias %",
        "rmse/ray %",
        "p99/ray %",
        "MB",
        "level",
    ];
    let mut rungs: Vec<&Rung> = Vec::new();
    for method in trade.methods() {
        let mut of_method: Vec<&Rung> = trade.rungs.iter().filter(|rung| rung.row.method == method).collect();
        of_method.sort_by(|a, b| a.one_thread_ms().total_cmp(&b.one_thread_ms()));
        rungs.extend(of_method);
    }
    let figure = |figures: Option<Figures>, pick: fn(Figures) -> f64| {
        figures.map_or_else(|| "-".to_string(), |figures| percent(pick(figures)))
    };
    let cells = |rung: &&Rung| {
        let row = &rung.row;
        let front = if rung.front { " *" } else { "" };
        // A setting's first name is enough to ask for it.
        let mut cells =
            vec![row.shot.clone(), row.method.clone(), rung.setting.first().cloned().unwrap_or_default()];
        if !rung.is_measured() {
            cells[2] = row.verdict.as_ref().map(|verdict| verdict.to_string()).unwrap_or_default();
            return cells;
        }
        let (map, ray) = (row.errors.shadow_map, row.errors.raycast);
        let non_finite = map.map_or(0, |figures| figures.non_finite);
        cells.extend([
            milliseconds(rung.one_thread_ms()),
            milliseconds(row.total_ms()),
            figure(map, |f| f.rel_rmse),
            figure(map, |f| f.p99),
            figure(map, |f| f.bias),
            figure(ray, |f| f.rel_rmse),
            figure(ray, |f| f.p99),
            format!("{:.1}", row.memory_bytes as f64 / 1e6),
            match non_finite {
                0 => format!("{}{front}", row.level.as_deref().unwrap_or("-")),
                count => format!("FAIL: {count} values are not finite"),
            },
        ]);
        cells
    };
    Columns::new(&HEADER, 2, rungs.iter().map(cells), |column| column < 3 || column == HEADER.len() - 1)
}

/// The time to each level with its ratio to the baseline, a line a shot and technique; `map_errors` are the relative
/// RMSEs of the shots' maps.
pub fn level_table(rows: &[LevelRow], map_errors: &[(String, f64)]) -> Columns {
    const HEADER: [&str; 6] =
        ["shot", "method", "preview (10 %) ms", "game (3 %) ms", "film (1 %) ms", "map's error %"];
    let cells = |levels: &[LevelRow]| {
        let first = levels.first()?;
        let map_error = map_errors.iter().find(|(shot, _)| *shot == first.shot);
        let mut line = vec![first.shot.clone(), first.method.clone()];
        line.extend(levels.iter().map(|row| match (&row.unsupported, &row.reached) {
            (Some(_), _) => "unsupported".to_string(),
            (None, None) => "not reached".into(),
            (None, Some(reached)) => time_and_ratio(reached),
        }));
        line.push(map_error.map_or_else(|| "-".into(), |(_, error)| percent(*error)));
        Some(line)
    };
    Columns::new(&HEADER, 1, rows.chunks(Quality::ALL.len()).filter_map(cells), |column| column < 2)
}

/// The fastest technique to each level with its ratio to the baseline and the next one's time over its own, a line a shot; the
/// last lines count how often each technique is the fastest.
pub fn winner_table(rows: &[LevelRow]) -> Columns {
    const HEADER: [&str; 4] = ["shot", "preview (10 %)", "game (3 %)", "film (1 %)"];
    let cell = |winner: &Winner| {
        let (Some(method), Some(reached)) = (&winner.method, &winner.reached) else {
            return "not reached".into();
        };
        let next = winner
            .next
            .as_ref()
            .map_or_else(String::new, |(next, ratio)| format!("; {next} +{:.0} %", 100.0 * (ratio - 1.0)));
        let ratio = reached.one_thread_ratio.map_or_else(String::new, |ratio| format!(" {}", times(ratio)));
        format!("{method}{ratio}{next}")
    };
    let winners = winners(rows);
    let shots = winners.chunks(Quality::ALL.len()).map(|levels| {
        let name = levels.first().map(|winner| winner.shot.clone()).unwrap_or_default();
        std::iter::once(name).chain(levels.iter().map(cell)).collect::<Vec<_>>()
    });
    let counts = wins(rows).into_iter().map(|wins| {
        let cells = wins.by_level.map(|count| count.to_string());
        std::iter::once(format!("fastest: {}", wins.method)).chain(cells).collect()
    });
    Columns::new(&HEADER, 1, shots.chain(counts), |_| true)
}

fn time_and_ratio(reached: &Reached) -> String {
    let time = milliseconds(reached.one_thread_ms);
    match reached.one_thread_ratio {
        Some(ratio) => format!("{time} ({})", times(ratio)),
        None => time,
    }
}

/// How many times faster, in three digits.
fn times(ratio: f64) -> String {
    match ratio {
        99.5.. => format!("{ratio:.0}×"),
        9.95.. => format!("{ratio:.1}×"),
        _ => format!("{ratio:.2}×"),
    }
}

/// The times at all sizes and their slope, a line a shot and technique.
pub fn scaling_table(rows: &[ScalingRow], slopes: &[Slope]) -> Columns {
    const HEADER: [&str; 6] = ["shot", "method", "1 thr ms by size", "level's p99 %", "slope", "scatter %"];
    let cells = |slope: &Slope| {
        let mut of_slope: Vec<&ScalingRow> = rows
            .iter()
            .filter(|row| Some(&row.row.shot) == slope.shot.as_ref() && row.row.method == slope.method)
            .collect();
        of_slope.sort_by(|a, b| a.resolution.total_cmp(&b.resolution));
        let list = |cell: fn(&ScalingRow) -> String| {
            of_slope.iter().map(|row| cell(row)).collect::<Vec<_>>().join(" ")
        };
        let is_measured = of_slope.iter().all(|row| !row.time_ms_one_thread.is_empty());
        let times = match is_measured {
            true => list(|row| milliseconds(row.point()[1])),
            false => of_slope[0].row.verdict.as_ref().map(|verdict| verdict.to_string()).unwrap_or_default(),
        };
        let p99 = list(|row| row.row.errors.shadow_map.map_or_else(String::new, |f| percent(f.p99)));
        let number =
            |value: Option<f64>| value.map_or_else(|| "-".to_string(), |value| format!("{value:.2}"));
        vec![
            slope.shot.clone().unwrap_or_else(|| "all".into()),
            slope.method.clone(),
            times,
            p99,
            number(slope.fit.map(|fit| fit.slope)),
            number(slope.fit.map(|fit| 100.0 * fit.residual)),
        ]
    };
    Columns::new(&HEADER, 1, slopes.iter().map(cells), |column| column < 4)
}

/// The flicker of each technique's error, a line a shot and technique.
pub fn motion_table(rows: &[MotionRow]) -> Columns {
    const HEADER: [&str; 7] =
        ["shot", "method", "rel_rmse %", "error's flicker %", "truth's own %", "non-fin", "setting"];
    let cells = |row: &MotionRow| {
        let options: Vec<String> =
            row.overrides.iter().map(|(key, value)| format!("{key}={value}")).collect();
        let mut setting = row.level.iter().cloned().chain(options).collect::<Vec<_>>().join(" ");
        if !row.light_turned {
            setting.push_str(" (the light stays: glass)");
        }
        if let Some(reason) = &row.unsupported {
            let nothing = || "-".to_string();
            let reason = format!("unsupported: {reason}");
            return vec![
                row.shot.clone(),
                row.method.clone(),
                nothing(),
                nothing(),
                nothing(),
                nothing(),
                reason,
            ];
        }
        let figures = [row.rel_rmse, row.flicker, row.truth_flicker].map(percent);
        let mut cells = vec![row.shot.clone(), row.method.clone()];
        cells.extend(figures);
        cells.extend([row.non_finite.to_string(), setting.trim().to_string()]);
        cells
    };
    Columns::new(&HEADER, 1, rows.iter().map(cells), |column| column < 2 || column == 6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::levels::level_rows;
    use crate::tradeoff::scaling::{slopes, tests::rows};
    use crate::tradeoff::trade::tests::trade;

    #[test]
    fn the_level_table_has_a_line_a_technique() {
        let text = level_table(&level_rows(&trade()), &[("nave".into(), 0.0142)]).to_string();
        let lines: Vec<Vec<&str>> = text
            .lines()
            .map(|line| line.split("  ").map(str::trim).filter(|c| !c.is_empty()).collect())
            .collect();
        assert_eq!(lines[1], ["nave", "march", "10.0 (1.00×)", "50.0 (1.00×)", "200 (1.00×)", "1.42"]);
        assert_eq!(lines[2], ["nave", "exact", "20.0 (0.50×)", "20.0 (2.50×)", "20.0 (10.0×)", "1.42"]);
        assert_eq!(lines[3], ["nave", "rough", "not reached", "not reached", "not reached", "1.42"]);
        let markdown = level_table(&level_rows(&trade()), &[]).markdown();
        assert!(
            markdown.contains("| nave | exact | 20.0 (0.50×) | 20.0 (2.50×) | 20.0 (10.0×) | - |\n"),
            "{markdown}"
        );
    }

    #[test]
    fn the_rung_table_is_sorted_by_time_and_marks_the_front() {
        let mut trade = trade();
        trade.rungs.swap(0, 3);
        let text = rung_table(&trade).to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 8);
        assert!(lines[1].contains("e=0.4") && lines[4].contains("e=0.005"), "{text}");
        assert!(lines[2].ends_with("preview *") && lines[1].ends_with('-'), "{text}");
        assert!(lines.iter().all(|line| line.chars().count() <= 130), "{text}");
    }

    #[test]
    fn the_scaling_table_has_points_and_slopes() {
        let rows = [rows("a", "march", 100.0, 3.0), rows("b", "march", 10.0, 2.0)].concat();
        let text = scaling_table(&rows, &slopes(&rows)).to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[1].contains("1.56 4.42 12.5 35.4 100") && lines[1].contains("3.00"), "{text}");
        assert!(lines[3].starts_with("all") && lines[3].contains("2.50"), "{text}");
    }
}
