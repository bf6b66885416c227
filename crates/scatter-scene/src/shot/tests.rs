use std::path::Path;

use glam::DVec3;
use scatter_core::{Light, Phase, Projection};

use super::{Shot, load_shot};

const SHOT: &str = r#"# a comment
mesh = "scene.obj"

[camera]
eye = [0, 1.7, 5.0]
target = [0.0, 1.5, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 60.0
resolution = [160, 121]
max_distance = 100.0

[light]
kind = "spot"
position = [0.0, 3.0, 0.0]
direction = [0.3, -1.0, 0.2]
intensity = [10.0, 11.0, 12.0]
inner_cone_degrees = 20.0
outer_cone_degrees = 25.0

[medium]
scattering = [0.02, 0.03, 0.04]
absorption = [0.0, 0.5, 0.0]
phase = "henyey-greenstein"
g = 0.25
"#;

fn load(text: &str) -> Result<Shot, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.obj"), "v 0 0 0\nv 3 0 0\nv 0 4 0\nf 1 2 3\n").unwrap();
    let path = folder.path().join("some.toml");
    std::fs::write(&path, text).unwrap();
    load_shot(&path).map_err(|error| error.to_string())
}

/// Loads [`SHOT`] with one of its pieces replaced.
fn changed(old: &str, new: &str) -> Result<Shot, String> {
    assert!(SHOT.contains(old), "{old}");
    load(&SHOT.replace(old, new))
}

#[test]
fn every_key_arrives_where_it_belongs() {
    let shot = load(SHOT).unwrap();
    assert_eq!(shot.name, "some");
    assert_eq!(shot.camera.eye(), DVec3::new(0.0, 1.7, 5.0));
    assert_eq!(shot.camera.size(), [160, 121]);
    // tan 30° to the rounding of one tangent.
    assert!((shot.camera.window().top - 1.0 / 3f64.sqrt()).abs() < 1e-15);
    assert_eq!(shot.max_distance, 100.0);
    let Light::Spot(spot) = &shot.lights[0].light else { panic!("no spot") };
    assert_eq!(spot.lamp().position(), DVec3::new(0.0, 3.0, 0.0));
    assert_eq!(spot.lamp().intensity(), [10.0, 11.0, 12.0]);
    assert_eq!(spot.lamp().radius(), 0.0);
    assert!((spot.outer() - 25f64.to_radians()).abs() < 1e-15);
    assert!((spot.cos_inner() - 20f64.to_radians().cos()).abs() < 1e-15);
    assert!((spot.direction() - DVec3::new(0.3, -1.0, 0.2).normalize()).length() < 1e-15);
    assert_eq!(shot.medium.sigma_t(), [0.02, 0.53, 0.04]);
    assert_eq!(shot.medium.components()[0].phase, Phase::HenyeyGreenstein { g: 0.25 });
    assert_eq!(shot.scene.triangles.len(), 1);
    assert!(shot.notes.is_empty(), "{:?}", shot.notes);
}

#[test]
fn a_height_falloff_needs_its_scale_and_nothing_else() {
    let fog = |keys: &str| load(&format!("{SHOT}\n[medium.height_falloff]\n{keys}\n"));
    let falloff = |keys: &str| *fog(keys).unwrap().medium.height_falloff().unwrap();
    let plain = falloff("scale_height = 8");
    assert_eq!((plain.up(), plain.base_height(), plain.scale_height()), (DVec3::Y, 0.0, 8.0));
    let tilted = falloff("up = [0.0, 0.0, -4.0]\nbase_height = -2.5\nscale_height = 0.75");
    assert_eq!((tilted.up(), tilted.base_height(), tilted.scale_height()), (DVec3::NEG_Z, -2.5, 0.75));
    assert!(load(SHOT).unwrap().medium.height_falloff().is_none());
    // The table starts in line 26: the text has 24 lines and an empty one.
    for (keys, said) in [
        ("", "line 26: medium.height_falloff: missing field `scale_height`; add it"),
        ("scale_height = 0", "line 27: medium.height_falloff.scale_height"),
        ("scale_height = -1.5", "a finite number > 0"),
        ("scale_height = nan", "line 27: medium.height_falloff.scale_height"),
        ("scale_height = 1\nup = [0, 0, 0]", "line 28: medium.height_falloff.up"),
        ("scale_height = 1\nbase_height = inf", "line 28: medium.height_falloff.base_height"),
        ("scale_height = 1\nfalloff = 2", "unknown field `falloff`"),
        ("scale_height = \"high\"", "line 27: medium.height_falloff.scale_height"),
    ] {
        let message = fog(keys).map(|_| ()).unwrap_err();
        println!("{message}");
        assert!(message.contains(said) && message.contains("; "), "{keys:?}: {message}");
    }
}

