//! How the weights of a band are filled, light by light: up to each run of the row, up to the end of each view ray, and how far they are
//! from the view ray's own.

use epipolar::driver::{SliceLight, SliceView};
use scatter_core::RayLanes;

use super::absorbed::absorbed;
use super::band::{BandWeights, QueryRays, middle_of, nearest_to_light};
use super::difference::{
    from_even, from_even_relative, of_blend, of_blend_relative, of_log_range, of_log_range_relative,
};
use super::frame_weights::Weights;
use super::lamp_table::detour;

const LANES: usize = RayLanes::COUNT;

impl Weights {
    /// A sun's rays, all alike.
    #[inline(always)]
    pub(super) fn fill_even(
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
    pub(super) fn fill_blend(
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
    pub(super) fn fill_fog(
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

    /// A lamp: the light of the view ray of the smallest angle to it, its cone included.
    ///
    /// It meets every light ray that the others of the band do; one in their middle does not, and what it never meets has no weight.
    #[inline(always)]
    pub(super) fn fill_lamp(
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
        let angle_of = |column: usize| [slice.sines()[column], slice.cosines()[column]];
        let reference = angle_of(nearest_to_light(slice, rays.columns) as usize);
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
