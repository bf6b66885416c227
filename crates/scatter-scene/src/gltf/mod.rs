//! glTF 2.0 and GLB as world-space f64 triangles, cut-outs, particles, strands, cameras and KHR_lights_punctual lights.
//!
//! In order of work: [`container`] splits the file, [`document`] parses its JSON by the crate `gltf`, [`exact`] reads
//! the numbers that `gltf` rounds, [`extensions`] judges what the asset asks for, [`nodes`] places the nodes,
//! [`instances`] multiplies them, [`material`] reads masks, [`primitive`] makes triangles of what [`accessor`] reads, in
//! the pose of [`skin`] and [`morph`]. What stays ours, and why: the guard before any accessor and the reading itself
//! (`gltf` panics on some files, passes over bad bounds in silence and decodes to f32) and the numbers of nodes.
//!
//! Points and lines are particles and strands ([`occluders`]), where they or the shot say how large they are and how much light
//! they take.
//!
//! Left out, with a note: other points and lines, animations, blending and transmission, a light's range, extensions that are
//! used and not read. An extension that is *required* and not read is an error, as the specification has it.

mod accessor;
mod container;
mod document;
mod exact;
mod extensions;
mod extras;
mod instances;
mod material;
mod morph;
mod nodes;
mod occluders;
mod posed;
mod primitive;
mod skin;
mod uri;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

use glam::{DMat4, DVec3};

use self::container::Buffers;
use self::document::Document;
use self::extras::{scene_camera, scene_light};
use self::instances::Instances;
use self::material::Materials;
use self::nodes::{Nodes, PlacedNode, node_place};
use self::primitive::{LeftOut, LocalMesh, Pose, decode, triangle_count};
use self::skin::Skin;
use crate::cutout::Cutout;
use crate::error::{Checked, Fault};
use crate::limits::{checked_counts, checked_occluders, checked_position};
use crate::scene::Scene;
use crate::translucent::{OccluderValues, Particle, StrandVertex};

/// Reads a GLB or glTF file; buffers and images beside it are looked for in `folder`.
pub(crate) fn read(bytes: &[u8], folder: &Path, values: &OccluderValues) -> Checked<Scene> {
    let (document, bin) = container::split(bytes)?;
    extensions::check_required(&document)?;
    let mut scene = Scene::default();
    let nodes = Nodes::new(&document, &mut scene.notes)?;
    let buffers = Buffers::new(&document.root.buffers, bin, folder);
    for &PlacedNode { node_idx, world_from_node, is_visible } in &nodes.placed {
        scene.cameras.extend(scene_camera(&document, node_idx, world_from_node)?);
        if is_visible {
            scene.lights.extend(scene_light(&document, node_idx, world_from_node, &mut scene.notes)?);
        }
    }
    let mut materials = Materials::new(&document, &buffers, folder);
    let drawn = drawn(&document, &buffers, &nodes)?;
    let left_out = add_meshes(&document, &buffers, &nodes, &drawn, &mut materials, values, &mut scene)?;
    let (masks, notes) = (materials.masks, materials.notes);
    scene.masks = masks;
    scene.notes.extend(notes);
    add_notes(&document, left_out, &mut scene.notes);
    Ok(scene)
}

/// A visible node with a mesh.
struct Drawn<'a> {
    placed: &'a PlacedNode,
    mesh_idx: usize,
    skin_idx: Option<usize>,
    instances: Option<Instances<'a>>,
}

/// The nodes that are drawn; the whole size is known and checked before the first vertex is decoded.
fn drawn<'a>(document: &'a Document, buffers: &'a Buffers<'_>, nodes: &'a Nodes) -> Checked<Vec<Drawn<'a>>> {
    let root = &document.root;
    let mut drawn = Vec::new();
    let mut triangle_total = 0u64;
    for placed in nodes.placed.iter().filter(|placed| placed.is_visible) {
        let node = &root.nodes[placed.node_idx];
        let Some(mesh_idx) = node.mesh.map(|mesh| mesh.value()) else { continue };
        let place = || node_place(root, placed.node_idx);
        let mesh = root.meshes.get(mesh_idx).ok_or_else(|| {
            let problem = format!("mesh {mesh_idx}, but the asset has {} meshes", root.meshes.len());
            Fault::invalid(place(), problem, "the file is damaged: export it again")
        })?;
        let instances = Instances::open(document, buffers, placed.node_idx)?;
        let instance_count = instances.as_ref().map_or(1, Instances::count);
        // Each instance counts, even of a mesh without a triangle: they are walked.
        let triangles = triangle_count(root, mesh)?.max(1).saturating_mul(instance_count);
        triangle_total = triangle_total.saturating_add(triangles);
        checked_counts(place, triangle_total, 0)?;
        let skin_idx = node.skin.map(|skin| skin.value());
        drawn.push(Drawn { placed, mesh_idx, skin_idx, instances });
    }
    Ok(drawn)
}

