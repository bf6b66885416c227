//! Rows of a projective map, filtered: weights of the row's reference ray, a basis of each texel's depth, and their running means
//! (Klehm et al. 2014, Section 3.3, Listings 1 to 3, basis and prefix sum in one pass; Peters et al. 2016 for moments).
//!
//! The reference ray is the middle of the row's view rays. A texel's weight is what that ray has of the texel's light rays: under a
//! sun `e^{−σt}·Δt`, around a lamp `e^{−σ(t+d)}·p(θ)·cone·Δγ`, at the texel's middle, whose place is the matrix's own (the
//! paper's Eq. 12 takes ways to grow by one factor, which they do not: `projective`).

use scatter_core::{Frame, Level, Light, SpotLight, at_level, exp_f32, parallel};

use super::numbers::Number;
use crate::fourier::harmonics;
use crate::options::Basis;
use crate::projective::{OwnMap, Rectification};

/// Texels side by side.
const LANES: usize = 16;

/// Most numbers of a texel.
pub const MOST: usize = 128;

/// Part of the series' period that is left free at either end.
const MARGIN: f32 = 0.05;

/// Where in the series' period a depth of the map (0 to 1) lies.
#[inline(always)]
pub fn place(depth: f32) -> f32 {
    MARGIN + (1.0 - 2.0 * MARGIN) * depth
}

/// What filters the rows of a frame's map.
pub struct RowFilter<'a> {
    frame: &'a Frame<'a>,
    map: &'a OwnMap,
    rectification: &'a Rectification,
    /// Extinction of the weights: of three channels their mean; 0 for average visibility.
    sigma: f64,
    spot: Option<&'a SpotLight>,
}

impl<'a> RowFilter<'a> {
    /// For a frame; `even` leaves transmittance out of the weights.
    pub fn new(frame: &'a Frame<'a>, map: &'a OwnMap, rectification: &'a Rectification, even: bool) -> Self {
        let sigma = if even { 0.0 } else { frame.medium().sigma_t().iter().sum::<f64>() / 3.0 };
        let spot = match frame.light() {
            Light::Spot(spot) => Some(spot),
            Light::Directional(_) | Light::Point(_) => None,
        };
        Self { frame, map, rectification, sigma, spot }
    }

    /// Fills `numbers`, `[row][column][coefficient]`, rows on all threads.
    pub fn fill<T: Number>(&self, simd: Level, basis: Basis, count: usize, numbers: &mut [T]) {
        let width = self.map.width();
        parallel::for_each_row(numbers, width * count, |row, numbers| {
            at_level!(
                simd,
                match (basis, count) {
                    (Basis::Moments, 4) => self.moments::<T, 4>(row, numbers),
                    (Basis::Moments, 6) => self.moments::<T, 6>(row, numbers),
                    (Basis::Moments, _) => self.moments::<T, 8>(row, numbers),
                    (Basis::Fourier, _) => self.fourier(row, count, numbers),
                }
            );
        });
    }

    /// Means of the powers of depths, scaled to [−1, 1]; sums in f64.
    #[inline(always)]
    fn moments<T: Number, const M: usize>(&self, row: usize, numbers: &mut [T]) {
        let (mut sums, mut total) = ([0.0f64; M], 0.0f64);
        self.blocks(row, |first, depths, weights| {
            let own = &mut numbers[first * M..];
            for ((&depth, &weight), out) in depths.iter().zip(weights).zip(own.chunks_exact_mut(M)) {
                let z = f64::from(depth) * 2.0 - 1.0;
                let weight = f64::from(weight);
                total += weight;
                let inverse = 1.0 / total;
                let mut power = weight;
                for (sum, out) in sums.iter_mut().zip(out) {
                    power *= z;
                    *sum += power;
                    *out = T::pack((*sum * inverse) as f32);
                }
            }
        });
    }

    /// Means of sines and cosines, in turn.
    #[inline(always)]
    fn fourier<T: Number>(&self, row: usize, count: usize, numbers: &mut [T]) {
        let mut basis = [[0.0f32; LANES]; MOST];
        let (mut sums, mut total) = ([0.0f32; MOST], 0.0f32);
        self.blocks(row, |first, depths, weights| {
            let mut z = [0.5f32; LANES];
            for (z, &depth) in z.iter_mut().zip(depths) {
                *z = place(depth);
            }
            harmonics(&z, count / 2, |k, sines, cosines| {
                (basis[2 * k], basis[2 * k + 1]) = (*sines, *cosines)
            });
            let own = &mut numbers[first * count..];
            for (lane, (&weight, out)) in weights.iter().zip(own.chunks_exact_mut(count)).enumerate() {
                total += weight;
                let inverse = 1.0 / total;
                for ((sum, basis), out) in sums.iter_mut().zip(&basis).zip(out) {
                    *sum += weight * basis[lane];
                    *out = T::pack(*sum * inverse);
                }
            }
        });
    }

