//! A band of a slice: view rays whose pixels are answered from the same filtered rows, and the weights of those.

use epipolar::driver::{SliceLight, SliceView};
use scatter_core::{RayLanes, Setup};

use super::absorbed::absorbed;
use super::difference::{
    from_even, from_even_relative, of_blend, of_blend_relative, of_log_range, of_log_range_relative,
};
use super::fog_rays::Fog;
use super::lamp_table::{LampTable, detour};

const LANES: usize = RayLanes::COUNT;

/// Half L1 distance of a blend half way between knots that are one optical depth apart.
const BLEND_AT_ONE: f64 = 0.0041;

/// Largest ratio of two knots: beyond it thin media gain nothing.
const WIDEST: f64 = 4.0;

/// Columns of a band without knots: filtering its rows costs about what asking them does.
const MOST_COLUMNS: u32 = 64;

/// Weights of a frame's light rays.
#[derive(Debug, Default)]
pub struct Weights {
    /// σt of each channel.
    sigma_t: [f32; 3],
    /// Whether transmittance is left out.
    even: bool,
    /// Ratio of neighbouring knots of 1/sin β, of each channel.
    ratios: [f64; 3],
    fog: Option<Fog>,
    /// Optical depth of each channel between eye and lamp.
    to_lamp: Option<[f32; 3]>,
    /// A lamp's phase function over the angle, of each channel; empty where it does not depend on it.
    phases: [Vec<f32>; 3],
    /// Largest change of its logarithm, of each channel \[1/radian\].
    lobes: [f32; 3],
}

/// View rays of some queries, column by column.
#[derive(Clone, Copy)]
pub struct QueryRays<'a> {
    /// Column of each, from the slice's first.
    pub columns: &'a [u32],
    /// The light ray in which each ends.
    pub gammas: &'a [f32],
}

