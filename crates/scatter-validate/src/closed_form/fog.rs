//! Height fog, `ρ = exp(−height/scale)` above a base: optical depths by the density in the middle of a stretch, a sun's
//! lit interval by a plain difference or a series in the optical depth, a lamp's by adaptive quadrature in the angle at
//! the lamp. Each integral has a second way by quadrature.

use glam::DVec3;

use super::airlight::integrate_between;
use super::quadrature::{integrate, integrate_smooth};
use super::terms::{Channel, Lamp};

/// Scale heights of a piece of a quadrature: e³ is resolved by 15 points without bisection.
const STEP: f64 = 3.0;

/// A fog as the start of a view ray sees it.
#[derive(Debug, Clone, Copy)]
pub struct Fog {
    /// Unit vector against which the density falls.
    pub up: DVec3,
    /// Height of the ray's start above the base, where the density is 1.
    pub start_height: f64,
    /// Height over which the density falls by a factor of e.
    pub scale: f64,
}

impl Fog {
    /// `ln ρ` at a point relative to the ray's start.
    fn log_density(&self, point: DVec3) -> f64 {
        -(self.start_height + self.up.dot(point)) / self.scale
    }

    /// `∫ρ` along the straight way between two points relative to the ray's start.
    ///
    /// `ρ(middle)·length·sinh(x/2)/(x/2)`, x the change of ln ρ.
    pub fn column(&self, from: DVec3, to: DVec3) -> f64 {
        let length = from.distance(to);
        let half = 0.5 * self.up.dot(to - from).abs() / self.scale;
        let middle = self.log_density(0.5 * (from + to));
        if half < 1.0 {
            // sinh(y)/y = Σ y²ᵏ/(2k+1)!: after 10 terms y ≤ 1 leaves 1/21!.
            let series =
                (1..=10).rev().fold(0.0, |sum, k| half * half * (1.0 + sum) / f64::from(2 * k * (2 * k + 1)));
            return length * middle.exp() * (1.0 + series);
        }
        // sinh y = e^y·(1 − e^{−2y})/2; the exponents belong together.
        length * (middle + half).exp() * (1.0 - (-2.0 * half).exp()) / (2.0 * half)
    }

    /// `∫ρ` from a point along a unit direction to `length`, which may be ∞.
    pub fn column_along(&self, from: DVec3, direction: DVec3, length: f64) -> f64 {
        if length.is_finite() {
            return self.column(from, from + direction * length);
        }
        // ∫ e^{−ms} ds = 1/m where the way leads out of the fog.
        let climb = self.up.dot(direction) / self.scale;
        if climb > 0.0 { self.log_density(from).exp() / climb } else { f64::INFINITY }
    }

    /// [`Self::column`] by adaptive quadrature, for ways of at most some hundred scale heights.
    pub fn column_by_quadrature(&self, from: DVec3, to: DVec3) -> f64 {
        let length = from.distance(to);
        let density = |s: f64| self.log_density(from + (to - from) * (s / length)).exp();
        self.pieces(from, to, length).windows(2).map(|pair| integrate(&density, pair[0], pair[1])).sum()
    }

    /// A way of some length cut into equal pieces of at most [`STEP`] scale heights, with both its ends.
    fn pieces(&self, from: DVec3, to: DVec3, length: f64) -> Vec<f64> {
        let count = (self.up.dot(to - from).abs() / (STEP * self.scale)).ceil().clamp(1.0, 1000.0);
        (0..=count as u32).map(|k| length * f64::from(k) / count).collect()
    }
}

