//! A small engine with a sun's shafts in its picture: it draws a built-in shot's depth buffer and four cascades by its own
//! vertex shader (reversed z, Depth32Float, layers of one texture), its opaque picture, then shafts in the same command
//! buffer; headless. Beside its picture it writes the one that the CPU's technique makes of the same depths.
//!
//! What concerns Scatter stands in `shafts.rs`, between two marks.
//!
//! `cargo run --release -p scatter-gpu --features harness --example engine -- [SHOT] [FOLDER]`

mod matrices;
mod reference;
mod shafts;
mod world;

use std::error::Error;
use std::path::Path;

use scatter_core::Light;
use scatter_gpu::harness::HarnessDevice;
use scatter_scene::{BuiltinShot, RadianceImage, Shot, export, load_shot, write_png};

use matrices::Viewpoint;
use reference::{composed_on_cpu, picture, rel_rmse};
use shafts::Shafts;
use world::{HDR, World, target};

/// The engine's near plane \[world units\].
const NEAR: f64 = 0.125;
/// Texels along a side of a cascade.
const MAP: u32 = 1024;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "arcade".into());
    let folder = arguments.next().unwrap_or_else(|| ".".into());
    let device = HarnessDevice::open(None)?;
    println!("gpu: {}", device.describe());
    let pictures = pictures(&device, &shot(&name)?, MAP)?;
    for (label, image) in [("gpu", &pictures.gpu), ("cpu", &pictures.cpu)] {
        let path = Path::new(&folder).join(format!("{name}-{label}.png"));
        write_png(&path, image, 1.0)?;
        println!("{}", path.display());
    }
    println!("rel_rmse between them: {:.1e}; their halves of 11 bits round by 4.9e-4", pictures.difference());
    println!("shafts hold {} bytes on the GPU", pictures.memory_bytes);
    Ok(())
}

/// A built-in shot by its name, as it is drawn here.
fn shot(name: &str) -> Result<Shot, Box<dyn Error>> {
    let built_in =
        BuiltinShot::find(name).ok_or_else(|| format!("{name}: no built-in shot has this name"))?;
    let folder = std::env::temp_dir().join(format!("scatter-engine-{}", std::process::id()));
    let paths = export(&folder, &[built_in])?;
    let shot = paths.first().ok_or("a built-in shot has no file").map(|path| load_shot(path));
    std::fs::remove_dir_all(&folder)?;
    Ok(shot??)
}

/// The engine's picture, and the CPU's.
struct Pictures {
    gpu: RadianceImage,
    cpu: RadianceImage,
    /// What shafts hold on the GPU \[bytes\].
    memory_bytes: u64,
}

impl Pictures {
    fn difference(&self) -> f64 {
        rel_rmse(&self.gpu, &self.cpu)
    }
}

