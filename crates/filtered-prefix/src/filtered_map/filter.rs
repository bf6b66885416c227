//! Rows of a projective map, filtered: weights of the row's reference ray, a basis of each texel's depth, and their running means
//! (Klehm et al. 2014, Section 3.3, Listings 1 to 3, basis and prefix sum in one pass; Peters et al. 2016 for moments).
//!
//! A texel's weight is what a reference ray ([`References`]) has of the texel's light rays: under a sun `∫ e^{−σt} dt`, around a lamp
//! `e^{−σ(t+d)}·p(θ)·cone·Δγ` at the texel's middle. Their places are the matrix's own (the paper's Eq. 12 takes ways to grow by one
//! factor, which they do not: `projective`). The first texel reaches to the eye: so near to it all light rays are one, and the paper's
//! near-plane correction has nothing to take off.
//!
//! Surfaces that all view rays of the row see lit, or none, are summed apart, as in rows of slices: a texel's numbers are the part
//! that is lit for all, the part in doubt, and the sums of the basis over the latter, all over the whole weight.

use fearless_simd::f32x16;
use fearless_simd::prelude::*;
use scatter_core::{Frame, Light, SpotLight, exp_f32, sun_interval_f32};

use super::numbers::Number;
use super::references::{self, References};
use super::row_depths::{RowDepths, cosine, measure};
use super::turned::{LANES, by_lane};
use crate::fourier::harmonics;
use crate::projective::{OwnMap, Rectification};

/// Most numbers of a texel.
pub const MOST: usize = 128;

/// Numbers of a texel beside its basis: light for all rays, and in doubt.
pub const BESIDE: usize = 2;

/// Part of the series' period, or of the range of moments, that is left free at either end.
pub const MARGIN: f32 = 0.05;

/// Where in the series' period a depth of a row (0 to 1) lies.
#[inline(always)]
pub fn place(depth: f32) -> f32 {
    MARGIN + (1.0 - 2.0 * MARGIN) * depth
}

/// What filters the rows of a frame's map.
pub struct RowFilter<'a> {
    frame: &'a Frame<'a>,
    map: &'a OwnMap,
    rectification: &'a Rectification,
    depths: &'a RowDepths,
    references: References,
    /// Extinction of the weights: of three channels their mean; 0 for average visibility.
    sigma: f64,
    spot: Option<&'a SpotLight>,
}

/// Sixteen texels of a row.
struct Block {
    /// The first one's column, and how many there are.
    first: usize,
    count: usize,
    /// Place of their surfaces among the row's view rays, 0 to 1.
    depths: [f32; LANES],
    /// 1 where all view rays see them lit, 0 where none or some do.
    lit: [f32; LANES],
    /// 1 where some do.
    doubt: [f32; LANES],
    /// Weights, by each reference.
    weights: [[f32; LANES]; references::MOST],
}

impl<'a> RowFilter<'a> {
    /// For a frame; `sigma` is the extinction of the weights, 0 to leave transmittance out.
    pub fn new(
        (frame, map, rectification): (&'a Frame<'a>, &'a OwnMap, &'a Rectification),
        depths: &'a RowDepths,
        references: References,
        sigma: f64,
    ) -> Self {
        let spot = match frame.light() {
            Light::Spot(spot) => Some(spot),
            Light::Directional(_) | Light::Point(_) => None,
        };
        Self { frame, map, rectification, depths, references, sigma, spot }
    }

    /// Fills the numbers of a row, `[reference][column][number]`, with means of the powers of depths, scaled to [−1, 1]; sums in f64. A is
    /// the number of all numbers, P room for them: a power of two.
    #[inline(always)]
    pub fn moments<T: Number, const A: usize, const P: usize, S: Simd>(
        &self,
        vectors: S,
        row: usize,
        numbers: &mut [T],
    ) {
        let mut terms = [[0.0f32; P]; LANES];
        let count = self.references.count();
        let mut sums = [[0.0f64; A]; references::MOST];
        let mut totals = [0.0f64; references::MOST];
        let mut inverses = [[1.0f64; LANES]; references::MOST];
        let side = self.map.width() * A;
        self.blocks(
            row,
            #[inline(always)]
            |block| {
                let own = inverses[..count].iter_mut().zip(&block.weights).zip(&mut totals);
                for ((inverses, weights), total) in own {
                    for (inverse, &weight) in inverses.iter_mut().zip(&weights[..block.count]) {
                        *total += f64::from(weight);
                        *inverse = *total;
                    }
                }
                // What is summed up, by whatever weights.
                let mut numbers_of = [f32x16::splat(vectors, 0.0); P];
                numbers_of[0] = f32x16::from_slice(vectors, &block.lit);
                numbers_of[1] = f32x16::from_slice(vectors, &block.doubt);
                let mut z = [0.0f32; LANES];
                for (z, &depth) in z.iter_mut().zip(&block.depths) {
                    *z = place(depth) * 2.0 - 1.0;
                }
                let z = f32x16::from_slice(vectors, &z);
                for k in BESIDE..A {
                    numbers_of[k] = numbers_of[k - 1] * z;
                }
                by_lane(numbers_of, &mut terms);
                for inverse in inverses[..count].as_flattened_mut() {
                    *inverse = 1.0 / *inverse;
                }
                for (lane, terms) in terms[..block.count].iter().enumerate() {
                    let first = (block.first + lane) * A;
                    for (reference, sums) in sums[..count].iter_mut().enumerate() {
                        let (weight, inverse) =
                            (f64::from(block.weights[reference][lane]), inverses[reference][lane]);
                        let out = &mut numbers[reference * side + first..][..A];
                        let mut means = [0.0f32; A];
                        for k in 0..A {
                            sums[k] += weight * f64::from(terms[k]);
                            means[k] = (sums[k] * inverse) as f32;
                        }
                        T::pack_all(&means, out);
                    }
                }
            },
        );
    }

