//! The texels of a raster map that the rasteriser's grid leaves in doubt: those that rays must decide.
//!
//! A rasteriser snaps vertices to a grid (1/256 texel, mostly), and computes their places in f32 before that. So the
//! triangle that it draws is the true one with each corner moved by at most [`Screen::reach`] along both axes. Two things
//! follow, and nothing else can go wrong:
//!
//! - *coverage* can differ only where a texel's centre lies within the reach of a projected edge (silhouettes, but also
//!   cracks along T-joints and slivers that vanish);
//! - *depth* elsewhere is the triangle's own at a place within the reach, so it is off by at most the depth's slope
//!   times the reach: more than [`TOLERANCE`] only on surfaces seen nearly edge on;
//! - *a cut-out's texel* can be another one only next to the borders of its mask (`mask_doubt.rs`).
//!
//! All kinds of texels are found in f64 from the triangles themselves, and only where the triangle is not hidden by
//! what was drawn. They are few: a texel that an edge runs through is in doubt with a chance of about 1 %.

use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;

use super::mask_doubt::MaskOnScreen;
use crate::caster::{Cards, SceneCaster};

/// A pass's projection in f64, with what the device's arithmetic may do to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Screen {
    /// Rows of `(x, y, v, w)` over world points relative to `reference`: `(x, y)/w` are texels, and `v/w`, affine on the
    /// screen, is smaller the nearer a surface is.
    pub rows: [DVec4; 4],
    /// The point of reference, world space.
    pub reference: DVec3,
    /// `[width, height]` in texels.
    pub size: [u32; 2],
    /// How `v/w` becomes a depth of the map.
    pub depth: ScreenDepth,
    /// Extent of the scene's depth, > 0, in units of the map's depth.
    pub range: f64,
    /// How far f32 arithmetic moves a vertex \[texels\].
    pub rounding: f64,
}

/// What `v/w` of a [`Screen`] is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScreenDepth {
    /// The depth itself.
    Itself,
    /// `−1/depth`.
    MinusReciprocal,
}

/// Share of the depth range by which the grid may move a depth before a ray decides. Smaller: more rays on surfaces seen
/// edge on; above 1e-4 those differ from ray casts by what counts as a difference.
const TOLERANCE: f64 = 2e-5;
/// Share of the depth range by which a triangle may lie behind what was drawn and still count as seen. The depth of an
/// edge is taken next to the texel, not at its centre: on a surface that is not steep that is less than
/// [`TOLERANCE`]. Smaller: nothing is gained. Larger: rays for hidden edges.
const HIDDEN: f64 = 1e-3;
/// Thickness on the screen, in reaches, below which all of a triangle is in doubt, whatever was drawn. The corners of
/// such a sliver change its area by a part of itself, and the plane that the device computes from that, in f32, may lead
/// to a depth that is nowhere on it. Smaller: such depths stay. Larger: more rays.
const SLIVER: f64 = 8.0;
/// Smallest w of a clipped triangle, as a share of the range: what is nearer to a lamp than that covers all it sees.
const SMALLEST_W: f64 = 1e-9;
/// Triangles of one task: long enough to be worth it, short enough to share.
const TASK: usize = 1 << 13;

/// What was drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Occluders<'a> {
    /// World space.
    pub positions: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    /// Those that are cut out.
    pub cards: &'a Cards,
}

impl<'a> Occluders<'a> {
    /// All of a caster's.
    pub fn of(caster: &'a SceneCaster) -> Self {
        let (positions, triangles) = caster.welded();
        Self { positions, triangles, cards: caster.cards() }
    }
}

/// Texels in doubt of a drawn map, ascending, each once: indices into `[row][column]`. `step` is the device's grid
/// \[texels\], `texels` the depths as drawn.
pub(super) fn texels_in_doubt(
    screen: &Screen,
    step: f64,
    occluders: &Occluders<'_>,
    texels: &[f32],
) -> Vec<u32> {
    let Occluders { positions, triangles, cards } = *occluders;
    let corners: Vec<DVec4> = positions.par_iter().map(|p| screen.corner(*p)).collect();
    let walk = Walk { screen, reach: screen.reach(step), texels };
    let mut found: Vec<u32> = triangles
        .par_chunks(TASK)
        .enumerate()
        .flat_map_iter(|(task, triangles)| {
            let mut found = Vec::new();
            for (number, triangle) in ((task * TASK) as u32..).zip(triangles) {
                let corners = triangle.map(|index| corners[index as usize]);
                let card = cards
                    .get(number)
                    .map(|card| MaskOnScreen::new(cards.mask(card), card.texels, corners, screen.size));
                walk.triangle(corners, card.as_ref(), &mut found);
            }
            found
        })
        .collect();
    found.par_sort_unstable();
    found.dedup();
    found
}