/// In-scattered radiance \[W/(m²·sr)\] of the lit interval `[a, b]`, 0 ≤ a ≤ b ≤ ∞, of a view ray in a fog:
/// `E·Σσs·p·(e^{−τ(a)} − e^{−τ(b)})/σt`. The sun is not attenuated on its way.
///
/// `travel` is the unit direction in which the light travels, `view` that of the view ray.
pub fn fog_sun_radiance(
    irradiance: f64,
    travel: DVec3,
    channel: &Channel<'_>,
    fog: &Fog,
    (view, a, b): (DVec3, f64, f64),
) -> f64 {
    if !(b > a) {
        return 0.0;
    }
    let before = channel.sigma_t * fog.column(DVec3::ZERO, view * a);
    let column = fog.column_along(view * a, view, b - a);
    let depth = channel.sigma_t * column;
    let lit = if depth > 1.0 {
        // e^{−depth} < 0.37: the difference loses less than a bit. Both may be ∞.
        ((-before).exp() - (-(before + depth)).exp()) / channel.sigma_t
    } else {
        // Σ (−x)ᵏ/(k+1)!: after 20 terms x ≤ 1 leaves 1/21! = 2e-20.
        let series = (1..=20).rev().fold(0.0, |sum, k| (1.0 - depth * sum) / f64::from(k));
        (-before).exp() * column * series
    };
    irradiance * channel.scattering(travel.dot(-view).clamp(-1.0, 1.0)) * lit
}

/// [`fog_sun_radiance`] by adaptive quadrature of `ρ·e^{−τ}`, cut where ln ρ has changed by 1 and at unit optical depths.
pub fn fog_sun_by_quadrature(
    irradiance: f64,
    travel: DVec3,
    channel: &Channel<'_>,
    fog: &Fog,
    (view, a, b): (DVec3, f64, f64),
) -> f64 {
    let depth = |t: f64| channel.sigma_t * fog.column(DVec3::ZERO, view * t);
    let value = |t: f64| (fog.log_density(view * t) - depth(t)).exp();
    let pieces = fog.pieces(view * a, view * b, b - a).into_iter().map(|s| a + s);
    let cuts: Vec<f64> = pieces.chain(depth_cuts(&depth, a, b)).collect();
    let lit = integrate_between(&value, a, b, cuts.into_iter());
    irradiance * channel.scattering(travel.dot(-view).clamp(-1.0, 1.0)) * lit
}

/// Where an optical depth has grown by a hundredth to a hundred since `a`, by bisection; `b` where it does not.
fn depth_cuts(depth: &dyn Fn(f64) -> f64, a: f64, b: f64) -> [f64; 5] {
    [0.01, 0.1, 1.0, 10.0, 100.0].map(|share| {
        let (mut low, mut high, level) = (a, b, depth(a) + share);
        if depth(b) <= level {
            return b;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if depth(middle) < level { low = middle } else { high = middle }
        }
        low
    })
}

