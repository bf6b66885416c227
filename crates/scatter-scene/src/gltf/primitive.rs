//! Meshes: the triangles of a mesh's primitives, posed and cut out, with only the vertices that they use; its particles and
//! strands.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.7.2 (primitive modes). Files often let many primitives share
//! one large vertex accessor, so each takes the vertices that its indices name, in order of first use.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use gltf::json::Root;
use gltf::json::mesh::{Mesh, Mode, Primitive, Semantic};
use gltf::json::validation::Checked as Known;

use super::accessor::{Elements, INDICES, TEX_COORD, accessor, vec3};
use super::container::{Buffers, DECOMPRESS};
use super::document::Document;
use super::exact::OccluderAttributes;
use super::material::{Coverage, Masking, Materials};
use super::morph::Morph;
use super::occluders::Sources;
use super::posed::Posed;
use super::skin::{Skin, Weighted};
use crate::cutout::Cutout;
use crate::error::{Checked, Fault};
use crate::translucent::{OccluderValues, Particle, Strands};

const DRACO: &str = "KHR_draco_mesh_compression";

/// Triangles, particles and strands of one mesh: in its own space, or, with a skin, in the world's.
#[derive(Default)]
pub(super) struct LocalMesh {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    /// By the index of a triangle in this mesh, ascending.
    pub cutouts: Vec<Cutout>,
    pub particles: Vec<Particle>,
    pub strands: Strands,
    pub left_out: LeftOut,
}

/// What was not read, for the notes.
#[derive(Default, Clone, Copy)]
pub(super) struct LeftOut {
    pub point_primitives: usize,
    pub line_primitives: usize,
    /// Lines that end with half of a pair.
    pub half_lines: usize,
    pub degenerate: usize,
    pub incomplete: usize,
    /// Primitives of a skinned mesh that name no joints.
    pub unskinned: usize,
    pub moved_tex_coords: usize,
}

/// In which shape a mesh is decoded.
pub(super) struct Pose<'a> {
    /// Weights of its morph targets; those that lack are zero.
    pub weights: &'a [f64],
    pub skin: Option<&'a Skin>,
}

/// How many triangles the mesh will have at most, by its counts alone: asked before anything is decoded.
pub(super) fn triangle_count(root: &Root, mesh: &Mesh) -> Checked<u64> {
    let mut total = 0u64;
    for primitive in &mesh.primitives {
        let Some(position) = attribute(primitive, Semantic::Positions) else { continue };
        let elements = primitive.indices.map_or(position, |indices| indices.value());
        total = total.saturating_add(triangles_of(mode(primitive), accessor(root, elements)?.count.0));
    }
    Ok(total)
}

/// Decodes the triangles, particles and strands of a mesh; the caller has checked their number against the limit.
pub(super) fn decode(
    document: &Document,
    buffers: &Buffers<'_>,
    materials: &mut Materials<'_>,
    values: &OccluderValues,
    mesh_idx: usize,
    pose: &Pose<'_>,
) -> Checked<LocalMesh> {
    let mut local = LocalMesh::default();
    let sources = Sources { root: &document.root, buffers, values };
    let mut skinned_count = 0;
    for (primitive_idx, primitive) in document.root.meshes[mesh_idx].primitives.iter().enumerate() {
        let place = || format!("meshes[{mesh_idx}].primitives[{primitive_idx}]");
        let unskinned_before = local.left_out.unskinned;
        match mode(primitive) {
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                let attributes = document.exact.meshes[mesh_idx].primitives[primitive_idx].attributes;
                if !append_occluders(&sources, &attributes, primitive, pose, &place, &mut local)? {
                    match mode(primitive) {
                        Mode::Points => local.left_out.point_primitives += 1,
                        _ => local.left_out.line_primitives += 1,
                    }
                    continue;
                }
            }
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {
                let is_morphed = pose.weights.iter().any(|weight| *weight != 0.0);
                if is_morphed && document.moved_tex_coords.contains(&[mesh_idx, primitive_idx]) {
                    local.left_out.moved_tex_coords += 1;
                }
                append(&document.root, buffers, materials, primitive, pose, &place, &mut local)?;
            }
        }
        if pose.skin.is_some() && local.left_out.unskinned == unskinned_before {
            skinned_count += 1;
        }
        if skinned_count > 0 && local.left_out.unskinned > 0 {
            let problem = "some primitives of this skinned mesh name joints, others do not";
            let cure = "give all of them JOINTS_0 and WEIGHTS_0, or split the mesh";
            return Err(Fault::invalid(place(), problem, cure));
        }
    }
    Ok(local)
}

