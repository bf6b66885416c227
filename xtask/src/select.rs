//! From names on the command line to shots and techniques; what does not exist lists what does.

use std::path::Path;

use anyhow::{Context, bail};
use raymarch_ref::MOST_STEPS;
use scatter::{Camera, Light, TECHNIQUES, Technique, technique};
use scatter_scene::{
    BuiltinShot, MapResolution, RasterDevice, RasterOptions, Shot, builtin_shots, builtin_variants, export,
    load_shot,
};
use scatter_validate::staged_shot::resized;
use scatter_validate::{AUTO, Baseline, ByHand, HEIGHT_FIELD_TRUTH, RAYCAST_TRUTH, SHADOW_MAP_TRUTH};

use crate::flags::{Maps, Rendering, ShadowSource};
use crate::gpu;
use crate::output::stderr_line;

/// The technique that the others' times are compared with.
pub const BASELINE: &str = "raymarch";
/// Texels along a side of the shadow map, without and with `--quick`.
pub const MAP_SIZE: [u32; 2] = [2048, 512];
/// Longest side of an image with `--quick`.
const QUICK_SIDE: u32 = 160;

/// Where a shot comes from.
pub enum ShotSource {
    /// Made by the project itself.
    BuiltIn(&'static BuiltinShot),
    /// A shot file or a mesh.
    File(std::path::PathBuf),
}

/// What renders.
#[derive(Clone, Copy)]
pub enum Method {
    /// A technique or the marcher.
    Technique(&'static dyn Technique),
    /// What a planner chooses.
    Auto,
    /// The exact image for the shadow map.
    ShadowMapTruth,
    /// The exact image for the triangles.
    RaycastTruth,
    /// The exact image for the surface that interpolates the shadow map.
    HeightFieldTruth,
}

/// Finds all named shots; all built-in ones if none is named.
pub fn shots(names: &[String]) -> anyhow::Result<Vec<ShotSource>> {
    if names.is_empty() {
        return Ok(builtin_shots().iter().map(ShotSource::BuiltIn).collect());
    }
    names.iter().map(|name| shot(name)).collect()
}

/// Finds a shot by its built-in name, or takes the name as a path.
pub fn shot(name: &str) -> anyhow::Result<ShotSource> {
    if let Some(built_in) = BuiltinShot::find(name) {
        return Ok(ShotSource::BuiltIn(built_in));
    }
    let path = Path::new(name);
    if !path.exists() && path.extension().is_none() {
        let known: Vec<_> = builtin_shots().iter().chain(builtin_variants()).map(|shot| shot.name).collect();
        bail!("--shot {name}: no such file, nor a built-in shot; built in are {}", known.join(", "));
    }
    Ok(ShotSource::File(path.to_path_buf()))
}

impl ShotSource {
    /// Its name, before it is loaded.
    pub fn label(&self) -> String {
        match self {
            Self::BuiltIn(shot) => shot.name.to_string(),
            Self::File(path) => path.display().to_string(),
        }
    }

    /// Loads it; built-in shots are written to a temporary folder and read back like any other.
    pub fn load(&self) -> anyhow::Result<Shot> {
        match self {
            Self::File(path) => Ok(load_shot(path)?),
            Self::BuiltIn(shot) => {
                let folder = tempfile::tempdir().context("temporary folder: cannot be made; set TMPDIR")?;
                let paths = export(folder.path(), &[shot])?;
                let path = paths.first().context("a built-in shot has no shot file")?;
                Ok(load_shot(path)?)
            }
        }
    }
}

/// Finds a technique or reference by its id.
pub fn method(id: &str) -> anyhow::Result<Method> {
    match id {
        AUTO => Ok(Method::Auto),
        SHADOW_MAP_TRUTH => Ok(Method::ShadowMapTruth),
        RAYCAST_TRUTH => Ok(Method::RaycastTruth),
        HEIGHT_FIELD_TRUTH => Ok(Method::HeightFieldTruth),
        _ => match technique(id).or_else(|| gpu::technique(id)) {
            Some(technique) => Ok(Method::Technique(technique)),
            None => bail!("--method {id}: no such technique; there are {}", method_ids().join(", ")),
        },
    }
}

/// All ids that `--method` takes.
pub fn method_ids() -> Vec<&'static str> {
    let techniques = TECHNIQUES.iter().map(|technique| technique.info().id);
    let on_gpu = gpu::techniques().iter().map(|technique| technique.info().id);
    [AUTO, RAYCAST_TRUTH, SHADOW_MAP_TRUTH, HEIGHT_FIELD_TRUTH]
        .into_iter()
        .chain(techniques)
        .chain(on_gpu)
        .collect()
}

/// The marcher, with its step count.
pub fn baseline() -> Option<Baseline<'static>> {
    technique(BASELINE).map(|technique| Baseline { technique, knob: "steps", most: MOST_STEPS })
}

