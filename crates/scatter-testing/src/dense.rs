//! A pixel by the formula of MODEL.md alone: dense samples along its ray, visibility and colour by look-ups at points.

use glam::DVec3;
use scatter_core::{Frame, Light};

/// What dense sampling finds for one pixel.
#[derive(Debug, Clone, Copy)]
pub struct Sampled {
    /// In-scattered radiance.
    pub radiance: DVec3,
    /// How far it may be off: every change of visibility or colour lies somewhere within one sample.
    pub uncertainty: f64,
}

/// `∫ f·V dt` of pixel `(x, y)` by the midpoint rule with `count` samples: the integrand as MODEL.md writes it,
/// visibility and colour by look-ups at points. For a lamp, samples are spread evenly over the angle at the lamp.
pub fn dense(frame: &Frame<'_>, x: u32, y: u32, count: u32) -> Sampled {
    let end = frame.ray_end(x, y);
    let eye = frame.camera().eye();
    let ray = frame.camera().pixel_ray(x, y);
    let medium = frame.medium();
    let sigma_t = DVec3::from(medium.sigma_t());
    let lamp = frame.light().position().map(|p| p - eye - ray.origin);
    let closest = lamp.map(|p| p.dot(ray.direction)).unwrap_or(0.0);
    let h = lamp.map(|p| p.cross(ray.direction).length()).unwrap_or(1.0);
    let angles = lamp.map(|_| ((-closest / h).atan(), ((end - closest) / h).atan()));
    let strength = DVec3::from(frame.light().strength());
    let (mut radiance, mut uncertainty, mut in_cone) = (DVec3::ZERO, 0.0, 0u32);
    let mut last = None;
    for i in 0..count {
        let share = (f64::from(i) + 0.5) / f64::from(count);
        let (t, dt) = match angles {
            None => (share * end, end / f64::from(count)),
            Some((from, to)) => {
                let angle = from + share * (to - from);
                (closest + h * angle.tan(), h / angle.cos().powi(2) * (to - from) / f64::from(count))
            }
        };
        let p = ray.origin + ray.direction * t;
        let (travel, cone, attenuation) = match (frame.light(), lamp) {
            (Light::Directional(sun), _) => (sun.direction(), 1.0, (-sigma_t * t).exp()),
            (light, Some(lamp)) => {
                let way = ray.direction * t - lamp;
                let d = way.length();
                let cone = if let Light::Spot(spot) = light {
                    spot.cone(spot.direction().dot(way / d))
                } else {
                    1.0
                };
                (way / d, cone, (-sigma_t * (t + d)).exp() * cone / (d * d))
            }
            _ => unreachable!("a lamp has a position"),
        };
        let cos_theta = travel.dot(-ray.direction);
        let scattering: DVec3 =
            medium.components().iter().map(|c| DVec3::from(c.sigma_s) * c.phase.at(cos_theta)).sum();
        let value = strength * scattering * attenuation * dt;
        let lit = frame.shadow().is_lit(p + eye);
        let colour = frame.texture().map_or([1.0f32; 3], |texture| texture.lookup(p + eye));
        // The cone's border and its bend at the inner angle are edges too.
        let now = (lit, colour, cone > 0.0, cone < 1.0);
        if last.is_some_and(|before| before != now) {
            uncertainty += 2.0 * value.max_element();
        }
        last = Some(now);
        in_cone += u32::from(cone > 0.0);
        if lit {
            radiance += value * DVec3::from(colour.map(f64::from));
        }
    }
    // A ray that grazes the cone has few samples in it: the midpoint rule's 1/n², of a parabola.
    uncertainty += radiance.max_element() / f64::from(in_cone.max(1)).powi(2);
    Sampled { radiance, uncertainty }
}
