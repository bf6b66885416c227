//! Input that nothing can be made of is refused by the model itself, before any technique sees it, with a message that
//! names the field or the first such texel.

use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, ModelError, Phase,
    ShadowLayer, ShadowMap,
};

use crate::stress::row::{StressRow, Trial};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// Each input, the model's answer, and what its message must name.
type Refusal = (&'static str, fn() -> Result<(), ModelError>, &'static str);

/// Rows of bad input.
pub fn rows() -> Vec<StressRow> {
    let refusals: [Refusal; 19] = [
        ("NaN in the depth map", || depth(f32::NAN), "texel (2, 1)"),
        ("−∞ in the depth map", || depth(f32::NEG_INFINITY), "texel (2, 1)"),
        ("negative depth", || depth(-1.0), "texel (2, 1)"),
        ("NaN in the shadow map", || shadow(f32::NAN), "texel (1, 2)"),
        ("−∞ in the shadow map", || shadow(f32::NEG_INFINITY), "texel (1, 2)"),
        ("negative depth in the shadow map", || shadow(-1e-3), "texel (1, 2)"),
        ("NaN in a cube map", cube, "texel (0, 1)"),
        ("NaN in the coloured glass", glass, "texel (0, 0)"),
        ("singular shadow matrix", || matrix(0.0), "singular"),
        ("NaN in the shadow matrix", || matrix(f64::NAN), "NaN"),
        ("NaN in the camera's matrix", camera_matrix, "NaN"),
        ("light direction of length 0", || sun([0.0; 3]), "light.direction"),
        ("NaN in the light's direction", || sun([0.0, f64::NAN, 1.0]), "light.direction"),
        ("negative irradiance", negative_light, "light.irradiance[1]"),
        ("negative σs", || medium(-0.1, 0.0), "scattering[0]"),
        ("g = 1", || medium(0.1, 1.0), "medium.g"),
        ("eye at the lamp", eye_at_the_lamp, "eye"),
        ("NaN as max_distance", || frame(f64::NAN), "max_distance"),
        ("empty field of view", || camera(0.0), "vertical_fov"),
    ];
    refusals
        .into_iter()
        .map(|(name, input, names)| StressRow {
            group: "bad input",
            name: name.into(),
            trial: Trial::Refusal { input, names },
        })
        .collect()
}

fn depth(texel: f32) -> Result<(), ModelError> {
    DepthMap::new(&[1.0, 1.0, 1.0, 1.0, 1.0, texel, 1.0, texel, 1.0], [3, 3]).map(drop)
}

fn projection() -> Result<MapProjection, ModelError> {
    MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 2], [3, 3])
}

fn shadow(texel: f32) -> Result<(), ModelError> {
    ShadowLayer::new(projection()?, &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, texel, texel]).map(drop)
}

fn cube() -> Result<(), ModelError> {
    CubeShadow::new([0.0; 3], 1, &[1.0, f32::NAN, 1.0, 1.0, 1.0, 1.0]).map(drop)
}

fn glass() -> Result<(), ModelError> {
    LightTexture::new(projection()?, &[[1.0, f32::NAN, 1.0]; 9]).map(drop)
}

fn matrix(entry: f64) -> Result<(), ModelError> {
    let mut clip = [[0.0; 4]; 4];
    (clip[0][0], clip[1][1], clip[2][2], clip[3][3]) = (entry, 1.0, 1.0, 1.0);
    MapProjection::from_clip_from_world(clip, [3, 3]).map(drop)
}

fn camera_matrix() -> Result<(), ModelError> {
    let mut view = [[0.0; 4]; 4];
    (view[0][0], view[1][1], view[2][2], view[3][3]) = (1.0, 1.0, f64::NAN, 1.0);
    let mut clip = view;
    clip[2] = [0.0, 0.0, 0.0, -1.0];
    Camera::from_matrices(view, clip, [3, 3]).map(drop)
}

fn sun(direction: [f64; 3]) -> Result<(), ModelError> {
    Light::directional(direction, [1.0; 3]).map(drop)
}

fn negative_light() -> Result<(), ModelError> {
    Light::directional(UP, [1.0, -1.0, 1.0]).map(drop)
}

fn medium(sigma_s: f64, g: f64) -> Result<(), ModelError> {
    Medium::homogeneous([sigma_s, 0.1, 0.1], [0.0; 3], Phase::henyey_greenstein(g)?).map(drop)
}

fn camera(field_of_view: f64) -> Result<(), ModelError> {
    Camera::perspective([0.0; 3], [1.0, 0.0, 0.0], UP, field_of_view, [3, 3]).map(drop)
}

fn frame(max_distance: f64) -> Result<(), ModelError> {
    with_light(&Light::directional([0.0, -1.0, 0.2], [1.0; 3])?, max_distance)
}

fn eye_at_the_lamp() -> Result<(), ModelError> {
    with_light(&Light::point([0.3, 1.0, 2.0], [1.0; 3], 0.0)?, 10.0)
}

fn with_light(light: &Light, max_distance: f64) -> Result<(), ModelError> {
    let camera = Camera::perspective([0.3, 1.0, 2.0], [0.0; 3], UP, 60.0, [3, 3])?;
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic)?;
    let depth = [1.0; 9];
    Frame::new(&camera, DepthMap::new(&depth, [3, 3])?, light, &ShadowMap::Unshadowed, &medium, max_distance)
        .map(drop)
}
