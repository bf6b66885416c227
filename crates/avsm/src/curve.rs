//! What every transmittance curve does: take segments, then say how much light is left at a depth.

use scatter_core::TranslucentSegment;

/// Optical depth from which on nothing is left of the light: `e^{−10⁴}` is 0 in f64 too. Curves hold this in place of ∞,
/// so that no lookup subtracts infinities.
pub const OPAQUE: f32 = 1e4;

/// Optical depth from which on light is nothing in f32: `e^{−110}` is below its smallest number.
pub const DARK: f32 = 110.0;

/// How much of the light of one texel is left at a depth (Salvi et al. 2010, Eq. 1): `T(z) = exp(−τ(z))`, where `τ` grows by
/// each segment's optical depth as the light crosses it.
///
/// A point at the very depth of a hair or of an opaque surface is before it, as in a shadow map (lit if and only if depth ≤
/// the stored one). Segments come in any order. Such with an optical depth of 0, or whose numbers are not finite (but for
/// an optical depth of ∞), change nothing; of a reversed one the ends are exchanged.
pub trait TransmittanceCurve {
    /// How τ runs between two neighbouring knots of [`Self::visit`].
    const BETWEEN: Between = Between::Exponential;

    /// Puts a segment into the curve: the product of both transmittances.
    fn insert(&mut self, segment: &TranslucentSegment);

    /// Ends a series of insertions, for curves that need all segments before they compress. Lookups without it are right and
    /// slow.
    fn finish(&mut self) {}

    /// `τ` at a depth, 0 to [`OPAQUE`].
    fn optical_depth(&self, depth: f64) -> f64;

    /// `T = e^{−τ}` at a depth, 0 to 1.
    fn transmittance(&self, depth: f64) -> f64 {
        (-self.optical_depth(depth)).exp()
    }

    /// A depth up to which nothing is dimmed; `+∞` of an empty curve.
    fn first_depth(&self) -> f32;

    /// A depth behind which [`DARK`] is passed; `+∞` of a curve that does not say.
    fn dark_depth(&self) -> f32 {
        f32::INFINITY
    }

    /// Calls `each(depth, τ)` for `from`, every knot of the curve between, and `to`, in the order of their depths; `from` <
    /// `to`. A step gives two knots of one depth.
    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64));
}

/// How a curve runs between two knots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Between {
    /// Extinction is constant: τ is linear. What a homogeneous segment really does.
    #[default]
    Exponential,
    /// T is linear: cheaper to look up, and how the paper computes areas (Section 3.2.1).
    Linear,
}

/// The depths between which a texel's light is dimmed: for curves that divide a range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthRange {
    /// Nearest entry.
    pub near: f32,
    /// Farthest exit, ≥ `near`.
    pub far: f32,
}

impl DepthRange {
    /// Of no segments.
    pub const EMPTY: Self = Self { near: f32::INFINITY, far: f32::NEG_INFINITY };

    /// The range that contains the segment too.
    pub fn with(self, segment: &TranslucentSegment) -> Self {
        let [a, b] = [segment.entry, segment.exit];
        Self { near: self.near.min(a.min(b)), far: self.far.max(a.max(b)) }
    }

    /// The range that contains both.
    pub fn union(self, other: Self) -> Self {
        Self { near: self.near.min(other.near), far: self.far.max(other.far) }
    }

    /// Of segments.
    pub fn of<'a>(segments: impl IntoIterator<Item = &'a TranslucentSegment>) -> Self {
        segments.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// Where a depth lies in it: 0 at `near`, 1 at `far`, beyond them outside of that; a range without length has 0 up to
    /// its depth and 1 beyond it.
    pub fn share(&self, depth: f64) -> f64 {
        let [near, far] = [self.near, self.far].map(f64::from);
        if far > near { (depth - near) / (far - near) } else { f64::from(depth > near) }
    }

    /// `far − near`, 0 of an empty one.
    pub fn length(&self) -> f64 {
        (f64::from(self.far) - f64::from(self.near)).max(0.0)
    }
}

/// A segment as curves take it: entry ≤ exit, finite, 0 < τ ≤ [`OPAQUE`], an opaque one without length. `None` of one that
/// changes nothing.
pub(crate) fn normalised(segment: &TranslucentSegment) -> Option<TranslucentSegment> {
    let TranslucentSegment { entry, exit, optical_depth } = *segment;
    if !(optical_depth > 0.0) || !entry.is_finite() || !exit.is_finite() {
        return None;
    }
    let (entry, exit) = (entry.min(exit), entry.max(exit));
    // Light that infinite extinction takes ends where it enters.
    let exit = if optical_depth >= OPAQUE { entry } else { exit };
    Some(TranslucentSegment { entry, exit, optical_depth: optical_depth.min(OPAQUE) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_divides_what_lies_in_it() {
        let range =
            DepthRange::of(&[TranslucentSegment::hair(3.0, 0.5), TranslucentSegment::volume(7.0, 5.0, 0.1)]);
        assert_eq!(range, DepthRange { near: 3.0, far: 7.0 });
        assert_eq!([2.0, 3.0, 5.0, 7.0].map(|z| range.share(z)), [-0.25, 0.0, 0.5, 1.0]);
        let point = DepthRange { near: 3.0, far: 3.0 };
        assert_eq!([3.0, 3.1].map(|z| point.share(z)), [0.0, 1.0]);
        assert_eq!(DepthRange::EMPTY.length(), 0.0);
    }

    #[test]
    fn degenerate_segments_are_put_right_or_left_out() {
        let segment = |entry, exit, optical_depth| TranslucentSegment { entry, exit, optical_depth };
        assert_eq!(normalised(&segment(2.0, 1.0, 0.5)), Some(segment(1.0, 2.0, 0.5)));
        assert_eq!(normalised(&segment(1.0, 2.0, f32::INFINITY)), Some(segment(1.0, 1.0, OPAQUE)));
        for nothing in [
            segment(1.0, 2.0, 0.0),
            segment(1.0, 2.0, f32::NAN),
            segment(f32::NAN, 2.0, 1.0),
            segment(1.0, f32::INFINITY, 1.0),
        ] {
            assert_eq!(normalised(&nothing), None, "{nothing:?}");
        }
    }
}
