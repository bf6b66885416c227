//! What a frame looks like to those who predict: a few hundred pixels walked exactly, and what their neighbours see.
//!
//! Pixels follow the R₂ sequence (Roberts 2018), so that any number of them is spread evenly. How many are walked is bounded by
//! work, not by the clock: the same frame has the same sample on every machine.

mod block_runs;
mod half_map;
mod march_spread;
mod sampled_ray;

pub use sampled_ray::SampledRay;

use crate::frame::Frame;
use crate::light::Light;
use crate::scene_facts::SceneFacts;
use march_spread::MarchErrors;
use sampled_ray::RayWalker;

/// Most places that are walked, three pixels each.
const MOST_PLACES: usize = 160;
/// Fewest, whatever the work is.
const FEWEST_PLACES: usize = 8;
/// Work that a sample may take, in texels looked at: 1.5 ms at the 17 ns that one takes.
const MOST_WORK: u64 = 85_000;

/// Least change that half a map's texels are taken to make, over what a march with a step a texel misses.
const LEAST_CHANGE: f64 = 0.04;

/// Facts of a frame, and rays through it.
#[derive(Debug, Clone)]
pub struct SceneSample {
    /// What the frame requires.
    pub facts: SceneFacts,
    /// Pixels that were walked, in the order of the sequence.
    pub rays: Vec<SampledRay>,
    /// What lies between pixels across the light's planes, a triple of neighbours each.
    pub triples: Vec<Triple>,
    /// Share of neighbouring pixels whose rays' ends differ by more than a twentieth.
    pub depth_breaks: f64,
    /// What marches are off by; `None` in the dark.
    march_errors: Option<MarchErrors>,
}

/// What three pixels side by side across the light's planes get, relative to the middle one (a hundredth of the picture's mean
/// at least).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Triple {
    /// How far the outer two differ, halved: an edge, or a slope.
    pub slope: f64,
    /// How far the middle one is off the mean of the outer two: what interpolation between them misses.
    pub kink: f64,
    /// The same over the picture's mean.
    pub kink_of_mean: f64,
}

impl SceneSample {
    /// Samples a frame. O(pixels) for its facts (a read a pixel), and at most 2 ms for the walks.
    pub fn of(frame: &Frame<'_>) -> Self {
        let facts = facts_of(frame);
        let [width, height] = frame.size().map(i64::from);
        let mut walker = RayWalker::default();
        let mut rays = Vec::with_capacity(MOST_PLACES);
        let mut triples = Vec::with_capacity(MOST_PLACES);
        let places = MOST_PLACES.min((width * height) as usize).max(1);
        for index in 0..places {
            let (x, y) = place(index, [width, height]);
            let [step_x, step_y] = across(frame, x, y);
            let beside = |sign: i64| {
                let [x, y] = [i64::from(x) + sign * step_x, i64::from(y) + sign * step_y];
                ((0..width).contains(&x) && (0..height).contains(&y)).then_some([x as u32, y as u32])
            };
            let own = walker.walk(frame, x, y, true);
            rays.push(own);
            if let (Some(before), Some(after)) = (beside(-1), beside(1)) {
                let [before, after] = [before, after].map(|[x, y]| walker.walk(frame, x, y, false));
                rays.extend([before, after]);
                triples.push([before.radiance, own.radiance, after.radiance]);
            }
            if index + 1 >= FEWEST_PLACES && walker.work > MOST_WORK {
                break;
            }
        }
        let mean = rays.iter().map(|ray| ray.radiance).sum::<f64>() / rays.len() as f64;
        let triples = triples.iter().map(|values| Triple::of(values, mean)).collect();
        let march_errors = (mean > 0.0).then(|| {
            let spread = |ray: &SampledRay| (ray.march_spread, ray.radiance.max(0.01 * mean));
            MarchErrors::of(&rays.iter().map(spread).collect::<Vec<_>>(), mean)
        });
        Self { facts, rays, triples, depth_breaks: depth_breaks(frame), march_errors }
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

    /// What maps of `scale` times as many texels a side are off by against the triangles: RMS over the mean.
    ///
    /// The geometric mean of two estimates: the change that half as many texels make, which sees edges that move across the ray,
    /// and what a march with a step a texel misses, which takes the edges of neighbouring rays for independent. On 24 shots the first
    /// alone was off by a factor of 0.3 to 2.5, the second by 0.2 to 12, their mean by 0.4 to 2 on 23 of them. Other scales follow
    /// the march, whose stretches are found or missed as the map's are.
    pub fn map_error(&self, scale: f64) -> f64 {
        let mean = self.mean(|ray| ray.radiance);
        if !(mean > 0.0) {
            return 0.0;
        }
        let changes = || self.rays.iter().filter_map(|ray| ray.half_map_change);
        let count = changes().count().max(1) as f64;
        let change = (changes().map(|change| change * change).sum::<f64>() / count).sqrt();
        let marched = |scale: f64| {
            let spread = |ray: &SampledRay| ray.march_spread.at((scale * ray.texels).max(1.0));
            self.mean(|ray| spread(ray).powi(2)).sqrt()
        };
        let [own, other] = [1.0, scale].map(marched);
        // That the sampled blocks happened to keep all edges does not make a map exact.
        let change = change.max(LEAST_CHANGE * own);
        if own > 0.0 { (change / own).sqrt() * other / mean } else { 0.0 }
    }

    /// What a march of so many steps is off by: p99 and RMS over the mean. The position of every edge within its step is
    /// taken for random.
    pub fn march_error(&self, steps: f64) -> [f64; 2] {
        self.march_errors.map_or([0.0; 2], |errors| errors.at(steps))
    }
}

/// The frame's facts. In height fog those of its set-up, which are bounds: every ray's own would take as long as the sample.
fn facts_of(frame: &Frame<'_>) -> SceneFacts {
    match frame.medium().height_falloff() {
        None => SceneFacts::of(frame),
        Some(_) => {
            SceneFacts { casts_shadow: frame.shadow().casts_shadow(), ..SceneFacts::of_setup(frame.setup()) }
        }
    }
}

impl Triple {
    fn of(&[before, own, after]: &[f64; 3], mean: f64) -> Self {
        if !(mean > 0.0) {
            return Self::default();
        }
        let level = own.max(0.01 * mean);
        let kink = (own - 0.5 * (before + after)).abs();
        Self { slope: 0.5 * (after - before).abs() / level, kink: kink / level, kink_of_mean: kink / mean }
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
