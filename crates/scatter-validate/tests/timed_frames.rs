//! Frames of a timed loop are those that their cameras see, and their times are those of techniques alone.

use std::thread::sleep;
use std::time::Duration;

use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Capabilities, Frame, RenderError, RenderStats, ScatterImage, Unsupported, VolumetricShadow,
};
use scatter_scene::{BuiltinShot, export, load_shot};
use scatter_validate::StagedShot;
use scatter_validate::measure::{Renderer, timed};
use scatter_validate::staged_shot::resized;

/// Not square, and narrower than two moves.
const SIZE: [u32; 2] = [31, 23];

fn staged(name: &str) -> StagedShot {
    let folder = tempfile::tempdir().unwrap();
    let paths = export(folder.path(), &[BuiltinShot::find(name).unwrap()]).unwrap();
    let mut shot = load_shot(&paths[0]).unwrap();
    shot.camera = resized(&shot.camera, SIZE).unwrap();
    StagedShot::new(shot, 32).unwrap()
}

/// A technique on another device: moving maps there takes a third of a second, rendering a twentieth.
struct Elsewhere(ShadowMapWalk);

impl Elsewhere {
    const TRANSFER: Duration = Duration::from_millis(300);
    const RENDER: Duration = Duration::from_millis(50);
}

impl VolumetricShadow for Elsewhere {
    fn id(&self) -> &'static str {
        "elsewhere"
    }

    fn capabilities(&self) -> Capabilities {
        self.0.capabilities()
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.0.supports(frame)
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        sleep(Self::TRANSFER);
        let stats = self.0.render(frame, out)?;
        sleep(Self::RENDER);
        Ok(RenderStats { transfer: Self::TRANSFER, ..stats })
    }
}

#[test]
fn what_moves_maps_to_another_device_is_no_part_of_the_time() {
    let mut technique = Elsewhere(ShadowMapWalk::new());
    let mut renderer = Renderer::Shared(&mut technique);
    let times = timed(&staged("beam"), &mut renderer, 1..=1, &mut ScatterImage::new()).unwrap();
    println!("total {} ms", times["total"]);
    // Sleeping takes no less than it is told; of what a loaded machine adds a quarter of a second is left.
    assert!((50.0..300.0).contains(&times["total"]), "{}", times["total"]);
}

#[test]
fn depth_moves_with_the_camera() {
    let staged = staged("nave");
    for (frame, columns) in [(0, 0.0), (1, 1.0), (5, 5.0), (16, 16.0), (17, 1.0)] {
        let camera = staged.camera().shifted(columns, 0.0);
        let mut seen = Vec::new();
        staged.caster().depth_map(&camera, &mut seen);
        let ends = staged
            .with_timed_frame(0, frame, |frame| {
                assert!(
                    (frame.camera().pixel_ray(3, 4).direction - camera.pixel_ray(3, 4).direction).length()
                        < 1e-12
                );
                frame.depth().texels().to_vec()
            })
            .unwrap();
        // The same rays to rounding: at a leaf's very edge one may pass it by.
        let differ =
            seen.iter().zip(&ends).filter(|(a, b)| a != b && (*a - *b).abs() > 1e-5 * a.abs()).count();
        println!("frame {frame}: {differ} of {} rays end elsewhere", ends.len());
        assert!(differ <= 2, "frame {frame}: {differ}");
    }
}