#[test]
fn phase_and_absorption_have_defaults_and_paths_either_slash() {
    let bare = SHOT
        .replace("absorption = [0.0, 0.5, 0.0]\n", "")
        .replace("phase = \"henyey-greenstein\"\ng = 0.25\n", "");
    let shot = load(&bare).unwrap();
    assert_eq!(shot.medium.components()[0].phase, Phase::Isotropic);
    assert_eq!(shot.medium.sigma_t(), [0.02, 0.03, 0.04]);
    assert!(shot.notes.is_empty(), "{:?}", shot.notes);
    let components = bare.replace("scattering = ", "[[medium.components]]\nscattering = ");
    assert_eq!(load(&components).unwrap().medium.components()[0].phase, Phase::Isotropic);
    let slashed = bare.replace("\"scene.obj\"", "'.\\scene.obj'");
    assert!(slashed.contains(".\\scene.obj"));
    assert_eq!(load(&slashed).unwrap().scene.triangles.len(), 1);
    assert!(load(&format!("\u{feff}{bare}")).is_ok(), "a byte order mark is no key");
}

#[test]
fn the_files_that_list_all_keys_load_and_say_what_is_ignored() {
    let text = SHOT.replace("kind = \"spot\"", "kind = \"directional\"\nirradiance = [1.0, 2.0, 3.0]");
    let shot = load(&text.replace("phase = \"henyey-greenstein\"", "phase = \"isotropic\"")).unwrap();
    assert!(matches!(&shot.lights[0].light, Light::Directional(sun) if sun.irradiance() == [1.0, 2.0, 3.0]));
    let notes = shot.notes.join("|");
    for key in [
        "light.position",
        "light.intensity",
        "light.inner_cone_degrees",
        "light.outer_cone_degrees",
        "medium.g",
    ] {
        assert!(notes.contains(&format!(": {key} is ignored")), "{notes}");
    }
    assert_eq!(shot.notes.len(), 5);
}

#[test]
fn further_lights_components_and_orthographic_cameras() {
    let text = SHOT
        .replace("vertical_fov_degrees = 60.0", "orthographic_height = 3.0")
        .replace("scattering = [0.02, 0.03, 0.04]\n", "")
        .replace("phase = \"henyey-greenstein\"\ng = 0.25\n", "")
        + "[[medium.components]]\nscattering = [1, 2, 3]\nphase = \"rayleigh\"\n\
           [[medium.components]]\nscattering = [4, 5, 6]\nphase = \"henyey-greenstein\"\ng = -0.5\n\
           [[lights]]\nkind = \"point\"\nposition = [1, 2, 3]\nintensity = [1, 1, 1]\nradius = 0.125\n";
    let shot = load(&text).unwrap();
    assert_eq!(shot.camera.projection(), Projection::Orthographic);
    assert_eq!(shot.camera.window().top, 1.5);
    assert_eq!(shot.medium.sigma_t(), [5.0, 7.5, 9.0]);
    assert_eq!(shot.medium.components()[1].phase, Phase::HenyeyGreenstein { g: -0.5 });
    assert!(matches!(&shot.lights[1].light, Light::Point(lamp) if lamp.radius() == 0.125));
}