/// Appends points and lines that have all their values. Whether they have.
fn append_occluders(
    sources: &Sources<'_>,
    attributes: &OccluderAttributes,
    primitive: &Primitive,
    pose: &Pose<'_>,
    place: &dyn Fn() -> String,
    local: &mut LocalMesh,
) -> Checked<bool> {
    let &Sources { root, buffers, .. } = sources;
    let mode = mode(primitive);
    let Some(position) = attribute(primitive, Semantic::Positions) else { return Ok(false) };
    // Its values say whether it is read at all: what is left out may be anything.
    let vertex_count = accessor(root, position)?.count.0;
    let Some(values) = sources.open(mode, attributes, vertex_count, place)? else { return Ok(false) };
    check_not_compressed(root, primitive, position, place)?;
    let (posed, indices) = opened(root, buffers, primitive, position, pose, place)?;
    local.left_out.unskinned += usize::from(pose.skin.is_some() && posed.weighted.is_none());
    let count = indices.as_ref().map_or(vertex_count, Elements::count);
    let vertex = |i: u64| {
        let old = indices.as_ref().map_or(i, |indices| indices.get(i)[0] as u64);
        posed.checked_idx(old, place)
    };
    if mode == Mode::Points {
        values.append_points(&posed, count, &vertex, place, &mut local.particles)?;
    } else if values.append_lines(&posed, mode, count, &vertex, place, &mut local.strands)? {
        local.left_out.half_lines += 1;
    }
    Ok(true)
}

/// The vertices and the indices of a primitive.
fn opened<'a>(
    root: &Root,
    buffers: &'a Buffers<'_>,
    primitive: &Primitive,
    position: usize,
    pose: &Pose<'a>,
    place: &dyn Fn() -> String,
) -> Checked<(Posed<'a>, Option<Elements<'a, 1>>)> {
    let positions = Elements::open(root, buffers, position, &vec3("POSITION is"))?;
    let indices = match primitive.indices {
        Some(accessor) => Some(Elements::<1>::open(root, buffers, accessor.value(), &INDICES)?),
        None => None,
    };
    let morph = Morph::open(root, buffers, primitive, pose.weights, positions.count(), place)?;
    let weighted = match pose.skin {
        None => None,
        Some(skin) => Weighted::open(root, buffers, primitive, skin, positions.count(), place)?,
    };
    Ok((Posed { positions, morph, weighted }, indices))
}

fn append(
    root: &Root,
    buffers: &Buffers<'_>,
    materials: &mut Materials<'_>,
    primitive: &Primitive,
    pose: &Pose<'_>,
    place: &dyn Fn() -> String,
    local: &mut LocalMesh,
) -> Checked<()> {
    // Legal: an extension may supply the positions. Then there is nothing to draw without it.
    let Some(position) = attribute(primitive, Semantic::Positions) else { return Ok(()) };
    check_not_compressed(root, primitive, position, place)?;
    let (posed, indices) = opened(root, buffers, primitive, position, pose, place)?;
    let vertex_count = posed.positions.count();
    let index_count = indices.as_ref().map_or(vertex_count, Elements::count);
    let mode = mode(primitive);
    if mode == Mode::Triangles && !index_count.is_multiple_of(3) {
        local.left_out.incomplete += 1;
    }
    local.left_out.unskinned += usize::from(pose.skin.is_some() && posed.weighted.is_none());
    let masked = match masked(root, buffers, materials, primitive, vertex_count, place)? {
        Cut::Whole => None,
        Cut::Nothing => return Ok(()),
        Cut::Masked(masked) => Some(masked),
    };
    let new_of_old = NewOfOld::new(index_count, vertex_count);
    let mut vertices = Vertices { local, posed, new_of_old };
    for i in 0..triangles_of(mode, index_count) {
        let corners = match mode {
            // Every other triangle of a strip is turned, so that all wind the same way.
            Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Mode::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        let olds = corners.map(|k| indices.as_ref().map_or(k, |indices| indices.get(k)[0] as u64));
        if olds[0] == olds[1] || olds[1] == olds[2] || olds[2] == olds[0] {
            vertices.local.left_out.degenerate += 1;
            continue;
        }
        let mut triangle = [0; 3];
        for (new, old) in triangle.iter_mut().zip(olds) {
            *new = vertices.new_idx(old, place)?;
        }
        if let Some(masked) = &masked {
            // MAX_TRIANGLES fit a u32.
            let cutout = masked.cutout(vertices.local.triangles.len() as u32, olds, place)?;
            vertices.local.cutouts.push(cutout);
        }
        vertices.local.triangles.push(triangle);
    }
    Ok(())
}

/// An error if only the compressed form of a primitive is there; where uncompressed accessors are, those are read.
fn check_not_compressed(
    root: &Root,
    primitive: &Primitive,
    position: usize,
    place: &dyn Fn() -> String,
) -> Checked<()> {
    if !primitive.extensions.as_ref().is_some_and(|extensions| extensions.others.contains_key(DRACO)) {
        return Ok(());
    }
    for idx in [Some(position), primitive.indices.map(|indices| indices.value())].into_iter().flatten() {
        let accessor = accessor(root, idx)?;
        if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
            let problem = format!("its geometry is compressed with {DRACO}, which is not read");
            return Err(Fault::unsupported(place(), problem, DECOMPRESS));
        }
    }
    Ok(())
}