/// Weights of one band, up to each of its row's runs and to the ends of its view rays; a buffer.
#[derive(Debug, Default)]
pub struct BandWeights {
    /// Up to the start of each run, by the nearer reference and the farther one (which are one where nothing is blended).
    pub starts: [Vec<f32>; 2],
    /// Up to the end of each query's ray.
    pub ends: [Vec<f32>; 2],
    /// Part of the farther reference, of each query.
    pub blend: Vec<f32>,
    /// Half the L1 distance of these weights from the query's own, from above.
    pub apart: Vec<f32>,
    /// What they are off by of a query's lit share, relative to it, from above.
    pub relative: Vec<f32>,
    /// What a lamp's table adds, of all light.
    pub rough: Vec<f32>,
    /// Whether there are two references.
    pub blends: bool,
    lamp: LampTable,
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
            return first + columns[first..].partition_point(|&column| column < last);
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
    fn knots(&self, channel: usize, sine: f32) -> [f32; 2] {
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

    /// A sun's rays, all alike.
    #[inline(always)]
    fn fill_even(
        &self,
        channel: usize,
        slice: &SliceView<'_>,
        rays: QueryRays<'_>,
        starts: &[f32],
        band: &mut BandWeights,
    ) {
        band.starts[0][..starts.len()].copy_from_slice(starts);
        let count = rays.columns.len();
        band.ends[0][..count].copy_from_slice(rays.gammas);
        let sigma = self.sigma_t[channel];
        let bounds = band.apart.iter_mut().zip(&mut band.relative);
        for ((apart, relative), (&column, &gamma)) in bounds.zip(rays.columns.iter().zip(rays.gammas)) {
            let depth = sigma * gamma / slice.sines()[column as usize];
            (*apart, *relative) = (from_even(depth), from_even_relative(depth));
        }
        band.blend[..count].fill(0.0);
    }

    /// A sun in a uniform medium, between two knots.
    #[inline(always)]
    fn fill_blend(
        &self,
        channel: usize,
        slice: &SliceView<'_>,
        rays: QueryRays<'_>,
        starts: &[f32],
        band: &mut BandWeights,
    ) {
        let sigma = self.sigma_t[channel];
        let knots = self.knots(channel, slice.sines()[rays.columns[0] as usize]);
        band.blends = true;
        for (side, &knot) in knots.iter().enumerate() {
            let extinction = sigma * knot;
            for (weight, &start) in band.starts[side].iter_mut().zip(starts) {
                *weight = absorbed(extinction * start);
            }
            for (weight, &gamma) in band.ends[side].iter_mut().zip(rays.gammas) {
                *weight = absorbed(extinction * gamma);
            }
        }
        let [near, far] = knots;
        let bounds = band.apart.iter_mut().zip(&mut band.relative);
        let queries = band.blend.iter_mut().zip(bounds).zip(rays.columns.iter().zip(rays.gammas));
        for ((blend, (apart, relative)), (&column, &gamma)) in queries {
            let cosecant = 1.0 / slice.sines()[column as usize];
            *blend = ((cosecant - near) / (far - near)).clamp(0.0, 1.0);
            let depth = sigma * gamma;
            let depths = [depth * cosecant, depth * near, depth * far];
            *apart = of_blend(depths[0], depths[1], depths[2]);
            *relative = of_blend_relative(depths[0], depths[1], depths[2]);
        }
    }

    /// Height fog: the middle view ray's own transmittances.
    #[inline(always)]
    fn fill_fog(
        &self,
        channel: usize,
        slice: &SliceView<'_>,
        rays: QueryRays<'_>,
        starts: &[f32],
        band: &mut BandWeights,
    ) {
        let Some(fog) = &self.fog else { return };
        let (count, middle) = (rays.columns.len(), middle_of(slice, rays.columns));
        let mut slope = 0.0;
        let mut fill = |gammas: &[f32], out: &mut [f32]| {
            for (gammas, out) in gammas.chunks(LANES).zip(out.chunks_mut(LANES)) {
                let mut lanes = [0.0f32; LANES];
                lanes[..gammas.len()].copy_from_slice(gammas);
                let [depths, slopes] = fog.depths(slice, channel, &[middle; LANES], &lanes);
                slope = slopes[0];
                out.copy_from_slice(&depths[..gammas.len()]);
            }
        };
        if self.even {
            band.starts[0][..starts.len()].copy_from_slice(starts);
            band.ends[0][..count].fill(0.0);
        } else {
            fill(starts, &mut band.starts[0][..starts.len()]);
            band.starts[0][..starts.len()].iter_mut().for_each(|depth| *depth = absorbed(*depth));
            fill(rays.gammas, &mut band.ends[0][..count]);
        }
        for first in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - first);
            let (mut columns, mut gammas) = ([rays.columns[first]; LANES], [0.0f32; LANES]);
            columns[..lanes].copy_from_slice(&rays.columns[first..first + lanes]);
            gammas[..lanes].copy_from_slice(&rays.gammas[first..first + lanes]);
            let [depths, slopes] = fog.depths(slice, channel, &columns, &gammas);
            for lane in 0..lanes {
                let (own, reference) = (depths[lane], band.ends[0][first + lane]);
                let turn = (slopes[lane] - slope) * gammas[lane];
                // The densities of extinction, whose logarithms are straight, meet once at the most; if they do so on the way, the
                // difference of the depths is not monotone.
                let cosecants = [columns[lane], middle].map(|column| 1.0 / slice.sines()[column as usize]);
                let apart_at_eye = (cosecants[0] / cosecants[1]).ln();
                let crosses = !self.even && apart_at_eye * (apart_at_eye - turn) < 0.0;
                let depths = if crosses { own + reference } else { (own - reference).abs() };
                let range = turn.abs() + depths;
                let apart = of_log_range(range);
                band.apart[first + lane] = if apart >= 0.0 { apart } else { 1.0 };
                let relative = of_log_range_relative(range);
                band.relative[first + lane] = if relative >= 0.0 { relative } else { f32::INFINITY };
            }
        }
        if self.even {
            band.ends[0][..count].copy_from_slice(rays.gammas);
        } else {
            band.ends[0][..count].iter_mut().for_each(|depth| *depth = absorbed(*depth));
        }
        band.blend[..count].fill(0.0);
    }

    /// A lamp: the middle view ray's own light, its cone included.
    #[inline(always)]
    fn fill_lamp(
        &self,
        channel: usize,
        slice: &SliceView<'_>,
        rays: QueryRays<'_>,
        starts: &[f32],
        band: &mut BandWeights,
    ) {
        let (Some(to_lamp), SliceLight::Lamp { .. }) = (self.to_lamp, slice.light) else { return };
        let count = rays.columns.len();
        let depth = to_lamp[channel];
        let middle = middle_of(slice, rays.columns) as usize;
        let angle_of = |column: usize| [slice.sines()[column], slice.cosines()[column]];
        let reference = angle_of(middle);
        let BandWeights { starts: at_starts, ends, blend, apart, relative, rough, lamp, .. } = band;
        lamp.fill(slice, reference, if self.even { 0.0 } else { depth }, &self.phases[channel]);
        lamp.read(starts, &mut at_starts[0][..starts.len()]);
        lamp.read(rays.gammas, &mut ends[0][..count]);
        let beta = |[sine, cosine]: [f32; 2]| sine.atan2(cosine);
        let rays = rays.columns.iter().zip(rays.gammas);
        let bounds = apart.iter_mut().zip(relative).zip(rough.iter_mut());
        for (((&column, &gamma), ((apart, relative), rough)), &light) in rays.zip(bounds).zip(&ends[0]) {
            let own = angle_of(column as usize);
            let direction = epipolar::geometry::direction_of_diamond_angle(gamma.into()).normalize();
            let light_ray = [direction.y as f32, direction.x as f32];
            let longer = detour(own, light_ray) * depth;
            // Along the row the difference of two view rays' ways grows all the way.
            let ways = if self.even { longer } else { (longer - detour(reference, light_ray) * depth).abs() };
            let lobe = 2.0 * self.lobes[channel] * (beta(own) - beta(reference)).abs();
            let own_rough = lamp.rough(gamma) / light;
            let range = ways + lobe;
            *apart = of_log_range(range);
            *relative = of_log_range_relative(range);
            // Numbers that are not any bound nothing.
            *rough = if own_rough < 1.0 { own_rough } else { 1.0 };
        }
        blend[..count].fill(0.0);
    }
}

