//! glTF and GLB through `load_scene`: hand-built files against values computed by hand, and against other readers.

use crate::common::{Asset, F32, I8, I16, U8, U16, U32, base64, f32_bytes, load_bytes, shared_folder};
use glam::{DMat4, DVec3};
use scatter_scene::{SceneLens, SceneLightKind, load_scene};
use serde_json::json;

const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// Rounding of a few f64 operations on numbers below 10.
const ROUNDING: f64 = 1e-14;

fn triangle_asset() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    asset.placed(json!({"attributes": {"POSITION": positions}}));
    asset
}

fn near(p: DVec3, x: f64, y: f64, z: f64) {
    assert!((p - DVec3::new(x, y, z)).length() < ROUNDING, "{p} is not ({x}, {y}, {z})");
}

#[test]
fn a_non_indexed_triangle_loads_as_it_is() {
    let scene = triangle_asset().load().unwrap();
    assert_eq!(scene.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(scene.triangles, [[0, 1, 2]]);
    assert!(scene.notes.is_empty());
}

#[test]
fn nested_rotation_non_uniform_scale_and_mirror_compose_as_by_hand() {
    let mut asset = Asset::new();
    let positions = asset.positions(&[[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    let mesh = asset.mesh(json!({"attributes": {"POSITION": positions}}));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let child = asset.push(
        "nodes",
        json!({"mesh": mesh, "scale": [2, 3, -1], "rotation": [0, half, 0, half], "translation": [10, 0, 0]}),
    );
    // Half of a right angle's turn about z, moved by 5 along z; columns.
    let matrix = json!([0, 0.5, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 5, 1]);
    asset.root_node(json!({"children": [child], "matrix": matrix}));
    let scene = asset.load().unwrap();
    // (1,2,3) scaled (2,6,−3), turned about y (−3,6,−2), moved (7,6,−2), turned and halved (−3,3.5,−1), moved.
    near(scene.positions[0], -3.0, 3.5, 4.0);
    // The origin: (10,0,0), then (0,5,0), moved.
    near(scene.positions[1], 0.0, 5.0, 5.0);
    // (0,0,1): (0,0,−1), (−1,0,0), (9,0,0), (0,4.5,0), moved.
    near(scene.positions[2], 0.0, 4.5, 5.0);
}

#[test]
fn node_numbers_are_the_nearest_f64_to_their_decimals() {
    let mut asset = triangle_asset();
    asset.json["nodes"][0]["translation"] = json!([0.1, 123456.789, 1e-9]);
    assert_eq!(asset.load().unwrap().positions[0], DVec3::new(0.1, 123456.789, 1e-9));
    asset.json["nodes"][0] = json!({"mesh": 0, "scale": [0.3, 1, 1], "rotation": [0, 0, 0, 0.5]});
    assert_eq!(asset.load().unwrap().positions[1], DVec3::new(0.3, 0.0, 0.0));
}

#[test]
fn all_index_types_mean_the_same() {
    for component in [U8, U16, U32] {
        let mut asset = Asset::new();
        let positions = asset.positions(&[[9.0, 9.0, 9.0], TRIANGLE[0], TRIANGLE[1], TRIANGLE[2]]);
        let indices = asset.indices(component, &[2, 3, 1]);
        asset.placed(json!({"attributes": {"POSITION": positions}, "indices": indices}));
        let scene = asset.load().unwrap();
        // Only the vertices in use, in order of first use.
        assert_eq!(scene.positions, [DVec3::X, DVec3::Y, DVec3::ZERO], "{component}");
        assert_eq!(scene.triangles, [[0, 1, 2]]);
    }
}

#[test]
fn strips_and_fans_give_their_triangles_with_one_winding() {
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let fan = [square[0], square[1], square[3], square[2]];
    for (mode, positions, area) in [(5, square, 1.0), (6, fan, 1.0)] {
        let mut asset = Asset::new();
        let accessor = asset.positions(&positions);
        asset.placed(json!({"attributes": {"POSITION": accessor}, "mode": mode}));
        let scene = asset.load().unwrap();
        assert_eq!(scene.triangles.len(), 2);
        let areas = scene.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| scene.positions[i as usize]);
            0.5 * (b - a).cross(c - a).z
        });
        let areas: Vec<f64> = areas.collect();
        assert_eq!(areas, [0.5 * area; 2], "mode {mode}: both turn the same way");
    }
}

#[test]
fn a_strip_drops_the_triangles_that_only_join_it() {
    let mut asset = Asset::new();
    let positions =
        asset.positions(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 5.0, 0.0], [6.0, 5.0, 1.0]]);
    let indices = asset.indices(U16, &[0, 1, 2, 2, 3, 3, 4, 0]);
    asset.placed(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 5}));
    let scene = asset.load().unwrap();
    assert_eq!(scene.triangles.len(), 2);
    assert!(scene.notes[0].starts_with("4 triangles"), "{:?}", scene.notes);
}

