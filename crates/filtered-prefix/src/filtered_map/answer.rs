//! Pixels answered from a filtered map: where each ray ends in it, a fetch, and a dot product or a reconstruction (Klehm et al.
//! 2014, Listing 4, with `1 − e^{−dσ}` in the closed form that its share is multiplied by; Peters et al. 2016).

use epipolar::driver::Shares;
use fearless_simd::f64x8;
use fearless_simd::prelude::*;
use glam::DVec3;
use scatter_core::{Frame, Level, at_level, parallel};

use super::filter::{BESIDE, MOST, place};
use super::numbers::Number;
use super::references::References;
use super::row_depths::{RowDepths, cosine, measure};
use crate::fourier::harmonics;
use crate::moments::{MOST_POWERS, bias_of, mass_below};
use crate::options::Fetch;
use crate::projective::{MOST_SPLITS, OwnMap, Rectification};
use crate::storage::Storage;

/// Pixels side by side.
const LANES: usize = 16;

/// What answers the pixels of a frame.
pub struct Answers<'a, T> {
    frame: &'a Frame<'a>,
    numbers: &'a [T],
    row_depths: &'a RowDepths,
    references: References,
    /// Numbers of a texel's basis.
    count: usize,
    width: usize,
    height: usize,
    is_bilinear: bool,
    /// `b·d`, `n·d`, `a·d` and the view ray itself, of the first pixel and a step of columns and rows.
    parts: [[f64; 3]; 3],
    directions: [DVec3; 3],
    lamp: Option<f32>,
    rows: [f32; 2],
    /// κ at which each split begins, and columns a unit of κ that it has.
    splits: [[f32; 2]; MOST_SPLITS],
    split_count: usize,
    a_split: f32,
}

/// Where the rays of some pixels end in the map.
#[derive(Default)]
struct Places {
    columns: [f32; LANES],
    rows: [f32; LANES],
    /// 0 to 1, among the row's view rays.
    depths: [f32; LANES],
    /// The nearer of two references, and the part of the other.
    references: [(u32, f32); LANES],
}

