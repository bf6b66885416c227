//! One frame's input, owned, with the numbers that its maps were made from.
//!
//! [`Scenario::with_frame`] goes through the model's public constructors, as an engine would; the brute-force image of
//! [`texel_cells`](crate::texel_cells) reads the same numbers and none of the model's matrices, so that a fault of the
//! constructors shows as a difference.

use glam::{DMat4, DVec3, DVec4};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, ModelError, ShadowLayer,
    ShadowMap, Translucent, TranslucentLayer, TranslucentSegment,
};

/// Everything that a frame borrows.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// The camera.
    pub camera: Camera,
    /// Distances along the rays \[world units\], `[y][x]`.
    pub distances: Vec<f32>,
    /// The light.
    pub light: Light,
    /// What shadows it.
    pub shadow: Shadow,
    /// Coloured glass in front of it.
    pub glass: Option<Glass>,
    /// Smoke and hair, captured for a map of its own.
    pub smoke: Option<Smoke>,
    /// The medium.
    pub medium: Medium,
    /// Where rays end that hit nothing nearer \[world units\].
    pub max_distance: f64,
    /// The pixels' rays where they are known in another way than by the camera, `[y][x]`.
    pub rays: Option<Vec<PixelRay>>,
}

/// A pixel's ray, relative to the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelRay {
    /// Where it starts.
    pub origin: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
    /// Where it ends \[world units\].
    pub end: f64,
}

/// Where the texels of a map lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFrame {
    /// A point of the plane of depth 0, or the lamp.
    pub origin: DVec3,
    /// Unit vector along the light's axis; depth is counted along it.
    pub forward: DVec3,
    /// Unit vector towards row 0.
    pub up: DVec3,
    /// Half width and half height \[world units\], or tangents of a perspective map.
    pub half: [f64; 2],
    /// Texels, width and height.
    pub size: [u32; 2],
    /// Whether texels are measured in tangents.
    pub perspective: bool,
    /// Whether the projection is built from an engine's matrix instead of the vectors.
    pub by_matrix: bool,
}

/// A map with its depths.
#[derive(Debug, Clone, PartialEq)]
pub struct MapLayer {
    /// Where its texels lie.
    pub frame: MapFrame,
    /// Depths, `[row][column]`.
    pub texels: Vec<f32>,
}

/// What shadows the light.
#[derive(Debug, Clone, PartialEq)]
pub enum Shadow {
    /// Nothing does.
    None,
    /// One map of a sun, or cascades, the nearest first.
    Parallel(Vec<MapLayer>),
    /// The map of a spot.
    Perspective(MapLayer),
    /// Six faces around the lamp.
    Cube {
        /// Texels along an edge.
        side: u32,
        /// Depths, `[face][row][column]`.
        texels: Vec<f32>,
    },
}

/// Segments of light rays, texel by texel.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoke {
    /// Where its texels lie.
    pub frame: MapFrame,
    /// The segments of each texel in any order, `[row][column]`.
    pub texels: Vec<Vec<TranslucentSegment>>,
}

/// Coloured glass.
#[derive(Debug, Clone, PartialEq)]
pub struct Glass {
    /// Where its texels lie.
    pub frame: MapFrame,
    /// Linear RGB factors, `[row][column]`.
    pub texels: Vec<[f32; 3]>,
}

impl MapFrame {
    /// A frame that looks along `forward` with an `up` of its own, square to it, a little turned against the axes of
    /// the world.
    pub fn along(origin: DVec3, forward: DVec3, half: [f64; 2], size: [u32; 2], perspective: bool) -> Self {
        let forward = forward.normalize();
        let seed = if forward.y.abs() < 0.7 { DVec3::new(0.2, 1.0, 0.1) } else { DVec3::new(0.3, 0.1, 1.0) };
        let up = (seed - forward * seed.dot(forward)).normalize();
        Self { origin, forward, up, half, size, perspective, by_matrix: false }
    }

    /// Unit vector towards the last column.
    pub fn right(&self) -> DVec3 {
        self.forward.cross(self.up)
    }

    /// The model's projection.
    pub fn projection(&self) -> Result<MapProjection, ModelError> {
        let [origin, forward, up] = [self.origin, self.forward, self.up].map(|v| v.to_array());
        if self.by_matrix {
            return MapProjection::from_clip_from_world(self.clip_from_world(), self.size);
        }
        if self.perspective {
            MapProjection::perspective(origin, forward, up, self.half[0], self.size[0])
        } else {
            MapProjection::orthographic(origin, forward, up, self.half, self.size)
        }
    }