#[test]
fn strided_elements_with_offsets_are_found() {
    let mut asset = Asset::new();
    let mut bytes = Vec::new();
    for p in TRIANGLE {
        bytes.extend([7u8; 4]);
        bytes.extend(f32_bytes(&p));
        bytes.extend([7u8; 4]);
    }
    // The last element is not followed by a whole stride.
    bytes.truncate(bytes.len() - 4);
    let view = asset.view(&bytes, Some(20));
    let accessor = asset.accessor(view, F32, "VEC3", 3);
    asset.json["accessors"][accessor]["byteOffset"] = json!(4);
    asset.placed(json!({"attributes": {"POSITION": accessor}}));
    assert_eq!(asset.load().unwrap().positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn quantised_positions_decode_as_the_extension_says() {
    let shorts: Vec<u8> =
        [-32768i16, 32767, 16384, 0, 1, -1, 2, 3, 4].iter().flat_map(|v| v.to_le_bytes()).collect();
    let bytes: Vec<u8> = [-128i8, 127, 64, 0, 1, -1, 2, 3, 4].iter().map(|&v| v as u8).collect();
    let cases = [
        (I16, shorts.clone(), true, [-1.0, 1.0, 16384.0 / 32767.0]),
        (I16, shorts.clone(), false, [-32768.0, 32767.0, 16384.0]),
        (U16, shorts, true, [32768.0 / 65535.0, 32767.0 / 65535.0, 16384.0 / 65535.0]),
        (I8, bytes.clone(), true, [-1.0, 1.0, 64.0 / 127.0]),
        (U8, bytes, false, [128.0, 127.0, 64.0]),
    ];
    for (component, bytes, normalized, expected) in cases {
        let mut asset = Asset::new();
        asset.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let view = asset.view(&bytes, None);
        let accessor = asset.accessor(view, component, "VEC3", 3);
        asset.json["accessors"][accessor]["normalized"] = json!(normalized);
        asset.placed(json!({"attributes": {"POSITION": accessor}}));
        assert_eq!(asset.load().unwrap().positions[0].to_array(), expected, "{component} {normalized}");
    }
}

#[test]
fn sparse_values_replace_elements_of_a_view_and_of_nothing() {
    for has_view in [true, false] {
        let mut asset = Asset::new();
        let accessor = asset.positions(&[[3.0; 3], [0.0, 2.0, 0.0], [0.0; 3], [0.0, 0.0, 4.0]]);
        let indices = asset.view(&[0, 2], None);
        let values = asset.view(&f32_bytes(&[5.0, 6.0, 7.0, 8.0, 9.0, 10.0]), None);
        asset.json["accessors"][accessor]["sparse"] = json!({
            "count": 2,
            "indices": {"bufferView": indices, "componentType": U8},
            "values": {"bufferView": values}
        });
        if !has_view {
            asset.json["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        }
        let indices = asset.indices(U8, &[0, 1, 2, 1, 2, 3]);
        asset.placed(json!({"attributes": {"POSITION": accessor}, "indices": indices}));
        let positions = asset.load().unwrap().positions;
        let base = if has_view { [2.0, 4.0] } else { [0.0, 0.0] };
        assert_eq!(
            positions,
            [
                DVec3::new(5.0, 6.0, 7.0),
                DVec3::new(0.0, base[0], 0.0),
                DVec3::new(8.0, 9.0, 10.0),
                DVec3::new(0.0, 0.0, base[1]),
            ]
        );
    }
}

#[test]
fn buffers_may_be_data_uris_files_beside_or_above_and_several() {
    let mut asset = triangle_asset();
    let bin = asset.bin.clone();
    let expected = asset.load().unwrap().positions;
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("sub/my mesh.bin"), &bin).unwrap();
    std::fs::write(folder.path().join("up.bin"), &bin).unwrap();
    let path = folder.path().join("sub/a.gltf");
    let data = format!("data:application/octet-stream;base64,{}", base64(&bin));
    for uri in [data.as_str(), "my%20mesh.bin", "../up.bin"] {
        asset.json["buffers"][0]["uri"] = json!(uri);
        std::fs::write(&path, asset.json.to_string()).unwrap();
        assert_eq!(load_scene(&path).unwrap().positions, expected, "{uri}");
    }
    asset.json["buffers"] =
        json!([{"byteLength": 1, "uri": "never-read.bin"}, {"byteLength": bin.len(), "uri": data}]);
    asset.json["bufferViews"][0]["buffer"] = json!(1);
    std::fs::write(&path, asset.json.to_string()).unwrap();
    assert_eq!(load_scene(&path).unwrap().positions, expected);
    for uri in ["https://example.org/a.bin", "/etc/passwd", "%2fetc/passwd", "none.bin"] {
        asset.json["buffers"][1]["uri"] = json!(uri);
        std::fs::write(&path, asset.json.to_string()).unwrap();
        let message = load_scene(&path).unwrap_err().to_string();
        assert!(message.contains("a.gltf: buffers[1].uri: "), "{message}");
    }
}

#[test]
fn instances_share_a_mesh_and_other_scenes_are_left_alone() {
    let mut asset = triangle_asset();
    asset.root_node(json!({"mesh": 0, "translation": [0, 0, 7]}));
    asset.push("nodes", json!({"mesh": 0}));
    let scene = asset.load().unwrap();
    assert_eq!(scene.triangles, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(scene.positions[3], DVec3::new(0.0, 0.0, 7.0));
    // Without a default scene the first one counts; without scenes every root does.
    asset.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(asset.load().unwrap().triangles.len(), 2);
    asset.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(asset.load().unwrap().triangles.len(), 3);
}

#[test]
fn cameras_and_lights_come_with_matrix_name_and_units() {
    let mut asset = triangle_asset();
    asset.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}));
    asset.push(
        "cameras",
        json!({"name": "o", "type": "orthographic", "orthographic": {"ymag": 2.5, "xmag": 1}}),
    );
    asset.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"type": "directional", "color": [1, 0.5, 0.25], "intensity": 4},
        {"type": "point", "name": "bulb"},
        {"type": "spot", "spot": {"outerConeAngle": 1.5707964}, "range": 3}
    ]);
    let light = |idx: usize| json!({"KHR_lights_punctual": {"light": idx}});
    asset.root_node(json!({"camera": 0, "translation": [1, 2, 3]}));
    asset.root_node(json!({"camera": 1}));
    asset.root_node(json!({"extensions": light(0), "name": "sun"}));
    asset.root_node(json!({"extensions": light(1)}));
    asset.root_node(json!({"extensions": light(2)}));
    let scene = asset.load().unwrap();
    assert_eq!(scene.cameras[0].name, "camera-0");
    assert_eq!(scene.cameras[0].lens, SceneLens::Perspective { vertical_fov: 0.9 });
    assert_eq!(scene.cameras[0].world_from_camera, DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(
        (scene.cameras[1].name.as_str(), scene.cameras[1].lens),
        ("o", SceneLens::Orthographic { height: 5.0 })
    );
    let lights: Vec<_> = scene.lights.iter().map(|l| (l.name.as_str(), l.strength, l.kind)).collect();
    assert_eq!(
        lights,
        [
            ("sun", [4.0, 2.0, 1.0], SceneLightKind::Directional),
            ("bulb", [1.0; 3], SceneLightKind::Point),
            // A right angle, though its f32 is rounded up.
            ("light-2", [1.0; 3], SceneLightKind::Spot { inner: 0.0, outer: std::f64::consts::FRAC_PI_2 }),
        ]
    );
}

