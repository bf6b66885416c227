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

/// The points of a grid over the square from (0, 0) to (4, 4) that some triangle covers, by how many, seen along z.
fn coverage(scene: &scatter_scene::Scene) -> Vec<usize> {
    let turn = |a: glam::DVec2, b: glam::DVec2, p: glam::DVec2| (b - a).perp_dot(p - a);
    let covers = |triangle: &[u32; 3], p: glam::DVec2| {
        let [a, b, c] = triangle.map(|i| scene.positions[i as usize].truncate());
        let turns = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
        turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0)
    };
    let points = (0..8).flat_map(|y| {
        (0..8).map(move |x| glam::DVec2::new(0.2371 + 0.5 * x as f64, 0.2613 + 0.5 * y as f64))
    });
    points.map(|p| scene.triangles.iter().filter(|triangle| covers(triangle, p)).count()).collect()
}

#[test]
fn concave_and_keyhole_polygons_cover_their_inside_once_wherever_they_stand() {
    // An L, and a square with a square hole behind a keyhole; the corners' indices may repeat or their places may.
    let ell = "v 0 0 0\nv 4 0 0\nv 4 1.5 0\nv 1.5 1.5 0\nv 1.5 4 0\nv 0 4 0\n";
    let in_ell = |x: f64, y: f64| x < 1.5 || y < 1.5;
    let ring = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nv 0 0 0\nv 1 1 0\n";
    let in_ring = |x: f64, y: f64| !((1.0..3.0).contains(&x) && (1.0..3.0).contains(&y));
    type Inside = fn(f64, f64) -> bool;
    let cases: [(&str, &str, Inside); 5] = [
        (ell, "f 1 2 3 4 5 6", in_ell),
        (ell, "f 4 5 6 1 2 3", in_ell),
        (ell, "f -1 -2 -3 -4 -5 -6", in_ell),
        (ring, "f 1 2 3 4 1 5 6 7 8 5", in_ring),
        (ring, "f 1 2 3 4 9 5 6 7 8 10", in_ring),
    ];
    for (vertices, face, inside) in cases {
        // Before and after their vertices; flat and slightly bent.
        for text in [
            format!("{vertices}{face}\n"),
            format!("{}\n{vertices}", face.replace("-1 -2 -3 -4 -5 -6", "6 5 4 3 2 1")),
            format!("{}{face}\n", vertices.replace("v 4 0 0", "v 4 0 0.001")),
        ] {
            let scene = load_bytes("p.obj", text.as_bytes()).unwrap();
            let wanted: Vec<usize> = (0..8)
                .flat_map(|y| (0..8).map(move |x| (0.2371 + 0.5 * f64::from(x), 0.2613 + 0.5 * f64::from(y))))
                .map(|(x, y)| usize::from(inside(x, y)))
                .collect();
            assert_eq!(coverage(&scene), wanted, "{text}");
            assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        }
    }
    let crossed = load_bytes("p.obj", b"v 0 0 0\nv 3 2 0\nv 3 0 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    assert!(crossed.notes[0].contains("cross themselves, the first in line 5"), "{:?}", crossed.notes);
    assert_eq!(crossed.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn byte_order_marks_line_ends_and_latin_1_change_nothing_and_wide_encodings_are_told() {
    let text = "# \u{e9}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let expected = load_bytes("a.obj", text.as_bytes()).unwrap().positions;
    let latin: Vec<u8> = text.chars().map(|c| u32::from(c) as u8).collect();
    for bytes in [
        format!("\u{feff}{}", &text[5..]).into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        format!("# D:\\houses\\\n{text}").into_bytes(),
        latin,
    ] {
        assert_eq!(load_bytes("a.obj", &bytes).unwrap().positions, expected, "{bytes:?}");
    }
    let wide: Vec<u8> = format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_be_bytes).collect();
    let message = load_bytes("a.obj", &wide).unwrap_err().to_string();
    assert!(message.contains("a.obj: the text is UTF-16 (big endian); save it as UTF-8"), "{message}");
    // Lines count the same, however they end.
    for end in ["\n", "\r\n", "\r"] {
        let message =
            load_bytes("a.obj", ["v 0 0 0", "", "f 1 x 1"].join(end).as_bytes()).unwrap_err().to_string();
        assert!(message.contains("line 3"), "{message}");
    }
}

#[test]
fn a_vertex_that_is_no_number_matters_only_to_faces_that_use_it() {
    for word in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND", "inf", "1e400"] {
        let text = format!("v {word} 0 0\nv 0 0 0\nv 1 0 0\nv 0 {word} 0\nv 0 1 0\nf 2 3 5\nf 5 3 2\n");
        let scene = load_bytes("n.obj", text.as_bytes()).unwrap();
        assert_eq!(scene.triangles, [[0, 1, 2], [2, 1, 0]]);
        assert_eq!(scene.positions, [glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y]);
        assert!(scene.notes.is_empty());
        let message = load_bytes("n.obj", format!("{text}f 2 3 4\n").as_bytes()).unwrap_err().to_string();
        assert!(
            message.contains("n.obj: line 4: the vertex (0, ") && message.contains("not finite"),
            "{message}"
        );
    }
}

#[test]
fn a_vertex_that_lies_absurdly_far_out_is_told() {
    let mut text: String = (0..30).map(|i| format!("v {} {} 0\n", i % 6, i / 6)).collect();
    text += "f 1 2 8\nf 9 10 16\nf 17 18 24\nf 3 4 10\nf 20 21 27\n";
    assert!(load_bytes("s.obj", text.as_bytes()).unwrap().notes.is_empty());
    text += "v 1e13 0 0\n";
    assert!(load_bytes("s.obj", text.as_bytes()).unwrap().notes.is_empty(), "no face uses it");
    text += "f 1 2 31\n";
    let notes = load_bytes("s.obj", text.as_bytes()).unwrap().notes;
    assert!(
        notes.len() == 1 && notes[0].contains("the vertex (1e13, 0e0, 0e0) lies 1.0e13 units"),
        "{notes:?}"
    );
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
