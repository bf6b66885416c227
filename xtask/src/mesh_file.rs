//! `render --export-mesh`: the mesh of `light-volume` as an OBJ file, a group a layer of each light's map.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use scatter::light_volume::raster::tessellation_of;
use scatter::light_volume::volume::polygons::{Closing, quads};
use scatter::light_volume::volume::triangles::triangles;
use scatter::light_volume::volume::{HeightField, SteppedVolume};
use scatter::light_volume::{Options, Surface};
use scatter::{Frame, ShadowLayer, Technique};
use scatter_scene::write_atomically;
use scatter_validate::StagedShot;

/// How far behind the farthest surface what has no end is drawn to, as a share of its depth.
const BEHIND: f64 = 1.5;

/// Writes the mesh that the options ask for. The stepped one encloses the shadow of a sun and the light of a lamp (so that its
/// pyramid is closed), the interpolated one always the shadow.
pub fn export_mesh(path: &Path, shot: &StagedShot, overrides: &[(&str, &str)]) -> anyhow::Result<()> {
    let mut options = Options::exact();
    let info = scatter::light_volume::TECHNIQUE.info();
    for (key, value) in overrides.iter().filter(|(key, _)| info.option(key).is_ok()) {
        options.set(key, value).context("--set")?;
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
        writeln!(file, "g light-{light}-layer-{index}")?;
        let (map, far) = (layer.projection(), far_of(&layer));
        match options.surface {
            Surface::Stepped => {
                let mut volume = SteppedVolume::default();
                volume.build(&layer, tessellation);
                for quad in quads(&volume, &layer, closing, far) {
                    let Some(corners) = quad.in_world(map) else { continue };
                    write_face(file, &corners.map(|corner| corner.to_array()))?;
                }
            }
            Surface::Interpolated => {
                let mut field = HeightField::default();
                field.build(&layer, tessellation);
                for triangle in triangles(&field, &layer, far) {
                    let Some(corners) = triangle.in_world(map) else { continue };
                    write_face(file, &corners.map(|corner| corner.to_array()))?;
                }
            }
        }
    }
    Ok(())
}

/// A triangle or a quadrilateral.
fn write_face<W: Write + ?Sized>(file: &mut W, corners: &[[f64; 3]]) -> std::io::Result<()> {
    for corner in corners {
        let [x, y, z] = corner.map(|value| value as f32);
        writeln!(file, "v {x} {y} {z}")?;
    }
    // The last ones.
    writeln!(file, "{}", if corners.len() == 3 { "f -3 -2 -1" } else { "f -4 -3 -2 -1" })
}

/// Behind all surfaces of a layer; of none 1.
fn far_of(layer: &ShadowLayer<'_>) -> f64 {
    let finite = layer.texels().iter().filter(|depth| depth.is_finite());
    let farthest = finite.fold(0.0f32, |far, depth| far.max(*depth));
    if farthest > 0.0 { BEHIND * f64::from(farthest) } else { 1.0 }
}
