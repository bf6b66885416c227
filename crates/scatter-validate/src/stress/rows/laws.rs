//! Laws that bind two images, whatever they are: scaling, linearity, occlusion, reflection, motion.

use glam::DVec3;
use scatter_core::{Camera, Light, Medium, ModelError, Scattering};

use crate::scenario::{MapFrame, Scenario, Shadow};
use crate::stress::row::{Law, ROUNDING, Relation, StressRow};
use crate::stress::scenes::{self, SCENES, light_with};

const GROUP: &str = "laws";

/// Depths are f32: 6e-8 of up to 30 units move the ends of stretches, a unit being the shortest way to an end. Ten
/// ends a ray, in both images.
const MOVED_ENDS: f64 = ROUNDING + 2.0 * 10.0 * 6e-8 * 30.0;

/// Rows of laws.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        for k in [1e-4, 1e4] {
            rows.push(law(format!("lengths × {k:e}, σ / {k:e}, {light}"), || scaled(scene()?, k)));
        }
        rows.push(law(format!("1000 × the light, {light}"), || {
            let first = scene()?;
            let second = Scenario { light: first.light.scaled(1000.0)?, ..first.clone() };
            Ok(Relation { first, second, law: Law::Same, factor: 1000.0, reference_tolerance: ROUNDING })
        }));
        rows.push(law(format!("one more occluder, {light}"), || {
            let first = scene()?;
            let second =
                first.clone().with_depths(|old, i, j| if (i * 7 + j) % 4 == 0 { old.min(1.5) } else { old });
            Ok(Relation { first, second, law: Law::NotBrighter, factor: 1.0, reference_tolerance: ROUNDING })
        }));
        rows.push(law(format!("longer rays are not darker, {light}"), || {
            let second = scene()?;
            let first = second.clone();
            // The shorter one is the second: it must not be brighter.
            let second = Scenario { max_distance: 4.0, ..second };
            Ok(Relation { first, second, law: Law::NotBrighter, factor: 1.0, reference_tolerance: ROUNDING })
        }));
    }
    rows.push(law("mirrored, sun".into(), || mirrored(scenes::sun()?)));
    rows.push(law("mirrored, spot".into(), || mirrored(scenes::spot()?)));
    rows.push(law("moved by (512, -64, 1024), point".into(), || {
        let first = scenes::point()?;
        let second = first.clone().moved(DVec3::new(512.0, -64.0, 1024.0))?;
        Ok(Relation { first, second, law: Law::Same, factor: 1.0, reference_tolerance: ROUNDING })
    }));
    rows
}

fn law(name: String, relation: impl FnOnce() -> Result<Relation, ModelError>) -> StressRow {
    StressRow::relation(GROUP, name, relation())
}

/// Everything `k` times as large in a medium `k` times as thin: a sun's image stays, a lamp's too with `k²` times the
/// intensity.
pub(super) fn scaled(first: Scenario, k: f64) -> Result<Relation, ModelError> {
    let mut second = first.clone();
    let camera = &first.camera;
    second.camera = Camera::perspective_off_centre(
        (k * camera.eye()).to_array(),
        (k * camera.eye() + camera.forward()).to_array(),
        camera.up().to_array(),
        camera.window(),
        camera.size(),
    )?;
    second.distances.iter_mut().for_each(|distance| *distance = (f64::from(*distance) * k) as f32);
    second.max_distance *= k;
    let components = first.medium.components().iter();
    let components = components
        .map(|part| Scattering { sigma_s: part.sigma_s.map(|s| s / k), phase: part.phase })
        .collect();
    second.medium = Medium::new(components, first.medium.sigma_a().map(|s| s / k))?;
    if let Some(falloff) = first.medium.height_falloff() {
        second = second.in_fog(falloff.up(), falloff.base_height() * k, falloff.scale_height() * k)?;
    }
    let scaled = light_with(&first.light, |place| k * place, |way| way)?;
    second.light = if matches!(scaled, Light::Directional(_)) { scaled } else { scaled.scaled(k * k)? };
    second = second.with_depths(|old, _, _| (f64::from(old) * k) as f32);
    let grow = |frame: &mut MapFrame| {
        frame.origin *= k;
        if !frame.perspective {
            frame.half = frame.half.map(|half| half * k);
        }
    };
    match &mut second.shadow {
        Shadow::Parallel(layers) => layers.iter_mut().for_each(|map| grow(&mut map.frame)),
        Shadow::Perspective(map) => grow(&mut map.frame),
        Shadow::None | Shadow::Cube { .. } => {}
    }
    Ok(Relation { first, second, law: Law::Same, factor: 1.0, reference_tolerance: MOVED_ENDS })
}

/// The world reflected at x = 0, and its map's columns with it.
pub(super) fn mirrored(first: Scenario) -> Result<Relation, ModelError> {
    let flip = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
    let mut second = first.clone();
    let camera = &first.camera;
    let eye = flip(camera.eye());
    second.camera = Camera::perspective_off_centre(
        eye.to_array(),
        (eye + flip(camera.forward())).to_array(),
        flip(camera.up()).to_array(),
        camera.window(),
        camera.size(),
    )?;
    let width = camera.size()[0] as usize;
    second.distances.chunks_mut(width).for_each(<[f32]>::reverse);
    second.light = light_with(&first.light, flip, flip)?;
    second = second.with_fog_moved(|up, base, scale| (flip(up), base, scale))?;
    let layers = match &mut second.shadow {
        Shadow::Parallel(layers) => layers.as_mut_slice(),
        Shadow::Perspective(layer) => std::slice::from_mut(layer),
        Shadow::None | Shadow::Cube { .. } => &mut [],
    };
    for layer in layers {
        let frame = &mut layer.frame;
        (frame.origin, frame.forward, frame.up) = (flip(frame.origin), flip(frame.forward), flip(frame.up));
        layer.texels.chunks_mut(frame.size[0] as usize).for_each(<[f32]>::reverse);
    }
    Ok(Relation { first, second, law: Law::Mirrored, factor: 1.0, reference_tolerance: ROUNDING })
}
