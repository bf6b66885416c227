//! From the keys of a shot file to the model's types; every fault names line, key and cure.

use std::path::Path;

use glam::DVec3;
use scatter_core::{Camera, HeightFalloff, Light, Medium, Phase, Scattering};

use super::document::Document;
use super::fault::{fault_at, model_fault, sane};
use super::pick::{picked_camera, picked_light};
use super::text::{CameraText, LightKindText, LightText, MediumText, Named, PhaseText, ShotText};
use super::texture::owned_texture;
use super::{DEFAULT_RESOLUTION, Shot, ShotLight};
use crate::error::{Checked, Fault};
use crate::radiance_image::checked_image_size;
use crate::scene::Scene;
use crate::translucent::{
    OccluderValues, ParticleValues, StrandValues, checked_density, checked_opacity, checked_radius,
};

/// Optical depth over the scene's diagonal of the medium that a mesh alone is shown in.
const BARE_OPTICAL_DEPTH: f64 = 0.5;

/// What a shot file says by itself; `None` where it names something of the mesh's file.
pub(super) struct Partial {
    camera: Option<(Camera, f64)>,
    light: Option<ShotLight>,
    further: Vec<ShotLight>,
    medium: Medium,
    /// For points and lines of the mesh that have none of their own.
    pub occluders: OccluderValues,
    notes: Vec<String>,
}

/// Checks all that needs no mesh.
pub(super) fn without_mesh(document: &Document<'_>, text: &ShotText, folder: &Path) -> Checked<Partial> {
    let mut notes = Vec::new();
    let camera = match &text.camera {
        Named::Inline(camera) => {
            for (key, is_given) in
                [("resolution", text.resolution.is_some()), ("max_distance", text.max_distance.is_some())]
            {
                if is_given {
                    let problem = "outside of [camera] it belongs to a camera of the glTF file";
                    return Err(Fault::invalid(document.place(key), problem, "move it into [camera]"));
                }
            }
            Some((
                camera_of(document, camera)?,
                checked_distance(document, "camera.max_distance", camera.max_distance)?,
            ))
        }
        Named::Gltf(_) => {
            if let Some(size) = text.resolution {
                checked_image_size(&document.place("resolution"), size.map(u64::from))?;
            }
            if let Some(distance) = text.max_distance {
                checked_distance(document, "max_distance", distance)?;
            }
            None
        }
    };
    let mut light_at = |key: &str, light: &LightText| light_of(document, key, light, folder, &mut notes);
    let light = match &text.light {
        Named::Inline(light) => Some(light_at("light", light)?),
        Named::Gltf(_) => None,
    };
    let further = text.lights.iter().enumerate().map(|(i, light)| light_at(&format!("lights[{i}]"), light));
    let further = further.collect::<Checked<Vec<_>>>()?;
    let medium = medium_of(document, &text.medium, &mut notes)?;
    let occluders = occluder_values(document, text)?;
    Ok(Partial { camera, light, further, medium, occluders, notes })
}

/// Completes the shot with its mesh.
pub(super) fn with_mesh(
    document: &Document<'_>,
    text: &ShotText,
    partial: Partial,
    scene: Scene,
) -> Checked<Shot> {
    let (camera, max_distance) = match (partial.camera, &text.camera) {
        (Some(camera), _) => camera,
        (None, Named::Gltf(name)) => {
            let size = text.resolution.unwrap_or(DEFAULT_RESOLUTION);
            let camera = picked_camera(&scene, Some(name), &document.place("camera"), size)?;
            let max_distance = match text.max_distance {
                Some(distance) => distance,
                None => diagonal(&scene, &document.place("camera"))?,
            };
            (camera, max_distance)
        }
        (None, Named::Inline(_)) => unreachable!("an inline camera was resolved before"),
    };
    let light = match (partial.light, &text.light) {
        (Some(light), _) => light,
        (None, Named::Gltf(name)) => {
            ShotLight { light: picked_light(&scene, Some(name), &document.place("light"))?, texture: None }
        }
        (None, Named::Inline(_)) => unreachable!("an inline light was resolved before"),
    };
    let mut lights = vec![light];
    lights.extend(partial.further);
    for (i, light) in lights.iter().enumerate() {
        let key = if i == 0 { "light".to_owned() } else { format!("lights[{}]", i - 1) };
        check_apart(&camera, &light.light, &document.place(&key))?;
    }
    let mut notes = partial.notes;
    for (table, is_given, found) in [
        ("particles", text.particles.is_some(), !scene.particles.is_empty()),
        ("strands", text.strands.is_some(), !scene.strands.is_empty()),
    ] {
        if is_given && !found {
            notes.push(format!("{} has nothing to act on: the mesh has none", document.place(table)));
        }
    }
    notes.extend(scene.notes.iter().cloned());
    Ok(Shot { name: String::new(), camera, lights, medium: partial.medium, max_distance, scene, notes })
}

