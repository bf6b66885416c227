//! Rows of maps made by hand, whose runs follow from similar triangles.
//!
//! The camera at the origin looks along −z with 90° of height: rows of its nine by five pixels look up by
//! 0.8, 0.4, 0, −0.4 and −0.8. Light comes from above, so that the slice through the middle column shows the plane
//! x = 0, row 0 is the first to be lit, and a surface at height h and distance q ends the light of rows below h/q.

use epipolar::SampledCells;
use epipolar::baran::Cells;
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, MapProjection, Medium, Phase, ShadowLayer, ShadowMap,
};

use crate::row_of_pixel::RowOfPixel;

const SIZE: [u32; 2] = [9, 5];
/// Positions up to 16 texels in f32, a quotient, a sum and a product on them.
const F32: f64 = 16.0 * 3.0 * f32::EPSILON as f64;

fn row(light: &Light, shadow: &ShadowMap<'_>, cells: Cells) -> RowOfPixel {
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 90.0, SIZE).unwrap();
    let endless = vec![f32::INFINITY; 45];
    let depth = DepthMap::new(&endless, SIZE).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let frame = Frame::new(&camera, depth, light, shadow, &medium, 10.0).unwrap();
    RowOfPixel::new(&frame, [4, 1], cells).unwrap()
}

#[track_caller]
fn assert_runs(row: &RowOfPixel, expected: &[(f64, u32)]) {
    let lit: Vec<u32> = expected.iter().map(|run| run.1).collect();
    assert_eq!(row.row.lit(), lit, "{:?}", row.row.starts());
    for (start, run) in row.row.starts().iter().zip(expected) {
        assert!((f64::from(*start) - run.0).abs() <= F32, "{start} instead of {}", run.0);
    }
}

/// A map of texels of one unit over 0 > z > −16, row 0 the farthest, its plane of depth 0 at y = 10.
fn sun_row((distances, height): (std::ops::Range<usize>, f32), cells: Cells) -> RowOfPixel {
    let down = [0.0, -1.0, 0.0];
    let projection =
        MapProjection::orthographic([0.0, 10.0, -8.0], down, [0.0, 0.0, -1.0], [4.0, 8.0], [8, 16]).unwrap();
    let mut texels = vec![f32::INFINITY; 8 * 16];
    for unit in distances {
        texels[(15 - unit) * 8..][..8].fill(10.0 - height);
    }
    let layer = ShadowLayer::new(projection, &texels).unwrap();
    row(&Light::directional(down, [1.0; 3]).unwrap(), &ShadowMap::Orthographic(layer), cells)
}

#[test]
fn an_occluder_above_a_row_of_pixels_ends_the_light_of_all_below_it() {
    // Height 1 at distances 3 to 5: 1/3 and 1/5 lie between 0.4 and 0.
    assert_runs(&sun_row((3..5, 1.0), Cells::Exact), &[(0.0, 5), (3.0, 2), (5.0, 5)]);
}

#[test]
fn a_texel_that_hides_a_columns_change_is_cut_where_the_view_ray_meets_it() {
    // Height 1 at distances 2 to 4: row 1 looks up by 0.4 and meets it at 1/0.4 = 2.5, in the middle of a texel.
    assert_runs(&sun_row((2..4, 1.0), Cells::Exact), &[(0.0, 5), (2.0, 1), (2.5, 2), (4.0, 5)]);
    // Below the eye, at −0.5: light ends before row 4 from 0.5/0.8 = 0.625 on, before row 3 from 0.5/0.4 = 1.25 on.
    let floor = [(0.0, 5), (0.625, 4), (1.25, 3), (2.0, 5)];
    assert_runs(&sun_row((0..2, -0.5), Cells::Exact), &floor);
}

#[test]
fn uniform_cells_know_a_texels_middle_alone() {
    // At 2.5 and 3.5 an occluder of height 1.1 is seen at 0.44 and 0.31: above row 1, then below it.
    assert_runs(
        &sun_row((2..4, 1.1), Cells::Sampled(SampledCells::Uniform)),
        &[(0.0, 5), (2.0, 1), (3.0, 2), (4.0, 5)],
    );
}

#[test]
fn an_occluder_under_a_lamp_casts_a_fan() {
    // Four units above the eye; texels of the lower face are 1/4 wide in tangents, and the one from 1/4 to 1/2 holds a
    // surface half a unit above the eye: its light rays end at the distance 3.5·tan, at the slope 1/(7·tan). Row 0
    // sees it lit from tan = 1/5.6 on, row 1 from 5/14 on; γ = tan/(1 + tan) is 1/5, 5/19 and 1/3.
    let lamp = [0.0, 4.0, 0.0];
    let mut texels = vec![f32::INFINITY; 6 * 8 * 8];
    texels[3 * 64 + 5 * 8..][..8].fill(3.5);
    let shadow = ShadowMap::Cube(CubeShadow::new(lamp, 8, &texels).unwrap());
    let row = row(&Light::point(lamp, [1.0; 3], 0.0).unwrap(), &shadow, Cells::Exact);
    // Light that goes on for ever down a slope of 0.8 or less never meets row 4, of 0.4 or less row 3: tan = 5/4 and
    // 5/2. The row ends where the ray of the pixel, ten units up a slope of 0.4, does.
    let across = 10.0 / 1.16f64.sqrt();
    let last = across / (4.0 - 0.4 * across + across);
    let expected =
        [(0.0, 5), (0.2, 1), (5.0 / 19.0, 2), (1.0 / 3.0, 5), (5.0 / 9.0, 4), (5.0 / 7.0, 3), (last, 5)];
    assert_runs(&row, &expected);
}
