//! Shadow maps: depths of the first surface along the light's rays.
//!
//! Visibility is by nearest texel: a point is lit if and only if its depth is ≤ the stored one; outside of the map
//! nothing is shadowed (MODEL.md, Conventions). Everything is borrowed, and every texel is checked once.

use glam::DVec3;

use crate::error::{ModelError, checked_len, checked_point, checked_size, checked_texels};
use crate::kinds::MapKind;
use crate::map_projection::{CUBE_AXES, MapProjection, cube_face_of};

/// One map: a projection and its depths.
#[derive(Debug, Clone, Copy)]
pub struct ShadowLayer<'a> {
    projection: MapProjection,
    texels: &'a [f32],
}

impl<'a> ShadowLayer<'a> {
    /// Borrows depths, `[row][column]`, `+∞` for "no surface"; checks every texel once. A depth may be any number
    /// ≥ 0 that the projection can produce. What an engine's pass wrote (z/w, distances) is made such depths by
    /// [`ShadowDepthEncoding`](crate::ShadowDepthEncoding).
    pub fn new(projection: MapProjection, texels: &'a [f32]) -> Result<Self, ModelError> {
        checked_shadow_texels(texels, projection.size(), 1)?;
        Ok(Self { projection, texels })
    }

    /// Of depths that are known to be sane, one a texel.
    pub(crate) fn from_checked(projection: MapProjection, texels: &'a [f32]) -> Self {
        Self { projection, texels }
    }

    /// Where the texels are.
    pub fn projection(&self) -> &MapProjection {
        &self.projection
    }

    /// All depths, `[row][column]`.
    pub fn texels(&self) -> &'a [f32] {
        self.texels
    }

    /// The depth stored at column `i`, row `j`.
    pub fn at(&self, i: u32, j: u32) -> f32 {
        self.texels[j as usize * self.projection.size()[0] as usize + i as usize]
    }
}

/// Six square maps around a lamp.
#[derive(Debug, Clone, Copy)]
pub struct CubeShadow<'a> {
    position: DVec3,
    size: u32,
    texels: &'a [f32],
}

impl<'a> CubeShadow<'a> {
    /// Borrows depths, `[face][row][column]` in the order +X −X +Y −Y +Z −Z, `size`² a face, linear along each
    /// face's axis; checks every texel once.
    pub fn new(position: [f64; 3], size: u32, texels: &'a [f32]) -> Result<Self, ModelError> {
        checked_shadow_texels(texels, [size; 2], 6)?;
        Ok(Self { position: checked_point("cube map position", position)?, size, texels })
    }

    /// One face as a map of its own.
    pub fn face(&self, face: usize) -> ShadowLayer<'a> {
        let (forward, right, down) = CUBE_AXES[face % 6];
        let projection = MapProjection::from_axes(self.position, right, down, forward, self.size);
        let area = self.size as usize * self.size as usize;
        ShadowLayer { projection, texels: &self.texels[(face % 6) * area..][..area] }
    }

    /// Where the lamp is.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Texels along an edge.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// All depths, `[face][row][column]`.
    pub fn texels(&self) -> &'a [f32] {
        self.texels
    }
}

/// What an engine knows about the light's shadows.
///
/// Borrowed and [`Copy`]: an engine makes one a frame without an allocation.
#[derive(Debug, Clone, Copy)]
pub enum ShadowMap<'a> {
    /// Nothing casts a shadow.
    Unshadowed,
    /// One parallel map: a directional light.
    Orthographic(ShadowLayer<'a>),
    /// One perspective map: a spot light, its field of view twice the outer angle.
    Perspective(ShadowLayer<'a>),
    /// Six faces along the world's axes in wgpu's order: a point light, or a spot wider than 80° (half angle).
    Cube(CubeShadow<'a>),
    /// Six square faces with projections of their own, for engines whose cubes are mirrored, turned or have borders:
    /// all from the lamp, together over the whole sphere (a frame checks both). The first that contains a point decides.
    Faces(&'a [ShadowLayer<'a>; 6]),
    /// Several parallel maps of one directional light, at most [`MAX_CASCADES`](crate::MAX_CASCADES); the first that
    /// contains a point decides.
    Cascades(&'a [ShadowLayer<'a>]),
}

impl<'a> ShadowMap<'a> {
    /// What kind of map it is.
    pub fn kind(&self) -> MapKind {
        match self {
            Self::Unshadowed => MapKind::Unshadowed,
            Self::Orthographic(_) => MapKind::Orthographic,
            Self::Perspective(_) => MapKind::Perspective,
            Self::Cube(_) => MapKind::Cube,
            Self::Faces(_) => MapKind::Faces,
            Self::Cascades(_) => MapKind::Cascades,
        }
    }

