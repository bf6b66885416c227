//! Where the rays of a packet run through one map of a sun: in f64, number by number, so that sixteen rays are set up
//! side by side.

use glam::DVec3;
use scatter_core::{MapProjection, ViewRay};

use super::lanes::LANES;
use super::lookups::MapLanes;
use super::packet::Span;

/// The rays of a packet in one parallel map, counted in steps of `span.end / steps`.
#[derive(Debug, Clone)]
pub struct SunPaths {
    /// `[u, v, depth]` where the rays start.
    start: [[f64; LANES]; 3],
    /// `[u, v, depth]` for a world unit.
    slope: [[f64; LANES]; 3],
    /// Length of a step \[world units\]; 0 where a ray has no length.
    step: [f64; LANES],
    /// The part inside of the map \[world units\]; empty if `from ≥ to`.
    from: [f64; LANES],
    to: [f64; LANES],
    /// Whether no ray leaves the map.
    pub all_inside: bool,
    steps: f64,
}

/// In which steps of a packet a map is met: ranges of step indices, half-open.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StepReach {
    /// Steps in which a sample may lie on the map.
    pub any: [u32; 2],
    /// Steps in which all samples do; empty if there are none.
    pub all: [u32; 2],
}

impl SunPaths {
    /// Parts `[0, span.end]` of `rays` (relative to `eye`), cut into `steps` ≥ 1.
    #[inline(always)]
    pub fn new(
        projection: &MapProjection,
        eye: DVec3,
        rays: &[ViewRay; LANES],
        spans: &[Span; LANES],
        steps: u32,
    ) -> Self {
        let steps = f64::from(steps);
        let zero = [0.0; LANES];
        let (mut start, mut slope) = ([zero; 3], [zero; 3]);
        for (axis, row) in projection.rows().into_iter().enumerate() {
            // The order of MapProjection::ray: the eye and the row's shift nearly cancel far from the origin.
            let base = row.truncate().dot(eye) + row.w;
            for lane in 0..LANES {
                let (from, along) = (rays[lane].origin, rays[lane].direction);
                start[axis][lane] = base + (row.x * from.x + row.y * from.y + row.z * from.z);
                slope[axis][lane] = row.x * along.x + row.y * along.y + row.z * along.z;
            }
        }
        let ends = spans.map(|span| span.end);
        let (mut from, mut to) = (zero, ends);
        for (axis, size) in projection.size().map(f64::from).into_iter().enumerate() {
            for lane in 0..LANES {
                let (p, d) = (start[axis][lane], slope[axis][lane]);
                let (low, high) = (-p / d, (size - p) / d);
                let (enter, leave) = if d > 0.0 { (low, high) } else { (high, low) };
                // Along a border there are no ends: all or nothing. Texels are half-open.
                let (enter, leave) = if d != 0.0 {
                    (enter, leave)
                } else if p >= 0.0 && p < size {
                    (f64::NEG_INFINITY, f64::INFINITY)
                } else {
                    (f64::INFINITY, f64::NEG_INFINITY)
                };
                from[lane] = if enter > from[lane] { enter } else { from[lane] };
                to[lane] = if leave < to[lane] { leave } else { to[lane] };
            }
        }
        let (mut step, mut all_inside) = (zero, true);
        for lane in 0..LANES {
            step[lane] = ends[lane] / steps;
            all_inside &= step[lane] == 0.0 || (from[lane] == 0.0 && to[lane] == ends[lane]);
        }
        Self { start, slope, step, from, to, all_inside, steps }
    }

