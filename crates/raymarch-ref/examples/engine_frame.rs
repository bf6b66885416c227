//! What an engine does with this crate: one frame with a sun, a hedge and some haze, marched and judged.
//!
//! `cargo run --release -p raymarch-ref --example engine_frame [FILE.pgm]`

use raymarch_ref::{Options, RayMarch, ShadowMapWalk};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapProjection, Medium, Phase, Quality, ScatterImage, ShadowLayer,
    ShadowMap, VolumetricShadow,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The camera, and the distance along each pixel's ray: flat ground at y = 0. (An engine's own depth buffer is
    // converted by `DepthEncoding::decode`.)
    let size = [320, 180];
    let camera = Camera::perspective([0.0, 1.7, 12.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;
    let distances: Vec<f32> = (0..size[1])
        .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
        .map(|(x, y)| {
            let down = -camera.pixel_ray(x, y).direction.y;
            if down > 0.0 { (1.7 / down) as f32 } else { f32::INFINITY }
        })
        .collect();
    let depth = DepthMap::new(&distances, size)?;

    // The sun and its shadow map: depths along the light from the plane through `origin`. Here a hedge of posts at
    // z = −2; texels that see no surface hold +∞.
    let direction = [0.2, -0.6, 1.0];
    let light = Light::directional(direction, [10.0, 9.0, 7.5])?;
    let origin = direction.map(|c| -30.0 * c);
    let projection =
        MapProjection::orthographic(origin, direction, [0.0, 1.0, 0.0], [20.0, 12.0], [512, 512])?;
    let texels: Vec<f32> = (0..512 * 512)
        .map(|k| {
            let (u, v) = (f64::from(k % 512) + 0.5, f64::from(k / 512) + 0.5);
            let Some((from, step)) = projection.light_ray(u, v) else { return f32::INFINITY };
            let t = (-2.0 - from.z) / step.z;
            let p = from + step * t;
            let post = p.y > 0.0 && p.y < 6.0 && p.x.rem_euclid(1.5) < 0.9;
            if post { t as f32 } else { f32::INFINITY }
        })
        .collect();
    let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels)?);

    let medium = Medium::homogeneous([0.03; 3], [0.0; 3], Phase::henyey_greenstein(0.6)?)?;
    let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 60.0)?;

    // Keep a technique from frame to frame: its buffers are reused.
    let mut march = RayMarch::new(Options::for_quality(Quality::Game))?;
    let mut image = ScatterImage::new();
    let stats = march.render(&frame, &mut image)?;
    println!("march: {:?} for {} steps a ray", stats.total_time(), march.options().steps);

    // The reference needs no options; what it returns is exact for this shadow map.
    let mut truth = ScatterImage::new();
    let stats = ShadowMapWalk::new().render(&frame, &mut truth)?;
    println!("walk:  {:?}", stats.total_time());
    let (mut square, mut sum) = (0.0, 0.0);
    for (a, b) in image.inscattered().iter().zip(truth.inscattered()) {
        square += f64::from(a[0] - b[0]).powi(2);
        sum += f64::from(b[0]);
    }
    let count = truth.inscattered().len() as f64;
    println!("relative RMSE: {:.2} %", 100.0 * (square / count).sqrt() / (sum / count));

    if let Some(path) = std::env::args().nth(1) {
        let brightest = image.inscattered().iter().map(|rgb| rgb[0]).fold(f32::MIN_POSITIVE, f32::max);
        let grey = image.inscattered().iter().map(|rgb| (255.0 * (rgb[0] / brightest).sqrt()) as u8);
        let header = format!("P5 {} {} 255\n", size[0], size[1]);
        std::fs::write(path, header.into_bytes().into_iter().chain(grey).collect::<Vec<u8>>())?;
    }
    Ok(())
}
