//! The weights of a frame's light rays: what they are of, and which view rays share them.

use std::ops::Range;

use epipolar::driver::SliceView;
use scatter_core::Setup;

use super::band::{BandWeights, QueryRays};
use super::fog_rays::Fog;
use super::phase_table::{fill_phase, lobe_of};

/// Half L1 distance of a blend half way between knots that are one optical depth apart.
const BLEND_AT_ONE: f64 = 0.0041;

/// Largest ratio of two knots: beyond it thin media gain nothing.
const WIDEST: f64 = 4.0;

/// Columns of a band without knots: filtering its rows costs about what asking them does.
const MOST_COLUMNS: u32 = 64;

/// Largest ratio of the sines of a lamp's band: beside the epipole the light rays that view rays meet differ as those do.
const MOST_ALIKE: f32 = 1.25;

/// Weights of a frame's light rays.
#[derive(Debug, Default)]
pub struct Weights {
    /// σt of each channel.
    pub(super) sigma_t: [f32; 3],
    /// Whether transmittance is left out.
    pub(super) even: bool,
    /// Ratio of neighbouring knots of 1/sin β, of each channel.
    ratios: [f64; 3],
    pub(super) fog: Option<Fog>,
    /// Optical depth of each channel between eye and lamp.
    pub(super) to_lamp: Option<[f32; 3]>,
    /// A lamp's phase function over the angle, of each channel; empty where it does not depend on it.
    pub(super) phases: [Vec<f32>; 3],
    /// Largest change of its logarithm, of each channel \[1/radian\].
    pub(super) lobes: [f32; 3],
}

impl Weights {
    /// For a frame: `even` leaves transmittance out; `error` is what blended weights may be off by.
    pub fn set_up(&mut self, setup: &Setup<'_>, even: bool, error: f64, longest_ray: f64) {
        let medium = setup.medium();
        let sigma_t = medium.sigma_t();
        let eye = setup.camera().eye();
        let position = setup.light().position();
        let ratios = sigma_t.map(|sigma| {
            let deepest = sigma * longest_ray;
            let apart = (error / BLEND_AT_ONE).sqrt();
            // At a band's far knot the deepest ray of its near one would be deeper by the ratio.
            if deepest > 0.0 { 1.0 + apart / deepest } else { WIDEST }
        });
        self.sigma_t = sigma_t.map(|sigma| sigma as f32);
        self.even = even;
        self.ratios = ratios.map(|ratio| ratio.clamp(1.02, WIDEST));
        self.fog = Fog::of(medium);
        self.to_lamp = position.map(|lamp| sigma_t.map(|sigma| (sigma * (lamp - eye).length()) as f32));
        if position.is_some() {
            for (channel, phase) in self.phases.iter_mut().enumerate() {
                fill_phase(setup, channel, phase);
                self.lobes[channel] = lobe_of(phase);
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.phases.iter().map(Vec::capacity).sum::<usize>()
    }

    /// Whether the light is a sun in a uniform medium.
    pub fn is_plain_sun(&self) -> bool {
        self.fog.is_none() && self.to_lamp.is_none()
    }

    /// The end of the band that begins with the query `first`: as many as have the same references.
    #[inline(always)]
    pub fn band_end(&self, channel: usize, slice: &SliceView<'_>, columns: &[u32], first: usize) -> usize {
        if !self.is_plain_sun() || self.even {
            // The fewer view rays, the nearer is each to its reference, and the less of the row is in doubt.
            let last = columns[first] + MOST_COLUMNS;
            let end = first + columns[first..].partition_point(|&column| column < last);
            return if self.to_lamp.is_some() && !self.even {
                alike_end(slice, columns, first..end)
            } else {
                end
            };
        }
        let sines = slice.sines();
        let [near, far] = self.knots(channel, sines[columns[first] as usize]);
        let beyond = |&column: &u32| {
            let cosecant = 1.0 / sines[column as usize];
            !(cosecant >= near && cosecant < far)
        };
        columns[first + 1..].iter().position(beyond).map_or(columns.len(), |count| first + 1 + count)
    }

    /// The knots of 1/sin β around a view ray.
    #[inline(always)]
    pub(super) fn knots(&self, channel: usize, sine: f32) -> [f32; 2] {
        let ratio = self.ratios[channel];
        let cosecant = 1.0 / sine;
        let power = f64::from(cosecant).ln() / ratio.ln();
        let near = ratio.powf(power.floor()) as f32;
        // Rounding may put a knot itself on its other side.
        let near = if near > cosecant { near / ratio as f32 } else { near };
        [near, near * ratio as f32]
    }

    /// Fills the weights of a band's queries and of the runs that begin at `starts`.
    #[inline(always)]
    pub fn fill(
        &self,
        channel: usize,
        slice: &SliceView<'_>,
        rays: QueryRays<'_>,
        starts: &[f32],
        band: &mut BandWeights,
    ) {
        band.make_room(starts.len(), rays.columns.len());
        band.blends = false;
        band.rough[..rays.columns.len()].fill(0.0);
        if self.to_lamp.is_some() {
            self.fill_lamp(channel, slice, rays, starts, band);
        } else if self.fog.is_some() {
            self.fill_fog(channel, slice, rays, starts, band);
        } else if self.even {
            self.fill_even(channel, slice, rays, starts, band);
        } else {
            self.fill_blend(channel, slice, rays, starts, band);
        }
    }
}

/// The end of the view rays around a lamp whose sines are like the first's.
fn alike_end(slice: &SliceView<'_>, columns: &[u32], rays: Range<usize>) -> usize {
    let sine = |query: usize| slice.sines()[columns[query] as usize];
    let own = sine(rays.start);
    let alike = |&query: &usize| sine(query) <= own * MOST_ALIKE && own <= sine(query) * MOST_ALIKE;
    rays.start + rays.take_while(alike).count().max(1)
}
