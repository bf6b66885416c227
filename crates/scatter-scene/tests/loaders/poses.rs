//! Where skins, morph targets, instances and hidden nodes put a mesh, by hand.

use glam::DVec3;
use serde_json::{Value, json};

use crate::common::{Asset, F32, I8, I16, U8, U16, f32_bytes};

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn floats(asset: &mut Asset, kind: &str, values: &[f32]) -> usize {
    let width = match kind {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 16,
    };
    let view = asset.view(&f32_bytes(values), None);
    asset.accessor(view, F32, kind, values.len() / width)
}

/// A triangle whose corners hang on joints 0, 1 and both, with those inverse bind matrices' translations.
fn skinned() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let view = asset.view(&[0, 9, 9, 9, 1, 0, 0, 0, 0, 1, 0, 0], None);
    let joints = asset.accessor(view, U8, "VEC4", 3);
    let weights = floats(&mut asset, "VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 0.25, 0.75, 0., 0.]);
    // Joint 0 as it is, joint 1 bound 3 units up.
    let mut binds = [glam::Mat4::IDENTITY.to_cols_array(), glam::Mat4::IDENTITY.to_cols_array()];
    binds[1][13] = -3.0;
    let binds = floats(&mut asset, "MAT4", binds.as_flattened());
    let mesh = asset.mesh(json!({
        "attributes": {"POSITION": positions, "JOINTS_0": joints, "WEIGHTS_0": weights}
    }));
    let second = asset.push("nodes", json!({"translation": [0, 3, 0], "rotation": [0, 0, 1, 0]}));
    let first = asset.root_node(json!({"translation": [10, 0, 0], "children": [second]}));
    asset.push("skins", json!({"joints": [first, second], "inverseBindMatrices": binds}));
    let node = asset.push("nodes", json!({"mesh": mesh, "skin": 0, "translation": [0, 500, 0]}));
    asset.root_node(json!({"children": [node], "scale": [0.01, 0.01, 0.01]}));
    asset
}

#[test]
fn joints_decide_where_a_skinned_mesh_stands_and_its_node_does_not() {
    let scene = skinned().load().unwrap();
    // Joint 1 is at (10, 3, 0), turned by half a turn about z: (x, y, z) → (10 − x, 6 − y, z) after its bind.
    let wanted =
        [DVec3::new(10.0, 0.0, 0.0), DVec3::new(9.0, 6.0, 0.0), DVec3::new(10.0, 0.25 + 0.75 * 5.0, 0.0)];
    for (found, wanted) in scene.positions.iter().zip(wanted) {
        assert!((*found - wanted).length() < 1e-12, "{found} {wanted}");
    }
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    // Joints need not be in the scene.
    let mut asset = skinned();
    asset.json["scenes"][0]["nodes"] = json!([3]);
    assert_eq!(asset.load().unwrap().positions, scene.positions);
}

#[test]
fn weights_may_be_integers_or_of_another_sum_and_binds_may_lack() {
    let mut asset = skinned();
    let shorts = |values: [u16; 12]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    // A quarter and three quarters, of a sum of 60000.
    let view = asset.view(&shorts([65535, 0, 0, 0, 1, 0, 0, 0, 15000, 45000, 0, 0]), None);
    let weights = asset.accessor(view, U16, "VEC4", 3);
    let view = asset.view(&shorts([0, 9, 9, 9, 1, 0, 0, 0, 0, 1, 0, 0]), None);
    let joints = asset.accessor(view, U16, "VEC4", 3);
    let attributes = &mut asset.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["WEIGHTS_0"] = json!(weights);
    attributes["JOINTS_0"] = json!(joints);
    let expected = skinned().load().unwrap().positions;
    for (found, wanted) in asset.load().unwrap().positions.iter().zip(&expected) {
        assert!((*found - *wanted).length() < 1e-12, "{found} {wanted}");
    }
    asset.json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    assert_eq!(asset.load().unwrap().positions[0], DVec3::new(10.0, 0.0, 0.0));
    // A vertex of no weight follows its first joint.
    let mut asset = skinned();
    let none = floats(&mut asset, "VEC4", &[0.0; 12]);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(none);
    assert!((asset.load().unwrap().positions[1] - DVec3::new(9.0, 6.0, 0.0)).length() < 1e-12);
}

#[test]
fn damaged_skins_are_refused_and_meshes_without_joints_are_noted() {
    type Change = fn(&mut Asset);
    let cases: [(Change, &str); 5] = [
        (|a| a.json["nodes"][2]["skin"] = json!(4), "skins[4]: the asset has 1 skins"),
        (|a| a.json["skins"][0]["joints"] = json!([0, 77]), "skins[0]: joint 77"),
        (|a| a.json["skins"][0]["joints"] = json!([0, 1, 0]), "3 joints, but 2 inverse bind matrices"),
        (|a| a.json["skins"][0]["joints"] = json!([0]), "joint 1, but its skin has 1 joints"),
        (|a| a.json["accessors"][1]["count"] = json!(2), "fewer joints or weights"),
    ];
    for (change, part) in cases {
        let mut asset = skinned();
        change(&mut asset);
        let message = asset.message();
        assert!(message.contains(part), "{part}: {message}");
    }
    let mut asset = skinned();
    asset.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
    let scene = asset.load().unwrap();
    assert!(scene.notes[0].starts_with("1 primitives of skinned meshes name no joints"), "{:?}", scene.notes);
    assert_eq!(scene.positions[0], DVec3::new(0.0, 5.0, 0.0));
}

