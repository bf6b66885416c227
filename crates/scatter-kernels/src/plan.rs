//! What a technique dispatches: passes and the storage buffers that they share. A GPU crate of any API follows it.
//!
//! Bindings have one meaning in all modules: 0 frame, 1 depth texture, 2 distances (written), 3 distances, 4 maps, 5 glass, 6 and
//! 7 image and transmittance, 9 a technique's own uniform. Storage buffers are a technique's own, with numbers that its passes share.

use crate::epipolar::{self, EpipolarPlan, EpipolarUniform};
use crate::minmax::{self, MinMaxPlan};
use crate::modules::{self, Entry, Module};

/// WebGPU's guaranteed size of a storage buffer's binding \[bytes\].
pub const MOST_BINDING_BYTES: u64 = 128 << 20;
/// WebGPU's guaranteed side of a 2D texture \[texels\], and workgroups a dimension.
pub const MOST_SIDE: u32 = 8192;
const MOST_GROUPS: u32 = 65_535;

/// One dispatch.
#[derive(Debug, Clone, Copy)]
pub struct Pass {
    /// Its name in reports.
    pub name: &'static str,
    /// Its shader.
    pub module: &'static Module,
    /// Its entry.
    pub entry: &'static Entry,
    /// Workgroups in x, y, z.
    pub groups: [u32; 3],
    /// Texel loads, counted; 0 where they depend on the scene.
    pub loads: u64,
    /// Atomic additions to storage: one an answer of a slice, channel and pixel. Those of counters are left out.
    pub atomics: u64,
    /// Which of several uniforms that follow each other in a technique's own (binding 9) it reads.
    pub batch: u32,
}

/// A storage buffer of a technique's own.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanBuffer {
    /// Its binding.
    pub binding: u32,
    /// What it holds, for messages.
    pub name: &'static str,
    /// Its size.
    pub bytes: u64,
    /// What it starts with; `None`: whatever was there, written before it is read.
    pub content: Option<Vec<u8>>,
}

/// A frame's dispatches, in order.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// The passes.
    pub passes: Vec<Pass>,
    /// The buffers.
    pub buffers: Vec<PlanBuffer>,
}

/// A resource that WebGPU's guaranteed limits do not hold.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} needs {needed} {unit}, and at most {limit} are possible; {cure}")]
pub struct TooLarge {
    /// Which.
    pub what: &'static str,
    /// Its size.
    pub needed: u64,
    /// In bytes, texels, pixels or workgroups.
    pub unit: &'static str,
    /// What WebGPU guarantees.
    pub limit: u64,
    /// What to do.
    pub cure: &'static str,
}

impl Plan {
    /// The marcher: `size` of the camera, `scale` 1, 2 or 4, `samples` of the depth texture, `steps` a ray, `float` the image's
    /// format.
    pub fn march(size: [u32; 2], scale: u32, samples: u32, steps: u32, float: bool) -> Self {
        let image = size.map(|side| side.div_ceil(scale));
        let module: &'static Module = if float { &modules::MARCH_FLOAT } else { &modules::MARCH_HALF };
        let loads = u64::from(image[0]) * u64::from(image[1]) * u64::from(steps);
        let march = Pass {
            name: "march",
            module,
            entry: &module.entries[0],
            groups: tiles(image),
            loads,
            atomics: 0,
            batch: 0,
        };
        Self { passes: vec![Self::distance(size, samples), march], buffers: Vec::new() }
    }

