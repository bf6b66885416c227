//! Options of the technique: which surface the mesh has, how fine it is, and how crossings become radiance.

use scatter_core::{LightKind, Quality};

/// The technique's id.
pub const ID: &str = "light-volume";

/// Options of [`LightVolume`](crate::LightVolume).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The surface that the mesh has.
    pub surface: Surface,
    /// How crossings become a pixel's radiance.
    pub accumulate: Accumulate,
    /// Whether the mesh is coarser where the map allows it.
    pub tessellation: Tessellation,
    /// What an adaptive mesh may be off by along the light, 0 to 0.1: under a sun as a share of the longest view ray, around
    /// a lamp as a share of the depth itself. Squares whose depths spread further (of the interpolated surface: are further off
    /// two triangles) are subdivided; 0 is exact.
    pub threshold: f32,
}

/// The surface of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Surface {
    /// Every texel at its own depth, with walls between: what the map says by nearest texel.
    #[default]
    Stepped,
    /// Triangles between the texels' centres (Billeter et al. 2010, Section 4). Judged by `truth-height-field`; it is not the surface
    /// by nearest texel.
    Interpolated,
}

/// How crossings become a pixel's radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accumulate {
    /// Every lit interval by its closed form.
    #[default]
    Intervals,
    /// Signed shares of the pixel's unoccluded light as integers of 2⁻³⁰: what a GPU can do by atomic additions.
    Shares,
    /// Signed radiances in f64.
    Signed,
    /// Signed radiances in f32: the paper's.
    SignedSingle,
}

/// How fine the mesh is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tessellation {
    /// Squares, rectangles and runs of one depth are one face; depths within the threshold count as one. Of the interpolated
    /// surface squares of cells that lie in one plane are one quad, stitched to its neighbours.
    #[default]
    Adaptive,
    /// The base grid: a cap a texel, a wall a step.
    Static,
}

impl Default for Options {
    fn default() -> Self {
        Self::exact()
    }
}

impl Options {
    /// What a level chooses for a light. Under a sun the exact mesh, which keeps every level: a coarser one saves little there.
    /// Around a lamp thresholds of which the shots of the workshop use a third of a level's error at the most; `film` is exact.
    pub fn for_quality(level: Quality, light: LightKind) -> Self {
        let threshold = match (light, level) {
            (LightKind::Directional, _) | (_, Quality::Film) => 0.0,
            (_, Quality::Game) => 0.003,
            (_, Quality::Preview) => 0.01,
        };
        Self { threshold, ..Self::exact() }
    }

    /// An adaptive mesh that is off by nothing.
    pub fn exact() -> Self {
        Self {
            surface: Surface::Stepped,
            accumulate: Accumulate::Intervals,
            tessellation: Tessellation::Adaptive,
            threshold: 0.0,
        }
    }

    /// What keeps a promise of `|T − R| ≤ ε` times the unoccluded value, for every ε. A surface that is moved by δ along the
    /// light moves a ray's crossing by δ over the cosine between the two, and no cosine is too small for a frame to have it:
    /// so no threshold but 0 keeps a promise.
    pub fn for_error(_error: f64) -> Self {
        Self::exact()
    }

    pub(crate) fn is_adaptive(&self) -> bool {
        self.tessellation == Tessellation::Adaptive
    }
}
