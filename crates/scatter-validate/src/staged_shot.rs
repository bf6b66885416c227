//! A shot made ready to be measured: its triangles in a caster, its maps cast once, its frames lent to techniques.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use scatter_core::{
    Camera, DepthMap, Frame, Light, Medium, ModelError, Projection, RenderError, SceneFacts, ShadowMap,
    Translucent, Window,
};
use scatter_scene::{
    CasterError, MapError, MapResolution, MapSource, OwnedTexture, RasterDevice, RasterError, RasterScene,
    SceneCaster, Shot, ShotMaps,
};

use crate::beyond_border::BeyondBorder;

/// A shot whose maps are made.
#[derive(Debug)]
pub struct StagedShot {
    name: String,
    camera: Camera,
    medium: Medium,
    max_distance: f64,
    lights: Vec<StagedLight>,
    caster: Arc<SceneCaster>,
    /// The same triangles on a device, where that makes the maps.
    raster: Option<RasterScene>,
    resolution: MapResolution,
    maps_ms: f64,
    /// What moved cameras see beside the picture, once one has moved.
    beyond: OnceLock<BeyondBorder>,
}

#[derive(Debug)]
struct StagedLight {
    light: Light,
    texture: Option<OwnedTexture>,
    /// None once they are dropped.
    maps: Option<ShotMaps>,
}

/// A shot that cannot be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StageError {
    /// Its parts make no frame.
    #[error("{shot}: {source}")]
    Model {
        /// The shot.
        shot: String,
        /// What is wrong, and the cure.
        source: ModelError,
    },
    /// Its triangles cannot be cast against.
    #[error("{shot}: {source}")]
    Caster {
        /// The shot.
        shot: String,
        /// What is wrong, and the cure.
        source: CasterError,
    },
    /// Its maps cannot be made.
    #[error("{shot}: {source}")]
    Maps {
        /// The shot.
        shot: String,
        /// What is wrong, and the cure.
        source: MapError,
    },
    /// Its triangles do not fit the device.
    #[error("{shot}: {source}")]
    Raster {
        /// The shot.
        shot: String,
        /// What is wrong, and the cure.
        source: RasterError,
    },
    /// A technique gave up on it.
    #[error("{shot}: {method}: {source}")]
    Render {
        /// The shot.
        shot: String,
        /// The technique.
        method: &'static str,
        /// Why.
        source: RenderError,
    },
}

impl StagedShot {
    /// Builds the caster, drops the loaded mesh and casts depth and shadow maps of a resolution (a number is one map of
    /// so many texels a side).
    pub fn new(shot: Shot, resolution: impl Into<MapResolution>) -> Result<Self, StageError> {
        Self::with_source(shot, resolution, None)
    }

    /// As [`Self::new`]; where there is a device, it draws the maps, and those that techniques ask for.
    pub fn with_source(
        shot: Shot,
        resolution: impl Into<MapResolution>,
        device: Option<&RasterDevice>,
    ) -> Result<Self, StageError> {
        let mut staged = Self::without_maps(shot, resolution, device)?;
        staged.make_maps()?;
        Ok(staged)
    }

    /// As [`Self::with_source`] without depth and shadow maps, as after [`Self::drop_maps`]: all that ray-cast truth needs.
    pub fn without_maps(
        shot: Shot,
        resolution: impl Into<MapResolution>,
        device: Option<&RasterDevice>,
    ) -> Result<Self, StageError> {
        let resolution = resolution.into();
        let Shot { name, camera, lights, medium, max_distance, scene, .. } = shot;
        let caster =
            SceneCaster::new(&scene).map_err(|source| StageError::Caster { shot: name.clone(), source })?;
        let caster = Arc::new(caster);
        // The caster has its own welded copy; a large scene must not be held twice.
        drop(scene);
        let raster = device
            .map(|device| RasterScene::new(device, caster.clone()))
            .transpose()
            .map_err(|source| StageError::Raster { shot: name.clone(), source })?;
        let lights = lights
            .into_iter()
            .map(|part| StagedLight { light: part.light, texture: part.texture, maps: None })
            .collect();
        let beyond = OnceLock::new();
        Ok(Self {
            name,
            camera,
            medium,
            max_distance,
            lights,
            caster,
            raster,
            resolution,
            maps_ms: 0.0,
            beyond,
        })
    }

