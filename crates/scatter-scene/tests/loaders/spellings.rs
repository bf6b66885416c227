//! Files as other exporters spell them: what JavaScript readers take, what is compressed, what is old.

use glam::DVec3;
use serde_json::{Value, json};

use crate::common::{Asset, load_bytes};

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn triangle() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let indices = asset.indices(crate::common::U16, &[0, 1, 2]);
    asset.placed(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    asset
}

/// Every integer as a number with a fraction, recursively.
fn with_fractions(value: &mut Value) {
    match value {
        Value::Object(map) => map.values_mut().for_each(with_fractions),
        Value::Array(list) => list.iter_mut().for_each(with_fractions),
        Value::Number(number) => *value = json!(number.as_f64().unwrap()),
        _ => {}
    }
}

#[test]
fn integers_with_fractions_and_nulls_are_what_they_stand_for() {
    let expected = triangle().load().unwrap();
    let mut asset = triangle();
    with_fractions(&mut asset.json);
    assert!(asset.json.to_string().contains("\"count\":3.0"));
    assert_eq!(asset.load().unwrap().positions, expected.positions);
    let mut asset = triangle();
    for (table, keys) in [
        (
            "nodes",
            ["name", "children", "matrix", "translation", "rotation", "skin", "weights", "extensions"]
                .as_slice(),
        ),
        ("meshes", &["name", "weights", "extras"]),
        ("accessors", &["byteOffset", "normalized", "sparse", "min", "max"]),
        ("bufferViews", &["byteStride", "target", "name"]),
        ("buffers", &["uri", "extensions"]),
        ("scenes", &["name", "extras"]),
    ] {
        for key in keys {
            asset.json[table][0][key] = Value::Null;
        }
    }
    for key in
        ["cameras", "materials", "skins", "extensionsUsed", "extensionsRequired", "animations", "extensions"]
    {
        asset.json[key] = Value::Null;
    }
    asset.json["meshes"][0]["primitives"][0]["mode"] = Value::Null;
    asset.json["meshes"][0]["primitives"][0]["material"] = Value::Null;
    assert_eq!(asset.load().unwrap().positions, expected.positions);
    // A version that is a number, a name in Latin-1, minus zero, a flag that is a number, zeros after the text.
    let mut asset = triangle();
    asset.json["asset"]["version"] = json!(2.0);
    asset.json["nodes"][0]["name"] = json!("caf?");
    asset.json["nodes"][0]["mesh"] = json!(-0.0);
    asset.json["accessors"][0]["normalized"] = json!(0);
    let mut json = asset.json.to_string().into_bytes();
    let at = json.windows(4).position(|w| w == b"caf?").unwrap();
    json[at + 3] = 0xe9;
    json.extend([0; 3]);
    assert_eq!(
        load_bytes("a.glb", &crate::common::glb(&json, &asset.bin)).unwrap().positions,
        expected.positions
    );
    // What is needed is still needed, and the place is that of the file.
    let mut asset = triangle();
    asset.json["accessors"][0]["count"] = json!(3.5);
    let message = asset.message();
    assert!(message.contains("JSON line 1 column ") && message.contains("accessors[0].count: "), "{message}");
}

#[test]
fn the_place_of_a_wrong_value_is_its_line_and_column_in_the_file() {
    let text =
        "{\"asset\": {\"version\": \"2.0\"},\n \"nodes\": [{},\n  {\"name\": \"\u{e9}\", \"mesh\": -1}]}";
    let message = load_bytes("a.gltf", text.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("a.gltf: JSON line 3 column 25: nodes[1].mesh: "), "{message}");
}

#[test]
fn last_rows_of_rounded_matrices_and_zero_strides_are_taken() {
    let expected = triangle().load().unwrap().positions;
    for row in [[0.0, 0.0, 0.0, 0.9999999], [0.0, 0.0, 0.0, 1.0000001], [1e-8, -1e-7, 0.0, 1.0]] {
        let mut asset = triangle();
        let [a, b, c, d] = row;
        asset.json["nodes"][0]["matrix"] = json!([1, 0, 0, a, 0, 1, 0, b, 0, 0, 1, c, 0, 0, 0, d]);
        assert_eq!(asset.load().unwrap().positions, expected);
        asset.json["nodes"][0]["matrix"][11] = json!(0.01);
        assert!(asset.message().contains("not affine"));
    }
    let mut asset = triangle();
    asset.json["bufferViews"][0]["byteStride"] = json!(0);
    asset.json["bufferViews"][1]["byteStride"] = json!(0);
    assert_eq!(asset.load().unwrap().positions, expected);
}

