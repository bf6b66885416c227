//! What bleeds beside the epipole by each measure of depth, against exact sums of the same rows.

use filtered_prefix::{Basis, DepthRange, Depths, FilteredPrefix, Options};
use glam::{DVec2, DVec3};
use scatter_core::{Camera, Frame, Light, ScatterImage, VolumetricShadow};
use scatter_testing::{Filling, MapKind, OwnedFrame};

const SIZE: [u32; 2] = [96, 72];

/// The epipole, in the middle of the picture.
const EPIPOLE: DVec2 = DVec2::new(48.0, 36.0);

/// Slats under a light, in two layers, seen from below with the light in the middle of the picture.
fn towards_the_light(kind: MapKind) -> OwnedFrame {
    let mut frame = OwnedFrame::stock(kind, SIZE, 256, Filling::Constant(f32::INFINITY));
    let layers = if kind.is_lamp() { [1.0, 2.5] } else { [4.0, 7.0] };
    for (texels, projection) in frame.texels.iter_mut().zip(&frame.projections) {
        let width = projection.size()[0] as usize;
        for (index, texel) in texels.iter_mut().enumerate() {
            let (i, j) = (index % width, index / width);
            if i / 6 % 2 == 0 {
                *texel = layers[0];
            } else if j / 10 % 3 == 0 {
                *texel = layers[1];
            }
        }
    }
    let eye = DVec3::new(0.3, -6.0, 0.4);
    let target = match &frame.light {
        Light::Directional(sun) => eye - sun.direction(),
        lamp => lamp.position().unwrap(),
    };
    let camera = Camera::perspective(eye.into(), target.into(), [0.0, 0.0, 1.0], 60.0, SIZE);
    frame.camera = camera.unwrap();
    frame.depth.fill(20.0);
    frame
}

/// Slices a pixel apart, none halved, so that all bases have the same rows.
fn options() -> Options {
    let even = epipolar::driver::SliceSettings::even(1.0);
    Options {
        uncut_columns: 0.0,
        spacing: even.spacing,
        fewest_slices: even.fewest_slices,
        target: None,
        refinement: even.refinement,
        shared_columns: 0,
        tolerance: 0.0,
        ..Options::default()
    }
}

fn radiance(frame: &Frame<'_>, options: Options) -> Vec<f64> {
    let mut image = ScatterImage::new();
    FilteredPrefix::new(options).render(frame, &mut image).unwrap();
    image.inscattered().iter().map(|rgb| f64::from(rgb[0])).collect()
}

/// rel_rmse of the pixels within so many of the epipole.
fn off(image: &[f64], exact: &[f64], within: f64) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for (pixel, (own, exact)) in image.iter().zip(exact).enumerate() {
        let [x, y] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]].map(|at| f64::from(at) + 0.5);
        if (DVec2::new(x, y) - EPIPOLE).length() < within {
            squares += (own - exact).powi(2);
            sum += exact;
            count += 1.0;
        }
    }
    (squares * count).sqrt() / sum
}

/// rel_rmse of all pixels, and of those within eight of the epipole, by each measure of depth.
fn table(kind: MapKind, basis: Basis, depth_range: DepthRange) -> [[f64; 2]; 4] {
    towards_the_light(kind).with(|frame| {
        let exact = radiance(frame, options());
        let coefficients = if basis == Basis::Fourier { 32 } else { 6 };
        let found = [Depths::Places, Depths::Angles, Depths::Tangents, Depths::Warp].map(|depths| {
            let own = Options {
                basis,
                coefficients,
                certified: false,
                tolerance: 0.01,
                depths,
                depth_range,
                ..options()
            };
            let image = radiance(frame, own);
            [f64::INFINITY, 8.0].map(|within| off(&image, &exact, within))
        });
        println!("{kind:?}, {basis:?}, {depth_range:?}: places, angles, tangents, warp: {found:.5?}");
        found
    })
}

#[test]
fn one_range_a_slice_bleeds_beside_the_epipole_and_a_warp_mends_it() {
    for basis in [Basis::Fourier, Basis::Moments] {
        let [[_, places], [_, angles], [_, tangents], [_, warp]] =
            table(MapKind::Orthographic, basis, DepthRange::Slice);
        // The nearer to the epipole, the narrower are columns in all other measures.
        assert!(places > angles && angles > tangents && angles > 1.2 * warp, "{basis:?}");
    }
}

#[test]
fn bands_of_view_rays_need_no_warp() {
    for (map, basis) in [MapKind::Orthographic, MapKind::Point]
        .into_iter()
        .flat_map(|map| [(map, Basis::Fourier), (map, Basis::Moments)])
    {
        let slice = table(map, basis, DepthRange::Slice);
        let band = table(map, basis, DepthRange::Band);
        // A band ends where 1/sin β has grown by a factor: that is a warp.
        for [all, beside] in band {
            assert!((all / band[0][0] - 1.0).abs() < 0.2 && beside < 0.5 * slice[1][1], "{map:?} {basis:?}");
        }
    }
}