#[test]
fn morph_targets_stand_at_the_nodes_weights_or_else_at_the_meshs() {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let first = asset.positions(&[[0.0, 0.0, 2.0]; 3]);
    // The second target moves one corner, in bytes, without a view behind the others.
    let indices = asset.view(&[1], None);
    let values = asset.view(&[64, 0, 0], None);
    let second = asset.push(
        "accessors",
        json!({"componentType": I8, "type": "VEC3", "count": 3, "sparse": {"count": 1,
            "indices": {"bufferView": indices, "componentType": U8}, "values": {"bufferView": values}}}),
    );
    let mesh = asset.push(
        "meshes",
        json!({"weights": [0.5, 0.25], "primitives": [{
            "attributes": {"POSITION": positions}, "targets": [{"POSITION": first}, {"POSITION": second}]
        }]}),
    );
    asset.root_node(json!({"mesh": mesh}));
    asset.root_node(json!({"mesh": mesh, "weights": [0, 1]}));
    asset.root_node(json!({"mesh": mesh}));
    let positions = asset.load().unwrap().positions;
    assert_eq!(positions[..3], [DVec3::Z, DVec3::new(17.0, 0.0, 1.0), DVec3::new(0.0, 1.0, 1.0)]);
    assert_eq!(positions[3..6], [DVec3::ZERO, DVec3::new(65.0, 0.0, 0.0), DVec3::Y]);
    assert_eq!(positions[6..], positions[..3]);
    asset.json["accessors"][first]["count"] = json!(2);
    assert!(asset.message().contains("meshes[0].primitives[0]: 3 positions, but 2 in morph target 0"));
    // Of weight zero it does not matter, and without weights there are none.
    asset.json["meshes"][0]["weights"] = json!([0, 0]);
    assert_eq!(asset.load().unwrap().positions[0], DVec3::ZERO);
}

#[test]
fn morphs_come_before_skins() {
    let mut asset = skinned();
    let target = asset.positions(&[[2.0, 0.0, 0.0]; 3]);
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    asset.json["meshes"][0]["weights"] = json!([1]);
    let positions = asset.load().unwrap().positions;
    assert!((positions[0] - DVec3::new(12.0, 0.0, 0.0)).length() < 1e-12);
    // The second joint turns the displacement.
    assert!((positions[1] - DVec3::new(7.0, 6.0, 0.0)).length() < 1e-12, "{}", positions[1]);
}

#[test]
fn instances_stand_where_their_attributes_put_them_under_their_node() {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let mesh = asset.mesh(json!({"attributes": {"POSITION": positions}}));
    let translations = floats(&mut asset, "VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    let scales = floats(&mut asset, "VEC3", &[1.0, 1.0, 1.0, 2.0, 3.0, 1.0]);
    // A quarter turn about z as normalised shorts: 23170/32767 is √½ up to rounding, and is normalised.
    let shorts: Vec<u8> =
        [0i16, 0, 0, 32767, 0, 0, 23170, 23170].iter().flat_map(|v| v.to_le_bytes()).collect();
    let view = asset.view(&shorts, None);
    let rotations = asset.accessor(view, I16, "VEC4", 2);
    asset.json["accessors"][rotations]["normalized"] = json!(true);
    let extension = json!({"EXT_mesh_gpu_instancing": {"attributes": {
        "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": 99
    }}});
    asset.root_node(json!({"mesh": mesh, "translation": [0, 0, 7], "extensions": extension}));
    let scene = asset.load().unwrap();
    assert_eq!(scene.triangles.len(), 2);
    // (x, y) → (2x, 3y) → (−3y, 2x) → + (5, 0).
    let wanted = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::new(5.0, 0.0, 0.0),
        DVec3::new(5.0, 2.0, 0.0),
        DVec3::new(2.0, 0.0, 0.0),
    ];
    for (found, wanted) in scene.positions.iter().zip(wanted) {
        assert!((*found - wanted - 7.0 * DVec3::Z).length() < 1e-14, "{found} {wanted}");
    }
    asset.json["accessors"][scales]["count"] = json!(1);
    assert!(asset.message().contains("differ in their counts"));
    asset.json["accessors"][scales] =
        json!({"componentType": F32, "type": "VEC3", "count": 4_000_000_000u64});
    asset.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": scales}}});
    assert!(asset.message().contains("limit"), "{}", asset.message());
    asset.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {}});
    assert!(asset.message().contains("no attributes"));
}

#[test]
fn hidden_nodes_hide_what_is_below_them_but_for_cameras() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let mesh = asset.mesh(json!({"attributes": {"POSITION": positions}}));
    asset.root_node(json!({"mesh": mesh}));
    asset.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1}}));
    asset.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "point"}]);
    let shown = json!({"KHR_lights_punctual": {"light": 0}, "KHR_node_visibility": {"visible": true}});
    let child = asset.push("nodes", json!({"mesh": mesh, "camera": 0, "extensions": shown}));
    let parent = asset.root_node(json!({"children": [child], "extensions": hidden}));
    asset.json["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual"]);
    let counts = |asset: &Asset| {
        let scene = asset.load().unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        (scene.triangles.len(), scene.cameras.len(), scene.lights.len())
    };
    assert_eq!(counts(&asset), (1, 1, 0));
    asset.json["nodes"][parent]["extensions"] = Value::Null;
    assert_eq!(counts(&asset), (2, 1, 1));
    asset.json["nodes"][0]["extensions"] = hidden;
    assert_eq!(counts(&asset), (1, 1, 1));
}
