//! `validate --image`: an image that another renderer made, read and checked before anything is rendered.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use scatter_scene::{RadianceImage, Shot, read_exr, write_atomically};
use scatter_validate::{ForeignImage, Pictures};

use crate::flags::Validate;
use crate::output::{check_writable, stderr_line};

/// The image to grade with where its picture goes.
pub struct Foreign {
    image: ForeignImage,
    path: PathBuf,
    difference: PathBuf,
}

impl Foreign {
    /// What `--image` names, if it is given.
    pub fn of(flags: &Validate) -> anyhow::Result<Option<Self>> {
        let Some(path) = &flags.image else { return Ok(None) };
        if flags.shots.len() != 1 {
            bail!("--image: say which shot it is of; give one --shot");
        }
        let image = read_exr(path)?;
        check_finite(path, &image)?;
        let difference = flags.difference.clone().unwrap_or_else(|| path.with_extension("difference.png"));
        check_writable(&difference)?;
        let label = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let image = ForeignImage { label, image };
        Ok(Some(Self { image, path: path.clone(), difference }))
    }

    /// The image, to be measured.
    pub fn image(&self) -> &ForeignImage {
        &self.image
    }

    /// An error unless the image is as large as the shot's.
    pub fn check_size(&self, shot: &Shot) -> anyhow::Result<()> {
        let ([w, h], [shot_w, shot_h]) = (self.image.image.size, shot.camera.size());
        if [w, h] != [shot_w, shot_h] {
            bail!(
                "{}: the image is {w}x{h} and {} is {shot_w}x{shot_h}; render it at that size or give --size {w}x{h}",
                self.path.display(),
                shot.name
            );
        }
        Ok(())
    }

    /// Writes the picture of the difference to shadow-map truth, or to ray-cast truth if that is nearer.
    pub fn write_difference(&self, pictures: &Pictures) -> anyhow::Result<()> {
        let (truth, png) = scatter_validate::report::difference_png(pictures, &self.image.image)
            .map_err(|error| anyhow!("{}: {error}", self.difference.display()))?;
        write_atomically(&self.difference, |writer| writer.write_all(&png))?;
        stderr_line(&format!(
            "wrote {}: {} - {truth}, red too bright, blue too dark, full colour at a tenth of the truth's mean",
            self.difference.display(),
            self.image.label
        ));
        Ok(())
    }
}

fn check_finite(path: &Path, image: &RadianceImage) -> anyhow::Result<()> {
    let bad = |pixel: &[f32; 3]| pixel.iter().any(|v| !v.is_finite());
    let count = image.pixels.iter().filter(|pixel| bad(pixel)).count();
    if let Some(first) = image.pixels.iter().position(bad) {
        let width = image.size[0].max(1) as usize;
        bail!(
            "{}: {count} pixels are not finite, the first at column {}, row {}; mend the renderer or paint them black",
            path.display(),
            first % width,
            first / width
        );
    }
    Ok(())
}
