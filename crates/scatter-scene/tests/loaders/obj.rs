//! OBJ files through `load_scene`, against the crate `tobj` as an independent reader.

use std::path::Path;

use crate::common::{load_bytes, shared_folder};
use scatter_scene::load_scene;

/// Corner positions of all triangles, in the file's order, by tobj in f64.
fn corners_by_tobj(path: &Path) -> Vec<[f64; 3]> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let bytes = std::fs::read(path).unwrap();
    let (models, _) =
        tobj::load_obj_buf(&mut bytes.as_slice(), &options, |_| Ok(Default::default())).unwrap();
    let corners = models.iter().flat_map(|model| {
        let mesh = &model.mesh;
        mesh.indices.iter().map(|&i| [0, 1, 2].map(|axis| mesh.positions[3 * i as usize + axis]))
    });
    corners.collect()
}

fn assert_equal_to_tobj(path: &Path) {
    let scene = load_scene(path).unwrap();
    let corners: Vec<[f64; 3]> =
        scene.triangles.iter().flatten().map(|&i| scene.positions[i as usize].to_array()).collect();
    let others = corners_by_tobj(path);
    assert_eq!(corners.len(), others.len(), "{}: {:?}", path.display(), scene.notes);
    // Both parse decimals to the nearest f64: equal to the last bit.
    assert!(corners == others, "{}", path.display());
    println!("{}: {} triangles", path.display(), scene.triangles.len());
}

#[test]
fn generated_polygons_of_all_notations_equal_tobjs() {
    let mut text = String::new();
    for i in 0..60 {
        let (x, y) = (0.1 * f64::from(i), 1e-3 * f64::from(i * i % 17));
        text += &format!("v {x} {y} -{i}.25\nvt 0.5 {x}\nvn 0 0 1\n");
        let n = i + 1;
        match i % 4 {
            3 => text += &format!("f {n} {} {} {}\n", n - 1, n - 2, n - 3),
            2 if i > 8 => text += &format!("f -1/-1 -3/-3 -5/-5 -7/-7 -8/-8\ng part{i}\n"),
            1 if i > 8 => text += &format!("f {n}//{n} {0}//{0} 1//1\n", n - 4),
            _ => {}
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("generated.obj");
    std::fs::write(&path, text).unwrap();
    assert_equal_to_tobj(&path);
}

#[test]
fn an_obj_without_faces_is_an_error_with_its_cure() {
    let message =
        load_bytes("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\nl 1 2 3\n").unwrap_err().to_string();
    assert!(message.contains("points.obj: no triangles; export faces"), "{message}");
}

#[test]
fn shared_meshes_equal_tobjs() {
    let Some(folder) = shared_folder("shared_meshes_equal_tobjs") else { return };
    let mut count = 0;
    for case in std::fs::read_dir(folder.join("cases")).unwrap() {
        let path = case.unwrap().path().join("scene.obj");
        if path.is_file() {
            assert_equal_to_tobj(&path);
            count += 1;
        }
    }
    assert!(count > 0, "no case has an OBJ");
    assert_equal_to_tobj(&folder.join("scenes/sponza.obj"));
}
