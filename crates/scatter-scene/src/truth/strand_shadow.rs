//! Which points of a view ray a straight piece of a strand can dim: those whose shadow rays pass nearer to it than its
//! radius.
//!
//! The piece with its radius is a capsule, which is convex, so these points are one stretch. Its ends are shadow rays that
//! touch the capsule: one of the two balls at its ends (as [`Disc`](super::disc_shadow)s do), or the cylinder between them.
//! Coordinates: x along the ray from its start, y towards the light, z along the normal of their plane.

use glam::{DVec2, DVec3};

use super::disc_shadow::Stretch;
use super::shadow_plane::PlaneLight;
use crate::translucent::{Closest, closest_on_segment};

/// A piece of a strand beside a view ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Capsule {
    /// Its ends.
    pub ends: [DVec3; 2],
    pub radius: f64,
}

impl Capsule {
    /// The nearest approach of the shadow ray from the point at t, along it from the light: that of a sun from t on
    /// backwards, so that places before the point are negative.
    #[inline]
    pub fn closest(&self, light: PlaneLight, t: f64) -> Closest {
        match light {
            PlaneLight::Sun(to_light) => {
                closest_on_segment(DVec3::new(t, 0.0, 0.0), -to_light.extend(0.0), false, self.ends)
            }
            PlaneLight::Lamp(place) => {
                let way = DVec2::new(t, 0.0) - place;
                let direction = way.try_normalize().unwrap_or(DVec2::NEG_Y);
                closest_on_segment(place.extend(0.0), direction.extend(0.0), true, self.ends)
            }
        }
    }

    /// Where the point at t itself is on that way.
    #[inline]
    pub fn place_of(light: PlaneLight, t: f64) -> f64 {
        match light {
            PlaneLight::Sun(_) => 0.0,
            PlaneLight::Lamp(place) => (DVec2::new(t, 0.0) - place).length(),
        }
    }

    /// Whether the shadow ray from the point at t passes nearer than the radius.
    fn is_near(&self, light: PlaneLight, t: f64) -> bool {
        self.closest(light, t).distance_sq < self.radius * self.radius
    }

    /// The stretch of the ray whose shadow rays are near.
    pub fn shadow(&self, light: PlaneLight) -> Option<Stretch> {
        match light {
            PlaneLight::Sun(to_light) | PlaneLight::Lamp(to_light) if to_light.y == 0.0 => {
                // All shadow rays lie on the ray's own line.
                let place = match light {
                    PlaneLight::Sun(_) => 0.0,
                    // Anywhere on the other side of what is looked for.
                    PlaneLight::Lamp(place) => place.x - place.x.signum(),
                };
                self.is_near(light, place).then_some([f64::NEG_INFINITY, f64::INFINITY])
            }
            PlaneLight::Sun(to_light) => self.sun_shadow(to_light),
            PlaneLight::Lamp(place) => self.lamp_shadow(light, place),
        }
    }

    /// As the sun sees it, the ray is a straight line and the capsule a stadium.
    fn sun_shadow(&self, to_light: DVec2) -> Option<Stretch> {
        let radius = self.radius;
        // Across the light: along the ray's image, and along the normal.
        let [a, b] = self.ends.map(|p| DVec2::new(p.x * to_light.y - p.y * to_light.x, p.z));
        let mut found = Found::default();
        for end in [a, b] {
            if end.y.abs() < radius {
                let half = ((radius - end.y) * (radius + end.y)).sqrt();
                found.add(end.x - half);
                found.add(end.x + half);
            }
        }
        let side = b - a;
        if side.y != 0.0 {
            let across = side.perp() * (radius / side.length());
            for offset in [across, -across] {
                // Where the straight side of the stadium meets the ray's image.
                let share = -(a.y + offset.y) / side.y;
                if (0.0..=1.0).contains(&share) {
                    found.add(a.x + share * side.x + offset.x);
                }
            }
        }
        found.stretch().map(|stretch| stretch.map(|image| image / to_light.y))
    }

    fn lamp_shadow(&self, light: PlaneLight, lamp: DVec2) -> Option<Stretch> {
        let radius = self.radius;
        let [a, b] = self.ends.map(|end| end - lamp.extend(0.0));
        let right_angle = std::f64::consts::FRAC_PI_2;
        let mut found = Found::default();
        // In tangents of the angle at the lamp from the perpendicular on the ray.
        for end in [a, b] {
            let disc_radius = ((radius - end.z) * (radius + end.z)).sqrt();
            let distance = end.truncate().length();
            if distance <= disc_radius {
                return Some([f64::NEG_INFINITY, f64::INFINITY]);
            }
            // NaN where the ball does not reach the plane.
            let (towards, half) = (end.x.atan2(-end.y), (disc_radius / distance).asin());
            for angle in [towards - half, towards + half] {
                if angle.abs() < right_angle {
                    found.add(angle.tan());
                }
            }
        }
        // Light rays e = (τ, −1, 0) at the distance of the radius from the line through both ends:
        // [a, e, d]² = r²·|e × d|², with [a, e, d] = p + q·τ.
        let d = b - a;
        let (p, q) = (a.z * d.x - a.x * d.z, a.z * d.y - a.y * d.z);
        let square = radius * radius;
        let quadratic = q * q - square * (d.z * d.z + d.y * d.y);
        let half_linear = p * q - square * d.x * d.y;
        let constant = p * p - square * (d.z * d.z + d.x * d.x);
        let discriminant = half_linear * half_linear - quadratic * constant;
        if discriminant >= 0.0 {
            let root = -(half_linear + discriminant.sqrt().copysign(half_linear));
            for tangent in [root / quadratic, constant / root] {
                if tangent.is_finite() && self.touches_inside(lamp, tangent) {
                    found.add(tangent);
                }
            }
        }
        let mut stretch = found.stretch().map(|stretch| stretch.map(|tangent| lamp.x + lamp.y * tangent));
        // Shadows that reach infinitely far along the ray.
        for direction in [-1.0, 1.0] {
            let along_ray = DVec3::new(direction, 0.0, 0.0);
            if closest_on_segment(lamp.extend(0.0), along_ray, true, self.ends).distance_sq < square {
                let infinite = f64::INFINITY.copysign(direction);
                let [low, high] = stretch.unwrap_or([infinite; 2]);
                stretch = Some([low.min(infinite), high.max(infinite)]);
            }
        }
        stretch.filter(|[low, high]| low < high || self.is_near(light, *low))
    }

    /// Whether the light ray of a tangent comes nearest to the piece between its ends, and before the lamp.
    fn touches_inside(&self, lamp: DVec2, tangent: f64) -> bool {
        let direction = DVec3::new(tangent, -1.0, 0.0).normalize();
        let closest = closest_on_segment(lamp.extend(0.0), direction, true, self.ends);
        closest.along > 0.0 && closest.share > 0.0 && closest.share < 1.0
    }
}

/// The hull of the places that were found.
#[derive(Default)]
struct Found(Option<Stretch>);

impl Found {
    fn add(&mut self, place: f64) {
        let [low, high] = self.0.unwrap_or([place; 2]);
        self.0 = Some([low.min(place), high.max(place)]);
    }

    fn stretch(&self) -> Option<Stretch> {
        self.0
    }
}