    /// What an engine would hold, column-major: x right, y up, reversed z with an infinite far plane for a lamp and
    /// linear depth for a sun.
    fn clip_from_world(&self) -> [[f64; 4]; 4] {
        let row = |axis: DVec3, scale: f64| (axis * scale).extend(-axis.dot(self.origin) * scale);
        let (x, y) = (row(self.right(), 1.0 / self.half[0]), row(self.up, 1.0 / self.half[1]));
        let depth = row(self.forward, 1.0);
        let rows = if self.perspective { [x, y, DVec4::W * 0.01, depth] } else { [x, y, depth, DVec4::W] };
        DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose().to_cols_array_2d()
    }
}

impl MapLayer {
    /// A map whose texel `(column, row)` holds `depth(column, row)`.
    pub fn filled(frame: MapFrame, depth: impl Fn(u32, u32) -> f32) -> Self {
        let texels = texels_of(frame.size, depth);
        Self { frame, texels }
    }
}

/// `value(column, row)` of every texel, `[row][column]`.
pub fn texels_of<T>(size: [u32; 2], value: impl Fn(u32, u32) -> T) -> Vec<T> {
    (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j))).map(|(i, j)| value(i, j)).collect()
}

impl Scenario {
    /// Builds the frame and hands it over.
    pub fn with_frame<R>(&self, use_frame: impl FnOnce(&Frame<'_>) -> R) -> Result<R, ModelError> {
        let layer = |layer: &'_ MapLayer| layer.frame.projection();
        let cascades;
        let shadow = match &self.shadow {
            Shadow::None => ShadowMap::Unshadowed,
            Shadow::Parallel(layers) if layers.len() == 1 => {
                ShadowMap::Orthographic(ShadowLayer::new(layer(&layers[0])?, &layers[0].texels)?)
            }
            Shadow::Parallel(maps) => {
                let layers = maps.iter().map(|map| ShadowLayer::new(layer(map)?, &map.texels));
                cascades = layers.collect::<Result<Vec<_>, _>>()?;
                ShadowMap::Cascades(&cascades)
            }
            Shadow::Perspective(map) => ShadowMap::Perspective(ShadowLayer::new(layer(map)?, &map.texels)?),
            Shadow::Cube { side, texels } => {
                let position = self.light.position().unwrap_or(DVec3::ZERO);
                ShadowMap::Cube(CubeShadow::new(position.to_array(), *side, texels)?)
            }
        };
        let depth = DepthMap::new(&self.distances, self.camera.size())?;
        let frame = Frame::new(&self.camera, depth, &self.light, &shadow, &self.medium, self.max_distance)?;
        let (mut offsets, mut segments) = (vec![0], Vec::new());
        for texel in self.smoke.iter().flat_map(|smoke| &smoke.texels) {
            segments.extend_from_slice(texel);
            offsets.push(segments.len() as u32);
        }
        let smoke = match &self.smoke {
            None => None,
            Some(smoke) => Some([TranslucentLayer::new(smoke.frame.projection()?, &offsets, &segments)?]),
        };
        let translucent = smoke.as_ref().map(|layers| Translucent::Captured(layers));
        let frame = match &translucent {
            None => frame,
            Some(translucent) => frame.with_translucent(translucent)?,
        };
        match &self.glass {
            None => Ok(use_frame(&frame)),
            Some(glass) => {
                let texture = LightTexture::new(glass.frame.projection()?, &glass.texels)?;
                Ok(use_frame(&frame.with_texture(&texture)?))
            }
        }
    }

    /// `[width, height]` of the image.
    pub fn size(&self) -> [u32; 2] {
        self.camera.size()
    }

    /// The pixels' rays, `[y][x]`.
    pub fn pixel_rays(&self) -> Vec<PixelRay> {
        if let Some(rays) = &self.rays {
            return rays.clone();
        }
        let rays = texels_of(self.size(), |x, y| self.camera.pixel_ray(x, y));
        rays.iter()
            .zip(&self.distances)
            .map(|(ray, &distance)| PixelRay {
                origin: ray.origin,
                direction: ray.direction,
                end: f64::from(distance).min(self.max_distance),
            })
            .collect()
    }

    /// Whether any map holds a surface.
    pub fn casts_shadow(&self) -> bool {
        let any = |texels: &[f32]| texels.iter().any(|depth| depth.is_finite());
        match &self.shadow {
            Shadow::None => false,
            Shadow::Parallel(layers) => layers.iter().any(|layer| any(&layer.texels)),
            Shadow::Perspective(layer) => any(&layer.texels),
            Shadow::Cube { texels, .. } => any(texels),
        }
    }

    /// Texels along the longest side of the maps; 0 without any.
    pub fn map_side(&self) -> u32 {
        match &self.shadow {
            Shadow::None => 0,
            Shadow::Parallel(layers) => layers.iter().flat_map(|layer| layer.frame.size).max().unwrap_or(0),
            Shadow::Perspective(layer) => layer.frame.size[0],
            Shadow::Cube { side, .. } => *side,
        }
    }
}
