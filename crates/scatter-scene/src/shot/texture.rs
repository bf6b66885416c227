//! A light's colour texture that owns its texels, and its placement in the world.

use std::path::Path;

use scatter_core::{Light, LightTexture, MapProjection, ModelError};

use super::document::Document;
use super::fault::{model_fault, sane};
use super::path_beside;
use super::text::TextureText;
use crate::error::{Checked, Fault};
use crate::image_file::read_linear_rgb;
use crate::radiance_image::checked_image_size;

/// Coloured glass: linear RGB factors with the projection that places them.
#[derive(Debug, Clone)]
pub struct OwnedTexture {
    projection: MapProjection,
    texels: Vec<[f32; 3]>,
}

impl OwnedTexture {
    /// Checks every texel once: factors are finite and ≥ 0, `[row][column]`, row 0 on top.
    pub fn new(projection: MapProjection, texels: Vec<[f32; 3]>) -> Result<Self, ModelError> {
        LightTexture::new(projection, &texels)?;
        Ok(Self { projection, texels })
    }

    /// The texture as a frame borrows it.
    pub fn as_light_texture(&self) -> LightTexture<'_> {
        match LightTexture::new(self.projection, &self.texels) {
            Ok(texture) => texture,
            Err(error) => unreachable!("`new` has checked these texels: {error}"),
        }
    }
}

/// Reads and places the texture of `light`, which stands at `key`.
pub(super) fn owned_texture(
    document: &Document<'_>,
    key: &str,
    text: &TextureText,
    light: &Light,
    folder: &Path,
) -> Checked<OwnedTexture> {
    let (size, texels) = texels(document, key, text, folder)?;
    let fault = |problem: &str, cure: &str| Fault::invalid(document.place(key), problem, cure);
    sane(document, &format!("{key}.up"), &text.up)?;
    let projection = match light {
        Light::Directional(sun) => {
            let (Some(center), Some(half_extents)) = (text.center, text.half_extents) else {
                return Err(fault("a directional light's texture needs center and half_extents", "add them"));
            };
            sane(document, &format!("{key}.center"), &center)?;
            sane(document, &format!("{key}.half_extents"), &half_extents)?;
            MapProjection::orthographic(center, sun.direction().to_array(), text.up, half_extents, size)
        }
        Light::Spot(spot) => {
            if size[0] != size[1] {
                return Err(fault("a spot's texture covers a square cone", "give as many rows as columns"));
            }
            if text.center.is_some() || text.half_extents.is_some() {
                let problem = "a spot's texture is placed by its cone, not by center and half_extents";
                return Err(fault(problem, "remove the two keys"));
            }
            // tan 90° is no field of view; the core's own limit for one perspective map is 80°.
            if spot.outer() > 80f64.to_radians() {
                return Err(fault(
                    "a texture needs a cone of at most 80 degrees",
                    "narrow outer_cone_degrees",
                ));
            }
            let (position, direction) = (spot.lamp().position().to_array(), spot.direction().to_array());
            MapProjection::perspective(position, direction, text.up, spot.outer().tan(), size[0])
        }
        Light::Point(_) => {
            return Err(fault("a point light takes no texture", "use a spot or a directional light"));
        }
    };
    let projection = projection.map_err(|error| model_fault(document, key, &error))?;
    OwnedTexture::new(projection, texels).map_err(|error| model_fault(document, key, &error))
}

fn texels(
    document: &Document<'_>,
    key: &str,
    text: &TextureText,
    folder: &Path,
) -> Checked<([u32; 2], Vec<[f32; 3]>)> {
    match (&text.image, &text.rows) {
        (Some(image), None) => {
            let place = || document.place(&format!("{key}.image"));
            let image = read_linear_rgb(&path_beside(folder, image))
                .map_err(|error| Fault::invalid(place(), error.to_string(), "or name another EXR or PNG"))?;
            Ok((image.size, image.pixels))
        }
        (None, Some(rows)) => {
            let place = || document.place(&format!("{key}.rows"));
            let width = rows.first().map_or(0, Vec::len);
            if rows.iter().any(|row| row.len() != width) {
                return Err(Fault::invalid(
                    place(),
                    "the rows differ in length",
                    "give every row as many triples",
                ));
            }
            let size = checked_image_size(&place(), [width as u64, rows.len() as u64])?;
            Ok((size, rows.concat()))
        }
        _ => Err(Fault::invalid(document.place(key), "it needs either image or rows", "give one of the two")),
    }
}
