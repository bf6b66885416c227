//! The JSON of an asset: parsed by the crate `gltf` without its validation, after mending what its schema refuses
//! without need.
//!
//! JavaScript readers take integers that are written as 36.0, a version that is a number, bytes that are no UTF-8 in a
//! name, zeros after the text, and `null` for what is not there; a scene without nodes and a camera without a far plane
//! are legal or harmless. `gltf` refuses all of these, so they are mended before, in
//! the JSON. What does not touch shadows (animations, extras, most of a material) is taken out, so that no fault in it
//! can cost the file. Everything that is used afterwards is checked by this crate where it is used: the validation of
//! `gltf` indexes unchecked.

use std::collections::BTreeSet;

use gltf::json::Root;
use serde_json::value::RawValue;
use serde_json::{Map, Value};

use super::exact::Exact;
use crate::error::{Checked, Fault};

/// A parsed asset; no index in it has been checked yet.
pub(super) struct Document {
    pub root: Root,
    /// The numbers that a scene is made of, as f64: `gltf` holds them as f32.
    pub exact: Exact,
    /// The names of all extensions that any object of the asset has, or the asset says that it uses.
    pub extensions: BTreeSet<String>,
    /// How many animations were left out.
    pub animation_count: usize,
    /// `meshes[0].primitives[1]` where a morph target moves texture coordinates, which `gltf` does not know.
    pub moved_tex_coords: BTreeSet<[usize; 2]>,
}

/// Largest whole number that every f64 below it can tell from its neighbours.
const LARGEST_WHOLE: f64 = 9_007_199_254_740_992.0;

impl Document {
    pub(super) fn parse(json: &[u8]) -> Checked<Self> {
        const CURE: &str = "the file is no valid glTF 2.0: export it again";
        let text = String::from_utf8_lossy(json);
        let json = text.trim_end_matches('\0');
        let mut value: Value = serde_json::from_str(json).map_err(|error| {
            let message = error.to_string();
            // serde_json ends its messages with the place, which we put first.
            let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem);
            let place = format!("JSON line {} column {}", error.line(), error.column());
            Fault::invalid(place, problem, CURE)
        })?;
        spell_version(&mut value);
        check_version(&value)?;
        let mut extensions = BTreeSet::new();
        mend(&mut value, &mut extensions);
        let exact = typed::<Exact>(&value, json, CURE)?;
        check_modes(&value)?;
        let moved_tex_coords = moved_tex_coords(&value);
        let animation_count = value["animations"].as_array().map_or(0, Vec::len);
        complete(&mut value);
        let root: Root = typed(&value, json, CURE)?;
        extensions.extend(root.extensions_used.iter().cloned());
        Ok(Self { root, exact, extensions, animation_count, moved_tex_coords })
    }
}

fn typed<T: serde::de::DeserializeOwned>(value: &Value, json: &str, cure: &str) -> Checked<T> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = error.path().to_string();
        let place = match located(json, error.path()) {
            Some((line, column)) => format!("JSON line {line} column {column}: {path}"),
            None => path,
        };
        Fault::invalid(place, error.into_inner().to_string(), cure)
    })
}

/// Line and column, from 1, at which the value at `path` begins.
fn located(text: &str, path: &serde_path_to_error::Path) -> Option<(usize, usize)> {
    use serde_path_to_error::Segment;
    let mut value: &RawValue = serde_json::from_str(text).ok()?;
    for segment in path {
        // What lies deeper may have been added by us.
        let next = match segment {
            Segment::Map { key } => {
                serde_json::from_str::<std::collections::HashMap<String, &RawValue>>(value.get())
                    .ok()
                    .and_then(|map| map.get(key).copied())
            }
            Segment::Seq { index } => serde_json::from_str::<Vec<&RawValue>>(value.get())
                .ok()
                .and_then(|list| list.get(*index).copied()),
            Segment::Enum { .. } | Segment::Unknown => None,
        };
        match next {
            Some(next) => value = next,
            None => break,
        }
    }
    let offset = (value.get().as_ptr() as usize).checked_sub(text.as_ptr() as usize)?;
    let before = text.get(..offset)?;
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    Some((1 + before.matches('\n').count(), 1 + before[line_start..].chars().count()))
}

/// A version that is written as a number, as the text that it must be.
fn spell_version(value: &mut Value) {
    for key in ["version", "minVersion"] {
        if let Some(version) = value.get_mut("asset").and_then(|asset| asset.get_mut(key))
            && let Some(number) = version.as_f64()
        {
            *version = Value::from(format!("{number:.1}"));
        }
    }
}

/// An error for files of other versions: glTF 1.0 holds its tables as dictionaries.
fn check_version(value: &Value) -> Checked<()> {
    let cure = "export it as glTF 2.0";
    let asset = &value["asset"];
    let version = asset["minVersion"].as_str().or(asset["version"].as_str());
    let is_dictionary = ["accessors", "bufferViews", "buffers", "meshes", "nodes", "scenes"]
        .iter()
        .any(|table| value[table].is_object());
    match version {
        Some(version) if version.split('.').next() != Some("2") => {
            let old = if version.starts_with("1.") { ": this is a glTF 1.0 file" } else { "" };
            Err(Fault::unsupported("asset", format!("version \"{version}\"{old}"), cure))
        }
        Some(_) if !is_dictionary => Ok(()),
        None if !is_dictionary => Ok(()),
        _ => Err(Fault::unsupported("asset", "its tables are dictionaries: this is a glTF 1.0 file", cure)),
    }
}

