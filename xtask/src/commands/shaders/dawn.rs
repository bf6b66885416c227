//! A second opinion: Dawn, which compiles WGSL for Chrome, finds barriers in flow that is not uniform, which naga lets pass.
//! It runs on a null device, in node with the npm package `webgpu`; without them the check is skipped and says so.

use std::io::Write;
use std::process::{Command, Stdio};

use anyhow::Context;
use serde::Serialize;

use super::translation::Translation;

/// What Dawn said.
pub enum Dawn {
    /// Errors of each module, in order.
    Checked(Vec<Vec<String>>),
    /// Why it was not run.
    Skipped(String),
}

#[derive(Serialize)]
struct Source<'a> {
    code: &'a str,
}

/// Compiles each module.
pub fn check(translations: &[Translation]) -> anyhow::Result<Dawn> {
    let found = Command::new("node").args(["-e", "require.resolve('webgpu')"]).stderr(Stdio::null()).status();
    match found {
        Err(_) => return Ok(Dawn::Skipped("node is not installed".into())),
        Ok(status) if !status.success() => {
            return Ok(Dawn::Skipped(
                "node finds no package `webgpu`; `npm install webgpu` here, or set NODE_PATH".into(),
            ));
        }
        Ok(_) => {}
    }
    let sources: Vec<Source<'_>> = translations.iter().map(|t| Source { code: &t.wgsl }).collect();
    let mut node = Command::new("node")
        .args(["-e", include_str!("dawn.js")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .context("node")?;
    if let Some(mut stdin) = node.stdin.take() {
        stdin.write_all(serde_json::to_string(&sources)?.as_bytes()).context("node")?;
    }
    let output = node.wait_with_output().context("node")?;
    match serde_json::from_slice::<Vec<Vec<String>>>(&output.stdout) {
        Ok(errors) if errors.len() == translations.len() => Ok(Dawn::Checked(errors)),
        _ => Ok(Dawn::Skipped(format!("node's package `webgpu` opened no null device ({})", output.status))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::shaders::translation::translated;
    use scatter_gpu::kernels::{Module, modules};

    /// Rung 0b: what WebGPU's other compiler says of all modules, and that it sees a barrier that not all threads of a workgroup
    /// reach, which naga lets pass.
    #[test]
    fn dawn_takes_every_module_and_rejects_a_barrier_in_a_branch() {
        let all: Vec<_> = modules::all().collect();
        let barrier = |name: &str| all.iter().find(|module| module.name == name);
        let original = barrier("minmax-mipmap/extrema-low").unwrap();
        let files: Vec<&'static str> = original
            .files
            .iter()
            .map(|text| {
                &*text.replace("workgroupBarrier();", "if thread.x < 3u { workgroupBarrier(); }").leak()
            })
            .collect();
        let mutant = Module { name: "mutant", files: files.leak(), entries: original.entries };
        // Naga takes it: that is why there is a second opinion.
        let translations: Vec<_> =
            all.iter().copied().chain([&mutant]).map(|module| translated(module).unwrap()).collect();
        match check(&translations).unwrap() {
            Dawn::Skipped(reason) => println!("SKIPPED: Dawn: {reason}"),
            Dawn::Checked(errors) => {
                let (wrong, right) = errors.split_last().unwrap();
                println!("{} modules; the mutant: {:?}", right.len(), wrong.first());
                assert!(right.iter().all(Vec::is_empty), "{right:?}");
                assert!(wrong.iter().any(|error| error.contains("uniform")), "{wrong:?}");
            }
        }
    }
}
