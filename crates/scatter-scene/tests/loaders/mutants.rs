//! Thousands of damaged files through the loaders: each gives a sane scene or one line that names the file.
//!
//! Deterministic (a seeded generator), and the count of panics must be zero: a panic prints text of its own.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, UnwindSafe};
use std::path::Path;
use std::sync::Once;

use crate::common::{Asset, F32, I16, U8, U16, base64, f32_bytes, glb, png, shared_folder};
use scatter_scene::{
    RadianceImage, Scene, SceneError, load_scene, load_shot, read_exr, read_linear_rgb, write_exr, write_png,
};
use scatter_testing::Random;
use serde_json::json;

/// What JSON and OBJ numbers are replaced by.
const NUMBERS: [&str; 22] = [
    "-1",
    "0",
    "1",
    "2",
    "3",
    "7",
    "999",
    "65535",
    "4294967295",
    "18446744073709551615",
    "99999999999999999999999",
    "1e39",
    "-1e308",
    "1e400",
    "1e-320",
    "0.5",
    "null",
    "true",
    "\"x\"",
    "[]",
    "{\"a\":[{\"b\":{}}]}",
    "nan",
];

thread_local! {
    static PANICS: Cell<usize> = const { Cell::new(0) };
}

/// Runs a loader; a panic is counted (and would unwind into the test as a failure anyway).
fn panics_of(work: impl FnOnce() + UnwindSafe) -> usize {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            PANICS.set(PANICS.get() + 1);
            usual(info);
        }));
    });
    let before = PANICS.get();
    let _ = std::panic::catch_unwind(work);
    PANICS.get() - before
}

fn check_line(error: &SceneError, file_name: &str) {
    let message = error.to_string();
    assert!(message.contains(file_name), "no file name: {message}");
    assert!(message.contains("; "), "no cure: {message}");
    assert!(!message.contains(|c: char| c.is_control()) && message.len() < 2000, "not one line: {message}");
}

fn check_scene(scene: &Scene) {
    assert!(!scene.triangles.is_empty());
    assert!(scene.positions.iter().all(|p| p.is_finite()));
    assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()));
    assert!(scene.cutouts.is_sorted_by(|a, b| a.triangle < b.triangle));
    assert!(scene.cutouts.iter().all(|c| (c.triangle as usize) < scene.triangles.len()
        && (c.mask as usize) < scene.masks.len()
        && c.uv.iter().all(|uv| uv.is_finite())));
    assert!(scene.cameras.iter().all(|c| c.world_from_camera.is_finite()));
    assert!(
        scene
            .lights
            .iter()
            .all(|l| l.world_from_light.is_finite() && l.strength.iter().all(|s| s.is_finite()))
    );
}

/// Loads each mutant from a file of that name; returns how many there were, and how many were accepted.
pub fn survive(
    folder: &Path,
    name: &str,
    mutants: impl Iterator<Item = Vec<u8>>,
    load: fn(&Path) -> Result<(), SceneError>,
) -> (usize, usize) {
    let path = folder.join(name);
    let (mut count, mut accepted, mut panics) = (0, 0, 0);
    for bytes in mutants {
        // A fresh file each time: rewriting one makes some file systems wait for the disk.
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, &bytes).unwrap();
        count += 1;
        panics += panics_of(AssertUnwindSafe(|| match load(&path) {
            Ok(()) => accepted += 1,
            Err(error) => check_line(&error, name),
        }));
    }
    assert_eq!(panics, 0, "{panics} of {count} mutants of {name} panicked or broke a promise");
    println!("{name}: {count} mutants, {accepted} accepted");
    (count, accepted)
}

fn scene(path: &Path) -> Result<(), SceneError> {
    load_scene(path).map(|scene| check_scene(&scene))
}

fn shot(path: &Path) -> Result<(), SceneError> {
    load_shot(path).map(|shot| {
        let [width, height] = shot.camera.size();
        assert!(width > 0 && height > 0 && u64::from(width) * u64::from(height) <= 1 << 28);
        assert!(shot.max_distance > 0.0 && shot.max_distance.is_finite());
        assert!(shot.camera.pixel_ray(0, height - 1).direction.is_finite());
        assert!(shot.medium.sigma_t().iter().all(|s| s.is_finite() && *s >= 0.0));
        assert!(!shot.lights.is_empty());
        assert!(
            shot.lights.iter().flat_map(|light| light.light.strength()).all(|s| s.is_finite() && s >= 0.0)
        );
    })
}

