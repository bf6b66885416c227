//! One frame by exact mode, as an engine has it: camera, depth, a lamp with its cube map, a medium; and what it looked at.
//!
//! `cargo run --release -p minmax-mipmap --example exact_frame`

use minmax_mipmap::{MinMaxMipmap, Options};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, Medium, Phase, ScatterImage, ShadowMap, VolumetricShadow,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A lamp in a room of ten metres a side, behind a grille: every eighth column of its map is free.
    let (lamp, side) = ([0.0, 2.0, -3.0], 256u32);
    let texels: Vec<f32> =
        (0..6 * side * side).map(|n| if n % side % 8 == 0 { f32::INFINITY } else { 0.7 }).collect();
    let shadow = ShadowMap::Cube(CubeShadow::new(lamp, side, &texels)?);
    let light = Light::point(lamp, [40.0, 36.0, 30.0], 0.0)?;

    let size = [320, 200];
    let camera = Camera::perspective([0.0, 1.7, 5.0], [0.0, 1.7, 0.0], [0.0, 1.0, 0.0], 70.0, size)?;
    let distances = vec![10.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size)?;
    let medium = Medium::homogeneous([0.03; 3], [0.0; 3], Phase::henyey_greenstein(0.3)?)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 50.0)?;

    // Keep the technique: its buffers serve the next frame.
    let mut technique = MinMaxMipmap::new(Options::default());
    let mut image = ScatterImage::new();
    let stats = technique.render(&frame, &mut image)?;
    for (stage, time) in stats.stages.iter() {
        println!("{stage}: {:.2} ms", time.as_secs_f64() * 1e3);
    }
    let pixels = f64::from(size[0] * size[1]);
    for (name, count) in stats.counts.iter() {
        println!("{name}: {:.1} a pixel", count as f64 / pixels);
    }
    println!("radiance beside the lamp: {:?}", image.at(170, 90));
    Ok(())
}
