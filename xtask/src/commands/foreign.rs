//! `validate --image`: an image that another renderer made, read and checked before anything is rendered.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use scatter_scene::{ExrSource, RadianceImage, Shot, read_exr_with_source, write_atomically};
use scatter_validate::{ForeignImage, Pictures};

use crate::flags::Validate;
use crate::output::{check_folder, check_writable, stderr_line};

/// The image to grade with where its picture goes.
pub struct Foreign {
    image: ForeignImage,
    /// What of the file was taken.
    source: ExrSource,
    path: PathBuf,
    /// None: nobody asked for the picture, and the image's folder is not ours.
    difference: Option<PathBuf>,
}

impl Foreign {
    /// What `--image` names, if it is given.
    pub fn of(flags: &Validate) -> anyhow::Result<Option<Self>> {
        let Some(path) = &flags.image else { return Ok(None) };
        if flags.shots.len() != 1 {
            bail!("--image: say which shot it is of; give one --shot");
        }
        let (image, source) = read_exr_with_source(path)?;
        check_finite(path, &image)?;
        let difference = match (&flags.difference, &flags.report) {
            (Some(difference), _) => {
                check_writable(difference)?;
                Some(difference.clone())
            }
            (None, Some(folder)) => {
                check_folder(folder)?;
                let name = Path::new(path.file_name().unwrap_or(path.as_os_str()));
                Some(folder.join(name.with_extension("difference.png")))
            }
            (None, None) => None,
        };
        let label = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let image = ForeignImage { label, image };
        Ok(Some(Self { image, source, path: path.clone(), difference }))
    }

    /// The image, to be measured.
    pub fn image(&self) -> &ForeignImage {
        &self.image
    }

    /// Says what of the file is graded; an error unless it is as large as the shot's image.
    pub fn check_size(&self, shot: &Shot) -> anyhow::Result<()> {
        let ([w, h], [shot_w, shot_h]) = (self.image.image.size, shot.camera.size());
        if [w, h] != [shot_w, shot_h] {
            bail!(
                "{}: the image is {w}x{h} and {} is {shot_w}x{shot_h}; render it at that size or give --size {w}x{h}",
                self.path.display(),
                shot.name
            );
        }
        stderr_line(&format!("{}: {}", self.path.display(), self.source));
        Ok(())
    }

    /// Writes the picture of the difference to shadow-map truth, or to ray-cast truth if that is nearer, where it was
    /// asked for.
    pub fn write_difference(&self, pictures: &Pictures) -> anyhow::Result<()> {
        let Some(path) = &self.difference else { return Ok(()) };
        let (truth, png) = scatter_validate::report::difference_png(pictures, &self.image.image)
            .map_err(|error| anyhow!("{}: {error}", path.display()))?;
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            // The report's own folder is made only now.
            std::fs::create_dir_all(folder)
                .with_context(|| format!("{}: cannot be made", folder.display()))?;
        }
        write_atomically(path, |writer| writer.write_all(&png))?;
        stderr_line(&format!(
            "wrote {}: {} - {truth}, red too bright, blue too dark, full colour at a tenth of the truth's mean",
            path.display(),
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