/// One frame of the engine.
fn pictures(device: &HarnessDevice, shot: &Shot, map: u32) -> Result<Pictures, Box<dyn Error>> {
    let Some(Light::Directional(sun)) = shot.lights.first().map(|part| &part.light) else {
        return Err(format!("{}: this engine has suns only; give another shot", shot.name).into());
    };
    if shot.lights.len() > 1 || shot.lights[0].texture.is_some() || !shot.scene.cutouts.is_empty() {
        println!("note: {}: one sun without glass, cut-outs as whole triangles", shot.name);
    }
    let light = &shot.lights[0].light;
    let matrices = Viewpoint::new(shot, sun.direction(), map)?.matrices(0.0);
    let world = World::new(&device.device, &device.queue, shot, map);
    let mut shafts = Shafts::new(&device.device, light.clone(), shot.medium.clone(), shot.max_distance)?;
    let opaque = target(&device.device, shot.camera.size(), 1, HDR);

    let mut encoder = device.device.create_command_encoder(&Default::default());
    world.draw(&device.queue, &mut encoder, &matrices, sun.direction());
    // For the comparison alone: the picture before it has shafts.
    encoder.copy_texture_to_texture(
        world.hdr_view.texture().as_image_copy(),
        opaque.as_image_copy(),
        opaque.size(),
    );
    shafts.encode(&device.queue, &mut encoder, &world, &matrices)?;
    device.queue.submit([encoder.finish()]);

    let opaque = picture(device, &opaque);
    let scene = (light, &shot.medium, shot.max_distance);
    Ok(Pictures {
        gpu: picture(device, world.hdr_view.texture()),
        cpu: composed_on_cpu(device, &world, &matrices, scene, &opaque)?,
        memory_bytes: shafts.view().memory_bytes(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrices::Matrices;

    /// Three numbers a pixel are stored as halves (light, transmittance, their sum with the picture), each off by an ulp of
    /// 2⁻¹⁰ at the most, however a driver rounds.
    const HALVES: f64 = 3.0 / 1024.0;

    /// True, and said, where there is no adapter.
    fn skipped() -> bool {
        let Err(none) = HarnessDevice::shared() else { return false };
        let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
        assert!(!required, "SCATTER_GPU=required, and there is no adapter: {none}");
        println!("SKIPPED: no adapter: {none}");
        true
    }

    fn small_shot(name: &str) -> Shot {
        let mut shot = shot(name).unwrap();
        shot.camera = shot.camera.with_size([97, 73]).unwrap();
        shot
    }

    #[test]
    fn the_engines_picture_is_the_cpus() {
        if skipped() {
            return;
        }
        for name in ["arcade", "comb"] {
            let device = HarnessDevice::shared().unwrap();
            let pictures = pictures(&device, &small_shot(name), 128).unwrap();
            let difference = pictures.difference();
            println!("{name}: rel_rmse {difference:.1e} of {HALVES:.1e}");
            assert!(difference <= HALVES, "{name}: {difference:e}");
            // There is something to see: an empty picture would be equal, too.
            let black = RadianceImage { size: [97, 73], pixels: vec![[0.0; 3]; 97 * 73] };
            assert!(rel_rmse(&black, &pictures.cpu) > 0.5);
        }
    }

    /// A mutant: the cascades of another frame.
    #[test]
    fn matrices_of_another_frame_are_seen() {
        if skipped() {
            return;
        }
        let device = HarnessDevice::shared().unwrap();
        let shot = small_shot("comb");
        let light = &shot.lights[0].light;
        let Light::Directional(sun) = light else { panic!("comb has a sun") };
        let viewpoint = Viewpoint::new(&shot, sun.direction(), 128).unwrap();
        let draw = |encoded: &Matrices| {
            let drawn = viewpoint.matrices(0.0);
            let world = World::new(&device.device, &device.queue, &shot, 128);
            let mut shafts =
                Shafts::new(&device.device, light.clone(), shot.medium.clone(), shot.max_distance).unwrap();
            let mut encoder = device.device.create_command_encoder(&Default::default());
            world.draw(&device.queue, &mut encoder, &drawn, sun.direction());
            shafts.encode(&device.queue, &mut encoder, &world, encoded).unwrap();
            device.queue.submit([encoder.finish()]);
            picture(&device, world.hdr_view.texture())
        };
        let (right, moved) = (viewpoint.matrices(0.0), viewpoint.matrices(2.0));
        let wrong = Matrices { cascades: moved.cascades, ..right };
        assert!(rel_rmse(&draw(&wrong), &draw(&right)) > 2.0 * HALVES);
    }

    #[test]
    fn at_most_sixty_lines_of_it_are_ours() {
        let text = include_str!("shafts.rs");
        let lines = text.lines().map(str::trim);
        let ours = lines.skip_while(|line| *line != "// --- ours: begin").skip(1);
        let ours = ours.take_while(|line| *line != "// --- ours: end").filter(|line| !line.is_empty());
        let count = ours.count();
        println!("{count} lines of 60");
        assert!((1..=60).contains(&count), "{count}");
    }
}
