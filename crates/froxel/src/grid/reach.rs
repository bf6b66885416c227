//! How far the grid reaches: to the end of the longest ray, or to where no scattered light comes from any more.

use scatter_core::{Frame, LampRay, SceneFacts, ViewRay};

/// e⁻¹⁷ = 4e-8 of the light is left there, half an ulp of f32. Slices beyond would hold nothing; a smaller depth would cut
/// light off.
const NEGLIGIBLE_OPTICAL_DEPTH: f64 = 17.0;

/// Distances from a lamp, in units of the eye's, beyond which a ray's light is left to the last slice: all of it together is
/// this to one of what there is.
const LAMP_REACH: f64 = 1e3;

/// Rays along each side of the picture that are asked in height fog and around lamps.
const PROBES: u32 = 5;

/// Where the last slice ends: finite and > 0.
///
/// Of the channels that scatter, the one that is extinguished least counts. In height fog a ray's own depth is taken, for
/// rays over the whole picture; one that climbs out of the fog ends 17 scale heights of its way later.
pub fn far_of(frame: &Frame<'_>, facts: &SceneFacts) -> f64 {
    let medium = frame.medium();
    let weakest = (0..3)
        .filter(|&channel| medium.components().iter().any(|component| component.sigma_s[channel] > 0.0))
        .map(|channel| medium.sigma_t()[channel])
        .fold(f64::INFINITY, f64::min);
    let uniform = medium.height_falloff().is_none();
    let mut far = facts.longest_ray;
    if uniform && weakest > 0.0 {
        far = far.min(NEGLIGIBLE_OPTICAL_DEPTH / weakest);
    }
    if !uniform || frame.light().position().is_some() {
        far = far.min(probes(frame).map(|ray| reach_of(frame, &ray, weakest)).fold(0.0, f64::max));
    }
    // Rays without length have no light; any length will do for them. f32 holds the square of the longest.
    if far > 0.0 { far.clamp(1e-18, 1e18) } else { 1.0 }
}

fn reach_of(frame: &Frame<'_>, ray: &ViewRay, weakest: f64) -> f64 {
    let eye = frame.camera().eye();
    let mut reach = f64::INFINITY;
    if let Some(fog) = frame.medium().fog_ray(eye, ray) {
        reach = fog.reach(weakest, NEGLIGIBLE_OPTICAL_DEPTH);
        if fog.slope() > 0.0 {
            // Of all the fog on a climbing ray, e⁻¹⁷ lies above this.
            reach = reach.min(NEGLIGIBLE_OPTICAL_DEPTH / fog.slope());
        }
    }
    if let Some(position) = frame.light().position() {
        let lamp = LampRay::new(ray.origin, ray.direction, position - eye, 0.0);
        reach = reach.min(LAMP_REACH * lamp.distance_at(0.0));
    }
    reach
}

/// Rays over the whole picture, its corners among them.
fn probes<'a>(frame: &Frame<'a>) -> impl Iterator<Item = ViewRay> + use<'a> {
    let camera = frame.camera();
    let [width, height] = camera.size().map(f64::from);
    let step = |index: u32| f64::from(index) / f64::from(PROBES - 1);
    (0..PROBES * PROBES)
        .map(move |index| camera.ray(width * step(index % PROBES), height * step(index / PROBES)))
}
