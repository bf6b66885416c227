//! Nothing is dropped in silence: every extension and every feature that the schemas know is done, refused or noted.
//!
//! What is expected stands here, by name, beside the loader's own tables: a name that changes sides there fails here.

use scatter_scene::load_scene;
use serde_json::{Value, json};

use crate::common::{Asset, F32, f32_bytes};

/// What must come of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// Read, or without a part in the picture: it loads, and nobody is told.
    Silent,
    /// It loads with one line that holds this text.
    Noted(&'static str),
    /// An error that holds this text.
    Refused(&'static str),
}

use Fate::{Noted, Refused, Silent};

fn triangle() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    asset.placed(json!({"attributes": {"POSITION": positions}}));
    asset
}

#[track_caller]
fn check(what: &str, asset: &Asset, fate: Fate) {
    let loaded = asset.load();
    let found = match &loaded {
        Ok(scene) => format!("loads, {:?}", scene.notes),
        Err(error) => error.to_string(),
    };
    let is_right = match (fate, &loaded) {
        (Silent, Ok(scene)) => scene.notes.is_empty(),
        (Noted(part), Ok(scene)) => scene.notes.len() == 1 && scene.notes[0].contains(part),
        (Refused(part), Err(error)) => error.to_string().contains(part),
        _ => false,
    };
    assert!(is_right, "{what} should be {fate:?}: {found}");
}

/// Extensions that are read.
const READ: [&str; 9] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Extensions that can move, hide or make nothing that throws a shadow.
const HARMLESS: [&str; 60] = [
    "ADOBE_materials_clearcoat_specular",
    "ADOBE_materials_clearcoat_tint",
    "ADOBE_materials_thin_transparency",
    "AGI_articulations",
    "AGI_stk_metadata",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_property_animation",
    "EXT_structural_metadata",
    "EXT_texture_avif",
    "EXT_texture_procedurals_mx_1_39",
    "EXT_texture_webp",
    "FB_geometry_metadata",
    "GODOT_single_root",
    "GRIFFEL_bim_data",
    "KHR_animation_pointer",
    "KHR_audio",
    "KHR_audio_emitter",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_rigid_bodies",
    "KHR_techniques_webgl",
    "KHR_texture_basisu",
    "KHR_texture_procedurals",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MOZ_hubs_components",
    "MPEG_audio_spatial",
    "MPEG_texture_video",
    "MSFT_audio_emitter",
    "MSFT_collision_primitives",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
    "MSFT_physics_rigid_bodies",
    "MSFT_texture_dds",
    "NEEDLE_components",
    "NV_materials_mdl",
    "OMI_collider",
    "OMI_link",
    "OMI_physics_body",
    "OMI_physics_shape",
    "OMI_seat",
    "OMI_spawn_point",
    "VRMC_materials_mtoon",
];

/// Extensions that may change geometry, cameras or lights and are not read, and names that nobody knows.
const UNREAD: [&str; 19] = [
    "CESIUM_RTC",
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "EXT_primitive_voxels",
    "EXT_unheard_of",
    "KHR_accessor_float64",
    "KHR_gaussian_splatting",
    "KHR_lights_environment",
    "MPEG_accessor_timed",
    "MPEG_buffer_circular",
    "MPEG_media",
    "MPEG_mesh_linking",
    "MPEG_viewport_recommended",
    "MSFT_lod",
    "VRM",
    "VRMC_node_constraint",
    "VRMC_springBone",
    "VRMC_vrm",
    "WEB3D_quantized_attributes",
];

const COMPRESSED: [&str; 3] =
    ["EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_meshopt_compression"];

#[test]
fn every_extension_is_read_harmless_noted_or_refused() {
    let known = READ.iter().chain(&HARMLESS).chain(&COMPRESSED).map(|&name| (name, Silent));
    for (name, used) in known.chain(UNREAD.iter().map(|&name| (name, Noted(name)))) {
        let mut asset = triangle();
        asset.json["extensionsUsed"] = json!([name]);
        check(&format!("{name}, used"), &asset, used);
        // Used without saying so.
        if UNREAD.contains(&name) {
            let mut asset = triangle();
            asset.json["nodes"][0]["extensions"] = json!({name: {}});
            check(&format!("{name}, unsaid"), &asset, used);
        }
        asset.json["extensionsRequired"] = json!([name]);
        let required =
            if UNREAD.contains(&name) || COMPRESSED.contains(&name) { Refused(name) } else { Silent };
        check(&format!("{name}, required"), &asset, required);
    }
    // Those that the crate's schema was built with are among them.
    for name in gltf::json::extensions::ENABLED_EXTENSIONS {
        assert!(READ.contains(name) || HARMLESS.contains(name), "{name} is not on a list");
    }
    // Several are one line.
    let mut asset = triangle();
    asset.json["extensionsUsed"] = json!(["MSFT_lod", "EXT_lights_ies", "KHR_xmp"]);
    check("two", &asset, Noted("EXT_lights_ies, MSFT_lod"));
}

