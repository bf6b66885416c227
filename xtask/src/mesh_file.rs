//! `render --export-mesh`: the mesh of `light-volume` as an OBJ file, a group a layer of each light's map.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use scatter::light_volume::raster::tessellation_of;
use scatter::light_volume::volume::SteppedVolume;
use scatter::light_volume::volume::polygons::{Closing, quads};
use scatter::light_volume::{ID, Options, Surface};
use scatter::{Frame, ShadowLayer, Technique};
use scatter_scene::write_atomically;
use scatter_validate::StagedShot;

/// How far behind the farthest surface what has no end is drawn to, as a share of its depth.
const BEHIND: f64 = 1.5;

/// Writes the mesh: around the shadow of a sun, around the light of a lamp (so that its pyramid is closed).
pub fn export_mesh(path: &Path, shot: &StagedShot, overrides: &[(&str, &str)]) -> anyhow::Result<()> {
    let mut options = Options::exact();
    let info = scatter::light_volume::TECHNIQUE.info();
    for (key, value) in overrides.iter().filter(|(key, _)| info.option(key).is_ok()) {
        options.set(key, value).context("--set")?;
    }
    if options.surface != Surface::Stepped {
        bail!("--export-mesh: the mesh of {ID} that is written is the stepped one; leave --set surface out");
    }
    Ok(write_atomically(path, |file| {
        for light in 0..shot.light_count() {
            shot.with_frame(light, shot.camera(), |frame| write(file, light, frame, &options))
                .map_err(std::io::Error::other)??;
        }
        Ok(())
    })?)
}

fn write<W: Write + ?Sized>(
    file: &mut W,
    light: usize,
    frame: &Frame<'_>,
    options: &Options,
) -> std::io::Result<()> {
    let tessellation = tessellation_of(frame, options);
    let closing = if frame.light().position().is_some() { Closing::Light } else { Closing::Shadow };
    for (index, layer) in frame.shadow().layers().enumerate() {
        let mut volume = SteppedVolume::default();
        volume.build(&layer, tessellation);
        writeln!(file, "g light-{light}-layer-{index}")?;
        for quad in quads(&volume, &layer, closing, far_of(&layer)) {
            let Some(corners) = quad.in_world(layer.projection()) else { continue };
            for corner in corners {
                writeln!(file, "v {} {} {}", corner.x as f32, corner.y as f32, corner.z as f32)?;
            }
            // The last four.
            writeln!(file, "f -4 -3 -2 -1")?;
        }
    }
    Ok(())
}

/// Behind all surfaces of a layer; of none 1.
fn far_of(layer: &ShadowLayer<'_>) -> f64 {
    let finite = layer.texels().iter().filter(|depth| depth.is_finite());
    let farthest = finite.fold(0.0f32, |far, depth| far.max(*depth));
    if farthest > 0.0 { BEHIND * f64::from(farthest) } else { 1.0 }
}
