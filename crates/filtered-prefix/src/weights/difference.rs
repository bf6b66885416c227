//! How far a pixel's weights and those that a row was filtered with can be apart: half the L1 distance of the two normalised
//! densities, from above.
//!
//! Visibility lies in [0, 1], so this is the largest error that wrong weights make of a pixel's lit share, whatever the row
//! holds.

/// Largest half L1 distance of two densities whose ratio stays within a factor of `e^range`: tanh(range/4), from above.
///
/// Among all such pairs the ratio takes its two extremes, √R and 1/√R, on masses that keep both normalised, and the distance is
/// (√R − 1)/(√R + 1).
#[inline(always)]
pub fn of_log_range(range: f32) -> f32 {
    let quarter = 0.25 * range;
    if quarter < 1.0 { quarter } else { 1.0 }
}

/// Half the L1 distance of the transmittance weights `τe^{−τv}/(1−e^{−τ})` on [0, 1] from even ones, from above: τ/8.
///
/// The distance is F(τ, v) − v at its maximum, F(τ, v) = (1−e^{−τv})/(1−e^{−τ}), and ∂F/∂τ ≤ 1/8 (attained at τ = 0, v = ½).
#[inline(always)]
pub fn from_even(optical_depth: f32) -> f32 {
    let eighth = 0.125 * optical_depth;
    if eighth < 1.0 { eighth } else { 1.0 }
}

/// Of the transmittance weights of optical depth τ from the mixture of those of `near` ≤ τ ≤ `far` that is linear in τ.
///
/// The remainder of a linear interpolation is ½·(τ−near)·(far−τ)·∂²w/∂τ², half the L1 norm of the second derivative is at most
/// [`CURVED`] at τ = 0 and falls as 1/τ² (test `blended_weights_keep_their_bound`).
#[inline(always)]
pub fn of_blend(optical_depth: f32, near: f32, far: f32) -> f32 {
    let product = 0.5 * (optical_depth - near) * (far - optical_depth);
    let product = if product > 0.0 { product } else { 0.0 };
    let curved = CURVED / (1.0 + near * near * (CURVED / FALLS));
    let bound = product * curved;
    // Numbers that are not any bound nothing.
    if bound < 1.0 { bound } else { 1.0 }
}

/// Largest difference of the same blend from the pixel's weights, of the blend itself: what it is off by of a pixel's lit share,
/// relative to that share; however dark the pixel is.
///
/// `∂²w/∂τ² = w·((m − v)² − s²)` with mean m and variance s² of w, of which the factor is at most 1/6 + 0.105·τ and 1; within a band
/// w changes by less than its exponential.
#[inline(always)]
pub fn of_blend_relative(optical_depth: f32, near: f32, far: f32) -> f32 {
    let apart = far - near;
    let product = 0.5 * (optical_depth - near) * (far - optical_depth);
    let product = if product > 0.0 { product } else { 0.0 };
    let curved = 1.0 / 6.0 + 0.105 * far;
    let curved = if curved < 1.0 { curved } else { 1.0 };
    let bound = product * curved * (1.0 + apart + apart * apart);
    if apart < 1.5 { bound } else { f32::INFINITY }
}

/// The same of densities whose ratio stays within a factor of `e^range`: `e^range − 1`, from above.
#[inline(always)]
pub fn of_log_range_relative(range: f32) -> f32 {
    let bound = range * (1.0 + range);
    if range < 1.0 { bound } else { f32::INFINITY }
}

/// The same of even weights: at the eye transmittance weights are `τ/(1 − e^{−τ})` ≤ 1 + τ/2 + τ²/12 times as large.
#[inline(always)]
pub fn from_even_relative(optical_depth: f32) -> f32 {
    let bound = optical_depth * (0.5 + optical_depth * (1.0 / 12.0));
    if optical_depth < 2.0 { bound } else { f32::INFINITY }
}

/// Half of ∫|∂²w/∂τ²|dv at τ = 0: the polynomial v² − v + 1/6 over [0, 1] has the L1 norm 0.0642.
const CURVED: f32 = 0.0325;

/// Times 1/τ² the same where τ is large.
const FALLS: f32 = 1.1;

