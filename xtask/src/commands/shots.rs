//! `shots`: what each shot is there to show, how much of it is lit, how often a ray changes, and on request the
//! marcher's steps to each quality level; `--export` writes the built-in ones as files.

use std::fmt::Write;

use anyhow::bail;
use scatter::{Camera, HeightFalloff, Light, Quality};
use scatter_scene::{
    BuiltinShot, MAX_SIDE, MapResolution, RasterDevice, Shot, builtin_shots, builtin_variants, export,
};
use scatter_validate::staged_shot::resized;
use scatter_validate::{
    CascadeGain, MapJudgedShot, RAYCAST_TRUTH, SHADOW_MAP_TRUTH, StagedShot, Survey, cascade_gain, survey,
};
use serde::Serialize;

use crate::Verdict;
use crate::flags::{Maps, ShadowSource, Shots};
use crate::output::{check_folder, print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{MAP_SIZE, ShotSource, baseline, note_lamps, raster_device, shots};

/// What is said of a shot.
#[derive(Debug, Serialize)]
struct ShotEntry {
    name: String,
    shows: Option<&'static str>,
    triangles: usize,
    lights: Vec<&'static str>,
    /// Of height fog \[world units\].
    #[serde(skip_serializing_if = "Option::is_none")]
    scale_height: Option<f64>,
    /// Largest optical depth of a view ray.
    optical_depth: f64,
    resolution: [u32; 2],
    #[serde(flatten)]
    survey: Survey,
    /// The marcher's steps to preview, game and film; a null where its most steps do not reach the level.
    #[serde(skip_serializing_if = "Option::is_none")]
    steps: Option<[Option<u32>; 3]>,
    /// The map's own error with one map and with cascades; a null without a sun.
    #[serde(skip_serializing_if = "Option::is_none")]
    map_error: Option<Option<CascadeGain>>,
}

/// Longest side of the image whose rays are surveyed: ten thousand rays give a share to a percent.
const SURVEY_SIDE: u32 = 160;
/// Side of the shadow map that they are surveyed with: a share does not need more, thin transitions do.
const SURVEY_MAP: u32 = 1024;

/// The maps of `--steps` and `--cascades`.
struct MapChoice {
    resolution: MapResolution,
    device: Option<RasterDevice>,
}

impl MapChoice {
    fn of(flags: &Shots) -> anyhow::Result<Self> {
        let Maps { shadow_map, cascades, shadow_source, .. } = flags.maps;
        if !flags.steps
            && cascades.is_none()
            && (shadow_map.is_some() || shadow_source != ShadowSource::Raycast)
        {
            bail!(
                "shots: the survey has a map of its own; with --shadow-map or --shadow-source add --cascades or --steps"
            );
        }
        let side = shadow_map.unwrap_or(MAP_SIZE[0]);
        let resolution = MapResolution { side, cascades: cascades.unwrap_or(1) };
        let one_map = resolution.in_one_map();
        if one_map.side > MAX_SIDE {
            bail!(
                "--cascades: one map with the texels of {resolution} would be {one_map}, more than {MAX_SIDE}; \
                 give a smaller --shadow-map"
            );
        }
        Ok(Self { resolution, device: raster_device(&flags.maps)? })
    }
}

/// Lists shots, or writes them.
pub fn run(flags: &Shots) -> anyhow::Result<Verdict> {
    let maps = MapChoice::of(flags)?;
    let mut sources = shots(&flags.shots)?;
    if flags.shots.is_empty() {
        sources.extend(builtin_variants().iter().map(ShotSource::BuiltIn));
    }
    if let Some(folder) = &flags.export {
        check_folder(folder)?;
        let chosen: Vec<&BuiltinShot> = builtin_shots()
            .iter()
            .chain(builtin_variants())
            .filter(|shot| flags.shots.is_empty() || flags.shots.iter().any(|name| name == shot.name))
            .collect();
        let progress = Progress::new(None);
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
    let progress = Progress::new(Some(sources.len() as u64));
    let mut entries = Vec::new();
    for source in &sources {
        progress.stage(&source.label());
        entries.push(in_pool(None, |_| entry(source, flags, &maps, &progress))??);
        progress.step();
    }
    drop(progress);
    if flags.json {
        print_json(&entries)?
    } else {
        print(&listing(&entries, maps.resolution))?
    }
    Ok(Verdict::Well)
}

fn entry(
    source: &ShotSource,
    flags: &Shots,
    maps: &MapChoice,
    progress: &Progress,
) -> anyhow::Result<ShotEntry> {
    let mut shot: Shot = source.load()?;
    let triangles = shot.scene.triangles.len();
    let lights = shot.lights.iter().map(|part| kind(&part.light)).collect();
    let scale_height = shot.medium.height_falloff().map(HeightFalloff::scale_height);
    let resolution = shot.camera.size();
    let name = shot.name.clone();
    let steps = match flags.steps {
        true => Some(steps_to_levels(shot.clone(), maps)?),
        false => None,
    };
    note_lamps(&shot, flags.maps.cascades);
    let map_error = match flags.maps.cascades {
        Some(_) => Some(cascade_gain(shot.clone(), maps.resolution, maps.device.as_ref(), &mut |stage| {
            progress.stage(&format!("{name}: {stage}"));
        })?),
        None => None,
    };
    let longest = resolution[0].max(resolution[1]);
    let small = resolution.map(|side| (side * SURVEY_SIDE / longest.max(SURVEY_SIDE)).max(1));
    let camera: Camera = resized(&shot.camera, small)?;
    shot.camera = camera;
    let staged = StagedShot::new(shot, SURVEY_MAP)?;
    let optical_depth = staged.facts()?.iter().map(|facts| facts.max_optical_depth).fold(0.0, f64::max);
    let shows = match source {
        ShotSource::BuiltIn(shot) => Some(shot.shows),
        ShotSource::File(_) => None,
    };
    let survey = survey(&staged)?;
    Ok(ShotEntry {
        name,
        shows,
        triangles,
        lights,
        scale_height,
        optical_depth,
        resolution,
        survey,
        steps,
        map_error,
    })
}

/// At the shot's own size.
fn steps_to_levels(shot: Shot, maps: &MapChoice) -> anyhow::Result<[Option<u32>; 3]> {
    let judged = MapJudgedShot::new(StagedShot::with_source(shot, maps.resolution, maps.device.as_ref())?)?;
    match baseline() {
        Some(baseline) => Ok(baseline.cheapest(Quality::ALL, &judged, &[])?),
        None => Ok([None; 3]),
    }
}

fn kind(light: &Light) -> &'static str {
    match light {
        Light::Directional(_) => "directional",
        Light::Point(_) => "point",
        Light::Spot(_) => "spot",
    }
}

fn listing(entries: &[ShotEntry], resolution: MapResolution) -> String {
    let widest = entries.iter().map(|entry| entry.name.chars().count()).max().unwrap_or(0).max(4);
    let mut text = String::new();
    let with_steps = entries.iter().any(|entry| entry.steps.is_some());
    let _ = write!(
        text,
        "{:<widest$}  {:>9}  {:<16}  {:>8}  {:>6}  {:>8}  {:>5}  ",
        "shot", "triangles", "light", "max σt·D", "lit %", "T mean", "T p90"
    );
    if with_steps {
        let _ = write!(text, "{:>8}  {:>6}  {:>6}  ", "preview", "game", "film");
    }
    let with_errors = entries.iter().any(|entry| entry.map_error.is_some());
    let cascades = format!("{} cascades %", resolution.cascades);
    if with_errors {
        let _ = write!(text, "{:>9}  {cascades:>13}  {:>5}  ", "one map %", "gain");
    }
    text.push_str("shows\n");
    for entry in entries {
        let ShotEntry { name, triangles, optical_depth, survey, .. } = entry;
        let fog = if entry.scale_height.is_some() { ", fog" } else { "" };
        let lights = entry.lights.join("+") + fog;
        let _ = write!(
            text,
            "{name:<widest$}  {triangles:>9}  {lights:<16}  {optical_depth:>8.3}  {:>6.1}  {:>8.2}  {:>5}  ",
            100.0 * survey.lit_share,
            survey.transitions_mean,
            survey.transitions_p90
        );
        for (steps, width) in entry.steps.iter().flatten().zip([8, 6, 6]) {
            let steps = steps.map_or_else(|| "-".to_string(), |steps| steps.to_string());
            let _ = write!(text, "{steps:>width$}  ");
        }
        match entry.map_error {
            Some(Some(gain)) => {
                let [one, several] = [gain.one_map, gain.cascades].map(|map| 100.0 * map.error.rel_rmse);
                let _ = write!(text, "{one:>9.3}  {several:>13.3}  {:>5.2}  ", gain.factor());
            }
            Some(None) => {
                let _ = write!(text, "{:>9}  {:>13}  {:>5}  ", "-", "-", "-");
            }
            None => {}
        }
        let _ = writeln!(text, "{}", entry.shows.unwrap_or("-"));
    }
    text.push_str("\nlit: lit share of all rays' length; T: changes between light and shadow along a ray");
    if with_steps {
        text.push_str("; preview, game, film: the marcher's steps to 10, 3 and 1 %");
    }
    if with_errors {
        let one_map = resolution.in_one_map();
        let _ = write!(
            text,
            "\none map, cascades: the map's own error, rel_rmse of {SHADOW_MAP_TRUTH} against {RAYCAST_TRUTH}, with \
             {one_map} texels and with {resolution}; gain: how many times smaller with cascades"
        );
    }
    text.push('\n');
    text
}
