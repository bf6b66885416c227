//! Plots over two logarithmic axes as SVG: to be inlined in a page or to stand alone, without scripts and styles.
//!
//! Colours are those of Okabe and Ito (distinct to colour-blind eyes), each curve has a marker and a dash of its own for
//! print, and no text is smaller than [`MIN_FONT`] of the 480 units that a plot is wide: legible where a phone shows it
//! in 360 pixels.

mod axis;
mod curve;
mod element;
#[cfg(test)]
mod tests;
mod transmittance;

use std::fmt::Write;

use axis::Scale;
pub use axis::{Axis, Guide};
pub use curve::{Curve, Mark, Point};
use element::{escaped, line, text};
pub use transmittance::{DepthCurve, TransmittancePlot};

/// Smallest font, in units of a plot that is 480 wide.
pub const MIN_FONT: f64 = 14.0;

/// A plot: axes, curves, legend.
#[derive(Debug, Clone)]
pub struct Plot {
    /// What is plotted, above it.
    pub title: String,
    /// What the picture shows, for those who cannot see it.
    pub description: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Vertical lines with names.
    pub guides: Vec<Guide>,
    /// The curves, the lowermost first; the legend has their order.
    pub curves: Vec<Curve>,
    /// What the marks mean, a line each under the legend.
    pub notes: Vec<String>,
}

const WIDTH: f64 = 480.0;
/// Where curves are drawn: left, right, top, bottom.
const FIELD: [f64; 4] = [66.0, 466.0, 34.0, 334.0];
/// Room under the field for tick labels and the axis label.
const AXIS_ROOM: f64 = 52.0;
const LINE_HEIGHT: f64 = 21.0;
const INK: &str = "#222";
const GRID: [&str; 2] = ["#ececec", "#cfcfcf"];

impl Plot {
    /// The plot as an `svg` element for an HTML page.
    pub fn inline_svg(&self) -> String {
        let height = self.height();
        format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" width=\"100%\" style=\"max-width:40rem\" role=\"img\" \
             aria-label=\"{}\" font-family=\"system-ui, sans-serif\">\n{}</svg>\n",
            escaped(&format!("{}: {}", self.title, self.description)),
            self.body()
        )
    }

    fn height(&self) -> f64 {
        FIELD[3] + AXIS_ROOM + LINE_HEIGHT * (self.legend_rows() + self.notes.len()) as f64 + 8.0
    }

    fn body(&self) -> String {
        let [left, right, top, bottom] = FIELD;
        let points = || self.curves.iter().flat_map(Curve::coordinates);
        let x = Scale::new(points().map(|p| p[0]).chain(self.guides.iter().map(|g| g.at)), [left, right]);
        let y = Scale::new(points().map(|p| p[1]), [bottom, top]);
        let mut svg = format!("<rect width=\"{WIDTH}\" height=\"{}\" fill=\"#fff\"/>\n", self.height());
        text(&mut svg, [0.5 * WIDTH, 22.0], 17.0, "middle", INK, &self.title);
        for curve in &self.curves {
            curve.shade(&mut svg, &x, &y, top);
        }
        self.grid(&mut svg, &x, &y);
        for guide in self.guides.iter().filter(|guide| x.contains(guide.at)) {
            let at = x.place(guide.at);
            line(&mut svg, [at, bottom], [at, top], "stroke=\"#666\" stroke-dasharray=\"2 4\"");
            // Along its line, on the side where errors are smaller and the curves higher up end.
            let _ = writeln!(
                svg,
                "<text transform=\"translate({:.1} {:.1}) rotate(-90)\" font-size=\"{MIN_FONT}\" \
                 text-anchor=\"end\" fill=\"#555\">{}</text>",
                at - 4.0,
                top + 5.0,
                escaped(&guide.name)
            );
        }
        for curve in &self.curves {
            curve.draw(&mut svg, &x, &y);
        }
        self.legend(&mut svg);
        svg
    }

    fn grid(&self, svg: &mut String, x: &Scale, y: &Scale) {
        let [left, right, top, bottom] = FIELD;
        for (minor, color) in [(true, GRID[0]), (false, GRID[1])] {
            let stroke = format!("stroke=\"{color}\"");
            for value in x.lines(minor) {
                line(svg, [x.place(value), top], [x.place(value), bottom], &stroke);
            }
            for value in y.lines(minor) {
                line(svg, [left, y.place(value)], [right, y.place(value)], &stroke);
            }
        }
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"{INK}\"/>",
            right - left,
            bottom - top
        );
        for value in x.ticks() {
            text(svg, [x.place(value), bottom + 18.0], MIN_FONT, "middle", INK, &axis::label(value));
        }
        for value in y.ticks() {
            text(svg, [left - 6.0, y.place(value) + 5.0], MIN_FONT, "end", INK, &axis::label(value));
        }
        text(svg, [0.5 * (left + right), bottom + 40.0], 15.0, "middle", INK, &self.x.label);
        let _ = writeln!(
            svg,
            "<text transform=\"translate(18 {:.1}) rotate(-90)\" font-size=\"15\" text-anchor=\"middle\" \
             fill=\"{INK}\">{}</text>",
            0.5 * (top + bottom),
            escaped(&self.y.label)
        );
    }

    /// Two entries a row, or one if a name is long.
    fn legend_columns(&self) -> usize {
        const LONGEST_OF_TWO: usize = 24;
        if self.curves.iter().all(|curve| curve.name.chars().count() <= LONGEST_OF_TWO) { 2 } else { 1 }
    }

    fn legend_rows(&self) -> usize {
        self.curves.len().div_ceil(self.legend_columns())
    }

    fn legend(&self, svg: &mut String) {
        let columns = self.legend_columns();
        let top = FIELD[3] + AXIS_ROOM;
        for (index, curve) in self.curves.iter().enumerate() {
            let at = [
                24.0 + (index % columns) as f64 * 0.5 * (WIDTH - 24.0),
                top + 15.0 + (index / columns) as f64 * LINE_HEIGHT,
            ];
            curve.legend_entry(svg, at);
        }
        for (row, note) in self.notes.iter().enumerate() {
            let y = top + 15.0 + (self.legend_rows() + row) as f64 * LINE_HEIGHT;
            text(svg, [24.0, y], MIN_FONT, "start", "#444", note);
        }
    }
}

/// Several plots in one SVG file, `columns` side by side, with a white ground: for pages that show image files.
pub fn svg_file(plots: &[Plot], columns: usize) -> String {
    let columns = columns.clamp(1, plots.len().max(1));
    let mut body = String::new();
    let mut y = 0.0;
    for row in plots.chunks(columns) {
        for (column, plot) in row.iter().enumerate() {
            let _ = writeln!(
                body,
                "<g transform=\"translate({} {y})\" role=\"img\" aria-label=\"{}\">\n{}</g>",
                column as f64 * WIDTH,
                escaped(&format!("{}: {}", plot.title, plot.description)),
                plot.body()
            );
        }
        y += row.iter().map(Plot::height).fold(0.0, f64::max);
    }
    let width = columns as f64 * WIDTH;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {y}\" width=\"{width}\" height=\"{y}\" \
         font-family=\"system-ui, sans-serif\">\n<rect width=\"{width}\" height=\"{y}\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}