impl Screen {
    /// How far a corner may be from where it belongs, along each axis \[texels\]: half a step of the grid, to whose
    /// nearest point it is moved, and the rounding before that.
    fn reach(&self, step: f64) -> f64 {
        0.5 * step + self.rounding
    }

    fn corner(&self, p: DVec3) -> DVec4 {
        let p = (p - self.reference).extend(1.0);
        DVec4::from_array(self.rows.map(|row| row.dot(p)))
    }

    /// The depth of a `v/w`; that of a surface behind everything is ∞.
    fn depth_of(&self, v: f64) -> f64 {
        match self.depth {
            ScreenDepth::Itself => v,
            ScreenDepth::MinusReciprocal if v < 0.0 => -1.0 / v,
            ScreenDepth::MinusReciprocal => f64::INFINITY,
        }
    }

    /// How much a depth changes with `v/w`.
    fn depth_per_v(&self, v: f64) -> f64 {
        match self.depth {
            ScreenDepth::Itself => 1.0,
            ScreenDepth::MinusReciprocal => self.depth_of(v).powi(2),
        }
    }
}

/// The search over one map.
struct Walk<'a> {
    screen: &'a Screen,
    reach: f64,
    texels: &'a [f32],
}

impl Walk<'_> {
    /// `card` is for a cut-out; `Some(None)` for one that is seen edge on.
    fn triangle(&self, corners: [DVec4; 3], card: Option<&Option<MaskOnScreen<'_>>>, found: &mut Vec<u32>) {
        let smallest = match self.screen.depth {
            ScreenDepth::Itself => f64::MIN_POSITIVE,
            ScreenDepth::MinusReciprocal => SMALLEST_W * self.screen.range,
        };
        let mut polygon = [DVec3::ZERO; 4];
        let count = project(corners, smallest, &mut polygon);
        let polygon = &polygon[..count];
        let low = polygon.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = polygon.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let [width, height] = self.screen.size;
        // Most triangles of a dense mesh lie between the centres.
        let (Some(_), Some(rows)) = (self.centres(low.x, high.x, width), self.centres(low.y, high.y, height))
        else {
            return;
        };
        let normal = polygon.get(..3).map_or(DVec3::ZERO, |p| (p[1] - p[0]).cross(p[2] - p[0]));
        // Twice the area over a side that is long, if not the longest, is about the thickness.
        if normal.z.abs() < SLIVER * self.reach * (high - low).truncate().max_element() {
            self.inside(polygon, DVec2::NAN, [f64::NEG_INFINITY, high.z], rows, found);
            return;
        }
        // How v/w changes a texel to the right and a texel down.
        let slope = -normal.truncate() / normal.z;
        // The farthest corner has the steepest depth.
        if self.is_steep(slope, high.z) {
            self.inside(polygon, slope, [low.z, high.z], rows, found);
        }
        for (index, &a) in polygon.iter().enumerate() {
            self.edge(a, polygon[(index + 1) % count], found);
        }
        if let Some(card) = card {
            self.borders(polygon, slope, [low.z, high.z], rows, card.as_ref(), found);
        }
    }

    /// Whether the reach moves a surface's depth by more than the tolerance where `v/w` is `v`.
    fn is_steep(&self, slope: DVec2, v: f64) -> bool {
        let moved = (slope.x.abs() + slope.y.abs()) * self.reach * self.screen.depth_per_v(v);
        // A sliver has no slope, NaN.
        !(moved <= TOLERANCE * self.screen.range)
    }

    /// First and last index of the centres in `[low, high]` grown by the reach.
    #[inline]
    fn centres(&self, low: f64, high: f64, count: u32) -> Option<[u32; 2]> {
        let first = (low - self.reach - 0.5).ceil().max(0.0);
        let last = (high + self.reach - 0.5).floor().min(f64::from(count) - 1.0);
        (first <= last).then_some([first as u32, last as u32])
    }

    /// Whether what was drawn at a texel does not hide `v`.
    #[inline]
    fn is_seen(&self, column: u32, row: u32, v: f64) -> bool {
        let drawn = f64::from(self.texels[(row * self.screen.size[0] + column) as usize]);
        self.screen.depth_of(v) <= drawn + HIDDEN * self.screen.range
    }

    /// Takes the texel unless what was drawn there hides `v`.
    #[inline]
    fn take(&self, column: u32, row: u32, v: f64, found: &mut Vec<u32>) {
        if self.is_seen(column, row, v) {
            found.push(row * self.screen.size[0] + column);
        }
    }

    /// The texels whose centres lie within the reach of an edge.
    fn edge(&self, a: DVec3, b: DVec3, found: &mut Vec<u32>) {
        let [width, height] = self.screen.size;
        let step = b - a;
        // Along the longer axis one texel of the other axis at a time.
        let is_tall = step.y.abs() >= step.x.abs();
        let turn = |p: DVec3| if is_tall { DVec3::new(p.y, p.x, p.z) } else { p };
        let (a, step) = (turn(a), turn(step));
        let (along, across) = if is_tall { (height, width) } else { (width, height) };
        let Some([first, last]) = self.centres(a.x.min(a.x + step.x), a.x.max(a.x + step.x), along) else {
            return;
        };
        let per_length = if step.x != 0.0 { 1.0 / step.x } else { 0.0 };
        let reach = self.reach * (1.0 + (step.y * per_length).abs());
        for major in first..=last {
            let t = ((f64::from(major) + 0.5 - a.x) * per_length).clamp(0.0, 1.0);
            let place = a.y + t * step.y - 0.5;
            // A reach of half a texel or more would need all minors in it; devices have at least four bits.
            let minor = place.round();
            if (place - minor).abs() <= reach && minor >= 0.0 && minor < f64::from(across) {
                let (column, row) = if is_tall { (minor as u32, major) } else { (major, minor as u32) };
                self.take(column, row, a.z + t * step.z, found);
            }
        }
    }

    /// The steep texels inside of a polygon and within the reach of it.
    fn inside(
        &self,
        polygon: &[DVec3],
        slope: DVec2,
        [nearest, farthest]: [f64; 2],
        [first, last]: [u32; 2],
        found: &mut Vec<u32>,
    ) {
        let width = self.screen.size[0];
        for row in first..=last {
            let y = f64::from(row) + 0.5;
            let Some(span) = span(polygon, y - self.reach, y + self.reach) else { continue };
            let Some([first, last]) = self.centres(span[0], span[1], width) else { continue };
            for column in first..=last {
                let to = DVec2::new(f64::from(column) + 0.5, y) - polygon[0].truncate();
                let v = (polygon[0].z + slope.dot(to)).clamp(nearest, farthest);
                // A clamped NaN stays NaN, and is steep.
                if self.is_steep(slope, v) {
                    self.take(column, row, nearest, found);
                }
            }
        }
    }
}

