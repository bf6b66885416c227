//! The numbers of nodes, meshes, materials, cameras and lights as f64.
//!
//! Departure from the crate `gltf`: its JSON layer holds them as f32, and world vertices must be right to f64.

use serde::Deserialize;

/// The tables of an asset, as far as their numbers matter. As long as those of [`gltf::json::Root`].
#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Exact {
    pub nodes: Vec<NodeNumbers>,
    pub meshes: Vec<MeshNumbers>,
    pub materials: Vec<MaterialNumbers>,
    pub cameras: Vec<Camera>,
    pub extensions: RootExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct NodeNumbers {
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub weights: Option<Vec<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct MeshNumbers {
    pub weights: Vec<f64>,
    pub primitives: Vec<PrimitiveNumbers>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct PrimitiveNumbers {
    pub attributes: OccluderAttributes,
}

/// Accessors of what points and lines bring along: names of our own, which `gltf` does not keep.
#[derive(Deserialize, Default, Clone, Copy)]
pub(super) struct OccluderAttributes {
    #[serde(rename = "_RADIUS")]
    pub radius: Option<usize>,
    #[serde(rename = "_DENSITY")]
    pub density: Option<usize>,
    #[serde(rename = "_OPACITY")]
    pub opacity: Option<usize>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MaterialNumbers {
    pub alpha_cutoff: f64,
    pub pbr_metallic_roughness: MetallicRoughness,
    pub extensions: MaterialExtensions,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct MetallicRoughness {
    pub base_color_factor: [f64; 4],
    pub base_color_texture: TextureInfo,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureInfo {
    pub extensions: TextureInfoExtensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

/// KHR_texture_transform.
#[derive(Deserialize, Clone, Copy)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct TextureTransform {
    pub offset: [f64; 2],
    /// Radians, counter-clockwise.
    pub rotation: f64,
    pub scale: [f64; 2],
    pub tex_coord: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Transmission,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    pub diffuse_transmission: DiffuseTransmission,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub specular_glossiness: Option<SpecularGlossiness>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Transmission {
    pub transmission_factor: f64,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct DiffuseTransmission {
    pub diffuse_transmission_factor: f64,
}

/// The archived KHR_materials_pbrSpecularGlossiness: its alpha replaces that of the base colour.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct SpecularGlossiness {
    pub diffuse_factor: [f64; 4],
    pub diffuse_texture: Option<DiffuseTexture>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct DiffuseTexture {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: u32,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

#[derive(Deserialize)]
pub(super) struct Camera {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
pub(super) struct Perspective {
    pub yfov: f64,
}

#[derive(Deserialize)]
pub(super) struct Orthographic {
    pub ymag: f64,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub lights: Lights,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Lights {
    pub lights: Vec<Light>,
}

/// KHR_lights_punctual.
#[derive(Deserialize)]
pub(super) struct Light {
    pub name: Option<String>,
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "white")]
    pub color: [f64; 3],
    #[serde(default = "one")]
    pub intensity: f64,
    pub range: Option<f64>,
    #[serde(default)]
    pub spot: Spot,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Spot {
    pub inner_cone_angle: f64,
    pub outer_cone_angle: f64,
}

impl Default for Spot {
    fn default() -> Self {
        Self { inner_cone_angle: 0.0, outer_cone_angle: std::f64::consts::FRAC_PI_4 }
    }
}

impl Default for MaterialNumbers {
    fn default() -> Self {
        Self {
            alpha_cutoff: 0.5,
            pbr_metallic_roughness: MetallicRoughness::default(),
            extensions: MaterialExtensions::default(),
        }
    }
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self { base_color_factor: [1.0; 4], base_color_texture: TextureInfo::default() }
    }
}

impl Default for SpecularGlossiness {
    fn default() -> Self {
        Self { diffuse_factor: [1.0; 4], diffuse_texture: None }
    }
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2], tex_coord: None }
    }
}

fn white() -> [f64; 3] {
    [1.0; 3]
}

fn one() -> f64 {
    1.0
}
