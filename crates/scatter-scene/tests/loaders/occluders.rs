//! Points as particles, lines as strands: where they stand, what they take, and what is wrong with them.

use std::path::Path;

use glam::DVec3;
use scatter_scene::{Scene, SceneError, Shot, load_shot};
use serde_json::{Value, json};

use crate::common::{Asset, F32, U8, U16, f32_bytes};
use crate::mutants::{damaged, renumbered, survive};
use scatter_testing::Random;

const PLACES: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

fn scalars(asset: &mut Asset, values: &[f32]) -> usize {
    let view = asset.view(&f32_bytes(values), None);
    asset.accessor(view, F32, "SCALAR", values.len())
}

/// Three points with a radius and a density, under a node that moves and scales them.
fn points() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&PLACES);
    let radius = scalars(&mut asset, &[0.5, 0.25, 1.0]);
    let density = scalars(&mut asset, &[2.0, 3.0, 4.0]);
    let mesh = asset.mesh(json!({
        "mode": 0, "attributes": {"POSITION": positions, "_RADIUS": radius, "_DENSITY": density}
    }));
    asset.root_node(json!({"mesh": mesh, "translation": [10, 0, 0], "scale": [2, 2, 2]}));
    asset
}

/// The same places as lines of this mode.
fn lines(mode: u32, indices: Option<&[u32]>) -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&PLACES);
    let radius = scalars(&mut asset, &[0.01, 0.02, 0.03]);
    let opacity = scalars(&mut asset, &[0.25, 0.5, 1.0]);
    let mut primitive = json!({
        "mode": mode, "attributes": {"POSITION": positions, "_RADIUS": radius, "_OPACITY": opacity}
    });
    if let Some(indices) = indices {
        primitive["indices"] = json!(asset.indices(U16, indices));
    }
    asset.placed(primitive);
    asset
}

fn attributes(asset: &mut Asset) -> &mut Value {
    &mut asset.json["meshes"][0]["primitives"][0]["attributes"]
}

/// Each strand's places.
fn strands(scene: &Scene) -> Vec<Vec<DVec3>> {
    scene.strands.iter().map(|strand| strand.iter().map(|vertex| vertex.position).collect()).collect()
}

const A: DVec3 = DVec3::ZERO;
const B: DVec3 = DVec3::X;
const C: DVec3 = DVec3::new(0.0, 2.0, 0.0);

#[test]
fn nodes_move_and_scale_middles_and_leave_radii_alone() {
    let scene = points().load().unwrap();
    let found: Vec<_> = scene.particles.iter().map(|p| (p.centre, p.radius, p.density)).collect();
    let wanted = [
        (DVec3::new(10.0, 0.0, 0.0), 0.5, 2.0),
        (DVec3::new(12.0, 0.0, 0.0), 0.25, 3.0),
        (DVec3::new(10.0, 4.0, 0.0), 1.0, 4.0),
    ];
    assert_eq!(found, wanted);
    assert!(scene.notes.is_empty() && scene.triangles.is_empty(), "{:?}", scene.notes);
}

#[test]
fn lines_strips_and_loops_are_strands_and_pairs_that_meet_are_one() {
    let of = |mode, indices| strands(&lines(mode, indices).load().unwrap());
    assert_eq!(of(3, None), [vec![A, B, C]]);
    assert_eq!(of(2, None), [vec![A, B, C, A]]);
    assert_eq!(of(1, Some(&[0, 1, 1, 2])), [vec![A, B, C]]);
    assert_eq!(of(1, Some(&[0, 1, 2, 1])), [vec![A, B], vec![C, B]]);
    assert_eq!(of(3, Some(&[2, 1])), [vec![C, B]]);
    let scene = lines(1, Some(&[0, 1, 2])).load().unwrap();
    assert_eq!(strands(&scene), [vec![A, B]]);
    assert_eq!(scene.notes, ["1 line primitives end with half of a line, which is left out"]);
    let vertex = lines(3, None).load().unwrap().strands.vertices()[1];
    assert_eq!((vertex.radius, vertex.opacity), (f64::from(0.02f32), 0.5));
}