#[test]
fn a_directional_texture_fills_its_rectangle_with_row_0_on_top() {
    // The sun shines down; up is −z, so right is forward × up = (−y) × (−z) = +x.
    let text = SHOT
        .replace("kind = \"spot\"", "kind = \"directional\"\nirradiance = [1, 1, 1]")
        .replace("direction = [0.3, -1.0, 0.2]", "direction = [0, -1, 0]")
        + "[light.texture]\nrows = [[[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[2, 2, 2], [3, 3, 3], [4, 4, 4]]]\n\
           up = [0, 0, -1]\ncenter = [10, 0, 20]\nhalf_extents = [3, 1]\n";
    let shot = load(&text).unwrap();
    let texture = shot.lights[0].texture.as_ref().unwrap();
    let at = |x: f64, z: f64| texture.as_light_texture().lookup(DVec3::new(x, -7.0, z));
    assert_eq!(at(7.5, 19.5), [1.0, 0.0, 0.0]);
    assert_eq!(at(10.0, 19.5), [0.0, 1.0, 0.0]);
    assert_eq!(at(12.5, 20.5), [4.0; 3]);
    assert_eq!(at(13.5, 20.5), [1.0; 3], "clear glass outside");
}

#[test]
fn a_spot_texture_fills_the_square_around_its_cone() {
    let text = SHOT.replace("[0.3, -1.0, 0.2]", "[0, -1, 0]").replace("= 25.0", "= 45.0")
        + "[light.texture]\nup = [0, 0, -1]\nrows = [[[1, 0, 0], [0, 1, 0]], [[0, 0, 1], [5, 5, 5]]]\n";
    let shot = load(&text).unwrap();
    let texture = shot.lights[0].texture.as_ref().unwrap();
    // The lamp is at y = 3: on y = 1 the square reaches from −2 to 2.
    let at = |x: f64, z: f64| texture.as_light_texture().lookup(DVec3::new(x, 1.0, z));
    assert_eq!(at(-1.9, -1.9), [1.0, 0.0, 0.0]);
    assert_eq!(at(1.9, -0.1), [0.0, 1.0, 0.0]);
    assert_eq!(at(1.9, 1.9), [5.0; 3]);
    assert_eq!(at(2.1, 1.9), [1.0; 3]);
}

