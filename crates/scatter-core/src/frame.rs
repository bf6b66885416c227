//! One frame: what an engine has anyway, borrowed, and checked once so that a [`Frame`] that exists is sane.

use crate::camera::Camera;
use crate::depth_map::DepthMap;
use crate::error::ModelError;
use crate::light::{Light, LightTexture};
use crate::map_layout::MapLayout;
use crate::map_source::MapSource;
use crate::medium::Medium;
use crate::setup::Setup;
use crate::shadow_map::ShadowMap;
use crate::translucent::Translucent;

/// Camera, depth, light with its shadows, medium: all that a technique reads. A [`Setup`] with its texels.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    pub(crate) setup: Setup<'a>,
    pub(crate) depth: DepthMap<'a>,
    pub(crate) shadow: &'a ShadowMap<'a>,
    pub(crate) texture: Option<&'a LightTexture<'a>>,
    pub(crate) map_source: Option<&'a dyn MapSource>,
    pub(crate) translucent: Option<&'a Translucent<'a>>,
}

impl<'a> Frame<'a> {
    /// Borrows a frame; checks how its parts fit each other (each part has checked itself).
    ///
    /// `max_distance` ≥ 0 \[world units\] is where rays end that hit nothing nearer; it may be ∞ if the medium
    /// extinguishes every channel that scatters.
    pub fn new(
        camera: &'a Camera,
        depth: DepthMap<'a>,
        light: &'a Light,
        shadow: &'a ShadowMap<'a>,
        medium: &'a Medium,
        max_distance: f64,
    ) -> Result<Self, ModelError> {
        if depth.size() != camera.size() {
            let ([w, h], [cw, ch]) = (depth.size(), camera.size());
            return Err(ModelError::Mismatch(format!(
                "the depth map is {w}x{h} and the camera's image {cw}x{ch}; give both the same size"
            )));
        }
        let setup = Setup::new(camera, light, MapLayout::of(shadow)?, medium, max_distance)?;
        Ok(Self { setup, depth, shadow, texture: None, map_source: None, translucent: None })
    }

    /// The same frame with a colour texture in front of its light. Errors as those of [`Setup::with_texture`].
    pub fn with_texture(self, texture: &'a LightTexture<'a>) -> Result<Self, ModelError> {
        let setup = self.setup.with_texture(*texture.projection())?;
        Ok(Self { setup, texture: Some(texture), ..self })
    }

    /// The same frame with a source of further maps of its scene.
    pub fn with_map_source(self, source: &'a dyn MapSource) -> Self {
        Self { map_source: Some(source), ..self }
    }

    /// The same frame with occluders that dim light on its way: smoke, hair. They add to the shadow map's opaque
    /// surfaces; view rays are not dimmed. Errors as those of [`Setup::with_translucent`].
    pub fn with_translucent(self, translucent: &'a Translucent<'a>) -> Result<Self, ModelError> {
        let setup = self.setup.with_translucent(translucent)?;
        Ok(Self { setup, translucent: Some(translucent), ..self })
    }

