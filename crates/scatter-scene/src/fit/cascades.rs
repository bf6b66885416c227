//! Where a sun's cascades look: stretches of the view, the nearest first, each in a rectangle as tight as it can be.
//!
//! The view is split by distance with the practical scheme (Zhang et al. 2006, *Parallel-Split Shadow Maps for Large-Scale
//! Virtual Environments*, section 4), and each map is fitted to its part of it (Dimitrov 2007, *Cascaded Shadow Maps*). What
//! differs is what air needs and surfaces do not:
//!
//! - A part holds whole stretches of the view rays up to their surfaces, cut to the scene, not corners of the frustum: air is
//!   lit along the whole ray, and what lies beside the scene is shadowed by nothing.
//! - The first cascade that contains a point decides, whatever its distance, since texel coordinates are constant along a
//!   light ray. So a cascade is fitted to what the ones before it leave over.
//! - The maps' axes are those, of a few, with the smallest texels along the rays; a frustum seen askew fills half of an
//!   upright rectangle at the most.

use glam::DVec3;
use rayon::prelude::*;
use scatter_core::{MAX_CASCADES, MapProjection, ModelError};

use super::light_rectangle::{FlatRay, Rectangle};
use super::sun_space::{SunSpace, View, across};
use crate::caster::SceneCaster;

/// Weight of the logarithmic split against the uniform one (Zhang et al. 2006 use 0.5). Near light rays are crossed by more
/// view rays than far ones. Smaller: they get too few texels; larger: the far ones do. The crate's README has
/// what was measured.
const LOGARITHMIC_SHARE: f64 = 0.65;
/// Where the logarithmic split begins, as a share of the range: air has no near plane. Smaller: the first cascade is spent
/// on a few pixels' beginnings; larger: the split becomes uniform.
const NEAREST_SPLIT: f64 = 0.01;
/// Orientations of the maps that are tried over a right angle, the first along the view. More of them turn the maps more
/// often while the camera moves, and gain little.
const ORIENTATIONS: u32 = 8;
/// Rays along a side of the image by which an orientation is chosen.
const SAMPLED_SIDE: u32 = 48;

/// `count` maps of `size`² texels of a sun that shines along `direction`, the nearest stretch of the view first. Together
/// they contain every point that the camera sees inside of the scene's rectangle. Time: one pass over the pixels a cascade,
/// O(count) rectangles each, and over the triangles an orientation.
pub fn fit_cascades(
    caster: &SceneCaster,
    view: &View<'_>,
    direction: DVec3,
    size: u32,
    count: u32,
) -> Result<Vec<MapProjection>, ModelError> {
    let count = (count as usize).clamp(1, MAX_CASCADES);
    // Beyond the far side of the scene's sphere a ray leaves no more of the scene behind it.
    let (centre, radius) = caster.sphere();
    let farthest = view.camera.eye().distance(centre) + radius;
    let tried: Vec<(f64, SunSpace)> = (0..ORIENTATIONS)
        .into_par_iter()
        .map(|index| {
            let angle = f64::from(index) / f64::from(ORIENTATIONS) * std::f64::consts::FRAC_PI_2;
            let space =
                SunSpace::new(caster, direction, turned(along_view(view, direction), direction, angle));
            (texel_area(&space, view, farthest, count), space)
        })
        .collect();
    let best = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let space = best.map_or_else(|| SunSpace::new(caster, direction, across(direction)), |(_, space)| space);
    let splits = Splits::of(
        space.fold(view, Range::NONE, |range, _, stretch| range.with(stretch), Range::joined),
        farthest,
    );
    let mut rectangles = Vec::with_capacity(count);
    for index in 0..count {
        let end = splits.end(index, count);
        let rectangle = space.fold(
            view,
            Rectangle::EMPTY,
            |seen, ray, stretch| left_over(seen, &rectangles, ray, stretch, end),
            Rectangle::joined,
        );
        rectangles.push(filled(rectangle, &rectangles));
    }
    rectangles.into_iter().map(|rectangle| space.projection(rectangle, size)).collect()
}

/// The view's direction as the sun sees it, or any other where it looks along the light.
fn along_view(view: &View<'_>, direction: DVec3) -> DVec3 {
    /// Sine of the angle from which on the direction is taken for one: below it rounding and the smallest motion of the
    /// camera would turn the maps.
    const SMALLEST_SINE: f64 = 1e-3;
    let forward = view.camera.forward();
    let flat = forward - direction * forward.dot(direction);
    if flat.length() > SMALLEST_SINE { flat.normalize() } else { across(direction) }
}

fn turned(up: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = angle.sin_cos();
    (up * cos + axis.cross(up) * sin).normalize()
}

/// Distances along the rays between which they cross the scene.
#[derive(Clone, Copy)]
struct Range {
    first: f64,
    last: f64,
}

impl Range {
    const NONE: Self = Self { first: f64::INFINITY, last: 0.0 };

    fn with(self, [from, to]: [f64; 2]) -> Self {
        self.joined(Self { first: from, last: to })
    }