/// The options by hand of each technique: those of `--set` that it has. An error for one that none of them has, or at a value that
/// one of them does not take.
pub fn options_by_hand(
    set: &[(String, String)],
    techniques: &[&dyn Technique],
) -> anyhow::Result<Vec<ByHand>> {
    for (key, value) in set {
        let Some(first) = techniques.first() else {
            bail!(
                "--set {key}={value}: references and auto have no options; leave it out, or name a technique"
            );
        };
        if techniques.iter().all(|technique| technique.info().option(key).is_err()) {
            // One technique's own message lists its options; with several every list would be too long.
            first.info().option(key).with_context(|| format!("--set {key}={value}"))?;
        }
    }
    let of = |technique: &&dyn Technique| ByHand::of(*technique, set).context("--set");
    techniques.iter().map(of).collect()
}

/// An error for options that cannot be set: [`options_by_hand`].
pub fn check_options(set: &[(String, String)], techniques: &[&dyn Technique]) -> anyhow::Result<()> {
    options_by_hand(set, techniques).map(drop)
}

/// The device that draws the maps; none where rays make them.
pub fn raster_device(maps: &Maps) -> anyhow::Result<Option<RasterDevice>> {
    let wanted = maps.vulkan_device.as_deref();
    if maps.shadow_source != ShadowSource::Raster {
        if wanted.is_some() {
            bail!("--vulkan-device: rays make the maps; add --shadow-source raster");
        }
        return Ok(None);
    }
    let device = wanted.unwrap_or_default().parse()?;
    let options = RasterOptions { device, ..RasterOptions::default() };
    Ok(Some(RasterDevice::open(&options).context("--shadow-source raster")?))
}

/// Texels of each light's shadow maps.
pub fn resolution(rendering: &Rendering) -> MapResolution {
    let Maps { shadow_map, cascades, .. } = rendering.maps;
    let side = shadow_map.unwrap_or(MAP_SIZE[usize::from(rendering.quick)]);
    MapResolution { side, cascades: cascades.unwrap_or(1) }
}

/// Says, once a shot, which of its lights `--cascades` does not concern.
pub fn note_lamps(shot: &Shot, cascades: Option<u32>) {
    let Some(count) = cascades else { return };
    let lamps = shot.lights.iter().filter(|part| !matches!(part.light, Light::Directional(_))).count();
    let which = match (lamps, shot.lights.len() - lamps) {
        (0, _) => return,
        (1, 0) => "its light is a lamp, which keeps its own map",
        (_, 0) => "its lights are lamps, which keep their own maps",
        _ => "its lamps keep their own maps",
    };
    stderr_line(&format!("note: {}: --cascades {count} is for a sun's map; {which}", shot.name));
}

/// Loads a shot at the size that was asked for.
pub fn load(source: &ShotSource, rendering: &Rendering) -> anyhow::Result<Shot> {
    let shot = at_size(source.load()?, rendering)?;
    note_lamps(&shot, rendering.maps.cascades);
    Ok(shot)
}

fn at_size(mut shot: Shot, rendering: &Rendering) -> anyhow::Result<Shot> {
    let [width, height] = shot.camera.size();
    let longest = width.max(height);
    let size = match rendering.size {
        Some(size) => size,
        None if rendering.quick && longest > QUICK_SIDE => {
            [width, height].map(|side| (side * QUICK_SIDE / longest).max(1))
        }
        None => return Ok(shot),
    };
    let camera: Camera = resized(&shot.camera, size).with_context(|| shot.name.clone())?;
    shot.camera = camera;
    Ok(shot)
}
