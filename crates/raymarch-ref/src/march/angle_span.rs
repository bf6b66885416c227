//! The part of a view ray that a lamp can light, in the angle that its steps are equal in.
//!
//! `ξ = φ/2 + π/4` with φ the angle at the lamp between the perpendicular on the ray and a point; `tan ξ = p/h` with
//! p = (t − t₀) + d, so that a part's start has all its digits however close the ray passes. f64.

use scatter_core::LampRay;

use super::NEGLIGIBLE_OPTICAL_DEPTH;
use super::packet::Span;

/// A part of a ray in `ξ = φ/2 + π/4`, from 0 (infinitely far before the lamp) to π/2 (infinitely far behind it).
#[derive(Debug, Clone, Copy)]
pub struct AngleSpan {
    /// Its start \[radians\].
    pub from: f64,
    /// Its end \[radians\]; nothing is left of the part where it is not behind the start.
    pub to: f64,
}

impl AngleSpan {
    /// The part `[0, end]` of a ray, cut where the transmittance is negligible.
    pub fn of(ray: LampRay, end: f64, weakest: f64) -> Self {
        let h = ray.distance;
        // p = (t − t₀) + d without cancellation; tan ξ = p/h.
        let path = |t: f64| {
            let (x, d) = (t - ray.closest, ray.distance_at(t));
            if x < 0.0 { h * (h / (d - x)) } else { x + d }
        };
        let start = path(0.0);
        let reach = if weakest > 0.0 { start + NEGLIGIBLE_OPTICAL_DEPTH / weakest } else { f64::INFINITY };
        Self { from: start.atan2(h), to: path(end).min(reach).atan2(h) }
    }

    /// The part inside of the cone: `along·sin φ + across·cos φ` is a cosine around its largest value.
    pub fn within_cone(self, along: f64, across: f64, cos_outer: f64) -> Self {
        let amplitude = along.hypot(across);
        if !(amplitude > cos_outer) {
            return Self { to: self.from, ..self };
        }
        let (peak, half) = (along.atan2(across), (cos_outer / amplitude).acos());
        let xi = |phi: f64| 0.5 * phi + std::f64::consts::FRAC_PI_4;
        Self { from: self.from.max(xi(peak - half)), to: self.to.min(xi(peak + half)) }
    }

    /// The same part on the ray, finite.
    pub fn on_ray(self, ray: LampRay, end: f64) -> Span {
        if !(self.to > self.from) {
            return Span::default();
        }
        // x = t − t₀ = h·tan φ = −h/tan 2ξ.
        let at = |xi: f64| (ray.closest - ray.distance / (2.0 * xi).tan()).clamp(0.0, end.min(f64::MAX));
        Span { start: at(self.from), end: at(self.to) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn ray(foot: f64, h: f64) -> LampRay {
        LampRay::new(DVec3::ZERO, DVec3::X, DVec3::new(foot, h, 0.0), 0.0)
    }

    #[test]
    fn angles_and_ray_parameters_are_each_others_inverse() {
        for (foot, h) in [(3.0, 1.0), (-2.0, 0.5), (5.0, 1e-3)] {
            let ray = ray(foot, h);
            let part = AngleSpan::of(ray, 9.0, 0.0);
            let span = part.on_ray(ray, 9.0);
            assert!(span.start.abs() < 1e-9 && (span.end - 9.0).abs() < 1e-9, "{span:?}");
            // The angle between the two ends, seen from the lamp: half of it in ξ.
            let exact = 0.5 * (((9.0 - foot) / h).atan() + (foot / h).atan());
            assert!((part.to - part.from - exact).abs() < 1e-14, "{part:?}");
        }
    }

    #[test]
    fn a_cone_cuts_a_ray_where_it_passes_its_mantle() {
        // Lamp 1 above the ray's point x = 3, shining straight down with a half angle of 45°: lit from 2 to 4.
        let ray = ray(3.0, 1.0);
        let cut = |along, across| {
            let part = AngleSpan::of(ray, 9.0, 0.0).within_cone(along, across, 0.5f64.sqrt());
            part.on_ray(ray, 9.0)
        };
        let span = cut(0.0, 1.0);
        assert!((span.start - 2.0).abs() < 1e-12 && (span.end - 4.0).abs() < 1e-12, "{span:?}");
        // Shining up it never meets the ray; shining along it, the ray is lit from 4 on.
        assert_eq!(cut(0.0, -1.0).end, 0.0);
        let span = cut(1.0, 0.0);
        assert!((span.start - 4.0).abs() < 1e-12 && (span.end - 9.0).abs() < 1e-12, "{span:?}");
    }

    #[test]
    fn endless_rays_end_where_no_light_is_left() {
        let ray = ray(3.0, 1.0);
        let span = AngleSpan::of(ray, f64::INFINITY, 0.5).on_ray(ray, f64::INFINITY);
        // t + d has grown by 17/σ = 34 since the start.
        let way = |t: f64| t + ray.distance_at(t);
        assert!((way(span.end) - way(0.0) - 34.0).abs() < 1e-9, "{span:?}");
    }
}
