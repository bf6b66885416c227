//! Shadow maps as a device stores them, in every convention: linear depths come back, cleared texels are no surface.
//!
//! Texels are z/w of points that were placed by axes and window, through the matrix in f64, so that the library's rays
//! and projections take no part.

use glam::{DMat4, DVec3};
use scatter_core::{ClipSpace, ShadowDepthEncoding};

use crate::conventions::{Lens, Place, Random, lenses};

const SIZE: [u32; 2] = [9, 7];

/// The point at a texel's centre and a linear depth from the place.
fn point(place: &Place, lens: &Lens, texel: usize, depth: f64) -> DVec3 {
    let [right, up, forward] = place.axes(lens.left_handed);
    let [l, r, b, t] = lens.window;
    let (x, y) = ((texel % 9) as f64 + 0.5, (texel / 9) as f64 + 0.5);
    let (x, y) = (x / 9.0, y / 7.0);
    let y = if lens.name.contains("opengl") { 1.0 - y } else { y };
    let unit = if lens.parallel { 1.0 } else { depth };
    place.position.as_dvec3()
        + right * ((l + (r - l) * x) * unit)
        + up * ((t + (b - t) * y) * unit)
        + forward * depth
}

fn clip_from_world(place: &Place, lens: &Lens) -> DMat4 {
    let [right, up, forward] = place.axes(lens.left_handed);
    let along_z = if lens.left_handed { forward } else { -forward };
    let row = |axis: DVec3| axis.extend(-axis.dot(place.position.as_dvec3()));
    let view = DMat4::from_cols(row(right), row(up), row(along_z), glam::DVec4::W).transpose();
    lens.matrix.as_dmat4() * view
}

#[test]
fn depths_come_back_from_every_convention() {
    let mut random = Random(7);
    let (mut worst, mut cases) = (0.0f64, 0);
    for _ in 0..60 {
        let place =
            Place { position: glam::Vec3::splat(random.single(-9.0, 9.0)), ..Place::random(&mut random) };
        for lens in lenses(&mut random) {
            let clip = clip_from_world(&place, &lens);
            let farthest = lens.far.min(200.0);
            let depths: Vec<f64> =
                (0..63).map(|_| lens.near + (farthest - lens.near) * random.range(0.01, 0.9)).collect();
            let signed = lens.name.contains("opengl");
            let texels: Vec<f32> = depths
                .iter()
                .enumerate()
                .map(|(texel, &depth)| {
                    if texel == 5 {
                        return if lens.space.is_reversed() { 0.0 } else { 1.0 };
                    }
                    let seen = clip * point(&place, &lens, texel, depth).extend(1.0);
                    let z = seen.z / seen.w;
                    (if signed { 0.5 * z + 0.5 } else { z }) as f32
                })
                .collect();
            let (mut linear, mut again) = (Vec::new(), Vec::new());
            let encoding = ShadowDepthEncoding::Clip(lens.space);
            let matrix = clip.to_cols_array_2d();
            encoding
                .decode(matrix, SIZE, &texels, &mut linear)
                .unwrap_or_else(|error| panic!("{}: {error}", lens.name));
            encoding.encode(matrix, SIZE, &linear, &mut again).unwrap();
            for (texel, &depth) in depths.iter().enumerate() {
                if texel == 5 {
                    assert_eq!(linear[texel], f32::INFINITY, "{}", lens.name);
                    assert_eq!(again[texel], texels[texel]);
                    continue;
                }
                let (near, far) = (lens.near, lens.far);
                let z = f64::from(texels[texel]);
                // A texel in [0, 1] rounds to 2⁻²⁵ near 1 and to 2⁻²⁴ of itself else; a perspective's depth changes by
                // depth²·(1/near − 1/far) for a whole of it, a parallel one's by far − near. The matrix's own entries were
                // rounded, and so were near and far: as much again, of an entry near 1.
                let change =
                    if lens.parallel { far - near } else { depth * depth * (1.0 / near - 1.0 / far) };
                let entries = if lens.space.is_reversed() && !signed && !lens.parallel { z } else { 1.0 };
                let rounding = change * (z + 4.0 * entries) * 2f64.powi(-24) + depth * 2f64.powi(-22);
                let expected = if lens.parallel { depth - near } else { depth };
                let off = (f64::from(linear[texel]) - expected).abs() / rounding;
                worst = worst.max(off);
                assert!(off <= 1.0, "{} {depth}: {} after {z}, {off}", lens.name, linear[texel]);
                cases += 1;
                assert!((again[texel] - texels[texel]).abs() <= 2f32.powi(-22), "{}", lens.name);
            }
        }
    }
    println!("{cases} texels, off by {worst:.2} of what f32 rounds");
}