/// A mesh as a shot of its own.
pub(super) fn bare_shot(scene: Scene) -> Checked<Shot> {
    let camera = picked_camera(&scene, None, "", DEFAULT_RESOLUTION)?;
    let light = picked_light(&scene, None, "")?;
    check_apart(&camera, &light, "")?;
    let max_distance = diagonal(&scene, "")?;
    let medium = Medium::homogeneous([BARE_OPTICAL_DEPTH / max_distance; 3], [0.0; 3], Phase::Isotropic)
        .map_err(|error| fault_at(String::new(), &error))?;
    let notes = scene.notes.clone();
    let lights = vec![ShotLight { light, texture: None }];
    Ok(Shot { name: String::new(), camera, lights, medium, max_distance, scene, notes })
}

fn occluder_values(document: &Document<'_>, text: &ShotText) -> Checked<OccluderValues> {
    let radius = |key: &str, value: Option<f64>| {
        let place = || document.place(key);
        value.map(|value| checked_radius(value, || "the value".to_owned(), place)).transpose()
    };
    let density = |value: Option<f64>| {
        let place = || document.place("particles.density");
        value.map(|value| checked_density(value, || "the value".to_owned(), place)).transpose()
    };
    let opacity = |value: Option<f64>| {
        let place = || document.place("strands.opacity");
        value.map(|value| checked_opacity(value, || "the value".to_owned(), place)).transpose()
    };
    let particles = match &text.particles {
        None => None,
        Some(particles) => Some(ParticleValues {
            radius: radius("particles.radius", particles.radius)?,
            density: density(particles.density)?,
        }),
    };
    let strands = match &text.strands {
        None => None,
        Some(strands) => Some(StrandValues {
            radius: radius("strands.radius", strands.radius)?,
            opacity: opacity(strands.opacity)?,
        }),
    };
    Ok(OccluderValues { particles, strands })
}

fn camera_of(document: &Document<'_>, text: &CameraText) -> Checked<Camera> {
    let size = checked_image_size(&document.place("camera.resolution"), text.resolution.map(u64::from))?;
    let &CameraText { eye, target, up, .. } = text;
    for (key, vector) in [("camera.eye", eye), ("camera.target", target), ("camera.up", up)] {
        sane(document, key, &vector)?;
    }
    let camera = match (text.vertical_fov_degrees, text.orthographic_height) {
        (Some(degrees), None) => Camera::perspective(eye, target, up, degrees, size),
        (None, Some(height)) => {
            sane(document, "camera.orthographic_height", &[height])?;
            Camera::orthographic(eye, target, up, height, size)
        }
        _ => {
            let problem = "it needs either vertical_fov_degrees or orthographic_height";
            return Err(Fault::invalid(document.place("camera"), problem, "give one of the two"));
        }
    };
    camera.map_err(|error| model_fault(document, "camera", &error))
}

fn light_of(
    document: &Document<'_>,
    key: &str,
    text: &LightText,
    folder: &Path,
    notes: &mut Vec<String>,
) -> Checked<ShotLight> {
    let vectors = [
        ("direction", text.direction),
        ("position", text.position),
        ("irradiance", text.irradiance),
        ("intensity", text.intensity),
    ];
    let numbers = [
        ("inner_cone_degrees", text.inner_cone_degrees),
        ("outer_cone_degrees", text.outer_cone_degrees),
        ("radius", text.radius),
    ];
    let (kind, used): (_, &[&str]) = match text.kind {
        LightKindText::Directional => ("directional", &["direction", "irradiance"]),
        LightKindText::Point => ("point", &["position", "intensity", "radius"]),
        LightKindText::Spot => (
            "spot",
            &["direction", "position", "intensity", "inner_cone_degrees", "outer_cone_degrees", "radius"],
        ),
    };
    let given = vectors.iter().filter(|v| v.1.is_some()).map(|v| v.0);
    let given: Vec<&str> = given.chain(numbers.iter().filter(|n| n.1.is_some()).map(|n| n.0)).collect();
    for name in given.into_iter().filter(|name| !used.contains(name)) {
        notes.push(format!(
            "{} is ignored: a {kind} light has none",
            document.place(&format!("{key}.{name}"))
        ));
    }
    let path = |name: &str| format!("{key}.{name}");
    let lacking = |name: &str| {
        let problem = format!("a {kind} light needs `{name}`");
        Fault::invalid(document.place(key), problem, "add it")
    };
    let vector = |name: &str| {
        let value = vectors.iter().find(|v| v.0 == name).and_then(|v| v.1).ok_or_else(|| lacking(name))?;
        sane(document, &path(name), &value)?;
        Ok(value)
    };
    let number = |name: &str| {
        let value = numbers.iter().find(|n| n.0 == name).and_then(|n| n.1).ok_or_else(|| lacking(name))?;
        sane(document, &path(name), &[value])?;
        Ok(value)
    };
    let radius = if text.radius.is_some() { number("radius")? } else { 0.0 };
    let light = match text.kind {
        LightKindText::Directional => Light::directional(vector("direction")?, vector("irradiance")?),
        LightKindText::Point => Light::point(vector("position")?, vector("intensity")?, radius),
        LightKindText::Spot => Light::spot(
            vector("position")?,
            vector("direction")?,
            vector("intensity")?,
            number("inner_cone_degrees")?,
            number("outer_cone_degrees")?,
            radius,
        ),
    };
    let light = light.map_err(|error| model_fault(document, key, &error))?;
    let texture = match &text.texture {
        Some(texture) => Some(owned_texture(document, &path("texture"), texture, &light, folder)?),
        None => None,
    };
    Ok(ShotLight { light, texture })
}

