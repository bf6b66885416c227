//! A lamp's light a slice: the angle that the slice takes at the lamp, times phase function, cone and transmittance at its middle.
//!
//! `dt/d²` is integrated exactly: it is `dφ/h`, φ the angle at the lamp and h the distance of the closest approach
//! (equi-angular; Kulla and Fajardo 2012), so that a slice beside a lamp weighs what it should however long it is. The rest is
//! taken at the middle, O(Δ²); it cancels where nothing shadows. Engines evaluate all of it at one point and clamp the distance.
//!
//! In height fog weights span more than f32 holds: exponents are added up, and sums are kept relative to the largest one so far.

use glam::DVec3;
use scatter_core::{FogLanes, Frame, LampRay, Phase, PointLight, RayLanes, SpotLight, ViewRay, exp_f32};

use super::paths::{LANES, Lanes, Wide};
use super::sums::{SliceLight, Sums};
use crate::grid::slices::Slices;

/// What a slice outside of a spot's cone weighs: little against what is inside, but not nothing, so that a column that misses
/// the cone still says how much of its light is lit.
const OUTSIDE: f32 = 1e-9;

/// A scattering component as lamps take it.
#[derive(Debug, Clone, Copy)]
pub struct PhaseTerm {
    /// σs of each channel, over the largest of all.
    weight: [f32; 3],
    phase: Phase,
}

/// Components of the medium into `terms`; returns the largest σs, in which they are counted.
pub fn set_terms(frame: &Frame<'_>, terms: &mut Vec<PhaseTerm>) -> f64 {
    let components = frame.medium().components();
    let largest = components.iter().flat_map(|component| component.sigma_s).fold(0.0, f64::max);
    terms.clear();
    terms.extend(components.iter().map(|component| PhaseTerm {
        weight: component.sigma_s.map(|sigma| (sigma / largest) as f32),
        phase: component.phase,
    }));
    largest
}

/// A lamp along sixteen rays. Lengths are counted in distances from the eye to the lamp.
pub struct LampLight<'a, const FOG: bool> {
    slices: &'a Slices,
    terms: &'a [PhaseTerm],
    /// One over the unit of length.
    inverse_unit: f64,
    closest: Wide,
    distance: Lanes,
    /// Distance to the lamp where each ray starts.
    from_start: Lanes,
    cone: Option<Cone>,
    /// Extinction of the channels a unit of length; in height fog shares of the thickest one.
    sigma: [f32; 3],
    fog: Option<LampFog>,
    /// Largest exponent so far of each channel; 0 in a uniform medium, where the first is the largest.
    peak: [Lanes; 3],
    /// Radiance of a unit at exponent 0.
    strength: [Lanes; 3],
}

struct Cone {
    along: Lanes,
    across: Lanes,
    cos_outer: f32,
    slope: f32,
}

struct LampFog {
    lanes: FogLanes,
    /// `ln σ` of the thickest channel, and of it a unit of length.
    log_thickest: f64,
    log_thickest_unit: f64,
    at_lamp: f64,
    /// Optical depth of the thickest channel up to the next slice.
    depth: Lanes,
}

