//! The survey's rows as readable tables.

use std::fmt::Write;

use scatter::TECHNIQUES;

use super::rows::{MapRow, ROUNDING, Survey, SurveyRow, TimeRow};

impl Survey {
    /// The maps' own errors.
    pub fn map_text(&self) -> String {
        let mut text =
            String::from("shot                               map side    off by  predicted  ratio\n");
        for MapRow { shot, side, error, predicted_error } in &self.maps {
            let [off, predicted] = [error, predicted_error].map(|error| 100.0 * error);
            let ratio = off / predicted;
            let _ = writeln!(text, "{shot:<34} {side:>8}  {off:>6.2} %   {predicted:>6.2} %  {ratio:>5.2}");
        }
        text
    }

    pub fn text(&self) -> String {
        let mut text = String::from(
            "measured over predicted       rows  time: median off, worst      p99: median off, worst\n",
        );
        let ids: Vec<&str> = TECHNIQUES.iter().map(|technique| technique.info().id).collect();
        for id in ids.iter().copied().map(Some).chain([None]) {
            let of = |row: &&SurveyRow| id.is_none_or(|id| row.method == id);
            let rows: Vec<&SurveyRow> = self.rows.iter().filter(of).collect();
            if rows.is_empty() {
                continue;
            }
            let times = rows.iter().map(|row| (row.time_ms / row.predicted_ms, *row)).collect();
            let seen = |row: &&&SurveyRow| row.p99.max(row.predicted_p99) > ROUNDING;
            let errors: Vec<_> =
                rows.iter().filter(seen).map(|row| (row.p99 / row.predicted_p99, *row)).collect();
            let _ = writeln!(
                text,
                "{:<28} {:>5}  {}  {}",
                id.unwrap_or("all"),
                rows.len(),
                spread(times),
                spread(errors)
            );
        }
        text.push_str("\nauto                               level    took                           ms  best                 ms  ratio  plan ms  p99 %\n");
        for row in &self.auto {
            let _ = writeln!(
                text,
                "{:<34} {:<8} {:<22} {:>10.1}  {:<15} {:>8.1}  {:>5.2}  {:>7.2}  {:.3}{}",
                row.shot,
                row.level,
                format!("{} {}", row.method, row.setting),
                row.time_ms,
                row.best_method,
                row.best_ms,
                row.time_ms / row.best_ms,
                row.plan_ms,
                100.0 * row.p99,
                if row.reached { "" } else { "  MISSED" }
            );
        }
        let mut ratios: Vec<f64> = self.auto.iter().map(|row| row.time_ms / row.best_ms).collect();
        ratios.sort_by(f64::total_cmp);
        if let (Some(median), Some(worst)) = (ratios.get(ratios.len() / 2), ratios.last()) {
            let missed = self.auto.iter().filter(|row| !row.reached).count();
            let _ = writeln!(
                text,
                "auto over the best: median {median:.2}, worst {worst:.2}; {missed} of {} levels missed",
                ratios.len()
            );
        }
        self.push_times(&mut text);
        text
    }

    /// How times were kept, and what was got within them.
    fn push_times(&self, text: &mut String) {
        text.push_str(
            "\nwithin a time                       budget ms  took                           ms  of it  error %  best %\n",
        );
        for row in &self.times {
            let _ = writeln!(
                text,
                "{:<34} {:>10.1}  {:<22} {:>10.1}  {:>5.2}  {:>7.3}  {}",
                row.shot,
                row.budget_ms,
                format!("{} {}", row.method, row.setting),
                row.time_ms,
                row.time_ms / row.budget_ms,
                100.0 * row.error,
                row.best_error.map_or_else(|| "-".into(), |best| format!("{:.3}", 100.0 * best))
            );
        }
        let mut shares: Vec<f64> = self.times.iter().map(|row| row.time_ms / row.budget_ms).collect();
        shares.sort_by(f64::total_cmp);
        let lost = |row: &TimeRow| {
            row.best_error
                .map(|best| row.error.max(ROUNDING) / best.max(ROUNDING))
                .filter(|ratio| ratio.is_finite())
        };
        let mut losses: Vec<f64> = self.times.iter().filter_map(lost).collect();
        losses.sort_by(f64::total_cmp);
        if let (Some(longest), Some(loss), Some(largest)) =
            (shares.last(), losses.get(losses.len() / 2), losses.last())
        {
            let over = shares.iter().filter(|share| **share > 1.25).count();
            let _ = writeln!(
                text,
                "time over the budget: median {:.2}, longest {longest:.2}, {over} of {} by more than a quarter; error over the best: \
                 median {loss:.2}, worst {largest:.2}",
                shares[shares.len() / 2],
                shares.len()
            );
        }
    }
}

/// The median distance of ratios from 1, as a factor, and the row that is farthest.
fn spread(mut ratios: Vec<(f64, &SurveyRow)>) -> String {
    let off = |ratio: f64| ratio.max(1.0 / ratio);
    ratios.retain(|(ratio, _)| ratio.is_finite() && *ratio > 0.0);
    ratios.sort_by(|a, b| off(a.0).total_cmp(&off(b.0)));
    let (Some((median, _)), Some((worst, row))) = (ratios.get(ratios.len() / 2), ratios.last()) else {
        return "-".into();
    };
    let percent = 100.0 * (off(*median) - 1.0);
    format!("{percent:>4.0} %, {worst:.2} ({} {})", row.shot, row.level)
}
