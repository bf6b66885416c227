//! The door for scene files: picks the reader by extension and holds the limits that all readers share.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::DVec3;

use crate::error::{Checked, Fault, SceneError};
use crate::scene::Scene;

/// Most triangles of one scene, instances included. A scene at the limit takes 1.2 GB for its indices; a file of a
/// few kilobytes can ask for any number through instancing, so there must be one.
pub const MAX_TRIANGLES: u64 = 100_000_000;

/// Most vertices of one scene: 2.4 GB of positions, and every index fits a `u32`.
pub const MAX_POSITIONS: u64 = 100_000_000;

/// Largest coordinate of a vertex \[world units\], either sign. Beyond it products of two edges leave the range of
/// the f32 acceleration structures, and f64 resolves no more than a tenth of a unit anyway.
pub const MAX_COORDINATE: f64 = 1e15;

/// A vertex this many times farther out than nine tenths of the scene is told: ground planes and skies reach some
/// thousand times as far as a model, mistakes 10⁹ times and more.
const STRAY_FACTOR: f64 = 1e6;

/// Longest file that is read, in bytes. Larger meshes exceed [`MAX_POSITIONS`] in every format.
const MAX_FILE_BYTES: u64 = 8 << 30;

/// Loads an OBJ, glTF or GLB file (by extension, in any case) as world-space triangles with cameras and lights.
///
/// Never panics, and allocates in proportion to the file and to the triangles that it really has, up to
/// [`MAX_TRIANGLES`]. A file without a single triangle is an error; zero-area triangles with three different
/// indices are kept, those that repeat an index (strips are joined with them) are dropped.
pub fn load_scene(path: &Path) -> Result<Scene, SceneError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let scene = match extension.as_str() {
        "obj" => crate::obj::read(&read_file(path)?, path.parent().unwrap_or(Path::new(""))),
        "gltf" | "glb" => crate::gltf::read(&read_file(path)?, path.parent().unwrap_or(Path::new(""))),
        _ => Err(Fault::unsupported(
            "",
            "this is no scene file by its name",
            "give an .obj, .gltf or .glb file",
        )),
    };
    scene.and_then(checked_scene).map_err(|fault| fault.in_file(path))
}

/// Reads a whole file whose size is sane.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    let open = || {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        Ok((file, metadata))
    };
    let (mut file, metadata) = open().map_err(|e| SceneError::read(path, e))?;
    if !metadata.is_file() {
        // A pipe or a device could go on for ever.
        return Err(Fault::invalid("", "this is not a regular file", "name a file").in_file(path));
    }
    if metadata.len() > MAX_FILE_BYTES {
        let problem = format!("{} bytes, more than the limit of {MAX_FILE_BYTES}", metadata.len());
        return Err(Fault::too_large("", problem, "split or simplify the file").in_file(path));
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|e| SceneError::read(path, e))?;
    Ok(bytes)
}

/// The place's position if it is finite and not absurdly far away.
pub(crate) fn checked_position(p_world: DVec3, place: impl Fn() -> String) -> Checked<DVec3> {
    if p_world.abs().max_element() <= MAX_COORDINATE && p_world.is_finite() {
        return Ok(p_world);
    }
    let [x, y, z] = p_world.to_array();
    let problem = if p_world.is_finite() {
        format!("the vertex ({x:e}, {y:e}, {z:e}) is farther than {MAX_COORDINATE:e} units from the origin")
    } else {
        format!("the vertex ({x}, {y}, {z}) is not finite")
    };
    Err(Fault::invalid(place(), problem, "export the mesh with finite coordinates of a sane size"))
}

/// Refuses a scene that would grow beyond the limits.
pub(crate) fn checked_counts(place: impl Fn() -> String, triangles: u64, positions: u64) -> Checked<()> {
    let (count, what, limit) = if triangles > MAX_TRIANGLES {
        (triangles, "triangles", MAX_TRIANGLES)
    } else if positions > MAX_POSITIONS {
        (positions, "vertices", MAX_POSITIONS)
    } else {
        return Ok(());
    };
    let problem = format!("the scene has {count} {what} or more, the limit is {limit}");
    Err(Fault::too_large(place(), problem, "simplify it, or use fewer instances"))
}

fn checked_scene(mut scene: Scene) -> Checked<Scene> {
    if scene.triangles.is_empty() {
        let cure = "export faces: points, lines and triangles that repeat an index do not count";
        return Err(Fault::invalid("", "no triangles", cure));
    }
    debug_assert!(scene.triangles.iter().flatten().all(|&i| (i as usize) < scene.positions.len()));
    debug_assert!(scene.cutouts.is_sorted_by(|a, b| a.triangle < b.triangle));
    scene.notes.extend(stray_vertex(&scene));
    Ok(scene)
}

/// A line about the farthest vertex if it lies absurdly far from the others: boxes, maps and views then have to span it.
fn stray_vertex(scene: &Scene) -> Option<String> {
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
