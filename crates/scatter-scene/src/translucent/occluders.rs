//! The translucent occluders of a scene, checked, in a tree.

use glam::DVec3;

use super::particle::Particle;
use super::strands::StrandVertex;
use crate::limits::{MAX_COORDINATE, MAX_OCCLUDERS};
use crate::scene::Scene;
use crate::tree::Bvh;

/// Particles and strands of a scene, made ready to dim light: the [`TranslucentSource`](scatter_core::TranslucentSource) of
/// its frames, and what ray-cast truth sees.
///
/// Submission order is that of the file: all particles, then all strands.
#[derive(Debug)]
pub struct Occluders {
    particles: Vec<Particle>,
    vertices: Vec<StrandVertex>,
    segments: Vec<StrandSegment>,
    /// Lowest and highest corner.
    bounds: [DVec3; 2],
    bvh: Bvh,
    /// What the leaves hold: particles by their number, segments behind them.
    order: Vec<u32>,
}

/// A straight piece of a strand. Neighbours of one strand have neighbouring numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StrandSegment {
    /// Its first vertex; the next one is its second.
    pub vertex: u32,
    pub strand: u32,
    /// Mean of its ends'.
    pub radius: f64,
    /// Mean of its ends'.
    pub opacity: f64,
}

/// What a leaf of the tree holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Occluder {
    /// A particle's number.
    Particle(u32),
    /// A segment's number.
    Segment(u32),
}

/// Particles or strands that cannot dim light.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OccluderError {
    /// A number that is out of its range.
    #[error("{what} {index} has a {field} of {value}; give {range}")]
    BadValue {
        /// `particle` or `strand vertex`.
        what: &'static str,
        /// Its index in the scene.
        index: usize,
        /// Which number.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What is accepted, in words.
        range: &'static str,
    },
    /// More of them than can be numbered.
    #[error(
        "the scene has {found} particles or strand vertices; at most {MAX_OCCLUDERS} can dim light; thin it out"
    )]
    TooMany {
        /// How many there are.
        found: usize,
    },
}

impl Occluders {
    /// Those of a scene; `None` if it has none that dims any light (a radius, density or opacity of 0 dims none).
    pub fn new(scene: &Scene) -> Result<Option<Self>, OccluderError> {
        let found = scene.particles.len().max(scene.strands.vertices().len());
        if found as u64 > MAX_OCCLUDERS {
            return Err(OccluderError::TooMany { found });
        }
        check(scene)?;
        let dims = |particle: &&Particle| particle.radius > 0.0 && particle.density > 0.0;
        let particles: Vec<Particle> = scene.particles.iter().filter(dims).copied().collect();
        let mut segments = Vec::with_capacity(scene.strands.vertices().len());
        let mut first = 0;
        for (strand, vertices) in (0..).zip(scene.strands.iter()) {
            for (vertex, ends) in (first..).zip(vertices.windows(2)) {
                let mean = |value: fn(&StrandVertex) -> f64| 0.5 * (value(&ends[0]) + value(&ends[1]));
                let segment = StrandSegment {
                    vertex,
                    strand,
                    radius: mean(|v| v.radius),
                    opacity: mean(|v| v.opacity),
                };
                segments.push(segment);
            }
            first += vertices.len() as u32;
        }
        let vertices = scene.strands.vertices().to_vec();
        let mut occluders = Self {
            particles,
            vertices,
            segments,
            bounds: [DVec3::ZERO; 2],
            bvh: Bvh::default(),
            order: Vec::new(),
        };
        let ball = |centre: DVec3, radius: f64| [centre - radius, centre + radius];
        let join = |[a, b]: [DVec3; 2], [c, d]: [DVec3; 2]| [a.min(c), b.max(d)];
        let mut boxes: Vec<[DVec3; 2]> =
            occluders.particles.iter().map(|particle| ball(particle.centre, particle.radius)).collect();
        // Segments that dim nothing keep their numbers, so that neighbours are neighbours, and are in no leaf.
        let mut numbers: Vec<u32> = (0..boxes.len() as u32).collect();
        for (segment, number) in occluders.segments.iter().zip(occluders.particles.len() as u32..) {
            if segment.radius > 0.0 && segment.opacity > 0.0 {
                let [a, b] = occluders.ends(segment).map(|end| ball(end, segment.radius));
                boxes.push(join(a, b));
                numbers.push(number);
            }
        }
        let Some(bounds) = boxes.iter().copied().reduce(join) else { return Ok(None) };
        let (bvh, order) = Bvh::of_boxes(&boxes);
        occluders.bounds = bounds;
        occluders.bvh = bvh;
        occluders.order = order.into_iter().map(|index| numbers[index as usize]).collect();
        Ok(Some(occluders))
    }

