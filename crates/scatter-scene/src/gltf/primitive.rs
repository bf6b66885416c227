//! Meshes: the triangles of a mesh's primitives in mesh space, with only the vertices that they use.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.7.2 (primitive modes). Files often let many primitives share
//! one large vertex accessor, so each takes the vertices that its indices name, in order of first use.

use std::collections::HashMap;

use glam::DVec3;

use super::accessor::{Elements, accessor};
use super::container::Buffers;
use super::schema::{Mesh, Primitive, Root};
use crate::error::{Checked, Fault};

/// The default primitive mode.
pub(super) const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// Triangles of one mesh in its own space.
#[derive(Default)]
pub(super) struct LocalMesh {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub left_out: LeftOut,
}

/// What was not read, for the notes.
#[derive(Default, Clone, Copy)]
pub(super) struct LeftOut {
    pub point_primitives: usize,
    pub line_primitives: usize,
    pub degenerate: usize,
    pub incomplete: usize,
    pub morphed: usize,
}

/// How many triangles the mesh will have at most, by its counts alone: asked before anything is decoded.
pub(super) fn triangle_count(root: &Root, mesh: &Mesh) -> Checked<u64> {
    let mut total = 0u64;
    for primitive in &mesh.primitives {
        let Some(position) = primitive.attributes.position else { continue };
        let vertex_count = accessor(root, primitive.indices.unwrap_or(position))?.count;
        total = total.saturating_add(triangles_of(primitive.mode, vertex_count));
    }
    Ok(total)
}

/// Decodes the triangles of a mesh; the caller has checked their number against the limit.
pub(super) fn decode(root: &Root, buffers: &Buffers<'_>, mesh_idx: usize) -> Checked<LocalMesh> {
    let mut local = LocalMesh::default();
    for (primitive_idx, primitive) in root.meshes[mesh_idx].primitives.iter().enumerate() {
        let place = || format!("meshes[{mesh_idx}].primitives[{primitive_idx}]");
        local.left_out.morphed += usize::from(primitive.targets.is_some());
        match primitive.mode {
            0 => local.left_out.point_primitives += 1,
            1..=3 => local.left_out.line_primitives += 1,
            TRIANGLES | STRIP | FAN => append(root, buffers, primitive, &place, &mut local)?,
            mode => {
                let problem = format!("primitive mode {mode}");
                return Err(Fault::invalid(place(), problem, "modes are 0 to 6: export the file again"));
            }
        }
    }
    Ok(local)
}

fn append(
    root: &Root,
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    place: &dyn Fn() -> String,
    local: &mut LocalMesh,
) -> Checked<()> {
    // Legal: an extension may supply the positions. Then there is nothing to draw without it.
    let Some(position) = primitive.attributes.position else { return Ok(()) };
    let positions = Elements::positions(root, buffers, position)?;
    let indices = match primitive.indices {
        Some(accessor_idx) => Some(Elements::indices(root, buffers, accessor_idx)?),
        None => None,
    };
    let index_count = indices.as_ref().map_or(positions.count(), Elements::count);
    if primitive.mode == TRIANGLES && !index_count.is_multiple_of(3) {
        local.left_out.incomplete += 1;
    }
    let new_of_old = NewOfOld::new(index_count, positions.count());
    let mut vertices = Vertices { local, positions, new_of_old };
    for i in 0..triangles_of(primitive.mode, index_count) {
        let corners = match primitive.mode {
            TRIANGLES => [3 * i, 3 * i + 1, 3 * i + 2],
            // Every other triangle of a strip is turned, so that all wind the same way.
            STRIP => [i, i + 1 + i % 2, i + 2 - i % 2],
            _ => [i + 1, i + 2, 0],
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
        vertices.local.triangles.push(triangle);
    }
    Ok(())
}

/// Appends the vertices of one primitive as they are first used.
struct Vertices<'a> {
    local: &'a mut LocalMesh,
    positions: Elements<'a>,
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
        if old >= self.positions.count() {
            let problem = format!("vertex index {old}, but POSITION has {} elements", self.positions.count());
            return Err(Fault::invalid(
                place(),
                problem,
                "the file is damaged or was exported wrongly: export it again",
            ));
        }
        // MAX_TRIANGLES · 3 vertices fit a u32.
        let next = self.local.positions.len() as u32;
        let new = match &mut self.new_of_old {
            NewOfOld::Dense(table) => &mut table[old as usize],
            NewOfOld::Sparse(map) => map.entry(old).or_insert(u32::MAX),
        };
        if *new == u32::MAX {
            let p_mesh = DVec3::from_array(self.positions.get(old));
            if !p_mesh.is_finite() {
                let problem = format!("POSITION[{old}] is {p_mesh}, not finite");
                return Err(Fault::invalid(place(), problem, "export the mesh with finite coordinates"));
            }
            *new = next;
            self.local.positions.push(p_mesh);
        }
        Ok(*new)
    }
}

fn triangles_of(mode: u64, vertex_count: u64) -> u64 {
    match mode {
        TRIANGLES => vertex_count / 3,
        STRIP | FAN => vertex_count.saturating_sub(2),
        _ => 0,
    }
}
