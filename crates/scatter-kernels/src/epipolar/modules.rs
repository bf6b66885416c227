//! The shader modules of `epipolar`: rows, sums, and the way back to pixels.

use crate::modules::BindingKind::{
    Storage, StorageReadWrite, Texture, TextureArray, Uniform, WriteRgba16Float, WriteRgba32Float,
};
use crate::modules::{Binding, BindingKind, Entry, Module, bind, core};

const SLICES: &str = include_str!("../../../../shaders/epipolar/slices.wgsl");
const ASKS: &str = include_str!("../../../../shaders/epipolar/asks.wgsl");
const PREFIXES: &str = include_str!("../../../../shaders/epipolar/prefixes.wgsl");
const SUMS_TEXT: &str = include_str!("../../../../shaders/epipolar/sums.wgsl");

/// Every slice's light rays as runs that end at one view ray.
pub const ROWS: Module = Module {
    name: "epipolar/rows",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::DEPTH,
        core::MAPS,
        SLICES,
        include_str!("../../../../shaders/epipolar/rows.wgsl"),
    ],
    entries: &[Entry {
        name: "rows",
        workgroup: [256, 1, 1],
        bindings: &[
            bind(0, Uniform),
            bind(4, TextureArray),
            bind(8, StorageReadWrite),
            bind(9, Uniform),
            bind(10, Storage),
            bind(11, Storage),
            bind(12, StorageReadWrite),
        ],
    }],
};

const SUMS_BINDINGS: &[Binding] = &[
    bind(0, Uniform),
    bind(3, Texture),
    bind(9, Uniform),
    bind(10, Storage),
    bind(12, Storage),
    bind(13, Storage),
    bind(14, Storage),
    bind(15, Storage),
    bind(16, StorageReadWrite),
];

macro_rules! sums {
    ($name:literal, $($answer:literal),+) => {
        Module {
            name: $name,
            files: &[
                core::NUMBER,
                core::FRAME,
                core::DISTANCE,
                SLICES,
                ASKS,
                PREFIXES,
                SUMS_TEXT,
                $(include_str!(concat!("../../../../shaders/epipolar/", $answer))),+
            ],
            entries: &[Entry { name: "sums", workgroup: [256, 1, 1], bindings: SUMS_BINDINGS }],
        }
    };
}

/// The dual sweep, a workgroup a task; adds each pixel's share to its answer.
pub const SUMS: Module = sums!("epipolar/sums", "add_answer.wgsl", "answer_share.wgsl");

/// The same sweep that writes its integers: what is compared with [`super::sum_mirror`].
pub const SUMS_RAW: Module = sums!("epipolar/sums-raw", "answer_sums.wgsl");

/// In height fog: every view ray visits its runs.
pub const EDGES: Module = Module {
    name: "epipolar/edges",
    files: &[
        core::NUMBER,
        core::FRAME,
        core::SUN,
        core::DISTANCE,
        SLICES,
        ASKS,
        include_str!("../../../../shaders/epipolar/add_answer.wgsl"),
        include_str!("../../../../shaders/epipolar/edges.wgsl"),
    ],
    entries: &[Entry {
        name: "edges",
        workgroup: [256, 1, 1],
        bindings: &[
            bind(0, Uniform),
            bind(3, Texture),
            bind(9, Uniform),
            bind(10, Storage),
            bind(12, Storage),
            bind(13, Storage),
            bind(14, Storage),
            bind(16, StorageReadWrite),
        ],
    }],
};

const fn resolve_bindings(output: BindingKind) -> [Binding; 8] {
    [
        bind(0, Uniform),
        bind(3, Texture),
        bind(4, TextureArray),
        bind(6, output),
        bind(7, output),
        bind(8, StorageReadWrite),
        bind(9, Uniform),
        bind(16, StorageReadWrite),
    ]
}

macro_rules! resolve {
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
                core::DISTANCE,
                core::OUTPUT,
                $output,
                SLICES,
                include_str!("../../../../shaders/epipolar/walk.wgsl"),
                include_str!("../../../../shaders/epipolar/resolve.wgsl"),
            ],
            entries: &[Entry {
                name: "resolve",
                workgroup: [8, 8, 1],
                bindings: &const { resolve_bindings($kind) },
            }],
        }
    };
}

/// Answers to an image of rgba16float.
pub const RESOLVE_HALF: Module = resolve!("epipolar/resolve", core::OUTPUT_HALF, WriteRgba16Float);

/// The same as rgba32float.
pub const RESOLVE_FLOAT: Module = resolve!("epipolar/resolve-float", core::OUTPUT_FLOAT, WriteRgba32Float);

/// Those that render.
pub const MODULES: [&Module; 5] = [&ROWS, &SUMS, &EDGES, &RESOLVE_HALF, &RESOLVE_FLOAT];