    /// Particles that dim light.
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// Vertices of all strands.
    pub fn strand_vertices(&self) -> &[StrandVertex] {
        &self.vertices
    }

    /// How many strands there are.
    pub fn strand_count(&self) -> usize {
        self.segments.last().map_or(0, |segment| segment.strand as usize + 1)
    }

    /// Lowest and highest corner of all that dims light, world space.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// Bytes that they hold.
    pub fn memory_bytes(&self) -> u64 {
        let bytes = self.particles.capacity() * size_of::<Particle>()
            + self.vertices.capacity() * size_of::<StrandVertex>()
            + self.segments.capacity() * size_of::<StrandSegment>()
            + self.order.capacity() * size_of::<u32>();
        bytes as u64 + self.bvh.memory_bytes()
    }

    #[inline]
    pub(crate) fn segment(&self, number: u32) -> &StrandSegment {
        &self.segments[number as usize]
    }

    /// Both ends of a segment.
    #[inline]
    pub(crate) fn ends(&self, segment: &StrandSegment) -> [DVec3; 2] {
        let first = segment.vertex as usize;
        [self.vertices[first].position, self.vertices[first + 1].position]
    }

    pub(crate) fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// What stands at a place of a leaf. Numbers ascend in the order of submission: particles, then segments.
    #[inline]
    pub(crate) fn in_leaf(&self, place: u32) -> u32 {
        self.order[place as usize]
    }

    /// What a number names.
    #[inline]
    pub(crate) fn occluder(&self, number: u32) -> Occluder {
        let particles = self.particles.len() as u32;
        if number < particles { Occluder::Particle(number) } else { Occluder::Segment(number - particles) }
    }

    /// Balls that together hold all that dims light: their middles and radii.
    pub(crate) fn balls(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        let particles = self.particles.iter().map(|particle| (particle.centre, particle.radius));
        let segments = self.segments.iter().filter(|segment| segment.radius > 0.0 && segment.opacity > 0.0);
        particles.chain(segments.flat_map(|segment| self.ends(segment).map(|end| (end, segment.radius))))
    }
}

fn check(scene: &Scene) -> Result<(), OccluderError> {
    let bad = |what, index, field, value, range| OccluderError::BadValue { what, index, field, value, range };
    let size = "a finite number ≥ 0";
    let is_size = |value: f64| (0.0..=MAX_COORDINATE).contains(&value);
    let coordinate = |p: DVec3| p.to_array().into_iter().find(|c| !(c.abs() <= MAX_COORDINATE));
    for (index, particle) in scene.particles.iter().enumerate() {
        let &Particle { centre, radius, density } = particle;
        if let Some(value) = coordinate(centre) {
            return Err(bad("particle", index, "coordinate", value, "finite coordinates within ±1e15"));
        }
        if !is_size(radius) {
            return Err(bad("particle", index, "radius", radius, "a number ≥ 0 and ≤ 1e15"));
        }
        if !(density >= 0.0 && density.is_finite()) {
            return Err(bad("particle", index, "density", density, size));
        }
    }
    for (index, vertex) in scene.strands.vertices().iter().enumerate() {
        let &StrandVertex { position, radius, opacity } = vertex;
        if let Some(value) = coordinate(position) {
            return Err(bad("strand vertex", index, "coordinate", value, "finite coordinates within ±1e15"));
        }
        if !is_size(radius) {
            return Err(bad("strand vertex", index, "radius", radius, "a number ≥ 0 and ≤ 1e15"));
        }
        if !(0.0..=1.0).contains(&opacity) {
            return Err(bad("strand vertex", index, "opacity", opacity, "a number from 0 to 1"));
        }
    }
    Ok(())
}
