//! Airlight by the table of Sun, Ramamoorthi, Narasimhan and Nayar 2005: one function of two numbers, looked up at both ends.
//!
//! ```text
//!     ∫ₐᵇ e^{−σ(t+d)}/d² dt = e^{−σt₀}·(2/h)·[F(σh, ξ_b) − F(σh, ξ_a)]      F(u, v) = ∫₀ᵛ e^{−u·tan ξ} dξ      tan ξ = p/h
//! ```
//!
//! (their Eq. 10; t₀ where the ray is closest to the lamp, h that distance, p = (t − t₀) + d). f32, as a GPU has it. A difference of two
//! looked-up numbers: what cancels is lost, most of all far before the lamp and behind it; F is as u·ln u where u is small, so even steps
//! of u converge as their length does; and beyond the table's last u nothing is known. The README has the measured errors.

use std::f32::consts::FRAC_PI_2;

use scatter_core::LampRay;

/// The table.
#[derive(Debug, Clone)]
pub struct SunTable {
    /// `[u][v]`, u from 0 to `u_max`, v from 0 to π/2, both ends included.
    values: Vec<f32>,
    side: usize,
    u_max: f32,
}

impl SunTable {
    /// With `side` ≥ 2 entries along both axes, for σh up to `u_max` > 0: 64 and 10 are the paper's. O(side²).
    pub fn new(side: usize, u_max: f32) -> Self {
        let side = side.max(2);
        let step = f64::from(FRAC_PI_2) / (side - 1) as f64;
        let mut values = Vec::with_capacity(side * side);
        for row in 0..side {
            let u = f64::from(u_max) * row as f64 / (side - 1) as f64;
            let mut sum = 0.0;
            values.push(0.0);
            for column in 1..side {
                sum += cell(u, step * (column - 1) as f64, step * column as f64);
                values.push(sum as f32);
            }
        }
        Self { values, side, u_max }
    }

    /// Bilinear; u beyond the table is taken at its end.
    #[inline(always)]
    pub fn lookup(&self, u: f32, v: f32) -> f32 {
        let last = (self.side - 1) as f32;
        let (x, y) = ((v * (last / FRAC_PI_2)).clamp(0.0, last), (u * (last / self.u_max)).clamp(0.0, last));
        let (i, j) = ((x as usize).min(self.side - 2), (y as usize).min(self.side - 2));
        let (right, below) = (x - i as f32, y - j as f32);
        let at = |i: usize, j: usize| self.values[j * self.side + i];
        let upper = at(i, j) + (at(i + 1, j) - at(i, j)) * right;
        let lower = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * right;
        upper + (lower - upper) * below
    }

    /// `∫ₐᵇ exp(−σ(t+d))/d² dt`, 0 ≤ a ≤ b ≤ ∞.
    #[inline(always)]
    pub fn airlight(&self, sigma: f32, lamp: LampRay, a: f32, b: f32) -> f32 {
        let (t0, h) = (lamp.closest as f32, lamp.distance as f32);
        let angle =
            |t: f32| if t == f32::INFINITY { FRAC_PI_2 } else { 0.5 * (FRAC_PI_2 + ((t - t0) / h).atan()) };
        let u = sigma * h;
        let difference = self.lookup(u, angle(b)) - self.lookup(u, angle(a));
        (-sigma * t0).exp() * (2.0 / h) * difference.max(0.0)
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        (self.values.capacity() * size_of::<f32>()) as u64
    }
}

/// `∫ e^{−u·tan ξ} dξ` of a cell: Simpson's rule over 32 pieces, 1e-9 of it at u = 10.
fn cell(u: f64, from: f64, to: f64) -> f64 {
    const PIECES: u32 = 32;
    let step = (to - from) / f64::from(2 * PIECES);
    let value = |n: u32| {
        let xi = from + step * f64::from(n);
        // At π/2 the tangent is infinite, and the exponential 0 but for u = 0.
        if u == 0.0 { 1.0 } else { (-u * xi.tan().max(0.0)).exp() }
    };
    let weight = |n: u32| if n == 0 || n == 2 * PIECES { 1.0 } else { f64::from(2 + 2 * (n % 2)) };
    (0..=2 * PIECES).map(|n| weight(n) * value(n)).sum::<f64>() * step / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::airlight;

    #[test]
    fn it_nears_the_integral_as_the_table_grows() {
        let mut errors = Vec::new();
        for side in [32, 64, 128, 256] {
            let table = SunTable::new(side, 10.0);
            // As F near u = 0 is as u·ln u, linear interpolation over a step h of u is off by h/e there; over a step of v by a quarter
            // of it, as the slope lies between 0 and 1. Two lookups.
            let steps = [10.0, f64::from(FRAC_PI_2)].map(|range| range / (side - 1) as f64);
            let bound = 2.0 * (steps[0] / std::f64::consts::E + 0.25 * steps[1]);
            let mut worst = 0.0f64;
            for n in 0..200u32 {
                let share = f64::from(n) / 200.0;
                let lamp =
                    LampRay { closest: 1.0 + 8.0 * share, distance: 0.3 + 3.0 * (7.0 * share).fract() };
                let sigma = 0.02 + 0.3 * (11.0 * share).fract();
                let exact = airlight(sigma, lamp, 0.0, 20.0);
                let off = f64::from(table.airlight(sigma as f32, lamp, 0.0, 20.0)) - exact;
                let off_in_table = off.abs() * 0.5 * lamp.distance * (sigma * lamp.closest).exp();
                assert!(off_in_table <= bound, "{side}: {off_in_table} of {bound}");
                worst = worst.max(off_in_table / bound);
                errors.push(off.abs() / exact);
            }
            println!("{side}²: {worst:.2} of the bound");
        }
        let worst_of = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
        let worst: Vec<f64> = errors.chunks(200).map(worst_of).collect();
        println!("worst relative errors {worst:?}");
        assert!(worst.is_sorted_by(|a, b| a > b), "{worst:?}");
    }
}
