//! Writes named groups of faces as a Wavefront OBJ file.

use super::mesh::Mesh;
use std::fmt::Write;

/// The text of an OBJ file with one object a mesh. Numbers are the shortest that read back as the same f32.
///
/// Every second object counts its vertices backwards from the latest (negative indices), which the format
/// allows and loaders must handle.
pub(crate) fn obj_text(title: &str, objects: &[(&str, &Mesh)]) -> String {
    let mut text = format!("# {title}\n");
    let mut first_vertex = 1;
    for (number, (name, mesh)) in objects.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "o {name}");
        for [x, y, z] in &mesh.positions {
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        let count = mesh.positions.len() as i64;
        for corners in &mesh.triangles {
            let offset = if number % 2 == 0 { first_vertex } else { -count };
            let [a, b, c] = corners.map(|index| i64::from(index) + offset);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        first_vertex += count;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn both_ways_of_counting_name_the_right_vertices() {
        let mut near = Mesh::default();
        near.add_box(DVec3::ZERO, DVec3::ONE);
        let mut far = Mesh::default();
        far.add_box(DVec3::splat(5.0), DVec3::splat(6.5));
        let text = obj_text("two boxes", &[("near", &near), ("far", &far)]);
        let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
        let (models, _) =
            tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| Err(tobj::LoadError::GenericFailure))
                .expect("a valid file");
        assert_eq!(models.iter().map(|model| model.name.as_str()).collect::<Vec<_>>(), ["near", "far"]);
        for (model, mesh) in models.iter().zip([&near, &far]) {
            assert_eq!(model.mesh.indices.len(), 3 * mesh.triangles.len());
            for (&index, &expected) in model.mesh.indices.iter().zip(mesh.triangles.iter().flatten()) {
                let position = &model.mesh.positions[3 * index as usize..][..3];
                assert_eq!(position, mesh.positions[expected as usize].map(f64::from));
            }
        }
    }
}