    /// Fills the numbers of a row with means of sines and cosines, in turn; `count` are those of the basis.
    #[inline(always)]
    pub fn fourier<T: Number>(&self, row: usize, count: usize, numbers: &mut [T]) {
        let mut basis = [[0.0f32; LANES]; MOST];
        let mut of_texel = [0.0f32; MOST];
        let mut sums = [[0.0f32; MOST]; references::MOST];
        let mut beside = [[0.0f32; BESIDE + 1]; references::MOST];
        let (references, width) = (self.references.count(), self.map.width());
        self.blocks(
            row,
            #[inline(always)]
            |block| {
                harmonics(&block.depths.map(place), count / 2, |k, sines, cosines| {
                    (basis[2 * k], basis[2 * k + 1]) = (*sines, *cosines)
                });
                let a_texel = count + BESIDE;
                for lane in 0..block.count {
                    for (own, basis) in of_texel[..count].iter_mut().zip(&basis) {
                        *own = basis[lane];
                    }
                    for reference in 0..references {
                        let first = (reference * width + block.first + lane) * a_texel;
                        let out = &mut numbers[first..][..a_texel];
                        let weight = block.weights[reference][lane];
                        let in_doubt = weight * block.doubt[lane];
                        let [lit, doubt, total] = &mut beside[reference];
                        *lit += weight * block.lit[lane];
                        *doubt += in_doubt;
                        *total += weight;
                        let inverse = 1.0 / *total;
                        out[0] = T::pack(*lit * inverse);
                        out[1] = T::pack(*doubt * inverse);
                        let sums = sums[reference].iter_mut();
                        for ((sum, basis), out) in sums.zip(&of_texel).zip(&mut out[BESIDE..]) {
                            *sum += in_doubt * basis;
                            *out = T::pack(*sum * inverse);
                        }
                    }
                }
            },
        );
    }