    /// Exact min/max of a planned frame; of the traversal's loads none are counted, which depend on the scene.
    pub fn min_max(frame: &MinMaxPlan, size: [u32; 2], scale: u32, samples: u32, float: bool) -> Self {
        let looks = frame.looks();
        let pass = |name, module: &'static Module, groups, loads| Pass {
            name,
            module,
            entry: &module.entries[0],
            groups,
            loads,
            atomics: 0,
            batch: 0,
        };
        let [low, high] = minmax::EXTREMA;
        let traverse: &'static Module = if float { &minmax::TRAVERSE_FLOAT } else { &minmax::TRAVERSE_HALF };
        let mut passes = vec![Self::distance(size, samples)];
        if !frame.layers().is_empty() {
            passes.push(pass("extrema_low", low, frame.extrema_low(), looks.texel_loads));
            passes.push(pass("extrema_high", high, frame.extrema_high(), 0));
        }
        passes.push(pass("traverse", traverse, tiles(size.map(|side| side.div_ceil(scale))), 0));
        let buffer = |binding, name, bytes| PlanBuffer { binding, name, bytes, content: None };
        let buffers = vec![
            buffer(1, "the layers of the min/max trees", frame.layer_bytes()),
            buffer(2, "the nodes of the min/max trees", frame.node_bytes()),
            buffer(8, "the counters", 16),
        ];
        Self { passes, buffers }
    }

    /// `epipolar` of a planned frame: rows and sums of each batch of slices, one after the other. Passes and buffers are those of any
    /// frame of the size; batches that the frame does not have are passes without workgroups. Of a row's texel columns one load is
    /// counted, of which those that cross a border take two. Loads and atomics of all batches stand with the first.
    pub fn epipolar(frame: &EpipolarPlan, size: [u32; 2], scale: u32, samples: u32, float: bool) -> Self {
        let pass = |name, module: &'static Module, groups, loads, batch| Pass {
            name,
            module,
            entry: &module.entries[0],
            groups,
            loads,
            atomics: 0,
            batch,
        };
        let mut passes = vec![Self::distance(size, samples)];
        let room = frame.room();
        for batch in 0..room.batches as u32 {
            let [rows, sums] = frame.groups(batch as usize);
            let columns = if batch == 0 { frame.counts().texel_columns } else { 0 };
            passes.push(pass("rows", &epipolar::ROWS, rows, columns, batch));
            let (name, module): (_, &'static Module) =
                if frame.has_fog() { ("edges", &epipolar::EDGES) } else { ("sums", &epipolar::SUMS) };
            let atomics = if batch == 0 { frame.counts().answer_atomics } else { 0 };
            passes.push(Pass { atomics, ..pass(name, module, sums, 0, batch) });
        }
        let resolve: &'static Module = if float { &epipolar::RESOLVE_FLOAT } else { &epipolar::RESOLVE_HALF };
        passes.push(pass("resolve", resolve, tiles(size.map(|side| side.div_ceil(scale))), 0, 0));
        let buffer = |binding, name, bytes| PlanBuffer { binding, name, bytes, content: None };
        let mut buffers = vec![
            buffer(8, "the counters", 16),
            buffer(epipolar::UNIFORM, "the uniforms of the batches of slices", room.uniforms),
            buffer(16, "the answers of the slices", room.answers),
        ];
        if frame.has_slices() {
            buffers.extend([
                buffer(10, "the slices of the image", room.slices),
                buffer(11, "the lines of the slices", room.lines),
                buffer(12, "the rows of a batch of slices", room.rows),
                buffer(13, "the tasks of the slices", room.tasks),
                buffer(14, "the pixels of the fans", room.ranges),
                buffer(15, "the tables of the factors", room.nodes),
            ]);
        }
        Self { passes, buffers }
    }

    /// Bytes from one uniform of a technique's own to the next.
    pub const UNIFORM_STRIDE: u64 = size_of::<EpipolarUniform>() as u64;

    /// The first pass of every technique.
    pub fn distance(size: [u32; 2], samples: u32) -> Pass {
        let module: &'static Module =
            if samples > 1 { &modules::DISTANCE_MULTISAMPLED } else { &modules::DISTANCE };
        let loads = u64::from(size[0]) * u64::from(size[1]) * u64::from(samples);
        Pass {
            name: "distance",
            module,
            entry: &module.entries[0],
            groups: tiles(size),
            loads,
            atomics: 0,
            batch: 0,
        }
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().map(|buffer| buffer.bytes).sum()
    }

    /// Workgroups of all passes.
    pub fn workgroups(&self) -> u64 {
        self.passes.iter().map(|pass| pass.groups.iter().map(|&n| u64::from(n)).product::<u64>()).sum()
    }

    /// What WebGPU's guaranteed limits do not hold, if anything.
    pub fn check(&self) -> Result<(), TooLarge> {
        for buffer in &self.buffers {
            if buffer.bytes > MOST_BINDING_BYTES {
                return Err(TooLarge {
                    what: buffer.name,
                    needed: buffer.bytes,
                    unit: "bytes",
                    limit: MOST_BINDING_BYTES,
                    cure: "give a smaller image, a larger scale, or smaller maps",
                });
            }
        }
        for pass in &self.passes {
            if let Some(&groups) = pass.groups.iter().find(|&&groups| groups > MOST_GROUPS) {
                return Err(TooLarge {
                    what: pass.name,
                    needed: groups.into(),
                    unit: "workgroups",
                    limit: MOST_GROUPS.into(),
                    cure: "give a smaller image",
                });
            }
        }
        Ok(())
    }
}

/// Workgroups of 8 × 8 that cover an image.
pub fn tiles(size: [u32; 2]) -> [u32; 3] {
    [size[0].div_ceil(8), size[1].div_ceil(8), 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_plan_of_the_marcher_leaves_webgpus_limits_up_to_4k() {
        for size in [[1, 1], [160, 120], [1920, 1080], [3840, 2160], [8192, 8192]] {
            for scale in [1, 2, 4] {
                let plan = Plan::march(size, scale, 4, 64, true);
                plan.check().unwrap();
                println!("{size:?} / {scale}: {} workgroups, {} bytes", plan.workgroups(), plan.bytes());
            }
        }
        let mut plan = Plan::march([8, 8], 1, 1, 1, true);
        plan.buffers.push(PlanBuffer {
            binding: 10,
            name: "rows",
            bytes: MOST_BINDING_BYTES + 1,
            content: None,
        });
        assert!(plan.check().unwrap_err().to_string().contains("rows needs 134217729"));
    }
}
