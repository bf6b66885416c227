//! Rung 1 of the ladder: the shaders' functions one by one, called on grids of inputs, against f64 on the CPU.

mod cases;

use std::sync::LazyLock;

use scatter_kernels::FrameUniform;
use scatter_kernels::modules::BindingKind::{Storage, StorageReadWrite, Uniform};
use scatter_kernels::modules::{Entry, MARCH_FLOAT, Module, bind};

use super::device::{Bound, HarnessDevice};
use cases::Case;

/// What was found of one function.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionCheck {
    /// Its name in WGSL, and where it matters of what.
    pub name: &'static str,
    /// How many inputs it was called for.
    pub inputs: usize,
    /// The largest error as a share of what is allowed at that input; above 1 the function is wrong.
    pub worst: f64,
    /// The input there.
    pub at: [f32; 4],
}

impl FunctionCheck {
    /// Whether every error is within what f32 and WGSL's promises allow.
    pub fn is_right(&self) -> bool {
        self.worst <= 1.0
    }
}

const ENTRIES: &[Entry] = &[Entry {
    name: "call",
    workgroup: [64, 1, 1],
    bindings: &[bind(0, Uniform), bind(1, Storage), bind(2, StorageReadWrite)],
}];

/// The functions' module: the marcher's files and an entry that calls one of them.
pub fn functions_module() -> &'static Module {
    static MODULE: LazyLock<Module> = LazyLock::new(|| {
        let calls = [include_str!("calls.wgsl")];
        let files: Vec<&'static str> = MARCH_FLOAT.files.iter().copied().chain(calls).collect();
        Module { name: "harness/functions", files: files.leak(), entries: ENTRIES }
    });
    &MODULE
}

/// Calls all functions of `module`: [`functions_module`], or a mutant of it.
pub fn check_functions(device: &HarnessDevice, module: &'static Module) -> Vec<FunctionCheck> {
    cases::all().iter().map(|case| checked(device, module, case)).collect()
}

fn checked(device: &HarnessDevice, module: &'static Module, case: &Case) -> FunctionCheck {
    let found = called(device, module, case.number, &case.uniform, &case.inputs);
    let mut check = FunctionCheck { name: case.name, inputs: case.inputs.len(), worst: 0.0, at: [0.0; 4] };
    for (&input, found) in case.inputs.iter().zip(&found) {
        let expected = (case.expected)(input);
        for (value, &found) in expected.iter().zip(found) {
            let off = (f64::from(found) - value.is).abs() / value.allowed;
            // A NaN is worse than any number.
            if !(off <= check.worst) {
                (check.worst, check.at) = (if off.is_nan() { f64::INFINITY } else { off }, input);
            }
        }
    }
    check
}

fn called(
    device: &HarnessDevice,
    module: &'static Module,
    number: u32,
    uniform: &FrameUniform,
    inputs: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let mut listed = vec![[number as f32, 0.0, 0.0, 0.0]];
    listed.extend(inputs);
    let zeros = vec![0u8; listed.len() * 16];
    let bound = [
        (0, Bound::Uniform(bytemuck::bytes_of(uniform))),
        (1, Bound::Storage(bytemuck::cast_slice(&listed))),
        (2, Bound::Storage(&zeros)),
    ];
    let groups = [(inputs.len() as u32).div_ceil(64), 1, 1];
    let read = device.run(module, 0, &bound, groups);
    bytemuck::pod_collect_to_vec(&read[1]).split_off(1)
}
