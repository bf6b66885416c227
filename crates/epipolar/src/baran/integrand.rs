//! What is summed over lit light rays: the factors of a sun or a lamp, as tables that every slice reads.
//!
//! A sun's factors are the same for all slices (Baran et al. 2010, Section 6: one factorisation a frame), and bands of
//! 1/sin β share them too. A lamp's depend on its cone, which cuts slices in different places: the factors stay, and a
//! slice multiplies them by its cone while it sums them up.

use std::f64::consts::PI;

use glam::DVec3;
use scatter_core::{Light, Medium, Setup, SpotLight};

use super::bands::Bands;
use super::factor::{Factorisation, Factors, LampBands, LampMedium};
use crate::geometry::{SlicePlane, direction_of_diamond_angle};

/// Where rays end for the sums: e⁻¹⁷ = 4e-8 of the light is left. Larger values spend factors on nothing.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// Intervals of a lamp's table over γ in [0, 2]. Fewer blur the cone's edge, more cost every slice.
const TURNS: usize = 1024;

/// Factors of all channels of a setup.
#[derive(Debug, Default)]
pub struct Integrand {
    channels: usize,
    sun: Vec<SunChannel>,
    lamp: Vec<LampChannel>,
    bands: Option<Bands>,
    /// Per interval of a lamp's table: cosine and sine of γ in its middle.
    turns: Vec<[f32; 2]>,
}

#[derive(Debug, Default)]
struct SunChannel {
    factors: Factors,
    /// Length of a view ray at which the factors' domain ends.
    length: f64,
}

#[derive(Debug, Default)]
struct LampChannel {
    bands: LampBands,
    /// Per band `[interval][lane]`: `∫ Γ dγ` over the interval, without a cone.
    pieces: Vec<Vec<f32>>,
}

/// One band of one channel, for one slice.
pub struct BandTables<'a> {
    /// `∫ Γ` up to a light ray, `[node][lane]`, uniform in γ.
    pub prefix: &'a [f32],
    /// Turns γ into [0, 1] over the prefix.
    pub per_gamma: f64,
    /// B, `[node][lane]`, uniform in the view coordinate.
    pub weights: &'a [f32],
    /// View coordinate of the first node.
    pub first_view: f64,
    /// Turns the difference to it into [0, 1].
    pub per_view: f64,
}

/// How a frame's integrand is to be factorised.
#[derive(Debug, Clone, Copy)]
pub struct Precision {
    /// By which of the ways (a lamp has one of its own).
    pub factorisation: Factorisation,
    /// Fixed number of terms.
    pub rank: Option<u32>,
    /// Else largest error.
    pub error: f64,
}

impl Integrand {
    /// Factorises the integrand of a frame whose view rays are at most `longest` long.
    pub fn rebuild(&mut self, setup: &Setup<'_>, bands: Bands, longest: f64, precision: Precision) {
        let medium = setup.medium();
        match setup.light() {
            Light::Directional(_) => {
                self.lamp.clear();
                self.bands = Some(bands);
                self.channels = if medium.is_grey() { 1 } else { 3 };
                self.sun.resize_with(self.channels, SunChannel::default);
                for (channel, sigma) in self.sun.iter_mut().zip(medium.sigma_t()) {
                    channel.rebuild(sigma, bands.ratio, longest, precision);
                }
            }
            Light::Point(_) | Light::Spot(_) => {
                self.sun.clear();
                self.bands = None;
                self.channels = if scatters_alike(medium) { 1 } else { 3 };
                let position = setup.light().position().unwrap_or_default();
                let distance = (position - setup.camera().eye()).length();
                if self.turns.is_empty() {
                    self.turns.extend((0..TURNS).map(|interval| {
                        let middle = (interval as f64 + 0.5) * (2.0 / TURNS as f64);
                        direction_of_diamond_angle(middle).normalize().as_vec2().to_array()
                    }));
                }
                self.lamp.resize_with(self.channels, LampChannel::default);
                for (index, channel) in self.lamp.iter_mut().enumerate() {
                    channel.rebuild(medium, index, bands, distance, longest, precision);
                }
            }
        }
    }

