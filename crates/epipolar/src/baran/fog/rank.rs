//! What a factorisation of height fog would take: why there is none. Measured, not used.
//!
//! `A(γ, β) = 1 − e^{−τ}` at the Chebyshev nodes of a band, `Bₖ` the Lagrange polynomials: the share of a view ray is a quotient
//! of two sums with the same factors, as a uniform medium's is. With `w = ln tan(β/2)`, `1/sin β = cosh w` and
//! `cot β = −sinh w` are entire, so that nothing but the fog limits the rank; each node's A is divided by its value at the end
//! of the band, which is the best of the scalings that were tried.

use std::f64::consts::PI;

/// A fog as a slice sees it: `ln σt·ρ(eye)`, and the slopes across and towards the light; rays reach as far as `length`.
struct Fog {
    ln_extinction: f64,
    across: f64,
    to_light: f64,
    length: f64,
}

impl Fog {
    fn absorbed(&self, gamma: f64, w: f64) -> f64 {
        let s = (self.across - self.to_light * w.sinh()) * gamma;
        let phi = if s.abs() < 1e-8 { 1.0 } else { -(-s.abs()).exp_m1() / s.abs() };
        -(-gamma * w.cosh() * (self.ln_extinction + (-s).max(0.0)).exp() * phi).exp_m1()
    }

    /// The error of a share at the worst visibility, over the rays of the band `[from, to]` of w, with `rank` nodes.
    fn worst(&self, [from, to]: [f64; 2], rank: usize) -> f64 {
        const PIECES: usize = 400;
        let end = self.length / from.cosh().max(to.cosh());
        let gamma = |i: usize| {
            let u = i as f64 / PIECES as f64;
            end * (0.2 * u + 0.8 * u * u * u)
        };
        let w = |z: f64| 0.5 * (from + to) + 0.5 * (to - from) * z;
        let nodes: Vec<f64> = (0..rank).map(|k| ((k as f64 + 0.5) * PI / rank as f64).cos()).collect();
        let tables: Vec<Vec<f64>> = nodes
            .iter()
            .map(|&z| {
                (0..=PIECES).map(|i| self.absorbed(gamma(i), w(z)) / self.absorbed(end, w(z))).collect()
            })
            .collect();
        let mut worst = 0.0f64;
        for step in 0..=16 {
            let z = f64::from(step) / 8.0 - 1.0;
            let weight = |k: usize| -> f64 {
                (0..rank).filter(|&j| j != k).map(|j| (z - nodes[j]) / (nodes[k] - nodes[j])).product()
            };
            let weights: Vec<f64> = (0..rank).map(weight).collect();
            let sums: Vec<f64> =
                (0..=PIECES).map(|i| (0..rank).map(|k| weights[k] * tables[k][i]).sum()).collect();
            let exact: Vec<f64> = (0..=PIECES).map(|i| self.absorbed(gamma(i), w(z))).collect();
            for last in [20, 80, 200, 300, PIECES] {
                // Lit exactly where the factors see more of the whole than there is.
                let excess =
                    |i: usize| (sums[i + 1] - sums[i]) / sums[last] - (exact[i + 1] - exact[i]) / exact[last];
                worst = worst.max((0..last).map(|i| excess(i).max(0.0)).sum());
            }
        }
        worst
    }
}

#[test]
fn the_rank_of_fog_is_not_bounded_as_that_of_a_uniform_medium_is() {
    /// What film allows its factors.
    const FILM: f64 = 2e-3;
    /// From 30° to 55° of the light, to 90°, and on the far side: bands of about an octave's work each.
    const BANDS: [[f64; 2]; 3] = [[-1.3, -0.65], [-0.65, 0.0], [0.65, 1.3]];
    let (elevation, azimuth) = (60f64.to_radians(), -0.5);
    let fogs = [
        ("uniform", 0.05f64.ln(), 1e6, 40.0),
        ("a haze over hills, 500 m", 0.05f64.ln(), 50.0, 40.0),
        ("mist in a room, 0.75 m", 0.065f64.ln(), 0.75, 4.0),
        ("thick mist in a room", 0.5f64.ln(), 0.75, 4.0),
        ("a floor's fog, 14 heights below", -14.0, 1.0, 30.0),
    ];
    let mut ranks = Vec::new();
    for (name, ln_extinction, scale, length) in fogs {
        let fog = Fog {
            ln_extinction,
            across: azimuth * elevation.cos() / scale,
            to_light: elevation.sin() / scale,
            length,
        };
        let needed = BANDS.map(|band| (1..=24).find(|&rank| fog.worst(band, rank) <= FILM));
        println!("{name}: ranks {needed:?} for {FILM} in the bands {BANDS:?} of ln tan(β/2)");
        ranks.push(needed.into_iter().map(|rank| rank.unwrap_or(99)).max().unwrap());
    }
    // A uniform medium keeps to its rank; fog far below the eye asks for more than any sum pays for.
    assert!(ranks[0] <= 4 && ranks[4] > 8, "{ranks:?}");
}
