//! The door for scene files: picks the reader by extension.

use std::path::Path;

use glam::DVec3;

use crate::error::{Checked, Fault, SceneError};
use crate::regular_file::read_file;
use crate::scene::Scene;
use crate::translucent::OccluderValues;

/// A vertex this many times farther out than nine tenths of the scene is told: ground planes and skies reach some
/// thousand times as far as a model, mistakes 10⁹ times and more.
const STRAY_FACTOR: f64 = 1e6;

/// Loads an OBJ, glTF or GLB file (by extension, in any case) as world-space triangles with cameras and lights.
///
/// glTF points with `_RADIUS` and `_DENSITY`, and lines with `_RADIUS` and `_OPACITY`, become [`Scene::particles`] and
/// [`Scene::strands`]; a shot file's `[particles]` and `[strands]` give these to points and lines that lack them, OBJ's too.
///
/// Materials whose alpha cuts parts out (glTF's `alphaMode` MASK, OBJ's `map_d`) become [`Scene::cutouts`]; images and
/// libraries beside the file are read for that. Everything that changes the picture and is not done (blending,
/// transmission, a light's range, other points and lines, extensions that are not read) is an error or stands in
/// [`Scene::notes`] by its name.
///
/// Never panics, and allocates in proportion to the file and to the triangles that it really has, up to
/// [`MAX_TRIANGLES`](crate::MAX_TRIANGLES). A file without a single triangle, particle or strand is an error; zero-area triangles with three different
/// indices are kept, those that repeat an index (strips are joined with them) are dropped.
pub fn load_scene(path: &Path) -> Result<Scene, SceneError> {
    load_scene_with(path, &OccluderValues::default())
}

/// As [`load_scene`], with values for points and lines that have none of their own.
pub(crate) fn load_scene_with(path: &Path, values: &OccluderValues) -> Result<Scene, SceneError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let scene = match extension.as_str() {
        "obj" => crate::obj::read(&read_file(path)?, path.parent().unwrap_or(Path::new("")), values),
        "gltf" | "glb" => {
            crate::gltf::read(&read_file(path)?, path.parent().unwrap_or(Path::new("")), values)
        }
        _ => Err(Fault::unsupported(
            "",
            "this is no scene file by its name",
            "give an .obj, .gltf or .glb file",
        )),
    };
    scene.and_then(checked_scene).map_err(|fault| fault.in_file(path))
}

fn checked_scene(mut scene: Scene) -> Checked<Scene> {
    if scene.triangles.is_empty() && scene.particles.is_empty() && scene.strands.is_empty() {
        let cure = "export faces: points, lines and triangles that repeat an index do not count, but for \
                    those that a shot's [particles] or [strands], or attributes of their own, give a size";
        return Err(Fault::invalid("", "no triangles", cure));
    }
    debug_assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()));
    debug_assert!(scene.cutouts.is_sorted_by(|a, b| a.triangle < b.triangle));
    scene.notes.extend(stray_vertex(&scene));
    Ok(scene)
}

/// A line about the farthest vertex if it lies absurdly far from the others: boxes, maps and views then have to span it.
fn stray_vertex(scene: &Scene) -> Option<String> {
    if scene.triangles.is_empty() {
        return None;
    }
    // A thousand vertices tell where most are; the median is not moved by the stray ones.
    const SAMPLES: usize = 1000;
    let step = scene.triangles.len().div_ceil(SAMPLES);
    let samples = || scene.triangles.iter().step_by(step).flatten().map(|&i| scene.positions[i as usize]);
    let value_at = |mut values: Vec<f64>, share: f64| {
        let at = ((values.len() - 1) as f64 * share) as usize;
        *values.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let median = |axis: usize| value_at(samples().map(|p| p[axis]).collect(), 0.5);
    let middle = DVec3::new(median(0), median(1), median(2));
    let size = value_at(samples().map(|p| p.distance(middle)).collect(), 0.9);
    let is_stray = |p: &DVec3| size > 0.0 && p.distance_squared(middle) > (STRAY_FACTOR * size).powi(2);
    // Nearly always there is none; whether a face uses it is asked only then.
    scene.positions.iter().find(|p| is_stray(p))?;
    let used = scene.triangles.iter().flatten().map(|&i| scene.positions[i as usize]);
    let farthest = used.max_by(|a, b| a.distance_squared(middle).total_cmp(&b.distance_squared(middle)))?;
    let distance = farthest.distance(middle);
    is_stray(&farthest).then(|| {
        let [x, y, z] = farthest.to_array();
        format!(
            "the vertex ({x:e}, {y:e}, {z:e}) lies {distance:.1e} units from the middle of the scene, of which most \
             lies within {size:.1e}: remove it if it is a mistake"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(path: &Path) -> String {
        load_scene(path).unwrap_err().to_string()
    }

    #[test]
    fn the_extension_chooses_the_reader_in_any_case() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.OBJ");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        assert_eq!(load_scene(&path).unwrap().triangles, [[0, 1, 2]]);
        let other = folder.path().join("a.stl");
        std::fs::write(&other, "solid").unwrap();
        assert!(message(&other).contains(".glb"));
    }

    #[test]
    fn missing_files_folders_and_empty_files_are_errors_that_name_them() {
        let folder = tempfile::tempdir().unwrap();
        assert!(message(&folder.path().join("none.glb")).contains("none.glb: cannot read"));
        std::fs::create_dir(folder.path().join("dir.glb")).unwrap();
        assert!(message(&folder.path().join("dir.glb")).contains("regular file"));
        for name in ["empty.obj", "empty.gltf", "empty.glb"] {
            std::fs::write(folder.path().join(name), "").unwrap();
            assert!(message(&folder.path().join(name)).contains(name));
        }
    }
}
