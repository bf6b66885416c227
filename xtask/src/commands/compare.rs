//! `compare A.exr B.exr`: the error figures of B against the reference A.

use std::fmt::Write;
use std::path::Path;

use anyhow::bail;
use scatter_scene::{RadianceImage, read_exr_with_source, read_mask};
use scatter_validate::{Labelled, compare};

use crate::Verdict;
use crate::flags::Compare;
use crate::output::{print, print_json, stderr_line};

/// Prints the figures. Exit code 0 whatever they are.
pub fn run(flags: &Compare) -> anyhow::Result<Verdict> {
    let (reference, reference_source) = read_exr_with_source(&flags.reference)?;
    let (test, test_source) = read_exr_with_source(&flags.test)?;
    let mask = flags.mask.as_deref().map(|path| read_mask_of(path, &test)).transpose()?;
    let bits = |image: &RadianceImage| image.pixels.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    if reference.size == test.size && bits(&reference) == bits(&test) {
        bail!(
            "{} and {} hold the same bits: an image compared with itself; give two different images",
            flags.reference.display(),
            flags.test.display()
        );
    }
    let (reference_label, test_label) = (label(&flags.reference), label(&flags.test));
    let figures = compare(
        Labelled { label: &reference_label, size: reference.size, pixels: &reference.pixels },
        Labelled { label: &test_label, size: test.size, pixels: &test.pixels },
        mask.as_deref(),
    )?;
    stderr_line(&format!("{}: {reference_source}", flags.reference.display()));
    stderr_line(&format!("{}: {test_source}", flags.test.display()));
    if flags.json {
        print_json(&figures)?;
        return Ok(Verdict::Well);
    }
    let mut text = String::new();
    let rows = [
        ("rel_rmse", figures.rel_rmse),
        ("p99", figures.p99),
        ("p99_lit", figures.p99_lit),
        ("max", figures.max),
        ("bias", figures.bias),
        ("reference mean", figures.reference_mean),
    ];
    for (name, value) in rows {
        let _ = writeln!(text, "{name:<15} {value:.6e}");
    }
    let _ = writeln!(text, "{:<15} {}", "non-finite", figures.non_finite);
    if figures.reference_non_finite > 0 {
        let _ = writeln!(text, "{:<15} {} (left out)", "  in reference", figures.reference_non_finite);
    }
    let _ = writeln!(text, "{:<15} {}", "pixels", figures.pixels);
    print(&text)?;
    Ok(Verdict::Well)
}

fn read_mask_of(path: &Path, image: &RadianceImage) -> anyhow::Result<Vec<bool>> {
    let mask = read_mask(path)?;
    if mask.size != image.size {
        let ([w, h], [iw, ih]) = (mask.size, image.size);
        bail!("{}: the mask is {w}x{h} and the images {iw}x{ih}; give a mask of their size", path.display());
    }
    Ok(mask.excluded)
}

/// The same for every way to write the path, so that a file is recognised as itself.
fn label(path: &Path) -> String {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf()).display().to_string()
}
