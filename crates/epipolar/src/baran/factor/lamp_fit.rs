//! Factors of a lamp's integrand `A(g, b)` on a band of b, before they are tabulated.
//!
//! Columns of A at Chebyshev points in b span what all columns of the band span, nearly. So Γ are N such columns, made
//! orthogonal to each other for the sake of f32, and `B(b)` is the least-squares fit of column b by Γ: for each of some
//! thirty b over the g that a ray at b has, a cubic in between. No SVD is needed, and none of the paper's upsampling in
//! g: Γ is known wherever A is.
//!
//! # Which least squares
//!
//! As for the sun (see `chebyshev`) the worst visibility V makes an error of half of `∫|e/E − f/F|`, e = A at one b and
//! f its fit; by Cauchy and Schwarz its square is at most `¼·∫ δ²/(e·E)`, δ = f − e. Rays of every length count, so in
//! place of E over the whole ray stands E up to g. The fit minimises that sum.

use super::MAX_RANK;
use super::lamp_kernel::{Grid, Half, Kernel};

/// Values of b where columns are fitted. The cubic between them errs with the fourth power of their distance; with half
/// as many it is what limits rank 8.
const FITS: usize = 33;

/// What a fit works in, kept from one to the next.
#[derive(Default, Debug, Clone)]
pub(super) struct Workspace {
    grid: Grid,
    /// Γ at the grid, `[k][i]`.
    basis: Vec<f64>,
    column: Vec<f64>,
    fitted: Vec<f64>,
}

/// A factorisation of one band.
pub(super) struct Fit<'a> {
    kernel: &'a Kernel<'a>,
    /// Range of `ln(tan(b/2) + scale/2)`, in which the function is about equally hard everywhere.
    range: (f64, f64),
    pub(super) rank: usize,
    /// Whether the band is narrow enough to be sampled as finely as its lobes ask.
    resolved: bool,
    /// The columns' b.
    columns: [Half; MAX_RANK],
    /// What makes columns orthogonal: `Γₖ = (columnₖ − Σ_{j<k} r[j][k]·Γⱼ)/r[k][k]`.
    r: [[f64; MAX_RANK]; MAX_RANK],
    /// `Bₖ` at the values of [`FITS`].
    weights: [[f64; MAX_RANK]; FITS],
}

impl<'a> Fit<'a> {
    /// Of rank `rank` at most, for b in the image of `range` under [`b_at`].
    pub(super) fn new(kernel: &'a Kernel<'a>, range: (f64, f64), rank: usize, space: &mut Workspace) -> Self {
        let mut fit = Self {
            kernel,
            range,
            rank,
            resolved: true,
            columns: [Half::default(); MAX_RANK],
            r: [[0.0; MAX_RANK]; MAX_RANK],
            weights: [[0.0; MAX_RANK]; FITS],
        };
        fit.resolved = kernel.grid(b_at(kernel, range.0), b_at(kernel, range.1), &mut space.grid);
        fit.orthogonal_columns(space);
        for l in 0..FITS {
            // As far as the rays at the next two b go: the cubic mixes neighbours, all of which must then be fits.
            let ends =
                [l.saturating_sub(2), l, (l + 2).min(FITS - 1)].map(|l| kernel.end(fit.b_of(l as f64)));
            fit.column(space, fit.b_of(l as f64), ends.into_iter().fold(0.0, f64::max));
            fit.weights[l] = fit.least_squares(space);
        }
        fit
    }

    /// `Γₖ` at any g.
    pub(super) fn gamma_at(&self, g: f64) -> [f64; MAX_RANK] {
        let half = Half::of(g);
        let mut gamma = [0.0; MAX_RANK];
        for k in 0..self.rank {
            let others: f64 = (0..k).map(|j| self.r[j][k] * gamma[j]).sum();
            gamma[k] = (self.kernel.value(self.columns[k], half) - others) / self.r[k][k];
        }
        gamma
    }

