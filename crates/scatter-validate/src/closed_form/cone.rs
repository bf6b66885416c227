//! The spot cone of KHR_lights_punctual, and where a view ray enters and leaves its parts.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// A cone: full strength within `inner`, none beyond `outer`.
#[derive(Debug, Clone, Copy)]
pub struct Cone {
    /// Unit direction of the axis, away from the lamp.
    pub axis: DVec3,
    /// Half angle of full strength \[radians\].
    pub inner: f64,
    /// Half angle from which on nothing is lit \[radians\].
    pub outer: f64,
}

impl Cone {
    /// `saturate((cos − cos outer)·s)²` with `s = 1/max(0.001, cos inner − cos outer)`.
    pub(super) fn factor(&self, cos_axis: f64) -> f64 {
        let width = (self.inner.cos() - self.outer.cos()).max(0.001);
        let linear = ((cos_axis - self.outer.cos()) / width).clamp(0.0, 1.0);
        linear * linear
    }

    /// Angles at the lamp, within (−π/2, π/2), at which a ray crosses the rim of the cone or of its full part.
    ///
    /// The cosine to the axis along a ray is `A·cos(u − φ)`: `along` = A·sin φ is the axis' share along the ray,
    /// `across` = A·cos φ that towards the foot of the perpendicular.
    pub(super) fn crossings(&self, along: f64, across: f64) -> Vec<f64> {
        let width = (self.inner.cos() - self.outer.cos()).max(0.001);
        let (amplitude, phi) = (along.hypot(across), along.atan2(across));
        let mut angles = Vec::new();
        for cos in [self.outer.cos(), self.outer.cos() + width] {
            if cos.abs() < amplitude {
                let half = (cos / amplitude).acos();
                for angle in [phi - half, phi + half] {
                    let wrapped = (angle + PI).rem_euclid(TAU) - PI;
                    angles.push(wrapped);
                }
            }
        }
        angles.retain(|u| u.abs() < 0.5 * PI);
        angles.sort_by(f64::total_cmp);
        angles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_in_the_cosine_is_a_quarter_of_the_strength() {
        let cone = Cone { axis: DVec3::NEG_Y, inner: 0.3, outer: 0.7 };
        let middle = 0.5 * (0.3f64.cos() + 0.7f64.cos());
        assert!((cone.factor(middle) - 0.25).abs() < 1e-14);
        assert_eq!((cone.factor(1.0), cone.factor(0.7f64.cos())), (1.0, 0.0));
    }

    #[test]
    fn crossings_lie_on_the_rims() {
        let cone = Cone { axis: DVec3::NEG_Y, inner: 0.3, outer: 0.7 };
        let (along, across) = (0.2, 0.97);
        let angles = cone.crossings(along, across);
        assert_eq!(angles.len(), 4);
        for u in angles {
            let cos = along * u.sin() + across * u.cos();
            let gap = (cos - 0.7f64.cos()).abs().min((cos - 0.3f64.cos()).abs());
            assert!(gap < 1e-14, "{u}: {cos}");
        }
    }
}
