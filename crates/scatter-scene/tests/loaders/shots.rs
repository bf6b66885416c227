//! Shots from glTF files and from the reference cases.

use glam::DVec3;
use scatter_core::{Light, Phase, Projection};
use scatter_scene::{
    BuiltinShot, Shot, Wrap, builtin_shots, builtin_variants, export, load_shot, read_exr, read_mask,
};
use serde_json::{Value, json};

use crate::common::{Asset, shared_folder};

/// A triangle from the origin to (3, 4, 12) by (3, 0, 0) (diagonal 13), a camera and a lamp.
fn asset() -> Asset {
    let mut asset = Asset::new();
    let positions = asset.positions(&[[0.0; 3], [3.0, 0.0, 0.0], [3.0, 4.0, 12.0]]);
    asset.placed(json!({"attributes": {"POSITION": positions}}));
    asset.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}));
    asset.push("cameras", json!({"type": "orthographic", "orthographic": {"ymag": 2.5, "xmag": 1.0}}));
    asset.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"type": "spot", "intensity": 8, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 3}
    ]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let light = |idx: usize| json!({"KHR_lights_punctual": {"light": idx}});
    asset.root_node(json!({"camera": 0, "translation": [1, 2, 30], "name": "view"}));
    // Turned about x by −90°: −z becomes −y, and y becomes −z.
    asset
        .root_node(json!({"camera": 1, "rotation": [-half, 0, 0, half], "scale": [3, 3, 3], "name": "plan"}));
    asset.root_node(json!({"extensions": light(0), "translation": [7, 8, 9], "name": "lamp"}));
    asset.root_node(json!({"extensions": light(1), "rotation": [-half, 0, 0, half], "name": "sun"}));
    asset
}

fn load(asset: &Asset, shot: Option<&str>) -> Result<Shot, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut path = folder.path().join("own.glb");
    std::fs::write(&path, asset.glb()).unwrap();
    if let Some(text) = shot {
        path = folder.path().join("shot.toml");
        std::fs::write(&path, text).unwrap();
    }
    load_shot(&path).map_err(|error| error.to_string())
}

const MEDIUM: &str = "[medium]\nscattering = [1, 1, 1]\nabsorption = [0, 0, 0]\nphase = \"isotropic\"\n";

#[test]
fn a_glb_alone_is_seen_by_its_first_camera_and_light() {
    let shot = load(&asset(), None).unwrap();
    assert_eq!(shot.name, "own");
    assert_eq!((shot.camera.eye(), shot.camera.forward()), (DVec3::new(1.0, 2.0, 30.0), DVec3::NEG_Z));
    assert_eq!(shot.camera.size(), [640, 480]);
    // tan of half a radian.
    assert!((shot.camera.window().top - 0.546_302_489_843_790_5).abs() < 1e-15);
    assert_eq!(shot.max_distance, 13.0);
    assert_eq!(shot.medium.sigma_t(), [0.5 / 13.0; 3]);
    assert_eq!(shot.medium.components()[0].phase, Phase::Isotropic);
    let Light::Spot(spot) = &shot.lights[0].light else { panic!("no spot") };
    assert_eq!(spot.lamp().position(), DVec3::new(7.0, 8.0, 9.0));
    assert_eq!(spot.lamp().intensity(), [8.0; 3]);
    assert_eq!(spot.direction(), DVec3::NEG_Z);
    assert!((spot.outer() - 0.5).abs() < 1e-15);
}

#[test]
fn a_shot_names_camera_and_light_of_the_file() {
    let text = format!(
        "mesh = \"own.glb\"\ncamera = \"gltf:plan\"\nlight = \"gltf:sun\"\nresolution = [30, 20]\n{MEDIUM}"
    );
    let shot = load(&asset(), Some(&text)).unwrap();
    assert_eq!(shot.camera.projection(), Projection::Orthographic);
    assert!((shot.camera.forward() - DVec3::NEG_Y).length() < 1e-15);
    assert!((shot.camera.up() - DVec3::NEG_Z).length() < 1e-15);
    assert_eq!((shot.camera.size(), shot.max_distance), ([30, 20], 13.0));
    // The node's scale does not matter.
    assert_eq!(shot.camera.window().top, 2.5);
    let Light::Directional(sun) = &shot.lights[0].light else { panic!("no sun") };
    assert!((sun.direction() - DVec3::NEG_Y).length() < 1e-15 && sun.irradiance() == [3.0; 3]);
    let missing = load(&asset(), Some(&text.replace("gltf:plan", "gltf:none"))).unwrap_err();
    assert!(missing.contains("shot.toml: line 2: camera: ") && missing.contains("view, plan"), "{missing}");
    let wrong = load(&asset(), Some(&text.replace("gltf:sun", "sun"))).unwrap_err();
    assert!(wrong.contains("shot.toml: line 3: light: ") && wrong.contains("gltf:NAME"), "{wrong}");
}

