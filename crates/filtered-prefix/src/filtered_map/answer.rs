//! Pixels answered from a filtered map: where each ray ends in it, a fetch, and a dot product or a reconstruction (Klehm et al.
//! 2014, Listing 4, with `1 − e^{−dσ}` in the closed form that its share is multiplied by; Peters et al. 2016).

use epipolar::driver::Shares;
use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, f64x8};
use glam::DVec3;
use scatter_core::{Frame, Level, at_level, parallel};

use super::filter::{BESIDE, MOST, place};
use super::numbers::{EIGHT, Number};
use super::references::References;
use super::row_depths::{RowDepths, cosine, measure};
use super::turned::{LANES, by_number};
use crate::fourier::harmonics;
use crate::moments::{MOST_POWERS, bias_of, mass_below};
use crate::options::Fetch;
use crate::projective::{MOST_SPLITS, OwnMap, Rectification};
use crate::storage::Storage;

/// Image rows that are answered together: rows of the map cross the image about upright, so that pixels above each other read
/// texels beside each other.
const BAND: usize = 16;

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
    references: [u32; LANES],
    parts: [f32; LANES],
}

impl<'a, T: Number> Answers<'a, T> {
    /// From a map's numbers, `[row][reference][column][number]`.
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
        self.rows(simd, shares, &FromSeries { map: self, simd });
    }

    /// Answers all pixels from moments.
    pub fn moments(&self, simd: Level, storage: Storage, shares: &Shares) {
        let bias = match storage {
            Storage::F32 => bias_of(self.count as u32),
            Storage::F16 | Storage::U8 => (bias_of(self.count as u32) * 6000.0).min(0.2),
        };
        match self.count {
            4 => self.rows(simd, shares, &FromMoments::<T, 2, 8> { map: self, simd, bias }),
            6 => self.rows(simd, shares, &FromMoments::<T, 3, 8> { map: self, simd, bias }),
            _ => self.rows(simd, shares, &FromMoments::<T, 4, 16> { map: self, simd, bias }),
        }
    }

    /// Answers all pixels, bands of image rows on all threads.
    fn rows(&self, simd: Level, shares: &Shares, answer: &(impl Answer + Sync)) {
        let height = self.frame.size()[1] as usize;
        // Bands without values: what is written are shared slots, and nothing is allocated for nothing.
        let mut bands = vec![(); height.div_ceil(BAND)];
        parallel::for_each_row(&mut bands, 1, |band, _| at_level!(simd, self.band(band, shares, answer)));
    }

    #[inline(always)]
    fn band(&self, band: usize, shares: &Shares, answer: &impl Answer) {
        let [width, height] = self.frame.size().map(|side| side as usize);
        let mut places = Places::default();
        let mut out = [0.0f32; LANES];
        for x in (0..width).step_by(LANES) {
            let lanes = LANES.min(width - x);
            for y in band * BAND..height.min((band + 1) * BAND) {
                self.place([x, y], lanes, &mut places);
                answer.answer(&places, &mut out);
                for share in &mut out {
                    // The series overshoots; NaN is nobody's share.
                    *share = if *share > 0.0 { share.min(1.0) } else { 0.0 };
                }
                for (lane, &share) in out[..lanes].iter().enumerate() {
                    shares.put(y * width + x + lane, 0, share);
                }
            }
        }
    }

    /// Finds where the rays of pixels end.
    #[inline(always)]
    fn place(&self, [x, y]: [usize; 2], lanes: usize, places: &mut Places) {
        let (width, limit) = (self.frame.size()[0] as usize, self.frame.max_distance() as f32);
        let depth = &self.frame.depth().texels()[y * width + x..][..lanes];
        let mut ends = [1.0f32; LANES];
        ends[..lanes].copy_from_slice(depth);
        ends.iter_mut().for_each(|end| *end = end.min(limit));
        let at = |n: usize| {
            let [first, column, row] = self.parts.map(|parts| parts[n]);
            [(first + column * x as f64 + row * y as f64) as f32, column as f32]
        };
        let [b, n, a] = [at(0), at(1), at(2)];
        let start = self.directions[0] + self.directions[1] * x as f64 + self.directions[2] * y as f64;
        let (start, step) = (start.as_vec3(), self.directions[1].as_vec3());
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
        let [firsts, scales] = self.row_depths.at(&places.rows);
        for lane in 0..LANES {
            places.depths[lane] = ((slopes[lane] - firsts[lane]) * scales[lane]).clamp(0.0, 1.0);
        }
        let at = if self.lamp.is_some() { &slopes } else { &ways };
        self.references.blend(at, &ends, &mut places.references, &mut places.parts);
        places.columns = [0.0; LANES];
        for &[near, scale] in &self.splits[..self.split_count] {
            for (place, &column) in places.columns.iter_mut().zip(&columns) {
                *place += ((near - column) * scale).max(0.0).min(self.a_split);
            }
        }
    }

    /// The texels about the pixels' places. The means of column i hold up to its far border, so that a ray that ends at i + 1 has
    /// them to itself.
    #[inline(always)]
    fn texels(&self, places: &Places) -> Texels {
        let last = [self.width as u32 - 1, self.height as u32 - 1];
        let mut texels = Texels::default();
        let shift = if self.is_bilinear { [1.0, 0.5] } else { [0.0, 0.0] };
        for lane in 0..LANES {
            let at = [(places.columns[lane] - shift[0]).max(0.0), (places.rows[lane] - shift[1]).max(0.0)];
            let (column, row) = ((at[0] as u32).min(last[0]), (at[1] as u32).min(last[1]));
            let (u, v) = ((at[0] - column as f32).min(1.0), (at[1] - row as f32).min(1.0));
            let (u, v) = if self.is_bilinear { (u, v) } else { (0.0, 0.0) };
            (texels.columns[lane], texels.rows[lane]) = (column, row);
            (texels.right[lane], texels.down[lane]) = (u32::from(column < last[0]), u32::from(row < last[1]));
            texels.weights[0][lane] = (1.0 - u) * (1.0 - v);
            texels.weights[1][lane] = u * (1.0 - v);
            texels.weights[2][lane] = (1.0 - u) * v;
            texels.weights[3][lane] = u * v;
        }
        texels
    }

    /// The numbers at a pixel's place, blended: as many as `means` has, of which those of the basis mean something.
    #[inline(always)]
    fn fetch<S: Simd>(&self, simd: S, texels: &Texels, places: &Places, lane: usize, means: &mut [f32]) {
        let (count, references) = (self.count + BESIDE, self.references.count());
        let a_side = self.width * count;
        let reference = places.references[lane] as usize;
        let first = texels.rows[lane] as usize * references + reference;
        let first = (first * self.width + texels.columns[lane] as usize) * count;
        let right = texels.right[lane] as usize * count;
        let down = texels.down[lane] as usize * references * a_side;
        let weights = texels.weights.map(|weights| weights[lane]);
        let part = places.parts[lane];
        let sides: &[f32] = if references > 1 { &[1.0 - part, part] } else { &[1.0] };
        for (block, means) in means.chunks_exact_mut(EIGHT).enumerate() {
            let mut sum = f32x8::splat(simd, 0.0);
            for (side, &part) in sides.iter().enumerate() {
                let first = first + side * a_side + block * EIGHT;
                let of = |texel: usize, weight: f32| T::eight(simd, &self.numbers[texel..][..EIGHT]) * weight;
                let [a, b] = [of(first, weights[0]), of(first + right, weights[1])];
                let below = first + down;
                let [c, d] = [of(below, weights[2]), of(below + right, weights[3])];
                sum += ((a + b) + (c + d)) * part;
            }
            sum.store_slice(means);
        }
    }
}