#[test]
fn a_child_that_is_listed_as_a_root_is_taken_once_under_its_parent() {
    let mut asset = triangle();
    asset.json["nodes"] = json!([{"mesh": 0}, {"children": [0], "translation": [0, 0, 4]}]);
    asset.json["scenes"][0]["nodes"] = json!([0, 1]);
    let scene = asset.load().unwrap();
    assert_eq!(scene.positions[0], DVec3::new(0.0, 0.0, 4.0));
    assert_eq!(scene.triangles.len(), 1);
    assert!(scene.notes[0].contains("beside their parents"), "{:?}", scene.notes);
    asset.json["scenes"][0]["nodes"] = json!([0]);
    let scene = asset.load().unwrap();
    assert_eq!(scene.positions[0], DVec3::ZERO);
    assert!(scene.notes[0].contains("without its parent"), "{:?}", scene.notes);
}

#[test]
fn compressed_geometry_is_told_by_its_name_unless_a_plain_form_is_there() {
    for (required, has_view) in [(false, false), (false, true), (true, true)] {
        let mut asset = triangle();
        asset.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
        asset.json["meshes"][0]["primitives"][0]["extensions"] =
            json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
        if required {
            asset.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        }
        if !has_view {
            asset.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        }
        if has_view && !required {
            assert_eq!(asset.load().unwrap().triangles.len(), 1);
        } else {
            let message = asset.message();
            assert!(
                message.contains("KHR_draco_mesh_compression")
                    && message.contains("without mesh compression"),
                "{message}"
            );
        }
    }
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut asset = triangle();
        asset.json["bufferViews"][0]["extensions"][name] = json!({"buffer": 0, "byteLength": 9});
        assert_eq!(asset.load().unwrap().triangles.len(), 1, "the plain form is there");
        let plain =
            asset.push("buffers", json!({"byteLength": 900, "extensions": {name: {"fallback": true}}}));
        asset.json["bufferViews"][0]["buffer"] = json!(plain);
        let message = asset.message();
        assert!(
            message.contains(&format!("bufferViews[0]: it is compressed with {name}"))
                && message.contains("without mesh compression"),
            "{message}"
        );
    }
}

#[test]
fn files_of_the_first_version_and_wide_encodings_are_told() {
    for text in [
        json!({"asset": {"version": "1.0"}, "meshes": {}}),
        json!({"asset": {"version": "1.1", "profile": {}}, "nodes": {"a": {}}}),
        json!({"meshes": {"a": {}}, "buffers": {"b": {"type": "arraybuffer"}}}),
        json!({"asset": {"generator": "collada2gltf"}, "nodes": {}}),
    ] {
        let message = load_bytes("old.gltf", text.to_string().as_bytes()).unwrap_err().to_string();
        assert!(message.contains("glTF 1.0") && message.ends_with("; export it as glTF 2.0"), "{message}");
    }
    let message = load_bytes("old.glb", b"glTF\x01\0\0\0\x20\0\0\0\0\0\0\0\0\0\0\0").unwrap_err().to_string();
    assert!(message.contains("glTF 1.0"), "{message}");
    let wide: Vec<u8> = "\u{feff}{}".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = load_bytes("wide.gltf", &wide).unwrap_err().to_string();
    assert!(message.contains("UTF-16"), "{message}");
}

#[test]
fn tables_that_nobody_reads_cannot_cost_the_file() {
    let mut asset = triangle();
    asset.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1}}]);
    asset.json["materials"] =
        json!([{"emissiveFactor": [1], "normalTexture": {"scale": "x"}, "doubleSided": 1}]);
    asset.json["samplers"] = json!([{"magFilter": "LINEAR"}]);
    asset.json["animations"] = json!([{"channels": 3}]);
    asset.json["scenes"].as_array_mut().unwrap().push(json!({}));
    asset.json["meshes"].as_array_mut().unwrap().push(json!({"name": "empty"}));
    asset.json["meshes"].as_array_mut().unwrap().push(json!({"primitives": [{}]}));
    asset.json["nodes"][0]["extras"] = json!({"mesh": -1, "count": null});
    asset.json["nodes"].as_array_mut().unwrap().push(json!({"mesh": 1}));
    asset.json["nodes"].as_array_mut().unwrap().push(json!({"mesh": 2}));
    asset.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let scene = asset.load().unwrap();
    assert_eq!((scene.triangles.len(), scene.notes.len()), (1, 1), "{:?}", scene.notes);
}