#[test]
fn points_lines_skins_and_animations_are_noted() {
    let mut asset = triangle_asset();
    for mode in 0..4 {
        asset.placed(json!({"attributes": {"POSITION": 0}, "mode": mode}));
    }
    asset.json["nodes"][0]["skin"] = json!(0);
    asset.push("skins", json!({"joints": [0]}));
    asset.push("animations", json!({}));
    let scene = asset.load().unwrap();
    let notes = scene.notes.join("|");
    assert_eq!(scene.triangles.len(), 1);
    for part in ["1 point", "3 line", "1 primitives of skinned", "1 animations"] {
        assert!(notes.contains(part), "{notes}");
    }
}

#[test]
fn json_with_a_byte_order_mark_and_a_glb_named_gltf_load() {
    let asset = triangle_asset();
    assert!(load_bytes("x.gltf", &asset.glb()).is_ok());
    let mut json = asset.json.clone();
    json["buffers"][0]["uri"] = json!(format!("data:;base64,{}", base64(&asset.bin)));
    assert!(load_bytes("x.gltf", format!("\u{feff}{json}").as_bytes()).is_ok());
}

/// One change to a sound asset, and a part of the message that it must cause.
#[test]
fn malformed_assets_are_refused_with_the_place_that_is_wrong() {
    type Change = fn(&mut Asset);
    let cases: &[(Change, &str)] = &[
        (|a| a.json["accessors"][0]["count"] = json!(4), "accessors[0]: 4 elements"),
        (|a| a.json["accessors"][0]["count"] = json!(1000), "accessors[0]: 1000 elements"),
        (|a| a.json["accessors"][0]["count"] = json!(u64::MAX), "limit"),
        (|a| a.json["accessors"][0]["byteOffset"] = json!(u64::MAX), "accessors[0]"),
        (|a| a.json["accessors"][0]["type"] = json!("SCALAR"), "VEC3"),
        (|a| a.json["accessors"][0]["componentType"] = json!(U32), "component type 5125"),
        (|a| a.json["accessors"][0]["bufferView"] = json!(9), "bufferView 9"),
        (|a| a.json["bufferViews"][0]["byteLength"] = json!(u64::MAX), "bufferViews[0]"),
        (|a| a.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX), "bufferViews[0]"),
        (|a| a.json["bufferViews"][0]["byteStride"] = json!(8), "byteStride 8"),
        (|a| a.json["bufferViews"][0]["byteStride"] = json!(u64::MAX), "accessors[0]"),
        (|a| a.json["bufferViews"][0]["buffer"] = json!(1), "buffers[1]"),
        (|a| a.json["buffers"][0]["byteLength"] = json!(10_000), "byteLength is 10000"),
        (|a| a.json["nodes"][0]["mesh"] = json!(999), "nodes[0]: mesh 999"),
        (|a| a.json["nodes"][0]["mesh"] = json!(-1), "JSON line 1 column"),
        (|a| a.json["nodes"][0]["children"] = json!([0]), "nodes[0]: it is its own ancestor"),
        (|a| a.json["nodes"][0]["children"] = json!([7]), "child 7"),
        (|a| a.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), "zero quaternion"),
        (|a| a.json["nodes"][0]["scale"] = json!([1e200, 1e200, 1]), "farther"),
        (|a| a.json["nodes"][0]["matrix"] = json!(vec![0; 16]), "not affine"),
        (|a| a.json["scene"] = json!(3), "scenes[3]"),
        (|a| a.json["scenes"][0]["nodes"] = json!([0, 0]), "twice"),
        (|a| a.json["scenes"][0]["nodes"] = json!([5]), "node 5"),
        (|a| a.json["scenes"][0]["nodes"] = json!([]), "no triangles"),
        (|a| a.json["meshes"][0]["primitives"][0]["mode"] = json!(7), "mode 7"),
        (|a| a.json["meshes"][0]["primitives"][0]["indices"] = json!(0), "indices are VEC3"),
        (|a| a.json["meshes"][0]["primitives"][0]["indices"] = json!(8), "accessors[8]"),
        (|a| a.json["asset"]["version"] = json!("1.0"), "asset: version \"1.0\""),
        (
            |a| a.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "without mesh compression",
        ),
        (|a| a.json["extensionsRequired"] = json!(["EXT_unheard_of"]), "EXT_unheard_of"),
        (|a| a.json["nodes"][0]["camera"] = json!(0), "camera 0"),
        (|a| a.bin[3..7].copy_from_slice(&f32::NAN.to_le_bytes()), "POSITION[0]"),
        (|a| a.bin[3..7].copy_from_slice(&f32::MAX.to_le_bytes()), "farther"),
    ];
    for (change, part) in cases {
        let mut asset = triangle_asset();
        change(&mut asset);
        let message = asset.message();
        assert!(message.contains("built.glb: ") && message.contains(part), "{part}: {message}");
    }
}

