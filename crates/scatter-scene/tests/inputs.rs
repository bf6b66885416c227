//! Files as users have them, through the loader and ray-cast truth, against the means that an independent renderer found.

use std::io::Write;
use std::path::Path;

use scatter_core::{DepthMap, Frame, ScatterImage, ShadowMap, VolumetricShadow};
use scatter_scene::{RaycastTruth, SceneCaster, Shot, load_shot, read_exr_with_source};

/// A room whose only light comes through one window.
const ROOM: f64 = 0.006_364_6;

/// The demand: a tenth of a percent of the mean.
const TOLERANCE: f64 = 1e-3;

fn mean(shot: &Shot) -> f64 {
    let caster = SceneCaster::new(&shot.scene).unwrap();
    let [width, height] = shot.camera.size();
    // The truth ignores the frame's maps.
    let texels = vec![f32::INFINITY; width as usize * height as usize];
    let depth = DepthMap::new(&texels, [width, height]).unwrap();
    let map = ShadowMap::Unshadowed;
    let light = &shot.lights[0].light;
    let frame = Frame::new(&shot.camera, depth, light, &map, &shot.medium, shot.max_distance).unwrap();
    let mut image = ScatterImage::new();
    RaycastTruth::new(&caster).render(&frame, &mut image).unwrap();
    let values = image.inscattered().iter().flatten().map(|&v| f64::from(v));
    values.sum::<f64>() / (3 * image.inscattered().len()) as f64
}

/// The folder of inputs, or a visible note that the test is skipped.
fn inputs(test: &str) -> Option<std::path::PathBuf> {
    let Some(shared) = std::env::var_os("SCATTER_SHARED") else {
        // Past the harness, which shows nothing of a test that passes.
        let _ = writeln!(std::io::stderr(), "SKIPPED {test}: SCATTER_SHARED is not set");
        return None;
    };
    Some(Path::new(&shared).join("inputs"))
}

#[test]
fn every_input_has_its_mean_or_says_what_it_lacks() {
    let Some(folder) = inputs("every_input_has_its_mean_or_says_what_it_lacks") else { return };
    let cases: &[(&str, f64, Option<&str>)] = &[
        ("gltf-alpha-mask/shot_clear.toml", ROOM, None),
        ("gltf-alpha-mask/shot_half.toml", 0.003_778_8, None),
        ("gltf-glass-pane/shot_blend.toml", 0.0, Some("materials[0] is blended")),
        ("gltf-node-visibility/shot.toml", ROOM, None),
        ("gltf-light-range/shot_endless.toml", 0.046_387_3, None),
        ("gltf-light-range/shot_range.toml", 0.046_387_3, Some("light \"Lamp\" has a range of 2")),
        ("gltf-skin-transform/shot.toml", ROOM, None),
        ("gltf-morph-weights/shot.toml", ROOM, None),
        ("gltf-instancing/shot.toml", 0.018_799_9, None),
        ("gltf-required-irrelevant/EXT_structural_metadata.toml", ROOM, None),
        ("gltf-required-irrelevant/EXT_texture_avif.toml", ROOM, None),
        ("gltf-required-irrelevant/KHR_interactivity.toml", ROOM, None),
        ("gltf-backslash-uri/shot.toml", ROOM, None),
        ("gltf-backslash-uri/shot_windows_path.toml", ROOM, None),
        ("gltf-bytestride-0/shot.toml", ROOM, None),
        ("gltf-float-integers/shot.toml", ROOM, None),
        ("gltf-matrix-last-row/shot.toml", ROOM, None),
        ("obj-bom/shot.toml", ROOM, None),
        ("obj-comment-backslash/shot.toml", ROOM, None),
        ("obj-concave-polygon/shot.toml", ROOM, None),
        ("obj-nan/shot_unused.toml", ROOM, None),
    ];
    let mut wrong = Vec::new();
    for &(name, expected, note) in cases {
        let shot = match load_shot(&folder.join(name)) {
            Ok(shot) => shot,
            Err(error) => {
                wrong.push(format!("{name}: {error}"));
                continue;
            }
        };
        let found = mean(&shot);
        let notes = shot.notes.join("|");
        println!("{name:55} {found:.7} ({expected:.7}) {notes}");
        let is_noted = note.map_or(notes.is_empty(), |note| notes.contains(note));
        // Spans of nothing leave their rounding: 1e-15 where all is dark.
        if !((found - expected).abs() <= TOLERANCE * expected + 1e-12 && is_noted) {
            wrong.push(format!("{name}: {found}, not {expected}; {notes}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn compressed_geometry_is_an_error_that_names_it() {
    let Some(folder) = inputs("compressed_geometry_is_an_error_that_names_it") else { return };
    let message = load_shot(&folder.join("gltf-draco-optional/shot.toml")).unwrap_err().to_string();
    assert!(
        message.contains("KHR_draco_mesh_compression") && message.contains("without mesh compression"),
        "{message}"
    );
}

#[test]
fn images_of_other_renderers_are_the_exact_picture() {
    let Some(folder) = inputs("images_of_other_renderers_are_the_exact_picture") else { return };
    let folder = folder.join("exr-foreign");
    let (truth, _) = read_exr_with_source(&folder.join("truth.exr")).unwrap();
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&v| f64::from(v)).sum::<f64>();
    for name in ["plain", "overscan", "multipart_matte_first", "yc"] {
        let (image, source) = read_exr_with_source(&folder.join(name).with_extension("exr")).unwrap();
        println!("{name}: {source}");
        assert_eq!(image.size, truth.size, "{name}");
        let difference: f64 = image
            .pixels
            .iter()
            .flatten()
            .zip(truth.pixels.iter().flatten())
            .map(|(a, b)| (f64::from(*a) - 1.0001 * f64::from(*b)).abs())
            .sum();
        // Half precision would be 5e-4 of each value; floats that went through chroma keep 1e-5.
        assert!(difference <= 1e-4 * sum(&truth.pixels), "{name}: {difference}");
    }
}
