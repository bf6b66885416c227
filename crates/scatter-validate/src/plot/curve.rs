//! A curve with its markers: colour, dash and shape of its own.

use std::fmt::Write;

use super::axis::Scale;
use super::element::{escaped, points, text};

/// A named curve.
#[derive(Debug, Clone)]
pub struct Curve {
    /// What the legend calls it.
    pub name: String,
    /// What to beat: black and heavy, with the ground above it shaded.
    pub is_baseline: bool,
    /// Places that a line joins, in this order.
    pub line: Vec<[f64; 2]>,
    /// Places with a marker.
    pub points: Vec<Point>,
    /// Which colour, dash and shape: the same number looks the same in every plot.
    pub look: usize,
}

/// A marker.
#[derive(Debug, Clone)]
pub struct Point {
    /// Where.
    pub at: [f64; 2],
    /// What it is; shown where a pointer rests on it.
    pub name: String,
    /// How it looks.
    pub mark: Mark,
}

/// How a marker looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Filled.
    Full,
    /// An outline.
    Hollow,
    /// A small outline.
    Small,
}

/// Okabe and Ito's colours but for black, which is the baseline's, and yellow, which is invisible on white.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const DASHES: [&str; 5] = ["none", "9 4", "3 3", "12 3 3 3", "6 2 2 2 2 2"];
/// Corners of the shapes, a unit around the middle: square, triangle, diamond, triangle on its head, star, hourglass.
/// The baseline has a circle.
const SHAPES: [&[[f64; 2]]; 6] = [
    &[[-0.85, -0.85], [0.85, -0.85], [0.85, 0.85], [-0.85, 0.85]],
    &[[0.0, -1.15], [1.0, 0.75], [-1.0, 0.75]],
    &[[0.0, -1.2], [1.2, 0.0], [0.0, 1.2], [-1.2, 0.0]],
    &[[0.0, 1.15], [1.0, -0.75], [-1.0, -0.75]],
    &[[0.0, -1.3], [0.4, -0.4], [1.3, 0.0], [0.4, 0.4], [0.0, 1.3], [-0.4, 0.4], [-1.3, 0.0], [-0.4, -0.4]],
    &[[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]],
];

impl Curve {
    /// All places that must be on the plot.
    pub(super) fn coordinates(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let places = self.points.iter().map(|point| point.at).chain(self.line.iter().copied());
        places.filter(|place| is_on_plot(*place))
    }

    fn color(&self) -> &'static str {
        if self.is_baseline { "#000" } else { COLORS[self.look % COLORS.len()] }
    }

    /// Attributes of its line.
    fn stroke(&self) -> String {
        let (width, dash) =
            if self.is_baseline { (3.5, "none") } else { (2.2, DASHES[self.look % DASHES.len()]) };
        format!("stroke=\"{}\" stroke-width=\"{width}\" stroke-dasharray=\"{dash}\"", self.color())
    }

    /// Above the baseline nobody wants to be.
    pub(super) fn shade(&self, svg: &mut String, x: &Scale, y: &Scale, top: f64) {
        let places = self.places(x, y);
        if let (true, Some(&[first, _]), Some(&[last, _])) = (self.is_baseline, places.first(), places.last())
        {
            let corners: Vec<[f64; 2]> =
                [[first, top]].into_iter().chain(places.iter().copied()).chain([[last, top]]).collect();
            let _ = writeln!(svg, "<polygon points=\"{}\" fill=\"#f3f3f3\"/>", points(&corners));
        }
    }

    /// The line, then the markers.
    pub(super) fn draw(&self, svg: &mut String, x: &Scale, y: &Scale) {
        let places = self.places(x, y);
        if places.len() > 1 {
            let _ =
                writeln!(svg, "<polyline points=\"{}\" fill=\"none\" {}/>", points(&places), self.stroke());
        }
        for point in self.points.iter().filter(|point| is_on_plot(point.at)) {
            self.marker(svg, [x.place(point.at[0]), y.place(point.at[1])], point.mark, &point.name);
        }
    }

    /// A piece of line with a marker, and the name.
    pub(super) fn legend_entry(&self, svg: &mut String, [left, baseline]: [f64; 2]) {
        let y = baseline - 5.0;
        let piece = points(&[[left, y], [left + 34.0, y]]);
        let _ = writeln!(svg, "<polyline points=\"{piece}\" fill=\"none\" {}/>", self.stroke());
        self.marker(svg, [left + 17.0, y], Mark::Full, &self.name);
        text(svg, [left + 42.0, baseline], 15.0, "start", "#222", &self.name);
    }

    fn places(&self, x: &Scale, y: &Scale) -> Vec<[f64; 2]> {
        let places = self.line.iter().filter(|place| is_on_plot(**place));
        places.map(|place| [x.place(place[0]), y.place(place[1])]).collect()
    }

    fn marker(&self, svg: &mut String, [x, y]: [f64; 2], mark: Mark, name: &str) {
        let color = self.color();
        let (size, fill) = match mark {
            Mark::Full => (6.0, color),
            Mark::Hollow => (6.0, "#fff"),
            Mark::Small => (3.5, "#fff"),
        };
        let style = format!("fill=\"{fill}\" stroke=\"{color}\" stroke-width=\"1.6\"");
        let title = escaped(name);
        let _ = if self.is_baseline {
            writeln!(
                svg,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{size}\" {style}><title>{title}</title></circle>"
            )
        } else {
            let corners: Vec<[f64; 2]> = SHAPES[self.look % SHAPES.len()]
                .iter()
                .map(|[dx, dy]| [x + size * dx, y + size * dy])
                .collect();
            writeln!(svg, "<polygon points=\"{}\" {style}><title>{title}</title></polygon>", points(&corners))
        };
    }
}

/// A logarithm shows what is positive and finite.
fn is_on_plot(place: [f64; 2]) -> bool {
    place.iter().all(|&v| v > 0.0 && v.is_finite())
}
