//! The plots: time over error of one shot, and time over resolution.

use scatter_core::Quality;

use super::pareto::on_front;
use super::scaling::{ScalingRow, slopes};
use super::trade::{Rung, ShotTrade};
use crate::plot::{Axis, Curve, Guide, Mark, Plot, Point};
use crate::table::{milliseconds, percent};

/// Coarsest error that is drawn: beyond 100 % a picture shows something else.
const COARSEST: f64 = 1.0;
/// Errors below this (a thousandth of the finest level) are drawn here: a logarithm has no zero.
const FINEST: f64 = 1e-5;

/// Time on one thread over error, one curve a technique: the line joins those of its settings that no other one of its
/// own beats; filled markers are on the front of all techniques.
pub fn trade_plot(trade: &ShotTrade) -> Plot {
    let methods = trade.methods();
    let curves = methods.iter().enumerate().map(|(index, method)| {
        let is_baseline = trade.baseline == Some(method);
        // The baseline comes first and has a look of its own.
        let look = index - usize::from(trade.baseline.is_some() && index > 0);
        let rungs: Vec<&Rung> = trade
            .rungs
            .iter()
            .filter(|rung| rung.row.method == *method && rung.error() <= COARSEST)
            .collect();
        let places: Vec<[f64; 2]> =
            rungs.iter().map(|rung| [100.0 * rung.error().max(FINEST), rung.one_thread_ms()]).collect();
        let own_front = on_front(&places);
        let mut line: Vec<[f64; 2]> = places
            .iter()
            .zip(&own_front)
            .filter(|(_, is_front)| **is_front)
            .map(|(place, _)| *place)
            .collect();
        line.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let points = rungs.iter().zip(&places).zip(&own_front).map(|((rung, &at), &is_own_front)| Point {
            at,
            name: point_name(rung),
            mark: match (rung.front, is_own_front) {
                (true, _) => Mark::Full,
                (false, true) => Mark::Hollow,
                (false, false) => Mark::Small,
            },
        });
        let is_measured = trade.rungs.iter().any(|rung| rung.row.method == *method && rung.is_measured());
        let name = if is_measured { method.to_string() } else { format!("{method}: unsupported") };
        Curve { name, is_baseline, line, points: points.collect(), look }
    });
    let guides =
        Quality::ALL.map(|level| Guide { at: 100.0 * level.error(), name: level.to_string() }).to_vec();
    Plot {
        title: trade.shot.clone(),
        description:
            "time of a frame over the error of the image, both logarithmic, one curve a technique; lower \
                      and further to the left is better"
                .into(),
        x: Axis { label: "error: larger of p99 and rel_rmse [%]".into() },
        y: Axis { label: "time of a frame, one thread [ms]".into() },
        guides,
        curves: curves.collect(),
        notes: notes(trade.baseline),
    }
}

fn notes(baseline: Option<&str>) -> Vec<String> {
    let mut notes = vec![
        "Lower and further to the left is better.".to_string(),
        "Filled: no setting is both faster and more exact.".into(),
    ];
    notes.extend(baseline.map(|id| format!("Grey ground: slower than {id} at the same error.")));
    notes
}

fn point_name(rung: &Rung) -> String {
    format!(
        "{} {}: {} %, {} ms",
        rung.row.method,
        rung.setting.join(", "),
        percent(rung.error()),
        milliseconds(rung.one_thread_ms())
    )
}

/// Time on one thread over resolution of one shot, one curve a technique, its slope in the legend.
pub fn scaling_plot(shot: &str, rows: &[ScalingRow], baseline: Option<&str>) -> Plot {
    let of_shot: Vec<ScalingRow> = rows.iter().filter(|row| row.row.shot == shot).cloned().collect();
    let slopes = slopes(&of_shot);
    let curves = slopes.iter().filter(|slope| slope.shot.is_some()).enumerate().map(|(index, slope)| {
        let mut rows: Vec<&ScalingRow> =
            of_shot.iter().filter(|row| row.row.method == slope.method).collect();
        rows.sort_by(|a, b| a.resolution.total_cmp(&b.resolution));
        let name = match slope.fit {
            Some(fit) => format!("{}: {:.2}", slope.method, fit.slope),
            None => format!("{}: unsupported", slope.method),
        };
        let is_baseline = baseline == Some(slope.method.as_str());
        let points = rows.iter().map(|row| {
            let [width, height] = row.row.size;
            let name =
                format!("{width}x{height}, map {}: {} ms", row.row.shadow_map, milliseconds(row.point()[1]));
            Point { at: row.point(), name, mark: Mark::Full }
        });
        let look = index - usize::from(baseline.is_some() && index > 0);
        let line = rows.iter().map(|row| row.point()).collect();
        Curve { name, is_baseline, line, points: points.collect(), look }
    });
    Plot {
        title: format!("{shot}: time over resolution"),
        description:
            "time of a frame over the resolution of image and shadow map together, both logarithmic, one \
                      curve a technique; the flatter the better"
                .into(),
        x: Axis { label: "cube root of width × height × map side".into() },
        y: Axis { label: "time of a frame, one thread [ms]".into() },
        guides: Vec::new(),
        curves: curves.collect(),
        notes: vec!["The number is the slope of log time.".into()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tradeoff::scaling::tests::rows;
    use crate::tradeoff::trade::tests::{rung, trade};

    #[test]
    fn a_curve_joins_what_the_technique_itself_does_not_beat_and_the_front_is_filled() {
        let mut trade = trade();
        // Slower and less exact than the other settings of its technique, and one that is far off.
        trade.rungs.push(rung("exact", 0.005, 30.0));
        trade.rungs.push(rung("exact", 7.0, 0.1));
        let plot = trade_plot(&trade);
        let names: Vec<&str> = plot.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(names, ["march", "exact", "rough"]);
        assert!(plot.curves[0].is_baseline && !plot.curves[1].is_baseline);
        let exact = &plot.curves[1];
        assert_eq!(exact.line, [[0.1, 25.0], [0.4, 20.0]], "in percent, from the left to the right");
        let marks: Vec<Mark> = exact.points.iter().map(|point| point.mark).collect();
        assert_eq!(marks, [Mark::Full, Mark::Full, Mark::Small]);
        assert_eq!(plot.curves[0].points[2].mark, Mark::Hollow, "the marcher at 2 % is beaten by another");
        assert_eq!(plot.guides.len(), 3);
    }

    #[test]
    fn an_exact_technique_is_on_the_plot() {
        let mut trade = trade();
        trade.rungs.push(rung("exact", 0.0, 40.0));
        let plot = trade_plot(&trade);
        assert_eq!(plot.curves[1].line[0], [100.0 * FINEST, 40.0]);
    }

    #[test]
    fn the_slope_stands_in_the_legend() {
        let rows =
            [rows("a", "march", 100.0, 3.0), rows("a", "slices", 9.0, 2.0), rows("b", "march", 1.0, 1.0)];
        let plot = scaling_plot("a", &rows.concat(), Some("march"));
        let names: Vec<&str> = plot.curves.iter().map(|curve| curve.name.as_str()).collect();
        assert_eq!(names, ["march: 3.00", "slices: 2.00"]);
        assert!(plot.curves.iter().all(|curve| curve.line.len() == 5 && curve.points.len() == 5));
        assert!(plot.curves[0].line.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    }
}
