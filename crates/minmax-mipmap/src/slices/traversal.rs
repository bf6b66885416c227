//! A view ray along a row (Yusov 2012, Algorithm 2): lit and dark runs are stepped over, a node at a time.
//!
//! ```text
//! until the end of the ray:
//!     the node at the current column:  lit or dark all along  → next node, a level up if that begins one
//!                                      neither                → a level down
//!     a column:                        the lit part of its two cells, by the crossing with their depths
//! ```
//!
//! A view ray's depth (in a perspective map one over it) is linear along the row, and f64 keeps it monotone: what is computed
//! at a column's end lies between what is computed at the ends of every node above it. So a node that is lit or dark all along
//! is that for every cell under it, to the bit, and runs do not depend on the tree.
//!
//! Departure from Algorithm 2: a cell's crossing with the ray is solved, where the paper takes a whole step for lit or dark.

use epipolar::driver::SliceView;
use epipolar::rows::{DepthAlong, MapLine};

use super::slice_row::{BLOCK_LEVEL, RowLine, SliceRow};
use super::tree_kind::TreeKind;

/// Where rays begin: blocks of 64 columns.
const START_LEVEL: u32 = BLOCK_LEVEL + 2;

/// Smallest sine of the angle between a view ray and the light: rays nearer to the epipole are taken there, as
/// [`epipolar::geometry::STEEPEST`] has it.
const LEAST_SINE: f64 = 1.0 / epipolar::geometry::STEEPEST;

/// A view ray of a slice, in the slice's plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceRay {
    /// Sine and cosine of its angle β to the light.
    pub sine: f64,
    /// As above.
    pub cosine: f64,
    /// Its place among the slice's columns, counted from the light: it is lit by a light ray that more columns than this see.
    pub rank: f64,
    /// Where it ends \[world units\]; may be ∞.
    pub end: f64,
}

impl SliceRay {
    /// The ray of a slice's image point: `column` counts pixel columns, c is the middle of column c.
    #[inline(always)]
    pub fn new(slice: &SliceView<'_>, column: f64, end: f64) -> Self {
        let ray = slice.plane.view_ray(column);
        let shrink = 1.0 / (ray.x * ray.x + ray.y * ray.y).sqrt();
        let [first, last] = slice.order.columns.map(f64::from);
        let rank = if slice.order.ascending { column - first } else { last - 1.0 - column };
        Self { sine: (ray.x * shrink).max(LEAST_SINE), cosine: ray.y * shrink, rank, end }
    }
}

/// What rays looked at.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Looks {
    /// Nodes that were compared.
    pub nodes: u64,
    /// Texel columns whose cells were.
    pub columns: u64,
}

impl SliceRow {
    /// Calls `each(a, b)` for the lit runs of a view ray of the slice that was laid, in order: distances from the eye with
    /// 0 ≤ a < b ≤ the ray's end. O(runs · log columns), without a tree O(columns).
    ///
    /// One ray at a time has nothing for wide registers: it is compiled once, not for each instruction set.
    pub fn lit_runs(
        &mut self,
        slice: &SliceView<'_>,
        kind: TreeKind,
        ray: &SliceRay,
        looks: &mut Looks,
        mut each: impl FnMut(f64, f64),
    ) {
        let lamp = slice.light.lamp_distance();
        // Before the first map, between two of them and behind the last nothing is shadowed.
        let mut runs = Runs { lit: true, from: 0.0, each: &mut each };
        for index in 0..self.lines.len() {
            let row = self.lines[index];
            let Some(on_line) = RayOnLine::new(&row.line, lamp, ray) else { break };
            match kind {
                TreeKind::Yusov => self.walk::<{ YUSOV }>(slice, &row, &on_line, looks, &mut runs),
                TreeKind::Chen if ray.sine > LEAST_SINE => {
                    self.walk::<{ CHEN }>(slice, &row, &on_line, looks, &mut runs);
                }
                // At the epipole itself a ray has no place among the columns: Chen et al. march around it, too.
                TreeKind::Chen | TreeKind::None => {
                    self.walk::<{ NO_TREE }>(slice, &row, &on_line, looks, &mut runs)
                }
            }
            if on_line.ends {
                break;
            }
            runs.change(true, on_line.distance(f64::from(row.line.length)));
        }
        runs.change(false, ray.end);
    }

