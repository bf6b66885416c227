//! Cameras and lights of a glTF file as those of the model.

use glam::{DMat4, DVec3};
use scatter_core::{Camera, Light, ModelError};

use super::fault::fault_at;
use crate::error::{Checked, Fault};
use crate::scene::{Scene, SceneCamera, SceneLens, SceneLight, SceneLightKind};

/// The camera of that name, or the first one.
pub(super) fn picked_camera(
    scene: &Scene,
    name: Option<&str>,
    place: &str,
    size: [u32; 2],
) -> Checked<Camera> {
    let names = || scene.cameras.iter().map(|camera| camera.name.as_str());
    let found = match name {
        Some(name) => scene.cameras.iter().find(|camera| camera.name == name),
        None => scene.cameras.first(),
    };
    let camera = found.ok_or_else(|| missing("camera", name, names(), place))?;
    camera_of(camera, size).map_err(|error| fault_at(place.to_owned(), &error))
}

/// The light of that name, or the first one.
pub(super) fn picked_light(scene: &Scene, name: Option<&str>, place: &str) -> Checked<Light> {
    let names = || scene.lights.iter().map(|light| light.name.as_str());
    let found = match name {
        Some(name) => scene.lights.iter().find(|light| light.name == name),
        None => scene.lights.first(),
    };
    let light = found.ok_or_else(|| missing("light", name, names(), place))?;
    light_of(light).map_err(|error| fault_at(place.to_owned(), &error))
}

fn missing<'a>(what: &str, name: Option<&str>, names: impl Iterator<Item = &'a str>, place: &str) -> Fault {
    let names: Vec<&str> = names.collect();
    match (name, names.is_empty()) {
        (Some(name), false) => {
            let cure = format!("name one of: {}", names.join(", "));
            Fault::invalid(place, format!("the mesh's file has no {what} \"{name}\""), cure)
        }
        (_, true) | (None, _) => {
            let cure = format!("give a [{what}] in a shot file (.toml)");
            Fault::invalid(place, format!("the mesh's file has no {what}"), cure)
        }
    }
}

fn camera_of(camera: &SceneCamera, size: [u32; 2]) -> Result<Camera, ModelError> {
    let world = camera.world_from_camera;
    let eye = world.w_axis.truncate();
    let up = world.y_axis.truncate().to_array();
    let target = (eye + forward(&world)).to_array();
    match camera.lens {
        SceneLens::Perspective { vertical_fov } => {
            Camera::perspective(eye.to_array(), target, up, vertical_fov.to_degrees(), size)
        }
        SceneLens::Orthographic { height } => Camera::orthographic(eye.to_array(), target, up, height, size),
    }
}

fn light_of(light: &SceneLight) -> Result<Light, ModelError> {
    let world = light.world_from_light;
    let position = world.w_axis.truncate().to_array();
    let direction = forward(&world).to_array();
    match light.kind {
        SceneLightKind::Directional => Light::directional(direction, light.strength),
        SceneLightKind::Point => Light::point(position, light.strength, 0.0),
        SceneLightKind::Spot { inner, outer } => {
            // Half a turn's rounding must not push a right angle beyond 90.
            let outer = outer.to_degrees().min(90.0);
            Light::spot(position, direction, light.strength, inner.to_degrees().min(outer), outer, 0.0)
        }
    }
}

/// Cameras and lights look along −z of their node. Zero for a node that is scaled to nothing, which the model refuses.
fn forward(world: &DMat4) -> DVec3 {
    (-world.z_axis.truncate()).normalize_or_zero()
}