#[test]
fn meshes_without_camera_or_light_say_what_to_do() {
    let mut asset = asset();
    asset.json["nodes"][1]["camera"] = Value::Null;
    asset.json["nodes"][2]["camera"] = Value::Null;
    let message = load(&asset, None).unwrap_err();
    assert!(
        message.contains("own.glb: the mesh's file has no camera; give a [camera] in a shot file"),
        "{message}"
    );
}

#[test]
fn built_in_shots_load_without_a_note() {
    let folder = tempfile::tempdir().unwrap();
    let shots: Vec<_> = builtin_shots().iter().chain(builtin_variants()).collect();
    let paths = export(folder.path(), &shots).unwrap();
    assert!(!paths.is_empty());
    for path in paths {
        let shot = load_shot(&path).unwrap_or_else(|error| panic!("{error}"));
        let is_coloured = shot.lights[0].texture.is_some();
        println!("{}: {} triangles, coloured light: {is_coloured}", shot.name, shot.scene.triangles.len());
        assert!(shot.notes.is_empty(), "{}: {:?}", shot.name, shot.notes);
    }
}

#[test]
fn the_cards_of_the_grove_come_back_from_their_file() {
    let folder = tempfile::tempdir().unwrap();
    let paths = export(folder.path(), &[BuiltinShot::find("grove-cards").unwrap()]).unwrap();
    let scene = load_shot(&paths[0]).unwrap().scene;
    // Every card is two triangles with the texture's corners, on 26 trees.
    let trees = 26;
    assert_eq!(scene.cutouts.len(), trees * 2 * 680);
    let corner = |uv: &glam::DVec2| (uv.x == 0.0 || uv.x == 1.0) && (uv.y == 0.0 || uv.y == 1.0);
    assert!(scene.cutouts.iter().all(|cutout| cutout.mask == 0 && cutout.uv.iter().all(corner)));
    let [mask] = scene.masks.as_slice() else { panic!("{} masks", scene.masks.len()) };
    assert_eq!((mask.size(), mask.wrap()), ([128, 128], [Wrap::ClampToEdge; 2]));
    // The texture's middle is the twig, its upper corners are empty.
    assert!(mask.is_there(glam::DVec2::new(0.5, 0.5)) && !mask.is_there(glam::DVec2::new(0.01, 0.01)));
}

#[test]
fn shared_shots_load() {
    let Some(folder) = shared_folder("shared_shots_load") else { return };
    let mut count = 0;
    let mut check = |path: &std::path::Path| {
        let shot = load_shot(path).unwrap_or_else(|error| panic!("{error}"));
        println!(
            "{}: {} triangles, {:?}, {:?}",
            shot.name,
            shot.scene.triangles.len(),
            shot.camera.size(),
            shot.notes
        );
        count += 1;
    };
    for case in std::fs::read_dir(folder.join("cases")).unwrap() {
        let folder = case.unwrap().path();
        if !folder.join("shot.toml").is_file() {
            continue;
        }
        check(&folder.join("shot.toml"));
        // The mean and the count of masked pixels were written by the reference's own tool.
        let reference: Value =
            serde_json::from_slice(&std::fs::read(folder.join("reference.json")).unwrap()).unwrap();
        let image = read_exr(&folder.join("reference.exr")).unwrap();
        let mean = image.pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>() / (3.0 * 160.0 * 120.0);
        let mask = read_mask(&folder.join("fragile.png")).unwrap();
        let masked = mask.excluded.iter().filter(|&&m| m).count();
        let expected = reference["mean"].as_f64().unwrap();
        // The file rounds each value to f32; the rounding averages out far below one of them.
        assert!((mean / expected - 1.0).abs() < 1e-8, "{mean} {expected}");
        assert_eq!(masked as u64, reference["fragile_pixels"].as_u64().unwrap());
        assert_eq!((image.size, mask.size), ([160, 120], [160, 120]));
    }
    for entry in std::fs::read_dir(folder.join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            check(&path);
        }
    }
    assert!(count > 0, "no shots");
}
