//! The maps of a shot, made once and lent to frames: depth along the view rays, and the light's shadow maps.

use scatter_core::{
    Camera, CubeShadow, DepthMap, Light, MapError, MapProjection, MapSource, ModelError, ShadowLayer,
    ShadowMap,
};

use crate::caster::SceneCaster;
use crate::fit::{FittedMap, fit_map};
use crate::map_resolution::MapResolution;

/// Depth and shadow texels with their projections; frames borrow them.
#[derive(Debug, Clone)]
pub struct ShotMaps {
    image_size: [u32; 2],
    depth: Vec<f32>,
    fitted: FittedMap,
    /// All layers one behind the other.
    shadow: Vec<f32>,
}

impl ShotMaps {
    /// Casts both maps, at a resolution (a number is one map of so many texels a side), fitted by [`fit_map`].
    pub fn build(
        caster: &SceneCaster,
        camera: &Camera,
        light: &Light,
        max_distance: f64,
        resolution: impl Into<MapResolution>,
    ) -> Result<Self, ModelError> {
        Self::build_from(caster, caster, camera, light, max_distance, resolution).map_err(of_casts)
    }

    /// As [`Self::build`], with maps made by any source; `caster` holds the same scene, and fits the map.
    pub fn build_from(
        source: &dyn MapSource,
        caster: &SceneCaster,
        camera: &Camera,
        light: &Light,
        max_distance: f64,
        resolution: impl Into<MapResolution>,
    ) -> Result<Self, MapError> {
        let resolution = resolution.into().checked()?;
        let mut depth = Vec::new();
        source.depth_map(camera, &mut depth)?;
        let map = DepthMap::new(&depth, camera.size())?;
        let fitted = fit_map(caster, camera, map, light, max_distance, resolution)?;
        Self::with_shadow(source, camera, depth, fitted)
    }

    fn with_shadow(
        source: &dyn MapSource,
        camera: &Camera,
        depth: Vec<f32>,
        fitted: FittedMap,
    ) -> Result<Self, MapError> {
        let mut shadow = Vec::new();
        match &fitted {
            FittedMap::Orthographic(projection) | FittedMap::Perspective(projection) => {
                source.shadow_map(projection, &mut shadow)?;
            }
            FittedMap::Cube { position, size } => source.cube_map(*position, *size, &mut shadow)?,
            FittedMap::Cascades(projections) => {
                let mut layer = Vec::new();
                for projection in projections {
                    source.shadow_map(projection, &mut layer)?;
                    shadow.extend_from_slice(&layer);
                }
            }
        }
        Ok(Self { image_size: camera.size(), depth, fitted, shadow })
    }

    /// Distances along the view rays. Checks every texel, as all maps do when they are borrowed; the texels of a cast
    /// pass.
    pub fn depth_map(&self) -> Result<DepthMap<'_>, ModelError> {
        DepthMap::new(&self.depth, self.image_size)
    }

    /// The light's shadows. Checks every texel. `layers` is a buffer that cascades borrow; its content does not matter.
    pub fn shadow_map<'l, 'a: 'l>(
        &'a self,
        layers: &'l mut Vec<ShadowLayer<'a>>,
    ) -> Result<ShadowMap<'l>, ModelError> {
        let area =
            |projection: &MapProjection| projection.size().map(|n| n as usize).iter().product::<usize>();
        Ok(match &self.fitted {
            FittedMap::Orthographic(projection) => {
                ShadowMap::Orthographic(ShadowLayer::new(*projection, &self.shadow)?)
            }
            FittedMap::Perspective(projection) => {
                ShadowMap::Perspective(ShadowLayer::new(*projection, &self.shadow)?)
            }
            FittedMap::Cube { position, size } => {
                ShadowMap::Cube(CubeShadow::new(*position, *size, &self.shadow)?)
            }
            FittedMap::Cascades(projections) => {
                let mut rest = self.shadow.as_slice();
                layers.clear();
                for projection in projections {
                    let (texels, behind) = rest.split_at(area(projection).min(rest.len()));
                    rest = behind;
                    layers.push(ShadowLayer::new(*projection, texels)?);
                }
                ShadowMap::Cascades(layers)
            }
        })
    }

    /// Where the shadow map looks.
    pub fn fitted(&self) -> &FittedMap {
        &self.fitted
    }

    /// Distances along the view rays, `[y][x]`.
    pub fn depth(&self) -> &[f32] {
        &self.depth
    }

    /// All depths of the shadow maps, layer by layer.
    pub fn shadow(&self) -> &[f32] {
        &self.shadow
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        ((self.depth.capacity() + self.shadow.capacity()) * size_of::<f32>()) as u64
    }
}

/// The error of a source that is made of ray casts: nothing but the model can be wrong.
fn of_casts(error: MapError) -> ModelError {
    match error {
        MapError::Model(error) => error,
        error => ModelError::Mismatch(error.to_string()),
    }
}