    #[inline]
    fn walk<const KIND: u8>(
        &mut self,
        slice: &SliceView<'_>,
        row: &RowLine,
        ray: &RayOnLine,
        looks: &mut Looks,
        runs: &mut Runs<impl FnMut(f64, f64)>,
    ) {
        let to_t = -f64::from(row.before) - f64::from(row.line.consumed);
        let border = |column: u32| (f64::from(column) + to_t).max(0.0).min(ray.t_end);
        let query = (ray.rank + 1.0) as f32;
        let mut column = row.before;
        let end = row.before + row.line.columns;
        let mut level = if KIND == NO_TREE { 0 } else { START_LEVEL.min(row.top) };
        let (mut t, mut value) = (0.0, ray.value(0.0));
        while column < end {
            if (KIND == NO_TREE || level < BLOCK_LEVEL) && !self.is_read(row, column) {
                self.read(slice, row, column);
            }
            let next = ((column >> level) + 1) << level;
            let next_t = border(next);
            let next_value = ray.value(next_t);
            let (mut lit, mut dark) = (false, false);
            if KIND != NO_TREE {
                looks.nodes += 1;
                let [nearest, farthest] = self.node(row, level, column >> level);
                if KIND == YUSOV {
                    lit = value.max(next_value) <= f64::from(nearest);
                    dark = value.min(next_value) > f64::from(farthest);
                } else {
                    lit = query <= nearest;
                    dark = query > farthest;
                }
            }
            if lit || dark {
                runs.change_at(lit, ray, t);
            } else if level > 0 {
                // A block that has just been read may be narrower than its tiles.
                if level == BLOCK_LEVEL && !self.is_read(row, column) {
                    self.read(slice, row, column);
                } else {
                    level -= 1;
                }
                continue;
            } else {
                looks.columns += 1;
                let cells = self.cells(row, column);
                let middle = f64::from(cells.border).max(t).min(next_t);
                let middle_value = ray.value(middle);
                runs.cell(ray, cells.keys[0], [t, middle], [value, middle_value]);
                if middle < next_t {
                    runs.cell(ray, cells.keys[1], [middle, next_t], [middle_value, next_value]);
                }
            }
            if next_t >= ray.t_end {
                break;
            }
            (column, t, value) = (next, next_t, next_value);
            if KIND != NO_TREE && level < row.top && column & ((2 << level) - 1) == 0 {
                level += 1;
            }
        }
    }

    /// Whether the surface in which a ray ends is lit as the row has it: shadows' edges on what the camera sees. Surfaces that are
    /// in the map themselves count as lit, by the farthest of three columns and two texels' width.
    #[inline(always)]
    pub fn end_is_lit(&mut self, slice: &SliceView<'_>, ray: &SliceRay) -> bool {
        let lamp = slice.light.lamp_distance();
        for index in 0..self.lines.len() {
            let row = &self.lines[index];
            match end_on_line(&row.line, lamp, ray) {
                None => return true,
                Some(RayEnd { t, .. }) if t == f64::INFINITY => continue,
                Some(end) => return self.end_is_lit_on(slice, index, &end),
            }
        }
        true
    }

    #[inline(always)]
    fn end_is_lit_on(&mut self, slice: &SliceView<'_>, index: usize, end: &RayEnd) -> bool {
        let RayEnd { t, value, least } = *end;
        let row = &self.lines[index];
        let (first, last) = (row.before, row.before + row.line.columns - 1);
        let own = ((t + f64::from(row.line.consumed)) as i32 as u32 + first).min(last);
        // Depths within two texels' width of the surface are the surface.
        let is_before = |farthest: f32| least <= f64::from(farthest);
        if self.kind == TreeKind::Yusov && own > first && own < last {
            // Most surfaces are under a roof, or nothing is above them: tiles know that.
            let blocks = [own - 1, own + 1].map(|column| self.node(row, BLOCK_LEVEL, column >> BLOCK_LEVEL));
            if blocks.iter().any(|[nearest, _]| value <= f64::from(*nearest)) {
                return true;
            }
            if !blocks.iter().any(|[_, farthest]| is_before(*farthest)) {
                return false;
            }
        }
        let row = *row;
        let mut farthest = f32::NEG_INFINITY;
        for column in own.saturating_sub(1).max(first)..=(own + 1).min(last) {
            if !self.is_read(&row, column) {
                self.read(slice, &row, column);
            }
            let [one, other] = self.cells(&row, column).keys;
            farthest = farthest.max(one).max(other);
        }
        is_before(farthest)
    }

    /// Texel columns that were read from the map since the slice was laid.
    pub fn columns_read(&self) -> u64 {
        self.columns_read
    }
}

/// Where a ray ends on a line.
#[derive(Clone, Copy)]
struct RayEnd {
    /// Its place \[texels\]; ∞ beyond the line.
    t: f64,
    /// What is compared with keys there, and the least of it that counts as the surface.
    value: f64,
    least: f64,
}

/// Where a ray ends on a line: [`RayOnLine`], of which no more than that is asked. `None` where it ends before the line begins.
#[inline(always)]
fn end_on_line(line: &MapLine, lamp: Option<f64>, ray: &SliceRay) -> Option<RayEnd> {
    match line.depth_along {
        DepthAlong::Parallel { start, across, to_light, light_ray: [from, per_texel] } => {
            let gamma = ray.end * ray.sine;
            let t = (gamma - from) / per_texel;
            let value = start + across * gamma + to_light * (ray.end * ray.cosine);
            let t = if t <= f64::from(line.length) { t } else { f64::INFINITY };
            (t > 0.0).then_some(RayEnd { t, value, least: value - 2.0 * per_texel })
        }
        DepthAlong::Perspective { towards, across, .. } => {
            let on_line = RayOnLine::new(line, lamp, ray)?;
            let per_texel = (towards[1] * towards[1] + across[1] * across[1]).sqrt();
            let value = on_line.value(on_line.t_end);
            let t = if on_line.ends { on_line.t_end } else { f64::INFINITY };
            // Both are −1/depth.
            Some(RayEnd { t, value, least: value * (1.0 + 2.0 * per_texel) })
        }
    }
}

