//! Segments of a map's light rays, texel by texel: chords of spheres, and passes of strands.
//!
//! Each occluder of a tile, in order of submission, is put on the texels that its bounds cover, and what it does to the ray
//! through a texel's centre is computed in f64. The neighbouring texels of a map are found by the bounds alone, so a tile
//! takes time in proportion to what lies in it.

use std::cell::RefCell;

use glam::DVec3;
use scatter_core::{MapError, MapProjection, TranslucentSegment, TranslucentSource};

use super::closest::closest_on_segment;
use super::map_bounds::{Rectangle, ball_on_map, leaves_in_tile, texels_between};
use super::map_rays::{LightRay, MapRays};
use super::occluders::{Occluder, Occluders};
use super::particle::Particle;
use super::passes::{NearSegment, each_pass};

/// Buffers of a thread, so that a second capture allocates nothing.
#[derive(Default)]
struct Buffers {
    /// Occluders of the tile.
    numbers: Vec<u32>,
    /// Of one strand: segments with the texels that they are near.
    near: Vec<(u32, NearSegment)>,
    one_texel: Vec<NearSegment>,
    runs: Vec<NearSegment>,
}

thread_local! {
    static BUFFERS: RefCell<Buffers> = RefCell::default();
}

/// What a sink gets.
type Sink<'a> = &'a mut dyn FnMut(u32, TranslucentSegment);

impl TranslucentSource for Occluders {
    fn capture(&self, projection: &MapProjection, tile: [u32; 4], sink: Sink<'_>) -> Result<(), MapError> {
        let [low, high] = self.bounds();
        let reference = 0.5 * (low + high);
        let rays = MapRays::new(projection, reference)?;
        // Taken out for the call: a sink may capture again.
        let mut buffers = BUFFERS.take();
        buffers.numbers.clear();
        leaves_in_tile(self.bvh(), projection, tile, |first, count| {
            buffers.numbers.extend((first..first + count).map(|place| self.in_leaf(place)));
        });
        buffers.numbers.sort_unstable();
        let mut map = Map { occluders: self, projection, rays, reference, tile, sink };
        let mut strand = None;
        buffers.near.clear();
        for index in 0..buffers.numbers.len() {
            match self.occluder(buffers.numbers[index]) {
                Occluder::Particle(number) => map.add_particle(&self.particles()[number as usize]),
                Occluder::Segment(number) => {
                    let of = self.segment(number).strand;
                    if strand != Some(of) {
                        map.flush(&mut buffers);
                        strand = Some(of);
                    }
                    map.add_segment(number, &mut buffers.near);
                }
            }
        }
        map.flush(&mut buffers);
        BUFFERS.replace(buffers);
        Ok(())
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some(Self::bounds(self).map(|corner| corner.to_array()))
    }

    fn memory_bytes(&self) -> u64 {
        Self::memory_bytes(self)
    }
}

struct Map<'a, 's> {
    occluders: &'a Occluders,
    projection: &'a MapProjection,
    rays: MapRays,
    reference: DVec3,
    tile: [u32; 4],
    sink: Sink<'s>,
}

impl Map<'_, '_> {
    fn texel(&self, column: u32, row: u32) -> u32 {
        let [x0, y0, x1, _] = self.tile;
        (row - y0) * (x1 - x0) + (column - x0)
    }

    fn add_particle(&mut self, particle: &Particle) {
        let [x0, y0, x1, y1] = self.tile;
        let Some([left, top, right, bottom]) = ball_on_map(self.projection, particle.centre, particle.radius)
        else {
            return;
        };
        let centre = particle.centre - self.reference;
        for row in texels_between(top, bottom, y0, y1) {
            for column in texels_between(left, right, x0, x1) {
                let ray = self.rays.through(column, row);
                let texel = self.texel(column, row);
                chord(&ray, centre, particle, &mut |segment| (self.sink)(texel, segment));
            }
        }
    }

    /// Notes the texels that a segment is near.
    fn add_segment(&self, number: u32, near: &mut Vec<(u32, NearSegment)>) {
        let segment = self.occluders.segment(number);
        let ends = self.occluders.ends(segment);
        let [x0, y0, x1, y1] = self.tile;
        let radius_sq = segment.radius * segment.radius;
        let local = ends.map(|end| end - self.reference);
        // The outline of a capsule lies in the hull of its two balls.
        let balls = ends.map(|end| ball_on_map(self.projection, end, segment.radius));
        let band = Band::new(balls);
        for row in texels_between(band.bounds[1], band.bounds[3], y0, y1) {
            let [left, right] = band.columns(f64::from(row) + 0.5);
            for column in texels_between(left, right, x0, x1) {
                let ray = self.rays.through(column, row);
                let closest = closest_on_segment(ray.origin, ray.direction, ray.starts, local);
                if closest.distance_sq < radius_sq {
                    let near_segment = NearSegment {
                        segment: number,
                        distance_sq: closest.distance_sq,
                        along: closest.along,
                    };
                    near.push((self.texel(column, row), near_segment));
                }
            }
        }
    }

