//! glTF 2.0 and GLB as world-space f64 triangles, cameras and KHR_lights_punctual lights.
//!
//! In order of work: [`container`] splits the file, [`schema`] is its JSON, [`nodes`] places the nodes,
//! [`accessor`] reads typed elements, [`primitive`] makes triangles of them. Read here rather than through the crate
//! `gltf` (which the tests compare with), because that one panics on some files, passes over bad bounds in silence,
//! and holds node numbers as f32.
//!
//! Left out, with a note: points and lines, skins, animations, morph targets. An unknown *required* extension is an
//! error, an optional one is ignored, as the specification has it.

mod accessor;
mod container;
mod extras;
mod nodes;
mod primitive;
mod schema;
mod uri;

use std::collections::HashMap;
use std::path::Path;

use self::container::Buffers;
use self::extras::{scene_camera, scene_light};
use self::nodes::{PlacedNode, node_place, placed_nodes};
use self::primitive::{LeftOut, LocalMesh, decode, triangle_count};
use self::schema::Root;
use crate::error::{Checked, Fault};
use crate::load::{checked_counts, checked_position};
use crate::scene::Scene;

/// Extensions that may be *required*: they are read, or do not touch geometry, cameras and lights.
const KNOWN_EXTENSIONS: [&str; 8] = [
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "KHR_xmp_json_ld",
    "KHR_animation_pointer",
    "EXT_texture_webp",
    "MSFT_texture_dds",
];

/// Reads a GLB or glTF file; buffers beside it are looked for in `folder`.
pub(crate) fn read(bytes: &[u8], folder: &Path) -> Checked<Scene> {
    let (root, bin) = container::split(bytes)?;
    check_asset(&root)?;
    let placed = placed_nodes(&root)?;
    let buffers = Buffers::new(&root.buffers, bin, folder);
    let mut scene = Scene::default();
    for &PlacedNode { node_idx, world_from_node } in &placed {
        scene.cameras.extend(scene_camera(&root, node_idx, world_from_node)?);
        scene.lights.extend(scene_light(&root, node_idx, world_from_node)?);
    }
    let left_out = add_meshes(&root, &buffers, &placed, &mut scene)?;
    add_notes(&root, &placed, left_out, &mut scene.notes);
    Ok(scene)
}

fn check_asset(root: &Root) -> Checked<()> {
    let newest = root.asset.min_version.as_deref().unwrap_or(&root.asset.version);
    if newest.split('.').next() != Some("2") {
        let problem = format!("version \"{newest}\"");
        return Err(Fault::unsupported("asset", problem, "export it as glTF 2.0"));
    }
    for extension in &root.extensions_required {
        if KNOWN_EXTENSIONS.contains(&extension.as_str()) || extension.starts_with("KHR_materials_") {
            continue;
        }
        let cure = if extension.contains("draco") || extension.contains("meshopt") {
            "export it without mesh compression"
        } else {
            "export it without that extension"
        };
        return Err(Fault::unsupported("extensionsRequired", format!("\"{extension}\" is not read"), cure));
    }
    Ok(())
}

/// Adds every instance of every mesh; the whole size is known and checked before the first vertex is decoded.
fn add_meshes(
    root: &Root,
    buffers: &Buffers<'_>,
    placed: &[PlacedNode],
    scene: &mut Scene,
) -> Checked<LeftOut> {
    let mut triangle_total = 0u64;
    let mut uses: HashMap<usize, usize> = HashMap::new();
    for &PlacedNode { node_idx, .. } in placed {
        let Some(mesh_idx) = root.nodes[node_idx].mesh else { continue };
        let place = || node_place(root, node_idx);
        let mesh = root.meshes.get(mesh_idx).ok_or_else(|| {
            let problem = format!("mesh {mesh_idx}, but the asset has {} meshes", root.meshes.len());
            Fault::invalid(place(), problem, "the file is damaged: export it again")
        })?;
        triangle_total = triangle_total.saturating_add(triangle_count(root, mesh)?);
        checked_counts(place, triangle_total, 0)?;
        *uses.entry(mesh_idx).or_default() += 1;
    }
    let mut decoded: HashMap<usize, LocalMesh> = HashMap::new();
    let mut left_out = LeftOut::default();
    for placed in placed {
        let Some(mesh_idx) = root.nodes[placed.node_idx].mesh else { continue };
        let local = match decoded.remove(&mesh_idx) {
            Some(local) => local,
            None => {
                let local = decode(root, buffers, mesh_idx)?;
                left_out.add(local.left_out);
                local
            }
        };
        add_instance(root, placed, &local, scene)?;
        // Kept only as long as another instance will come.
        let uses_left = uses.entry(mesh_idx).or_default();
        *uses_left = uses_left.saturating_sub(1);
        if *uses_left > 0 {
            decoded.insert(mesh_idx, local);
        }
    }
    Ok(left_out)
}

fn add_instance(root: &Root, placed: &PlacedNode, local: &LocalMesh, scene: &mut Scene) -> Checked<()> {
    let place = || node_place(root, placed.node_idx);
    let first = scene.positions.len();
    checked_counts(place, 0, (first + local.positions.len()) as u64)?;
    // MAX_POSITIONS fits a u32.
    let first = first as u32;
    scene.positions.reserve(local.positions.len());
    for &p_mesh in &local.positions {
        let p_world = placed.world_from_node.transform_point3(p_mesh);
        scene.positions.push(checked_position(p_world, place)?);
    }
    scene.triangles.extend(local.triangles.iter().map(|triangle| triangle.map(|idx| idx + first)));
    Ok(())
}

impl LeftOut {
    fn add(&mut self, other: Self) {
        self.point_primitives += other.point_primitives;
        self.line_primitives += other.line_primitives;
        self.degenerate += other.degenerate;
        self.incomplete += other.incomplete;
        self.morphed += other.morphed;
    }
}

fn add_notes(root: &Root, placed: &[PlacedNode], left_out: LeftOut, notes: &mut Vec<String>) {
    let mut note = |count: usize, what: &str| {
        if count > 0 {
            notes.push(format!("{count} {what}"));
        }
    };
    let nodes = || placed.iter().map(|placed| &root.nodes[placed.node_idx]);
    note(left_out.point_primitives, "point primitives are left out");
    note(left_out.line_primitives, "line primitives are left out");
    note(left_out.degenerate, "triangles that repeat a vertex index are left out");
    note(left_out.incomplete, "primitives end with an incomplete triangle, which is left out");
    note(left_out.morphed, "primitives have morph targets, which are ignored: the base shape is taken");
    note(
        nodes().filter(|node| node.skin.is_some()).count(),
        "skins are ignored: the mesh stands as its node does",
    );
    note(
        nodes().filter(|node| node.extensions.instancing.is_some()).count(),
        "EXT_mesh_gpu_instancing nodes are taken once",
    );
    note(root.animations.len(), "animations are ignored");
}
