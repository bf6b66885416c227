//! One ray through the quadtree in f64: the plain form of exact mode, for rays that the packets of f32 lanes cannot hold.
//!
//! ```text
//!     block ← the coarsest one that holds the start
//!     until the end of the ray:
//!         texel:  its lit part, by the crossing with its depth;  go to the next texel
//!         block:  all lit or all dark:  go to the next block, up a level if that is another parent's
//!                 neither:              down a level
//! ```
//!
//! Departures: borders are computed from their own index, never accumulated, and the other axis' index is clamped to the
//! block that the ray leaves, so that rounding cannot turn it back.

use scatter_core::{MapRay, ShadowLayer};

use crate::tree::MinMaxTree;

/// What a descent looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Looks {
    /// Nodes.
    pub nodes: u64,
    /// Texels.
    pub texels: u64,
}

/// Calls `each(a, b)` for the lit stretches of the part `[t_min, t_max]` of a ray, in order, neighbours not joined. The
/// part lies inside of the layer; `path` is the ray in its space.
pub fn lit_stretches(
    layer: &ShadowLayer<'_>,
    tree: &MinMaxTree,
    path: &MapRay,
    [t_min, t_max]: [f64; 2],
    looks: &mut Looks,
    mut each: impl FnMut(f64, f64),
) {
    let projection = layer.projection();
    let depth = [path.start.z, path.step.z];
    let divisor = if projection.is_perspective() { depth } else { [1.0, 0.0] };
    let [width, height] = projection.size();
    let mut axes = [
        Axis::new([path.start.x, path.step.x], divisor, width, t_min),
        Axis::new([path.start.y, path.step.y], divisor, height, t_min),
    ];
    let code_at = |t: f64| {
        // A depth may be rounded to below zero at the lamp itself.
        let depth = depth[0] + depth[1] * t;
        tree.codes().of_point(if projection.is_perspective() { depth.max(f64::MIN_POSITIVE) } else { depth })
    };
    let mut lit = |a: f64, b: f64| {
        if b > a {
            each(a, b);
        }
    };
    let (mut t, mut level) = (t_min, tree.coarsest());
    let mut code = code_at(t);
    while t < t_max {
        let borders = [axes[0].border(level), axes[1].border(level)];
        let nearer = usize::from(borders[1] < borders[0]);
        // A border may be rounded to just before the point where the ray is: the stretch is then empty.
        let end = borders[nearer].max(t).min(t_max);
        let end_code = code_at(end);
        let (i, j) = (axes[0].index as u32, axes[1].index as u32);
        if level == 0 {
            looks.texels += 1;
            let surface = f64::from(layer.at(i, j));
            let crossing = if surface.is_finite() { (surface - depth[0]) / depth[1] } else { f64::INFINITY };
            if surface == f64::INFINITY {
                lit(t, end);
            } else if depth[1] > 0.0 {
                lit(t, end.min(crossing));
            } else if depth[1] < 0.0 {
                lit(t.max(crossing), end);
            } else if depth[0] <= surface {
                lit(t, end);
            }
        } else {
            looks.nodes += 1;
            let node = tree.node(level, i, j);
            let (least, most) = if code < end_code { (code, end_code) } else { (end_code, code) };
            if most <= node.nearest() {
                lit(t, end);
            } else if !(least >= node.farthest()) {
                level = if level == tree.finest() { 0 } else { level - 1 };
                continue;
            }
        }
        if !(end < t_max) {
            return;
        }
        let before = [axes[0].index, axes[1].index];
        if !axes[nearer].leave(level) {
            return;
        }
        axes[1 - nearer].follow(end, level);
        (t, code) = (end, end_code);
        let above = if level == 0 { tree.finest() } else { level + 1 };
        let crossed = (axes[0].index ^ before[0]) | (axes[1].index ^ before[1]);
        if above <= tree.coarsest() && crossed >> above != 0 {
            level = above;
        }
    }
}

/// One image axis of a ray: the coordinate is `(start + t·step)/(w + t·w_step)`.
struct Axis {
    start: f64,
    step: f64,
    divisor: [f64; 2],
    /// +1, 0 or −1: which way the index goes along the ray.
    heading: i64,
    count: i64,
    index: i64,
}

impl Axis {
    fn new([start, step]: [f64; 2], divisor: [f64; 2], count: u32, t: f64) -> Self {
        // The sign of the coordinate's slope is constant along the ray.
        let slope = step * divisor[0] - start * divisor[1];
        let heading = if slope > 0.0 { 1 } else { -i64::from(slope < 0.0) };
        let mut axis = Self { start, step, divisor, heading, count: count.into(), index: 0 };
        let at = axis.at(t);
        // On a border that it enters downwards, the texel is the one below.
        let on_border = heading < 0 && at == at.floor();
        axis.index = (at.floor() as i64).saturating_sub(i64::from(on_border)).clamp(0, axis.count - 1);
        axis
    }

    fn at(&self, t: f64) -> f64 {
        (self.start + self.step * t) / (self.divisor[0] + self.divisor[1] * t)
    }

    /// The texel border behind which the ray is in the next block.
    fn next(&self, level: u32) -> i64 {
        ((self.index >> level) + i64::from(self.heading > 0)) << level
    }

    /// Where the ray leaves the block; ∞ where it never does.
    fn border(&self, level: u32) -> f64 {
        if self.heading == 0 {
            return f64::INFINITY;
        }
        let k = self.next(level) as f64;
        let t = (self.start - k * self.divisor[0]) / (k * self.divisor[1] - self.step);
        // A perspective ray may never reach a border before infinity: the solution then lies behind the lamp.
        if self.divisor[0] + self.divisor[1] * t > 0.0 && t.is_finite() { t } else { f64::INFINITY }
    }

    /// Goes to the first texel of the next block; false where that is off the map.
    fn leave(&mut self, level: u32) -> bool {
        self.index = self.next(level) - i64::from(self.heading < 0);
        (0..self.count).contains(&self.index)
    }

    /// The index at `t`, inside of the block and not behind where it was.
    fn follow(&mut self, t: f64, level: u32) {
        let first = (self.index >> level) << level;
        let last = (first + (1 << level) - 1).min(self.count - 1);
        let now = (self.at(t).floor() as i64).clamp(first, last);
        self.index = if self.heading > 0 { now.max(self.index) } else { now.min(self.index) };
    }
}