#[test]
fn instances_morph_targets_and_skins_place_them_as_they_place_triangles() {
    let mut asset = points();
    let translation = asset.positions(&[[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]);
    asset.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] =
        json!({"attributes": {"TRANSLATION": translation}});
    let scene = asset.load().unwrap();
    assert_eq!(scene.particles.len(), 6);
    assert_eq!(scene.particles[4].centre, DVec3::new(12.0, 0.0, 10.0));

    let mut asset = lines(3, None);
    let target = asset.positions(&[[0.0, 0.0, 1.0]; 3]);
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    asset.json["meshes"][0]["weights"] = json!([0.5]);
    assert_eq!(strands(&asset.load().unwrap())[0][1], DVec3::new(1.0, 0.0, 0.5));

    let mut asset = points();
    let view = asset.view(&[0; 12], None);
    let joints = asset.accessor(view, U8, "VEC4", 3);
    let weights = {
        let view = asset.view(&f32_bytes(&[1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]), None);
        asset.accessor(view, F32, "VEC4", 3)
    };
    attributes(&mut asset)["JOINTS_0"] = json!(joints);
    attributes(&mut asset)["WEIGHTS_0"] = json!(weights);
    let joint = asset.root_node(json!({"translation": [0, 0, 7]}));
    asset.push("skins", json!({"joints": [joint]}));
    asset.json["nodes"][0]["skin"] = json!(0);
    // Its own node does not matter.
    assert_eq!(asset.load().unwrap().particles[1].centre, DVec3::new(1.0, 0.0, 7.0));
}

#[test]
fn what_a_file_does_not_say_is_left_out_with_a_note() {
    for missing in ["_RADIUS", "_DENSITY"] {
        let mut asset = points();
        attributes(&mut asset).as_object_mut().unwrap().remove(missing);
        assert!(asset.message().contains("no triangles"), "{missing}");
        let positions = asset.positions(&PLACES);
        asset.placed(json!({"attributes": {"POSITION": positions}}));
        let scene = asset.load().unwrap();
        assert!(scene.particles.is_empty());
        assert_eq!(scene.notes, ["1 point primitives are left out"]);
    }
    // What is left out may be damaged.
    let mut asset = points();
    attributes(&mut asset).as_object_mut().unwrap().remove("_DENSITY");
    asset.json["accessors"][0]["type"] = json!("VEC2");
    let positions = asset.positions(&PLACES);
    asset.placed(json!({"attributes": {"POSITION": positions}}));
    assert_eq!(asset.load().unwrap().notes.len(), 1);
}

#[test]
fn faults_name_the_place_and_the_cure() {
    type Change = fn(&mut Asset);
    let cases: [(Change, &str, &str); 14] = [
        (
            |a| replace(a, 1, &[0.5, -1.0, 1.0]),
            "meshes[0].primitives[0]",
            "_RADIUS[1] is -1; give a number from 0 to 1e15",
        ),
        (|a| replace(a, 1, &[0.5, f32::NAN, 1.0]), "meshes[0].primitives[0]", "_RADIUS[1] is NaN"),
        (|a| replace(a, 1, &[f32::INFINITY, 0.5, 1.0]), "meshes[0].primitives[0]", "_RADIUS[0] is inf"),
        (|a| replace(a, 2, &[1.0, 1.0, -0.5]), "meshes[0].primitives[0]", "_DENSITY[2] is -0.5"),
        (|a| replace(a, 1, &[0.5, 1.0]), "meshes[0].primitives[0]", "3 positions, but 2 elements of _RADIUS"),
        (|a| replace(a, 2, &[0.5; 4]), "meshes[0].primitives[0]", "3 positions, but 4 elements of _DENSITY"),
        (|a| a.json["accessors"][1]["type"] = json!("VEC2"), "accessors[1]", "_RADIUS is VEC2"),
        (|a| a.json["accessors"][2]["componentType"] = json!(5125), "accessors[2]", "of component type 5125"),
        (|a| a.json["accessors"][2]["count"] = json!(3000), "accessors[2]", "3000 elements from byte 0"),
        (|a| attributes(a)["_RADIUS"] = json!(77), "accessors[77]", "the asset has"),
        (|a| attributes(a)["_RADIUS"] = json!("x"), "_RADIUS", "invalid type"),
        (|a| attributes(a)["_RADIUS"] = json!(-1), "_RADIUS", "invalid value"),
        (|a| a.json["accessors"][0]["type"] = json!("VEC2"), "accessors[0]", "POSITION is VEC2"),
        (
            |a| {
                let indices = a.indices(U16, &[0, 9]);
                a.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
            },
            "meshes[0].primitives[0]",
            "vertex index 9",
        ),
    ];
    for (change, place, part) in cases {
        let mut asset = points();
        change(&mut asset);
        let message = asset.message();
        assert!(message.contains(place) && message.contains(part), "{part}: {message}");
    }
    let mut asset = lines(3, None);
    replace(&mut asset, 2, &[0.5, 1.5, 0.0]);
    let message = asset.message();
    assert!(message.contains("_OPACITY[1] is 1.5; give a number from 0 to 1"), "{message}");
    // What no index names may be anything.
    let mut asset = lines(1, Some(&[0, 2]));
    replace(&mut asset, 2, &[0.5, f32::NAN, 0.0]);
    assert!(asset.load().is_ok());
}

