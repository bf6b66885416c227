//! Points as particles and lines as strands, posed as the vertices of triangles are.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.7.2.1: names that begin with an underscore belong to applications.
//! `_RADIUS` \[world units\], `_DENSITY` \[1/length\] and `_OPACITY` are scalars, one a vertex; a shot's tables stand in
//! where a primitive has none. Node transforms move centres and vertices and leave radii alone.
//!
//! LINES are pairs of vertices: neighbouring pairs are one strand where one begins at the vertex, or the place, at which the
//! one before ends.

use glam::DVec3;
use gltf::json::Root;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Mode;

use super::accessor::{Elements, Wanted};
use super::container::Buffers;
use super::exact::OccluderAttributes;
use super::posed::Posed;
use crate::error::{Checked, Fault};
use crate::limits::checked_occluders;
use crate::translucent::{
    OccluderValues, Particle, StrandVertex, Strands, checked_density, checked_opacity, checked_radius,
};

/// What points and lines bring along, and the shot's values for them.
pub(super) struct Sources<'a> {
    pub root: &'a Root,
    pub buffers: &'a Buffers<'a>,
    pub values: &'a OccluderValues,
}

/// A value for each vertex.
enum Value<'a> {
    Each(Elements<'a, 1>),
    Same(f64),
}

/// Two values for each vertex: of its size, and of how much light it takes.
pub(super) struct Values<'a> {
    radius: Value<'a>,
    strength: Value<'a>,
    strength_name: &'static str,
}

impl<'a> Sources<'a> {
    /// The values of a primitive's points or lines; `None` if one is missing, and they are left out.
    pub(super) fn open(
        &self,
        mode: Mode,
        attributes: &OccluderAttributes,
        vertex_count: u64,
        place: &dyn Fn() -> String,
    ) -> Checked<Option<Values<'a>>> {
        let (radius, strength, strength_name, attribute) = if mode == Mode::Points {
            let values = self.values.particles.unwrap_or_default();
            (values.radius, values.density, "_DENSITY", attributes.density)
        } else {
            let values = self.values.strands.unwrap_or_default();
            (values.radius, values.opacity, "_OPACITY", attributes.opacity)
        };
        let open = |accessor: Option<usize>, name: &'static str, same: Option<f64>| match accessor {
            None => Ok(same.map(Value::Same)),
            Some(accessor) => self.each(accessor, name, vertex_count, place).map(Some),
        };
        let radius = open(attributes.radius, "_RADIUS", radius)?;
        let strength = open(attribute, strength_name, strength)?;
        Ok(radius.zip(strength).map(|(radius, strength)| Values { radius, strength, strength_name }))
    }

    fn each(
        &self,
        accessor: usize,
        name: &'static str,
        vertex_count: u64,
        place: &dyn Fn() -> String,
    ) -> Checked<Value<'a>> {
        let subject = match name {
            "_RADIUS" => "_RADIUS is",
            "_DENSITY" => "_DENSITY is",
            _ => "_OPACITY is",
        };
        let wanted = Wanted {
            subject,
            kind: Type::Scalar,
            components: &[
                ComponentType::F32,
                ComponentType::I8,
                ComponentType::U8,
                ComponentType::I16,
                ComponentType::U16,
            ],
            normalized: None,
            cure: "_RADIUS, _DENSITY and _OPACITY are SCALAR of floats, bytes or shorts",
        };
        let elements = Elements::open(self.root, self.buffers, accessor, &wanted)?;
        if elements.count() == vertex_count {
            return Ok(Value::Each(elements));
        }
        let problem = format!("{vertex_count} positions, but {} elements of {name}", elements.count());
        Err(Fault::invalid(place(), problem, "give one element a vertex"))
    }
}

impl Value<'_> {
    fn get(&self, idx: u64) -> f64 {
        match self {
            Self::Each(elements) => elements.get(idx)[0],
            Self::Same(value) => *value,
        }
    }
}

impl Values<'_> {
    fn radius(&self, idx: u64, place: &dyn Fn() -> String) -> Checked<f64> {
        checked_radius(self.radius.get(idx), || format!("_RADIUS[{idx}]"), place)
    }

    fn particle(&self, posed: &Posed<'_>, idx: u64, place: &dyn Fn() -> String) -> Checked<Particle> {
        let density =
            checked_density(self.strength.get(idx), || format!("{}[{idx}]", self.strength_name), place)?;
        let radius = self.radius(idx, place)?;
        // What dims nothing is placed nowhere: an accessor without bytes may have any number of zeros.
        let centre = if radius > 0.0 && density > 0.0 { posed.at(idx, place)? } else { DVec3::ZERO };
        Ok(Particle { centre, radius, density })
    }

    fn strand_vertex(
        &self,
        posed: &Posed<'_>,
        idx: u64,
        place: &dyn Fn() -> String,
    ) -> Checked<StrandVertex> {
        let opacity =
            checked_opacity(self.strength.get(idx), || format!("{}[{idx}]", self.strength_name), place)?;
        Ok(StrandVertex { position: posed.at(idx, place)?, radius: self.radius(idx, place)?, opacity })
    }

    /// Appends the particles of points: `count` of them, point `i` at the vertex `vertex(i)`.
    pub(super) fn append_points(
        &self,
        posed: &Posed<'_>,
        count: u64,
        vertex: &dyn Fn(u64) -> Checked<u64>,
        place: &dyn Fn() -> String,
        particles: &mut Vec<Particle>,
    ) -> Checked<()> {
        for i in 0..count {
            let particle = self.particle(posed, vertex(i)?, place)?;
            if particle.radius > 0.0 && particle.density > 0.0 {
                particles.push(particle);
                checked_occluders(place, particles.len() as u64)?;
            }
        }
        Ok(())
    }

    /// Appends the strands of lines. Whether a last vertex was left over.
    pub(super) fn append_lines(
        &self,
        posed: &Posed<'_>,
        mode: Mode,
        count: u64,
        vertex: &dyn Fn(u64) -> Checked<u64>,
        place: &dyn Fn() -> String,
        strands: &mut Strands,
    ) -> Checked<bool> {
        let at = |i: u64| self.strand_vertex(posed, vertex(i)?, place);
        let mut strand: Vec<StrandVertex> = Vec::new();
        if mode != Mode::Lines {
            // A loop returns to its first vertex.
            let returns = mode == Mode::LineLoop && count > 0;
            for i in (0..count).chain(returns.then_some(0)) {
                let vertex = at(i)?;
                // A vertex on the one before changes nothing, and an accessor without bytes may have any number of them.
                if strand.len() < 2 || strand.last() != Some(&vertex) {
                    strand.push(vertex);
                    checked_occluders(place, (strands.vertices().len() + strand.len()) as u64)?;
                }
            }
            strands.push(strand);
            return Ok(false);
        }
        let mut last = None;
        for line in 0..count / 2 {
            let [a, b] = [vertex(2 * line)?, vertex(2 * line + 1)?];
            let [from, to] = [self.strand_vertex(posed, a, place)?, self.strand_vertex(posed, b, place)?];
            let goes_on = last == Some(a) || strand.last().is_some_and(|end| *end == from);
            if !goes_on {
                strands.push(strand.drain(..));
                strand.push(from);
            }
            if strand.len() < 2 || strand.last() != Some(&to) {
                strand.push(to);
                checked_occluders(place, (strands.vertices().len() + strand.len()) as u64)?;
            }
            last = Some(b);
        }
        strands.push(strand.drain(..));
        Ok(!count.is_multiple_of(2))
    }
}