    fn joined(self, other: Self) -> Self {
        Self { first: self.first.min(other.first), last: self.last.max(other.last) }
    }
}

/// How the range is split: `first + s·(last − first)` and `near·(last/near)^s`, mixed.
struct Splits {
    first: f64,
    near: f64,
    last: f64,
}

impl Splits {
    fn of(range: Range, farthest: f64) -> Self {
        let last = range.last.min(farthest);
        let first = range.first.min(last);
        Self { first, near: first.max(NEAREST_SPLIT * last), last }
    }

    /// Where the stretch of a cascade ends; the last one's does not.
    fn end(&self, index: usize, count: usize) -> f64 {
        if index + 1 >= count {
            return f64::INFINITY;
        }
        let share = (index + 1) as f64 / count as f64;
        let uniform = self.first + share * (self.last - self.first);
        let logarithmic = if self.near > 0.0 { self.near * (self.last / self.near).powf(share) } else { 0.0 };
        LOGARITHMIC_SHARE * logarithmic + (1.0 - LOGARITHMIC_SHARE) * uniform
    }
}

/// `seen` with the part of a ray's stretch up to `end` that lies in none of the cascades so far.
fn left_over(
    seen: Rectangle,
    cascades: &[Rectangle],
    ray: &FlatRay,
    [from, to]: [f64; 2],
    end: f64,
) -> Rectangle {
    let to = to.min(end);
    if !(from <= to) {
        return seen;
    }
    let mut pieces = Pieces::of([from, to]);
    for cascade in cascades {
        pieces.take(cascade, ray);
    }
    pieces.iter().fold(seen, |seen, [from, to]| seen.with(ray.at(from)).with(ray.at(to)))
}

/// A cascade that nothing is left for looks where the one before it does: it decides about nothing, and takes nothing
/// from those behind it.
fn filled(rectangle: Rectangle, before: &[Rectangle]) -> Rectangle {
    match before.last() {
        Some(&last) if rectangle.is_empty() => last,
        _ => rectangle,
    }
}

/// The mean square of a texel's sides, in units of their number, along the rays that are sampled: how far an edge of a
/// shadow is displaced along a ray grows with the texel that it falls on.
fn texel_area(space: &SunSpace, view: &View<'_>, farthest: f64, count: usize) -> f64 {
    let [width, height] = view.camera.size();
    let stride = (width.max(height) / SAMPLED_SIDE).max(1);
    let middle = |side: u32| (stride.min(side) / 2..side).step_by(stride as usize);
    let rays: Vec<(FlatRay, [f64; 2])> = middle(height)
        .flat_map(|y| middle(width).map(move |x| (x, y)))
        .filter_map(|(x, y)| space.stretch(view, x, y))
        .collect();
    let splits =
        Splits::of(rays.iter().fold(Range::NONE, |range, (_, stretch)| range.with(*stretch)), farthest);
    let mut rectangles: Vec<Rectangle> = Vec::with_capacity(count);
    for index in 0..count {
        let end = splits.end(index, count);
        let rectangle = rays
            .iter()
            .fold(Rectangle::EMPTY, |seen, (ray, stretch)| left_over(seen, &rectangles, ray, *stretch, end));
        rectangles.push(filled(rectangle, &rectangles));
    }
    let mut sum = 0.0;
    for (ray, [from, to]) in &rays {
        let mut pieces = Pieces::of([*from, to.min(farthest).max(*from)]);
        for rectangle in &rectangles {
            sum += pieces.take(rectangle, ray) * (rectangle.high - rectangle.low).length_squared();
        }
    }
    sum
}

/// Stretches of a ray, in order. Every rectangle that is taken away cuts at most one in two.
struct Pieces {
    pieces: [[f64; 2]; MAX_CASCADES + 1],
    count: usize,
}

impl Pieces {
    fn of(stretch: [f64; 2]) -> Self {
        Self { pieces: [stretch; MAX_CASCADES + 1], count: 1 }
    }

    fn iter(&self) -> impl Iterator<Item = [f64; 2]> {
        self.pieces[..self.count].iter().copied()
    }

    /// Takes away what lies in a rectangle; returns its length.
    fn take(&mut self, rectangle: &Rectangle, ray: &FlatRay) -> f64 {
        let (mut left, mut count, mut taken) = ([[0.0; 2]; MAX_CASCADES + 1], 0, 0.0);
        let mut keep = |piece: [f64; 2]| {
            if let Some(free) = left.get_mut(count) {
                *free = piece;
                count += 1;
            }
        };
        for [from, to] in self.iter() {
            match rectangle.clip(ray, [from, to]) {
                None => keep([from, to]),
                Some([enter, leave]) => {
                    taken += leave - enter;
                    if enter > from {
                        keep([from, enter]);
                    }
                    if leave < to {
                        keep([leave, to]);
                    }
                }
            }
        }
        (self.pieces, self.count) = (left, count);
        taken
    }
}
