use glam::DVec3;
use scatter_core::{LampIntegral, LampRay, Medium, Phase};

use super::*;

const PHASES: [(&str, Phase); 8] = [
    ("isotropic", Phase::Isotropic),
    ("Rayleigh", Phase::Rayleigh),
    ("g 0.5", Phase::HenyeyGreenstein { g: 0.5 }),
    ("g 0.9", Phase::HenyeyGreenstein { g: 0.9 }),
    ("g 0.99", Phase::HenyeyGreenstein { g: 0.99 }),
    ("g -0.5", Phase::HenyeyGreenstein { g: -0.5 }),
    ("g -0.9", Phase::HenyeyGreenstein { g: -0.9 }),
    ("g -0.99", Phase::HenyeyGreenstein { g: -0.99 }),
];
const DEPTHS: [f64; 5] = [1e-6, 0.1, 1.0, 4.0, 30.0];
/// Distance from eye to lamp: not 1, so that nothing is right by chance.
const LENGTH: f64 = 2.5;

/// `∫Γₖ` from 0 to g over the table as it is interpolated, the way a slice without cone sums it.
struct Prefix<'a> {
    factors: &'a LampFactors,
    sums: Vec<[f64; MAX_RANK]>,
}

impl<'a> Prefix<'a> {
    fn new(factors: &'a LampFactors) -> Self {
        let nodes: Vec<&[f32]> = factors.gamma().chunks_exact(factors.lanes()).collect();
        let step = PI / (nodes.len() - 1) as f64;
        let mut sums = vec![[0.0; MAX_RANK]];
        for pair in nodes.windows(2) {
            let mut next = *sums.last().unwrap();
            for k in 0..factors.rank() {
                next[k] += 0.5 * step * (f64::from(pair[0][k]) + f64::from(pair[1][k]));
            }
            sums.push(next);
        }
        Self { factors, sums }
    }

    fn at(&self, g: f64) -> [f64; MAX_RANK] {
        let step = PI / (self.sums.len() - 1) as f64;
        let node = ((g / step) as usize).min(self.sums.len() - 2);
        let (mut left, mut right) = ([0.0; MAX_RANK], [0.0; MAX_RANK]);
        let start = node as f64 * step;
        self.factors.gamma_at(start as f32, &mut left);
        self.factors.gamma_at(g as f32, &mut right);
        let mut sum = self.sums[node];
        for k in 0..self.factors.rank() {
            sum[k] += 0.5 * (g - start) * (f64::from(left[k]) + f64::from(right[k]));
        }
        sum
    }
}

/// The error of vis for the worst visibility of a ray at `b` that ends at `length`, against the exact airlight integral.
fn worst_error(bands: &LampBands, prefixes: &[Prefix<'_>], medium: &Medium, b: f64, length: f64) -> f64 {
    const PIECES: usize = 400;
    let direction = DVec3::new(b.sin(), 0.0, b.cos());
    let ray = LampRay::new(DVec3::ZERO, direction, DVec3::new(0.0, 0.0, LENGTH), 0.0);
    let exact = LampIntegral::point(ray, medium);
    let band = bands.band_of(b);
    let weights = bands.bands()[band].weights_at(b as f32);
    let angle = |t: f64| (t * b.sin()).atan2(LENGTH - t * b.cos());
    let fitted = |t: f64| -> f64 {
        prefixes[band].at(angle(t)).iter().zip(weights).map(|(p, w)| p * f64::from(w)).sum()
    };
    // Uniform in the angle at the lamp where it turns fast, in t elsewhere: half of the pieces each.
    let mut ends: Vec<f64> = (0..=PIECES / 2)
        .flat_map(|i| {
            let share = i as f64 / (PIECES / 2) as f64;
            let g = angle(length) * share;
            [length * share, (LENGTH * g.sin() / (b + g).sin()).clamp(0.0, length)]
        })
        .collect();
    ends.sort_by(f64::total_cmp);
    let pieces: Vec<(f64, f64)> =
        ends.windows(2).map(|t| (exact.interval(t[0], t[1]).x, fitted(t[1]) - fitted(t[0]))).collect();
    let (e, f) = pieces.iter().fold((0.0, 0.0), |sum, piece| (sum.0 + piece.0, sum.1 + piece.1));
    pieces.iter().map(|piece| (piece.1 / f - piece.0 / e).max(0.0)).sum()
}

/// Bands for a phase function and their worst error over rays between `b_min` and `b_max`.
fn measured(
    phase: Phase,
    depth: f64,
    reach: f64,
    (b_min, b_max): (f64, f64),
    rank: usize,
    error: f64,
) -> (LampBands, f64) {
    let medium = Medium::homogeneous([1.0; 3], [0.0; 3], phase).unwrap();
    let scattering = |h: f64| medium.scattering_towards(h).x;
    let bands = LampBands::new(
        &LampMedium { optical_depth: depth, reach, phase: &scattering },
        b_min,
        b_max,
        rank,
        error,
    );
    let prefixes: Vec<Prefix<'_>> = bands.bands().iter().map(Prefix::new).collect();
    // The same phase function, with the extinction that makes σL the depth.
    let sigma = depth / LENGTH;
    let medium = Medium::homogeneous([sigma; 3], [0.0; 3], phase).unwrap();
    let mut worst = 0.0f64;
    for i in 0..=16 {
        let b = (b_min + (b_max - b_min) * (f64::from(i) / 16.0).powi(2)).max(0.003);
        for share in [0.1, 0.4, 1.0] {
            worst = worst.max(worst_error(&bands, &prefixes, &medium, b, LENGTH * reach * share));
        }
    }
    (bands, worst)
}

#[test]
fn lamp_bands_keep_their_error_against_the_exact_airlight_integral() {
    for (name, phase) in PHASES {
        for depth in DEPTHS {
            print!("{name:9} σL {depth:7}:");
            for (rank, target) in [(4, 1e-2), (8, 2e-3)] {
                let (bands, worst) = measured(phase, depth, 3.0, (0.0, 2.1), rank, target);
                let ranks: Vec<usize> = bands.bands().iter().map(LampFactors::rank).collect();
                print!("  {worst:.1e} of {:.1e} with ranks {ranks:?}", bands.error());
            }
            println!();
        }
    }
}