/// As [`Coverage`], with the texture coordinates that a mask needs.
enum Cut<'a> {
    Whole,
    Nothing,
    Masked(Masked<'a>),
}

/// A mask with the texture coordinates of a primitive's vertices.
struct Masked<'a> {
    masking: Masking,
    tex_coords: Elements<'a, 2>,
}

fn masked<'a>(
    root: &Root,
    buffers: &'a Buffers<'_>,
    materials: &mut Materials<'_>,
    primitive: &Primitive,
    vertex_count: u64,
    place: &dyn Fn() -> String,
) -> Checked<Cut<'a>> {
    let Some(material) = primitive.material.map(|material| material.value()) else { return Ok(Cut::Whole) };
    let coverage = materials.coverage(material, place)?;
    if materials.is_mask(material)
        && attribute(primitive, Semantic::Colors(0)).is_some_and(|color| {
            root.accessors
                .get(color)
                .is_some_and(|a| a.type_ == Known::Valid(gltf::json::accessor::Type::Vec4))
        })
    {
        materials.note(material, "is a cut-out whose COLOR_0 has an alpha, which is not read");
    }
    let masking = match coverage {
        Coverage::Whole => return Ok(Cut::Whole),
        Coverage::Nothing => return Ok(Cut::Nothing),
        Coverage::Masked(masking) => masking,
    };
    let name = format!("TEXCOORD_{}", masking.tex_coord);
    let Some(accessor) = attribute(primitive, Semantic::TexCoords(masking.tex_coord)) else {
        materials
            .note(material, &format!("is a cut-out, but counts as opaque where a primitive has no {name}"));
        return Ok(Cut::Whole);
    };
    let tex_coords = Elements::open(root, buffers, accessor, &TEX_COORD)?;
    if tex_coords.count() < vertex_count {
        let problem = format!("{vertex_count} positions, but {} elements of {name}", tex_coords.count());
        return Err(Fault::invalid(place(), problem, "the file is damaged: export it again"));
    }
    Ok(Cut::Masked(Masked { masking, tex_coords }))
}

impl Masked<'_> {
    fn cutout(&self, triangle: u32, olds: [u64; 3], place: &dyn Fn() -> String) -> Checked<Cutout> {
        let mut uv = [DVec2::ZERO; 3];
        for (uv, old) in uv.iter_mut().zip(olds) {
            let attribute = DVec2::from_array(self.tex_coords.get(old));
            *uv = self.masking.texture_from_attribute.transform_point2(attribute);
            if !uv.is_finite() {
                let problem =
                    format!("TEXCOORD_{}[{old}] is {attribute}, not finite", self.masking.tex_coord);
                return Err(Fault::invalid(
                    place(),
                    problem,
                    "export the mesh with finite texture coordinates",
                ));
            }
        }
        Ok(Cutout { triangle, mask: self.masking.mask, uv })
    }
}

/// Appends the vertices of one primitive as they are first used.
struct Vertices<'a> {
    local: &'a mut LocalMesh,
    posed: Posed<'a>,
    new_of_old: NewOfOld,
}

/// The new index of each old one.
enum NewOfOld {
    /// One entry a vertex of the accessor; `u32::MAX`: not used yet.
    Dense(Vec<u32>),
    /// For accessors with many more vertices than the primitive has indices.
    Sparse(HashMap<u64, u32>),
}

impl NewOfOld {
    fn new(index_count: u64, vertex_count: u64) -> Self {
        // Four times: the table costs less than the hash map would, and stays in proportion to the indices, which
        // are bounded by the limit on triangles.
        if vertex_count <= index_count.saturating_mul(4) {
            Self::Dense(vec![u32::MAX; vertex_count as usize])
        } else {
            Self::Sparse(HashMap::new())
        }
    }
}

impl Vertices<'_> {
    fn new_idx(&mut self, old: u64, place: &dyn Fn() -> String) -> Checked<u32> {
        let old = self.posed.checked_idx(old, place)?;
        // MAX_TRIANGLES · 3 vertices fit a u32.
        let next = self.local.positions.len() as u32;
        let new = match &mut self.new_of_old {
            NewOfOld::Dense(table) => &mut table[old as usize],
            NewOfOld::Sparse(map) => map.entry(old).or_insert(u32::MAX),
        };
        if *new == u32::MAX {
            let p_mesh = self.posed.at(old, place)?;
            *new = next;
            self.local.positions.push(p_mesh);
        }
        Ok(*new)
    }
}

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Known::Valid(semantic)).map(|accessor| accessor.value())
}

/// Unknown modes were refused with the document.
fn mode(primitive: &Primitive) -> Mode {
    match primitive.mode {
        Known::Valid(mode) => mode,
        Known::Invalid => Mode::Triangles,
    }
}

fn triangles_of(mode: Mode, vertex_count: u64) -> u64 {
    match mode {
        Mode::Triangles => vertex_count / 3,
        Mode::TriangleStrip | Mode::TriangleFan => vertex_count.saturating_sub(2),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
    }
}