impl<'a, const FOG: bool> LampLight<'a, FOG> {
    /// For a frame with that lamp; `largest` as [`set_terms`] gave it.
    pub fn new(
        frame: &Frame<'_>,
        (lamp, spot): (&PointLight, Option<&SpotLight>),
        slices: &'a Slices,
        (terms, largest): (&'a [PhaseTerm], f64),
        rays: &RayLanes,
    ) -> Self {
        let eye = frame.camera().eye();
        let relative = lamp.position() - eye;
        let unit = relative.length();
        let sigma_t = frame.medium().sigma_t();
        let thickest = sigma_t.into_iter().fold(0.0, f64::max);
        let zero = [0.0; LANES];
        let fog = frame.medium().height_falloff().map(|falloff| LampFog {
            lanes: FogLanes::new(falloff, eye, rays),
            log_thickest: thickest.ln(),
            log_thickest_unit: (thickest * unit).ln(),
            at_lamp: falloff.log_density(eye, relative),
            depth: zero,
        });
        let over = |sigma: f64| if thickest > 0.0 { sigma / thickest } else { 0.0 };
        let mut light = Self {
            slices,
            terms,
            inverse_unit: 1.0 / unit,
            closest: [0.0; LANES],
            distance: zero,
            from_start: zero,
            cone: spot.map(|spot| Cone {
                along: zero,
                across: zero,
                cos_outer: spot.cos_outer() as f32,
                slope: spot.cone_slope() as f32,
            }),
            sigma: sigma_t.map(|sigma| if FOG { over(sigma) } else { sigma * unit }.min(1e30) as f32),
            fog,
            peak: [if FOG { [-f32::MAX; LANES] } else { zero }; 3],
            strength: [zero; 3],
        };
        for lane in 0..LANES {
            let [origin, direction] =
                [&rays.origin, &rays.direction].map(|way| DVec3::from([0, 1, 2].map(|axis| way[axis][lane])));
            let ray = ViewRay { origin, direction };
            light.set(lane, &ray, relative, lamp, spot);
            let h = LampRay::new(origin, direction, relative, lamp.radius()).distance;
            let start = f64::from(light.from_start[lane]) * unit;
            for channel in 0..3 {
                let through = if FOG { 1.0 } else { (-sigma_t[channel] * start).exp() };
                light.strength[channel][lane] = (lamp.intensity()[channel] * largest * through / h) as f32;
            }
        }
        light
    }

    fn set(&mut self, lane: usize, ray: &ViewRay, lamp: DVec3, light: &PointLight, spot: Option<&SpotLight>) {
        let on_ray = LampRay::new(ray.origin, ray.direction, lamp, light.radius());
        self.closest[lane] = on_ray.closest * self.inverse_unit;
        self.distance[lane] = (on_ray.distance * self.inverse_unit) as f32;
        self.from_start[lane] = (on_ray.distance_at(0.0) * self.inverse_unit) as f32;
        if let (Some(cone), Some(spot)) = (&mut self.cone, spot) {
            let foot = ray.origin + ray.direction * on_ray.closest - lamp;
            cone.along[lane] = spot.direction().dot(ray.direction) as f32;
            cone.across[lane] = (spot.direction().dot(foot) * self.inverse_unit) as f32;
        }
    }

    /// `exponent` of each channel relative to the channel's peak, after the sums have been brought to it.
    #[inline(always)]
    fn relative<const C: usize>(&mut self, channel: usize, exponent: &Lanes, sums: &mut Sums<C>) -> Lanes {
        let mut factor = [0.0; LANES];
        for lane in 0..LANES {
            let peak = self.peak[channel][lane].max(exponent[lane]);
            let shrink = exp_f32((self.peak[channel][lane] - peak).max(-1e3));
            sums.lit[channel][lane] *= shrink;
            sums.all[channel][lane] *= shrink;
            self.peak[channel][lane] = peak;
            factor[lane] = exp_f32((exponent[lane] - peak).max(-1e3));
        }
        factor
    }
}

impl<const C: usize, const FOG: bool> SliceLight<C> for LampLight<'_, FOG> {
    #[inline(always)]
    fn add(&mut self, slice: usize, visible: &[Lanes; C], sums: &mut Sums<C>) {
        let inverse = self.inverse_unit;
        let [from, to] = [slice, slice + 1].map(|bound| self.slices.bounds()[bound] * inverse);
        let middle = self.slices.middles()[slice];
        let (middle_units, length) = (middle * inverse, (to - from) as f32);
        let zero = [0.0; LANES];
        let (mut base, mut towards, mut away, mut way) = (zero, zero, zero, zero);
        for lane in 0..LANES {
            let (closest, h) = (self.closest[lane], self.distance[lane]);
            let [x0, x1, x] = [from, to, middle_units].map(|t| (t - closest) as f32);
            let d = (h * h + x * x).sqrt();
            base[lane] = angle(h * length, h * h + x0 * x1);
            // sin²(θ/2) = (1 + x/d)/2 and cos²(θ/2), without cancellation on either side of the lamp.
            let sum = d + x.abs();
            let (large, small) = (0.5 * sum / d, 0.5 * h * h / (d * sum));
            towards[lane] = if x >= 0.0 { large } else { small };
            away[lane] = if x >= 0.0 { small } else { large };
            way[lane] = d;
        }
        if let Some(cone) = &self.cone {
            for lane in 0..LANES {
                let x = (middle_units - self.closest[lane]) as f32;
                let cos = (cone.along[lane] * x + cone.across[lane]) / way[lane];
                let share = ((cos - cone.cos_outer) * cone.slope).clamp(0.0, 1.0);
                base[lane] *= (share * share).max(OUTSIDE);
            }
        }
        let (mut view_depth, mut exponent) = (zero, zero);
        if let (true, Some(fog)) = (FOG, &mut self.fog) {
            let bounds = [slice, slice + 1].map(|bound| [self.slices.bounds_f32()[bound]; LANES]);
            let depths = fog.lanes.optical_depths(fog.log_thickest, &bounds[0], &bounds[1]);
            for lane in 0..LANES {
                let log_density = fog.lanes.log_density[lane] - fog.lanes.slope[lane] * middle;
                let (densest, change) =
                    (log_density.max(fog.at_lamp), (log_density - fog.at_lamp).abs().min(1e30) as f32);
                // To the lamp: σ·d·ρ at the denser end, times the mean of what ρ falls to.
                let log_depth = (densest + fog.log_thickest_unit).clamp(-80.0, 80.0) as f32;
                let from_lamp = exp_f32(log_depth) * way[lane] * mean_of_fall(change);
                view_depth[lane] = fog.depth[lane] + 0.5 * depths[lane] + from_lamp;
                exponent[lane] = log_density.clamp(-1e30, 1e30) as f32;
                fog.depth[lane] = (fog.depth[lane] + depths[lane]).min(1e30);
            }
        } else {
            for lane in 0..LANES {
                // t + d grows from the start on.
                view_depth[lane] = middle_units as f32 + way[lane] - self.from_start[lane];
            }
        }
        let mut phases = [[0.0; LANES]; C];
        for term in self.terms {
            for lane in 0..LANES {
                let phase = term.phase.at_haversine_f32(towards[lane], away[lane]);
                for channel in 0..C {
                    phases[channel][lane] += term.weight[channel] * phase;
                }
            }
        }
        for channel in 0..C {
            let mut exponents = [0.0; LANES];
            for lane in 0..LANES {
                let depth = self.sigma[channel] * view_depth[lane];
                exponents[lane] = exponent[lane] - if depth > 0.0 { depth.min(1e30) } else { 0.0 };
            }
            let factor = if FOG {
                self.relative(channel, &exponents, sums)
            } else {
                exponents.map(|exponent| exp_f32(exponent.max(-1e3)))
            };
            let mut weights = [0.0; LANES];
            for lane in 0..LANES {
                weights[lane] = base[lane] * phases[channel][lane] * factor[lane];
            }
            sums.add(channel, &weights, &visible[channel]);
        }
    }

