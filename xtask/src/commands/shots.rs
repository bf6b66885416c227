//! `shots`: what each shot is there to show; `--export` writes the built-in ones as files.

use std::fmt::Write;

use scatter::{Camera, Light};
use scatter_scene::{BuiltinShot, Shot, builtin_shots, export};
use scatter_validate::StagedShot;
use scatter_validate::staged_shot::resized;
use serde::Serialize;

use crate::Verdict;
use crate::flags::Shots;
use crate::output::{check_folder, print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{ShotSource, shots};

/// What is said of a shot.
#[derive(Debug, Serialize)]
struct ShotEntry {
    name: String,
    shows: Option<&'static str>,
    triangles: usize,
    lights: Vec<&'static str>,
    /// Largest σt times the longest ray.
    optical_depth: f64,
    resolution: [u32; 2],
}

/// Image width and shadow map at which rays are looked at: the longest ray needs no more.
const SURVEY_SIDE: u32 = 160;

/// Lists shots, or writes them.
pub fn run(flags: &Shots) -> anyhow::Result<Verdict> {
    let sources = shots(&flags.shots)?;
    if let Some(folder) = &flags.export {
        check_folder(folder)?;
        let chosen: Vec<&BuiltinShot> = builtin_shots()
            .iter()
            .filter(|shot| flags.shots.is_empty() || flags.shots.iter().any(|name| name == shot.name))
            .collect();
        let progress = Progress::new(None, false);
        progress.stage("writing shots");
        let paths = export(folder, &chosen)?;
        drop(progress);
        for path in &paths {
            stderr_line(&format!("wrote {}", path.display()));
        }
        if !flags.json {
            return Ok(Verdict::Well);
        }
    }
    let progress = Progress::new(Some(sources.len() as u64), false);
    let mut entries = Vec::new();
    for source in &sources {
        progress.stage(&source.label());
        entries.push(in_pool(None, |_| entry(source))??);
        progress.step();
    }
    drop(progress);
    if flags.json {
        print_json(&entries)?
    } else {
        print(&listing(&entries))?
    }
    Ok(Verdict::Well)
}

fn entry(source: &ShotSource) -> anyhow::Result<ShotEntry> {
    let mut shot: Shot = source.load()?;
    let triangles = shot.scene.triangles.len();
    let lights = shot.lights.iter().map(|part| kind(&part.light)).collect();
    let resolution = shot.camera.size();
    let longest = resolution[0].max(resolution[1]);
    let small = resolution.map(|side| (side * SURVEY_SIDE / longest.max(SURVEY_SIDE)).max(1));
    let camera: Camera = resized(&shot.camera, small)?;
    shot.camera = camera;
    let name = shot.name.clone();
    let staged = StagedShot::new(shot, SURVEY_SIDE)?;
    let optical_depth = staged.facts()?.iter().map(|facts| facts.max_optical_depth).fold(0.0, f64::max);
    let shows = match source {
        ShotSource::BuiltIn(shot) => Some(shot.shows),
        ShotSource::File(_) => None,
    };
    Ok(ShotEntry { name, shows, triangles, lights, optical_depth, resolution })
}

fn kind(light: &Light) -> &'static str {
    match light {
        Light::Directional(_) => "directional",
        Light::Point(_) => "point",
        Light::Spot(_) => "spot",
    }
}

fn listing(entries: &[ShotEntry]) -> String {
    let widest = entries.iter().map(|entry| entry.name.chars().count()).max().unwrap_or(0).max(4);
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:<widest$}  {:>9}  {:<12}  {:>8}  {:<10}  shows",
        "shot", "triangles", "light", "max σt·D", "size"
    );
    for entry in entries {
        let ShotEntry { name, triangles, optical_depth, resolution: [w, h], .. } = entry;
        let lights = entry.lights.join("+");
        let shows = entry.shows.unwrap_or("-");
        let size = format!("{w}x{h}");
        let _ = writeln!(
            text,
            "{name:<widest$}  {triangles:>9}  {lights:<12}  {optical_depth:>8.3}  {size:<10}  {shows}"
        );
    }
    text
}