    /// Visits a row's texels, some at a time.
    #[inline(always)]
    fn blocks(&self, row: usize, mut visit: impl FnMut(&Block)) {
        let rectification = self.rectification;
        let y = self.map.row_middle(rectification, row);
        let rays: [Reference<'_>; references::MOST] =
            std::array::from_fn(|index| Reference::new(self, y, self.references.knot(index)));
        let rays = &rays[..self.references.count()];
        let own_cosine = cosine(y as f32);
        let [first, last] = rectification.depths.map(|z| z as f32);
        let [start, scale] = self.depths.of_row(row);
        let a_split = self.map.columns_of_split();
        let mut block = Block {
            first: 0,
            count: 0,
            depths: [0.5; LANES],
            lit: [0.0; LANES],
            doubt: [0.0; LANES],
            weights: [[0.0; LANES]; references::MOST],
        };
        for split in 0..self.map.split_count() {
            let [near, far] = self.map.split_borders(split);
            let step = ((far - near) / a_split as f64) as f32;
            let texels = self.map.row_of_split(split, row);
            for (index, texels) in texels.chunks(LANES).enumerate() {
                let in_split = index * LANES;
                (block.first, block.count) = (split as usize * a_split + in_split, texels.len());
                let mut surfaces = [f32::INFINITY; LANES];
                surfaces[..block.count].copy_from_slice(texels);
                for (lane, &texel) in surfaces.iter().enumerate() {
                    // Behind all view rays of the picture, or before them, where the map's own range ends.
                    let depth = measure((first + (last - first) * texel.min(1.0)) * own_cosine);
                    let depth = (depth - start) * scale;
                    let is_lit = depth >= 1.0 || texel >= 1.0;
                    let is_dark = depth <= 0.0 || texel <= 0.0;
                    block.lit[lane] = f32::from(u8::from(is_lit));
                    block.doubt[lane] = f32::from(u8::from(!(is_lit | is_dark)));
                    block.depths[lane] = depth.clamp(0.0, 1.0);
                }
                let lights = LightRays::new(near as f32, step, in_split, block.first == 0);
                for (ray, weights) in rays.iter().zip(&mut block.weights) {
                    ray.weigh(&lights, weights);
                }
                visit(&block);
            }
        }
    }
}

/// Weights are at least this: rows that begin where a lamp's cone has no light still have means.
const LEAST_WEIGHT: f32 = 1e-30;

/// The light rays of sixteen texels.
struct LightRays {
    /// κ of their middles, and their widths in κ.
    columns: [f32; LANES],
    widths: [f32; LANES],
    /// Ways across the light to their middles, and between their borders.
    ways: [f32; LANES],
    spans: [f32; LANES],
    /// Whether the first texel is the row's, which reaches to the eye, and the way to its end.
    is_first: bool,
    first_end: f32,
}

impl LightRays {
    /// From the texel `index` of a split that begins at `near` and goes on by `step` (< 0).
    #[inline(always)]
    fn new(near: f32, step: f32, index: usize, is_first: bool) -> Self {
        let (mut columns, mut widths) = ([0.0f32; LANES], [-step; LANES]);
        let (mut ways, mut spans) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let start = near + step * (index + lane) as f32;
            columns[lane] = start + 0.5 * step;
            spans[lane] = -step / (start * (start + step));
            ways[lane] = 1.0 / columns[lane];
        }
        let end = near + step;
        if is_first {
            // Under a lamp; all angles nearer than its end are nearly 1/κ.
            (columns[0], widths[0]) = (2.0 * end, 2.0 * end);
        }
        Self { columns, widths, ways, spans, is_first, first_end: 1.0 / end }
    }
}

/// The reference ray of one row.
struct Reference<'a> {
    sigma: f32,
    /// Length of its direction with `b·p` = 1, and its depth z; of a lamp's.
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
    /// Of the row y, by its place among the references.
    fn new(filter: &'a RowFilter<'a>, y: f64, knot: f32) -> Self {
        let lamp = filter.rectification.lamp.map(|distance| distance as f32);
        let own_cosine = cosine(y as f32);
        let (length, z) = match lamp {
            None => (knot, 0.0),
            Some(_) => {
                let z = knot / (1.0 - knot.abs()).max(1e-6) / own_cosine;
                let y = y as f32;
                ((1.0 + y * y + z * z).sqrt(), z)
            }
        };
        let isotropic =
            filter.frame.medium().components().iter().all(|component| component.phase.is_isotropic());
        let asks = lamp.is_some() && (filter.spot.is_some() || !isotropic);
        let lamp_light = asks.then_some(LampLight { filter, y });
        Self { sigma: filter.sigma as f32, length, z, cosine: own_cosine, lamp, lamp_light }
    }

    /// Weights of sixteen texels.
    #[inline(always)]
    fn weigh(&self, lights: &LightRays, weights: &mut [f32; LANES]) {
        match self.lamp {
            None => {
                let extinction = self.sigma * self.length;
                let lights_of = lights.ways.iter().zip(&lights.spans);
                for (weight, (&way, &span)) in weights.iter_mut().zip(lights_of) {
                    let depth = extinction * span;
                    // The middle rule with its next term, of spans that are far shorter than a mean free path where there is light.
                    let light = exp_f32(-(extinction * way).min(80.0)) * span;
                    *weight = (light * (1.0 + depth * depth / 24.0)).max(LEAST_WEIGHT);
                }
                if lights.is_first {
                    weights[0] = sun_interval_f32(extinction, 0.0, lights.first_end).max(LEAST_WEIGHT);
                }
            }
            Some(distance) => {
                let lights_of = lights.columns.iter().zip(&lights.widths);
                for (weight, (&column, &width)) in weights.iter_mut().zip(lights_of) {
                    *weight = self.of_lamp(distance, column, width);
                }
            }
        }
    }

    /// Weight of a lamp's light rays about a column (κ), so wide.
    #[inline(always)]
    fn of_lamp(&self, distance: f32, middle: f32, width: f32) -> f32 {
        // The reference ray meets the light ray where b·p = w; light rays beyond its last one have nothing of it.
        let w = distance / (middle - self.z).max(1e-12);
        let across = middle * self.cosine;
        let to_lamp = w / self.cosine * (1.0 + across * across).sqrt();
        let angle = width / (1.0 + across * across);
        let light = self.lamp_light.as_ref().map_or(1.0, |light| light.at(middle, self.z, w));
        let depth = self.sigma * (self.length * w + to_lamp);
        (exp_f32(-depth.min(80.0)) * angle * light).max(LEAST_WEIGHT)
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