    /// Hands over the passes of the strand whose segments were noted, texel by texel.
    fn flush(&mut self, buffers: &mut Buffers) {
        let Buffers { near, one_texel, runs, .. } = buffers;
        let width = self.tile[2] - self.tile[0];
        near.sort_unstable_by_key(|(texel, near)| (*texel, near.segment));
        for same in near.chunk_by(|a, b| a.0 == b.0) {
            let texel = same[0].0;
            one_texel.clear();
            one_texel.extend(same.iter().map(|(_, near)| *near));
            let stretch =
                self.rays.through(self.tile[0] + texel % width, self.tile[1] + texel / width).stretch;
            each_pass(self.occluders, one_texel, runs, |along, opacity| {
                // Before a sun's near plane it dims all that the map sees.
                let depth = (along / stretch).max(0.0) as f32;
                let optical_depth = -(-opacity).ln_1p() as f32;
                (self.sink)(texel, TranslucentSegment { entry: depth, exit: depth, optical_depth });
            });
        }
        near.clear();
    }
}

/// The stretch of a light ray in a ball, `centre` relative to the ray's reference.
#[inline]
fn chord(ray: &LightRay, centre: DVec3, particle: &Particle, sink: &mut dyn FnMut(TranslucentSegment)) {
    let to_centre = centre - ray.origin;
    let middle = to_centre.dot(ray.direction);
    let distance = (to_centre - ray.direction * middle).length();
    if !(distance < particle.radius) {
        return;
    }
    let half = ((particle.radius - distance) * (particle.radius + distance)).sqrt();
    let (entry, exit) = (middle - half, middle + half);
    if exit <= 0.0 && ray.starts {
        return;
    }
    if entry < 0.0 && !ray.starts {
        // Before a sun's near plane it dims all that the map sees.
        let before = particle.density * (exit.min(0.0) - entry);
        sink(TranslucentSegment { entry: 0.0, exit: 0.0, optical_depth: before as f32 });
    }
    if exit > 0.0 {
        // The chord ends at the lamp.
        let entry = entry.max(0.0);
        let optical_depth = (particle.density * (exit - entry)) as f32;
        let (entry, exit) = ((entry / ray.stretch) as f32, (exit / ray.stretch) as f32);
        // Depths beyond f32 are no place; no map's texels reach there.
        if exit.is_finite() {
            sink(TranslucentSegment { entry, exit, optical_depth });
        }
    }
}

/// The outline of a capsule on a map, as columns by row: two rectangles and what lies between them.
struct Band {
    bounds: Rectangle,
    /// Middles of the two rectangles, and the larger of their halves; `None` where one of them has no end.
    middles: Option<([[f64; 2]; 2], [f64; 2])>,
}

impl Band {
    fn new(balls: [Option<Rectangle>; 2]) -> Self {
        const ALL: Rectangle = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
        let [a, b] = match balls {
            [Some(a), Some(b)] => [a, b],
            [None, None] => return Self { bounds: [0.0, 0.0, -2.0, -2.0], middles: None },
            // One end behind the lamp: it may come from anywhere.
            _ => [ALL, ALL],
        };
        let bounds = [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])];
        let is_finite = bounds.iter().all(|side| side.is_finite());
        let middle = |r: Rectangle| [0.5 * (r[0] + r[2]), 0.5 * (r[1] + r[3])];
        let half = |r: Rectangle| [0.5 * (r[2] - r[0]), 0.5 * (r[3] - r[1])];
        let halves = [half(a)[0].max(half(b)[0]), half(a)[1].max(half(b)[1])];
        Self { bounds, middles: is_finite.then(|| ([middle(a), middle(b)], halves)) }
    }

    /// The columns that a row at the height v may meet: those of the middles' line within half a rectangle of v, and half a
    /// rectangle around them. The rectangles of the balls between the two ends lie in the hull of theirs.
    fn columns(&self, v: f64) -> [f64; 2] {
        let all = [self.bounds[0], self.bounds[2]];
        let Some(([a, b], [half_u, half_v])) = self.middles else { return all };
        let rise = b[1] - a[1];
        // A texel more than half a rectangle: for the rounding of nearly level pieces.
        let reach = half_v + 1.0;
        if rise.abs() <= 2.0 * reach {
            return all;
        }
        let share = |v: f64| ((v - a[1]) / rise).clamp(0.0, 1.0);
        let ends = [share(v - reach), share(v + reach)].map(|share| a[0] + (b[0] - a[0]) * share);
        [ends[0].min(ends[1]) - half_u - 1.0, ends[0].max(ends[1]) + half_u + 1.0]
    }
}
