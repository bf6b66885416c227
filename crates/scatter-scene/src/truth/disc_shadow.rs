//! What a sphere of smoke does to the shadow rays of one view ray.
//!
//! The plane of a view ray and a light cuts a sphere in a disc. The shadow ray of the point (t, 0) crosses it in a chord, cut
//! off at the point itself and at the lamp: a smooth function of t but where the shadow ray touches the disc and where the
//! point enters or leaves it.

use glam::DVec2;

use super::shadow_plane::PlaneLight;

/// A sphere in the plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Disc {
    /// Middle: along the ray, and towards the light.
    pub middle: DVec2,
    pub radius: f64,
    /// Extinction inside of it.
    pub density: f64,
}

/// The stretch of a ray that an occluder can dim.
pub(super) type Stretch = [f64; 2];

impl Disc {
    /// The optical depth of the shadow ray from the point at t.
    #[inline]
    pub fn optical_depth(&self, light: PlaneLight, t: f64) -> f64 {
        let from_point = DVec2::new(self.middle.x - t, self.middle.y);
        let (to_light, length) = match light {
            PlaneLight::Sun(direction) => (direction, f64::INFINITY),
            PlaneLight::Lamp(place) => {
                let way = DVec2::new(place.x - t, place.y);
                let length = way.length();
                // At the lamp itself no way is left.
                if length == 0.0 {
                    return 0.0;
                }
                (way / length, length)
            }
        };
        let distance = from_point.perp_dot(to_light).abs();
        if !(distance < self.radius) {
            return 0.0;
        }
        let half = ((self.radius - distance) * (self.radius + distance)).sqrt();
        let middle = from_point.dot(to_light);
        let chord = (middle + half).min(length) - (middle - half).max(0.0);
        self.density * chord.max(0.0)
    }

    /// The stretch that it can dim, and the places of its kinks in it (NaN: none). `None` if it dims nothing.
    pub fn shadow(&self, light: PlaneLight) -> Option<(Stretch, [f64; 4])> {
        let Self { middle, radius, .. } = *self;
        let (mut kinks, mut all) = ([f64::NAN; 4], [f64::INFINITY, f64::NEG_INFINITY]);
        let is_on_ray = middle.y.abs() < radius;
        if is_on_ray {
            let half = ((radius - middle.y) * (radius + middle.y)).sqrt();
            kinks[0] = middle.x - half;
            kinks[1] = middle.x + half;
        }
        let place = match light {
            PlaneLight::Sun(to_light) | PlaneLight::Lamp(to_light) if to_light.y == 0.0 => {
                // The light is on the ray's line: all that it dims is on that line.
                let is_ahead = to_light.x > 0.0;
                let ends = if is_ahead { [f64::NEG_INFINITY, kinks[1]] } else { [kinks[0], f64::INFINITY] };
                return is_on_ray.then_some((ends, kinks));
            }
            PlaneLight::Sun(to_light) => {
                if middle.y + radius <= 0.0 {
                    return None;
                }
                let image = middle.x - middle.y * (to_light.x / to_light.y);
                let half = radius / to_light.y;
                kinks[2] = image - half;
                kinks[3] = image + half;
                return Some((hull(kinks, all), kinks));
            }
            PlaneLight::Lamp(place) => place,
        };
        let from_lamp = middle - place;
        let distance = from_lamp.length();
        if middle.y + radius <= 0.0 || middle.y - radius >= place.y {
            return None;
        }
        if distance <= radius {
            // Every way to the lamp ends inside.
            return Some(([f64::NEG_INFINITY, f64::INFINITY], kinks));
        }
        // Angles at the lamp from the perpendicular on the ray; at a right angle to it the shadow is infinitely far.
        let (towards, half) = (from_lamp.x.atan2(-from_lamp.y), (radius / distance).asin());
        let (first, last) = (towards - half, towards + half);
        let right_angle = std::f64::consts::FRAC_PI_2;
        if first >= right_angle || last <= -right_angle {
            return None;
        }
        for (kink, angle) in [(2, first), (3, last)] {
            if angle.abs() < right_angle {
                kinks[kink] = place.x + place.y * angle.tan();
            } else {
                all[usize::from(angle > 0.0)] = f64::INFINITY.copysign(angle);
            }
        }
        Some((hull(kinks, all), kinks))
    }
}

/// The stretch that holds all kinks, and `all` where that goes beyond.
fn hull(kinks: [f64; 4], all: Stretch) -> Stretch {
    // min and max pass over NaN.
    kinks.into_iter().fold(all, |[low, high], kink| [low.min(kink), high.max(kink)])
}