/// Takes out nulls and extras, writes whole numbers as integers, and collects the names of extensions.
///
/// Recursive: serde_json refuses texts that are nested deeper than 128.
fn mend(value: &mut Value, extensions: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            map.remove("extras");
            map.retain(|_, value| !value.is_null());
            if let Some(Value::Object(named)) = map.get("extensions") {
                extensions.extend(named.keys().cloned());
            }
            map.values_mut().for_each(|value| mend(value, extensions));
        }
        Value::Array(list) => list.iter_mut().for_each(|value| mend(value, extensions)),
        Value::Number(number) if number.is_f64() => {
            let whole = number.as_f64().filter(|v| v.fract() == 0.0 && v.abs() < LARGEST_WHOLE);
            // Minus zero loses its sign, which no position sees.
            if let Some(v) = whole {
                *value = Value::from(v as i64);
            }
        }
        _ => {}
    }
}

/// `gltf` tells neither the mode nor the type that it does not know, and cuts both to 32 bits.
fn check_modes(value: &Value) -> Checked<()> {
    for (mesh_idx, mesh) in list(&value["meshes"]).enumerate() {
        for (primitive_idx, primitive) in list(&mesh["primitives"]).enumerate() {
            if let Some(mode) = primitive["mode"].as_u64().filter(|&mode| mode > 6) {
                let place = format!("meshes[{mesh_idx}].primitives[{primitive_idx}]");
                let problem = format!("primitive mode {mode}");
                return Err(Fault::invalid(place, problem, "modes are 0 to 6: export the file again"));
            }
        }
    }
    Ok(())
}

fn moved_tex_coords(value: &Value) -> BTreeSet<[usize; 2]> {
    let mut moved = BTreeSet::new();
    for (mesh_idx, mesh) in list(&value["meshes"]).enumerate() {
        for (primitive_idx, primitive) in list(&mesh["primitives"]).enumerate() {
            let names = list(&primitive["targets"]).filter_map(Value::as_object).flat_map(Map::keys);
            if names.into_iter().any(|name| name.starts_with("TEXCOORD_")) {
                moved.insert([mesh_idx, primitive_idx]);
            }
        }
    }
    moved
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

/// Adds what `gltf` demands and the specification or our use does not, and takes out what nobody reads.
fn complete(value: &mut Value) {
    let Value::Object(root) = value else { return };
    // Cameras and lights are read from [`Exact`]; of the rest nothing touches a shadow.
    for table in ["animations", "cameras", "extensions"] {
        root.remove(table);
    }
    each(root, "scenes", |scene| default(scene, "nodes", Value::Array(Vec::new())));
    each(root, "skins", |skin| default(skin, "joints", Value::Array(Vec::new())));
    each(root, "meshes", |mesh| {
        default(mesh, "primitives", Value::Array(Vec::new()));
        each(mesh, "primitives", |primitive| default(primitive, "attributes", Value::Object(Map::new())));
    });
    each(root, "accessors", |accessor| {
        for key in ["min", "max", "extensions"] {
            accessor.remove(key);
        }
        known_type(accessor);
        if let Some(normalized) = accessor.get_mut("normalized")
            && let Some(number) = normalized.as_f64()
        {
            *normalized = Value::from(number != 0.0);
        }
        if let Some(Value::Object(sparse)) = accessor.get_mut("sparse")
            && let Some(Value::Object(indices)) = sparse.get_mut("indices")
        {
            known_type(indices);
        }
    });
    each(root, "bufferViews", |view| {
        view.remove("target");
        // Tightly packed, in the words of OpenGL.
        if view.get("byteStride").and_then(Value::as_u64) == Some(0) {
            view.remove("byteStride");
        }
    });
    each(root, "samplers", |sampler| sampler.retain(|key, _| key.starts_with("wrap")));
    each(root, "materials", |material| {
        const READ: [&str; 4] = ["name", "alphaMode", "pbrMetallicRoughness", "extensions"];
        material.retain(|key, _| READ.contains(&key.as_str()));
        if let Some(Value::Object(pbr)) = material.get_mut("pbrMetallicRoughness") {
            pbr.retain(|key, _| key == "baseColorTexture");
        }
    });
}

fn each(parent: &mut Map<String, Value>, table: &str, mut change: impl FnMut(&mut Map<String, Value>)) {
    if let Some(Value::Array(list)) = parent.get_mut(table) {
        list.iter_mut().filter_map(Value::as_object_mut).for_each(&mut change);
    }
}

fn default(object: &mut Map<String, Value>, key: &str, value: Value) {
    object.entry(key).or_insert(value);
}

/// A component type that would be taken for another one, cut to 32 bits, becomes one that nobody knows.
fn known_type(object: &mut Map<String, Value>) {
    if let Some(code) = object.get_mut("componentType")
        && code.as_u64().is_some_and(|code| code > u64::from(u32::MAX))
    {
        *code = Value::from(0);
    }
}