    /// Moves the camera and the lights (as many as there are, in their order), and makes maps of a resolution
    /// anew. The triangles stay as they are, and so does the glass before a light.
    pub fn restage(
        &mut self,
        camera: Camera,
        lights: &[Light],
        resolution: impl Into<MapResolution>,
    ) -> Result<(), StageError> {
        (self.camera, self.resolution) = (camera, resolution.into());
        for (staged, light) in self.lights.iter_mut().zip(lights) {
            staged.light = light.clone();
        }
        self.make_maps()
    }

    /// What makes the maps.
    fn source(&self) -> &dyn MapSource {
        match &self.raster {
            Some(raster) => raster,
            None => &*self.caster,
        }
    }

    fn make_maps(&mut self) -> Result<(), StageError> {
        self.beyond = OnceLock::new();
        let source: &dyn MapSource = match &self.raster {
            Some(raster) => raster,
            None => &*self.caster,
        };
        let start = Instant::now();
        for part in &mut self.lights {
            // The old maps go first: two sets of large maps are not held at once.
            part.maps = None;
            let (camera, light) = (&self.camera, &part.light);
            let maps =
                ShotMaps::build_from(source, &self.caster, camera, light, self.max_distance, self.resolution)
                    .map_err(|source| StageError::Maps { shot: self.name.clone(), source })?;
            part.maps = Some(maps);
        }
        self.maps_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(())
    }

    /// The shot's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The shot's camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The triangles.
    pub fn caster(&self) -> &SceneCaster {
        &self.caster
    }

    /// The lights, each with whether coloured glass stands before it.
    pub fn lights(&self) -> impl Iterator<Item = (&Light, bool)> {
        self.lights.iter().map(|part| (&part.light, part.texture.is_some()))
    }

    /// How many lights shine.
    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Texels of each light's shadow maps.
    pub fn resolution(&self) -> MapResolution {
        self.resolution
    }

    /// How many cascades each sun has; `None` where all lights have their one map.
    pub fn cascades(&self) -> Option<u32> {
        self.lights.iter().find_map(|part| self.resolution.cascades_of(&part.light))
    }

    /// Time that the maps took \[ms\].
    pub fn maps_ms(&self) -> f64 {
        self.maps_ms
    }

    /// Time that the same maps take by ray casts \[ms\]: `None` where ray casts made them.
    pub fn raycast_maps_ms(&self) -> Result<Option<f64>, StageError> {
        if self.raster.is_none() {
            return Ok(None);
        }
        let start = Instant::now();
        for part in &self.lights {
            let (camera, light) = (&self.camera, &part.light);
            ShotMaps::build(&self.caster, camera, light, self.max_distance, self.resolution)
                .map_err(|source| StageError::Model { shot: self.name.clone(), source })?;
        }
        Ok(Some(start.elapsed().as_secs_f64() * 1e3))
    }

    /// Drops depth and shadow maps; from now on frames are unshadowed and endless, as ray-cast truth reads them.
    pub fn drop_maps(&mut self) {
        for light in &mut self.lights {
            light.maps = None;
        }
    }