impl BandWeights {
    /// Room for so many runs and queries.
    pub fn make_room(&mut self, runs: usize, queries: usize) {
        let grow = |list: &mut Vec<f32>, length: usize| {
            if list.len() < length {
                list.resize(length, 0.0);
            }
        };
        self.starts.iter_mut().for_each(|list| grow(list, runs + 1));
        self.ends.iter_mut().for_each(|list| grow(list, queries));
        grow(&mut self.blend, queries);
        grow(&mut self.apart, queries);
        grow(&mut self.relative, queries);
        grow(&mut self.rough, queries);
    }

    /// Room for the tables of a lamp, too.
    pub fn reserve(&mut self, runs: usize, queries: usize, is_lamp: bool) {
        self.make_room(runs, queries);
        if is_lamp {
            self.lamp.reserve();
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = self.starts.iter().chain(&self.ends).chain([
            &self.blend,
            &self.apart,
            &self.relative,
            &self.rough,
        ]);
        4 * lists.map(Vec::capacity).sum::<usize>() + self.lamp.memory_bytes()
    }
}

/// The column half way between the angles of the first and the last: the paper's bisectrix.
fn middle_of(slice: &SliceView<'_>, columns: &[u32]) -> u32 {
    let angle = |column: u32| {
        let index = column as usize;
        slice.sines()[index].atan2(slice.cosines()[index])
    };
    let (first, last) = (columns[0], columns[columns.len() - 1]);
    let middle = 0.5 * (angle(first) + angle(last));
    let ascends = angle(last) >= angle(first);
    let (mut from, mut to) = (first, last);
    while from < to {
        let column = from + (to - from) / 2;
        if (angle(column) < middle) == ascends { from = column + 1 } else { to = column }
    }
    from
}

/// Intervals of a phase function's table.
const STEPS: usize = 2048;

/// Fills what a medium scatters around a lamp by the angle, of a channel; nothing if all angles are alike.
fn fill_phase(setup: &Setup<'_>, channel: usize, phase: &mut Vec<f32>) {
    phase.clear();
    let medium = setup.medium();
    if medium.components().iter().all(|component| component.phase.is_isotropic()) {
        return;
    }
    phase.reserve(STEPS + 1);
    let mut brightest = 0.0f32;
    for step in 0..=STEPS {
        let half = 0.5 * std::f64::consts::PI * step as f64 / STEPS as f64;
        let rgb = medium.scattering_towards(half.sin().powi(2));
        // A channel that scatters nothing may stand for the others, where their shares are alike.
        let value = if rgb[channel] > 0.0 { rgb[channel] } else { rgb.element_sum() } as f32;
        brightest = brightest.max(value);
        phase.push(value);
    }
    let scale = if brightest > 0.0 { 1.0 / brightest } else { 0.0 };
    phase.iter_mut().for_each(|value| *value *= scale);
}

/// How fast the logarithm of a phase function's table changes at the most \[1/radian\].
fn lobe_of(phase: &[f32]) -> f32 {
    let changes = phase.windows(2).map(|pair| (pair[1] / pair[0]).ln().abs());
    // The slope between two nodes is a mean: a lobe of g = 0.99 is ten nodes wide.
    changes.fold(0.0, f32::max) * (1.1 * STEPS as f32 / std::f32::consts::PI)
}