#[test]
fn distances_from_the_lamp_become_depths_along_the_axis() {
    let mut random = Random(8);
    for lens in lenses(&mut random) {
        let place = Place { position: glam::Vec3::new(1.0, 2.0, -3.0), ..Place::random(&mut random) };
        let matrix = clip_from_world(&place, &lens).to_cols_array_2d();
        let depths: Vec<f64> = (0..63).map(|n| 1.0 + f64::from(n)).collect();
        // A parallel map counts from its near plane, along the light.
        let distance = |texel: usize| {
            if lens.parallel {
                depths[texel]
            } else {
                point(&place, &lens, texel, depths[texel]).distance(place.position.as_dvec3())
            }
        };
        let (near, far) = (0.5, 1000.0);
        let share = |d: f64| (d - near) / (far - near);
        let cases = [
            (ShadowDepthEncoding::AlongRay(lens.space), false),
            (ShadowDepthEncoding::AlongRayShare { space: lens.space, near, far }, true),
        ];
        for (encoding, is_share) in cases {
            let stored = |d: f64| if is_share { share(d) } else { d };
            let mut texels: Vec<f32> = (0..63).map(|texel| stored(distance(texel)) as f32).collect();
            let (mut linear, mut again) = (Vec::new(), Vec::new());
            texels[11] = if is_share { 1.0 } else { f32::INFINITY };
            encoding.decode(matrix, SIZE, &texels, &mut linear).unwrap();
            encoding.encode(matrix, SIZE, &linear, &mut again).unwrap();
            for (texel, &depth) in depths.iter().enumerate() {
                if texel == 11 {
                    assert_eq!(linear[texel], f32::INFINITY);
                    continue;
                }
                // A share of 1000 units rounds to 3e-5 units, the window's numbers to 1e-6 of the depth.
                let off = (f64::from(linear[texel]) - depth).abs();
                assert!(off <= 3e-5 + 2e-6 * depth, "{}: {} is not {depth}", lens.name, linear[texel]);
                assert!((again[texel] - texels[texel]).abs() <= 1e-6 * texels[texel].max(1.0));
            }
        }
    }
}

#[test]
fn layers_of_an_array_are_maps_in_order() {
    let mut random = Random(9);
    let place = Place::random(&mut random);
    let lens = lenses(&mut random)
        .into_iter()
        .find(|lens| lens.name == "rh directx orthographic, reversed")
        .unwrap();
    let clip = clip_from_world(&place, &lens);
    // Each half as wide as the one before.
    let matrices: [_; 3] = std::array::from_fn(|index| {
        let zoom = 2f64.powi(index as i32);
        (DMat4::from_scale(DVec3::new(zoom, zoom, 1.0)) * clip).to_cols_array_2d()
    });
    let texels: Vec<f32> = (0..3 * 63).map(|n| n as f32 / 200.0).collect();
    let encoding = ShadowDepthEncoding::Clip(ClipSpace::WGPU.reversed());
    let mut linear = Vec::new();
    let layers = encoding.layers(&matrices, SIZE, &texels, &mut linear).unwrap();
    for (index, layer) in layers.iter().enumerate() {
        let mut alone = Vec::new();
        let part = &texels[63 * index..][..63];
        let projection = encoding.decode(matrices[index], SIZE, part, &mut alone).unwrap();
        assert_eq!((layer.projection(), layer.texels()), (&projection, &alone[..]));
    }
    let mut bad = texels;
    bad[63 + 9 * 2 + 4] = 2.0;
    let error = encoding.layers(&matrices, SIZE, &bad, &mut linear).unwrap_err().to_string();
    assert!(error.contains("(4, 9)"), "rows are counted down all layers: {error}");
}
