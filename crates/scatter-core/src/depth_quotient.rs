//! Depth texels as quotients of affine functions: what a GPU needs to read an engine's depth as it is.
//!
//! Whatever near and far planes, direction of z, infinity or oblique planes there are, a stored texel z means
//! `(a + b·z)/(c + d·z)` with a, b, c and d affine in the pixel (a camera's depth) or c in the texel (a light's map).

use glam::{DVec2, DVec3};

/// `(a + b·z)/(c + d·z)` of a camera's depth texel z: the ray parameter s of a [`RayFan`](crate::RayFan), in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthQuotient {
    /// `[a, b, c, d]` at the centre of pixel (0, 0), for a column more, for a row more.
    pub coefficients: [[f64; 4]; 3],
    /// The texel that means "no surface"; `None` where it is infinite anyway.
    pub cleared: Option<f32>,
    /// Whether the texel is the distance along the ray itself, whatever `coefficients` say.
    pub along_ray: bool,
}

/// What the texels of a light's map mean, as linear depth along the map's axis \[world units\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowDepthQuotient {
    /// `(a + b·z)/(c + d·z + slope·(u, v))`, (u, v) the texel's centre.
    Quotient {
        /// a, b, c, d.
        coefficients: [f64; 4],
        /// Of the denominator, a texel in u and in v.
        slope: DVec2,
        /// The texel that means "no surface"; `None` where it is infinite anyway.
        cleared: Option<f32>,
    },
    /// `(near + z·(far − near))/|way + u·way_u + v·way_v|`: distances along the light's rays.
    AlongRay {
        /// A light ray's way for a unit of depth: at (0, 0), a texel in u, a texel in v.
        way: [DVec3; 3],
        /// near and far − near.
        share: [f64; 2],
        /// The texel that means "no surface"; `None` where it is infinite anyway.
        cleared: Option<f32>,
    },
}

impl ShadowDepthQuotient {
    /// Of texels that are linear depths themselves, `+∞` for no surface.
    pub const LINEAR: Self =
        Self::Quotient { coefficients: [0.0, 1.0, 1.0, 0.0], slope: DVec2::ZERO, cleared: None };
}
