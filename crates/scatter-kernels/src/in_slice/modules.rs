//! The shader modules of in-slice sums.

use crate::modules::BindingKind::{Storage, StorageReadWrite};
use crate::modules::{Binding, Entry, Module, bind};

const IN_SLICE: &str = include_str!("../../../../shaders/epipolar/in_slice.wgsl");

/// The dual sweep: 13,488 bytes of workgroup memory.
pub const SUMS: Module = Module {
    name: "epipolar/sums",
    files: &[IN_SLICE, include_str!("../../../../shaders/epipolar/sums.wgsl")],
    entries: &[Entry {
        name: "sums",
        workgroup: [256, 1, 1],
        bindings: &[
            bind(10, Storage),
            bind(11, Storage),
            bind(12, Storage),
            bind(13, Storage),
            bind(14, Storage),
            bind(15, StorageReadWrite),
        ],
    }],
};

const DIRECT_BINDINGS: &[Binding] =
    &[bind(10, Storage), bind(11, Storage), bind(12, Storage), bind(13, Storage), bind(15, StorageReadWrite)];

/// Every run before each ask's end: the reference of [`SUMS`].
pub const DIRECT: Module = Module {
    name: "epipolar/direct",
    files: &[IN_SLICE, include_str!("../../../../shaders/epipolar/direct.wgsl")],
    entries: &[Entry { name: "direct", workgroup: [256, 1, 1], bindings: DIRECT_BINDINGS }],
};

/// Both.
pub static MODULES: [&Module; 2] = [&SUMS, &DIRECT];
