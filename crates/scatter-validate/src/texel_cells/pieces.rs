//! Lit pieces of a ray and what smoke and hair do to their light: cut wherever a segment of a texel begins or ends.

use scatter_core::TranslucentSegment;

/// A part of a ray, `start < end`.
pub(super) type Span = (f64, f64);

/// A piece of a ray with the colour of its light and the optical depths of what dims it.
pub(super) struct Piece {
    pub(super) span: Span,
    pub(super) colour: [f32; 3],
    /// At both ends, linear between.
    pub(super) depths: [f64; 2],
}

impl Piece {
    /// A lit piece that nothing dims.
    pub(super) fn clear((span, colour): (Span, [f32; 3])) -> Self {
        Self { span, colour, depths: [0.0; 2] }
    }

    /// The part of it in `span`.
    pub(super) fn cut(&self, span: Span, colour: [f32; 3]) -> Self {
        let [a, b] = self.depths;
        let at = |t: f64| a + (b - a) * ((t - self.span.0) / (self.span.1 - self.span.0)).clamp(0.0, 1.0);
        let depths = if a == b { [a; 2] } else { [at(span.0), at(span.1)] };
        Self { span, colour, depths }
    }
}

/// The parts of a ray within one texel, cut where a segment begins or ends: in each the optical depth is linear.
pub(super) fn parts(segments: &[TranslucentSegment], depth: [f64; 2], (from, to): Span) -> Vec<Piece> {
    // Optical depth before the ray parameter t, of which the segments' ends are seen from `side`.
    let taken = |t: f64, side: f64| {
        let (at, inner) = (depth[0] + depth[1] * t, depth[0] + depth[1] * side);
        let of = |segment: &TranslucentSegment| {
            let [entry, exit, whole] = [segment.entry, segment.exit, segment.optical_depth].map(f64::from);
            if inner <= entry {
                0.0
            } else if inner >= exit || whole == f64::INFINITY {
                whole
            } else {
                whole * ((at - entry) / (exit - entry)).clamp(0.0, 1.0)
            }
        };
        segments.iter().map(of).sum::<f64>()
    };
    let ends = segments.iter().flat_map(|segment| [segment.entry, segment.exit]);
    let mut cuts: Vec<f64> = ends.map(|end| (f64::from(end) - depth[0]) / depth[1]).collect();
    cuts.retain(|cut| *cut > from && *cut < to);
    cuts.extend([from, to]);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup();
    cuts.windows(2)
        .map(|pair| {
            let [a, b] = [pair[0], pair[1]];
            // Beyond the last cut nothing changes.
            let is_last = !b.is_finite();
            let side = if is_last { 2.0 * a + 1.0 } else { 0.5 * (a + b) };
            let depths = [a, if is_last { side } else { b }].map(|t| taken(t, side));
            Piece { span: (a, b), colour: [1.0; 3], depths: if is_last { [depths[1]; 2] } else { depths } }
        })
        .collect()
}