    /// How many maps there are: none, one, six or as many as there are cascades.
    pub fn layer_count(&self) -> usize {
        match self {
            Self::Unshadowed => 0,
            Self::Orthographic(_) | Self::Perspective(_) => 1,
            Self::Cube(_) | Self::Faces(_) => 6,
            Self::Cascades(layers) => layers.len(),
        }
    }

    /// The map with this index, in the order of [`Self::layers`].
    pub fn layer(&self, index: usize) -> Option<ShadowLayer<'a>> {
        match self {
            Self::Unshadowed => None,
            Self::Orthographic(layer) | Self::Perspective(layer) => (index == 0).then_some(*layer),
            Self::Cube(cube) => (index < 6).then(|| cube.face(index)),
            Self::Faces(faces) => faces.get(index).copied(),
            Self::Cascades(layers) => layers.get(index).copied(),
        }
    }

    /// The maps in order: none, one, six or as many as there are cascades.
    pub fn layers(&self) -> impl Iterator<Item = ShadowLayer<'a>> + use<'a> {
        let map = *self;
        (0..self.layer_count()).filter_map(move |index| map.layer(index))
    }

    /// Whether any texel holds a surface.
    pub fn casts_shadow(&self) -> bool {
        match self {
            Self::Unshadowed => false,
            Self::Cube(cube) => cube.texels.iter().any(|t| t.is_finite()),
            _ => self.layers().any(|layer| layer.texels.iter().any(|t| t.is_finite())),
        }
    }

    /// Whether light reaches a world point, by nearest texel.
    pub fn is_lit(&self, p_world: DVec3) -> bool {
        match self {
            Self::Unshadowed => true,
            Self::Orthographic(layer) | Self::Perspective(layer) => layer.lookup(p_world).unwrap_or(true),
            Self::Cube(cube) => {
                let face = cube_face_of(p_world - cube.position);
                cube.face(face).lookup(p_world).unwrap_or(true)
            }
            Self::Faces(faces) => faces.iter().find_map(|layer| layer.lookup(p_world)).unwrap_or(true),
            Self::Cascades(layers) => layers.iter().find_map(|layer| layer.lookup(p_world)).unwrap_or(true),
        }
    }
}

impl ShadowLayer<'_> {
    /// Whether light reaches a world point; `None` outside of this map.
    fn lookup(&self, p_world: DVec3) -> Option<bool> {
        let p = self.projection.texel_from_world(p_world);
        let [width, height] = self.projection.size();
        let behind = self.projection.is_perspective() && p.z <= 0.0;
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(width) && p.y < f64::from(height) && !behind;
        inside.then(|| p.z <= f64::from(self.at(p.x as u32, p.y as u32)))
    }
}

fn checked_shadow_texels(texels: &[f32], size: [u32; 2], faces: usize) -> Result<(), ModelError> {
    checked_len("shadow map", texels.len(), checked_size("shadow map", size)? * faces)?;
    checked_texels("shadow map", texels, size[0], |t| t >= 0.0, "a depth ≥ 0, or +∞ for no surface")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lit_means_not_deeper_than_the_stored_depth() {
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 1.0], [2, 1])
                .unwrap();
        let map = ShadowMap::Orthographic(ShadowLayer::new(projection, &[2.0, f32::INFINITY]).unwrap());
        assert!(map.is_lit(DVec3::new(-0.5, 0.0, -2.0)));
        assert!(!map.is_lit(DVec3::new(-0.5, 0.0, -2.001)));
        assert!(map.is_lit(DVec3::new(0.5, 0.0, -1e9)));
        assert!(map.is_lit(DVec3::new(-1.5, 0.0, -9.0)), "outside of the map nothing is shadowed");
        assert!(map.casts_shadow());
    }

    #[test]
    fn the_first_cascade_that_contains_a_point_decides() {
        let layer = |half: f64, texel: &'static [f32]| {
            let p =
                MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [half; 2], [1, 1]);
            ShadowLayer::new(p.unwrap(), texel).unwrap()
        };
        let layers = [layer(1.0, &[f32::INFINITY]), layer(4.0, &[1.0])];
        let map = ShadowMap::Cascades(&layers);
        assert!(map.is_lit(DVec3::new(0.5, 0.0, -2.0)));
        assert!(!map.is_lit(DVec3::new(1.5, 0.0, -2.0)));
        assert!(map.is_lit(DVec3::new(4.5, 0.0, -2.0)));
    }

    #[test]
    fn bad_maps_are_errors() {
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 1.0], [2, 3])
                .unwrap();
        let error =
            ShadowLayer::new(projection, &[1.0, 1.0, 1.0, f32::NAN, 1.0, 1.0]).unwrap_err().to_string();
        assert!(error.contains("(1, 1)"), "{error}");
        assert!(ShadowLayer::new(projection, &[1.0; 5]).is_err());
        assert!(MapProjection::from_clip_from_world([[0.0; 4]; 4], [2, 2]).is_err());
        assert!(MapProjection::orthographic([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0], [1.0; 2], [2, 2]).is_err());
    }
}
