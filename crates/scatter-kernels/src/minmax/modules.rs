//! The shader modules of exact min/max: extrema of blocks, and the traversal with the image as halves or as floats.

use crate::modules::BindingKind::{
    Storage, StorageReadWrite, Texture, TextureArray, Uniform, WriteRgba16Float, WriteRgba32Float,
};
use crate::modules::{Binding, BindingKind, Entry, Module, bind, core};

const LAYERS: &str = include_str!("../../../../shaders/minmax-mipmap/tree_layers.wgsl");
const TRAVERSAL: &str = include_str!("../../../../shaders/minmax-mipmap/traverse.wgsl");

/// Binding of the trees' layers.
const TREE_LAYERS: Binding = bind(1, Storage);

/// Levels 2 to 6 of the trees.
const EXTREMA_LOW: Module = Module {
    name: "minmax-mipmap/extrema-low",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::DEPTH,
        core::MAPS,
        LAYERS,
        include_str!("../../../../shaders/minmax-mipmap/extrema_low.wgsl"),
    ],
    entries: &[Entry {
        name: "extrema_low",
        workgroup: [16, 16, 1],
        bindings: &[bind(0, Uniform), TREE_LAYERS, bind(2, StorageReadWrite), bind(4, TextureArray)],
    }],
};

/// The levels above.
const EXTREMA_HIGH: Module = Module {
    name: "minmax-mipmap/extrema-high",
    files: &[LAYERS, include_str!("../../../../shaders/minmax-mipmap/extrema_high.wgsl")],
    entries: &[Entry {
        name: "extrema_high",
        workgroup: [256, 1, 1],
        bindings: &[TREE_LAYERS, bind(2, StorageReadWrite)],
    }],
};

/// The two passes that make the trees, in order.
pub const EXTREMA: [&Module; 2] = [&EXTREMA_LOW, &EXTREMA_HIGH];

const fn traversal_bindings(output: BindingKind) -> [Binding; 9] {
    [
        bind(0, Uniform),
        TREE_LAYERS,
        bind(2, Storage),
        bind(3, Texture),
        bind(4, TextureArray),
        bind(5, Texture),
        bind(6, output),
        bind(7, output),
        bind(8, StorageReadWrite),
    ]
}

macro_rules! traversal {
    ($name:literal, $output:expr, $kind:expr) => {
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
                core::GLASS,
                core::DISTANCE,
                core::OUTPUT,
                $output,
                LAYERS,
                TRAVERSAL,
            ],
            entries: &[Entry {
                name: "traverse",
                workgroup: [8, 8, 1],
                bindings: &const { traversal_bindings($kind) },
            }],
        }
    };
}

/// The traversal that writes an image of rgba16float.
pub const TRAVERSE_HALF: Module = traversal!("minmax-mipmap/traverse", core::OUTPUT_HALF, WriteRgba16Float);

/// The same as rgba32float.
pub const TRAVERSE_FLOAT: Module =
    traversal!("minmax-mipmap/traverse-float", core::OUTPUT_FLOAT, WriteRgba32Float);

/// All of them.
pub const MODULES: [&Module; 4] = [EXTREMA[0], EXTREMA[1], &TRAVERSE_HALF, &TRAVERSE_FLOAT];