/// Four texels about each of some pixels' places; nearest fetches have the weight of one.
#[derive(Default)]
struct Texels {
    /// The first one of the four, and whether there are neighbours.
    columns: [u32; LANES],
    rows: [u32; LANES],
    right: [u32; LANES],
    down: [u32; LANES],
    weights: [[f32; LANES]; 4],
}

/// Turns fetched numbers into shares.
trait Answer {
    /// The shares of the pixels.
    fn answer(&self, places: &Places, out: &mut [f32; LANES]);
}

struct FromSeries<'a, T> {
    map: &'a Answers<'a, T>,
    simd: Level,
}

impl<T: Number> Answer for FromSeries<'_, T> {
    #[inline(always)]
    fn answer(&self, places: &Places, out: &mut [f32; LANES]) {
        let count = self.map.count + BESIDE;
        let mut of_pixel = [0.0f32; MOST + EIGHT];
        let mut means = [[0.0f32; LANES]; MOST + BESIDE];
        let texels = self.map.texels(places);
        at_level!(self.simd, simd => {
            for lane in 0..LANES {
                let of_pixel = &mut of_pixel[..count.next_multiple_of(EIGHT)];
                self.map.fetch(simd, &texels, places, lane, of_pixel);
                for (means, &mean) in means[..count].iter_mut().zip(&*of_pixel) {
                    means[lane] = mean;
                }
            }
        });
        for lane in 0..LANES {
            out[lane] = means[0][lane] + 0.5 * means[1][lane];
        }
        harmonics(&places.depths.map(place), self.map.count / 2, |k, sines, cosines| {
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

/// N is half the number of moments, P room for the numbers of a reference: a power of two.
struct FromMoments<'a, T, const N: usize, const P: usize> {
    map: &'a Answers<'a, T>,
    simd: Level,
    bias: f64,
}

impl<T: Number, const N: usize, const P: usize> Answer for FromMoments<'_, T, N, P> {
    #[inline(always)]
    fn answer(&self, places: &Places, out: &mut [f32; LANES]) {
        let mut z = [0.0f32; LANES];
        for (z, &depth) in z.iter_mut().zip(&places.depths) {
            *z = place(depth) * 2.0 - 1.0;
        }
        let texels = self.map.texels(places);
        at_level!(self.simd, simd => {
            let mut fetched = [[0.0f32; P]; LANES];
            for (lane, fetched) in fetched.iter_mut().enumerate() {
                self.map.fetch(simd, &texels, places, lane, fetched);
            }
            let of = |value: f32| f32x16::splat(simd, value);
            let numbers = by_number(simd, &fetched);
            let doubt = numbers[1].max(of(0.0));
            let inverse = of(1.0) / doubt.max(of(1e-12));
            let mut moments = [of(1.0); MOST_POWERS];
            for (moment, number) in moments[1..=2 * N].iter_mut().zip(&numbers[BESIDE..]) {
                *moment = *number * inverse;
            }
            let dark = middle::<N, _>(simd, &moments, f32x16::from_slice(simd, &z), self.bias);
            let lit = numbers[0] + doubt * (of(1.0) - dark).max(of(0.0));
            lit.store_slice(out);
        });
    }
}

/// The middle of the bounds of the mass below z: in f32, but of eight moments, whose smallest pivots f32 does not resolve.
#[inline(always)]
fn middle<const N: usize, S: Simd>(
    simd: S,
    moments: &[f32x16<S>; MOST_POWERS],
    z: f32x16<S>,
    bias: f64,
) -> f32x16<S> {
    if N < 4 {
        let bounds = mass_below::<N, _, _>(simd, moments, z, bias);
        return bounds.least + bounds.width * 0.5;
    }
    let mut out = [0.0f32; LANES];
    for (half, out) in out.chunks_exact_mut(LANES / 2).enumerate() {
        let widened = |numbers: &f32x16<S>| {
            let mut values = [0.0f64; LANES / 2];
            for (value, &number) in values.iter_mut().zip(&numbers.as_slice()[half * (LANES / 2)..]) {
                *value = f64::from(number);
            }
            f64x8::from_slice(simd, &values)
        };
        let mut wide = [f64x8::splat(simd, 1.0); MOST_POWERS];
        for (wide, moment) in wide.iter_mut().zip(moments) {
            *wide = widened(moment);
        }
        let bounds = mass_below::<N, _, _>(simd, &wide, widened(&z), bias);
        let middle = bounds.least + bounds.width * 0.5;
        for (out, &middle) in out.iter_mut().zip(middle.as_slice()) {
            *out = middle as f32;
        }
    }
    f32x16::from_slice(simd, &out)
}
