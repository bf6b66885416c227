//! Statements of OBJ texts, and the lines that faults name.

use super::*;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn scene(faces: &str) -> Scene {
    read(format!("{SQUARE}{faces}").as_bytes(), Path::new(""), &OccluderValues::default()).unwrap()
}

fn message(text: &str) -> String {
    read(text.as_bytes(), Path::new(""), &OccluderValues::default()).unwrap_err().to_string()
}

#[test]
fn coordinates_are_the_nearest_f64_to_their_decimals() {
    let scene = read(
        b"v 0.1 1e-3 -16777217.25\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        Path::new(""),
        &OccluderValues::default(),
    )
    .unwrap();
    assert_eq!(scene.positions[0], DVec3::new(0.1, 1e-3, -16777217.25));
}

#[test]
fn all_face_notations_mean_the_same_triangle() {
    for face in
        ["f 1 2 3", "f 1/9 2/9 3/9", "f 1//7 2//7 3//7", "f 1/1/1 2/2/2 3/3/3", "f -4 -3 -2", "f 1 \\\n 2 3"]
    {
        assert_eq!(scene(face).triangles, [[0, 1, 2]], "{face}");
    }
}

#[test]
fn polygons_become_fans_and_faces_may_come_before_their_vertices() {
    assert_eq!(scene("f 1 2 3 4").triangles, [[0, 1, 2], [0, 2, 3]]);
    let early = format!("f 1 2 3\n{SQUARE}");
    assert_eq!(
        read(early.as_bytes(), Path::new(""), &OccluderValues::default()).unwrap().triangles,
        [[0, 1, 2]]
    );
}

#[test]
fn a_polyline_is_no_face() {
    let scene = scene("l 1 2 3\np 1\nf 1 2 4\nf 1 2\nf 2 2 3");
    assert_eq!(scene.triangles, [[0, 1, 3]]);
    assert_eq!(scene.notes.len(), 3);
    assert!(scene.notes[1].starts_with("2 line"), "{:?}", scene.notes);
}

#[test]
fn weights_divide_and_colours_and_comments_do_not_matter() {
    let scene = read(
        b"\xff# caf\xe9\nv 2 4 6 2 # w\nv 1 0 0 .5 .5 .5\r\nv 0 1 0\nusemtl\nmtllib none.mtl\nvt x\nf 1 2 3",
        Path::new(""),
        &OccluderValues::default(),
    )
    .unwrap();
    assert_eq!(scene.positions, [DVec3::new(1.0, 2.0, 3.0), DVec3::X, DVec3::Y]);
}

#[test]
fn faults_name_their_line() {
    let line = |text: &str| message(&format!("{SQUARE}{text}"));
    for (text, place, part) in [
        ("f 1 2 9", "line 5", "index 9"),
        ("f 1 2 0", "line 5", "index 0"),
        ("f 1 2 -5", "line 5", "index -5"),
        ("f 1 2 99999999999999999999", "line 5", "vertex index"),
        ("\nf", "line 6", "without"),
        ("v nan 0 0\nf 1 2 5", "line 5", "finite"),
        ("v 0 1e400 0\nf 1 2 5", "line 5", "finite"),
        ("v 0 0 1 0\nf 1 2 5", "line 5", "finite"),
        ("v 0 1e16 0\nf 1 2 5", "line 5", "farther"),
        ("v 0 1", "line 5", "three"),
        ("v 0 1 z", "line 5", "`z`"),
    ] {
        let message = line(text);
        assert!(message.starts_with(place) && message.contains(part), "{text}: {message}");
    }
}

/// What `text` gives with values for points and lines.
fn valued(text: &str) -> Checked<Scene> {
    let particles = Some(crate::translucent::ParticleValues { radius: Some(0.5), density: Some(2.0) });
    let strands = Some(crate::translucent::StrandValues { radius: Some(0.1), opacity: Some(0.25) });
    read(format!("{SQUARE}{text}").as_bytes(), Path::new(""), &OccluderValues { particles, strands })
}

#[test]
fn points_are_particles_and_lines_strands_where_a_shot_gives_them_a_size() {
    let scene = valued("p 1 -1\np 3/7\nf 1 2 3\nl 1 2/5 5\nl 5 3\nl 3 4\nl 1 4\nv 2 2 2").unwrap();
    let centres: Vec<DVec3> = scene.particles.iter().map(|particle| particle.centre).collect();
    assert_eq!(centres, [DVec3::ZERO, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)]);
    assert!(scene.particles.iter().all(|particle| (particle.radius, particle.density) == (0.5, 2.0)));
    // The first three lines go on where the one before ended; a vertex may come later.
    let strands: Vec<Vec<DVec3>> =
        scene.strands.iter().map(|strand| strand.iter().map(|vertex| vertex.position).collect()).collect();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::splat(2.0), DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
    assert_eq!(strands, [corners.to_vec(), vec![DVec3::ZERO, DVec3::Y]]);
    assert!(scene.strands.vertices().iter().all(|vertex| (vertex.radius, vertex.opacity) == (0.1, 0.25)));
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn faults_of_points_and_lines_name_their_line() {
    for (text, place, part) in [
        ("p 9", "line 5", "index 9"),
        ("p 0", "line 5", "index 0"),
        ("p x", "line 5", "`x`"),
        ("l 1", "line 5", "less than two"),
        ("l", "line 5", "less than two"),
        ("l 1 2 9", "line 5", "index 9"),
        ("l 1 -9", "line 5", "index -9"),
        ("v nan 0 0\nl 1 5", "line 5", "finite"),
        ("v 0 inf 0\np 5", "line 5", "finite"),
    ] {
        let message = valued(text).unwrap_err().to_string();
        assert!(message.starts_with(place) && message.contains(part), "{text}: {message}");
    }
}
