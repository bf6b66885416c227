//! What a frame looks like to those who predict: a few hundred pixels walked exactly, and what their neighbours see.
//!
//! Pixels follow the R₂ sequence (Roberts 2018), so that any number of them is spread evenly. How many are walked is bounded by
//! work, not by the clock: the same frame has the same sample on every machine.

mod block_runs;
mod march_spread;
mod sampled_ray;

pub use sampled_ray::SampledRay;

use crate::frame::Frame;
use crate::light::Light;
use crate::scene_facts::SceneFacts;
use march_spread::quantile_of_spreads;
use sampled_ray::RayWalker;

/// Most places that are walked, two pixels each.
const MOST_PLACES: usize = 240;
/// Fewest, whatever the work is.
const FEWEST_PLACES: usize = 8;
/// Work that a sample may take, in texels looked at: 2 ms at the 12 ns that one takes.
const MOST_WORK: u64 = 160_000;
/// Pixels between a place and its neighbour.
const ACROSS: i64 = 2;

/// Facts of a frame, and rays through it.
#[derive(Debug, Clone)]
pub struct SceneSample {
    /// What the frame requires.
    pub facts: SceneFacts,
    /// Pixels that were walked, in the order of the sequence.
    pub rays: Vec<SampledRay>,
    /// How the light differs between a pixel and the second next one across the light's planes.
    pub across: Variation,
    /// Share of neighbouring pixels whose rays' ends differ by more than a twentieth.
    pub depth_breaks: f64,
}

/// How what pixels get differs at a distance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Variation {
    /// RMS of the differences over the mean radiance.
    pub rms: f64,
    /// Mean of differences over the larger of the two values, a hundredth of the picture's mean at least.
    pub relative: f64,
    /// Share of pairs that differ by more than 1 %.
    pub share: f64,
}

impl SceneSample {
    /// Samples a frame. O(pixels) for its facts (a read a pixel), and at most 2 ms for the walks.
    pub fn of(frame: &Frame<'_>) -> Self {
        let facts = SceneFacts::of(frame);
        let [width, height] = frame.size().map(i64::from);
        let mut walker = RayWalker::default();
        let mut rays = Vec::with_capacity(MOST_PLACES);
        let mut pairs = Vec::with_capacity(MOST_PLACES);
        let places = MOST_PLACES.min((width * height) as usize).max(1);
        for index in 0..places {
            let (x, y) = place(index, [width, height]);
            let ray = walker.walk(frame, x, y);
            let [step_x, step_y] = across(frame, x, y);
            // A neighbour within the picture, on either side.
            let side = |sign: i64| {
                let x = i64::from(x) + sign * ACROSS * step_x;
                let y = i64::from(y) + sign * ACROSS * step_y;
                ((0..width).contains(&x) && (0..height).contains(&y)).then_some([x as u32, y as u32])
            };
            rays.push(ray);
            if let Some([x, y]) = side(1).or_else(|| side(-1)) {
                let neighbour = walker.walk(frame, x, y);
                pairs.push((ray.radiance, neighbour.radiance));
                rays.push(neighbour);
            }
            if rays.len() >= FEWEST_PLACES && walker.work > MOST_WORK {
                break;
            }
        }
        let mean = rays.iter().map(|ray| ray.radiance).sum::<f64>() / rays.len() as f64;
        let across = Variation::of(&pairs, mean);
        Self { facts, rays, across, depth_breaks: depth_breaks(frame) }
    }

    /// Pixels of the image.
    pub fn pixels(&self) -> f64 {
        let [width, height] = self.facts.size.map(f64::from);
        width * height
    }

    /// Mean over the rays.
    pub fn mean(&self, of: impl Fn(&SampledRay) -> f64) -> f64 {
        self.rays.iter().map(of).sum::<f64>() / self.rays.len().max(1) as f64
    }

    /// Share of the light that is lit, 0 to 1; 1 where there is none.
    pub fn lit_share(&self) -> f64 {
        let whole = self.mean(|ray| ray.unoccluded);
        if whole > 0.0 { (self.mean(|ray| ray.radiance) / whole).min(1.0) } else { 1.0 }
    }

    /// What a march of so many steps is off by: p99 and RMS over the mean. The position of every edge within its step is
    /// taken for random.
    pub fn march_error(&self, steps: f64) -> [f64; 2] {
        let mean = self.mean(|ray| ray.radiance);
        if !(mean > 0.0) {
            return [0.0; 2];
        }
        let spread = |ray: &SampledRay| ray.march_spread.at(steps);
        let rms = self.mean(|ray| spread(ray).powi(2)).sqrt() / mean;
        let relative: Vec<f64> =
            self.rays.iter().map(|ray| spread(ray) / ray.radiance.max(0.01 * mean)).collect();
        [quantile_of_spreads(&relative, 0.01), rms]
    }
}

impl Variation {
    fn of(pairs: &[(f64, f64)], mean: f64) -> Self {
        if pairs.is_empty() || !(mean > 0.0) {
            return Self::default();
        }
        let over_pairs = |of: &dyn Fn(f64, f64) -> f64| {
            pairs.iter().map(|&(a, b)| of(a, b)).sum::<f64>() / pairs.len() as f64
        };
        let relative = |a: f64, b: f64| (a - b).abs() / a.max(b).max(0.01 * mean);
        Self {
            rms: over_pairs(&|a, b| (a - b).powi(2)).sqrt() / mean,
            relative: over_pairs(&relative),
            share: over_pairs(&|a, b| f64::from(relative(a, b) > 0.01)),
        }
    }
}

/// Number `index` of the sequence, as a pixel.
fn place(index: usize, size: [i64; 2]) -> (u32, u32) {
    // Powers of the inverse of the plastic number.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let at = |axis: usize| {
        let fraction = (0.5 + STEPS[axis] * index as f64).fract();
        ((fraction * size[axis] as f64) as i64).clamp(0, size[axis] - 1) as u32
    };
    (at(0), at(1))
}

/// The step of one pixel that leaves the plane of a pixel's ray and the light soonest.
fn across(frame: &Frame<'_>, x: u32, y: u32) -> [i64; 2] {
    let camera = frame.camera();
    let epipole = match frame.light() {
        Light::Directional(sun) => camera.image_from_direction(sun.direction()),
        lamp => match lamp.position() {
            Some(position) => camera.image_from_world(position),
            None => return [1, 0],
        },
    };
    let along = [epipole.x - (f64::from(x) + 0.5) * epipole.z, epipole.y - (f64::from(y) + 0.5) * epipole.z];
    if along[0].abs() < along[1].abs() { [1, 0] } else { [0, 1] }
}

/// Of some thousand pairs of neighbours.
fn depth_breaks(frame: &Frame<'_>) -> f64 {
    const PAIRS: usize = 2048;
    let [width, height] = frame.size().map(i64::from);
    if width < 2 {
        return 0.0;
    }
    let breaks = (0..PAIRS).filter(|&index| {
        let (x, y) = place(index, [width - 1, height]);
        let [a, b] = [frame.ray_end(x, y), frame.ray_end(x + 1, y)];
        a != b && !((a - b).abs() <= 0.05 * a.max(b))
    });
    breaks.count() as f64 / PAIRS as f64
}
