//! View rays answered by the moments of their rows: shares of the unoccluded light, each with a certificate.

use std::ops::Range;

use fearless_simd::f64x8;
use fearless_simd::prelude::*;

use super::bounds::{MOST_POWERS, mass_below};
use super::filtered_row::MomentRow;
use crate::runs::{Asked, Certain, DepthScale, Runs};
use crate::weights::BandWeights;

/// View rays that are answered side by side.
const LANES: usize = 8;

/// What moments say of a view ray.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Answer {
    /// Share of its unoccluded light.
    pub share: f32,
    /// Largest error of it, from above.
    pub certificate: f32,
}

/// A band of a slice whose view rays ask the same filtered rows.
pub struct MomentAnswers<'a> {
    /// Rows of the nearer reference ray and of the farther one.
    pub rows: &'a [MomentRow; 2],
    /// Weights of the band.
    pub band: &'a BandWeights,
    /// The slice's runs.
    pub runs: Runs<'a>,
    /// How columns become depths.
    pub scale: DepthScale,
    /// Of a channel.
    pub channel: usize,
    /// Part that is replaced by the distribution of most entropy.
    pub bias: f64,
    /// Largest colour of the light.
    pub brightest: f32,
}

impl MomentAnswers<'_> {
    /// Answers the view rays `range`, the band's own; N is half the number of moments. Per view ray one gather of a run's means from
    /// each of two rows, and an eighth of a [`mass_below`].
    #[inline(always)]
    pub fn answer<const N: usize, S: Simd>(
        &self,
        simd: S,
        asked: &Asked,
        range: Range<usize>,
        out: &mut [Answer],
    ) {
        let mut powers = [[1.0f64; LANES]; MOST_POWERS];
        let (mut places, mut amounts, mut lit) = ([0.5f64; LANES], [1.0f64; LANES], [0.0f64; LANES]);
        for first in range.clone().step_by(LANES) {
            let lanes = LANES.min(range.end - first);
            for lane in 0..lanes {
                let ray = first + lane;
                let (moments, lit_for_all) = self.moments::<N>(asked, ray, ray - range.start);
                (amounts[lane], lit[lane]) = (moments[0], lit_for_all);
                for (powers, moment) in powers.iter_mut().zip(moments) {
                    powers[lane] = moment;
                }
                places[lane] = self.scale.view_ray(asked.ranks[ray]);
            }
            let load = |lanes: &[f64; LANES]| f64x8::from_slice(simd, lanes);
            let amount = load(&amounts);
            // Where nothing is in doubt, nothing is multiplied by nothing.
            let inverse = f64x8::splat(simd, 1.0) / amount.max(f64x8::splat(simd, 1e-200));
            let mut moments = [inverse; MOST_POWERS];
            for (moment, powers) in moments.iter_mut().zip(&powers) {
                *moment = load(powers) * inverse;
            }
            let bounds = mass_below::<N, S, _>(simd, &moments, load(&places), self.bias);
            let half = bounds.width * 0.5;
            let part = (f64x8::splat(simd, 1.0) - bounds.least - half).max(f64x8::splat(simd, 0.0));
            let (shares, doubts) = (part * amount + load(&lit), (half + self.bias) * amount);
            for lane in 0..lanes {
                let place = first + lane - range.start;
                let (share, doubt) = (shares.as_slice()[lane] as f32, doubts.as_slice()[lane] as f32);
                // Wrong weights are off by a part of all light, or by a part of what is lit.
                let (apart, relative) = (
                    self.brightest * self.band.apart[place],
                    self.band.relative[place] * (share + doubt).max(f32::MIN_POSITIVE),
                );
                let weights = if relative < apart { relative } else { apart };
                out[first + lane] =
                    Answer { share, certificate: doubt + weights + self.brightest * self.band.rough[place] };
            }
        }
    }

    /// The moments b₀ to b₈ of the light up to the end of a ray that is in doubt, and the light that is lit for the whole band, both over
    /// the ray's unoccluded white light; `place` is the ray's place in the band.
    #[inline(always)]
    fn moments<const N: usize>(&self, asked: &Asked, ray: usize, place: usize) -> ([f64; MOST_POWERS], f64) {
        let run = asked.ends[ray] as usize;
        let certain = self.scale.certain(self.runs.lit[run]);
        let z = self.scale.surface(self.runs.lit[run]);
        let mut lit = 0.0;
        let colour = self.runs.colour(self.channel).map_or(1.0, |colour| colour[run]);
        let mut sums = [0.0f64; MOST_POWERS];
        let blend = self.band.blend[place];
        let references = if self.band.blends { 2 } else { 1 };
        for side in 0..references {
            let row = &self.rows[side];
            let whole = self.band.ends[side][place];
            let own = f64::from(colour * (whole - self.band.starts[side][run]).max(0.0));
            let [before, lit_before] = row.totals(run).map(f64::from);
            let part = if side == 0 { 1.0 - blend } else { blend };
            let factor = f64::from(part) / f64::from(whole);
            let means = row.means(run);
            let (own, before) = (own * factor, before * factor);
            lit += lit_before * factor + if certain == Certain::Lit { own } else { 0.0 };
            let own = if certain == Certain::No { own } else { 0.0 };
            sums[0] += own + before;
            let mut power = own;
            for (sum, &mean) in sums[1..=2 * N].iter_mut().zip(&means) {
                power *= z;
                *sum += before * f64::from(mean) + power;
            }
        }
        (sums, lit)
    }
}
