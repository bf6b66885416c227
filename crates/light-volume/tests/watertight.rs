//! Meshes are closed: signed incidence on every piece of an edge sums to 0, for every kind of map and filling.

use light_volume::volume::polygons::{Closing, Quad, open_edge_count, quads};
use light_volume::volume::{SteppedVolume, Tessellation, Tolerance};
use scatter_core::{MapProjection, ShadowLayer};
use scatter_testing::Random;

fn maps(size: [u32; 2]) -> [MapProjection; 2] {
    let (position, forward, up) = ([1.0, 2.0, 3.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
    [
        MapProjection::orthographic(position, forward, up, [4.0, 3.0], size).unwrap(),
        MapProjection::perspective(position, forward, up, 0.8, size[0]).unwrap(),
    ]
}

fn fillings([width, height]: [u32; 2], seed: u64) -> Vec<(&'static str, Vec<f32>)> {
    let mut random = Random(seed);
    let mut fill = |depth: &mut dyn FnMut(&mut Random, u32, u32) -> f32| -> Vec<f32> {
        (0..width * height).map(|n| depth(&mut random, n % width, n / width)).collect()
    };
    vec![
        (
            "random",
            fill(&mut |r, _, _| if r.below(4) == 0 { f32::INFINITY } else { r.range(0.5, 9.0) as f32 }),
        ),
        ("few depths", fill(&mut |r, _, _| [2.0, 3.0, f32::INFINITY][r.below(3) as usize])),
        ("constant", fill(&mut |_, _, _| 4.0)),
        ("no surface", fill(&mut |_, _, _| f32::INFINITY)),
        ("checkerboard", fill(&mut |_, i, j| if (i + j) % 2 == 0 { 2.0 } else { 5.0 })),
        ("checkerboard of holes", fill(&mut |_, i, j| if (i + j) % 2 == 0 { 2.0 } else { f32::INFINITY })),
        (
            "a slope with a pit",
            fill(&mut |_, i, j| if i > 20 && j > 9 { 8.0 } else { 3.0 + 0.01 * (i + j) as f32 }),
        ),
    ]
}

fn tessellations() -> [Tessellation; 3] {
    [
        Tessellation::Static,
        Tessellation::Adaptive(Tolerance::EXACT),
        Tessellation::Adaptive(Tolerance { absolute: 0.2, relative: 0.0 }),
    ]
}

/// Six times the volume that the mesh encloses.
fn volume_of(quads: &[Quad]) -> f64 {
    let triple = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        glam::DVec3::from(a).dot(glam::DVec3::from(b).cross(glam::DVec3::from(c)))
    };
    quads
        .iter()
        .map(|q| {
            triple(q.corners[0], q.corners[1], q.corners[2])
                + triple(q.corners[0], q.corners[2], q.corners[3])
        })
        .sum()
}

#[test]
fn every_mesh_is_closed_and_encloses_what_its_texels_say() {
    let mut meshes = 0;
    for size in [[1, 1], [8, 8], [37, 23], [9, 64], [16, 33]] {
        for (what, texels) in fillings(size, 5) {
            for map in maps(size) {
                let texels = &texels[..(map.size()[0] * map.size()[1]).min(texels.len() as u32) as usize];
                let Ok(layer) = ShadowLayer::new(map, texels) else { continue };
                let mut faces = [0; 3];
                for (tessellation, faces) in tessellations().into_iter().zip(&mut faces) {
                    let mut volume = SteppedVolume::default();
                    volume.build(&layer, tessellation);
                    *faces = volume.face_count();
                    let far = 20.0;
                    let depth_of = |i, j| f64::from(volume.depth_at(&layer, i, j)).min(far);
                    let [width, height] = map.size();
                    let lit: f64 = (0..height)
                        .flat_map(|j| (0..width).map(move |i| (i, j)))
                        .map(|(i, j)| depth_of(i, j))
                        .sum();
                    let all = far * f64::from(width * height);
                    for (closing, expected) in [(Closing::Shadow, all - lit), (Closing::Light, lit)] {
                        let quads = quads(&volume, &layer, closing, far);
                        let apex = map.is_perspective() && closing == Closing::Light;
                        assert_eq!(
                            open_edge_count(&quads, apex),
                            0,
                            "{what} {size:?} {tessellation:?} {closing:?}"
                        );
                        // In map space a lamp's pyramid is a box whose end at depth 0 no face covers: its volume is still
                        // that of the faces, since the plane through the origin adds nothing.
                        let found = volume_of(&quads) / 6.0;
                        assert!(
                            (found - expected).abs() < 1e-9 * all,
                            "{what} {tessellation:?} {closing:?}: {found} {expected}"
                        );
                        meshes += 1;
                    }
                }
                assert!(
                    faces[1] <= faces[0] && faces[2] <= faces[1],
                    "never more faces than static: {faces:?}"
                );
            }
        }
    }
    println!("{meshes} meshes");
}

#[test]
fn a_mesh_without_one_face_is_open() {
    let texels: Vec<f32> = (0..20).map(|n| 1.0 + n as f32).collect();
    let map = maps([5, 4])[0];
    let layer = ShadowLayer::new(map, &texels).unwrap();
    let mut volume = SteppedVolume::default();
    volume.build(&layer, Tessellation::Static);
    let all = quads(&volume, &layer, Closing::Shadow, 30.0);
    for left_out in 0..all.len() {
        let mut rest = all.clone();
        rest.remove(left_out);
        assert!(open_edge_count(&rest, false) > 0, "{:?}", all[left_out]);
    }
}
