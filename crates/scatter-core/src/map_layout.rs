//! Which maps a light has, and where they look: a shadow map without its texels.

use glam::DVec4;

use crate::error::ModelError;
use crate::kinds::MapKind;
use crate::map_projection::MapProjection;
use crate::shadow_map::ShadowMap;

/// Most cascades of a directional light. Engines use 3 to 8; the list is held inline, so that a set-up borrows nothing
/// of the maps and is copied as it is.
pub const MAX_CASCADES: usize = 16;

/// The kind of a shadow map and the projections of its layers, in the order of [`ShadowMap::layers`]. No heap.
#[derive(Clone, Copy)]
pub struct MapLayout {
    kind: MapKind,
    count: usize,
    /// The first `count` are the layers'.
    projections: [MapProjection; MAX_CASCADES],
}

impl MapLayout {
    /// Nothing casts a shadow.
    pub const UNSHADOWED: Self = Self {
        kind: MapKind::Unshadowed,
        count: 0,
        projections: [MapProjection::from_rows_unchecked([DVec4::X, DVec4::Y, DVec4::Z], false, [1; 2]);
            MAX_CASCADES],
    };

    /// Of a shadow map. An error if it has more than [`MAX_CASCADES`] cascades.
    pub fn of(shadow: &ShadowMap<'_>) -> Result<Self, ModelError> {
        let mut layout = Self { kind: shadow.kind(), ..Self::UNSHADOWED };
        for layer in shadow.layers() {
            layout.push(*layer.projection())?;
        }
        Ok(layout)
    }

    /// Of a cube map that only a GPU has: faces of `size`² texels around `position`, in wgpu's order and orientation.
    pub fn cube(position: [f64; 3], size: u32) -> Result<Self, ModelError> {
        let mut layout = Self { kind: MapKind::Cube, ..Self::UNSHADOWED };
        for face in 0..6 {
            layout.push(MapProjection::cube_face(position, face, size)?)?;
        }
        Ok(layout)
    }

    /// Of maps that only a GPU has. An error if the number of projections is not that of the kind: none, one, six
    /// or as many as there are cascades (1 to [`MAX_CASCADES`]); and for a cube, whose faces are no choice:
    /// [`Self::cube`].
    pub fn new(kind: MapKind, projections: &[MapProjection]) -> Result<Self, ModelError> {
        let (fits, expected) = match kind {
            MapKind::Unshadowed => (projections.is_empty(), "no projection"),
            MapKind::Orthographic | MapKind::Perspective => (projections.len() == 1, "one projection"),
            MapKind::Cube => (false, "its position and size to MapLayout::cube, or the kind Faces"),
            MapKind::Faces => (projections.len() == 6, "six projections"),
            MapKind::Cascades => (!projections.is_empty(), "at least one projection"),
        };
        if !fits {
            return Err(ModelError::Mismatch(format!(
                "a light with {} has {} projections; give {expected}",
                crate::kinds::Kind::phrase(kind),
                projections.len()
            )));
        }
        Self::of_projections(kind, projections.iter().copied())
    }

    /// Of as many projections as the kind has.
    pub(crate) fn of_projections(
        kind: MapKind,
        projections: impl Iterator<Item = MapProjection>,
    ) -> Result<Self, ModelError> {
        let mut layout = Self { kind, ..Self::UNSHADOWED };
        for projection in projections {
            layout.push(projection)?;
        }
        Ok(layout)
    }

    fn push(&mut self, projection: MapProjection) -> Result<(), ModelError> {
        let Some(free) = self.projections.get_mut(self.count) else {
            return Err(ModelError::Mismatch(format!(
                "the light has more than {MAX_CASCADES} cascades; give at most {MAX_CASCADES}"
            )));
        };
        *free = projection;
        self.count += 1;
        Ok(())
    }

    /// What kind of map it is.
    pub fn kind(&self) -> MapKind {
        self.kind
    }

    /// The layers' projections in order: none, one, six or as many as there are cascades.
    pub fn projections(&self) -> &[MapProjection] {
        &self.projections[..self.count]
    }

    /// Largest side of a layer \[texels\]; 0 without one.
    pub fn largest_side(&self) -> u32 {
        self.projections().iter().flat_map(MapProjection::size).max().unwrap_or(0)
    }
}

impl PartialEq for MapLayout {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind && self.projections() == other.projections()
    }
}

impl std::fmt::Debug for MapLayout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("MapLayout").field(&self.kind).field(&self.projections()).finish()
    }
}