    /// Channels that are summed apart.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Floats a term of the widest table takes.
    pub fn lanes(&self) -> usize {
        let sun = self.sun.iter().map(|channel| channel.factors.lanes());
        let lamp = self.lamp.iter().flat_map(|channel| channel.bands.bands()).map(|band| band.lanes());
        sun.chain(lamp).max().unwrap_or(1)
    }

    /// Largest error of a lamp's factors, as measured when they were made; a sun's keep their bound.
    pub fn lamp_error(&self) -> f64 {
        self.lamp.iter().map(|channel| channel.bands.error()).fold(0.0, f64::max)
    }

    /// Largest number of terms.
    pub fn rank(&self) -> usize {
        let sun = self.sun.iter().map(|channel| channel.factors.rank());
        let lamp = self.lamp.iter().flat_map(|channel| channel.bands.bands()).map(|band| band.rank());
        sun.chain(lamp).max().unwrap_or(1)
    }

    /// Number of bands of the channel that has most.
    pub fn band_count(&self) -> usize {
        let lamp = self.lamp.iter().map(|channel| channel.bands.bands().len()).max();
        lamp.unwrap_or(self.bands.map_or(0, |bands| bands.count as usize))
    }

    /// How far along a view ray light counts.
    pub fn longest(&self) -> f64 {
        self.sun.iter().map(|channel| channel.length).fold(0.0, f64::max)
    }

    /// The band of a view ray, by its view coordinate (1/sin β for a sun, β for a lamp), and from where to where on that
    /// coordinate the band reaches.
    #[inline(always)]
    pub fn band_of(&self, channel: usize, view: f32) -> (usize, [f32; 2]) {
        match &self.bands {
            Some(bands) => {
                let (band, span) = bands.of(view);
                (band as usize, span)
            }
            None => self.lamp[channel].bands.band_of(view),
        }
    }

    /// The tables of a band. A lamp's prefix is summed up in `buffer`, through the cone of the slice.
    #[inline(always)]
    pub fn tables<'a>(
        &'a self,
        channel: usize,
        band: usize,
        cone: &[f32],
        buffer: &'a mut [f32],
    ) -> (BandTables<'a>, usize) {
        if let Some(bands) = &self.bands {
            let channel = &self.sun[channel];
            let start = bands.start(band as u32);
            let tables = BandTables {
                prefix: channel.factors.prefix(),
                per_gamma: start / channel.length,
                weights: channel.factors.weights(),
                first_view: start,
                per_view: 1.0 / (start * (bands.ratio - 1.0)),
            };
            return (tables, channel.factors.lanes());
        }
        let channel = &self.lamp[channel];
        let factors = &channel.bands.bands()[band];
        let lanes = factors.lanes();
        let pieces = &channel.pieces[band];
        let buffer = &mut buffer[..(TURNS + 1) * lanes];
        match lanes {
            1 => accumulate::<1>(pieces, cone, buffer),
            2 => accumulate::<2>(pieces, cone, buffer),
            4 => accumulate::<4>(pieces, cone, buffer),
            _ => accumulate::<8>(pieces, cone, buffer),
        }
        let span = factors.b_max() - factors.b_min();
        let tables = BandTables {
            prefix: buffer,
            per_gamma: 0.5,
            weights: factors.weights(),
            first_view: factors.b_min(),
            per_view: if span > 0.0 { 1.0 / span } else { 0.0 },
        };
        (tables, lanes)
    }

    /// Floats that [`Self::tables`] needs.
    pub fn buffer_len(&self) -> usize {
        if self.lamp.is_empty() { 0 } else { (TURNS + 1) * self.lanes() }
    }

    /// Fills `cone`, one factor an interval, for a slice; empty without a cone.
    #[inline(always)]
    pub fn fill_cone(&self, spot: Option<&SpotLight>, plane: &SlicePlane, cone: &mut Vec<f32>) {
        cone.clear();
        let Some(spot) = spot else { return };
        let axis: DVec3 = spot.direction();
        let (towards, across) = (-axis.dot(plane.to_light) as f32, axis.dot(plane.across) as f32);
        let (outer, slope) = (spot.cos_outer() as f32, spot.cone_slope() as f32);
        cone.extend(self.turns.iter().map(|[cos, sin]| {
            let factor = ((towards * cos + across * sin - outer) * slope).clamp(0.0, 1.0);
            factor * factor
        }));
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let sun = self.sun.iter().map(|c| c.factors.prefix().len() + c.factors.weights().len());
        let lamp = self.lamp.iter().map(|c| {
            let tables: usize = c.bands.bands().iter().map(|b| b.gamma().len() + b.weights().len()).sum();
            tables + c.pieces.iter().map(Vec::capacity).sum::<usize>()
        });
        4 * (sun.chain(lamp).sum::<usize>() + 2 * self.turns.capacity())
    }
}