    /// Visits a row's texels, some at a time: first column, depths clamped to 0 to 1, weights > 0.
    #[inline(always)]
    fn blocks(&self, row: usize, mut visit: impl FnMut(usize, &[f32], &[f32])) {
        let rectification = self.rectification;
        let y = self.map.row_middle(rectification, row);
        let reference = Reference::new(self, y);
        let a_split = self.map.columns_of_split();
        for split in 0..self.map.split_count() {
            let [near, far] = self.map.split_borders(rectification, split);
            let step = ((far - near) / a_split as f64) as f32;
            let texels = self.map.row_of_split(split, row);
            for (block, texels) in texels.chunks(LANES).enumerate() {
                let (mut depths, mut weights) = ([0.0f32; LANES], [0.0f32; LANES]);
                let first = block * LANES;
                for lane in 0..texels.len() {
                    depths[lane] = texels[lane].min(1.0);
                    let column = near as f32 + step * (first + lane) as f32;
                    weights[lane] = reference.weight(column, step);
                }
                visit(split as usize * a_split + first, &depths[..texels.len()], &weights[..texels.len()]);
            }
        }
    }
}

/// Weights are at least this: rows that begin where a lamp's cone has no light still have means.
const LEAST_WEIGHT: f32 = 1e-30;

/// The reference ray of one row.
struct Reference<'a> {
    sigma: f32,
    /// Length of its direction with `b·p` = 1, and its depth z.
    length: f32,
    z: f32,
    /// Cosine between the row's slice and the bisectrix.
    cosine: f32,
    lamp: Option<f32>,
    /// A lamp's phase function and cone ask for directions.
    lamp_light: Option<LampLight<'a>>,
}

/// What the light of a lamp depends on beside distances.
struct LampLight<'a> {
    filter: &'a RowFilter<'a>,
    y: f64,
}

impl<'a> Reference<'a> {
    fn new(filter: &'a RowFilter<'a>, y: f64) -> Self {
        let z = filter.rectification.middle_depth(filter.frame.camera(), y);
        let isotropic =
            filter.frame.medium().components().iter().all(|component| component.phase.is_isotropic());
        let asks = filter.rectification.lamp.is_some() && (filter.spot.is_some() || !isotropic);
        Self {
            sigma: filter.sigma as f32,
            length: (1.0 + y * y + z * z).sqrt() as f32,
            z: z as f32,
            cosine: (1.0 / (1.0 + y * y).sqrt()) as f32,
            lamp: filter.rectification.lamp.map(|distance| distance as f32),
            lamp_light: asks.then_some(LampLight { filter, y }),
        }
    }

    /// Weight of the light rays from a column (κ) on, `step` (< 0) of them.
    #[inline(always)]
    fn weight(&self, column: f32, step: f32) -> f32 {
        let middle = column + 0.5 * step;
        let weight = match self.lamp {
            None => {
                let way = -step / (column * (column + step));
                exp_f32(-self.sigma * self.length / middle) * way
            }
            Some(distance) => {
                // The reference ray meets the light ray where b·p = w; light rays beyond its last one have nothing of it.
                let w = distance / (middle - self.z).max(1e-12);
                let across = middle * self.cosine;
                let to_lamp = w / self.cosine * (1.0 + across * across).sqrt();
                let angle = -step / (1.0 + across * across);
                let light = self.lamp_light.as_ref().map_or(1.0, |light| light.at(middle, self.z, w));
                exp_f32(-(self.sigma * (self.length * w + to_lamp)).min(80.0)) * angle * light
            }
        };
        weight.max(LEAST_WEIGHT)
    }
}

impl LampLight<'_> {
    /// Phase function times cone of the light ray that a reference ray meets at `w`, in any unit.
    fn at(&self, column: f32, z: f32, w: f32) -> f32 {
        let RowFilter { rectification, spot, frame, .. } = *self.filter;
        let (_, light) = rectification.light_ray(f64::from(column), self.y);
        let light = light.normalize();
        let view =
            rectification.along + rectification.across * self.y - rectification.to_light * f64::from(z);
        let view = view.normalize();
        debug_assert!(w > 0.0, "behind the eye");
        // sin² of half the angle between the light's way and the way to the eye.
        let haversine = 0.25 * (light + view).length_squared();
        let phase = frame.medium().scattering_towards(haversine.min(1.0)).element_sum();
        let cone = spot.map_or(1.0, |spot| spot.cone(light.dot(spot.direction())));
        (phase * cone) as f32
    }
}
