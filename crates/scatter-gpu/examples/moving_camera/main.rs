//! The engine of the example `engine` for a hundred frames while its camera moves: after the second frame nothing is
//! allocated on the GPU any more, and no call draws a message of wgpu's validation. Headless.
//!
//! `cargo run --release -p scatter-gpu --features harness --example moving_camera`

#[path = "../engine/matrices.rs"]
mod matrices;
#[path = "../engine/shafts.rs"]
mod shafts;
#[path = "../engine/world.rs"]
mod world;

use std::error::Error;

use scatter_core::Light;
use scatter_gpu::harness::HarnessDevice;
use scatter_gpu::wgpu;
use scatter_scene::{BuiltinShot, Shot, export, load_shot};

use matrices::Viewpoint;
use shafts::Shafts;
use world::World;

/// The engine's near plane \[world units\].
const NEAR: f64 = 0.125;
const FRAMES: usize = 100;
/// Texels along a side of a cascade.
const MAP: u32 = 64;
/// World units from one frame to the next.
const STEP: f64 = 0.02;

fn main() -> Result<(), Box<dyn Error>> {
    let device = HarnessDevice::open(None)?;
    println!("gpu: {}", device.describe());
    println!("{}", moved(&device, &arcade([320, 200])?)?);
    Ok(())
}

fn arcade(size: [u32; 2]) -> Result<Shot, Box<dyn Error>> {
    let built_in = BuiltinShot::find("arcade").ok_or("there is no such shot")?;
    let folder = std::env::temp_dir().join(format!("scatter-moving-{}", std::process::id()));
    let paths = export(&folder, &[built_in])?;
    let shot = paths.first().ok_or("it has no file").map(|path| load_shot(path));
    std::fs::remove_dir_all(&folder)?;
    let mut shot = shot??;
    shot.camera = shot.camera.with_size(size)?;
    Ok(shot)
}

/// What the device holds: buffers, bytes of textures (wgpu 30 does not count textures on Vulkan), views of them, bind groups,
/// pipelines.
fn held(device: &wgpu::Device) -> [isize; 7] {
    let hal = device.get_internal_counters().hal;
    [
        hal.buffers.read(),
        hal.texture_memory.read(),
        hal.texture_views.read(),
        hal.bind_groups.read(),
        hal.bind_group_layouts.read(),
        hal.compute_pipelines.read(),
        hal.render_pipelines.read(),
    ]
}

/// Draws the frames; an error names the first one that allocated or drew a message.
fn moved(device: &HarnessDevice, shot: &Shot) -> Result<String, Box<dyn Error>> {
    let light = &shot.lights[0].light;
    let Light::Directional(sun) = light else { return Err("it has no sun".into()) };
    let viewpoint = Viewpoint::new(shot, sun.direction(), MAP)?;
    let world = World::new(&device.device, &device.queue, shot, MAP);
    let mut shafts = Shafts::new(&device.device, light.clone(), shot.medium.clone(), shot.max_distance)?;
    let (mut second, mut bytes) = ([0; 7], 0);
    for frame in 0..FRAMES {
        let matrices = viewpoint.matrices(STEP * frame as f64);
        let scope = device.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder = device.device.create_command_encoder(&Default::default());
        world.draw(&device.queue, &mut encoder, &matrices, sun.direction());
        shafts.encode(&device.queue, &mut encoder, &world, &matrices)?;
        device.queue.submit([encoder.finish()]);
        device.device.poll(wgpu::PollType::wait_indefinitely())?;
        if let Some(message) = pollster::block_on(scope.pop()) {
            return Err(format!("frame {frame}: {message}").into());
        }
        let now = held(&device.device);
        if frame == 1 {
            (second, bytes) = (now, shafts.view().memory_bytes());
        }
        // Buffers may become fewer: wgpu's staging for `write_buffer` comes and goes.
        let grown = now[0] > second[0] || now[1..] != second[1..] || shafts.view().memory_bytes() != bytes;
        if frame > 1 && grown {
            return Err(format!("frame {frame}: {now:?} objects, {second:?} after the second").into());
        }
    }
    Ok(format!(
        "{FRAMES} frames, nothing allocated after the second, no validation message; shafts hold {bytes} bytes"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_frames_allocate_nothing_after_the_second() {
        match HarnessDevice::shared() {
            Ok(device) => println!("{}", moved(&device, &arcade([33, 25]).unwrap()).unwrap()),
            Err(none) => {
                let required = std::env::var_os("SCATTER_GPU").is_some_and(|value| value == "required");
                assert!(!required, "SCATTER_GPU=required, and there is no adapter: {none}");
                println!("SKIPPED: no adapter: {none}");
            }
        }
    }

    /// A mutant: what is made in each frame is counted.
    #[test]
    fn an_allocation_is_counted() {
        let Ok(device) = HarnessDevice::shared() else { return };
        let before = held(&device.device);
        let kept = device.r32float([4, 3], 1);
        assert_ne!(held(&device.device), before);
        drop(kept);
    }
}
