//! Materials: which part of their triangles is there.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.9.4 (alpha coverage) and 3.8.4 (samplers);
//! KHR_texture_transform; the archived KHR_materials_pbrSpecularGlossiness, whose alpha replaces the base colour's.
//! `MASK` is done: a texel of the base level is there where its alpha times the factor's reaches the cutoff.
//! Departures, each with a note that names the material: `BLEND`, KHR_materials_transmission and
//! KHR_materials_diffuse_transmission count as opaque; so does a mask whose texture cannot be read; the alpha of COLOR_0
//! is not read; a sampler's filter is not used.

use std::collections::HashMap;
use std::path::Path;

use glam::{DAffine2, DMat2, DVec2};
use gltf::json::material::AlphaMode;
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked as Known;

use super::container::Buffers;
use super::document::Document;
use super::exact::TextureTransform;
use super::uri::read_uri;
use crate::cutout::{AlphaMask, Wrap};
use crate::error::{Checked, Fault, one_line};
use crate::texels::{Texels, decode_texels};

/// Longest image file that is read, in bytes.
const MAX_IMAGE_BYTES: u64 = 1 << 30;

/// Which part of a primitive is there.
#[derive(Clone, Copy)]
pub(super) enum Coverage {
    /// All of it.
    Whole,
    /// Nothing of it.
    Nothing,
    /// What a mask says.
    Masked(Masking),
}

/// A mask, and where its coordinates come from.
#[derive(Clone, Copy)]
pub(super) struct Masking {
    /// Index among the scene's masks.
    pub mask: u32,
    /// The n of TEXCOORD_n.
    pub tex_coord: u32,
    /// From the attribute's coordinates to the texture's.
    pub texture_from_attribute: DAffine2,
}

