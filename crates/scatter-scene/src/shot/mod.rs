//! Shots: a mesh, a camera, lights and a medium, from a TOML file or from a glTF file alone.
//!
//! The format stands in the README of this crate's workspace. Beyond the keys that every shot has:
//! `camera = "gltf:NAME"` and `light = "gltf:NAME"` take the named node of the mesh's file, with top-level
//! `resolution` and `max_distance`; `orthographic_height` replaces `vertical_fov_degrees`; `[[lights]]` are further
//! lights; `[[medium.components]]` replace `scattering`, `phase` and `g`. `light.radius` defaults to 0,
//! `medium.absorption` to 0, `phase` to isotropic. Paths may be written with either slash.
//!
//! `[light.texture]` is coloured glass: `image` (an EXR, or a PNG read as sRGB) or `rows` of linear RGB triples, row
//! 0 towards `up`. A directional light's texture fills the rectangle around `center` with `half_extents` (to the
//! right and upwards, world units) across the light's direction, a spot's the square of twice the outer angle.
//!
//! `[particles]` (`radius`, `density`) and `[strands]` (`radius`, `opacity`) give points and lines of the mesh what they lack; a
//! point or a line that has a value keeps it, and one that still lacks one is left out.
//!
//! A key that another kind of light or phase reads is ignored and noted, so that a file may list all of them; a key
//! that nobody reads is an error.

mod document;
mod fault;
mod pick;
mod resolve;
#[cfg(test)]
mod tests;
mod text;
mod texture;

use std::path::{Path, PathBuf};

use scatter_core::{Camera, Light, Medium};

use self::document::Document;
use self::text::ShotText;
pub use self::texture::OwnedTexture;
use crate::error::{Checked, Fault, SceneError};
use crate::load::{load_scene, load_scene_with};
use crate::regular_file::read_file;
use crate::scene::Scene;
use crate::text::utf8_bytes;

/// Image size of a shot that does not say it.
const DEFAULT_RESOLUTION: [u32; 2] = [640, 480];

/// Everything that one picture needs.
#[derive(Debug, Clone)]
pub struct Shot {
    /// The file's name without its extension; of a `shot.toml` its folder's name.
    pub name: String,
    /// The camera with its image size.
    pub camera: Camera,
    /// At least one light; their images add up.
    pub lights: Vec<ShotLight>,
    /// The air.
    pub medium: Medium,
    /// Where rays that hit nothing end, along the ray \[world units\], > 0, finite.
    pub max_distance: f64,
    /// The occluders.
    pub scene: Scene,
    /// What the shot file says in vain and what the mesh's loader left out: one sentence each, for people.
    pub notes: Vec<String>,
}

/// A light with the glass before it.
#[derive(Debug, Clone)]
pub struct ShotLight {
    /// The light.
    pub light: Light,
    /// Its colour texture.
    pub texture: Option<OwnedTexture>,
}

/// Loads a shot file (`.toml`), or a mesh as a shot of its own.
///
/// A `.glb`, `.gltf` or `.obj` file alone is seen by its first camera in its first light, at 640 × 480 pixels, in a
/// grey isotropic medium with an optical depth of 0.5 over the scene's diagonal, where rays end too.
pub fn load_shot(path: &Path) -> Result<Shot, SceneError> {
    let is_toml = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    let mut shot = if is_toml {
        load_shot_file(path)?
    } else {
        let scene = load_scene(path)?;
        resolve::bare_shot(scene).map_err(|fault| fault.in_file(path))?
    };
    shot.name = shot_name(path);
    Ok(shot)
}

fn load_shot_file(path: &Path) -> Result<Shot, SceneError> {
    let bytes = read_file(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    parse_shot(&bytes, folder).map_err(|fault| fault.in_file(path))
}

/// Parses a shot's text; `mesh` and textures are looked for in `folder`.
fn parse_shot(bytes: &[u8], folder: &Path) -> Checked<Shot> {
    let bytes = utf8_bytes(bytes, "as UTF-8")?;
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        Fault::invalid(format!("line {line}"), "the text is no UTF-8", "save it as UTF-8")
    })?;
    let (document, text) = Document::parse::<ShotText>(text)?;
    // What needs no mesh is checked first: a typing error should not cost a long load.
    let partial = resolve::without_mesh(&document, &text, folder)?;
    let mesh_path = path_beside(folder, &text.mesh);
    let scene = load_scene_with(&mesh_path, &partial.occluders).map_err(|error| match error {
        SceneError::Io { file, source, .. } => {
            let problem = format!("cannot read {}: {source}", file.display());
            Fault::invalid(document.place("mesh"), problem, "give a path relative to the shot file")
        }
        // The fault lies in the other file: its name comes along as the place.
        other => Fault::invalid(document.place("mesh"), other.to_string(), "or name another mesh"),
    })?;
    resolve::with_mesh(&document, &text, partial, scene)
}

/// A path of a shot file: either slash parts folders. On Windows both do; elsewhere a name that holds a backslash is
/// found if it is there.
pub(super) fn path_beside(folder: &Path, name: &str) -> PathBuf {
    let plain = folder.join(name);
    if name.contains('\\') && !plain.exists() { folder.join(name.replace('\\', "/")) } else { plain }
}

fn shot_name(path: &Path) -> String {
    let name =
        |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name(path.file_stem());
    let folder = name(path.parent().and_then(Path::file_name));
    if stem == "shot" && !folder.is_empty() { folder } else { stem }
}
