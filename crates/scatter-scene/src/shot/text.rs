//! The keys of a shot file, as they stand there: types are checked here, meaning in [`super::resolve`].

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShotText {
    pub mesh: String,
    pub camera: Named<CameraText>,
    pub light: Named<LightText>,
    #[serde(default)]
    pub lights: Vec<LightText>,
    pub medium: MediumText,
    pub resolution: Option<[u32; 2]>,
    pub max_distance: Option<f64>,
    pub particles: Option<ParticlesText>,
    pub strands: Option<StrandsText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParticlesText {
    pub radius: Option<f64>,
    pub density: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StrandsText {
    pub radius: Option<f64>,
    pub opacity: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraText {
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    pub vertical_fov_degrees: Option<f64>,
    pub orthographic_height: Option<f64>,
    pub resolution: [u32; 2],
    pub max_distance: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightText {
    pub kind: LightKindText,
    pub direction: Option<[f64; 3]>,
    pub position: Option<[f64; 3]>,
    pub irradiance: Option<[f64; 3]>,
    pub intensity: Option<[f64; 3]>,
    pub inner_cone_degrees: Option<f64>,
    pub outer_cone_degrees: Option<f64>,
    pub radius: Option<f64>,
    pub texture: Option<TextureText>,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(super) enum LightKindText {
    Directional,
    Point,
    Spot,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TextureText {
    pub image: Option<String>,
    pub rows: Option<Vec<Vec<[f32; 3]>>>,
    pub up: [f64; 3],
    pub center: Option<[f64; 3]>,
    pub half_extents: Option<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MediumText {
    pub scattering: Option<[f64; 3]>,
    #[serde(default)]
    pub absorption: [f64; 3],
    pub phase: Option<PhaseText>,
    pub g: Option<f64>,
    #[serde(default)]
    pub components: Vec<ComponentText>,
    pub height_falloff: Option<HeightFalloffText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HeightFalloffText {
    #[serde(default = "plus_y")]
    pub up: [f64; 3],
    #[serde(default)]
    pub base_height: f64,
    pub scale_height: f64,
}

fn plus_y() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ComponentText {
    pub scattering: [f64; 3],
    #[serde(default)]
    pub phase: PhaseText,
    pub g: Option<f64>,
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq, Default)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PhaseText {
    #[default]
    Isotropic,
    Rayleigh,
    HenyeyGreenstein,
}

/// A table, or `"gltf:NAME"`, which takes the thing of that name from the mesh's file.
pub(super) enum Named<T> {
    Inline(T),
    Gltf(String),
}

// By hand: serde's untagged enums lose the place and the reason of an error inside of the table.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NamedVisitor<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for NamedVisitor<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table or \"gltf:NAME\"")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                match text.strip_prefix("gltf:") {
                    Some(name) => Ok(Named::Gltf(name.to_owned())),
                    None => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(Named::Inline)
            }
        }

        deserializer.deserialize_any(NamedVisitor(PhantomData))
    }
}