const YUSOV: u8 = 0;
const CHEN: u8 = 1;
const NO_TREE: u8 = 2;

/// A view ray on one line: its value there, compared with keys, is `start + per_texel·t`.
struct RayOnLine {
    start: f64,
    per_texel: f64,
    /// Where it ends on the line.
    t_end: f64,
    /// Whether it ends within the line.
    ends: bool,
    rank: f64,
    end: f64,
    light_rays: LightRays,
    sine: f64,
    cosine: f64,
}

/// The light ray at t.
enum LightRays {
    /// γ at t = 0, and its change a texel.
    Sun([f64; 2]),
    /// Towards the eye and across, each at t = 0 and its change a texel; distance of the lamp.
    Lamp { towards: [f64; 2], across: [f64; 2], distance: f64 },
}

impl RayOnLine {
    /// `None` where the ray ends before the line begins.
    #[inline(always)]
    fn new(line: &MapLine, lamp: Option<f64>, ray: &SliceRay) -> Option<Self> {
        let SliceRay { sine, cosine, rank, end } = *ray;
        let length = f64::from(line.length);
        match line.depth_along {
            DepthAlong::Parallel { start, across, to_light, light_ray: [from, per_texel] } => {
                let per_gamma = across + to_light * (cosine / sine);
                let t = (end * sine - from) / per_texel;
                (t > 0.0).then(|| Self {
                    start: start + per_gamma * from,
                    per_texel: per_gamma * per_texel,
                    t_end: t.min(length),
                    ends: t <= length,
                    rank,
                    end,
                    light_rays: LightRays::Sun([from, per_texel]),
                    sine,
                    cosine,
                })
            }
            DepthAlong::Perspective { distance, towards, across } => {
                let distance = lamp.unwrap_or(distance);
                // The light ray in which the ray ends.
                let (q, p) =
                    if end < f64::INFINITY { (end * sine, distance - end * cosine) } else { (sine, -cosine) };
                // Whether its angle is larger than that of the light ray at t: both lie in the half-plane across ≥ 0.
                let beyond = |t: f64| {
                    let (own_p, own_q) = (towards[0] + towards[1] * t, across[0] + across[1] * t);
                    q * own_p - p * own_q
                };
                if !(beyond(0.0) > 0.0) {
                    return None;
                }
                let ends = !(beyond(length) > 0.0);
                let t = (q * towards[0] - p * across[0]) / (p * across[1] - q * towards[1]);
                let inverse = |n: usize| (across[n] * cosine + towards[n] * sine) / (distance * sine);
                Some(Self {
                    start: -inverse(0),
                    per_texel: -inverse(1),
                    t_end: if ends { t.max(0.0).min(length) } else { length },
                    ends,
                    rank,
                    end,
                    light_rays: LightRays::Lamp { towards, across, distance },
                    sine,
                    cosine,
                })
            }
        }
    }

    #[inline(always)]
    fn value(&self, t: f64) -> f64 {
        self.start + self.per_texel * t
    }

    /// How far from the eye the ray meets the light ray at t, at most its end.
    #[inline(always)]
    fn distance(&self, t: f64) -> f64 {
        let distance = match &self.light_rays {
            LightRays::Sun([from, per_texel]) => (from + per_texel * t) / self.sine,
            LightRays::Lamp { towards, across, distance } => {
                let (p, q) = (towards[0] + towards[1] * t, across[0] + across[1] * t);
                let divergence = q * self.cosine + p * self.sine;
                if divergence > 0.0 { (distance * q / divergence).max(0.0) } else { f64::INFINITY }
            }
        };
        distance.min(self.end)
    }
}

/// Lit runs as they are found.
struct Runs<'a, F> {
    lit: bool,
    /// Where the last change was.
    from: f64,
    each: &'a mut F,
}

impl<F: FnMut(f64, f64)> Runs<'_, F> {
    #[inline(always)]
    fn change_at(&mut self, lit: bool, ray: &RayOnLine, t: f64) {
        if lit != self.lit {
            self.change(lit, ray.distance(t));
        }
    }

    #[inline(always)]
    fn change(&mut self, lit: bool, at: f64) {
        if lit == self.lit {
            return;
        }
        if self.lit && at > self.from {
            (self.each)(self.from, at);
        }
        self.lit = lit;
        self.from = at.max(self.from);
    }

    /// One cell between two places, with the ray's values there.
    #[inline(always)]
    fn cell(&mut self, ray: &RayOnLine, key: f32, [from, to]: [f64; 2], values: [f64; 2]) {
        let key = f64::from(key);
        let [first, last] = values.map(|value| value <= key);
        self.change_at(first, ray, from);
        if first != last {
            let crossing = ((key - ray.start) / ray.per_texel).max(from).min(to);
            self.change_at(last, ray, crossing);
        }
    }
}
