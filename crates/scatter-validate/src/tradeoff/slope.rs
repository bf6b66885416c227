//! The exponent of a power law by least squares on logarithms.

use serde::Serialize;

/// The line `ln y = a + slope·ln x` nearest to points, all groups with the same slope and each with its own `a`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    /// The exponent.
    pub slope: f64,
    /// Root of the mean squared residual of `ln y`: 0.1 is a scatter of 10 %.
    pub residual: f64,
}

impl Fit {
    /// Fits groups of points `[x, y]`; points whose coordinates are not positive and finite are left out. `None` if no
    /// group has two different x.
    pub fn of<'p>(groups: impl IntoIterator<Item = &'p [[f64; 2]]>) -> Option<Self> {
        let (mut xx, mut xy, mut yy, mut count) = (0.0, 0.0, 0.0, 0.0);
        for group in groups {
            let logs: Vec<[f64; 2]> = group
                .iter()
                .filter(|p| p.iter().all(|&v| v > 0.0 && v.is_finite()))
                .map(|p| p.map(f64::ln))
                .collect();
            let n = logs.len() as f64;
            let [mean_x, mean_y] = [0, 1].map(|axis| logs.iter().map(|p| p[axis]).sum::<f64>() / n.max(1.0));
            for [x, y] in logs {
                let (dx, dy) = (x - mean_x, y - mean_y);
                xx += dx * dx;
                xy += dx * dy;
                yy += dy * dy;
            }
            count += n;
        }
        let slope = xy / xx;
        // Rounding can leave a residual just below zero.
        (xx > 0.0).then(|| Self { slope, residual: ((yy - slope * xy) / count).max(0.0).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_law_has_its_exponent_and_no_residual() {
        for exponent in [-1.0, 0.0, 1.94, 2.83] {
            let points = [0.25, 0.35, 0.5, 0.7, 1.0].map(|x: f64| [x, 7.0 * x.powf(exponent)]);
            let fit = Fit::of([&points[..]]).unwrap();
            assert!((fit.slope - exponent).abs() < 1e-12 && fit.residual < 1e-7, "{exponent}: {fit:?}");
        }
    }

    #[test]
    fn noise_is_the_residual() {
        // ln y = 2·ln x ± e in the pattern + − − +, which is orthogonal to 1 and to x.
        let e = 0.05f64;
        let points = [1.0, 2.0, 3.0, 4.0].map(|step: f64| {
            let sign = if step == 1.0 || step == 4.0 { 1.0 } else { -1.0 };
            [step.exp(), (2.0 * step + sign * e).exp()]
        });
        let fit = Fit::of([&points[..]]).unwrap();
        assert!((fit.slope - 2.0).abs() < 1e-12 && (fit.residual - e).abs() < 1e-9, "{fit:?}");
    }

    #[test]
    fn groups_share_the_slope_and_not_the_height() {
        let group = |height: f64| [1.0, 2.0, 5.0].map(|x: f64| [x, height * x * x]);
        let (a, b) = (group(1.0), group(900.0));
        let fit = Fit::of([&a[..], &b[..]]).unwrap();
        assert!((fit.slope - 2.0).abs() < 1e-12 && fit.residual < 1e-7, "{fit:?}");
    }

    #[test]
    fn one_place_has_no_slope() {
        assert_eq!(Fit::of([&[[1.0, 2.0], [1.0, 3.0]][..], &[[2.0, 9.0]]]), None);
        assert_eq!(Fit::of([&[[1.0, 2.0], [2.0, f64::NAN], [3.0, 0.0]][..]]), None);
        assert_eq!(Fit::of([]), None);
    }
}
