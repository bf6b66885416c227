//! A ray through a map, texel by texel: which texels it crosses, in order, and between which ray parameters.
//!
//! Every border's parameter is computed from the border's own index, `t = (U₀ − k·W₀)/(k·Ẇ − U̇)` (W ≡ 1 for a
//! parallel map), never accumulated, so that the error does not grow along the ray (after Amanatides and Woo 1987,
//! who add up).

use crate::map_projection::{MapProjection, MapRay};

/// A stretch of a ray inside of one texel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexelSpan {
    /// Column.
    pub i: u32,
    /// Row.
    pub j: u32,
    /// Where the ray enters the texel.
    pub t_min: f64,
    /// Where it leaves; ≥ `t_min`.
    pub t_max: f64,
}

/// Iterator over the [`TexelSpan`]s of a ray between two parameters; what lies outside of the map is left out.
#[derive(Debug, Clone)]
pub struct TexelWalk {
    axes: [Axis; 2],
    /// Where the ray leaves the texel along each axis: a division each, so that only the axis that has moved is asked again.
    borders: [f64; 2],
    t: f64,
    t_end: f64,
}

/// One image axis of the walk.
#[derive(Debug, Clone, Copy)]
struct Axis {
    /// Numerator at t = 0 and its step.
    start: f64,
    step: f64,
    /// Denominator at t = 0 and its step; 1 and 0 for a parallel map.
    w_start: f64,
    w_step: f64,
    /// +1, 0 or −1: which way the index goes along the ray.
    heading: i64,
    count: i64,
    index: i64,
}

impl TexelWalk {
    /// The texels of `map` on `ray` (as [`MapProjection::ray`] gives it) for `t_min ≤ t ≤ t_max`, both finite or
    /// `t_max = ∞`.
    pub fn new(map: &MapProjection, ray: &MapRay, t_min: f64, t_max: f64) -> Self {
        let [width, height] = map.size();
        let (w_start, w_step) = if map.is_perspective() { (ray.start.z, ray.step.z) } else { (1.0, 0.0) };
        let axis = |start: f64, step: f64, count: u32| {
            // The sign of d(U/W)/dt is constant: U̇·W₀ − U₀·Ẇ over W².
            let slope = step * w_start - start * w_step;
            let heading = if slope > 0.0 { 1 } else { -i64::from(slope < 0.0) };
            Axis { start, step, w_start, w_step, heading, count: count.into(), index: 0 }
        };
        let mut axes = [axis(ray.start.x, ray.step.x, width), axis(ray.start.y, ray.step.y, height)];
        let (mut t, mut t_end) = (t_min, t_max);
        if map.is_perspective() {
            clip_to_front(ray, &mut t, &mut t_end);
        }
        for axis in &axes {
            axis.clip(&mut t, &mut t_end);
        }
        for axis in &mut axes {
            axis.index = axis.index_at(t);
        }
        Self { axes, borders: axes.map(|axis| axis.next_border()), t, t_end }
    }
}

impl Iterator for TexelWalk {
    type Item = TexelSpan;

    fn next(&mut self) -> Option<TexelSpan> {
        if !(self.t < self.t_end) {
            return None;
        }
        let nearer = usize::from(self.borders[1] < self.borders[0]);
        // Rounding may put a border just before the current parameter: the span is then empty, never negative.
        let t_max = self.borders[nearer].clamp(self.t, self.t_end);
        let [i, j] = self.axes.map(|axis| axis.index as u32);
        let span = TexelSpan { i, j, t_min: self.t, t_max };
        self.t = t_max;
        let axis = &mut self.axes[nearer];
        if t_max < self.t_end {
            axis.index += axis.heading;
            self.borders[nearer] = axis.next_border();
            if !(0..axis.count).contains(&axis.index) {
                // The last border of the map, an ulp before its clipped end.
                self.t = self.t_end;
            }
        }
        Some(span)
    }
}

impl Axis {
    /// The parameter at which the coordinate is `k`; may be infinite or NaN for a heading of 0.
    fn at_border(&self, k: f64) -> f64 {
        (self.start - k * self.w_start) / (k * self.w_step - self.step)
    }

    fn next_border(&self) -> f64 {
        match self.heading {
            0 => f64::INFINITY,
            heading => {
                let t = self.at_border((self.index + i64::from(heading > 0)) as f64);
                // A perspective ray may never reach a border before infinity: the solution then lies behind it.
                if self.w_start + self.w_step * t > 0.0 && t.is_finite() { t } else { f64::INFINITY }
            }
        }
    }

    /// Shrinks `[t, t_end]` to where the coordinate lies in [0, count).
    fn clip(&self, t: &mut f64, t_end: &mut f64) {
        let count = self.count as f64;
        if self.heading == 0 {
            let value = self.start / self.w_start;
            if !(value >= 0.0 && value < count) {
                *t_end = *t;
            }
            return;
        }
        let (first, last) = if self.heading > 0 { (0.0, count) } else { (count, 0.0) };
        let in_front = |t: f64| self.w_start + self.w_step * t > 0.0;
        let (enter, leave) = (self.at_border(first), self.at_border(last));
        let now = (self.start + self.step * *t) / (self.w_start + self.w_step * *t);
        let before = if self.heading > 0 { now < first } else { now > first };
        let beyond = if self.heading > 0 { now >= last } else { now <= last };
        if beyond {
            *t_end = *t;
        } else if before {
            // Never entered in front of the map: nothing is left.
            if enter.is_finite() && in_front(enter) { *t = t.max(enter) } else { *t_end = *t }
        }
        if leave.is_finite() && in_front(leave) && leave >= *t {
            *t_end = t_end.min(leave);
        }
    }

