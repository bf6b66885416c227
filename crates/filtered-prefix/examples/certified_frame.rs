//! One frame from filtered rows, as an engine has it: camera, depth, a spot with its map, a medium; and how much of it the
//! certificate settled.
//!
//! `cargo run --release -p filtered-prefix --example certified_frame`

use filtered_prefix::{FilteredPrefix, Options};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, Quality, ScatterImage, ShadowLayer,
    ShadowMap, VolumetricShadow, walked_radiance,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A spot under the ceiling, over boards with gaps between them: half of the texels of its map are free.
    let (lamp, down, up) = ([0.0, 4.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]);
    let outer = 35.0f64;
    let projection = MapProjection::perspective(lamp, down, up, outer.to_radians().tan(), 512)?;
    let texels: Vec<f32> =
        (0..512 * 512).map(|n| if n % 512 % 64 < 32 { 1.5 } else { f32::INFINITY }).collect();
    let shadow = ShadowMap::Perspective(ShadowLayer::new(projection, &texels)?);
    let light = Light::spot(lamp, down, [40.0, 36.0, 30.0], 20.0, outer, 0.0)?;

    let size = [320, 200];
    let camera = Camera::perspective([0.0, 1.7, 6.0], [0.0, 1.7, 0.0], [0.0, 1.0, 0.0], 70.0, size)?;
    let distances = vec![12.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size)?;
    let medium = Medium::homogeneous([0.03; 3], [0.0; 3], Phase::Isotropic)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 50.0)?;

    // Keep the technique: its buffers serve the next frame.
    let mut technique = FilteredPrefix::new(Options::for_quality(Quality::Game, size));
    let mut image = ScatterImage::new();
    let stats = technique.render(&frame, &mut image)?;
    for (stage, time) in stats.stages.iter() {
        println!("{stage}: {:.2} ms", time.as_secs_f64() * 1e3);
    }
    for (name, count) in stats.counts.iter() {
        println!("{name}: {count}");
    }
    let (found, exact) = (f64::from(image.at(160, 90)[0]), walked_radiance(&frame, 160, 90).x);
    println!("radiance below the lamp: {found}, exactly {exact}");
    // A wrong technique must not pass for an example.
    assert!((found / exact - 1.0).abs() < 0.03);
    Ok(())
}