    #[inline(always)]
    fn radiance(&self) -> [Lanes; C] {
        std::array::from_fn(|channel| {
            let mut radiance = self.strength[channel];
            if FOG {
                for lane in 0..LANES {
                    radiance[lane] *= exp_f32(self.peak[channel][lane].clamp(-1e3, 80.0));
                }
            }
            radiance
        })
    }
}

/// The angle of the point `(x, y)`, y ≥ 0, from 0 to π; relative error ≤ 3e-5, which weights bear.
#[inline(always)]
fn angle(y: f32, x: f32) -> f32 {
    let (low, high) = (y.min(x.abs()), y.max(x.abs()).max(f32::MIN_POSITIVE));
    let r = low / high;
    let s = r * r;
    // Hastings' polynomial for arctan on [0, 1].
    let mut series = -0.011_721_2f32;
    for coefficient in [0.052_653_32, -0.116_432_87, 0.193_543_46, -0.332_623_47, 0.999_977_26] {
        series = series * s + coefficient;
    }
    let first = series * r;
    let quarter = if y > x.abs() { std::f32::consts::FRAC_PI_2 - first } else { first };
    if x < 0.0 { std::f32::consts::PI - quarter } else { quarter }
}

/// `(1 − e^{−x})/x` for x ≥ 0.
#[inline(always)]
fn mean_of_fall(x: f32) -> f32 {
    let short = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0)));
    let long = (1.0 - exp_f32(-x)) / x;
    if x < 0.02 { short } else { long }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_atan2() {
        let mut worst = 0.0f64;
        for step in 0..2000 {
            let exact = f64::from(step) / 2000.0 * std::f64::consts::PI;
            let (y, x) = (exact.sin() * 3.0, exact.cos() * 3.0);
            worst = worst.max((f64::from(angle(y as f32, x as f32)) - exact).abs() / exact.max(1e-3));
        }
        println!("worst relative error {worst:.1e} (allowed 3e-5)");
        assert!(worst < 3e-5);
        assert_eq!(angle(0.0, 0.0), 0.0);
    }

    #[test]
    fn the_mean_of_a_falling_density_runs_from_one_to_its_inverse() {
        for x in [0.0f32, 1e-6, 0.019, 0.021, 1.0, 50.0, 1e30] {
            let exact = if x == 0.0 { 1.0 } else { -(-f64::from(x)).exp_m1() / f64::from(x) };
            // At 0.02 the subtraction leaves 2⁻²⁴/0.02 of the difference.
            assert!((f64::from(mean_of_fall(x)) / exact - 1.0).abs() < 2e-5, "{x}");
        }
    }
}