fn medium_of(document: &Document<'_>, text: &MediumText, notes: &mut Vec<String>) -> Checked<Medium> {
    let fault = |problem: String, cure: &str| Err(Fault::invalid(document.place("medium"), problem, cure));
    sane(document, "medium.absorption", &text.absorption)?;
    let mut components = Vec::new();
    if text.components.is_empty() {
        let Some(sigma_s) = text.scattering else {
            return fault("missing field `scattering`".to_owned(), "add it, or [[medium.components]]");
        };
        let phase = text.phase.unwrap_or_default();
        sane(document, "medium.scattering", &sigma_s)?;
        components.push(Scattering { sigma_s, phase: phase_of(document, "medium", phase, text.g, notes)? });
    } else if text.scattering.is_some() || text.phase.is_some() || text.g.is_some() {
        let problem = "it has components and scattering, phase or g of its own";
        return fault(problem.to_owned(), "keep one of the two");
    }
    for (i, component) in text.components.iter().enumerate() {
        let key = format!("medium.components[{i}]");
        sane(document, &format!("{key}.scattering"), &component.scattering)?;
        // Checked here too, where the component's number is known.
        Medium::homogeneous(component.scattering, [0.0; 3], Phase::Isotropic)
            .map_err(|error| model_fault(document, &key, &error))?;
        let phase = phase_of(document, &key, component.phase, component.g, notes)?;
        components.push(Scattering { sigma_s: component.scattering, phase });
    }
    let medium =
        Medium::new(components, text.absorption).map_err(|error| model_fault(document, "medium", &error))?;
    let Some(falloff) = &text.height_falloff else { return Ok(medium) };
    let key = "medium.height_falloff";
    sane(document, &format!("{key}.up"), &falloff.up)?;
    sane(document, &format!("{key}.base_height"), &[falloff.base_height])?;
    sane(document, &format!("{key}.scale_height"), &[falloff.scale_height])?;
    let falloff = HeightFalloff::new(falloff.up, falloff.base_height, falloff.scale_height)
        .map_err(|error| model_fault(document, key, &error))?;
    Ok(medium.with_height_falloff(falloff))
}

fn phase_of(
    document: &Document<'_>,
    key: &str,
    phase: PhaseText,
    g: Option<f64>,
    notes: &mut Vec<String>,
) -> Checked<Phase> {
    let key_g = format!("{key}.g");
    if let Some(g) = g {
        sane(document, &key_g, &[g])?;
    }
    match (phase, g) {
        (PhaseText::HenyeyGreenstein, Some(g)) => {
            Phase::henyey_greenstein(g).map_err(|error| fault_at(document.place(&key_g), &error))
        }
        (PhaseText::HenyeyGreenstein, None) => {
            let problem = "henyey-greenstein needs `g`";
            Err(Fault::invalid(document.place(key), problem, "add it, in [-0.9999, 0.9999]"))
        }
        (phase, g) => {
            // Files of all phases carry g = 0 by habit.
            if g.is_some_and(|g| g != 0.0) {
                notes.push(format!("{} is ignored: only henyey-greenstein reads it", document.place(&key_g)));
            }
            Ok(if phase == PhaseText::Rayleigh { Phase::Rayleigh } else { Phase::Isotropic })
        }
    }
}

fn checked_distance(document: &Document<'_>, key: &str, distance: f64) -> Checked<f64> {
    sane(document, key, &[distance])?;
    if distance > 0.0 {
        return Ok(distance);
    }
    Err(Fault::invalid(document.place(key), format!("the value {distance}"), "give a distance > 0"))
}

/// The diagonal of the box around all triangles, particles and strands.
fn diagonal(scene: &Scene, place: &str) -> Checked<f64> {
    let corners = || {
        let particles = scene.particles.iter().flat_map(|p| [p.centre - p.radius, p.centre + p.radius]);
        let strands = scene.strands.vertices().iter().map(|vertex| vertex.position);
        let triangles = scene.triangles.iter().flatten().map(|&i| scene.positions[i as usize]);
        triangles.chain(particles).chain(strands)
    };
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let diagonal = low.distance(high);
    if diagonal > 0.0 && diagonal.is_finite() {
        return Ok(diagonal);
    }
    Err(Fault::invalid(
        place,
        "the mesh is a single point, so rays have no length",
        "give max_distance in a shot file",
    ))
}

fn check_apart(camera: &Camera, light: &Light, place: &str) -> Checked<()> {
    if light.position() == Some(camera.eye()) {
        let problem = "the lamp is at the camera's eye, where its light is infinite";
        return Err(Fault::invalid(place, problem, "move one of the two"));
    }
    Ok(())
}
