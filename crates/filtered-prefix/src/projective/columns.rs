//! Where along view rays the texels of a map go whose pixels fetch means of whole rays: where the picture's light is.
//!
//! A texel's part of a ray's light is what that ray's mean is off by if the texel is half wrong. So one half of the texels is spread
//! like the light of a sample of view rays, `C(w) = mean of ∫₀ʷ light / ∫₀ᵉⁿᵈ light`, and one half evenly in log w, which keeps splits,
//! whose texels are even in κ and so thin out with w², from reaching too far each. What lies before the first texel has about half a
//! texel's light, and counts as it does.
//!
//! Departure from Klehm et al. (2014), Section 4.2, whose splits follow the distance alone.

use scatter_core::{Frame, sun_interval_f32};

use super::rectification::Rectification;

/// Pixels of the sample a row and a column of the image, at most.
const SAMPLE: u32 = 28;

/// Light of the mean ray that may lie before the first texel.
const BEFORE_FIRST: f64 = 1.0 / 2048.0;

/// Part of the texels that is spread evenly in log w.
const LOGARITHMIC: f64 = 0.5;

/// Nearest border over the farthest that is looked at.
const NEAREST: f64 = 1e-6;

/// Where the light of a picture's view rays lies; a buffer.
#[derive(Debug, Default)]
pub struct LightSpread {
    /// Place of a view ray's end ([`Rectification::place`]), extinction a unit of it, and the light up to there.
    rays: Vec<[f64; 3]>,
}

impl LightSpread {
    /// Samples the view rays of a frame. O(1).
    pub fn fill(&mut self, frame: &Frame<'_>, rectification: &Rectification) {
        let [width, height] = frame.size();
        let (camera, limit) = (frame.camera(), frame.max_distance());
        // A lamp's light is spread evenly over its angle; its extinction is left out.
        let sigma = match rectification.lamp {
            None => frame.medium().sigma_t().iter().sum::<f64>() / 3.0,
            Some(_) => 0.0,
        };
        self.rays.clear();
        for y in (0..height).step_by(height.div_ceil(SAMPLE) as usize) {
            for x in (0..width).step_by(width.div_ceil(SAMPLE) as usize) {
                let direction = camera.pixel_ray(x, y).direction;
                let depth = frame.depth().texels()[(y * width + x) as usize];
                let end = direction * f64::from(depth).min(limit);
                let across = rectification.along.dot(end);
                let place = match rectification.lamp {
                    None => across,
                    Some(distance) => across.atan2(distance - rectification.to_light.dot(end)),
                };
                if place > 0.0 {
                    let extinction = sigma / rectification.along.dot(direction);
                    self.rays.push([place, extinction, light(extinction, place)]);
                }
            }
        }
    }

    /// Part of its light that the mean view ray has before a place.
    fn before(&self, place: f64) -> f64 {
        let part = |&[end, extinction, whole]: &[f64; 3]| {
            if place >= end { 1.0 } else { light(extinction, place) / whole }
        };
        self.rays.iter().map(part).sum::<f64>() / self.rays.len().max(1) as f64
    }

    /// The nearest place that a map needs whose farthest one is known.
    pub fn nearest(&self, farthest: f64) -> f64 {
        crossing([NEAREST * farthest, 0.1 * farthest], BEFORE_FIRST, |place| self.before(place))
    }

    /// Fills `borders` with the places between which splits lie that have as many texels each.
    pub fn borders(&self, [near, far]: [f64; 2], borders: &mut [f64]) {
        let first = self.before(near);
        let range = (self.before(far) - first).max(f64::MIN_POSITIVE);
        let texels = |place: f64| {
            let light = (self.before(place) - first) / range;
            light + LOGARITHMIC * ((place / near).ln() / (far / near).ln() - light)
        };
        let count = borders.len() - 1;
        let mut last = near;
        for (index, border) in borders.iter_mut().enumerate() {
            *border = match index {
                0 => near,
                index if index == count => far,
                _ => crossing([last, far], index as f64 / count as f64, texels),
            };
            last = *border;
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of::<[f64; 3]>() * self.rays.capacity()
    }
}

/// Light of a ray up to a place, in any unit.
fn light(extinction: f64, place: f64) -> f64 {
    f64::from(sun_interval_f32(extinction as f32, 0.0, place as f32)).max(f64::MIN_POSITIVE)
}

/// Where a function that grows takes a value, by regula falsi in log (Illinois: an end that stays counts half), to 1e-6 of that
/// value: some eight of the function's values, each of which asks all rays.
fn crossing([mut low, mut high]: [f64; 2], value: f64, grows: impl Fn(f64) -> f64) -> f64 {
    const CLOSE: f64 = 1e-6;
    let missing = |place: f64| grows(place) - value;
    let (mut below, mut above) = (missing(low), missing(high));
    if below >= 0.0 || above <= 0.0 {
        return if below >= 0.0 { low } else { high };
    }
    let (mut middle, mut last_side) = (low, 0);
    for _ in 0..40 {
        middle = low * (high / low).powf(below / (below - above));
        let at = missing(middle);
        if at.abs() < CLOSE * value.abs() {
            break;
        }
        let side = if at < 0.0 { -1 } else { 1 };
        if side < 0 {
            (low, below) = (middle, at);
            above *= if last_side == side { 0.5 } else { 1.0 };
        } else {
            (high, above) = (middle, at);
            below *= if last_side == side { 0.5 } else { 1.0 };
        }
        last_side = side;
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_follow_the_light_and_leave_little_before_the_first() {
        // Rays of many lengths in thin and in thick air.
        for extinction in [0.0, 0.02, 0.2] {
            let rays =
                (1..=40).map(|n| f64::from(n * n)).map(|end| [end, extinction, light(extinction, end)]);
            let spread = LightSpread { rays: rays.collect() };
            let near = spread.nearest(1600.0);
            let before = spread.before(near);
            println!("extinction {extinction}: near {near:.5}, {before:.2e} of the light before it");
            // A millionth is where the search ends.
            assert!((before / BEFORE_FIRST - 1.0).abs() < 1e-6);
            let mut borders = [0.0; 17];
            spread.borders([near, 1600.0], &mut borders);
            assert_eq!([borders[0], borders[16]], [near, 1600.0]);
            for pair in borders.windows(2) {
                // Half the texels are a split's share of the light at most, the other half of the logarithm.
                let light = spread.before(pair[1]) - spread.before(pair[0]);
                let logarithm = (pair[1] / pair[0]).ln() / (1600.0 / near).ln();
                assert!(pair[1] > pair[0] && light <= 2.001 / 16.0 && logarithm <= 2.001 / 16.0);
            }
        }
    }
}