#[cfg(test)]
mod tests {
    use super::*;

    fn weight(depth: f64, v: f64) -> f64 {
        if depth < 1e-6 { 1.0 } else { depth * (-depth * v).exp() / -(-depth).exp_m1() }
    }

    /// Half the L1 distance of two densities on [0, 1], by the midpoint rule.
    fn distance(a: impl Fn(f64) -> f64, b: impl Fn(f64) -> f64) -> f64 {
        const STEPS: u32 = 4000;
        let middle = |step: u32| (f64::from(step) + 0.5) / f64::from(STEPS);
        0.5 * (0..STEPS).map(|step| (a(middle(step)) - b(middle(step))).abs()).sum::<f64>() / f64::from(STEPS)
    }

    #[test]
    fn even_weights_keep_their_bound() {
        for depth in [1e-3, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0] {
            let exact = distance(|v| weight(depth, v), |_| 1.0);
            let bound = f64::from(from_even(depth as f32));
            println!("{depth}: {exact:.5} of {bound:.5}");
            assert!(exact <= bound + 1e-6 && (depth > 1.0 || exact > 0.95 * bound));
        }
    }

    #[test]
    fn blended_weights_keep_their_bound() {
        let mut nearest = 0.0f64;
        for near in [0.0, 0.01, 0.3, 1.0, 2.0, 4.0, 8.0, 20.0] {
            for apart in [0.05, 0.2, 1.0, 3.0, 10.0] {
                let far = near + apart;
                for part in [0.1, 0.3, 0.5, 0.7, 0.9] {
                    let depth = near + part * apart;
                    let blend = |v: f64| (1.0 - part) * weight(near, v) + part * weight(far, v);
                    let exact = distance(|v| weight(depth, v), blend);
                    let bound = f64::from(of_blend(depth as f32, near as f32, far as f32));
                    assert!(exact <= bound + 2e-6, "{near} {far} {part}: {exact} of {bound}");
                    nearest = nearest.max(exact / bound);
                }
            }
        }
        println!("at most {nearest:.3} of the bound");
        assert!(nearest > 0.8);
    }

    #[test]
    fn relative_bounds_hold_at_every_place() {
        let mut nearest = 0.0f64;
        for near in [0.0, 0.01, 0.3, 1.0, 2.0, 4.0, 8.0] {
            for apart in [0.02, 0.1, 0.3, 1.0] {
                for part in [0.1, 0.5, 0.9] {
                    let (far, depth) = (near + apart, near + part * apart);
                    let bound = f64::from(of_blend_relative(depth as f32, near as f32, far as f32));
                    for step in 0..=100 {
                        let v = f64::from(step) / 100.0;
                        let blend = (1.0 - part) * weight(near, v) + part * weight(far, v);
                        let own = (weight(depth, v) / blend - 1.0).abs();
                        assert!(own <= bound + 1e-7, "{near} {far} {part} {v}: {own} of {bound}");
                        nearest = nearest.max(own / (bound + 1e-6));
                    }
                }
            }
        }
        println!("at most {nearest:.3} of the bound");
        assert!(nearest > 0.7);
        for depth in [0.01, 0.3, 1.0, 1.9] {
            let bound = f64::from(from_even_relative(depth as f32));
            for v in [0.0, 0.3, 0.7, 1.0] {
                assert!((weight(depth, v) - 1.0).abs() <= bound + 1e-6);
            }
            assert!(depth.exp_m1() <= f64::from(of_log_range_relative(depth as f32)) + 1e-6);
        }
    }

    #[test]
    fn densities_within_a_ratio_keep_their_bound() {
        // The worst pair of a ratio R: √R on a mass of 1/(1+√R), 1/√R on the rest.
        for range in [0.01f32, 0.3, 1.0, 3.0] {
            let root = f64::from(0.5 * range).exp();
            let part = 1.0 / (1.0 + root);
            let worst = distance(|_| 1.0, |v| if v < part { root } else { 1.0 / root });
            let bound = f64::from(of_log_range(range));
            println!("{range}: {worst:.5} of {bound:.5}");
            assert!(worst <= bound + 1e-3);
        }
    }
}