fn image(path: &Path) -> Result<(), SceneError> {
    read_linear_rgb(path).map(|image| {
        assert_eq!(image.pixels.len() as u64, u64::from(image.size[0]) * u64::from(image.size[1]));
    })
}

/// One to four byte edits, a truncation, a removed or a doubled piece.
pub fn damaged(random: &mut Random, seed: &[u8]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    let at = random.index(bytes.len());
    match random.index(8) {
        0 => bytes.truncate(at),
        1 => drop(bytes.drain(at..(at + 1 + random.index(40)).min(seed.len()))),
        2 => {
            let piece = bytes[at..(at + 1 + random.index(40)).min(seed.len())].to_vec();
            bytes.splice(at..at, piece);
        }
        _ => {
            for _ in 0..=random.index(4) {
                let at = random.index(bytes.len());
                bytes[at] = match random.index(3) {
                    0 => random.bits() as u8,
                    1 => bytes[at] ^ (1 << random.index(8)),
                    _ => *b"0123456789-.,:[]{}\" \n\0".get(random.index(22)).unwrap(),
                };
            }
        }
    }
    bytes
}

/// One number of a text replaced by something else, or two exchanged.
pub fn renumbered(random: &mut Random, text: &str) -> String {
    let is_digit = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut numbers = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices() {
        match (is_digit(c), start) {
            (true, None) => start = Some(at),
            (false, Some(from)) => {
                numbers.push(from..at);
                start = None;
            }
            _ => {}
        }
    }
    let one = numbers[random.index(numbers.len())].clone();
    let other = numbers[random.index(numbers.len())].clone();
    let mut changed = text.to_owned();
    if random.index(4) == 0 && one.end < other.start {
        changed.replace_range(other.clone(), &text[one.clone()]);
        changed.replace_range(one, &text[other]);
    } else {
        changed.replace_range(one, NUMBERS[random.index(NUMBERS.len())]);
    }
    changed
}

/// An asset that uses everything that the reader knows.
fn rich_asset() -> Asset {
    let mut asset = Asset::new();
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.5], [2.0, 1.0, 0.0]];
    let plain = asset.positions(&points);
    let indices = asset.indices(U16, &[0, 1, 2, 2, 1, 3]);
    let sparse_indices = asset.view(&[1, 4], None);
    let sparse_values = asset.view(&f32_bytes(&[5.0, 6.0, 7.0, 8.0, 9.0, 10.0]), None);
    let sparse = asset.push(
        "accessors",
        json!({"bufferView": 0, "componentType": F32, "type": "VEC3", "count": 5, "sparse": {"count": 2,
            "indices": {"bufferView": sparse_indices, "componentType": U8}, "values": {"bufferView": sparse_values}}}),
    );
    let shorts: Vec<u8> = (0..16i16).flat_map(|v| (v * v * 100).to_le_bytes()).collect();
    let view = asset.view(&shorts, Some(8));
    let quantised = asset.push(
        "accessors",
        json!({"bufferView": view, "componentType": I16, "type": "VEC3", "count": 4, "normalized": true}),
    );
    let strip = asset.indices(U8, &[0, 1, 2, 3]);
    let view = asset.view(&(0..10).map(|i| i * 23).collect::<Vec<u8>>(), None);
    let tex_coords = asset.push(
        "accessors",
        json!({"bufferView": view, "componentType": U8, "type": "VEC2", "count": 5, "normalized": true}),
    );
    let leaf = image::RgbaImage::from_fn(3, 2, |x, y| image::Rgba([9, 9, 9, (x * 90 + y * 30) as u8]));
    let view = asset.view(&png(&leaf.into()), None);
    asset.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    asset.push("samplers", json!({"wrapS": 33071, "wrapT": 33648}));
    asset.push("textures", json!({"source": 0, "sampler": 0}));
    asset.push(
        "materials",
        json!({"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.3, "pbrMetallicRoughness": {
            "baseColorFactor": [1, 1, 1, 0.9], "baseColorTexture": {"index": 0, "texCoord": 0, "extensions": {
                "KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3]}}}}}),
    );
    let view = asset.view(&[0, 1, 0, 0].repeat(5), None);
    let joints = asset.accessor(view, U8, "VEC4", 5);
    let view = asset.view(&f32_bytes(&[0.25, 0.75, 0.0, 0.0].repeat(5)), None);
    let weights = asset.accessor(view, F32, "VEC4", 5);
    let view = asset
        .view(&f32_bytes(&[1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.].repeat(2)), None);
    let binds = asset.accessor(view, F32, "MAT4", 2);
    let mesh = asset.push(
        "meshes",
        json!({"primitives": [
            {"attributes": {"POSITION": plain, "TEXCOORD_0": tex_coords}, "indices": indices, "material": 0,
                "targets": [{"POSITION": sparse}]},
            {"attributes": {"POSITION": sparse}, "mode": 5},
            {"attributes": {"POSITION": quantised}, "indices": strip, "mode": 6},
            {"attributes": {"POSITION": plain}, "mode": 1}
        ], "weights": [0.5]}),
    );
    let skinned = asset.mesh(json!({
        "attributes": {"POSITION": plain, "JOINTS_0": joints, "WEIGHTS_0": weights}, "indices": indices
    }));
    asset.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}));
    asset.push("cameras", json!({"type": "orthographic", "orthographic": {"ymag": 2.5, "xmag": 1.0}}));
    asset.json["extensions"]["KHR_lights_punctual"]["lights"] =
        json!([{"type": "spot", "color": [1, 0.5, 0.25], "intensity": 4, "spot": {"innerConeAngle": 0.2}}]);
    let child = asset.push("nodes", json!({"mesh": mesh, "rotation": [0, 0.6, 0, 0.8], "name": "arm\n"}));
    let light =
        asset.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}, "camera": 1}));
    let matrix = json!([0, 0.5, 0, 0, -0.5, 0, 0, 0, 0, 0, 0.5, 0, 0, 0, 5, 1]);
    asset.root_node(json!({"children": [child, light], "matrix": matrix}));
    asset.root_node(json!({"mesh": mesh, "scale": [2, 3, -1], "translation": [10, 0, 0.1], "camera": 0}));
    let instances = json!({"TRANSLATION": plain, "SCALE": sparse});
    let hidden = json!({"KHR_node_visibility": {"visible": false},
        "EXT_mesh_gpu_instancing": {"attributes": instances}});
    asset.root_node(json!({"mesh": mesh, "extensions": hidden}));
    let instanced = json!({"EXT_mesh_gpu_instancing": {"attributes": instances}});
    asset.root_node(json!({"mesh": skinned, "extensions": instanced}));
    asset.push("skins", json!({"joints": [child, light], "inverseBindMatrices": binds}));
    asset.root_node(json!({"mesh": skinned, "skin": 0}));
    asset
}