    /// The rays as the inner loop wants them.
    #[inline(always)]
    pub fn lanes(&self) -> MapLanes {
        let mut lanes = MapLanes::default();
        let (mut origin, mut on_ray) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            // Counting from a step inside of the map keeps coordinates small, wherever the ray starts.
            origin[lane] = (0.5 * (self.from[lane] + self.to[lane]) / self.step[lane]).floor() + 0.5;
            on_ray[lane] = origin[lane] * self.step[lane];
        }
        lanes.origin = std::array::from_fn(|lane| {
            let crosses = self.from[lane] < self.to[lane] && self.step[lane] != 0.0;
            if crosses { origin[lane] as f32 } else { 0.0 }
        });
        // Without a length all samples are the start itself, and weigh nothing; others are outside.
        let elsewhere = self.step.map(|step| if step == 0.0 { 0.0 } else { -1.0 });
        for axis in 0..3 {
            for lane in 0..LANES {
                let crosses = self.from[lane] < self.to[lane] && self.step[lane] != 0.0;
                let at = self.start[axis][lane] + self.slope[axis][lane] * on_ray[lane];
                let step = self.slope[axis][lane] * self.step[lane];
                lanes.start[axis][lane] = if crosses { at as f32 } else { elsewhere[lane] };
                lanes.step[axis][lane] = if crosses { step as f32 } else { 0.0 };
            }
        }
        lanes
    }

    /// The steps whose samples lie on the map: in the middle of each step, or anywhere in it if `jittered`.
    #[inline(always)]
    pub fn reach(&self, jittered: bool) -> StepReach {
        let [mut first, mut last] = [f64::INFINITY, f64::NEG_INFINITY];
        let [mut latest, mut earliest] = [f64::NEG_INFINITY, f64::INFINITY];
        for lane in 0..LANES {
            let (from, to, step) = (self.from[lane], self.to[lane], self.step[lane]);
            // Rays without a length weigh nothing: they decide nothing.
            let decides = step != 0.0;
            let crosses = decides && from < to;
            let (enter, leave) = (from / step, to / step);
            first = first.min(if crosses { enter } else { f64::INFINITY });
            last = last.max(if crosses { leave } else { f64::NEG_INFINITY });
            let (enter, leave) = if crosses { (enter, leave) } else { (f64::INFINITY, f64::NEG_INFINITY) };
            latest = latest.max(if decides { enter } else { f64::NEG_INFINITY });
            earliest = earliest.min(if decides { leave } else { f64::INFINITY });
        }
        // The first step whose sample, at most `play` from the middle, lies behind a place.
        let play = if jittered { 0.5 } else { 0.0 };
        let step_behind = |place: f64, play: f64| (place - 0.5 + play).ceil().clamp(0.0, self.steps) as u32;
        let any = [step_behind(first, -play), step_behind(last, play)];
        let all = [step_behind(latest, play), step_behind(earliest, -play)];
        StepReach { any, all: if any[0] < any[1] { all } else { [0; 2] } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_segments::inside;

    #[test]
    fn rays_side_by_side_are_cut_as_one_by_one() {
        let projection = MapProjection::orthographic(
            [0.3, 0.1, 9.0],
            [0.1, 0.2, -1.0],
            [0.0, 1.0, 0.0],
            [3.0, 2.0],
            [64, 48],
        )
        .unwrap();
        let eye = DVec3::new(0.4, -0.3, 0.2);
        let (mut met, mut left) = (0, 0);
        for seed in 0..500 {
            let ray = |lane: usize| {
                let angle = f64::from(seed) * 0.7 + lane as f64 * 0.01;
                let direction = DVec3::new(angle.sin(), (1.7 * angle).cos(), (2.3 * angle).sin()).normalize();
                ViewRay { origin: DVec3::new(angle.cos() * 4.0, 0.1, 0.0), direction }
            };
            let rays: [ViewRay; LANES] = std::array::from_fn(ray);
            let spans: [Span; LANES] =
                std::array::from_fn(|lane| Span { start: 0.0, end: 0.5 * lane as f64 });
            for jittered in [false, true] {
                let paths = SunPaths::new(&projection, eye, &rays, &spans, 37);
                let reach = paths.reach(jittered);
                let mut all_inside = true;
                for lane in 0..LANES {
                    let path = projection.ray(eye, rays[lane].origin, rays[lane].direction);
                    let end = spans[lane].end;
                    let part = inside(&projection, &path, 0.0, end);
                    let own =
                        (paths.from[lane] < paths.to[lane]).then_some((paths.from[lane], paths.to[lane]));
                    assert_eq!(part, own);
                    all_inside &= end == 0.0 || part == Some((0.0, end));
                    if end == 0.0 {
                        continue;
                    }
                    for step in 0..37u32 {
                        for place in if jittered { vec![0.001, 0.5, 0.999] } else { vec![0.5] } {
                            let at = end / 37.0 * (f64::from(step) + place);
                            let on = part.is_some_and(|(from, to)| from <= at && at < to);
                            met += usize::from(on);
                            left += usize::from(!on);
                            let within = |[from, to]: [u32; 2]| from <= step && step < to;
                            assert!(!on || within(reach.any), "{seed} {lane} {step}: {reach:?}");
                            assert!(on || !within(reach.all), "{seed} {lane} {step}: {reach:?}");
                        }
                    }
                }
                assert_eq!(paths.all_inside, all_inside);
            }
        }
        assert!(met > 1000 && left > 1000, "{met} {left}");
    }
}