/// In-scattered radiance \[W/(m²·sr)\] of the lit interval `[a, b]`, b finite, of the view ray from the origin along `view`:
/// `I·∫ₐᵇ Σσs·p(cosθ)·C·ρ·exp(−σt(F + G))/d² dt`, F and G the columns along the ray and from the lamp.
///
/// By adaptive quadrature in the angle at the lamp. A ray that passes the lamp closer than 1e-6 of its distance is taken at
/// that distance.
pub fn fog_lamp_radiance(
    lamp: &Lamp,
    channel: &Channel<'_>,
    fog: &Fog,
    (view, a, b): (DVec3, f64, f64),
) -> f64 {
    let foot = lamp.position.dot(view);
    let offset = view * foot - lamp.position;
    let h = offset.length().max(1e-6 * lamp.position.length());
    let (mut along, mut across, mut kinks) = (0.0, 0.0, Vec::new());
    if let Some(cone) = &lamp.cone {
        along = cone.axis.dot(view);
        across = cone.axis.dot(offset) / h;
        kinks = cone.crossings(along, across);
    }
    // dt/d² = du/h with t = foot + h·tan u.
    let value = |u: f64| {
        let t = foot + h * u.tan();
        let point = view * t;
        let depth = channel.sigma_t * (fog.column(DVec3::ZERO, point) + fog.column(lamp.position, point));
        let cone = lamp.cone.map_or(1.0, |cone| cone.factor(along * u.sin() + across * u.cos()));
        channel.scattering(-u.sin()) * cone * (fog.log_density(point) - depth).exp()
    };
    let angle = |t: f64| ((t - foot) / h).atan();
    let depth = |t: f64| channel.sigma_t * fog.column(DVec3::ZERO, view * t);
    let pieces = fog.pieces(view * a, view * b, b - a).into_iter().map(|s| a + s);
    let along_ray = pieces.chain(depth_cuts(&depth, a, b)).map(angle);
    let (first, last) = (angle(a), angle(b));
    let mut cuts: Vec<f64> = along_ray.chain(kinks).chain([0.0]).map(|u| u.clamp(first, last)).collect();
    cuts.sort_by(f64::total_cmp);
    lamp.intensity * integrate_smooth(&value, &cuts) / h
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{PhaseFunction, lamp_radiance, sun_radiance};

    fn near(value: f64, exact: f64, tolerance: f64) {
        assert!((value - exact).abs() <= tolerance * exact.abs(), "{value:e} for {exact:e}");
    }

    fn fogs() -> Vec<Fog> {
        let tilted = DVec3::new(0.3, 0.9, -0.2).normalize();
        let mut all = Vec::new();
        for up in [DVec3::Y, tilted] {
            for (start_height, scale) in [(0.0, 1e6), (1.5, 0.7), (40.0, 1.0), (-3.0, 2.0)] {
                all.push(Fog { up, start_height, scale });
            }
        }
        all
    }

    const VIEWS: [DVec3; 5] =
        [DVec3::X, DVec3::Y, DVec3::NEG_Y, DVec3::new(0.6, -0.8, 0.0), DVec3::new(0.6, 0.0, 0.8)];

    #[test]
    fn columns_are_the_integral_of_the_density() {
        for fog in fogs() {
            for view in VIEWS {
                for (a, b) in [(0.0, 1e-6), (0.0, 3.0), (5.0, 40.0)] {
                    let column = fog.column(view * a, view * b);
                    // ln ρ up to 80, so its exponential is good to 80 ulp.
                    near(column, fog.column_by_quadrature(view * a, view * b), 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_suns_closed_form_is_the_quadrature() {
        let mut worst = 0.0f64;
        for fog in fogs() {
            for sigma in [1e-9, 0.02, 1.0, 300.0] {
                let components = [(sigma, PhaseFunction::Isotropic)];
                let channel = Channel { components: &components, sigma_t: 1.25 * sigma };
                for view in VIEWS {
                    for (a, b) in [(0.0, 1e-3), (0.0, 40.0), (2.0, 9.0)] {
                        let stretch = (view, a, b);
                        let exact = fog_sun_by_quadrature(2.0, DVec3::NEG_Y, &channel, &fog, stretch);
                        let closed = fog_sun_radiance(2.0, DVec3::NEG_Y, &channel, &fog, stretch);
                        if exact > 1e-290 {
                            // An optical depth of 600 before the interval costs 600 ulp of its own error.
                            near(closed, exact, 1e-10);
                            worst = worst.max((closed / exact - 1.0).abs());
                        }
                    }
                }
            }
        }
        println!("sun in height fog, closed form against quadrature: {worst:.1e}");
    }

    #[test]
    fn without_a_change_of_density_fog_is_the_uniform_medium() {
        let fog = Fog { up: DVec3::Y, start_height: 0.0, scale: 1e18 };
        let components = [(0.3, PhaseFunction::HenyeyGreenstein(0.6))];
        let channel = Channel { components: &components, sigma_t: 0.4 };
        let (travel, lamp) = (DVec3::new(0.6, -0.8, 0.0), DVec3::new(1.0, 2.0, 3.0));
        let lamp = Lamp { position: lamp, intensity: 2.0, cone: None };
        for view in VIEWS {
            for (a, b) in [(0.0, 0.01), (0.0, 30.0), (1.0, 6.0)] {
                let fog_sun = fog_sun_radiance(2.0, travel, &channel, &fog, (view, a, b));
                near(fog_sun, sun_radiance(2.0, travel, &channel, view, a, b), 1e-13);
                let fog_lamp = fog_lamp_radiance(&lamp, &channel, &fog, (view, a, b));
                // An angle's tangent is the price of differences near the ends.
                near(fog_lamp, lamp_radiance(&lamp, &channel, view, a, b), 1e-11);
            }
        }
    }
}