impl Walk<'_> {
    /// The texels of a cut-out next to the borders of its mask.
    fn borders(
        &self,
        polygon: &[DVec3],
        slope: DVec2,
        [nearest, farthest]: [f64; 2],
        [first, last]: [u32; 2],
        card: Option<&MaskOnScreen<'_>>,
        found: &mut Vec<u32>,
    ) {
        let width = self.screen.size[0];
        let reach = (slope.x.abs() + slope.y.abs()) * self.reach;
        for row in first..=last {
            let y = f64::from(row) + 0.5;
            let Some(span) = span(polygon, y - self.reach, y + self.reach) else { continue };
            let Some([first, last]) = self.centres(span[0], span[1], width) else { continue };
            for column in first..=last {
                let place = DVec2::new(f64::from(column) + 0.5, y);
                let v = polygon[0].z + slope.dot(place - polygon[0].truncate()) - reach;
                let is_seen = self.is_seen(column, row, v.clamp(nearest, farthest));
                if is_seen && card.is_none_or(|card| card.is_in_doubt(place, self.reach)) {
                    found.push(row * width + column);
                }
            }
        }
    }
}

/// The triangle's part with w ≥ `smallest`, as `(x/w, y/w, v/w)`; returns the number of its corners, 0, 3 or 4.
#[inline]
fn project(corners: [DVec4; 3], smallest: f64, polygon: &mut [DVec3; 4]) -> usize {
    let divided = |p: DVec4| p.truncate() / p.w;
    if corners.iter().all(|p| p.w >= smallest) {
        for (out, p) in polygon.iter_mut().zip(corners) {
            *out = divided(p);
        }
        return 3;
    }
    let mut count = 0;
    for (index, a) in corners.iter().enumerate() {
        let b = corners[(index + 1) % 3];
        if a.w >= smallest {
            polygon[count] = divided(*a);
            count += 1;
        }
        if (a.w >= smallest) != (b.w >= smallest) {
            let t = (smallest - a.w) / (b.w - a.w);
            polygon[count] = divided(DVec4::new(0.0, 0.0, 0.0, smallest) + (*a + (b - *a) * t).with_w(0.0));
            count += 1;
        }
    }
    count
}

