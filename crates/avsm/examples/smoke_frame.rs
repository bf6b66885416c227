//! One frame of fog lit through smoke, as an engine has it: a source that names the smoke's segments tile by tile, the
//! technique, and how much light reaches a surface.
//!
//! `cargo run --release -p avsm --example smoke_frame`

use avsm::{Avsm, Options};
use scatter_core::{
    Camera, DepthMap, Frame, Light, MapError, MapProjection, Medium, Phase, ScatterImage, ShadowMap,
    Translucent, TranslucentSegment, TranslucentSource, VolumetricShadow,
};

/// Puffs of smoke: centre, radius and extinction inside of the sphere.
struct Puffs(Vec<([f64; 3], f64, f64)>);

impl TranslucentSource for Puffs {
    fn capture(
        &self,
        projection: &MapProjection,
        [x0, y0, x1, y1]: [u32; 4],
        sink: &mut dyn FnMut(u32, TranslucentSegment),
    ) -> Result<(), MapError> {
        for (index, (x, y)) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (x, y))).enumerate() {
            // A light ray: where it is at depth 0, and its way for a unit of depth.
            let ray = projection.light_ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (origin, step) = ray.ok_or_else(MapError::singular_matrix)?;
            for (centre, radius, extinction) in &self.0 {
                let to_centre = glam::DVec3::from(*centre) - origin;
                let closest = to_centre.dot(step) / step.length_squared();
                let beside = (to_centre - step * closest).length_squared();
                let half = ((radius * radius - beside).max(0.0) / step.length_squared()).sqrt();
                if half > 0.0 && closest + half > 0.0 {
                    let [entry, exit] = [(closest - half).max(0.0), closest + half];
                    // Extinction is a unit of length; segments have it a unit of depth.
                    let extinction = (extinction * step.length()) as f32;
                    sink(index as u32, TranslucentSegment::volume(entry as f32, exit as f32, extinction));
                }
            }
        }
        Ok(())
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let corner = |sign: f64| {
            let of = |axis: usize| self.0.iter().map(move |(centre, radius, _)| centre[axis] + sign * radius);
            [0, 1, 2].map(|axis| {
                of(axis).fold(-sign * f64::INFINITY, if sign < 0.0 { f64::min } else { f64::max })
            })
        };
        (!self.0.is_empty()).then(|| [corner(-1.0), corner(1.0)])
    }

    fn memory_bytes(&self) -> u64 {
        (self.0.capacity() * size_of::<([f64; 3], f64, f64)>()) as u64
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A column of two hundred puffs that drifts with the wind.
    let puff = |n: i32| {
        let height = f64::from(n) * 0.03;
        ([0.3 * (1.9 * height).sin() + 0.2 * height, height, 0.3 * (2.3 * height).cos()], 0.35, 0.4)
    };
    let puffs = Puffs((0..200).map(puff).collect());
    let smoke = Translucent::Source(&puffs);

    let size = [320, 200];
    let camera = Camera::perspective([0.0, 1.7, 9.0], [0.0, 2.5, 0.0], [0.0, 1.0, 0.0], 60.0, size)?;
    let distances = vec![15.0f32; (size[0] * size[1]) as usize];
    let depth = DepthMap::new(&distances, size)?;
    let light = Light::directional([0.8, -0.6, -0.1], [10.0, 9.0, 7.5])?;
    let medium = Medium::homogeneous([0.04; 3], [0.0; 3], Phase::henyey_greenstein(0.3)?)?;
    let frame = Frame::new(&camera, depth, &light, &ShadowMap::Unshadowed, &medium, 50.0)?
        .with_translucent(&smoke)?;

    // Keep the technique: its buffers serve the next frame.
    let mut technique = Avsm::new(Options::default());
    let mut image = ScatterImage::new();
    let stats = technique.render(&frame, &mut image)?;
    for (stage, time) in stats.stages.iter() {
        println!("{stage}: {:.2} ms", time.as_secs_f64() * 1e3);
    }
    for (name, count) in stats.counts.iter() {
        println!("{name}: {count}");
    }
    // What a surface behind the column gets of the sun.
    let curves = technique.curves();
    for x in [1.0, 2.5, 4.0] {
        let p = glam::DVec3::new(x, 0.0, 0.0);
        println!("light that reaches the ground at x = {x}: {:.3}", curves.transmittance_bilinear(p));
    }
    Ok(())
}
