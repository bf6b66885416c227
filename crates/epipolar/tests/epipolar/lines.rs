//! Lines of slices through maps, point by point: what a view ray is on them, and which view ray ends a surface.

use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::{Epipole, Major};
use epipolar::rows::{MapLine, MapLineRecord, MinMaxTiles};
use proptest::prelude::*;
use scatter_core::{Frame, simd_level};
use scatter_testing::{Facing, MapKind, Random, SliceCase, Texels, slice_cases};

/// Calls `check` with slices through some pixels, the pixel's column, and the slices' lines with their layers.
fn each_line(case: SliceCase, mut check: impl FnMut(&Frame<'_>, &SliceView<'_>, u32, usize, &MapLine)) {
    let scene = case.frame();
    scene.with(|frame| {
        let epipole = Epipole::new(frame.camera(), frame.light());
        let tiles = MinMaxTiles::default();
        let slices = SliceScene { frame, epipole, tiles: &tiles, simd: simd_level() };
        let mut angles = SliceAngles::default();
        for pixel in [[2, 1], [9, 6], [5, 3]] {
            let Some((slice, column)) = SliceView::through_pixel(slices, pixel, &mut angles) else {
                continue;
            };
            let slice = slice.up_to(if slice.light.lamp_distance().is_some() { 2.0 } else { 20.0 });
            slice.for_each_line(|layer, line| {
                // In a map of one column both strides are 1, and nothing tells its axes apart.
                if frame.shadow().layer(layer).is_some_and(|map| map.projection().size()[0] > 1) {
                    check(frame, &slice, column, layer, &line);
                }
            });
        }
    });
}

/// Texel along the line's major axis at t.
fn major_texel(line: &MapLine, t: f64) -> f64 {
    let (first, consumed) = (f64::from(line.first), f64::from(line.consumed));
    if line.advance > 0 { first + consumed + t } else { first + 1.0 - consumed - t }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// The line's numbers are f32 where texels are counted (up to 16 of them: 1e-6), and f64 where depths are.
    #[test]
    fn a_view_ray_on_a_line_has_the_depths_that_the_map_gives_its_points(case in slice_cases(), share in 0.02..0.98f64) {
        each_line(case, |frame, slice, column, layer, line| {
            let ray = line.view_ray(&slice.plane, f64::from(column));
            let t = share * f64::from(line.length);
            let depth = ray.depth(t);
            let projection = frame.shadow().layers().nth(layer).unwrap();
            let projection = projection.projection();
            // The point of the view ray that the map sees at the line's texel: u of the major axis is linear in numerator
            // and denominator along the ray, so it is found by a quotient.
            let view = slice.view_ray(column);
            let on_map = projection.ray(frame.camera().eye(), view.origin, view.direction);
            let axis = usize::from(line.strides[0] != 1);
            let (w, dw) = if projection.is_perspective() { (on_map.start.z, on_map.step.z) } else { (1.0, 0.0) };
            let texel = major_texel(line, t);
            let s = (on_map.start[axis] - texel * w) / (texel * dw - on_map.step[axis]);
            let found = on_map.start.z + on_map.step.z * s;
            // A slice along a texel row has no texel to be found by; rays along the light have no single depth.
            let slant = (texel * dw - on_map.step[axis]).abs();
            if slant < 1e-2 || !found.is_finite() || found.abs() > 1e3 {
                return;
            }
            // An error of 2e-6 texels is one of 2e-6/slant along the ray.
            let tolerance = 1e-4 * found.abs().max(1.0) / slant.min(1.0) * found.abs().max(1.0);
            assert!((depth - found).abs() <= tolerance, "{case:?}: {depth} {found}, slant {slant}");
        });
    }

    #[test]
    fn the_view_coordinate_of_a_surface_is_where_the_camera_sees_it(case in slice_cases(), share in 0.02..0.98f64) {
        let mut random = Random(case.seed);
        each_line(case, |frame, slice, _, layer, line| {
            let t = share * f64::from(line.length);
            let depth = random.range(0.3, 8.0);
            let columns = slice.order.count() as f64;
            let found = f64::from(line.view_coordinate(t as f32, depth as f32, columns as f32));
            // The world point on the light ray of the texel at t.
            let projection = frame.shadow().layers().nth(layer).unwrap();
            let [start, slope] = line.minor.map(f64::from);
            let (major, minor) = (major_texel(line, t), start + slope * t);
            let (u, v) = if line.strides[0] == 1 { (major, minor) } else { (minor, major) };
            let (origin, step) = projection.projection().light_ray(u, v).unwrap();
            let seen = frame.camera().image_from_direction(origin + step * depth - frame.camera().eye());
            if seen.z <= 1e-3 {
                return; // Behind the camera.
            }
            let column = if slice.major == Major::X { seen.x } else { seen.y } / seen.z;
            let [first, end] = slice.order.columns.map(f64::from);
            let lit = if slice.order.ascending { column + 0.5 - first } else { end + 0.5 - column };
            // Positions of 1e-6 of a scene of size 16, seen at a distance of z.
            let tolerance = 1e-3 / seen.z.min(1.0);
            assert!((found - lit.clamp(0.0, columns)).abs() <= tolerance, "{case:?}: {found} {lit} of {columns}");
        });
    }
}

#[test]
fn a_record_for_a_gpu_has_the_numbers_of_its_line_and_no_padding() {
    // Sixteen-byte rows, as uniform buffers want them.
    assert_eq!(size_of::<MapLineRecord>() % 16, 0);
    let case = SliceCase {
        seed: 4,
        kind: MapKind::Orthographic,
        texels: Texels::Random,
        facing: Facing::Across,
        outside: false,
    };
    let mut lines = 0;
    each_line(case, |_, _, _, _, line| {
        let record = MapLineRecord::from(line);
        assert_eq!((record.columns, record.first, record.length), (line.columns, line.first, line.length));
        // γ by the record's numbers.
        assert_eq!(record.gamma_kind, 0);
        assert_eq!(record.gamma[0] + record.gamma[1] * 1.5, line.gamma.at(1.5));
        assert_eq!(record.lit_columns[..4], line.lit_columns[0]);
        lines += 1;
    });
    assert!(lines > 0);
}
