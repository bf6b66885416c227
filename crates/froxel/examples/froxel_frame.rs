//! One frame by a grid of froxels, as an engine has it: camera, depth, a sun with its shadow map, a medium; and what the engines'
//! grid misses of what the finest one sees.
//!
//! `cargo run --release -p froxel --example froxel_frame`

use froxel::{Froxel, Options};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, ScatterImage, ShadowLayer, ShadowMap,
    VolumetricShadow,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A sun through a roof of boards, four metres below the plane from which its map counts depths.
    let side = 512u32;
    let sun = [0.3, -1.0, 0.2];
    let projection =
        MapProjection::orthographic([0.0, 10.0, 0.0], sun, [0.0, 0.0, -1.0], [12.0; 2], [side; 2])?;
    let texels: Vec<f32> = (0..side * side).map(|n| if n % side % 64 < 48 { 4.0 } else { 11.0 }).collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);
    let light = Light::directional(sun, [10.0, 9.0, 7.5])?;

    let size = [320, 200];
    let camera = Camera::perspective([0.0, 1.7, 8.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 70.0, size)?;
    let distances = vec![15.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size)?;
    let medium = Medium::homogeneous([0.03; 3], [0.0; 3], Phase::henyey_greenstein(0.3)?)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 50.0)?;

    // Keep a technique: its buffers serve the next frame.
    for grid in [[160, 90, 64], [240, 135, 128], [320, 200, 1024]] {
        let mut technique = Froxel::new(Options { grid, ..Options::default() });
        let mut image = ScatterImage::new();
        let stats = technique.render(&frame, &mut image)?;
        let [columns, rows, slices] = grid;
        print!("{columns}x{rows}x{slices}:");
        for (stage, time) in stats.stages.iter() {
            print!(" {stage} {:.2} ms,", time.as_secs_f64() * 1e3);
        }
        println!(" {} bytes; radiance in the middle: {:?}", stats.memory_bytes, image.at(160, 100));
    }
    Ok(())
}