/// Adds every instance of every mesh.
fn add_meshes(
    document: &Document,
    buffers: &Buffers<'_>,
    nodes: &Nodes,
    drawn: &[Drawn<'_>],
    materials: &mut Materials<'_>,
    values: &OccluderValues,
    scene: &mut Scene,
) -> Checked<LeftOut> {
    let mut left_out = LeftOut::default();
    let mut uses: HashMap<(usize, Option<usize>), usize> = HashMap::new();
    let key = |drawn: &Drawn<'_>| (drawn.mesh_idx, drawn.skin_idx);
    let own_weights = |drawn: &Drawn<'_>| document.exact.nodes[drawn.placed.node_idx].weights.as_deref();
    for drawn in drawn.iter().filter(|drawn| own_weights(drawn).is_none()) {
        *uses.entry(key(drawn)).or_default() += 1;
    }
    let mut decoded: HashMap<(usize, Option<usize>), LocalMesh> = HashMap::new();
    let mut skins: HashMap<usize, Skin> = HashMap::new();
    for drawn in drawn {
        let weights = own_weights(drawn);
        let known = if weights.is_none() { decoded.remove(&key(drawn)) } else { None };
        let local = match known {
            Some(local) => local,
            None => {
                let skin = match drawn.skin_idx {
                    None => None,
                    Some(skin_idx) => Some(match skins.entry(skin_idx) {
                        Entry::Occupied(known) => &*known.into_mut(),
                        Entry::Vacant(new) => new.insert(Skin::open(document, buffers, nodes, skin_idx)?),
                    }),
                };
                let weights = weights.unwrap_or(&document.exact.meshes[drawn.mesh_idx].weights);
                let pose = Pose { weights, skin };
                let local = decode(document, buffers, materials, values, drawn.mesh_idx, &pose)?;
                left_out.add(local.left_out);
                local
            }
        };
        add_instances(document, drawn, &local, scene)?;
        // Kept only as long as another node will come.
        if weights.is_none() {
            let uses_left = uses.entry(key(drawn)).or_default();
            *uses_left = uses_left.saturating_sub(1);
            if *uses_left > 0 {
                decoded.insert(key(drawn), local);
            }
        }
    }
    Ok(left_out)
}

fn add_instances(
    document: &Document,
    drawn: &Drawn<'_>,
    local: &LocalMesh,
    scene: &mut Scene,
) -> Checked<()> {
    let node_idx = drawn.placed.node_idx;
    // The joints have put a skinned mesh into the world; instances of it would all stand there.
    if drawn.skin_idx.is_some() && local.left_out.unskinned == 0 {
        if drawn.instances.is_some() {
            let node = node_place(&document.root, node_idx);
            scene.notes.push(format!("{node} is skinned and instanced: it is taken once"));
        }
        return add_instance(document, node_idx, DMat4::IDENTITY, local, scene);
    }
    let world_from_node = drawn.placed.world_from_node;
    match &drawn.instances {
        None => add_instance(document, node_idx, world_from_node, local, scene),
        Some(instances) => (0..instances.count()).try_for_each(|i| {
            let world = world_from_node * instances.node_from_instance(i)?;
            add_instance(document, node_idx, world, local, scene)
        }),
    }
}

fn add_instance(
    document: &Document,
    node_idx: usize,
    world_from_mesh: DMat4,
    local: &LocalMesh,
    scene: &mut Scene,
) -> Checked<()> {
    let place = || node_place(&document.root, node_idx);
    let first = scene.positions.len();
    checked_counts(place, 0, (first + local.positions.len()) as u64)?;
    // MAX_POSITIONS fits a u32, as MAX_TRIANGLES does.
    let (first, first_triangle) = (first as u32, scene.triangles.len() as u32);
    scene.positions.reserve(local.positions.len());
    for &p_mesh in &local.positions {
        let p_world = world_from_mesh.transform_point3(p_mesh);
        scene.positions.push(checked_position(p_world, place)?);
    }
    scene.triangles.extend(local.triangles.iter().map(|triangle| triangle.map(|idx| idx + first)));
    let placed = |cutout: &Cutout| Cutout { triangle: cutout.triangle + first_triangle, ..*cutout };
    scene.cutouts.extend(local.cutouts.iter().map(placed));
    checked_occluders(place, (scene.particles.len() + local.particles.len()) as u64)?;
    checked_occluders(place, (scene.strands.vertices().len() + local.strands.vertices().len()) as u64)?;
    // Radii are world units, whatever the node's scale.
    let world = |p_mesh: DVec3| checked_position(world_from_mesh.transform_point3(p_mesh), place);
    for particle in &local.particles {
        scene.particles.push(Particle { centre: world(particle.centre)?, ..*particle });
    }
    for strand in local.strands.iter() {
        let placed =
            |vertex: &StrandVertex| Ok(StrandVertex { position: world(vertex.position)?, ..*vertex });
        let placed: Vec<StrandVertex> = strand.iter().map(placed).collect::<Checked<_>>()?;
        scene.strands.push(placed);
    }
    Ok(())
}

impl LeftOut {
    fn add(&mut self, other: Self) {
        self.point_primitives += other.point_primitives;
        self.line_primitives += other.line_primitives;
        self.half_lines += other.half_lines;
        self.degenerate += other.degenerate;
        self.incomplete += other.incomplete;
        self.unskinned += other.unskinned;
        self.moved_tex_coords += other.moved_tex_coords;
    }
}

fn add_notes(document: &Document, left_out: LeftOut, notes: &mut Vec<String>) {
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            notes.push(format!("{count} {what}"));
        }
    };
    note(left_out.point_primitives, "point primitives are left out");
    note(left_out.line_primitives, "line primitives are left out");
    note(left_out.half_lines, "line primitives end with half of a line, which is left out");
    note(left_out.degenerate, "triangles that repeat a vertex index are left out");
    note(left_out.incomplete, "primitives end with an incomplete triangle, which is left out");
    note(left_out.unskinned, "primitives of skinned meshes name no joints: they stand as their node does");
    note(
        left_out.moved_tex_coords,
        "primitives have morph targets for texture coordinates, which are not moved",
    );
    note(document.animation_count, "animations are ignored: everything stands as its node does");
    extensions::note_unread(&document.extensions, notes);
}