impl<'a, T: Number> Answers<'a, T> {
    /// From a map's numbers, `[row][column][reference][number]`.
    pub fn new(
        (frame, map, rectification): (&'a Frame<'a>, &OwnMap, &Rectification),
        (numbers, count): (&'a [T], usize),
        row_depths: &'a RowDepths,
        references: References,
        fetch: Fetch,
    ) -> Self {
        let Rectification { along, across, to_light, lamp, rows, .. } = *rectification;
        let directions = Rectification::view_rays(frame.camera());
        let a_split = map.columns_of_split() as f32;
        let mut splits = [[0.0f32; 2]; MOST_SPLITS];
        for (index, split) in splits.iter_mut().enumerate().take(map.split_count() as usize) {
            let [near, far] = map.split_borders(index as u32);
            *split = [near as f32, (f64::from(a_split) / (near - far)) as f32];
        }
        Self {
            frame,
            numbers,
            row_depths,
            references,
            count,
            width: map.width(),
            height: map.row_count(),
            is_bilinear: fetch != Fetch::Nearest,
            parts: directions.map(|v| [along.dot(v), across.dot(v), to_light.dot(v)]),
            directions,
            lamp: lamp.map(|distance| distance as f32),
            rows: rows.map(|row| row as f32),
            splits,
            split_count: map.split_count() as usize,
            a_split,
        }
    }

    /// Answers all pixels from a Fourier series.
    pub fn fourier(&self, simd: Level, shares: &Shares) {
        self.rows(simd, shares, &FromSeries(self));
    }

    /// Answers all pixels from moments.
    pub fn moments(&self, simd: Level, storage: Storage, shares: &Shares) {
        let bias = match storage {
            Storage::F32 => bias_of(self.count as u32),
            Storage::F16 | Storage::U8 => (bias_of(self.count as u32) * 6000.0).min(0.2),
        };
        match self.count {
            4 => self.rows(simd, shares, &FromMoments::<T, 2> { map: self, simd, bias }),
            6 => self.rows(simd, shares, &FromMoments::<T, 3> { map: self, simd, bias }),
            _ => self.rows(simd, shares, &FromMoments::<T, 4> { map: self, simd, bias }),
        }
    }

    /// Answers all pixels, image rows on all threads.
    fn rows(&self, simd: Level, shares: &Shares, answer: &(impl Answer + Sync)) {
        let [width, height] = self.frame.size().map(|side| side as usize);
        // Rows without values: what is written are shared slots, and nothing is allocated for nothing.
        let mut rows = vec![(); height];
        parallel::for_each_row(&mut rows, 1, |y, _| at_level!(simd, self.row(y, width, shares, answer)));
    }

    #[inline(always)]
    fn row(&self, y: usize, width: usize, shares: &Shares, answer: &impl Answer) {
        let mut places = Places::default();
        let mut out = [0.0f32; LANES];
        for x in (0..width).step_by(LANES) {
            let lanes = LANES.min(width - x);
            self.place([x, y], lanes, &mut places);
            answer.answer(&places, lanes, &mut out);
            for (lane, &share) in out[..lanes].iter().enumerate() {
                // The series overshoots; NaN is nobody's share.
                shares.put(y * width + x + lane, 0, if share > 0.0 { share.min(1.0) } else { 0.0 });
            }
        }
    }

    /// Finds where the rays of pixels end.
    #[inline(always)]
    fn place(&self, [x, y]: [usize; 2], lanes: usize, places: &mut Places) {
        let (width, limit) = (self.frame.size()[0] as usize, self.frame.max_distance() as f32);
        let depth = &self.frame.depth().texels()[y * width + x..][..lanes];
        let at = |n: usize| {
            let [first, column, row] = self.parts.map(|parts| parts[n]);
            [(first + column * x as f64 + row * y as f64) as f32, column as f32]
        };
        let [b, n, a] = [at(0), at(1), at(2)];
        let start = self.directions[0] + self.directions[1] * x as f64 + self.directions[2] * y as f64;
        let (start, step) = (start.as_vec3(), self.directions[1].as_vec3());
        let mut ends = [0.0f32; LANES];
        for (end, &depth) in ends.iter_mut().zip(depth) {
            *end = depth.min(limit);
        }
        let row_scale = self.height as f32 / (self.rows[1] - self.rows[0]);
        let mut columns = [0.0f32; LANES];
        let (mut slopes, mut ways) = ([0.0f32; LANES], [0.0f32; LANES]);
        for lane in 0..LANES {
            let x = lane as f32;
            let [b, n, a] = [b[0] + b[1] * x, n[0] + n[1] * x, a[0] + a[1] * x];
            let (dx, dy, dz) = (start.x + step.x * x, start.y + step.y * x, start.z + step.z * x);
            let length = (dx * dx + dy * dy + dz * dz).sqrt();
            let per_b = 1.0 / b;
            places.rows[lane] = (self.rows[1] - n * per_b) * row_scale;
            slopes[lane] = measure(-a * per_b * cosine(n * per_b));
            ways[lane] = length * per_b;
            let s = ends[lane] / length;
            // An endless ray under a lamp ends at a limit of κ; a ray without length is nearer than all columns.
            columns[lane] = match self.lamp {
                None => per_b / s,
                Some(distance) => (distance / s - a) * per_b,
            };
        }
        for lane in 0..lanes {
            let [first, scale] = self.row_depths.at(places.rows[lane]);
            places.depths[lane] = ((slopes[lane] - first) * scale).clamp(0.0, 1.0);
            let at = if self.lamp.is_some() { slopes[lane] } else { ways[lane] };
            places.references[lane] = self.references.blend(at, ends[lane]);
        }
        places.columns = [0.0; LANES];
        for &[near, scale] in &self.splits[..self.split_count] {
            for (place, &column) in places.columns.iter_mut().zip(&columns) {
                *place += ((near - column) * scale).max(0.0).min(self.a_split);
            }
        }
    }

    /// Reads the numbers at a pixel's place, blended. The means of column i hold up to its far border, so that a ray that ends at i + 1 has
    /// them to itself.
    #[inline(always)]
    fn fetch(&self, places: &Places, lane: usize, mut visit: impl FnMut(usize, f32)) {
        let (a_reference, references) = (self.count + BESIDE, self.references.count());
        let (reference, other_part) = places.references[lane];
        let texel = |column: usize, row: usize, reference: usize| {
            let first = ((row * self.width + column) * references + reference) * a_reference;
            &self.numbers[first..first + a_reference]
        };
        let last = [self.width - 1, self.height - 1];
        let sides = [(reference as usize, 1.0 - other_part), (reference as usize + 1, other_part)];
        let sides = &sides[..if references > 1 { 2 } else { 1 }];
        let mut means = [0.0f32; MOST + BESIDE];
        let means = &mut means[..a_reference];
        if self.is_bilinear {
            let at = [(places.columns[lane] - 1.0).max(0.0), (places.rows[lane] - 0.5).max(0.0)];
            let [column, row] = [0, 1].map(|n| (at[n] as usize).min(last[n]));
            let [next_column, next_row] = [(column + 1).min(last[0]), (row + 1).min(last[1])];
            let [u, v] = [(at[0] - column as f32).min(1.0), (at[1] - row as f32).min(1.0)];
            let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            for &(side, part) in sides {
                let [a, b, c, d] = [
                    texel(column, row, side),
                    texel(next_column, row, side),
                    texel(column, next_row, side),
                    texel(next_column, next_row, side),
                ];
                let weights = weights.map(|weight| weight * part);
                for k in 0..a_reference {
                    means[k] += weights[0] * a[k].unpack()
                        + weights[1] * b[k].unpack()
                        + weights[2] * c[k].unpack()
                        + weights[3] * d[k].unpack();
                }
            }
        } else {
            let at = [places.columns[lane], places.rows[lane]];
            let [column, row] = [0, 1].map(|n| (at[n].max(0.0) as usize).min(last[n]));
            for &(side, part) in sides {
                for (mean, number) in means.iter_mut().zip(texel(column, row, side)) {
                    *mean += part * number.unpack();
                }
            }
        }
        means.iter().enumerate().for_each(|(k, &mean)| visit(k, mean));
    }
}

/// Turns fetched numbers into shares.
trait Answer {
    /// The shares of `lanes` pixels.
    fn answer(&self, places: &Places, lanes: usize, out: &mut [f32; LANES]);
}

struct FromSeries<'a, T>(&'a Answers<'a, T>);

impl<T: Number> Answer for FromSeries<'_, T> {
    #[inline(always)]
    fn answer(&self, places: &Places, lanes: usize, out: &mut [f32; LANES]) {
        let mut means = [[0.0f32; LANES]; MOST + BESIDE];
        (0..lanes).for_each(|lane| self.0.fetch(places, lane, |k, mean| means[k][lane] = mean));
        for lane in 0..LANES {
            out[lane] = means[0][lane] + 0.5 * means[1][lane];
        }
        harmonics(&places.depths.map(place), self.0.count / 2, |k, sines, cosines| {
            let factor = 2.0 / ((2 * k + 1) as f32 * std::f32::consts::PI);
            let (own, other) = (&means[2 * k + BESIDE], &means[2 * k + 1 + BESIDE]);
            for lane in 0..LANES {
                out[lane] += factor * (cosines[lane] * own[lane] - sines[lane] * other[lane]);
            }
        });
        // The series overshoots by a part of what is in doubt.
        for lane in 0..LANES {
            out[lane] = out[lane].clamp(means[0][lane], means[0][lane] + means[1][lane].max(0.0));
        }
    }
}

