//! Translucent occluders of a frame: smoke and hair that dim light on its way instead of cutting it off.
//!
//! They come captured, as segments of each texel's light ray ([`TranslucentLayer`]), or as a [`TranslucentSource`] that
//! names the segments of any map tile by tile, for techniques that store none. Opaque surfaces stay in the
//! [`ShadowMap`](crate::ShadowMap); view rays are not dimmed, the engine draws smoke and hair itself.

use glam::DVec3;

use crate::error::{ModelError, checked_size};
use crate::kinds::{LightKind, MapKind};
use crate::map_layout::MapLayout;
use crate::map_projection::MapProjection;
use crate::map_source::MapError;
use crate::translucent_segment::TranslucentSegment;

/// The segments of every texel's light ray, through the texel's centre, as one flat list.
#[derive(Debug, Clone, Copy)]
pub struct TranslucentLayer<'a> {
    projection: MapProjection,
    offsets: &'a [u32],
    segments: &'a [TranslucentSegment],
}

impl<'a> TranslucentLayer<'a> {
    /// Borrows the segments of all texels, `[row][column]`: those of texel `t` are
    /// `segments[offsets[t]..offsets[t + 1]]`, in any order. `offsets` holds one number more than there are texels, starts
    /// at 0, never falls and ends at the number of segments.
    ///
    /// Every segment is checked once, in O(texels + segments); the error names the first bad texel.
    pub fn new(
        projection: MapProjection,
        offsets: &'a [u32],
        segments: &'a [TranslucentSegment],
    ) -> Result<Self, ModelError> {
        let texels = checked_size("translucent layer", projection.size())?;
        let wrong_length = |buffer, expected: usize, found: usize| ModelError::BufferLength {
            buffer,
            expected: expected as u64,
            found: found as u64,
        };
        if offsets.len() != texels + 1 {
            return Err(wrong_length("translucent layer offsets", texels + 1, offsets.len()));
        }
        let bad = |texel: usize, value: f64, range| ModelError::BadTexel {
            map: "translucent layer",
            x: (texel % projection.size()[0] as usize) as u32,
            y: (texel / projection.size()[0] as usize) as u32,
            value,
            range,
        };
        if offsets[0] != 0 {
            return Err(bad(0, offsets[0].into(), "offsets that start at 0"));
        }
        if let Some(texel) = offsets.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(bad(texel, offsets[texel + 1].into(), "offsets that do not fall"));
        }
        if offsets[texels] as usize != segments.len() {
            return Err(wrong_length("translucent layer segments", offsets[texels] as usize, segments.len()));
        }
        if let Some(index) = segments.iter().position(|segment| !segment.is_sane()) {
            // The last texel that begins at or before the segment; texels without segments begin there too.
            let texel = offsets.partition_point(|&offset| offset as usize <= index) - 1;
            let TranslucentSegment { entry, exit, optical_depth } = segments[index];
            return Err(if !(optical_depth >= 0.0) {
                bad(texel, optical_depth.into(), "optical depths ≥ 0, or +∞ for an opaque segment")
            } else if !(entry >= 0.0) {
                bad(texel, entry.into(), "segments that begin at a depth ≥ 0")
            } else {
                bad(texel, exit.into(), "segments that end at a finite depth, not before they begin")
            });
        }
        Ok(Self { projection, offsets, segments })
    }

    /// Of segments that are known to be sane.
    pub(crate) fn from_checked(
        projection: MapProjection,
        offsets: &'a [u32],
        segments: &'a [TranslucentSegment],
    ) -> Self {
        Self { projection, offsets, segments }
    }

    /// Where the texels are.
    pub fn projection(&self) -> &MapProjection {
        &self.projection
    }

    /// Where each texel's segments begin, and at the end how many there are: texels + 1 numbers.
    pub fn offsets(&self) -> &'a [u32] {
        self.offsets
    }

    /// The segments of all texels.
    pub fn segments(&self) -> &'a [TranslucentSegment] {
        self.segments
    }

    /// The segments of the texel at column `i`, row `j`, unsorted.
    pub fn at(&self, i: u32, j: u32) -> &'a [TranslucentSegment] {
        let texel = j as usize * self.projection.size()[0] as usize + i as usize;
        &self.segments[self.offsets[texel] as usize..self.offsets[texel + 1] as usize]
    }

    /// What a light ray keeps up to a world point, 0 to 1, by nearest texel; `None` outside of this map.
    pub fn transmittance(&self, p_world: DVec3) -> Option<f64> {
        let p = self.projection.texel_from_world(p_world);
        let [width, height] = self.projection.size();
        let behind = self.projection.is_perspective() && p.z <= 0.0;
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(width) && p.y < f64::from(height) && !behind;
        inside.then(|| {
            let segments = self.at(p.x as u32, p.y as u32);
            (-segments.iter().map(|segment| segment.optical_depth_before(p.z)).sum::<f64>()).exp()
        })
    }
}

/// Names the segments of any map, from the occluders themselves: what a technique asks that stores no segments.
pub trait TranslucentSource: Sync {
    /// Calls `sink` with every segment on the light rays through the centres of a tile's texels.
    ///
    /// `tile` is `[x0, y0, x1, y1]` in texels of `projection`, half-open and within its size. `sink` gets the texel within
    /// the tile in row order, `(y − y0)·(x1 − x0) + (x − x0)`, and the segment. Segments of one texel come in the order in
    /// which the occluders were submitted, the same at every call and for every tiling. Depths are the map's; what lies
    /// before depth 0 of a parallel map dims all that the map sees and comes as a segment from 0 to 0. Every segment is
    /// sane ([`TranslucentSegment::is_sane`]).
    ///
    /// # Errors
    ///
    /// A projection without an inverse; what the source itself lacks.
    fn capture(
        &self,
        projection: &MapProjection,
        tile: [u32; 4],
        sink: &mut dyn FnMut(u32, TranslucentSegment),
    ) -> Result<(), MapError>;

