//! Shader modules: files of WGSL, concatenated. Module scope knows no order, so that each noun has one file, and variants
//! differ in which files they list. No preprocessor.

use BindingKind::{
    Texture, TextureArray, TextureMultisampled, Uniform, WriteR32Float, WriteRgba16Float, WriteRgba32Float,
};

/// One assembled shader.
#[derive(Debug, Clone, Copy)]
pub struct Module {
    /// Its name, as `technique/stage`.
    pub name: &'static str,
    /// Its files' texts, in any order.
    pub files: &'static [&'static str],
    /// Its entry points.
    pub entries: &'static [Entry],
}

/// One compute entry point (or the two stages of a full-screen triangle), with all that it binds.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Its function's name.
    pub name: &'static str,
    /// Invocations a workgroup; zeros of a raster stage.
    pub workgroup: [u32; 3],
    /// What it binds in group 0.
    pub bindings: &'static [Binding],
}

/// A binding of group 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Binding {
    /// Its number.
    pub number: u32,
    /// What it is.
    pub kind: BindingKind,
}

/// What can be bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// A uniform buffer.
    Uniform,
    /// A storage buffer that is read.
    Storage,
    /// A storage buffer that is read and written.
    StorageReadWrite,
    /// `texture_2d<f32>`, not filtered: r32float, depth formats.
    Texture,
    /// `texture_multisampled_2d<f32>`.
    TextureMultisampled,
    /// `texture_2d_array<f32>`, not filtered.
    TextureArray,
    /// A storage texture, written: r32float.
    WriteR32Float,
    /// A storage texture, written: rgba16float.
    WriteRgba16Float,
    /// A storage texture, written: rgba32float.
    WriteRgba32Float,
}

impl Module {
    /// Its text.
    pub fn assemble(&self) -> String {
        self.files.join("\n")
    }
}

/// Shorthand for tables.
pub const fn bind(number: u32, kind: BindingKind) -> Binding {
    Binding { number, kind }
}

/// The texts of `shaders/core`.
pub mod core {
    /// Numbers without infinities, φ.
    pub const NUMBER: &str = include_str!("../../../shaders/core/number.wgsl");
    /// The frame's uniform (binding 0), a pixel's ray.
    pub const FRAME: &str = include_str!("../../../shaders/core/frame.wgsl");
    /// Depth texels as distances.
    pub const DEPTH: &str = include_str!("../../../shaders/core/depth.wgsl");
    /// The light's maps (binding 4).
    pub const MAPS: &str = include_str!("../../../shaders/core/maps.wgsl");
    /// Phase functions.
    pub const PHASE: &str = include_str!("../../../shaders/core/phase.wgsl");
    /// Lit intervals under a sun, transmittance.
    pub const SUN: &str = include_str!("../../../shaders/core/sun.wgsl");
    /// Lit intervals near a lamp.
    pub const LAMP: &str = include_str!("../../../shaders/core/lamp.wgsl");
    /// Sines and angles to f32's rounding.
    pub const ANGLE: &str = include_str!("../../../shaders/core/angle.wgsl");
    /// The texture in front of the light (binding 5).
    pub const GLASS: &str = include_str!("../../../shaders/core/glass.wgsl");
    /// Distances along the rays, read (binding 3).
    pub const DISTANCE: &str = include_str!("../../../shaders/core/distance_in.wgsl");
    /// The image in rgba16float (bindings 6 and 7).
    pub const OUTPUT_HALF: &str = include_str!("../../../shaders/core/output_half.wgsl");
    /// The image in rgba32float (bindings 6 and 7).
    pub const OUTPUT_FLOAT: &str = include_str!("../../../shaders/core/output_float.wgsl");
    /// What is written of a pixel.
    pub const OUTPUT: &str = include_str!("../../../shaders/core/output.wgsl");
}

/// The shared modules; the first is the first pass of every technique.
pub const MODULES: &[&Module] = &[&DISTANCE, &DISTANCE_MULTISAMPLED, &MARCH_HALF, &MARCH_FLOAT, &COMPOSITE];

/// Every module of the crate, those of techniques after the shared ones.
pub fn all() -> impl Iterator<Item = &'static Module> {
    MODULES
        .iter()
        .chain(&crate::minmax::MODULES)
        .chain(&crate::epipolar::MODULES)
        .copied()
        .chain([&crate::epipolar::SUMS_RAW])
}

/// Depth texels to distances.
pub const DISTANCE: Module = Module {
    name: "core/distance",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::DEPTH,
        include_str!("../../../shaders/core/depth_single.wgsl"),
        include_str!("../../../shaders/core/distance.wgsl"),
    ],
    entries: &[Entry {
        name: "distance",
        workgroup: [8, 8, 1],
        bindings: &[bind(0, Uniform), bind(1, Texture), bind(2, WriteR32Float)],
    }],
};

/// The same of several samples a pixel.
pub const DISTANCE_MULTISAMPLED: Module = Module {
    name: "core/distance-multisampled",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::DEPTH,
        include_str!("../../../shaders/core/depth_multisampled.wgsl"),
        include_str!("../../../shaders/core/distance.wgsl"),
    ],
    entries: &[Entry {
        name: "distance",
        workgroup: [8, 8, 1],
        bindings: &[bind(0, Uniform), bind(1, TextureMultisampled), bind(2, WriteR32Float)],
    }],
};

macro_rules! march {
    ($name:literal, $output:expr, $write:ident) => {
        Module {
            name: $name,
            files: &[
                core::NUMBER,
                core::FRAME,
                core::DEPTH,
                core::MAPS,
                core::PHASE,
                core::SUN,
                core::LAMP,
                core::ANGLE,
                core::GLASS,
                core::DISTANCE,
                $output,
                core::OUTPUT,
                include_str!("../../../shaders/raymarch-ref/visibility.wgsl"),
                include_str!("../../../shaders/raymarch-ref/march.wgsl"),
            ],
            entries: &[Entry {
                name: "march",
                workgroup: [8, 8, 1],
                bindings: &[
                    bind(0, Uniform),
                    bind(3, Texture),
                    bind(4, TextureArray),
                    bind(5, Texture),
                    bind(6, $write),
                    bind(7, $write),
                ],
            }],
        }
    };
}

/// The marcher, into rgba16float.
pub const MARCH_HALF: Module = march!("raymarch/march-half", core::OUTPUT_HALF, WriteRgba16Float);
/// The marcher, into rgba32float.
pub const MARCH_FLOAT: Module = march!("raymarch/march-float", core::OUTPUT_FLOAT, WriteRgba32Float);

const COMPOSITE_BINDINGS: &[Binding] =
    &[bind(0, Uniform), bind(3, Texture), bind(8, Texture), bind(9, Texture)];

/// The image over the engine's picture.
pub const COMPOSITE: Module = Module {
    name: "core/composite",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::PHASE,
        core::DISTANCE,
        include_str!("../../../shaders/core/composite.wgsl"),
    ],
    entries: &[
        Entry { name: "composite_vertex", workgroup: [0; 3], bindings: &[bind(0, Uniform)] },
        Entry { name: "composite_grey", workgroup: [0; 3], bindings: COMPOSITE_BINDINGS },
        Entry { name: "composite_through", workgroup: [0; 3], bindings: COMPOSITE_BINDINGS },
        Entry { name: "composite_light", workgroup: [0; 3], bindings: COMPOSITE_BINDINGS },
    ],
};