/// N is half the number of moments.
struct FromMoments<'a, T, const N: usize> {
    map: &'a Answers<'a, T>,
    simd: Level,
    bias: f64,
}

impl<T: Number, const N: usize> Answer for FromMoments<'_, T, N> {
    #[inline(always)]
    fn answer(&self, places: &Places, lanes: usize, out: &mut [f32; LANES]) {
        let mut powers = [[0.0f64; LANES]; MOST_POWERS];
        let mut lit_for_all = [0.0f64; LANES];
        (0..lanes).for_each(|lane| {
            self.map.fetch(places, lane, |k, mean| {
                let mean = f64::from(mean);
                if k == 0 { lit_for_all[lane] = mean } else { powers[k - 1][lane] = mean }
            });
        });
        let z = places.depths.map(|depth| f64::from(place(depth)) * 2.0 - 1.0);
        at_level!(self.simd, simd => {
            for half in [0, LANES / 2] {
                let load = |lanes: &[f64; LANES]| f64x8::from_slice(simd, &lanes[half..half + 8]);
                let doubt = load(&powers[0]).max(f64x8::splat(simd, 0.0));
                let inverse = f64x8::splat(simd, 1.0) / doubt.max(f64x8::splat(simd, 1e-12));
                let mut moments = [f64x8::splat(simd, 1.0); MOST_POWERS];
                for (moment, powers) in moments.iter_mut().zip(&powers).skip(1) {
                    *moment = load(powers) * inverse;
                }
                let bounds = mass_below::<N, _>(simd, &moments, load(&z), self.bias);
                let part = f64x8::splat(simd, 1.0) - bounds.least - bounds.width * 0.5;
                let lit = load(&lit_for_all) + doubt * part.max(f64x8::splat(simd, 0.0));
                for lane in 0..8 {
                    out[half + lane] = lit.as_slice()[lane] as f32;
                }
            }
        });
    }
}
