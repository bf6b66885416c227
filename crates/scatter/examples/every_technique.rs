//! What an engine does with this crate: one frame, every technique that can render it, what each takes and how far each
//! is from the exact walk.
//!
//! `cargo run --release -p scatter --example every_technique`

use scatter::raymarch_ref::ShadowMapWalk;
use scatter::{
    Camera, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, Phase, Quality, ScatterImage,
    SceneFacts, ShadowLayer, ShadowMap, TECHNIQUES, Target, VolumetricShadow,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Camera and depth: flat ground, seen from the height of a person.
    let size = [160, 90];
    let camera = Camera::perspective([0.0, 1.7, 12.0], [0.0, 3.0, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    let distances: Vec<f32> = pixels
        .map(|(x, y)| {
            let down = -camera.pixel_ray(x, y).direction.y;
            if down > 0.0 { (1.7 / down) as f32 } else { f32::INFINITY }
        })
        .collect();

    // A sun behind a wall with windows of coloured glass: a shadow map, and the colours by the same projection.
    let direction = [0.3, -0.8, 1.0];
    let light = Light::directional(direction, [10.0, 9.0, 7.5])?;
    let projection = MapProjection::orthographic(
        direction.map(|axis| -20.0 * axis),
        direction,
        [0.0, 1.0, 0.0],
        [12.0, 12.0],
        [256; 2],
    )?;
    let window = |n: u32| (n % 256 / 8 + n / 256 / 8).is_multiple_of(4);
    let texels: Vec<f32> = (0..256 * 256).map(|n| if window(n) { f32::INFINITY } else { 12.0 }).collect();
    let colours: Vec<[f32; 3]> =
        (0..256 * 256).map(|n| if n / 256 % 16 < 8 { [1.0, 0.4, 0.1] } else { [0.2, 0.5, 1.0] }).collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);
    let glass = LightTexture::new(projection, &colours)?;

    let haze = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::henyey_greenstein(0.4)?)?;
    let depth = DepthMap::new(&distances, size)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &haze, 60.0)?.with_texture(&glass)?;

    let mut truth = ScatterImage::new();
    ShadowMapWalk::new().render(&frame, &mut truth)?;
    let mean =
        truth.inscattered().as_flattened().iter().sum::<f32>() / (3 * truth.inscattered().len()) as f32;

    let (target, facts) = (Target::Quality(Quality::Game), SceneFacts::of(&frame));
    for technique in TECHNIQUES {
        let info = technique.info();
        println!("{}: {}", info.id, info.summary);
        let mut renderer = technique.configure(target, &[], &facts)?;
        println!("{}", renderer.capabilities());
        if let Err(unsupported) = renderer.supports(&frame) {
            println!("{unsupported}\n");
            continue;
        }
        for (key, value) in technique.resolved(target, &[], &facts)? {
            println!("  {key} = {value}");
        }
        let mut image = ScatterImage::new();
        let stats = renderer.render(&frame, &mut image)?;
        let pairs = image.inscattered().as_flattened().iter().zip(truth.inscattered().as_flattened());
        let square =
            pairs.map(|(a, b)| (a - b).powi(2)).sum::<f32>() / (3 * truth.inscattered().len()) as f32;
        println!("  {:?}, relative RMSE {:.2} %\n", stats.total_time(), 100.0 * square.sqrt() / mean);
    }
    Ok(())
}