#[test]
fn every_property_of_primitives_nodes_and_lights_is_read_noted_or_refused() {
    type Change = fn(&mut Asset);
    fn primitive(asset: &mut Asset) -> &mut Value {
        &mut asset.json["meshes"][0]["primitives"][0]
    }
    /// Beside the triangle that is drawn: another primitive of that mode.
    fn with_mode(asset: &mut Asset, mode: u64) {
        asset.placed(json!({"attributes": {"POSITION": 0}, "mode": mode}));
    }
    fn with_light(asset: &mut Asset, light: Value) {
        asset.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([light]);
        asset.json["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(0);
    }
    let cases: &[(&str, Change, Fate)] = &[
        ("points", |a| with_mode(a, 0), Noted("1 point primitives")),
        ("lines", |a| with_mode(a, 1), Noted("1 line primitives")),
        ("line loop", |a| with_mode(a, 2), Noted("1 line primitives")),
        ("line strip", |a| with_mode(a, 3), Noted("1 line primitives")),
        ("triangles", |a| with_mode(a, 4), Silent),
        ("triangle strip", |a| with_mode(a, 5), Silent),
        ("triangle fan", |a| with_mode(a, 6), Silent),
        ("mode 7", |a| with_mode(a, 7), Refused("mode 7")),
        ("mode 2^32 + 4", |a| with_mode(a, (1 << 32) + 4), Refused("mode 4294967300")),
        ("normals", |a| primitive(a)["attributes"]["NORMAL"] = json!(0), Silent),
        ("own attributes", |a| primitive(a)["attributes"]["_BATCHID"] = json!(0), Silent),
        ("colours", |a| primitive(a)["attributes"]["COLOR_0"] = json!(0), Silent),
        ("targets", |a| primitive(a)["targets"] = json!([{"POSITION": 0}]), Silent),
        (
            "moved texture coordinates",
            |a| {
                primitive(a)["targets"] = json!([{"TEXCOORD_0": 0}]);
                a.json["meshes"][0]["weights"] = json!([1]);
            },
            Noted("morph targets for texture coordinates"),
        ),
        ("no material", |a| primitive(a)["material"] = json!(3), Refused("material 3")),
        ("an animation", |a| a.json["animations"] = json!([{}]), Noted("1 animations are ignored")),
        (
            "an incomplete triangle",
            |a| {
                let view =
                    a.view(&f32_bytes(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), None);
                let positions = a.accessor(view, F32, "VEC3", 4);
                primitive(a)["attributes"]["POSITION"] = json!(positions);
            },
            Noted("incomplete triangle"),
        ),
        ("a skin that is not there", |a| a.json["nodes"][0]["skin"] = json!(0), Refused("skins[0]")),
        ("a sun", |a| with_light(a, json!({"type": "directional"})), Silent),
        ("a lamp", |a| with_light(a, json!({"type": "point", "color": [1, 0, 0], "intensity": 2})), Silent),
        ("a spot", |a| with_light(a, json!({"type": "spot", "spot": {}})), Silent),
        (
            "a range",
            |a| with_light(a, json!({"type": "point", "range": 2, "name": "L"})),
            Noted("light \"L\" has a range of 2"),
        ),
        ("a sun's range", |a| with_light(a, json!({"type": "directional", "range": 2})), Silent),
        ("an area light", |a| with_light(a, json!({"type": "area"})), Refused("light type \"area\"")),
        (
            "a hidden node",
            |a| {
                a.root_node(json!({"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}));
            },
            Silent,
        ),
    ];
    for &(what, change, fate) in cases {
        let mut asset = triangle();
        change(&mut asset);
        check(what, &asset, fate);
    }
}

#[test]
fn every_statement_of_obj_and_mtl_is_read_noted_or_without_a_part() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let notes = |statement: &str, library: &str| {
        std::fs::write(folder.path().join("a.mtl"), format!("newmtl m\n{library}\n")).unwrap();
        let text = format!(
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl m\nf 1 2 3\n{statement}\n"
        );
        std::fs::write(&path, text).unwrap();
        load_scene(&path).unwrap().notes
    };
    for statement in [
        "vn 0 0 1",
        "vt 0 0 0",
        "vp 0 0",
        "g a b",
        "o x",
        "s off",
        "s 1",
        "mg 1 2",
        "bevel on",
        "c_interp off",
        "d_interp off",
        "lod 1",
        "usemtl m",
        "deg 3",
        "cstype bezier",
        "parm u 0 1",
        "end",
        "# x",
        "unheard of",
    ] {
        assert!(notes(statement, "").is_empty(), "{statement}: {:?}", notes(statement, ""));
    }
    for (statement, part) in [
        ("p 1 2", "1 point elements"),
        ("l 1 2", "1 line elements"),
        ("f 1 2", "1 line elements"),
        ("curv 0 1 1 2", "1 free-form"),
        ("surf 0 1 0 1 1 2 3", "1 free-form"),
        ("call other.obj", "1 other files"),
        ("f 1 1 2", "1 triangles that repeat"),
        ("mtllib none.mtl", "material library none.mtl"),
        ("usemtl n", "materials that no library has count as opaque: n"),
    ] {
        let notes = notes(statement, "");
        assert!(notes.len() == 1 && notes[0].contains(part), "{statement}: {notes:?}");
    }
    for library in [
        "Ka 0 0 0",
        "Kd 1 1 1",
        "Ks 1 1 1",
        "Ke 0 0 0",
        "Tf 1 1 1",
        "Ns 10",
        "Ni 1.5",
        "sharpness 60",
        "d 1",
        "Tr 0",
        "illum 2",
        "map_Ka x.png",
        "map_Ks x.png",
        "map_Ns x.png",
        "bump x.png",
        "disp x.png",
        "decal x.png",
        "refl -type sphere x.png",
        "Pr 0.5",
        "Pm 0",
        "norm x.png",
        "aniso 0",
    ] {
        assert!(notes("", library).is_empty(), "{library}: {:?}", notes("", library));
    }
    for (library, part) in [
        ("d 0.5", "material \"m\" lets light through"),
        ("d -halo 0.5", "material \"m\" lets light through"),
        ("Tr 0.5", "material \"m\" lets light through"),
        ("illum 4", "material \"m\" is glass"),
        ("map_d x.png", "material \"m\" is a cut-out"),
        ("map_Kd x.png", "x.png"),
    ] {
        let notes = notes("", library);
        assert!(notes.len() == 1 && notes[0].contains(part), "{library}: {notes:?}");
    }
}
