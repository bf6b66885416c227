//! What each extension means to shadows: read, without a part in them, or not read.
//!
//! Source: the Khronos registry of glTF extensions, Khronos, multi-vendor and vendor ones. An extension that the asset
//! *requires* and that is not read is an error; one that is only used is a note; one that cannot move, hide or make a
//! triangle, a camera or a light is accepted without a word.

use std::collections::BTreeSet;

use super::container::DECOMPRESS;
use super::document::Document;
use crate::error::{Checked, Fault};

/// Extensions that are read, where they stand.
const READ: [&str; 9] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_materials_variants",
];

/// Compressed geometry: an error where nothing but the compressed form is there.
const COMPRESSED: [&str; 3] =
    ["EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_meshopt_compression"];

/// Extensions that touch neither geometry nor cameras nor lights: metadata, interaction, sound, physics, and what
/// changes an animation only.
const WITHOUT_A_PART: [&str; 26] = [
    "AGI_articulations",
    "AGI_stk_metadata",
    "CESIUM_primitive_outline",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_edge_visibility",
    "FB_ngon_encoding",
    "FB_ngon_triangulation",
    "GODOT_single_root",
    "GRIFFEL_bim_data",
    "KHR_character",
    "KHR_implicit_shapes",
    "KHR_mesh_annotation",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_techniques_webgl",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MOZ_hubs_components",
    "NEEDLE_components",
    "NEEDLE_gameobject_data",
    "OMI_link",
    "OMI_personality",
    "OMI_seat",
    "OMI_spawn_point",
];

/// Parts of the names of extensions that only change how a surface looks (a cut-out's own texture is looked at where it
/// is read), sound or move, or that say what something is.
const HARMLESS_PARTS: [&str; 13] = [
    "_materials_",
    "_texture_",
    "_packing_",
    "_audio",
    "_animation",
    "_physics",
    "_rigid_bodies",
    "_collision_",
    "_collider",
    "_interactivity",
    "_structural_metadata",
    "_feature_metadata",
    "_geometry_metadata",
];

fn has_no_part(name: &str) -> bool {
    WITHOUT_A_PART.contains(&name) || HARMLESS_PARTS.iter().any(|part| name.contains(part))
}

/// An error for the first extension that is required and neither read nor without a part.
pub(super) fn check_required(document: &Document) -> Checked<()> {
    for name in &document.root.extensions_required {
        if READ.contains(&name.as_str()) || has_no_part(name) {
            continue;
        }
        let is_compression = COMPRESSED.contains(&name.as_str());
        let cure = if is_compression { DECOMPRESS } else { "export it without that extension" };
        return Err(Fault::unsupported("extensionsRequired", format!("\"{name}\" is not read"), cure));
    }
    Ok(())
}

/// One line for all extensions that are used and not read, though they may have a part in the picture.
pub(super) fn note_unread(names: &BTreeSet<String>, notes: &mut Vec<String>) {
    let is_unread = |name: &&String| {
        !READ.contains(&name.as_str()) && !COMPRESSED.contains(&name.as_str()) && !has_no_part(name)
    };
    let unread: Vec<&str> = names.iter().filter(is_unread).map(String::as_str).collect();
    if !unread.is_empty() {
        notes.push(format!("extensions that are not read: {}", unread.join(", ")));
    }
}