/// The materials of an asset as they are first used.
pub(super) struct Materials<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    folder: &'a Path,
    known: HashMap<usize, Coverage>,
    /// The masks so far.
    pub masks: Vec<AlphaMask>,
    /// What a material cannot do, once each.
    pub notes: Vec<String>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(document: &'a Document, buffers: &'a Buffers<'a>, folder: &'a Path) -> Self {
        Self { document, buffers, folder, known: HashMap::new(), masks: Vec::new(), notes: Vec::new() }
    }

    /// The coverage of a primitive with that material; an error if there is no such material.
    pub(super) fn coverage(&mut self, material_idx: usize, place: &dyn Fn() -> String) -> Checked<Coverage> {
        let count = self.document.root.materials.len();
        if material_idx >= count {
            let problem = format!("material {material_idx}, but the asset has {count}");
            return Err(Fault::invalid(place(), problem, "the file is damaged: export it again"));
        }
        if let Some(&coverage) = self.known.get(&material_idx) {
            return Ok(coverage);
        }
        let coverage = self.read(material_idx);
        self.known.insert(material_idx, coverage);
        Ok(coverage)
    }

    /// Whether a material that exists is a cut-out.
    pub(super) fn is_mask(&self, material_idx: usize) -> bool {
        self.document.root.materials[material_idx].alpha_mode == Known::Valid(AlphaMode::Mask)
    }

    /// `material "leaf"`.
    pub(super) fn name(&self, material_idx: usize) -> String {
        match self.document.root.materials.get(material_idx).and_then(|material| material.name.as_deref()) {
            Some(name) => format!("material \"{}\"", one_line(name)),
            None => format!("materials[{material_idx}]"),
        }
    }

    /// Says something about a material, once.
    pub(super) fn note(&mut self, material_idx: usize, what: &str) {
        let note = format!("{} {what}", self.name(material_idx));
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    fn read(&mut self, material_idx: usize) -> Coverage {
        let material = &self.document.root.materials[material_idx];
        let numbers = &self.document.exact.materials[material_idx];
        for (factor, extension) in [
            (numbers.extensions.transmission.transmission_factor, "KHR_materials_transmission"),
            (
                numbers.extensions.diffuse_transmission.diffuse_transmission_factor,
                "KHR_materials_diffuse_transmission",
            ),
        ] {
            if factor != 0.0 {
                self.note(material_idx, &format!("lets light through ({extension}), but counts as opaque"));
            }
        }
        match material.alpha_mode {
            Known::Valid(AlphaMode::Opaque) => Coverage::Whole,
            Known::Valid(AlphaMode::Blend) => {
                self.note(material_idx, "is blended (alphaMode BLEND), but counts as opaque");
                Coverage::Whole
            }
            Known::Valid(AlphaMode::Mask) => self.mask(material_idx),
            Known::Invalid => {
                self.note(material_idx, "has an unknown alphaMode and counts as opaque");
                Coverage::Whole
            }
        }
    }

    fn mask(&mut self, material_idx: usize) -> Coverage {
        let material = &self.document.root.materials[material_idx];
        let numbers = &self.document.exact.materials[material_idx];
        let cutoff = numbers.alpha_cutoff;
        let (factor, texture) = match &numbers.extensions.specular_glossiness {
            Some(glossy) => {
                let texture = glossy.diffuse_texture.as_ref();
                (glossy.diffuse_factor[3], texture.map(|t| (t.index, t.tex_coord, t.extensions.transform)))
            }
            None => {
                let texture = material.pbr_metallic_roughness.base_color_texture.as_ref();
                let pbr = &numbers.pbr_metallic_roughness;
                let transform = pbr.base_color_texture.extensions.transform;
                (pbr.base_color_factor[3], texture.map(|t| (t.index.value(), t.tex_coord, transform)))
            }
        };
        let uniform = |alpha: f64| if alpha * factor >= cutoff { Coverage::Whole } else { Coverage::Nothing };
        let Some((texture_idx, tex_coord, transform)) = texture else { return uniform(1.0) };
        let (texels, wrap) = match self.texels(texture_idx) {
            Ok(read) => read,
            Err(fault) => {
                self.note(material_idx, &format!("is a cut-out, but counts as opaque: {fault}"));
                return Coverage::Whole;
            }
        };
        let is_there = |column: u32, row: u32| texels.alpha(column, row) * factor >= cutoff;
        match texels.uniform(is_there) {
            Some(true) => Coverage::Whole,
            Some(false) => Coverage::Nothing,
            None => {
                let mask = self.masks.len() as u32;
                self.masks.push(AlphaMask::new(texels.size, wrap, is_there));
                let tex_coord = transform.and_then(|t| t.tex_coord).unwrap_or(tex_coord);
                let texture_from_attribute = transform.map_or(DAffine2::IDENTITY, affine);
                Coverage::Masked(Masking { mask, tex_coord, texture_from_attribute })
            }
        }
    }

    /// The texels of a texture with what lies beyond its ends.
    fn texels(&self, texture_idx: usize) -> Checked<(Texels, [Wrap; 2])> {
        let root = &self.document.root;
        let fault = |place: String, problem: String| {
            Fault::invalid(place, problem, "export the texture as PNG or JPEG, inside the file or beside it")
        };
        let place = format!("textures[{texture_idx}]");
        let texture = root
            .textures
            .get(texture_idx)
            .ok_or_else(|| fault(place.clone(), format!("the asset has {} textures", root.textures.len())))?;
        let sampler = texture.sampler.and_then(|sampler| root.samplers.get(sampler.value()));
        let wrap =
            sampler.map_or([Wrap::Repeat; 2], |sampler| [wrap(&sampler.wrap_s), wrap(&sampler.wrap_t)]);
        // `gltf` has u32::MAX where a texture names no source.
        let image_idx = texture.source.value();
        let Some(image) = root.images.get(image_idx) else {
            let names: Vec<&str> =
                texture.extensions.iter().flat_map(|e| e.others.keys()).map(String::as_str).collect();
            let problem = if names.is_empty() {
                "it names no image of the asset".to_owned()
            } else {
                format!("its image is only there as {}", names.join(", "))
            };
            return Err(fault(place, problem));
        };
        let place = format!("images[{image_idx}]");
        let owned;
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                owned =
                    read_uri(self.folder, uri, MAX_IMAGE_BYTES).map_err(|f| f.at(format!("{place}.uri")))?;
                owned.as_slice()
            }
            (None, Some(view)) => self.buffers.view(root, view.value()).map_err(|f| f.at(place.as_str()))?,
            (None, None) => return Err(fault(place, "it has neither a uri nor a bufferView".to_owned())),
        };
        let texels = decode_texels(bytes).map_err(|f| f.at(place))?;
        Ok((texels, wrap))
    }
}

/// Scaled, then turned, then moved. A positive angle turns counter-clockwise as seen on the screen, where v goes down.
fn affine(transform: TextureTransform) -> DAffine2 {
    let (sin, cos) = transform.rotation.sin_cos();
    let turned = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let scaled = turned * DMat2::from_diagonal(DVec2::from_array(transform.scale));
    DAffine2::from_mat2_translation(scaled, DVec2::from_array(transform.offset))
}

fn wrap(mode: &Known<WrappingMode>) -> Wrap {
    match mode {
        Known::Valid(WrappingMode::ClampToEdge) => Wrap::ClampToEdge,
        Known::Valid(WrappingMode::MirroredRepeat) => Wrap::MirroredRepeat,
        Known::Valid(WrappingMode::Repeat) | Known::Invalid => Wrap::Repeat,
    }
}
