//! The report as a table to read.

use std::fmt::Write;

use scatter_validate::Row;

use super::Report;
use super::times::TimedFrame;

/// Everything, a section after the other.
pub fn text(report: &Report) -> String {
    let mut text = format!("{}\ngpu: {}\n", report.machine, report.gpu);
    if let Some(limits) = report.limits.as_object() {
        for (name, value) in limits {
            let _ = writeln!(text, "  {name:<42}{value:>14}");
        }
    }
    functions(&mut text, report);
    images(&mut text, &report.rows);
    times(&mut text, report);
    let problems = report.problems();
    let _ = writeln!(
        text,
        "\n{} functions, {} images, {} frames; {problems} out of tolerance",
        report.functions.len(),
        report.rows.len(),
        report.times.len()
    );
    text
}

fn functions(text: &mut String, report: &Report) {
    let _ = writeln!(
        text,
        "\nfunctions against f64: the largest error as a share of what f32 and WGSL allow there"
    );
    for check in &report.functions {
        let verdict = if check.is_right() { "ok" } else { "FAIL" };
        let _ =
            writeln!(text, "  {:<40}{:>7} inputs{:>8.2}  {verdict}", check.name, check.inputs, check.worst);
    }
}

fn images(text: &mut String, rows: &[Row]) {
    let _ = writeln!(
        text,
        "\nimages: rel_rmse from the CPU's technique with the same options, and from shadow-map truth"
    );
    let _ =
        writeln!(text, "  {:<10}{:<22}{:>9}{:>10}{:>10}  verdict", "shot", "method", "size", "twin", "truth");
    for row in rows {
        let figure = |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.1e}"));
        let verdict = row.verdict.as_ref().map_or_else(String::new, ToString::to_string);
        let [width, height] = row.size;
        let _ = writeln!(
            text,
            "  {:<10}{:<22}{:>9}{:>10}{:>10}  {}",
            row.shot,
            row.method,
            format!("{width}x{height}"),
            figure(row.twin.as_ref().map(|twin| twin.figures.rel_rmse)),
            figure(row.errors.shadow_map.map(|f| f.rel_rmse)),
            verdict.split(';').next().unwrap_or_default()
        );
    }
}

fn times(text: &mut String, report: &Report) {
    let how = match (report.emulated, report.timestamps) {
        (true, _) => "a software driver's, in brackets: not a GPU's",
        (false, true) => "timestamps a pass; frame: from submit to the end of waiting",
        (false, false) => {
            "this device has no timestamps: only the frame is timed, from submit to the end of waiting"
        }
    };
    let _ = writeln!(
        text,
        "\ntimes in ms, medians ({how}); loads and atomic additions as the plan counts them, loads - where the scene decides"
    );
    let shown = |ms: Option<f64>| match ms {
        None => "-".to_string(),
        Some(ms) if report.emulated => format!("({ms:.2})"),
        Some(ms) => format!("{ms:.3}"),
    };
    for frame in &report.times {
        let TimedFrame { shot, method, size: [width, height], shadow_map, .. } = frame;
        let _ = writeln!(text, "  {shot}, {method}, {width}x{height}, map {shadow_map}");
        if let Some(reason) = &frame.refused {
            let _ = writeln!(text, "    refused: {reason}");
            continue;
        }
        for pass in &frame.passes {
            let loads = if pass.loads == 0 { "-".to_string() } else { pass.loads.to_string() };
            let _ = writeln!(
                text,
                "    {:<16}{:>12}{:>10} workgroups{:>14} loads{:>12} atomics",
                pass.name,
                shown(pass.ms),
                pass.workgroups,
                loads,
                pass.atomics
            );
        }
        let _ = writeln!(
            text,
            "    {:<16}{:>12}  prepare {}, {} bytes",
            "frame",
            shown(frame.submitted_ms),
            shown(frame.prepare_ms),
            frame.memory_bytes
        );
        if frame.cut_short > 0 {
            let _ = writeln!(text, "    FAIL: {} rays were cut short", frame.cut_short);
        }
    }
}