/// Running sums of pieces, each times its factor of the cone.
#[inline(always)]
fn accumulate<const N: usize>(pieces: &[f32], cone: &[f32], out: &mut [f32]) {
    let (pieces, out) = (pieces.as_chunks::<N>().0, out.as_chunks_mut::<N>().0);
    let mut sum = [0.0f32; N];
    out[0] = sum;
    for (interval, piece) in pieces.iter().enumerate() {
        let factor = cone.get(interval).copied().unwrap_or(1.0);
        for term in 0..N {
            sum[term] += factor * piece[term];
        }
        out[interval + 1] = sum;
    }
}

/// Whether one sum serves all channels of a lamp: one extinction, and one colour for all angles.
fn scatters_alike(medium: &Medium) -> bool {
    let components = medium.components();
    let anisotropic = components.iter().any(|component| !component.phase.is_isotropic());
    let grey = |sigma: [f64; 3]| sigma[0] == sigma[1] && sigma[1] == sigma[2];
    medium.is_grey() && (!anisotropic || components.len() == 1 || components.iter().all(|c| grey(c.sigma_s)))
}

impl SunChannel {
    fn rebuild(&mut self, sigma: f64, ratio: f64, longest: f64, precision: Precision) {
        // A channel without extinction scatters nothing; any finite length will do.
        let reach = if sigma > 0.0 { NEGLIGIBLE_OPTICAL_DEPTH / sigma } else { f64::MAX };
        self.length = longest.min(reach).clamp(1e-30, 1e30);
        let depth = sigma * self.length;
        let rank = match precision.rank {
            Some(rank) => rank as usize,
            None => Factors::rank_for(precision.error, depth, ratio).unwrap_or(8),
        };
        self.factors.rebuild(precision.factorisation, rank, depth, ratio);
    }
}

impl LampChannel {
    fn rebuild(
        &mut self,
        medium: &Medium,
        channel: usize,
        bands: Bands,
        distance: f64,
        longest: f64,
        precision: Precision,
    ) {
        let phase = |haversine: f64| {
            let rgb = medium.scattering_towards(haversine);
            // A channel that scatters nothing is dark whatever its factors are.
            if rgb[channel] > 0.0 { rgb[channel] } else { rgb.max_element().max(f64::MIN_POSITIVE) }
        };
        let around = LampMedium {
            optical_depth: medium.sigma_t()[channel] * distance,
            reach: (longest / distance).clamp(1e-6, 1e6),
            phase: &phase,
        };
        let max_rank = precision.rank.map_or(8, |rank| rank as usize);
        let [b_min, b_max] = bands.angles;
        self.bands.rebuild(&around, b_min, b_max, max_rank, precision.error);
        let count = self.bands.bands().len();
        // One more than there are, all of them as wide as can be: the camera's next step may ask for it.
        self.pieces.resize_with((count + 1).max(self.pieces.len()), || Vec::with_capacity(8 * TURNS));
        for (pieces, factors) in self.pieces.iter_mut().zip(self.bands.bands()) {
            pieces.clear();
            let lanes = factors.lanes();
            let angle = |turn: f64| {
                let direction = direction_of_diamond_angle(turn);
                direction.y.atan2(direction.x)
            };
            let mut from = 0.0;
            for interval in 0..TURNS {
                let to = if interval + 1 == TURNS {
                    PI
                } else {
                    angle((interval + 1) as f64 * (2.0 / TURNS as f64))
                };
                pieces.extend(&factors.integral(from, to)[..lanes]);
                from = to;
            }
        }
    }
}