#[test]
fn a_vertex_index_beyond_the_positions_is_refused() {
    let mut asset = Asset::new();
    let positions = asset.positions(&TRIANGLE);
    let indices = asset.indices(U32, &[0, 1, 3]);
    asset.placed(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    assert!(asset.message().contains("meshes[0].primitives[0]: vertex index 3"));
}

#[test]
fn bombs_are_refused_before_they_go_off() {
    // Zeros without a buffer: 3 · 10⁹ vertices from 200 bytes.
    let mut asset = Asset::new();
    asset.push("accessors", json!({"componentType": F32, "type": "VEC3", "count": 3_000_000_000u64}));
    asset.placed(json!({"attributes": {"POSITION": 0}}));
    assert!(asset.message().contains("1000000000 triangles"));
    // 10⁵ instances of a mesh of 10⁴ triangles.
    let mut asset = Asset::new();
    asset.push("accessors", json!({"componentType": F32, "type": "VEC3", "count": 30_000}));
    let mesh = asset.mesh(json!({"attributes": {"POSITION": 0}}));
    asset.json["nodes"] = json!(vec![json!({"mesh": mesh}); 100_000]);
    asset.json["scenes"][0]["nodes"] = json!((0..100_000).collect::<Vec<_>>());
    assert!(asset.message().contains("limit"));
}

#[test]
fn a_hierarchy_of_any_depth_is_walked() {
    const DEPTH: usize = 200_000;
    let mut asset = triangle_asset();
    let mut nodes = vec![json!({"mesh": 0})];
    nodes.extend((0..DEPTH).map(|child| json!({"children": [child], "translation": [1, 0, 0]})));
    asset.json["nodes"] = json!(nodes);
    asset.json["scenes"][0]["nodes"] = json!([DEPTH]);
    assert_eq!(asset.load().unwrap().positions[0], DVec3::new(DEPTH as f64, 0.0, 0.0));
    // A long cycle besides is found without recursion, too.
    asset.json["nodes"][0]["children"] = json!([DEPTH]);
    assert!(asset.message().contains("cycle"));
}

#[test]
fn a_truncated_glb_is_refused_at_every_length() {
    let glb = triangle_asset().glb();
    for length in 0..glb.len() {
        let message = load_bytes("cut.glb", &glb[..length]).unwrap_err().to_string();
        assert!(message.contains("cut.glb: "), "{length}: {message}");
    }
}

/// World positions of all triangle corners by the crate `gltf` (f32 node numbers, f64 products).
fn corners_by_other_reader(path: &std::path::Path) -> Vec<DVec3> {
    let asset = ::gltf::Gltf::open(path).unwrap();
    let blob = asset.blob.clone().unwrap();
    let mut corners = Vec::new();
    let scene = asset.default_scene().or_else(|| asset.scenes().next()).unwrap();
    let mut stack: Vec<_> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((node, parent)) = stack.pop() {
        let columns = node.transform().matrix().map(|column| column.map(f64::from));
        let world = parent * DMat4::from_cols_array_2d(&columns);
        for primitive in node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
            assert_eq!(primitive.mode(), ::gltf::mesh::Mode::Triangles);
            let reader = primitive.reader(|_| Some(&blob));
            let positions: Vec<_> = reader.read_positions().unwrap().collect();
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..positions.len() as u32).collect(),
            };
            let place =
                |i: u32| world.transform_point3(DVec3::from_array(positions[i as usize].map(f64::from)));
            corners.extend(indices.into_iter().map(place));
        }
        stack.extend(node.children().map(|child| (child, world)));
    }
    corners
}

