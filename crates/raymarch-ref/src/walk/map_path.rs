//! The path of a view ray through the texels of one map: where it crosses each border, and each depth.
//!
//! Every crossing is computed from the border's index, never by adding steps, and by operations that are **monotone
//! in the index to the last bit**: for a parallel map `(k − u₀)/u'`; for a perspective one, with q = u/w the texel
//! coordinate at a point t* inside of the segment and e its derivative there,
//!
//! ```text
//!     t(k) = t* + 1/( e/(k − q) − w'/w* )
//! ```
//!
//! (the inverse of the projective map). So the crossings of a row's borders come in order, however close they lie,
//! and a walk that skips some of them meets the others at the same bits. f64.

use scatter_core::MapRay;

/// One texel coordinate along a ray.
#[derive(Debug, Clone, Copy)]
pub struct AxisPath {
    /// Coordinate at `t_ref`.
    origin: f64,
    /// Texels a world unit at `t_ref` (perspective), or world units a texel (parallel).
    rate: f64,
    /// `w'/w` at `t_ref`; unused for a parallel map.
    bend: f64,
    /// Ray parameter of `origin`.
    t_ref: f64,
    perspective: bool,
    /// The way the coordinate goes: −1, 0 or 1.
    step: i32,
    /// Texels along this axis.
    count: i32,
    /// Borders between texels that the coordinate can cross.
    inner_count: u32,
}

/// Depth along a ray.
#[derive(Debug, Clone, Copy)]
pub struct DepthPath {
    origin: f64,
    /// World units of ray a unit of depth; meaningless where `sign` is 0.
    inverse: f64,
    sign: i32,
}

/// Both texel coordinates and the depth.
#[derive(Debug, Clone, Copy)]
pub struct MapPath {
    /// Columns.
    pub u: AxisPath,
    /// Rows.
    pub v: AxisPath,
    /// Depth.
    pub depth: DepthPath,
    ray: MapRay,
    perspective: bool,
}

/// What the stored depths of a block say about a piece of the ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockVerdict {
    /// Every texel of the block leaves the whole piece lit.
    Lit,
    /// Every texel of the block leaves the whole piece dark.
    Dark,
    /// The texels have to be asked.
    Mixed,
}

impl MapPath {
    /// The path of `ray` on its part `(a, b)`, which lies inside of the map (and before a perspective map's centre).
    /// `None` where rounding has left nothing of the part.
    pub fn new(ray: MapRay, perspective: bool, size: [u32; 2], a: f64, b: f64) -> Option<Self> {
        let depth = DepthPath::new(ray.start.z, ray.step.z);
        let axis = |start: f64, step: f64, count: u32| {
            if perspective {
                let t_ref = reference(&ray, a, b);
                let w = ray.start.z + t_ref * ray.step.z;
                let origin = (start + t_ref * step) / w;
                let rate = (step - origin * ray.step.z) / w;
                AxisPath::new([origin, rate, ray.step.z / w, t_ref], true, count)
            } else {
                AxisPath::new([start, 1.0 / step, 0.0, 0.0], false, count)
            }
        };
        let u = axis(ray.start.x, ray.step.x, size[0]);
        let v = axis(ray.start.y, ray.step.y, size[1]);
        let sane = u.origin.is_finite() && v.origin.is_finite();
        sane.then_some(Self { u, v, depth, ray, perspective })
    }

    /// The texel `(i, j)` at `t`; its entry lies at or before `t`, its exit after it.
    pub fn texel_at(&self, t: f64) -> (i32, i32) {
        (self.column_at(t), self.row_at(t))
    }

    /// Calls `each(i, j, from, to)` for every texel of `[a, b]`, in order.
    #[inline(always)]
    pub fn visit_texels(&self, (a, b): (f64, f64), mut each: impl FnMut(u32, u32, f64, f64)) {
        let (mut i, mut j) = self.texel_at(a);
        let (mut exit_u, mut exit_v) = (self.u.exit(i, 1), self.v.exit(j, 1));
        let mut t = a;
        loop {
            let end = exit_u.min(exit_v).min(b);
            each(i as u32, j as u32, t, end);
            if end >= b {
                return;
            }
            t = end;
            if exit_u <= exit_v {
                i = self.u.after(i, 1);
                exit_u = self.u.exit(i, 1);
            } else {
                j = self.v.after(j, 1);
                exit_v = self.v.exit(j, 1);
            }
        }
    }

