//! An angle without an arc tangent: the place of a direction on a diamond instead of on a circle.

use glam::DVec2;

/// The diamond angle of a direction with `across` ≥ 0: from 0 (`towards` alone) over 1 (`across` alone) to 2 (away).
///
/// It grows with the angle, is exact in its order and smooth, and small angles keep all their digits. It orders the light
/// rays of a lamp in a slice: towards the eye first.
#[inline(always)]
pub fn diamond_angle(towards: f32, across: f32) -> f32 {
    let size = (towards.abs() + across).max(f32::MIN_POSITIVE);
    let part = across / size;
    if towards >= 0.0 { part } else { 2.0 - part }
}

/// The direction `[towards, across]` with that [`diamond_angle`], not normalised.
pub fn direction_of_diamond_angle(angle: f64) -> DVec2 {
    DVec2::new(1.0 - angle, angle.min(2.0 - angle).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diamond_angles_grow_with_the_angle_and_give_their_direction_back() {
        let mut before = -1.0f32;
        for step in 0..=1000 {
            let angle = std::f64::consts::PI * f64::from(step) / 1000.0;
            let (across, towards) = angle.sin_cos();
            let diamond = diamond_angle(towards as f32, across.max(0.0) as f32);
            assert!(diamond > before, "{angle}");
            before = diamond;
            let back = direction_of_diamond_angle(diamond.into());
            // A quotient in f32, near 2 with an ulp of 2.4e-7.
            assert!((back.y.atan2(back.x) - angle).abs() < 1e-6, "{angle}");
        }
    }
}