    /// The smallest and the largest corner of a box along the world's axes around all occluders \[world units\];
    /// `None` if there are none.
    fn bounds(&self) -> Option<[[f64; 3]; 2]>;

    /// Bytes that the source itself holds.
    fn memory_bytes(&self) -> u64;
}

/// The translucent occluders of a frame.
#[derive(Clone, Copy)]
pub enum Translucent<'a> {
    /// Segments of maps that are there: one layer for a sun or a spot, as many as there are cascades for a sun, or six
    /// faces around a lamp. They look where shadow maps look (a frame checks it) and have a size of their own. The first
    /// that contains a point decides; outside of all nothing is dimmed.
    Captured(&'a [TranslucentLayer<'a>]),
    /// The occluders themselves, for maps of the technique's own choice.
    Source(&'a dyn TranslucentSource),
}

impl<'a> Translucent<'a> {
    /// The captured layers; none of a source.
    pub fn layers(&self) -> &'a [TranslucentLayer<'a>] {
        match self {
            Self::Captured(layers) => layers,
            Self::Source(_) => &[],
        }
    }

    /// The occluders themselves, where they are there.
    pub fn source(&self) -> Option<&'a dyn TranslucentSource> {
        match self {
            Self::Captured(_) => None,
            Self::Source(source) => Some(*source),
        }
    }

    /// Where captured layers look, as maps of this kind of light; `None` of a source, which looks nowhere.
    pub(crate) fn layout(&self, light: LightKind) -> Result<Option<MapLayout>, ModelError> {
        let Self::Captured(layers) = self else { return Ok(None) };
        let kind = match (light, layers.len()) {
            (LightKind::Directional, 1) => MapKind::Orthographic,
            (LightKind::Directional, 2..) => MapKind::Cascades,
            (LightKind::Spot, 1) => MapKind::Perspective,
            (LightKind::Point | LightKind::Spot, 6) => MapKind::Faces,
            (light, count) => {
                let needs = match light {
                    LightKind::Directional => "one layer, or one a cascade",
                    LightKind::Point => "six faces",
                    LightKind::Spot => "one layer or six faces",
                };
                return Err(ModelError::Mismatch(format!(
                    "{} has {count} translucent layers; give {needs}",
                    crate::kinds::Kind::phrase(light)
                )));
            }
        };
        MapLayout::of_projections(kind, layers.iter().map(|layer| *layer.projection())).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(size: [u32; 2]) -> MapProjection {
        MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [3.0, 1.0], size).unwrap()
    }

    #[test]
    fn transmittances_multiply_and_end_where_the_map_does() {
        let half = TranslucentSegment::hair(2.0, 0.5);
        let segments = [TranslucentSegment::volume(1.0, 3.0, 0.5), half, half];
        let layer = TranslucentLayer::new(map([3, 1]), &[0, 1, 1, 3], &segments).unwrap();
        // Columns from left to right: smoke, nothing, two hairs.
        let at = |x: f64, depth: f64| layer.transmittance(DVec3::new(x, 0.0, -depth));
        assert_eq!(at(-2.0, 1.0), Some(1.0));
        assert!((at(-2.0, 2.0).unwrap() - (-0.5f64).exp()).abs() < 1e-15);
        assert_eq!(at(0.0, 9.0), Some(1.0));
        assert_eq!(at(2.0, 2.0), Some(1.0));
        // ln 2 in f32 is right to 6e-8.
        assert!((at(2.0, 9.0).unwrap() - 0.25).abs() < 1e-7);
        assert_eq!(at(4.0, 9.0), None);
        assert_eq!(layer.at(2, 0).len(), 2);
    }

    #[test]
    fn the_first_bad_texel_is_named() {
        let good = TranslucentSegment::volume(1.0, 3.0, 0.5);
        let said = |offsets: &[u32], segments: &[TranslucentSegment]| {
            TranslucentLayer::new(map([3, 2]), offsets, segments).unwrap_err().to_string()
        };
        let nan = TranslucentSegment { optical_depth: f32::NAN, ..good };
        let message = said(&[0, 1, 1, 1, 2, 4, 4], &[good, good, good, nan]);
        assert!(
            message.contains("texel (1, 1) is NaN") && message.contains("optical depths ≥ 0"),
            "{message}"
        );
        let before = TranslucentSegment { entry: -1.0, ..good };
        assert!(said(&[0, 0, 0, 1, 1, 1, 1], &[before]).contains("texel (2, 0) is -1"));
        let turned = TranslucentSegment { exit: 0.5, ..good };
        assert!(said(&[0, 1, 1, 1, 1, 1, 1], &[turned]).contains("texel (0, 0) is 0.5"));
        assert!(
            said(&[0, 0, 0, 2, 1, 1, 1], &[good])
                .contains("texel (0, 1) is 1; give offsets that do not fall")
        );
        assert!(said(&[1, 1, 1, 1, 1, 1, 1], &[good]).contains("start at 0"));
        assert!(said(&[0; 6], &[]).contains("needs 7"));
        assert!(said(&[0, 1, 1, 1, 1, 1, 1], &[]).contains("segments holds 0 values; its size needs 1"));
    }
}
