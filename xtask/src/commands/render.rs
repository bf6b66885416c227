//! `render`: one shot, one technique, one image; with `--compare` its error figures.

use std::fmt::Write;

use anyhow::{Context, bail};
use raymarch_ref::{HeightFieldWalk, ShadowMapWalk};
use scatter::{Budget, Target};
use scatter_scene::{RaycastTruth, write_exr, write_png};
use scatter_validate::judged_shot::against;
use scatter_validate::measure::{Measurement, Outcome, Renderer, measure};
use scatter_validate::planned::measure_planned;
use scatter_validate::report::exposure;
use scatter_validate::truths::{height_field_truth, raycast_truth, shadow_map_truth};
use scatter_validate::{
    AUTO, Errors, HEIGHT_FIELD_TRUTH, RAYCAST_TRUTH, Row, SHADOW_MAP_TRUTH, Settings, StagedShot,
};

use crate::Verdict;
use crate::auto::AutoPlanner;
use crate::flags::{CompareWith, Render};
use crate::gpu;
use crate::machine_file::machine_of;
use crate::mesh_file::export_mesh;
use crate::output::{check_writable, print, print_json, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{BASELINE, Method, check_options, load, method, raster_device, resolution, shot};

/// Renders, writes, prints.
pub fn run(flags: &Render) -> anyhow::Result<Verdict> {
    let rendering = &flags.rendering;
    let id = match rendering.methods.as_slice() {
        [] => BASELINE,
        [id] => id.as_str(),
        _ => bail!("--method: render takes one technique; give the option once"),
    };
    let id = &gpu::id_on(rendering.on.device, id);
    let method = method(id)?;
    gpu::choose(&rendering.on, id.ends_with("@gpu"))?;
    if id.ends_with("@gpu") {
        let adapter = gpu::adapter().map_err(|none| anyhow::anyhow!("--method {id}: {none}"))?;
        stderr_line(&format!("gpu: {adapter}"));
    }
    match method {
        Method::Technique(technique) => check_options(&rendering.set, &[technique])?,
        _ => check_options(&rendering.set, &[])?,
    }
    // What is wrong with its file is said before any work.
    let machine =
        if matches!(method, Method::Auto) { Some(machine_of(flags.machine.as_deref())?) } else { None };
    let has_use = flags.out.is_some() || flags.png.is_some() || flags.export_mesh.is_some();
    if !has_use && !rendering.json && flags.compare.is_none() {
        bail!("render: nothing to do with the image; give --out F.exr, --png F.png, --compare or --json");
    }
    if flags.out.is_some() && flags.out == flags.png {
        bail!("--out and --png name the same file; give two");
    }
    for path in [&flags.out, &flags.png, &flags.export_mesh].into_iter().flatten() {
        check_writable(path)?;
    }
    let raster = raster_device(&rendering.maps)?;
    let source = shot(&flags.shot)?;
    let progress = Progress::new(None);
    let (row, notes) = in_pool(rendering.threads, |threads| {
        progress.stage(&format!("{}: loading", source.label()));
        let shot = load(&source, rendering)?;
        let notes = shot.notes.clone();
        let settings = Settings {
            quality: rendering.quality,
            overrides: rendering.set.clone(),
            resolution: resolution(rendering),
            raster,
            repeat: rendering.repeat,
            threads,
        };
        let planner = machine.map(|machine| AutoPlanner {
            budget: Budget::Level(rendering.quality),
            machine: machine.with_threads(threads),
        });
        anyhow::Ok((render(flags, id, (method, planner.as_ref()), shot, &settings, &progress)?, notes))
    })??;
    drop(progress);
    for note in notes {
        stderr_line(&format!("note: {}: {note}", source.label()));
    }
    if rendering.json {
        print_json(&row)?
    } else {
        print(&summary(&row))?
    }
    Ok(Verdict::Well)
}

/// Does the work stage by stage, holding no image and no map longer than it must.
fn render(
    flags: &Render,
    id: &str,
    (method, planner): (Method, Option<&AutoPlanner>),
    shot: scatter_scene::Shot,
    settings: &Settings,
    progress: &Progress,
) -> anyhow::Result<Row> {
    let device = settings.raster.as_ref();
    // The triangles' truth reads no maps, and they may take longer than it does.
    let reads_maps = !matches!(method, Method::RaycastTruth)
        || flags.export_mesh.is_some()
        || !matches!(flags.compare, None | Some(CompareWith::Raycast));
    progress.stage(&format!("{}: {}", shot.name, if reads_maps { "maps" } else { "tree" }));
    let mut shot = if reads_maps {
        StagedShot::with_source(shot, settings.resolution, device)?
    } else {
        StagedShot::without_maps(shot, settings.resolution, device)?
    };
    progress.stage(&format!("{}: {id}", shot.name()));
    let (measurement, planned) = match planner {
        Some(planner) => {
            let (measurement, choice) = measure_planned(&shot, planner, settings.repeat)?;
            (measurement, Some(choice))
        }
        None => (rendered(method, &shot, settings)?, None),
    };
    // What they follow from is gone with the maps.
    let resolved = match method {
        Method::Technique(technique) => {
            let target = Target::Quality(settings.quality);
            Renderer::resolved(technique, target, &overrides(settings), &shot)?.context("--set")?
        }
        _ => Default::default(),
    };
    if let Some(path) = &flags.out {
        write_exr(path, &measurement.image)?;
    }
    if let Some(path) = &flags.png {
        write_png(path, &measurement.image, exposure(&measurement.image) as f32)?;
    }
    let wants = |truth: CompareWith, truth_id: &str| match flags.compare {
        // An image is not compared with itself; asked for by name, that is an error.
        Some(CompareWith::Both) => truth_id != id && truth != CompareWith::HeightField,
        Some(CompareWith::All) => truth_id != id,
        Some(wanted) => wanted == truth,
        None => false,
    };
    let mut errors = Errors::default();
    if wants(CompareWith::ShadowMap, SHADOW_MAP_TRUTH) {
        progress.stage(&format!("{}: {SHADOW_MAP_TRUTH}", shot.name()));
        let truth = if id == SHADOW_MAP_TRUTH { measurement.clone() } else { shadow_map_truth(&shot)? };
        errors.shadow_map = Some(against(&shot, &truth, &measurement)?);
    }
    if wants(CompareWith::HeightField, HEIGHT_FIELD_TRUTH) {
        progress.stage(&format!("{}: {HEIGHT_FIELD_TRUTH}", shot.name()));
        let truth = if id == HEIGHT_FIELD_TRUTH { measurement.clone() } else { height_field_truth(&shot)? };
        errors.height_field = Some(against(&shot, &truth, &measurement)?);
    }
    if let Some(path) = &flags.export_mesh {
        progress.stage(&format!("{}: mesh", shot.name()));
        export_mesh(path, &shot, &overrides(settings))?;
    }
    shot.drop_maps();
    if wants(CompareWith::Raycast, RAYCAST_TRUTH) {
        progress.stage(&format!("{}: {RAYCAST_TRUTH}", shot.name()));
        let truth = if id == RAYCAST_TRUTH { measurement.clone() } else { raycast_truth(&shot)? };
        errors.raycast = Some(against(&shot, &truth, &measurement)?);
    }
    let mut row = Row::new(&shot, &measurement, settings, errors);
    row.overrides = settings.overrides.iter().cloned().collect();
    if let Method::Technique(technique) = method {
        row.emulated = !gpu::emulated(&[technique]).is_empty();
        row.options = resolved;
        row.level = Some(settings.quality.to_string());
    }
    if let Some(planned) = planned {
        (row.method, row.requested) = (planned.method, Some(AUTO.into()));
        (row.options, row.overrides) = (planned.options, planned.overrides);
        row.level = Some(settings.quality.to_string());
    }
    Ok(row)
}

fn overrides(settings: &Settings) -> Vec<(&str, &str)> {
    settings.overrides.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect()
}

fn rendered(method: Method, shot: &StagedShot, settings: &Settings) -> anyhow::Result<Measurement> {
    let (mut walk, mut height_field) = (ShadowMapWalk::new(), HeightFieldWalk);
    let mut raycast = RaycastTruth::new(shot.caster());
    let mut renderer = match method {
        Method::ShadowMapTruth => Renderer::Shared(&mut walk),
        Method::RaycastTruth => Renderer::Shared(&mut raycast),
        Method::HeightFieldTruth => Renderer::Shared(&mut height_field),
        Method::Auto => bail!("{}: auto has no planner", shot.name()),
        Method::Technique(technique) => {
            let target = Target::Quality(settings.quality);
            Renderer::configured(technique, target, &overrides(settings), shot)?.context("--set")?
        }
    };
    match measure(shot, &mut renderer, settings.repeat)? {
        Outcome::Measured(measurement) => Ok(*measurement),
        Outcome::Unsupported(unsupported) => {
            bail!("{}: {unsupported}; choose another technique with --method", shot.name())
        }
    }
}

fn summary(row: &Row) -> String {
    let mut text = String::new();
    let [width, height] = row.size;
    let _ = writeln!(
        text,
        "{} on {}: {width}x{height}, {:.1} ms, maps {:.1} ms, {} threads",
        row.method,
        row.shot,
        row.total_ms(),
        row.maps_ms,
        row.threads
    );
    for (stage, time) in row.time_ms.iter().filter(|(stage, _)| *stage != "total") {
        let _ = writeln!(text, "  {stage:<20} {time:>12.2} ms");
    }
    for (name, count) in &row.counts {
        let _ = writeln!(text, "  {name:<20} {count:>12}");
    }
    let truths = [
        (SHADOW_MAP_TRUTH, row.errors.shadow_map),
        (RAYCAST_TRUTH, row.errors.raycast),
        (HEIGHT_FIELD_TRUTH, row.errors.height_field),
    ];
    for (truth, figures) in truths {
        let Some(f) = figures else { continue };
        let _ = writeln!(
            text,
            "  against {truth}: rel_rmse {:.3e}, p99 {:.3e}, p99_lit {:.3e}, max {:.3e}, bias {:.3e}, non-finite {}",
            f.rel_rmse, f.p99, f.p99_lit, f.max, f.bias, f.non_finite
        );
    }
    text
}