    fn index_at(&self, t: f64) -> i64 {
        let value = (self.start + self.step * t) / (self.w_start + self.w_step * t);
        let index = value.floor() as i64;
        // On a border that it enters downwards, the texel is the one below.
        let on_border = self.heading < 0 && value == value.floor();
        // Of an empty walk the value may be infinite.
        index.saturating_sub(i64::from(on_border)).clamp(0, self.count - 1)
    }
}

/// Shrinks `[t, t_end]` to where the depth of a perspective map is above zero.
fn clip_to_front(ray: &MapRay, t: &mut f64, t_end: &mut f64) {
    let plane = -ray.start.z / ray.step.z;
    // One part in 10¹² of the way past the plane: u and v are infinite on it.
    if ray.step.z > 0.0 {
        *t = t.max(plane + 1e-12 * plane.abs());
    } else if ray.step.z < 0.0 {
        *t_end = t_end.min(plane - 1e-12 * plane.abs());
    } else if ray.start.z <= 0.0 {
        *t_end = *t;
    }
    *t_end = t_end.max(*t);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn maps() -> [MapProjection; 2] {
        let (position, forward, up) = ([1.0, 2.0, 3.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
        [
            MapProjection::orthographic(position, forward, up, [4.0, 3.0], [17, 9]).unwrap(),
            MapProjection::perspective(position, forward, up, 0.8, 13).unwrap(),
        ]
    }

    /// A repeatable spread of rays, most of which cross the maps.
    fn rays() -> impl Iterator<Item = (DVec3, DVec3)> {
        (0..400).map(|n| {
            let a = f64::from(n);
            let start =
                DVec3::new(6.0 * a.sin(), 2.0 - 4.0 * (0.7 * a).cos().abs(), 3.0 + 5.0 * (1.3 * a).sin());
            let towards = DVec3::new((2.1 * a).cos(), -3.0 + (0.3 * a).sin(), 3.0 + (3.7 * a).cos());
            (start, (towards - start).normalize())
        })
    }

    #[test]
    fn spans_tile_the_part_of_the_ray_that_lies_inside_of_the_map() {
        let mut crossed = 0;
        for map in maps() {
            for (start, direction) in rays() {
                let ray = map.ray(DVec3::ZERO, start, direction);
                let [width, height] = map.size().map(f64::from);
                let inside = |t: f64| {
                    let p = map.texel_from_world(start + direction * t);
                    let in_front = !map.is_perspective() || p.z > 0.0;
                    (in_front && p.x >= 0.0 && p.y >= 0.0 && p.x < width && p.y < height).then_some(p)
                };
                let spans: Vec<_> = TexelWalk::new(&map, &ray, 0.5, 12.0).collect();
                crossed += spans.len();
                for pair in spans.windows(2) {
                    assert_eq!(pair[0].t_max, pair[1].t_min, "no gap");
                }
                for n in 0..500 {
                    let t = 0.5 + 11.5 * (f64::from(n) + 0.5) / 500.0;
                    // Points within 1e-9 of a span's end may fall to either side.
                    let near_end = spans.iter().any(|s| (t - s.t_min).abs().min((t - s.t_max).abs()) < 1e-9);
                    let span = spans.iter().find(|s| s.t_min <= t && t < s.t_max);
                    if near_end {
                        continue;
                    }
                    let found = span.map(|s| (s.i, s.j));
                    assert_eq!(found, inside(t).map(|p| (p.x as u32, p.y as u32)), "{start} {direction} {t}");
                }
            }
        }
        assert!(crossed > 3000, "the rays hardly meet the maps: {crossed}");
    }

    #[test]
    fn a_ray_along_the_light_stays_in_one_texel() {
        let map = maps()[0];
        let forward = DVec3::new(0.2, -1.0, 0.3).normalize();
        let mut ray = map.ray(DVec3::ZERO, DVec3::new(1.5, 2.0, 3.5), forward);
        ray.step = DVec3::new(0.0, 0.0, 1.0);
        let spans: Vec<_> = TexelWalk::new(&map, &ray, 0.0, f64::INFINITY).collect();
        assert_eq!(spans.len(), 1);
        assert_eq!((spans[0].t_min, spans[0].t_max), (0.0, f64::INFINITY));
    }

    #[test]
    fn a_ray_from_the_plane_of_a_cube_face_never_enters_it() {
        let map = MapProjection::cube_face([0.0, 3.0, 0.0], 0, 4).unwrap();
        let ray = map.ray(DVec3::ZERO, DVec3::new(0.0, 1.0, 6.0), DVec3::new(-0.3, -0.2, -1.0));
        assert_eq!(TexelWalk::new(&map, &ray, 0.0, 10.0).count(), 0);
    }

    #[test]
    fn axis_aligned_rays_on_texel_borders_end() {
        let map =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [2.0, 2.0], [4, 4])
                .unwrap();
        for direction in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
            let start = -10.0 * direction;
            let ray = map.ray(DVec3::ZERO, start, direction);
            let spans: Vec<_> = TexelWalk::new(&map, &ray, 0.0, f64::INFINITY).collect();
            assert_eq!(spans.len(), 4, "{direction}");
            assert!((spans[3].t_max - spans[0].t_min - 4.0).abs() < 1e-12);
        }
    }
}