    /// Lends the frame of light `index` as `camera` sees it (the shot's camera, or one shifted by some pixels).
    pub fn with_frame<R>(
        &self,
        index: usize,
        camera: &Camera,
        visit: impl FnOnce(&Frame<'_>) -> R,
    ) -> Result<R, StageError> {
        let own = self.lights[index].maps.as_ref().map(ShotMaps::depth);
        self.with_depth(index, camera, own, visit)
    }

    /// Lends the frame of light `index` that a timed loop shows as number `frame`: 0 is the shot's own; the camera of the
    /// others has moved to the right by up to sixteen pixels, a pixel a frame and then from the first again, and the depth map is
    /// what it sees.
    pub fn with_timed_frame<R>(
        &self,
        index: usize,
        frame: u32,
        visit: impl FnOnce(&Frame<'_>) -> R,
    ) -> Result<R, StageError> {
        let columns = BeyondBorder::columns_of(frame);
        let camera = self.camera.shifted(f64::from(columns), 0.0);
        let own = self.lights[index].maps.as_ref().map(ShotMaps::depth);
        let moved = match own {
            Some(own) if columns > 0 => {
                Some(self.beyond()?.moved(own, self.camera.size()[0] as usize, columns))
            }
            _ => None,
        };
        self.with_depth(index, &camera, moved.as_deref().or(own), visit)
    }

    /// What moved cameras see beside the picture.
    fn beyond(&self) -> Result<&BeyondBorder, StageError> {
        if let Some(beyond) = self.beyond.get() {
            return Ok(beyond);
        }
        let beyond = BeyondBorder::of(self.source(), &self.camera)
            .map_err(|source| StageError::Maps { shot: self.name.clone(), source })?;
        Ok(self.beyond.get_or_init(|| beyond))
    }

    fn with_depth<R>(
        &self,
        index: usize,
        camera: &Camera,
        depth: Option<&[f32]>,
        visit: impl FnOnce(&Frame<'_>) -> R,
    ) -> Result<R, StageError> {
        let wrong = |source| StageError::Model { shot: self.name.clone(), source };
        let part = &self.lights[index];
        let texture = part.texture.as_ref().map(OwnedTexture::as_light_texture);
        let [width, height] = camera.size();
        let endless;
        let mut layers = Vec::new();
        let depth = match depth {
            Some(depth) => depth,
            None => {
                endless = vec![f32::INFINITY; width as usize * height as usize];
                &endless
            }
        };
        let depth = DepthMap::new(depth, camera.size()).map_err(wrong)?;
        let shadow = match &part.maps {
            Some(maps) => maps.shadow_map(&mut layers).map_err(wrong)?,
            None => ShadowMap::Unshadowed,
        };
        let frame = Frame::new(camera, depth, &part.light, &shadow, &self.medium, self.max_distance)
            .map_err(wrong)?
            .with_map_source(self.source());
        // Smoke and hair of the scene, for whoever dims light by them; all others refuse the frame.
        let translucent = self.caster.occluders().map(|occluders| Translucent::Source(occluders));
        let frame = match &translucent {
            Some(translucent) => frame.with_translucent(translucent).map_err(wrong)?,
            None => frame,
        };
        Ok(match &texture {
            Some(texture) => visit(&frame.with_texture(texture).map_err(wrong)?),
            None => visit(&frame),
        })
    }

    /// The facts of each light's frame, by which techniques are configured.
    pub fn facts(&self) -> Result<Vec<SceneFacts>, StageError> {
        (0..self.lights.len()).map(|index| self.with_frame(index, &self.camera, SceneFacts::of)).collect()
    }
}

/// The same view at another size: the vertical extent stays, pixels keep their shape.
pub fn resized(camera: &Camera, size: [u32; 2]) -> Result<Camera, ModelError> {
    let [width, height] = camera.size().map(f64::from);
    let stretch = (f64::from(size[0]) / f64::from(size[1].max(1))) / (width / height);
    // At the same shape nothing but the pixel count changes, to the last bit.
    if stretch == 1.0 || size[1] == 0 {
        return camera.with_size(size);
    }
    let Window { left, right, bottom, top } = camera.window();
    let window = Window { left: left * stretch, right: right * stretch, bottom, top };
    let target = (camera.eye() + camera.forward()).to_array();
    let (eye, up) = (camera.eye().to_array(), camera.up().to_array());
    match camera.projection() {
        Projection::Perspective => Camera::perspective_off_centre(eye, target, up, window, size),
        Projection::Orthographic => Camera::orthographic(eye, target, up, top - bottom, size),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wider_image_shows_more_to_the_sides_and_the_same_above() {
        let camera =
            Camera::perspective([1.0, 2.0, 3.0], [0.0, 1.0, -4.0], [0.0, 1.0, 0.0], 60.0, [40, 30]).unwrap();
        let wide = resized(&camera, [80, 30]).unwrap();
        let exact =
            Camera::perspective([1.0, 2.0, 3.0], [0.0, 1.0, -4.0], [0.0, 1.0, 0.0], 60.0, [80, 30]).unwrap();
        let (a, b) = (wide.pixel_ray(71, 3).direction, exact.pixel_ray(71, 3).direction);
        assert!((a - b).length() < 1e-14);
        let same = resized(&camera, [80, 60]).unwrap();
        assert_eq!(same.window(), camera.window());
        assert!(resized(&camera, [0, 30]).is_err() && resized(&camera, [30, 0]).is_err());
    }
}
