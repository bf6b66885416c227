//! The kinds of things that a frame is made of: what capabilities are lists of, and what a refusal names.

use std::fmt;

use crate::camera::{Camera, Projection, Window};
use crate::light::{DirectionalLight, Light, PointLight, SpotLight};
use crate::phase::Phase;

/// An enumeration whose values have a short name for tables and a phrase for sentences.
pub trait Kind: Copy + PartialEq + fmt::Display + 'static {
    /// All values.
    const ALL: &'static [Self];

    /// What a frame with it has, with its article: "an orthographic camera".
    fn phrase(self) -> &'static str;
}

macro_rules! kinds {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $short:literal, $phrase:literal;)+ }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name {
            $($(#[$variant_doc])* $variant,)+
        }

        impl Kind for $name {
            const ALL: &'static [Self] = &[$(Self::$variant),+];

            fn phrase(self) -> &'static str {
                match self {
                    $(Self::$variant => $phrase,)+
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(match self {
                    $(Self::$variant => $short,)+
                })
            }
        }
    };
}

kinds! {
    /// The kind of a frame's light.
    LightKind {
        /// A sun.
        Directional = "directional", "a directional light";
        /// A lamp.
        Point = "point", "a point light";
        /// A lamp with a cone.
        Spot = "spot", "a spot light";
    }
}

kinds! {
    /// The kind of a light's shadow map.
    MapKind {
        /// No map: nothing casts a shadow.
        Unshadowed = "unshadowed", "no shadow map";
        /// One parallel map.
        Orthographic = "orthographic", "one parallel shadow map";
        /// One perspective map.
        Perspective = "perspective", "one perspective shadow map";
        /// Six faces along the world's axes, in wgpu's order and orientation.
        Cube = "cube", "a cube map in wgpu's order";
        /// Six faces with projections of their own.
        Faces = "faces", "six faces of any orientation";
        /// Several parallel maps of one light.
        Cascades = "cascades", "cascades";
    }
}

kinds! {
    /// The kind of a camera.
    CameraKind {
        /// Rays through one eye, the window centred on the view direction.
        Perspective = "perspective", "a perspective camera";
        /// Rays through one eye, any window, sheared ones too.
        OffCentre = "off-centre", "an off-centre perspective camera";
        /// Parallel rays, square to the image plane or oblique.
        Orthographic = "orthographic", "an orthographic camera";
    }
}

kinds! {
    /// How a medium extinguishes the three channels.
    ExtinctionKind {
        /// All alike.
        Grey = "grey", "grey extinction";
        /// Each by its own σt.
        Rgb = "rgb", "extinction that differs by channel";
    }
}

kinds! {
    /// The kind of a phase function.
    PhaseKind {
        /// The same in all directions.
        Isotropic = "isotropic", "isotropic scattering";
        /// Rayleigh's.
        Rayleigh = "rayleigh", "Rayleigh scattering";
        /// Henyey and Greenstein's.
        HenyeyGreenstein = "henyey-greenstein", "Henyey-Greenstein scattering";
    }
}

// The patterns below name every field on purpose: what is added to a light, a camera or a phase function does not compile
// before it says here whether it is of another kind, which no technique renders that does not name it.

impl LightKind {
    /// Of a light.
    pub fn of(light: &Light) -> Self {
        match light {
            Light::Directional(DirectionalLight { direction: _, irradiance: _ }) => Self::Directional,
            Light::Point(PointLight { position: _, intensity: _, radius: _ }) => Self::Point,
            Light::Spot(SpotLight { lamp: _, direction: _, cos_inner: _, cos_outer: _, outer: _ }) => {
                Self::Spot
            }
        }
    }
}

impl CameraKind {
    /// Of a camera. A perspective window counts as centred if its borders mirror each other to 1e-6 of its size, which
    /// is what matrices of f32 round.
    pub fn of(camera: &Camera) -> Self {
        let Camera { eye: _, right: _, up: _, forward: _, window, shear, travel: _, projection, size: _ } =
            camera;
        let &Window { left, right, bottom, top } = window;
        let off = |a: f64, b: f64| (a + b).abs() > 1e-6 * (a - b).abs();
        let sheared = shear.abs() > 1e-6 * (left - right).abs();
        match projection {
            Projection::Orthographic => Self::Orthographic,
            Projection::Perspective if sheared || off(left, right) || off(bottom, top) => Self::OffCentre,
            Projection::Perspective => Self::Perspective,
        }
    }
}

impl PhaseKind {
    /// Of a phase function.
    pub fn of(phase: &Phase) -> Self {
        match phase {
            Phase::Isotropic => Self::Isotropic,
            Phase::Rayleigh => Self::Rayleigh,
            Phase::HenyeyGreenstein { g: _ } => Self::HenyeyGreenstein,
        }
    }
}

/// Kinds by their short names: "a, b, c"; "none" for an empty list.
pub(crate) fn names<K: Kind>(kinds: &[K]) -> String {
    match kinds {
        [] => "none".into(),
        _ => kinds.iter().map(K::to_string).collect::<Vec<_>>().join(", "),
    }
}

/// Words as a choice: "a, b or c".
pub(crate) fn either(words: &[&str]) -> String {
    match words {
        [] => "nothing".into(),
        [one] => (*one).into(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}
