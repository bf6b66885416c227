//! View rays answered by the Fourier series of their rows: one dot product each, clamped.

use std::ops::Range;

use super::filtered_row::{FourierRow, MOST, place};
use super::harmonics::{LANES, harmonics};
use crate::runs::{Asked, DepthScale, Runs};
use crate::weights::BandWeights;

/// Coefficients of a column's view ray; a buffer: pixels of one column share them.
#[derive(Debug)]
pub struct Terms {
    of_rank: Option<u32>,
    terms: Box<[f32; MOST]>,
}

impl Default for Terms {
    fn default() -> Self {
        Self { of_rank: None, terms: Box::new([0.0; MOST]) }
    }
}

impl Terms {
    /// Forgets what the slice before has left.
    pub fn clear(&mut self) {
        self.of_rank = None;
    }

    /// `2/c_k` times cosine and −sine of a view ray that comes after `rank` columns.
    #[inline(always)]
    fn of(&mut self, rank: u32, scale: DepthScale, count: usize) -> &[f32] {
        if self.of_rank != Some(rank) {
            self.of_rank = Some(rank);
            let z = [place(scale.view_ray(rank)); LANES];
            let terms = &mut self.terms;
            harmonics(&z, count / 2, |k, sines, cosines| {
                let factor = 2.0 / ((2 * k + 1) as f32 * std::f32::consts::PI);
                (terms[2 * k], terms[2 * k + 1]) = (factor * cosines[0], -factor * sines[0]);
            });
        }
        &self.terms[..count]
    }
}

/// A band of a slice whose view rays ask the same filtered rows.
pub struct FourierAnswers<'a> {
    /// Rows of the nearer reference ray and of the farther one.
    pub rows: &'a [FourierRow; 2],
    /// Weights of the band.
    pub band: &'a BandWeights,
    /// The slice's runs.
    pub runs: Runs<'a>,
    /// How columns become depths.
    pub scale: DepthScale,
    /// Of a channel.
    pub channel: usize,
    /// Coefficients of the series.
    pub count: usize,
}

impl FourierAnswers<'_> {
    /// Answers the view rays `range`, the band's own, with shares of their unoccluded light.
    #[inline(always)]
    pub fn answer(&self, asked: &Asked, range: Range<usize>, terms: &mut Terms, out: &mut [f32]) {
        let mut means = [0.0f32; MOST];
        let means = &mut means[..self.count];
        for ray in range.clone() {
            let place_in_band = ray - range.start;
            let run = asked.ends[ray] as usize;
            let terms = terms.of(asked.ranks[ray], self.scale, self.count);
            // What the ray's own run adds is lit or not, exactly.
            let own_is_lit = if self.runs.lit[run] > asked.ranks[ray] { 1.0 } else { 0.0 };
            let colour = self.runs.colour(self.channel).map_or(1.0, |colour| colour[run]);
            let blend = self.band.blend[place_in_band];
            let mut share = 0.0;
            for side in 0..if self.band.blends { 2 } else { 1 } {
                let row = &self.rows[side];
                row.means(run, means);
                let dot = dot(terms, means);
                let visible = (0.5 + dot).clamp(0.0, 1.0);
                let whole = self.band.ends[side][place_in_band];
                let own = colour * (whole - self.band.starts[side][run]).max(0.0);
                let part = if side == 0 { 1.0 - blend } else { blend };
                let [before, lit_before] = row.totals(run);
                share += part * (visible * before + lit_before + own * own_is_lit) / whole;
            }
            // A ray without light has no shadow.
            out[ray] = if share >= 0.0 { share } else { 1.0 };
        }
    }
}

/// Sixteen sums side by side.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (blocks, rest) = a.as_chunks::<LANES>();
    let (own, own_rest) = b.as_chunks::<LANES>();
    for (a, b) in blocks.iter().zip(own) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = rest.iter().zip(own_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}