/// Smallest and largest x of a convex polygon between two heights.
fn span(polygon: &[DVec3], low: f64, high: f64) -> Option<[f64; 2]> {
    let mut span = [f64::INFINITY, f64::NEG_INFINITY];
    for (index, a) in polygon.iter().enumerate() {
        let b = polygon[(index + 1) % polygon.len()];
        let (a, b) = if a.y <= b.y { (*a, b) } else { (b, *a) };
        if b.y < low || a.y > high {
            continue;
        }
        let at = |y: f64| if b.y > a.y { a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)) } else { a.x };
        let ends = if b.y > a.y { [at(low.max(a.y)), at(high.min(b.y))] } else { [a.x, b.x] };
        span = [span[0].min(ends[0]).min(ends[1]), span[1].max(ends[0]).max(ends[1])];
    }
    (span[0] <= span[1]).then_some(span)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Odd, and wider than high.
    const SIZE: [u32; 2] = [45, 33];
    const STEP: f64 = 1.0 / 256.0;
    /// Depths of the scenes below are within 0 to this.
    const RANGE: f64 = 10.0;

    /// Texels are world units: x, y, and the depth z.
    fn parallel() -> Screen {
        let rows = [DVec4::X, DVec4::Y, DVec4::Z, DVec4::W];
        Screen {
            rows,
            reference: DVec3::ZERO,
            size: SIZE,
            depth: ScreenDepth::Itself,
            range: RANGE,
            rounding: 0.0,
        }
    }

    /// A lamp at the origin that looks along z, with a frustum of one unit at depth 1.
    fn perspective() -> Screen {
        let [width, height] = SIZE.map(|n| 0.5 * f64::from(n));
        let rows =
            [DVec4::new(width, 0.0, width, 0.0), DVec4::new(0.0, height, height, 0.0), -DVec4::W, DVec4::Z];
        Screen { rows, depth: ScreenDepth::MinusReciprocal, ..parallel() }
    }

    /// Of one opaque triangle.
    fn doubts_of(screen: &Screen, corners: &[DVec3; 3], texels: &[f32]) -> Vec<u32> {
        let occluders = Occluders { positions: corners, triangles: &[[0, 1, 2]], cards: &Cards::default() };
        texels_in_doubt(screen, STEP, &occluders, texels)
    }

    /// Numbers in [0, 1), the same every time.
    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut random = scatter_testing::Random(seed);
        move || random.range(0.0, 1.0)
    }

    /// Depth of a triangle's plane at a centre that it covers, by barycentric coordinates.
    fn covered(corners: [DVec3; 3], x: f64, y: f64) -> Option<f64> {
        let p = DVec2::new(x, y);
        let [a, b, c] = corners.map(|c| c.truncate());
        let area = (b - a).perp_dot(c - a);
        let weights = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)];
        let shares = weights.map(|w| w / area);
        shares.iter().all(|s| *s >= 0.0).then(|| (0..3).map(|k| shares[k] * corners[k].z).sum())
    }

    #[test]
    fn whatever_a_grid_can_change_is_in_doubt() {
        let empty = vec![f32::INFINITY; (SIZE[0] * SIZE[1]) as usize];
        let (mut changed, mut doubted) = (0, 0);
        for seed in 1..400 {
            let mut random = random(seed);
            // Small and large ones, slivers, flat and steep, partly outside.
            let size = 60.0 * random().powi(3);
            let middle = DVec3::new(45.0 * random(), 33.0 * random(), 0.0);
            let thin = if seed % 3 == 0 { 1e-3 } else { 1.0 };
            let mut corner = || {
                let (x, y) = (random() - 0.5, thin * (random() - 0.5));
                middle + DVec3::new(size * (x + 0.3 * y), size * (y - 0.3 * x), RANGE * random())
            };
            let corners = [corner(), corner(), corner()];
            let screen = parallel();
            let doubts = doubts_of(&screen, &corners, &empty);
            assert!(doubts.is_sorted() && doubts.iter().all(|&index| index < SIZE[0] * SIZE[1]));
            doubted += doubts.len();
            // Each corner on its own to any side, as far as the grid may move it.
            for _ in 0..8 {
                let mut move_it =
                    |p: DVec3| p + STEP * DVec3::new(random().round() - 0.5, random().round() - 0.5, 0.0);
                let moved = corners.map(&mut move_it);
                for index in (0..SIZE[0] * SIZE[1]).filter(|index| doubts.binary_search(index).is_err()) {
                    let (x, y) = (f64::from(index % SIZE[0]) + 0.5, f64::from(index / SIZE[0]) + 0.5);
                    let (a, b) = (covered(corners, x, y), covered(moved, x, y));
                    match (a, b) {
                        (None, None) => {}
                        (Some(a), Some(b)) => {
                            changed += 1;
                            assert!((a - b).abs() <= 1.001 * TOLERANCE * RANGE, "seed {seed}: {a} {b}");
                        }
                        _ => panic!("seed {seed}: texel {index} is covered by one of {corners:?} {moved:?}"),
                    }
                }
            }
        }
        assert!(changed > 5000 && doubted > 1000, "{changed} {doubted}");
    }

    #[test]
    fn a_flat_triangle_is_in_doubt_along_its_edges_only() {
        // Legs of 30 and 20 texels between the centres, 1/8 from them; the long edge meets a centre's surroundings now
        // and then.
        let at = |x: f64, y: f64| DVec3::new(x, y, 2.0);
        let corners = [at(5.125, 4.125), at(35.125, 4.125), at(5.125, 24.125)];
        let empty = vec![f32::INFINITY; (SIZE[0] * SIZE[1]) as usize];
        let doubts = doubts_of(&parallel(), &corners, &empty);
        // y = 24.125 − 2(x − 5.125)/3: at centres 3y + 2x is a whole and a half; on the edge it is 82.625.
        assert_eq!(doubts, Vec::<u32>::new());
        let through = corners.map(|p| p + DVec3::new(0.375, 0.0, 0.0));
        let doubts = doubts_of(&parallel(), &through, &empty);
        // The left leg runs through the centres of column 5, rows 4 to 23.
        assert_eq!(doubts, (4..24).map(|row| row * SIZE[0] + 5).collect::<Vec<_>>());
    }

    #[test]
    fn what_is_hidden_is_not_in_doubt() {
        let corners = [DVec3::new(5.5, 4.0, 6.0), DVec3::new(30.5, 4.0, 6.0), DVec3::new(5.5, 29.0, 6.0)];
        let doubts = |drawn: f32| {
            let texels = vec![drawn; (SIZE[0] * SIZE[1]) as usize];
            doubts_of(&parallel(), &corners, &texels).len()
        };
        assert_eq!(doubts(5.9), 0);
        assert!(doubts(6.0) > 20 && doubts(f32::INFINITY) == doubts(6.0));
    }

    #[test]
    fn a_floor_under_a_lamp_is_in_doubt_where_it_is_seen_edge_on() {
        // Through the lamp's own plane, far to all sides, half a unit off.
        let far = 1e3;
        let corners = [DVec3::new(-far, 0.5, -far), DVec3::new(far, 0.5, -far), DVec3::new(0.0, 0.5, RANGE)];
        let empty = vec![f32::INFINITY; (SIZE[0] * SIZE[1]) as usize];
        let doubts = doubts_of(&perspective(), &corners, &empty);
        // Depth at a row's centre y is ½·16.5/(y − 16.5), so half a step of the grid, 1/512 texel, moves it by
        // 8.25/512/(y − 16.5)²: by more than 2e-5·10 where y − 16.5 < 8.98, up to row 24. Row 17 sees its tip.
        let rows: Vec<u32> = doubts.iter().map(|index| index / SIZE[0]).collect();
        assert!(rows.iter().all(|row| (17..=24).contains(row)), "{rows:?}");
        for row in 18..=24 {
            // Its sides are hundreds of units away at depth 1.
            let count = rows.iter().filter(|&&r| r == row).count();
            assert!(count > 35, "row {row}: {count}");
        }
    }

    #[test]
    fn a_clipped_triangle_keeps_its_plane() {
        let corners = [
            DVec4::new(1.0, 2.0, -1.0, 3.0),
            DVec4::new(4.0, -1.0, -1.0, -2.0),
            DVec4::new(0.0, 5.0, -1.0, 1.0),
        ];
        let mut whole = [DVec3::ZERO; 4];
        assert_eq!(project(corners, 0.5, &mut whole), 4);
        let normal = (whole[1] - whole[0]).cross(whole[2] - whole[0]).normalize();
        assert!(normal.dot(whole[3] - whole[0]).abs() < 1e-12);
        assert!(whole.iter().all(|p| p.z >= -2.0 - 1e-12), "w ≥ ½: {whole:?}");
        let behind = corners.map(|p| p.with_w(-1.0));
        assert_eq!(project(behind, 0.5, &mut whole), 0);
    }
}
