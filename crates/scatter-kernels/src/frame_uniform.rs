//! What a frame is without its texels, as the shaders read it: the mirror of `FrameUniform` in `shaders/core/frame.wgsl`,
//! whose comments say what each number means. A test compares the layouts with naga's.

use bytemuck::{Pod, Zeroable};

/// Most scattering components that a shader knows; components with one phase function count as one.
pub const MOST_PHASES: usize = 8;
/// "No surface", "no end": `FARTHEST` of the shaders, which know no infinities.
pub const FARTHEST: f32 = 1e18;

/// One layer of a light's map: `MapLayer`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct MapLayer {
    /// (u, v, depth) of a pixel's ray at s = 0: at the reference pixel, a column's, a row's.
    pub start: [[f32; 4]; 3],
    /// A unit of s.
    pub step: [[f32; 4]; 3],
    /// Width, height, bias \[world units\], cleared texel.
    pub size: [f32; 4],
    /// a, b, c, d of a stored texel's quotient.
    pub quotient: [f32; 4],
    /// Slope of its denominator in u and v; near and far − near of shares along the light's rays.
    pub slope: [f32; 4],
    /// The way of a light ray for a unit of depth, a texel's u, a texel's v.
    pub way: [[f32; 4]; 3],
    /// Column and row of its first texel, layer of the texture, flags (`LAYER_*`).
    pub place: [u32; 4],
}

/// One phase function and how much scatters by it: `PhaseTerm`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct PhaseTerm {
    /// RGB σs \[1/length\].
    pub sigma_s: [f32; 4],
    /// `PHASE_*`, g.
    pub kind: [f32; 4],
}

/// Everything: `FrameUniform`, 4,768 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct FrameUniform {
    /// Width, height, and the first pixel of the viewport in the depth texture.
    pub image: [u32; 4],
    /// How many maps, `MAPS_*`, `LIGHT_*`, flags (`FRAME_*`).
    pub kinds: [u32; 4],
    /// How many phase terms; steps of a march, its seed, its flags (`MARCH_*`).
    pub counts: [u32; 4],
    /// Direction of a pixel's ray a unit of s: at the reference pixel, a column's, a row's.
    pub direction: [[f32; 4]; 3],
    /// Its start, relative to the eye.
    pub origin: [[f32; 4]; 3],
    /// Reference pixel, max_distance, extinction of the weakest channel that scatters.
    pub reference: [f32; 4],
    /// a, b, c, d of a depth texel's quotient: at the reference pixel, a column's, a row's.
    pub depth: [[f32; 4]; 3],
    /// Cleared depth texel, block of pixels that one distance stands for, unused.
    pub depth_more: [f32; 4],
    /// Sun: the way the light travels. Lamp: position relative to the eye, radius.
    pub light: [f32; 4],
    /// Lamp: position × way of a unit of s, at the reference pixel, a column's, a row's: numbers whose sums over an image are
    /// exact, then what they leave over.
    pub moment: [[f32; 4]; 6],
    /// RGB irradiance or intensity times the exposure.
    pub strength: [f32; 4],
    /// Spot: axis, cosine of the outer angle.
    pub cone: [f32; 4],
    /// Spot: slope of the cone's factor, cosine from which on it is 1, unused.
    pub cone_more: [f32; 4],
    /// RGB σt, the largest of them.
    pub sigma_t: [f32; 4],
    /// Height fog: up/scale height, ln ρ at the eye.
    pub fog: [f32; 4],
    /// The medium's components.
    pub phases: [PhaseTerm; MOST_PHASES],
    /// The texture in front of the light.
    pub glass: MapLayer,
    /// The light's maps.
    pub maps: [MapLayer; 16],
}

/// Constants of `frame.wgsl`; a test compares them.
pub mod flags {
    /// u and v are to be divided by depth.
    pub const LAYER_PERSPECTIVE: u32 = 1;
    /// Texels are distances along the light's rays.
    pub const LAYER_ALONG_RAY: u32 = 2;
    /// `size[3]` means "no surface".
    pub const LAYER_HAS_CLEARED: u32 = 4;
    /// No map.
    pub const MAPS_NONE: u32 = 0;
    /// One map of a sun or a spot.
    pub const MAPS_ONE: u32 = 1;
    /// Cascades: the first that contains a point decides.
    pub const MAPS_CASCADES: u32 = 2;
    /// Six faces of a lamp.
    pub const MAPS_FACES: u32 = 3;
    /// A directional light.
    pub const LIGHT_SUN: u32 = 0;
    /// A point light.
    pub const LIGHT_POINT: u32 = 1;
    /// A spot light.
    pub const LIGHT_SPOT: u32 = 2;
    /// All rays start at the eye.
    pub const FRAME_PERSPECTIVE: u32 = 1;
    /// Height fog.
    pub const FRAME_FOG: u32 = 2;
    /// A texture in front of the light.
    pub const FRAME_GLASS: u32 = 4;
    /// Depth texels are distances along the rays.
    pub const FRAME_DEPTH_ALONG_RAY: u32 = 8;
    /// `depth_more[0]` means "no surface".
    pub const FRAME_DEPTH_HAS_CLEARED: u32 = 16;
    /// A phase function depends on the angle.
    pub const FRAME_ANISOTROPIC: u32 = 32;
    /// One sample anywhere in each step.
    pub const MARCH_JITTER: u32 = 1;
    /// Steps of equal length near lamps, too.
    pub const MARCH_UNIFORM: u32 = 2;
}
