//! An engine's reversed depth buffer becomes distances along the rays, and a pixel's unshadowed god ray a number.

use scatter_core::{Camera, DepthEncoding, DepthMap, Light, Medium, Phase, RayLight};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size = [4, 3];
    let camera = Camera::perspective([0.0, 2.0, 8.0], [0.0, 2.0, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;

    // Reversed z with an infinite far plane: z = near / distance along the view direction; 0 is the sky.
    let buffer: Vec<f32> = (0..12).map(|n| if n < 4 { 0.0 } else { 0.1 / (4.0 + n as f32) }).collect();
    let mut distances = Vec::new();
    DepthEncoding::ReversedInfinite { near: 0.1 }.decode(&camera, &buffer, &mut distances)?;
    let depth = DepthMap::new(&distances, size)?;

    let sun = Light::directional([0.3, -1.0, 0.2], [10.0, 9.0, 7.5])?;
    let haze = Medium::homogeneous([0.02; 3], [0.0; 3], Phase::henyey_greenstein(0.4)?)?;
    for y in 0..size[1] {
        for x in 0..size[0] {
            let ray = camera.pixel_ray(x, y);
            let end = f64::from(depth.at(x, y)).min(100.0);
            let radiance = RayLight::new(&sun, &haze, camera.eye(), &ray).interval(0.0, end);
            println!("({x}, {y}): {end:7.3} long, unshadowed radiance {radiance:.4}");
        }
    }
    Ok(())
}
