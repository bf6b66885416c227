//! An engine's plan: once a view, then the planned technique renders frame after frame.
//!
//! `cargo run --release -p scatter --example plan`

use scatter::{
    Budget, Camera, DepthMap, Frame, Light, Machine, MapProjection, Medium, Phase, Quality, ScatterImage,
    ShadowLayer, ShadowMap, plan,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // What an engine has: a view down a hall, with light through a row of windows.
    let size = [320, 240];
    let camera = Camera::perspective([0.0, 2.0, 8.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;
    let distances = vec![20.0_f32; (size[0] * size[1]) as usize];
    let light = Light::directional([0.2, -1.0, 0.1], [10.0, 9.0, 7.5])?;
    let projection = MapProjection::orthographic(
        [0.0, 10.0, 0.0],
        [0.2, -1.0, 0.1],
        [0.0, 0.0, -1.0],
        [14.0; 2],
        [256; 2],
    )?;
    let window = |i: usize| (i % 256) % 32 < 10 && (i / 256) % 48 < 16;
    let texels: Vec<f32> = (0..256 * 256).map(|i| if window(i) { f32::INFINITY } else { 4.0 }).collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);
    let medium = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::henyey_greenstein(0.4)?)?;
    let depth = DepthMap::new(&distances, size)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 100.0)?;

    // Once: some milliseconds, and nothing is rendered. What `cargo xtask calibrate` measured may take the built-in machine's
    // place.
    let machine = Machine::built_in();
    let mut plan_of_view = plan(&frame, Budget::Level(Quality::Film), &machine)?;
    println!("{}", plan_of_view.sentence);
    for rejected in &plan_of_view.rejected {
        println!("  not {}: {}", rejected.id, rejected.reason);
    }

    // Every frame: the instance keeps its buffers.
    let mut scattered = ScatterImage::new();
    let stats = plan_of_view.instance.render(&frame, &mut scattered)?;
    let took = 1e3 * stats.total_time().as_secs_f64();
    println!("predicted {:.2} ms, took {took:.2} ms", plan_of_view.estimate.time_ms);
    assert_eq!(scattered.size(), size);
    Ok(())
}
