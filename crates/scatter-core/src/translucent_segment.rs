//! What one translucent occluder does to one light ray: a stretch of it that takes some of the light.

/// Smoke between two depths of a light ray, or a hair at one.
///
/// Light that has crossed it keeps `exp(−optical_depth)`; inside of it the optical depth grows evenly with depth, which
/// along a light ray is evenly with distance. Several segments of one texel multiply, in any order and wherever they
/// overlap (MODEL.md, "Translucent occluders").
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TranslucentSegment {
    /// Where it begins: depth as a [`ShadowLayer`](crate::ShadowLayer)'s, linear along the light's axis, finite, ≥ 0.
    pub entry: f32,
    /// Where it ends, finite, ≥ `entry`; a hair has `exit == entry`.
    pub exit: f32,
    /// Optical depth of the whole of it along the light ray, ≥ 0; `+∞` lets nothing through.
    pub optical_depth: f32,
}

impl TranslucentSegment {
    /// Smoke of this extinction, ≥ 0, **per unit of depth** (in a perspective map: the extinction per unit of length times
    /// the length of the light ray's step for a unit of depth, [`MapProjection::light_ray`](crate::MapProjection::light_ray)).
    /// Nothing is checked; [`Self::is_sane`] and [`TranslucentLayer::new`](crate::TranslucentLayer::new) do.
    pub fn volume(entry: f32, exit: f32, extinction: f32) -> Self {
        // An infinitely dense sheet of no thickness is no occluder: 0·∞.
        let optical_depth = if exit > entry { extinction * (exit - entry) } else { 0.0 };
        Self { entry, exit, optical_depth }
    }

    /// A hair, a leaf or a pane at one depth that keeps `1 − opacity` of the light; `opacity` in [0, 1].
    /// Nothing is checked; [`Self::is_sane`] and [`TranslucentLayer::new`](crate::TranslucentLayer::new) do.
    pub fn hair(depth: f32, opacity: f32) -> Self {
        // ln_1p holds the digits of an opacity near 0. The sign of zero is cleared with + 0.
        Self { entry: depth, exit: depth, optical_depth: -(-opacity).ln_1p() + 0.0 }
    }

    /// Whether the depths are finite, in order and ≥ 0, and the optical depth ≥ 0 or +∞.
    pub fn is_sane(&self) -> bool {
        self.entry >= 0.0 && self.exit >= self.entry && self.exit.is_finite() && self.optical_depth >= 0.0
    }

    /// Optical depth of the part that lies before `depth`. At its own depth a hair dims nothing yet, as a surface is lit
    /// at its own depth.
    pub fn optical_depth_before(&self, depth: f64) -> f64 {
        let [entry, exit, whole] = [self.entry, self.exit, self.optical_depth].map(f64::from);
        if depth <= entry {
            0.0
        } else if depth >= exit {
            whole
        } else {
            whole * ((depth - entry) / (exit - entry))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoke_takes_its_share_evenly_and_hairs_all_at_once() {
        let smoke = TranslucentSegment::volume(2.0, 6.0, 0.25);
        assert!(smoke.is_sane());
        // A quarter of the way through a segment of optical depth 1.
        let before = [0.0, 2.0, 3.0, 6.0, 1e9].map(|depth| smoke.optical_depth_before(depth));
        assert_eq!(before, [0.0, 0.0, 0.25, 1.0, 1.0]);
        let hair = TranslucentSegment::hair(3.0, 0.75);
        assert_eq!(hair.optical_depth_before(3.0), 0.0);
        assert!((hair.optical_depth_before(3.0 + 1e-9) - 4f64.ln()).abs() < 1e-6);
    }

    #[test]
    fn extremes_have_a_meaning_and_nonsense_is_told() {
        assert_eq!(TranslucentSegment::hair(1.0, 1.0).optical_depth, f32::INFINITY);
        assert_eq!(TranslucentSegment::hair(1.0, 0.0).optical_depth.to_bits(), 0.0f32.to_bits());
        // −ln(1 − 1e-8) = 1e-8, where 1 − 1e-8 rounds to 1 in f32.
        assert_eq!(TranslucentSegment::hair(1.0, 1e-8).optical_depth, 1e-8);
        let dense = TranslucentSegment::volume(1.0, 2.0, f32::INFINITY);
        assert_eq!(
            [1.0, 1.5, 2.0].map(|d| dense.optical_depth_before(d)),
            [0.0, f64::INFINITY, f64::INFINITY]
        );
        assert_eq!(TranslucentSegment::volume(1.0, 1.0, f32::INFINITY).optical_depth, 0.0);
        let bad = [
            (-1.0, 1.0, 1.0),
            (2.0, 1.0, 1.0),
            (f32::NAN, 1.0, 1.0),
            (0.0, f32::INFINITY, 1.0),
            (0.0, 1.0, -1.0),
            (0.0, 1.0, f32::NAN),
        ];
        for (entry, exit, optical_depth) in bad {
            assert!(
                !TranslucentSegment { entry, exit, optical_depth }.is_sane(),
                "{entry} {exit} {optical_depth}"
            );
        }
        assert!(!TranslucentSegment::hair(1.0, 1.5).is_sane());
    }
}