    /// The frame without its texels.
    pub fn setup(&self) -> &Setup<'a> {
        &self.setup
    }

    /// The camera.
    pub fn camera(&self) -> &'a Camera {
        self.setup.camera
    }

    /// Distances along the pixels' rays.
    pub fn depth(&self) -> DepthMap<'a> {
        self.depth
    }

    /// The light of this pass.
    pub fn light(&self) -> &'a Light {
        self.setup.light
    }

    /// What shadows it.
    pub fn shadow(&self) -> &'a ShadowMap<'a> {
        self.shadow
    }

    /// The colour texture in front of it.
    pub fn texture(&self) -> Option<&'a LightTexture<'a>> {
        self.texture
    }

    /// The medium.
    pub fn medium(&self) -> &'a Medium {
        self.setup.medium
    }

    /// Where rays end that hit nothing nearer \[world units\], ≥ 0 or ∞.
    pub fn max_distance(&self) -> f64 {
        self.setup.max_distance
    }

    /// A source of further maps of the scene, where the caller has one.
    pub fn map_source(&self) -> Option<&'a dyn MapSource> {
        self.map_source
    }

    /// What dims its light on the way, where there is any.
    pub fn translucent(&self) -> Option<&'a Translucent<'a>> {
        self.translucent
    }

    /// Where the ray of pixel `(x, y)` ends: its surface, or `max_distance` if that is nearer.
    pub fn ray_end(&self, x: u32, y: u32) -> f64 {
        f64::from(self.depth.at(x, y)).min(self.setup.max_distance)
    }

    /// RGB transmittance of the ray of pixel `(x, y)` from the eye to where it ends, in any medium; f64.
    pub fn transmittance(&self, x: u32, y: u32) -> [f64; 3] {
        let (camera, end) = (self.setup.camera, self.ray_end(x, y));
        match self.setup.medium.height_falloff() {
            None => self.setup.medium.transmittance(end),
            Some(_) => self.setup.medium.transmittance_along(camera.eye(), &camera.pixel_ray(x, y), end),
        }
    }

    /// `[width, height]` of the image.
    pub fn size(&self) -> [u32; 2] {
        self.setup.size()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_projection::MapProjection;
    use crate::phase::Phase;
    use crate::shadow_map::{CubeShadow, ShadowLayer};

    fn camera() -> Camera {
        Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [3, 2]).unwrap()
    }

    fn medium() -> Medium {
        Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap()
    }

    fn message(light: &Light, shadow: &ShadowMap<'_>, max_distance: f64) -> String {
        let (camera, medium, depth) = (camera(), medium(), [1.0f32; 6]);
        let depth = DepthMap::new(&depth, [3, 2]).unwrap();
        match Frame::new(&camera, depth, light, shadow, &medium, max_distance) {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
        let lamp = Light::point([1.0, 2.0, 3.0], [1.0; 3], 0.0).unwrap();
        let texels = [1.0f32; 24];
        let cube = ShadowMap::Cube(CubeShadow::new([1.0, 2.0, 3.0], 2, &texels).unwrap());
        let elsewhere = ShadowMap::Cube(CubeShadow::new([1.0, 2.0, 4.0], 2, &texels).unwrap());
        let map = |forward: [f64; 3]| {
            let p =
                MapProjection::orthographic([0.0; 3], forward, [0.0, 0.0, 1.0], [1.0; 2], [2, 2]).unwrap();
            ShadowMap::Orthographic(ShadowLayer::new(p, &texels[..4]).unwrap())
        };
        assert_eq!(message(&sun, &map([0.0, -1.0, 0.0]), 10.0), "");
        assert!(message(&sun, &map([0.1, -1.0, 0.0]), 10.0).contains("look along"));
        assert!(message(&sun, &map([0.0, 1.0, 0.0]), 10.0).contains("look along"));
        assert!(message(&sun, &cube, 10.0).contains("orthographic"));
        assert_eq!(message(&lamp, &cube, 10.0), "");
        assert!(message(&lamp, &elsewhere, 10.0).contains("not at the lamp"));
        assert!(message(&lamp, &map([0.0, -1.0, 0.0]), 10.0).contains("cube"));
        assert!(message(&lamp, &cube, f64::NAN).contains("max_distance"));
        assert!(message(&lamp, &cube, -1.0).contains("max_distance"));
        assert_eq!(message(&lamp, &cube, f64::INFINITY), "");
        let at_eye = Light::point([0.0; 3], [1.0; 3], 0.0).unwrap();
        assert!(message(&at_eye, &ShadowMap::Unshadowed, 10.0).contains("eye"));
    }

    #[test]
    fn the_depth_map_has_the_size_of_the_image() {
        let (camera, medium, depth) = (camera(), medium(), [1.0f32; 6]);
        let sun = Light::directional([0.0, -1.0, 0.0], [1.0; 3]).unwrap();
        let depth = DepthMap::new(&depth, [2, 3]).unwrap();
        assert!(Frame::new(&camera, depth, &sun, &ShadowMap::Unshadowed, &medium, 1.0).is_err());
    }
}