    /// `Bₖ` at a b of the band.
    pub(super) fn weights_at(&self, b: f64) -> [f64; MAX_RANK] {
        let width = self.range.1 - self.range.0;
        let share = if width > 0.0 { (coordinate(self.kernel, b) - self.range.0) / width } else { 0.0 };
        let at = (share * (FITS - 1) as f64).clamp(0.0, (FITS - 1) as f64);
        let first = (at as usize).saturating_sub(1).min(FITS - 4);
        let x = at - first as f64;
        let cubic = [
            -(x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0,
            x * (x - 2.0) * (x - 3.0) / 2.0,
            -x * (x - 1.0) * (x - 3.0) / 2.0,
            x * (x - 1.0) * (x - 2.0) / 6.0,
        ];
        std::array::from_fn(|k| (0..4).map(|i| cubic[i] * self.weights[first + i][k]).sum())
    }

    /// The worst error of vis with B from `weights`, over all visibilities, b between the fits and rays of eight
    /// lengths. 1 for a band too wide to be sampled.
    pub(super) fn error(&self, weights: impl Fn(f64) -> [f64; MAX_RANK], space: &mut Workspace) -> f64 {
        const LENGTHS: usize = 8;
        let mut worst = if self.resolved { 0.0f64 } else { 1.0 };
        for l in 0..FITS - 1 {
            let b = self.b_of(l as f64 + 0.5);
            self.column(space, b, self.kernel.end(b));
            let weights = weights(b);
            let (count, samples) = (space.column.len(), space.grid.g.len());
            space.fitted.clear();
            space.fitted.resize(count, 0.0);
            for (gamma, weight) in space.basis.chunks_exact(samples).zip(weights) {
                space.fitted.iter_mut().zip(gamma).for_each(|(sum, g)| *sum += weight * g);
            }
            for length in 1..=LENGTHS {
                let count = (count * length).div_ceil(LENGTHS);
                worst = worst.max(distance(&space.column, &space.fitted, &space.grid.weight, count));
            }
        }
        worst
    }

    /// b at a place among the fits.
    fn b_of(&self, place: f64) -> f64 {
        b_at(self.kernel, self.range.0 + (self.range.1 - self.range.0) * place / (FITS - 1) as f64)
    }

    /// Γ at the grid. Sets columns and r, and lowers the rank where columns are multiples of each other.
    fn orthogonal_columns(&mut self, space: &mut Workspace) {
        let Workspace { grid, basis, fitted: size, .. } = space;
        let count = grid.g.len();
        basis.clear();
        size.clear();
        size.resize(count, 0.0);
        for k in 0..self.rank {
            let z = (std::f64::consts::PI * (k as f64 + 0.5) / self.rank as f64).cos();
            self.columns[k] = Half::of(self.b_of(0.5 * (1.0 + z) * (FITS - 1) as f64));
            basis.extend(grid.half.iter().map(|&g| self.kernel.value(self.columns[k], g)));
            // Sizes along g, relative to each ray's mean, so that the far end of a ray is not lost beside the near one.
            let column = &basis[k * count..];
            let mean = dot(column, &grid.weight).max(1e-300);
            size.iter_mut().zip(column).for_each(|(sum, v)| *sum += v / mean);
        }
        let floor = 1e-6 * size.iter().fold(0.0, |most: f64, s| most.max(*s));
        size.iter_mut().for_each(|s| *s = 1.0 / s.max(floor));
        let product = |a: &[f64], b: &[f64]| -> f64 {
            a.iter().zip(b).zip(size.iter()).map(|((a, b), s)| a * s * (b * s)).sum()
        };
        for k in 0..self.rank {
            let (before, rest) = basis.split_at_mut(k * count);
            let column = &mut rest[..count];
            let length = product(column, column).sqrt();
            // Twice: what the first pass leaves of an all but parallel column is cleaned by the second.
            for _ in 0..2 {
                for (j, gamma) in before.chunks_exact(count).enumerate() {
                    let r = product(gamma, column);
                    self.r[j][k] += r;
                    column.iter_mut().zip(gamma).for_each(|(v, q)| *v -= r * q);
                }
            }
            self.r[k][k] = product(column, column).sqrt();
            // Below this a column is made of roundings.
            if k > 0 && self.r[k][k] < 1e-9 * length {
                self.rank = k;
                break;
            }
            let r = self.r[k][k];
            column.iter_mut().for_each(|v| *v /= r);
        }
        basis.truncate(self.rank * count);
    }

    /// A at the grid for one b, up to `end`.
    fn column(&self, space: &mut Workspace, b: f64, end: f64) {
        let grid = &space.grid;
        let count = grid.g.partition_point(|&g| g <= end).max(2);
        let half = Half::of(b);
        space.column.clear();
        space.column.extend(grid.half[..count].iter().map(|&g| self.kernel.value(half, g)));
    }

    /// `B` of the present column, divided by its integral.
    fn least_squares(&self, space: &Workspace) -> [f64; MAX_RANK] {
        /// Of the trace, added to the diagonal. Less lets a short ray's B grow to 1e5; more shows in the error.
        const RIDGE: f64 = 1e-11;
        /// Of the mean up to g: a smaller A counts as this large, or the darkest end would decide the fit.
        const DARKEST: f64 = 1e-4;
        let samples = space.grid.g.len();
        let mut matrix = [[0.0; MAX_RANK]; MAX_RANK];
        let mut right = [0.0; MAX_RANK];
        let mut integral = 0.0;
        for (i, (&value, &width)) in space.column.iter().zip(&space.grid.weight).enumerate() {
            integral += width * value;
            let mean = integral / space.grid.g[i].max(width);
            let weight = width / (integral * value.max(DARKEST * mean)).max(1e-300);
            for k in 0..self.rank {
                let weighted = weight * space.basis[k * samples + i];
                right[k] += weighted * value;
                for (j, entry) in matrix[k][..=k].iter_mut().enumerate() {
                    *entry += weighted * space.basis[j * samples + i];
                }
            }
        }
        let trace: f64 = (0..self.rank).map(|k| matrix[k][k]).sum();
        (0..self.rank).for_each(|k| matrix[k][k] += RIDGE * trace);
        solve(&mut matrix, &mut right, self.rank);
        right.map(|v| v / integral.max(1e-300))
    }
}

/// `ln(tan(b/2) + scale/2)`.
pub(super) fn coordinate(kernel: &Kernel<'_>, b: f64) -> f64 {
    ((0.5 * b).tan() + 0.5 * kernel.scale()).ln()
}

/// b from its [`coordinate`].
pub(super) fn b_at(kernel: &Kernel<'_>, coordinate: f64) -> f64 {
    2.0 * (coordinate.exp() - 0.5 * kernel.scale()).max(0.0).atan()
}

/// `½∫|e/E − f/F|` over the first `count` samples: what the worst visibility makes of f in place of e.
fn distance(exact: &[f64], fitted: &[f64], weight: &[f64], count: usize) -> f64 {
    let (e, f) = (dot(&exact[..count], weight), dot(&fitted[..count], weight));
    let differences = exact.iter().zip(fitted).zip(weight).take(count);
    0.5 * differences.map(|((a, b), w)| w * (a / e - b / f).abs()).sum::<f64>()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves a symmetric positive system, of which the lower triangle is given, by Cholesky's decomposition.
fn solve(matrix: &mut [[f64; MAX_RANK]; MAX_RANK], right: &mut [f64; MAX_RANK], rank: usize) {
    for k in 0..rank {
        for j in 0..=k {
            let done: f64 = (0..j).map(|i| matrix[k][i] * matrix[j][i]).sum();
            let rest = matrix[k][j] - done;
            matrix[k][j] = if j == k { rest.max(1e-300).sqrt() } else { rest / matrix[j][j] };
        }
        let done: f64 = (0..k).map(|i| matrix[k][i] * right[i]).sum();
        right[k] = (right[k] - done) / matrix[k][k];
    }
    for k in (0..rank).rev() {
        let done: f64 = (k + 1..rank).map(|i| matrix[i][k] * right[i]).sum();
        right[k] = (right[k] - done) / matrix[k][k];
    }
}