const RICH_OBJ: &str = "# rich\nmtllib none.mtl\no a\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0.25 2\nv 0 1e-3 0\n\
vt 0 0\nvn 0 0 1\ng b\nusemtl red\nf 1/1/1 2/1/1 3/1/1\nf 1 2 3 4\nf -1 -2 -3\nl 1 2 3\np 1\ns off\n\
v 7.5 -2 1\nf 1//1 \\\n 5//1 2//1\n";

#[test]
fn damaged_scene_files_give_a_sane_scene_or_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(2024);
    let rich = rich_asset();
    let json_text = rich.json.to_string();
    let mut gltf = rich.json.clone();
    gltf["buffers"][0]["uri"] = json!(format!("data:;base64,{}", base64(&rich.bin)));
    let gltf_text = gltf.to_string();
    let glb_bytes = rich.glb();
    let bin = rich.bin.clone();
    let mut totals = Vec::new();
    // The seeds themselves are sound.
    totals.push(survive(folder.path(), "seed.glb", std::iter::once(glb_bytes.clone()), scene));
    totals.push(survive(folder.path(), "seed.gltf", std::iter::once(gltf_text.clone().into_bytes()), scene));
    totals.push(survive(folder.path(), "seed.obj", std::iter::once(RICH_OBJ.into()), scene));
    assert!(totals.iter().all(|total| *total == (1, 1)), "a seed was refused");

    let mut run = |name: &str, count: usize, mutant: &mut dyn FnMut(&mut Random) -> Vec<u8>| {
        let mutants = (0..count).map(|_| mutant(&mut random));
        totals.push(survive(folder.path(), name, mutants, scene));
    };
    run("bytes.glb", 2000, &mut |r| damaged(r, &glb_bytes));
    run("numbers.glb", 2000, &mut |r| glb(renumbered(r, &json_text).as_bytes(), &bin));
    run("twice.glb", 1000, &mut |r| {
        let once = renumbered(r, &json_text);
        glb(renumbered(r, &once).as_bytes(), &bin)
    });
    run("buffer.glb", 1000, &mut |r| glb(json_text.as_bytes(), &damaged(r, &bin)));
    run("bytes.gltf", 1000, &mut |r| damaged(r, gltf_text.as_bytes()));
    run("bytes.obj", 1500, &mut |r| damaged(r, RICH_OBJ.as_bytes()));
    run("numbers.obj", 1500, &mut |r| renumbered(r, RICH_OBJ).into_bytes());

    if let Some(shared) = shared_folder("mutants of the shared cases") {
        let glb_bytes = std::fs::read(shared.join("cases/gltf_nodes/scene.glb")).unwrap();
        let obj_bytes = std::fs::read(shared.join("cases/spot_grille/scene.obj")).unwrap();
        run("case.glb", 500, &mut |r| damaged(r, &glb_bytes));
        run("case.obj", 500, &mut |r| damaged(r, &obj_bytes));
    }
    let (count, accepted) = totals.iter().fold((0, 0), |sum, total| (sum.0 + total.0, sum.1 + total.1));
    println!("{count} mutants, {accepted} accepted");
    // Both kinds must occur often, or the mutants are too wild or too tame to say anything.
    assert!(count > 10_000 && accepted > count / 20 && accepted < count * 19 / 20, "{accepted} of {count}");
}

