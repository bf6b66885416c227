//! `shaders`: every module of the GPU's techniques, checked by two compilers and written for three APIs.

mod dawn;
mod translation;

use std::fmt::Write;

use anyhow::Context;
use scatter_gpu::kernels::{Module, modules};
use serde::Serialize;

use self::dawn::Dawn;
use self::translation::{Translation, translated};
use crate::Verdict;
use crate::flags::Shaders;
use crate::output::{check_folder, print, print_json, stderr_line, write_bytes, write_text};

/// What was found of one module.
#[derive(Serialize)]
struct ShaderRow {
    module: &'static str,
    entries: Vec<&'static str>,
    /// Bindings of the entry that has most.
    bindings: usize,
    workgroup_bytes: u32,
    wgsl_bytes: usize,
    spirv_bytes: usize,
    hlsl_bytes: usize,
    msl_bytes: usize,
    /// Dawn's errors, each with its line; none where it was not run.
    #[serde(skip_serializing_if = "Option::is_none")]
    dawn: Option<Vec<String>>,
}

/// Checks, prints, writes.
pub fn run(flags: &Shaders) -> anyhow::Result<Verdict> {
    if let Some(folder) = &flags.out {
        check_folder(folder)?;
    }
    let all: Vec<&Module> = modules::all().collect();
    let translations = all.iter().map(|module| translated(module)).collect::<anyhow::Result<Vec<_>>>()?;
    let dawn = dawn::check(&translations)?;
    if let Some(folder) = &flags.out {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        for translation in &translations {
            let path = |extension| folder.join(format!("{}.{extension}", translation.name.replace('/', "-")));
            write_text(&path("wgsl"), &translation.wgsl)?;
            write_bytes(&path("spv"), &translation.spirv)?;
            write_text(&path("hlsl"), &translation.hlsl)?;
            write_text(&path("metal"), &translation.msl)?;
        }
        stderr_line(&format!("wrote {} files into {}", 4 * translations.len(), folder.display()));
    }
    let rows: Vec<ShaderRow> = all
        .iter()
        .zip(&translations)
        .enumerate()
        .map(|(index, pair)| row(pair, dawn.errors_of(index)))
        .collect();
    if flags.json {
        print_json(&rows)?;
    } else {
        print(&table(&rows))?;
    }
    stderr_line(&dawn.sentence());
    let is_refused = rows.iter().any(|row| row.dawn.as_ref().is_some_and(|errors| !errors.is_empty()));
    Ok(if is_refused { Verdict::OutOfTolerance } else { Verdict::Well })
}

fn row((module, translation): (&&Module, &Translation), dawn: Option<Vec<String>>) -> ShaderRow {
    ShaderRow {
        module: module.name,
        entries: module.entries.iter().map(|entry| entry.name).collect(),
        bindings: module.entries.iter().map(|entry| entry.bindings.len()).max().unwrap_or(0),
        workgroup_bytes: translation.workgroup_bytes,
        wgsl_bytes: translation.wgsl.len(),
        spirv_bytes: translation.spirv.len(),
        hlsl_bytes: translation.hlsl.len(),
        msl_bytes: translation.msl.len(),
        dawn,
    }
}

fn table(rows: &[ShaderRow]) -> String {
    let mut text = format!(
        "{:<29}{:>8}{:>10}{:>13}{:>8}{:>10}{:>8}{:>8}  dawn\n",
        "module", "entries", "bindings", "workgroup B", "WGSL B", "SPIR-V B", "HLSL B", "MSL B"
    );
    for row in rows {
        let dawn = match &row.dawn {
            None => "SKIPPED",
            Some(errors) if errors.is_empty() => "ok",
            Some(_) => "FAIL",
        };
        let _ = writeln!(
            text,
            "{:<29}{:>8}{:>10}{:>13}{:>8}{:>10}{:>8}{:>8}  {dawn}",
            row.module,
            row.entries.len(),
            row.bindings,
            row.workgroup_bytes,
            row.wgsl_bytes,
            row.spirv_bytes,
            row.hlsl_bytes,
            row.msl_bytes
        );
    }
    for row in rows {
        for error in row.dawn.iter().flatten() {
            let _ = writeln!(text, "FAIL {}: {error}", row.module);
        }
    }
    text
}

impl Dawn {
    /// What is said of it below the table.
    fn sentence(&self) -> String {
        match self {
            Self::Checked(_) => {
                "Dawn (the WebGPU implementation of Chrome, null device) compiled every module".into()
            }
            Self::Skipped(reason) => format!("SKIPPED: Dawn: {reason}"),
        }
    }

    /// Its errors in the module of that index.
    fn errors_of(&self, index: usize) -> Option<Vec<String>> {
        match self {
            Self::Checked(errors) => errors.get(index).cloned(),
            Self::Skipped(_) => None,
        }
    }
}
