//! Everything that a frame borrows, owned and open to change.

use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, ScatterImage,
    ShadowLayer, ShadowMap, VolumetricShadow,
};

use crate::filling::Filling;

/// The kinds of shadow map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKind {
    /// A sun without a map.
    Unshadowed,
    /// A sun with one map.
    Orthographic,
    /// A sun with several.
    Cascades,
    /// A spot with a map of its cone.
    Spot,
    /// A spot that is too wide for one: six faces.
    SpotCube,
    /// A point light: six faces.
    Point,
    /// A point light: six turned faces that overlap, with projections of their own.
    Faces,
}

impl MapKind {
    /// All kinds, the one without a map first.
    pub const ALL: [Self; 7] = [
        Self::Unshadowed,
        Self::Orthographic,
        Self::Cascades,
        Self::Spot,
        Self::SpotCube,
        Self::Point,
        Self::Faces,
    ];

    /// Whether the light is a lamp.
    pub fn is_lamp(self) -> bool {
        matches!(self, Self::Spot | Self::SpotCube | Self::Point | Self::Faces)
    }
}

/// What a frame borrows. Tests change a part of it; [`Self::with`] checks how the parts fit.
#[derive(Debug, Clone)]
pub struct OwnedFrame {
    /// The camera; its size is the image's.
    pub camera: Camera,
    /// Distances along the pixels' rays \[world units\], `[y][x]`; `+∞` is no surface.
    pub depth: Vec<f32>,
    /// The light.
    pub light: Light,
    /// How the maps are put together.
    pub kind: MapKind,
    /// A projection a map, faces and cascades in their order.
    pub projections: Vec<MapProjection>,
    /// Depths of each map, `[row][column]`.
    pub texels: Vec<Vec<f32>>,
    /// The medium.
    pub medium: Medium,
    /// Coloured glass before the light, `[row][column]`.
    pub texture: Option<(MapProjection, Vec<[f32; 3]>)>,
    /// Where rays end that hit nothing nearer \[world units\], ≥ 0 or ∞.
    pub max_distance: f64,
}

impl OwnedFrame {
    /// Fills all maps anew.
    pub fn fill(&mut self, filling: Filling) {
        let sizes = self.projections.iter().map(MapProjection::size);
        self.texels = sizes.enumerate().map(|(index, size)| filling.texels(index, size)).collect();
    }

    /// The same frame with all maps filled anew.
    pub fn filled(&self, filling: Filling) -> Self {
        let mut filled = self.clone();
        filled.fill(filling);
        filled
    }

    /// The same frame without map and glass: what it would be in full light.
    pub fn unoccluded(&self) -> Self {
        Self { kind: MapKind::Unshadowed, texture: None, ..self.clone() }
    }

    /// Builds the frame and lends it; panics with the model's error where the parts do not fit.
    #[track_caller]
    pub fn with<R>(&self, use_frame: impl FnOnce(&Frame<'_>) -> R) -> R {
        let layer = |index: usize| ShadowLayer::new(self.projections[index], &self.texels[index]).unwrap();
        let (layers, cube_texels, faces): (Vec<_>, Vec<_>, [_; 6]);
        let shadow = match self.kind {
            MapKind::Unshadowed => ShadowMap::Unshadowed,
            MapKind::Orthographic => ShadowMap::Orthographic(layer(0)),
            MapKind::Cascades => {
                layers = (0..self.projections.len()).map(layer).collect();
                ShadowMap::Cascades(&layers)
            }
            MapKind::Spot => ShadowMap::Perspective(layer(0)),
            MapKind::Faces => {
                faces = std::array::from_fn(layer);
                ShadowMap::Faces(&faces)
            }
            MapKind::SpotCube | MapKind::Point => {
                let side = self.projections[0].size()[0];
                let lamp = self.light.position().expect("a cube map is a lamp's");
                cube_texels = self.texels.concat();
                ShadowMap::Cube(CubeShadow::new(lamp.into(), side, &cube_texels).unwrap())
            }
        };
        let depth = DepthMap::new(&self.depth, self.camera.size()).unwrap();
        let frame =
            Frame::new(&self.camera, depth, &self.light, &shadow, &self.medium, self.max_distance).unwrap();
        let texture = self.texture.as_ref().map(|(p, texels)| LightTexture::new(*p, texels).unwrap());
        match &texture {
            Some(texture) => use_frame(&frame.with_texture(texture).unwrap()),
            None => use_frame(&frame),
        }
    }

    /// With a point light in the place of a spot: where a ray grazes a cone, its own value can be as small as one likes while
    /// its ends are rounded all the same.
    pub fn without_cone(mut self) -> Self {
        if let Light::Spot(spot) = &self.light {
            let lamp = spot.lamp();
            self.light = Light::point(lamp.position().into(), lamp.intensity(), lamp.radius()).unwrap();
        }
        self
    }

    /// The image by a technique that is known to do it.
    #[track_caller]
    pub fn render(&self, technique: &mut dyn VolumetricShadow) -> ScatterImage {
        self.with(|frame| {
            let mut image = ScatterImage::new();
            technique.render(frame, &mut image).unwrap();
            image
        })
    }
}