/// Puts other scalars in the place of the accessor `index`.
fn replace(asset: &mut Asset, index: usize, values: &[f32]) {
    let new = scalars(asset, values);
    asset.json["accessors"][index] = asset.json["accessors"][new].clone();
}

#[test]
fn a_loop_of_billions_of_vertices_without_bytes_is_two() {
    let mut asset = Asset::new();
    let nothing = |asset: &mut Asset, kind: &str| {
        asset.push("accessors", json!({"componentType": F32, "type": kind, "count": 3_000_000}))
    };
    let positions = nothing(&mut asset, "VEC3");
    let (radius, opacity) = (nothing(&mut asset, "SCALAR"), nothing(&mut asset, "SCALAR"));
    let attributes = json!({"POSITION": positions, "_RADIUS": radius, "_OPACITY": opacity});
    asset.placed(json!({"mode": 3, "attributes": attributes}));
    assert_eq!(strands(&asset.load().unwrap()), [vec![A, A]]);
}

const SHOT: &str = r#"mesh = "mesh.EXT"
[camera]
eye = [0.0, 1.7, 5.0]
target = [0.0, 1.5, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [16, 12]
max_distance = 100.0
[light]
kind = "directional"
direction = [0.3, -1.0, 0.2]
irradiance = [1.0, 1.0, 1.0]
[medium]
scattering = [0.02, 0.02, 0.02]
"#;

fn shot(extension: &str, mesh: &[u8], tables: &str) -> Result<Shot, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(format!("mesh.{extension}")), mesh).unwrap();
    let text = SHOT.replace("EXT", extension) + tables;
    std::fs::write(folder.path().join("shot.toml"), text).unwrap();
    load_shot(&folder.path().join("shot.toml"))
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\np 2\nl 1 2 3\n";

#[test]
fn a_shots_tables_give_what_the_file_does_not() {
    let both = "[particles]\nradius = 0.1\ndensity = 1.0\n[strands]\nradius = 0.001\nopacity = 0.5\n";
    let loaded = shot("obj", OBJ.as_bytes(), both).unwrap();
    assert_eq!(loaded.scene.particles.len(), 1);
    assert_eq!(strands(&loaded.scene), [vec![A, B, C]]);
    assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    let without = shot("obj", OBJ.as_bytes(), "").unwrap();
    assert_eq!(without.notes, ["1 point elements are left out", "1 line elements are left out"]);
    // A value of the file's own stands.
    let mut asset = points();
    attributes(&mut asset).as_object_mut().unwrap().remove("_DENSITY");
    let loaded = shot("glb", &asset.glb(), "[particles]\nradius = 9.0\ndensity = 1.5\n").unwrap();
    let found: Vec<_> = loaded.scene.particles.iter().map(|p| (p.radius, p.density)).collect();
    assert_eq!(found, [(0.5, 1.5), (0.25, 1.5), (1.0, 1.5)]);
    let loaded = shot("glb", &asset.glb(), "[particles]\ndensity = 1.5\n").unwrap();
    assert_eq!(loaded.scene.particles.len(), 3);
    let loaded = shot("obj", b"v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n", both).unwrap();
    assert_eq!(loaded.notes.len(), 2);
    assert!(loaded.notes[0].contains("particles has nothing to act on"), "{:?}", loaded.notes);
}

