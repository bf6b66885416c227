//! Cameras and KHR_lights_punctual lights of the node hierarchy.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.10; KHR_lights_punctual. Departures: near and far planes and the
//! aspect ratio are not read; a light's `range` is no part of the model, and is noted; equal inner and outer cone angles
//! are allowed.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DMat4;

use super::document::Document;
use super::exact::{Camera, Light};
use super::nodes::node_place;
use crate::error::{Checked, Fault};
use crate::scene::{SceneCamera, SceneLens, SceneLight, SceneLightKind};

/// Angles in files are rounded to f32, which puts a right angle 4e-8 above π/2: this much is forgiven and clamped.
const ANGLE_ROUNDING: f64 = 1e-6;

/// The node's camera, if it has one.
pub(super) fn scene_camera(
    document: &Document,
    node_idx: usize,
    world_from_camera: DMat4,
) -> Checked<Option<SceneCamera>> {
    let node = &document.root.nodes[node_idx];
    let Some(camera_idx) = node.camera.map(|camera| camera.value()) else { return Ok(None) };
    let camera = listed(document, node_idx, "camera", &document.exact.cameras, camera_idx)?;
    let name = node.name.as_ref().or(camera.name.as_ref());
    let name = name.map_or_else(|| format!("camera-{camera_idx}"), String::clone);
    let lens = lens(camera, camera_idx)?;
    Ok(Some(SceneCamera { name, world_from_camera, lens }))
}

/// The node's light, if it has one.
pub(super) fn scene_light(
    document: &Document,
    node_idx: usize,
    world_from_light: DMat4,
    notes: &mut Vec<String>,
) -> Checked<Option<SceneLight>> {
    let node = &document.root.nodes[node_idx];
    let reference = node.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let Some(light_idx) = reference.map(|reference| reference.light.value()) else {
        return Ok(None);
    };
    let light = listed(document, node_idx, "light", &document.exact.extensions.lights.lights, light_idx)?;
    let place = || format!("lights[{light_idx}]");
    let name = node.name.as_ref().or(light.name.as_ref());
    let name = name.map_or_else(|| format!("light-{light_idx}"), String::clone);
    let strength = light.color.map(|c| c * light.intensity);
    if strength.iter().any(|s| !s.is_finite() || *s < 0.0) {
        let problem = format!("color times intensity is {strength:?}");
        return Err(Fault::invalid(place(), problem, "give finite numbers that are not negative"));
    }
    let kind = match light.kind.as_str() {
        "directional" => SceneLightKind::Directional,
        "point" => SceneLightKind::Point,
        "spot" => cone(light).ok_or_else(|| {
            let problem = "the spot's cone angles are out of order";
            Fault::invalid(place(), problem, "0 ≤ innerConeAngle ≤ outerConeAngle ≤ π/2, in radians")
        })?,
        kind => {
            let problem = format!("light type \"{kind}\"");
            return Err(Fault::invalid(place(), problem, "types are directional, point and spot"));
        }
    };
    if let Some(range) = light.range.filter(|_| kind != SceneLightKind::Directional) {
        notes.push(format!("light \"{name}\" has a range of {range}, which is no part of the model: it shines at any distance"));
    }
    Ok(Some(SceneLight { name, world_from_light, strength, kind }))
}

fn listed<'a, T>(
    document: &Document,
    node_idx: usize,
    what: &str,
    list: &'a [T],
    idx: usize,
) -> Checked<&'a T> {
    list.get(idx).ok_or_else(|| {
        let problem = format!("{what} {idx}, but the asset has {}", list.len());
        Fault::invalid(node_place(&document.root, node_idx), problem, "the file is damaged: export it again")
    })
}

fn lens(camera: &Camera, camera_idx: usize) -> Checked<SceneLens> {
    let fault =
        |problem: String, cure: &str| Err(Fault::invalid(format!("cameras[{camera_idx}]"), problem, cure));
    match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(perspective), _) => {
            let vertical_fov = perspective.yfov;
            if vertical_fov > 0.0 && vertical_fov < PI {
                Ok(SceneLens::Perspective { vertical_fov })
            } else {
                fault(format!("yfov is {vertical_fov}"), "give an angle between 0 and π, in radians")
            }
        }
        ("orthographic", _, Some(orthographic)) => {
            // A negative ymag is discouraged, not forbidden, and flips the image: refused with zero and NaN.
            let height = 2.0 * orthographic.ymag;
            if height > 0.0 && height.is_finite() {
                Ok(SceneLens::Orthographic { height })
            } else {
                fault(format!("ymag is {}", orthographic.ymag), "give a positive number")
            }
        }
        (kind, ..) => fault(
            format!("type \"{kind}\" without a lens of that name"),
            "a camera is perspective or orthographic, with the properties of its type",
        ),
    }
}

fn cone(light: &Light) -> Option<SceneLightKind> {
    let (inner, outer) = (light.spot.inner_cone_angle, light.spot.outer_cone_angle);
    let is_ordered = inner >= 0.0 && inner <= outer + ANGLE_ROUNDING && outer <= FRAC_PI_2 + ANGLE_ROUNDING;
    let outer = outer.min(FRAC_PI_2);
    // A cone without an opening lights nothing.
    (is_ordered && outer > 0.0).then_some(SceneLightKind::Spot { inner: inner.min(outer), outer })
}
