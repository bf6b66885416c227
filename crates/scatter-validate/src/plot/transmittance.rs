//! What is left of the light over depth, of one light ray, as SVG over two even axes: a curve beside the one that it stands for.

use std::fmt::Write;

use super::element::{escaped, line, points, text};
use super::{FIELD, GRID, INK, LINE_HEIGHT, MIN_FONT, WIDTH};

/// Transmittance curves of one light ray.
#[derive(Debug, Clone)]
pub struct TransmittancePlot {
    /// Whose light ray it is, above the plot.
    pub title: String,
    /// Where the horizontal axis begins and ends: depth along the light's axis \[world units\].
    pub depths: [f64; 2],
    /// The curves, the lowermost first.
    pub curves: Vec<DepthCurve>,
}

/// One curve.
#[derive(Debug, Clone)]
pub struct DepthCurve {
    /// What the legend calls it.
    pub name: String,
    /// `[depth, transmittance]`, in the order of depths.
    pub line: Vec<[f64; 2]>,
    /// Places of its nodes, where these are few enough to be seen.
    pub nodes: Vec<[f64; 2]>,
}

/// Black for the truth, then two of Okabe and Ito's that differ in print.
const COLORS: [&str; 3] = ["#222", "#d55e00", "#0072b2"];
/// Room under the field for the depths and what they are.
const AXIS_ROOM: f64 = 46.0;

impl TransmittancePlot {
    /// The plot as an `svg` element for an HTML page. Points that are no numbers are left out.
    pub fn inline_svg(&self) -> String {
        let [left, right, top, bottom] = FIELD;
        let height = bottom + AXIS_ROOM + LINE_HEIGHT * self.curves.len() as f64 + 8.0;
        let [near, far] = self.depths;
        let across = |depth: f64| left + (right - left) * ((depth - near) / (far - near)).clamp(0.0, 1.0);
        let down = |left_of_light: f64| bottom + (top - bottom) * left_of_light.clamp(0.0, 1.0);
        let place = |[depth, kept]: [f64; 2]| [across(depth), down(kept)];
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" width=\"100%\" style=\"max-width:40rem\" role=\"img\" \
             aria-label=\"{}\" font-family=\"system-ui, sans-serif\">\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n",
            escaped(&format!("{}: transmittance over depth", self.title))
        );
        text(&mut svg, [0.5 * WIDTH, 22.0], 17.0, "middle", INK, &self.title);
        for step in 0..=4 {
            let share = 0.25 * f64::from(step);
            let stroke = format!("stroke=\"{}\"", GRID[1]);
            line(&mut svg, [left, down(share)], [right, down(share)], &stroke);
            text(&mut svg, [left - 8.0, down(share) + 5.0], MIN_FONT, "end", INK, &format!("{share}"));
            let depth = near + share * (far - near);
            line(&mut svg, [across(depth), top], [across(depth), bottom], &stroke);
            text(&mut svg, [across(depth), bottom + 19.0], MIN_FONT, "middle", INK, &format!("{depth:.3}"));
        }
        let middle = [0.5 * (left + right), bottom + 40.0];
        text(&mut svg, middle, MIN_FONT, "middle", INK, "depth along the light, and what is left of it");
        for (index, curve) in self.curves.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let width = if index == 0 { 4.0 } else { 1.8 };
            let is_number = |point: &&[f64; 2]| point.iter().all(|value| value.is_finite());
            let places: Vec<_> = curve.line.iter().filter(is_number).copied().map(place).collect();
            let opacity = if index == 0 { 0.45 } else { 1.0 };
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" \
                 stroke-opacity=\"{opacity}\"/>",
                points(&places)
            );
            for [x, y] in curve.nodes.iter().filter(is_number).copied().map(place) {
                let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{color}\"/>");
            }
            let row = bottom + AXIS_ROOM + LINE_HEIGHT * (index as f64 + 0.6);
            let stroke = format!("stroke=\"{color}\" stroke-width=\"{width}\"");
            line(&mut svg, [left, row], [left + 34.0, row], &stroke);
            text(&mut svg, [left + 42.0, row + 5.0], MIN_FONT, "start", INK, &curve.name);
        }
        svg.push_str("</svg>\n");
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_run_from_the_upper_left_and_nodes_lie_on_them() {
        let plot = TransmittancePlot {
            title: "a < b".into(),
            depths: [2.0, 4.0],
            curves: vec![
                DepthCurve {
                    name: "exact".into(),
                    line: vec![[2.0, 1.0], [f64::NAN, 0.3], [4.0, 0.0]],
                    nodes: Vec::new(),
                },
                DepthCurve { name: "4 nodes".into(), line: vec![[2.0, 1.0]], nodes: vec![[3.0, 0.5]] },
            ],
        };
        let svg = plot.inline_svg();
        let [left, right, top, bottom] = FIELD;
        assert!(svg.contains(&format!("points=\"{left:.1},{top:.1} {right:.1},{bottom:.1}\"")), "{svg}");
        let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
        assert!(svg.contains(&format!("cx=\"{:.1}\" cy=\"{:.1}\"", middle[0], middle[1])), "{svg}");
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && svg.contains("4 nodes"));
    }
}