#[test]
fn faults_name_line_key_and_cure() {
    let cases = [
        ("eye = [0, 1.7, 5.0]", "eye = [0.0, 1.5, 0.0]", "line 6: camera.target: ", "in front"),
        ("eye = [0, 1.7, 5.0]", "eye = [0.0, nan, 0.0]", "line 5: camera.eye: ", "finite"),
        ("eye = [0, 1.7, 5.0]", "eye = [0.0, 1e300, 0.0]", "line 5: camera.eye: ", "at most"),
        ("eye = [0, 1.7, 5.0]", "eye = [0.0, 1.0]", "line 5: camera.eye: ", "3"),
        ("eye = [0, 1.7, 5.0]", "eye = \"here\"", "line 5: camera.eye: ", "string"),
        ("eye = [0, 1.7, 5.0]\n", "", "line 4: camera: missing field `eye`; ", "add"),
        ("position = [0.0, 3.0, 0.0]", "position = [0, 1.7, 5.0]", "line 12: light: ", "move one"),
        ("up = [0.0, 1.0, 0.0]", "up = [0.0, 0.1, 2.5]", "line 7: camera.up: ", "another"),
        ("up = [0.0, 1.0, 0.0]", "up = [0, 0, 0]", "line 7: camera.up: ", "; "),
        ("= 60.0", "= 180.0", "line 8: camera.vertical_fov_degrees: ", "(0, 180)"),
        ("= 60.0", "= 0", "line 8: camera.vertical_fov_degrees: ", "(0, 180)"),
        ("vertical_fov_degrees = 60.0\n", "", "line 4: camera: ", "one of the two"),
        ("[160, 121]", "[0, 121]", "line 9: camera.resolution: ", "16384"),
        ("[160, 121]", "[160, 16385]", "line 9: camera.resolution: ", "16384"),
        ("[160, 121]", "[16384, 16385]", "line 9: camera.resolution: ", "16384"),
        ("[160, 121]", "[-160, 121]", "line 9: camera.resolution: ", "-160"),
        ("[160, 121]", "[99999999999, 121]", "line 9: camera.resolution: ", "99999999999"),
        ("= 100.0", "= 0.0", "line 10: camera.max_distance: ", "> 0"),
        ("= 100.0", "= inf", "line 10: camera.max_distance: ", "finite"),
        ("= 100.0", "= 100.0\nzoom = 3", "line 11: camera.zoom: unknown field `zoom`", "correct or remove"),
        ("kind = \"spot\"", "kind = \"laser\"", "line 13: light.kind: ", "`spot`"),
        ("kind = \"spot\"\n", "", "line 12: light: missing field `kind`", "add"),
        ("direction = [0.3, -1.0, 0.2]", "direction = [0, 0, 0]", "line 15: light.direction: ", "; "),
        ("direction = [0.3, -1.0, 0.2]\n", "", "line 12: light: a spot light needs `direction`", "add"),
        ("[10.0, 11.0, 12.0]", "[10.0, -11.0, 12.0]", "line 16: light.intensity: ", "≥ 0"),
        (
            "inner_cone_degrees = 20.0",
            "inner_cone_degrees = 26.0",
            "line 17: light.inner_cone_degrees: ",
            "outer",
        ),
        (
            "outer_cone_degrees = 25.0",
            "outer_cone_degrees = 95.0",
            "line 18: light.outer_cone_degrees: ",
            "90",
        ),
        ("[0.02, 0.03, 0.04]", "[0.02, -0.03, 0.04]", "line 21: medium.scattering: ", "≥ 0"),
        ("[0.0, 0.5, 0.0]", "[0.0, nan, 0.0]", "line 22: medium.absorption: ", "finite"),
        ("phase = \"henyey-greenstein\"", "phase = \"mie\"", "line 23: medium.phase: ", "`rayleigh`"),
        ("g = 0.25", "g = 1.0", "line 24: medium.g: ", "0.9999"),
        ("g = 0.25\n", "", "line 20: medium: ", "add it"),
        ("mesh = \"scene.obj\"", "mesh = \"none.obj\"", "line 2: mesh: cannot read ", "relative"),
        ("mesh = \"scene.obj\"", "mesh = 3", "line 2: mesh: ", "string"),
        (
            "mesh = \"scene.obj\"",
            "mesh = \"scene.obj\"\nresolution = [3, 3]",
            "line 3: resolution: ",
            "into [camera]",
        ),
        ("mesh = \"scene.obj\"", "mesh = ", "line 2", "TOML"),
        ("[medium]", "[medium", "line 20", "TOML"),
        ("[light]", "[camera]", "line 12", "TOML"),
    ];
    let mut wrong = Vec::new();
    for (old, new, place, part) in cases {
        let message = changed(old, new).expect_err(new);
        let is_placed = message.contains(&format!("some.toml: {place}"));
        if !(is_placed && message.contains(part) && message.contains("; ") && !message.contains('\n')) {
            wrong.push(format!("{new}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let lights =
        format!("{SHOT}[[lights]]\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = [1, -1, 1]\n");
    let message = load(&lights).unwrap_err();
    assert!(message.contains("line 28: lights[0].intensity: "), "{message}");
}

#[test]
fn a_missing_shot_file_and_one_that_is_no_text_are_errors() {
    let message = load_shot(Path::new("no/such.toml")).unwrap_err().to_string();
    assert!(message.starts_with("no/such.toml: cannot read: "), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("latin.toml");
    std::fs::write(&path, b"# caf\xe9\n").unwrap();
    assert!(load_shot(&path).unwrap_err().to_string().contains("latin.toml: line 1: the text is no UTF-8"));
}