#[test]
fn bad_tables_name_line_key_and_cure() {
    for (tables, parts) in [
        ("[particles]\nradius = -1.0\ndensity = 1.0\n", ["particles.radius", "give a number from 0 to 1e15"]),
        ("[particles]\nradius = 1.0\ndensity = nan\n", ["line 17: particles.density", "NaN"]),
        ("[strands]\nradius = 1.0\nopacity = 1.5\n", ["strands.opacity", "give a number from 0 to 1"]),
        ("[strands]\nradius = inf\nopacity = 0.5\n", ["strands.radius", "inf"]),
        ("[strands]\nwidth = 1.0\n", ["strands.width", "unknown field"]),
        ("[particles]\nradius = \"a\"\n", ["particles.radius", "invalid type"]),
    ] {
        let message = shot("obj", OBJ.as_bytes(), tables).unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{tables}: {message}");
    }
}

#[test]
fn damaged_points_and_lines_are_loaded_or_refused_with_one_line() {
    fn check(path: &Path) -> Result<(), SceneError> {
        scatter_scene::load_scene(path).map(|scene| {
            let positive = |x: f64| x >= 0.0 && x.is_finite();
            assert!(
                scene
                    .particles
                    .iter()
                    .all(|p| p.centre.is_finite() && positive(p.radius) && positive(p.density))
            );
            let vertices = scene.strands.vertices();
            assert!(
                vertices.iter().all(|v| v.position.is_finite() && positive(v.radius) && v.opacity <= 1.0)
            );
            assert!(scatter_scene::SceneCaster::new(&scene).is_ok());
        })
    }
    fn check_shot(path: &Path) -> Result<(), SceneError> {
        load_shot(path).map(|shot| assert!(scatter_scene::SceneCaster::new(&shot.scene).is_ok()))
    }
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(21);
    let (mut count, mut accepted) = (0, 0);
    for asset in [points(), lines(1, Some(&[0, 1, 1, 2])), lines(2, None)] {
        let (bytes, json) = (asset.glb(), asset.json.to_string());
        let mutants: Vec<Vec<u8>> = (0..600)
            .map(|index| match index % 3 {
                0 => damaged(&mut random, &bytes),
                1 => crate::common::glb(renumbered(&mut random, &json).as_bytes(), &asset.bin),
                _ => crate::common::glb(json.as_bytes(), &damaged(&mut random, &asset.bin)),
            })
            .collect();
        let total = survive(folder.path(), "points.glb", mutants.into_iter(), check);
        (count, accepted) = (count + total.0, accepted + total.1);
    }
    let tables = "[particles]\nradius = 0.1\ndensity = 1.0\n[strands]\nradius = 0.001\nopacity = 0.5\n";
    std::fs::write(folder.path().join("shot.toml"), SHOT.replace("EXT", "obj") + tables).unwrap();
    for index in 0..600 {
        let seed = format!("{OBJ}l 3 1\nv 4 4 4\np 1 4 -1\nl -1 -2 1\n");
        let mutant = if index % 2 == 0 {
            damaged(&mut random, seed.as_bytes())
        } else {
            renumbered(&mut random, &seed).into_bytes()
        };
        std::fs::write(folder.path().join("mesh.obj"), mutant).unwrap();
        count += 1;
        match check_shot(&folder.path().join("shot.toml")) {
            Ok(()) => accepted += 1,
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
    }
    println!("{count} mutants, {accepted} accepted");
    assert!(accepted > count / 20 && accepted < count * 19 / 20, "{accepted} of {count}");
}
