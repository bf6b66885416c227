//! The interpolated surface's meshes: every edge has two triangles of opposite sense, no vertex lies within an edge, and adaptive
//! ones are off by the threshold at the most; for every kind of map and filling, and for all sixteen stitchings.

use std::collections::HashSet;

use light_volume::volume::triangles::{Triangle, open_edge_count, triangles, unpaired_edge_count};
use light_volume::volume::{HeightField, Tessellation, Tolerance, code_of};
use scatter_core::{MapProjection, ShadowLayer};
use scatter_testing::Random;

/// Behind all surfaces.
const FAR: f64 = 40.0;

fn maps(size: [u32; 2]) -> Vec<MapProjection> {
    let (position, forward, up) = ([1.0, 2.0, 3.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
    let mut maps = vec![MapProjection::orthographic(position, forward, up, [4.0, 3.0], size).unwrap()];
    if size[0] == size[1] {
        maps.push(MapProjection::perspective(position, forward, up, 0.8, size[0]).unwrap());
        maps.extend((0..6).map(|face| MapProjection::cube_face(position, face, size[0]).unwrap()));
    }
    maps
}

/// Fillings, and whether they have holes.
fn fillings([width, height]: [u32; 2], seed: u64) -> Vec<(&'static str, bool, Vec<f32>)> {
    let mut random = Random(seed);
    let mut fill = |depth: &mut dyn FnMut(&mut Random, u32, u32) -> f32| -> Vec<f32> {
        (0..width * height).map(|n| depth(&mut random, n % width, n / width)).collect()
    };
    let hill = |i: u32, j: u32| 9.0 + (0.05 * f64::from(i)).sin() as f32 + (0.03 * f64::from(j)).cos() as f32;
    vec![
        ("random", false, fill(&mut |r, _, _| r.range(0.5, 9.0) as f32)),
        ("constant", false, fill(&mut |_, _, _| 4.0)),
        ("no surface", true, fill(&mut |_, _, _| f32::INFINITY)),
        ("checkerboard", false, fill(&mut |_, i, j| if (i + j) % 2 == 0 { 2.0 } else { 5.0 })),
        (
            "checkerboard of holes",
            true,
            fill(&mut |_, i, j| if (i + j) % 2 == 0 { 2.0 } else { f32::INFINITY }),
        ),
        (
            "random with holes",
            true,
            fill(&mut |r, _, _| if r.below(4) == 0 { f32::INFINITY } else { r.range(0.5, 9.0) as f32 }),
        ),
        ("hills", false, fill(&mut |_, i, j| hill(i, j))),
        ("hills with posts", false, fill(&mut |r, i, j| if r.below(90) == 0 { 3.0 } else { hill(i, j) })),
        (
            "hills with pits",
            true,
            fill(&mut |r, i, j| if r.below(300) == 0 { f32::INFINITY } else { hill(i, j) }),
        ),
    ]
}

fn tessellations(map: &MapProjection) -> [Tessellation; 4] {
    let share = |threshold: f32| {
        let (absolute, relative) =
            if map.is_perspective() { (0.0, threshold) } else { (9.0 * threshold, 0.0) };
        Tessellation::Adaptive(Tolerance { absolute, relative })
    };
    [Tessellation::Static, share(0.0), share(0.002), share(0.05)]
}

/// Vertices that lie within an edge of the surface, seen along the light.
fn t_junctions(mesh: &[Triangle]) -> usize {
    // In halves of texels; walls and the lid have the surface's vertices.
    let halves = |corner: [f64; 3]| [0, 1].map(|axis| (2.0 * corner[axis]) as i32);
    let vertices: HashSet<[i32; 2]> = mesh.iter().flat_map(|triangle| triangle.corners).map(halves).collect();
    let mut found = 0;
    for triangle in mesh {
        for n in 0..3 {
            let ([ax, ay], [bx, by]) = (halves(triangle.corners[n]), halves(triangle.corners[(n + 1) % 3]));
            let steps = (bx - ax).abs().max((by - ay).abs());
            let on_grid = |step: &i32| (bx - ax) * step % steps == 0 && (by - ay) * step % steps == 0;
            let between = (1..steps).filter(on_grid);
            found += between
                .filter(|step| {
                    vertices.contains(&[ax + (bx - ax) * step / steps, ay + (by - ay) * step / steps])
                })
                .count();
        }
    }
    found
}

#[test]
fn every_edge_has_two_triangles_of_opposite_sense_and_no_vertex_within_it() {
    let (mut meshes, mut seen) = (0, HashSet::new());
    for size in [[1, 1], [8, 8], [37, 23], [9, 64], [16, 16], [16, 33], [70, 60]] {
        for (what, has_holes, texels) in fillings(size, 5) {
            // All six faces of a cube where they are small.
            for map in maps(size).into_iter().take(if size[0] > 50 { 1 } else { 8 }) {
                let layer = ShadowLayer::new(map, &texels).unwrap();
                let mut least = u64::MAX;
                for tessellation in tessellations(&map) {
                    let mut field = HeightField::default();
                    field.build(&layer, tessellation);
                    field.for_each_facet(|facet, _| {
                        seen.insert(facet.finer());
                    });
                    let mesh = triangles(&field, &layer, FAR);
                    let name = format!("{what} {size:?} {tessellation:?}");
                    assert_eq!(open_edge_count(&mesh), 0, "{name}");
                    assert_eq!(t_junctions(&mesh), 0, "{name}");
                    if !has_holes {
                        assert_eq!(unpaired_edge_count(&mesh), 0, "{name}");
                    }
                    assert!(field.triangle_count() <= least, "{name}: never more triangles than finer ones");
                    least = field.triangle_count();
                    meshes += 1;
                }
            }
        }
    }
    println!("{meshes} meshes, stitchings {seen:?}");
    assert_eq!(seen.len(), 16, "all of them: {seen:?}");
}

#[test]
fn a_mesh_without_one_triangle_is_open() {
    let texels: Vec<f32> = (0..20).map(|n| if n == 7 { f32::INFINITY } else { 1.0 + n as f32 }).collect();
    let layer = ShadowLayer::new(maps([5, 4])[0], &texels).unwrap();
    let mut field = HeightField::default();
    field.build(&layer, Tessellation::Static);
    let all = triangles(&field, &layer, FAR);
    for left_out in 0..all.len() {
        let mut rest = all.clone();
        rest.remove(left_out);
        assert!(open_edge_count(&rest) > 0, "{:?}", all[left_out]);
        assert!(unpaired_edge_count(&rest) > 0);
    }
}

/// At every vertex of the base grid: between them both surfaces are linear on the pieces of their common division, whose other vertices
/// lie on edges of the base grid.
#[test]
fn adaptive_meshes_are_off_by_the_threshold_at_the_most() {
    let mut worst = 0.0f64;
    for size in [[100, 100], [130, 70]] {
        for (what, _, texels) in fillings(size, 9) {
            for map in maps(size).into_iter().take(2) {
                let layer = ShadowLayer::new(map, &texels).unwrap();
                for threshold in [1e-3f32, 0.01, 0.05] {
                    let tolerance = if map.is_perspective() {
                        Tolerance { absolute: 0.0, relative: threshold }
                    } else {
                        Tolerance { absolute: threshold, relative: 0.0 }
                    };
                    let mut field = HeightField::default();
                    field.build(&layer, Tessellation::Adaptive(tolerance));
                    for (n, depth) in texels.iter().enumerate().filter(|(_, depth)| depth.is_finite()) {
                        let [i, j] = [n as u32 % size[0], n as u32 / size[0]];
                        let Some(facet) = field.facet_at(&layer, [i, j], [true, true]) else { continue };
                        let code = facet.code_at([f64::from(i) + 0.5, f64::from(j) + 0.5]);
                        let exact = f64::from(code_of(*depth, map.is_perspective()));
                        let off = if map.is_perspective() {
                            (exact / code - 1.0).abs()
                        } else {
                            (code - exact).abs()
                        };
                        // Codes are rounded to 2⁻²⁴ of themselves.
                        let rounding = if map.is_perspective() { 1e-6 } else { 1e-6 * exact };
                        worst = worst.max((off - rounding) / f64::from(threshold));
                        assert!(
                            off <= f64::from(threshold) + rounding,
                            "{what} {i} {j}: {off} of {threshold}"
                        );
                    }
                }
            }
        }
    }
    println!("off by {worst:.2} of the threshold");
    assert!(worst > 0.3, "thresholds are used: {worst}");
}