    /// The column at `t`.
    pub fn column_at(&self, t: f64) -> i32 {
        self.u.texel_at(t, self.coordinate(self.ray.start.x, self.ray.step.x, t))
    }

    /// The row at `t`.
    pub fn row_at(&self, t: f64) -> i32 {
        self.v.texel_at(t, self.coordinate(self.ray.start.y, self.ray.step.y, t))
    }

    fn coordinate(&self, start: f64, step: f64, t: f64) -> f64 {
        let value = start + t * step;
        if self.perspective { value / (self.ray.start.z + t * self.ray.step.z) } else { value }
    }
}

/// A point well inside of `(a, b)`, so that neither end is far away in terms of w.
fn reference(ray: &MapRay, a: f64, b: f64) -> f64 {
    if b < f64::INFINITY {
        return 0.5 * (a + b);
    }
    // Where w has doubled, and not closer than the way already gone.
    let doubled = (ray.start.z + a * ray.step.z) / ray.step.z;
    let way = doubled.max(a.abs());
    if way.is_finite() && way > 0.0 { a + way } else { a + 1.0 }
}

impl AxisPath {
    fn new([origin, rate, bend, t_ref]: [f64; 4], perspective: bool, count: u32) -> Self {
        // A coordinate that does not move (or so slowly that 1/u' overflows) crosses nothing.
        let moves = rate.is_finite() && rate != 0.0;
        let step = if !moves {
            0
        } else if rate > 0.0 {
            1
        } else {
            -1
        };
        // Sizes are at most 65536 (MapProjection).
        let inner_count = if moves { count - 1 } else { 0 };
        Self { origin, rate, bend, t_ref, perspective, step, count: count as i32, inner_count }
    }

    /// Where the coordinate passes the inner border `border`; ±∞ where it never does.
    #[inline(always)]
    fn crossing(&self, border: i32) -> f64 {
        let offset = f64::from(border) - self.origin;
        if !self.perspective {
            return offset * self.rate;
        }
        let ahead = self.rate / offset;
        let inverse = ahead - self.bend;
        // Beyond the point at infinity the inverse changes its sign.
        if (inverse > 0.0) == (ahead > 0.0) && inverse != 0.0 {
            self.t_ref + 1.0 / inverse
        } else {
            f64::INFINITY.copysign(ahead)
        }
    }

    /// Where the ray leaves texels `first` to `first + length`, ∞ if they reach the map's last border: the outermost
    /// texels are taken to go on for ever, since the ray's part has been cut to the map already.
    #[inline(always)]
    pub fn exit(&self, first: i32, length: i32) -> f64 {
        let border = if self.step > 0 { first + length } else { first };
        // `inner_count` is 0 for a coordinate that does not move; 0 wraps around to the largest u32.
        let inner = (border as u32).wrapping_sub(1) < self.inner_count;
        if inner { self.crossing(border) } else { f64::INFINITY }
    }

    /// The texel after leaving texels `first` to `first + length`.
    pub fn after(&self, first: i32, length: i32) -> i32 {
        if self.step > 0 { first + length } else { first - 1 }
    }

    /// The later of two texels in the way the coordinate goes.
    pub fn later(&self, i: i32, j: i32) -> i32 {
        if self.step >= 0 { i.max(j) } else { i.min(j) }
    }

    /// The texel at `t`, of which `guess` is the coordinate to rounding.
    fn texel_at(&self, t: f64, guess: f64) -> i32 {
        let last = self.count - 1;
        if self.step == 0 {
            return (self.origin as i32).clamp(0, last);
        }
        // The cast saturates, and NaN (at a perspective map's centre) becomes 0; so does what is above −1.
        let mut texel = (guess as i32).clamp(0, last);
        while self.exit(texel, 1) <= t {
            texel += self.step;
        }
        // The entry of a texel is the exit of the one before it.
        while (0..=last).contains(&(texel - self.step)) && self.exit(texel - self.step, 1) > t {
            texel -= self.step;
        }
        texel
    }
}

impl DepthPath {
    fn new(start: f64, step: f64) -> Self {
        let inverse = 1.0 / step;
        let sign = if !inverse.is_finite() {
            0
        } else if step > 0.0 {
            1
        } else {
            -1
        };
        Self { origin: start, inverse, sign }
    }

    /// The lit part of the piece `(a, b)` under a texel with this depth; empty if its end is not behind its start.
    pub fn lit_part(&self, stored: f32, a: f64, b: f64) -> (f64, f64) {
        let stored = f64::from(stored);
        match self.sign {
            0 if self.origin <= stored => (a, b),
            0 => (a, a),
            1 => (a, b.min((stored - self.origin) * self.inverse)),
            _ => (a.max((stored - self.origin) * self.inverse), b),
        }
    }