const RICH_SHOT: &str = r#"mesh = "mesh.obj"
[camera]
eye = [0.0, 1.7, 5.0]
target = [0.0, 1.5, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [160, 120]
max_distance = 100.0
[light]
kind = "spot"
direction = [0.3, -1.0, 0.2]
position = [0.0, 3.0, 0.0]
intensity = [10.0, 10.0, 10.0]
inner_cone_degrees = 20.0
outer_cone_degrees = 25.0
[light.texture]
rows = [[[1, 0, 0.5], [0, 1, 0]], [[0, 0, 1], [1, 1, 1]]]
up = [0, 0, 1]
[[lights]]
kind = "directional"
direction = [0.3, -1.0, 0.2]
irradiance = [1.0, 1.0, 1.0]
[lights.texture]
rows = [[[1, 0, 0.5], [0, 1, 0]]]
center = [0, 2, 0]
half_extents = [1.5, 2]
up = [0, 0, 1]
[medium]
absorption = [0.0, 0.0, 0.001]
[[medium.components]]
scattering = [0.02, 0.02, 0.02]
phase = "henyey-greenstein"
g = 0.25
"#;

#[test]
fn damaged_shot_files_give_a_sane_shot_or_one_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mesh.obj"), RICH_OBJ).unwrap();
    let mut random = Random(7);
    let seed = std::iter::once(RICH_SHOT.into());
    assert_eq!(survive(folder.path(), "seed.toml", seed, shot), (1, 1));
    let bytes = (0..2000).map(|_| damaged(&mut random, RICH_SHOT.as_bytes()));
    let (_, some) = survive(folder.path(), "bytes.toml", bytes, shot);
    let mut random = Random(8);
    let numbers = (0..2000).map(|_| renumbered(&mut random, RICH_SHOT).into_bytes());
    let (_, more) = survive(folder.path(), "numbers.toml", numbers, shot);
    let mut random = Random(9);
    // Whole lines lost, doubled or exchanged: missing keys, keys of the wrong table.
    let lines: Vec<&str> = RICH_SHOT.lines().collect();
    let shuffled = (0..1000).map(|_| {
        let mut lines = lines.clone();
        let (a, b) = (random.index(lines.len()), random.index(lines.len()));
        match random.index(3) {
            0 => drop(lines.remove(a)),
            1 => lines.insert(a, lines[b]),
            _ => lines.swap(a, b),
        }
        lines.join("\n").into_bytes()
    });
    let (_, others) = survive(folder.path(), "lines.toml", shuffled, shot);
    let accepted = some + more + others;
    assert!((250..4750).contains(&accepted), "{accepted} of 5000 accepted: too wild or too tame");
}

#[test]
fn damaged_images_give_an_image_or_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seed.exr");
    let seed = RadianceImage { size: [17, 9], pixels: (0..153).map(|i| [i as f32, 0.5, -0.0]).collect() };
    write_exr(&path, &seed).unwrap();
    assert_eq!(read_exr(&path).unwrap(), seed);
    let exr = std::fs::read(&path).unwrap();
    let path = folder.path().join("seed.png");
    write_png(&path, &seed, 0.02).unwrap();
    let png = std::fs::read(&path).unwrap();
    let mut random = Random(11);
    let mutants = (0..1500).map(|_| damaged(&mut random, &exr));
    let (count, accepted) = survive(folder.path(), "bytes.exr", mutants, image);
    assert!(accepted > 0 && accepted < count);
    let mut random = Random(12);
    let mutants = (0..1500).map(|_| damaged(&mut random, &png));
    survive(folder.path(), "bytes.png", mutants, image);
}