#[test]
fn shared_scenes_equal_another_readers() {
    let Some(folder) = shared_folder("shared_scenes_equal_another_readers") else { return };
    for name in ["cases/gltf_nodes/scene.glb", "scenes/sponza.glb", "scenes/sibenik_open.glb"] {
        let path = folder.join(name);
        let scene = load_scene(&path).unwrap();
        let mut ours: Vec<DVec3> =
            scene.triangles.iter().flatten().map(|&i| scene.positions[i as usize]).collect();
        let mut others = corners_by_other_reader(&path);
        println!(
            "{name}: {} triangles, {} vertices, {:?}",
            scene.triangles.len(),
            scene.positions.len(),
            scene.notes
        );
        let size = others.iter().map(|p| p.length()).fold(0.0, f64::max);
        if ours.len() == others.len() {
            // Order of instances may differ: compare as sorted by place on a coarse grid, then near.
            let key = |p: &DVec3| (p.dot(DVec3::new(1.0, 1.7, 0.3)) / size * 1e12) as i64;
            ours.sort_by_key(key);
            others.sort_by_key(key);
            // f32 node numbers: 2⁻²⁴ of the size, a few of them in a row.
            let sum = |corners: &[DVec3]| corners.iter().copied().sum::<DVec3>() / corners.len() as f64;
            assert!((sum(&ours) - sum(&others)).length() < 1e-6 * size);
            for (a, b) in ours.iter().zip(&others) {
                let along = (*a - *b).dot(DVec3::new(1.0, 1.7, 0.3)).abs();
                assert!(along < 1e-6 * size, "{name}: {a} {b}");
            }
        } else {
            let dropped = (others.len() - ours.len()) / 3;
            assert!(
                scene.notes.iter().any(|note| note.starts_with(&format!("{dropped} triangles"))),
                "{name}"
            );
        }
    }
}