    /// What [`Self::lit_part`] gives for every depth from `least` to `greatest`: by the same crossings, so that the
    /// verdict holds to the last bit.
    pub fn verdict(&self, least: f32, greatest: f32, a: f64, b: f64) -> BlockVerdict {
        let at_least = self.lit_part(least, a, b);
        if at_least == (a, b) {
            return BlockVerdict::Lit;
        }
        let at_most = self.lit_part(greatest, a, b);
        if at_most.1 > at_most.0 { BlockVerdict::Mixed } else { BlockVerdict::Dark }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn path(start: [f64; 3], step: [f64; 3], perspective: bool, a: f64, b: f64) -> MapPath {
        let ray = MapRay { start: start.into(), step: step.into() };
        MapPath::new(ray, perspective, [4096, 4096], a, b).unwrap()
    }

    #[test]
    fn crossings_lie_on_their_borders() {
        for perspective in [false, true] {
            let start = DVec3::new(120.3, 4000.7, 2.0);
            let step = DVec3::new(11.0, -3.0, 0.4);
            let (a, b) = (0.0, 40.0);
            let path = path(start.into(), step.into(), perspective, a, b);
            let position = |t: f64| {
                let p = start + step * t;
                if perspective { DVec3::new(p.x / p.z, p.y / p.z, p.z) } else { p }
            };
            let from = path.column_at(a);
            let to = path.column_at(b);
            assert_ne!(from, to);
            let mut column = from;
            while column != to {
                let t = path.u.exit(column, 1);
                let border = if path.u.step > 0 { column + 1 } else { column };
                assert!((position(t).x - f64::from(border)).abs() < 1e-10, "{perspective} {column}");
                column += path.u.step;
            }
        }
    }

    #[test]
    fn crossings_never_go_backwards_even_where_they_coincide() {
        // A ray that passes a perspective map's centre at a millionth: the texels rush by within 1e-4 units.
        let path = path([-10.0 * 2048.0, 1000.0, 1e-5], [2048.0, 2e-3, 1e-9], true, 9.9999, 10.0001);
        let (mut column, mut t) = (path.column_at(9.9999), 9.9999);
        for _ in 0..4096 {
            let next = path.u.exit(column, 1);
            assert!(next >= t, "{column}: {next} {t}");
            if next == f64::INFINITY {
                break;
            }
            t = next;
            column += path.u.step;
        }
    }

    #[test]
    fn a_texel_that_is_never_reached_is_entered_at_infinity() {
        // u/w tends to 100: border 101 is never crossed.
        let path = path([10.0, 10.0, 1.0], [100.0, 10.0, 1.0], true, 0.0, f64::INFINITY);
        assert_eq!(path.column_at(0.0), 10);
        assert!(path.u.exit(99, 1) == f64::INFINITY && path.u.exit(98, 1).is_finite());
        assert_eq!(path.column_at(1e300), 99);
    }

    #[test]
    fn depth_pieces_are_lit_up_to_the_stored_depth_inclusive() {
        let falling = DepthPath::new(5.0, 2.0);
        assert_eq!(falling.lit_part(7.0, 0.0, 4.0), (0.0, 1.0));
        assert_eq!(falling.lit_part(f32::INFINITY, 0.0, 4.0), (0.0, 4.0));
        let rising = DepthPath::new(5.0, -2.0);
        assert_eq!(rising.lit_part(1.0, 0.0, 4.0), (2.0, 4.0));
        assert_eq!(rising.lit_part(f32::INFINITY, 0.0, 4.0), (0.0, 4.0));
        let level = DepthPath::new(5.0, 0.0);
        assert_eq!(level.lit_part(5.0, 0.0, 4.0), (0.0, 4.0));
        assert_eq!(level.lit_part(4.9, 0.0, 4.0), (0.0, 0.0));
    }

    #[test]
    fn verdicts_are_those_of_the_extreme_texels() {
        let falling = DepthPath::new(5.0, 2.0);
        assert_eq!(falling.verdict(9.0, 9.5, 0.0, 2.0), BlockVerdict::Lit);
        assert_eq!(falling.verdict(8.9, 9.5, 0.0, 2.0), BlockVerdict::Mixed);
        assert_eq!(falling.verdict(1.0, 5.0, 0.0, 2.0), BlockVerdict::Dark);
    }
}
