//! A scene's triangles on the device: uploaded once, drawn by every pass.

use std::sync::Arc;

use ash::vk;

use super::device::Device;
use super::error::RasterError;
use super::memory::Buffer;
use super::pass::split;
use super::pipeline::Vertex;
use crate::caster::SceneCaster;

/// Vertex and index buffer; neither for a scene without triangles.
pub(super) struct Mesh {
    buffers: Option<(Buffer, Buffer)>,
    index_count: u64,
}

/// Bytes that are copied to the device at once.
const UPLOAD_BYTES: usize = 16 << 20;
/// Indices of one draw call: a multiple of 3 that any driver takes.
const INDICES_A_DRAW: u64 = 3 << 24;

impl Mesh {
    /// Uploads the caster's welded triangles, relative to its centre; without those that are cut out.
    pub fn new(device: &Arc<Device>, caster: &SceneCaster) -> Result<Self, RasterError> {
        let (positions, triangles) = caster.welded();
        let opaque: Vec<[u32; 3]>;
        let triangles = if caster.cards().is_empty() {
            triangles
        } else {
            let all = (0..).zip(triangles);
            opaque = all.filter(|(index, _)| caster.cards().get(*index).is_none()).map(|(_, t)| *t).collect();
            &opaque
        };
        if triangles.is_empty() {
            return Ok(Self { buffers: None, index_count: 0 });
        }
        if positions.len() as u64 > u64::from(device.largest_index) {
            let (vertices, limit) = (positions.len(), device.largest_index);
            return Err(RasterError::SceneTooLarge { vertices, limit });
        }
        let centre = caster.bvh().centre;
        let vertex = |p: &glam::DVec3| {
            let [high, low] = split(*p - centre);
            Vertex { high, low }
        };
        let vertices = upload(
            device,
            "the scene's vertices",
            vk::BufferUsageFlags::VERTEX_BUFFER,
            positions.len(),
            |start, out: &mut [Vertex]| {
                for (out, p) in out.iter_mut().zip(&positions[start..]) {
                    *out = vertex(p);
                }
            },
        )?;
        let indices = upload(
            device,
            "the scene's triangles",
            vk::BufferUsageFlags::INDEX_BUFFER,
            triangles.len(),
            |start, out: &mut [[u32; 3]]| out.copy_from_slice(&triangles[start..][..out.len()]),
        )?;
        Ok(Self { buffers: Some((vertices, indices)), index_count: 3 * triangles.len() as u64 })
    }

    /// Vertex and index buffer.
    pub fn buffers(&self) -> Option<(vk::Buffer, vk::Buffer)> {
        self.buffers.as_ref().map(|(vertices, indices)| (vertices.raw, indices.raw))
    }

    /// `[first index, index count]` of each draw call.
    pub fn draws(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let starts = (0..self.index_count).step_by(INDICES_A_DRAW as usize);
        // At most 3·2³⁰ indices: the caster takes 2³⁰ triangles.
        starts.map(|first| [first as u32, (self.index_count - first).min(INDICES_A_DRAW) as u32])
    }

    /// Bytes on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.buffers.as_ref().map_or(0, |(vertices, indices)| vertices.bytes + indices.bytes)
    }
}

/// A buffer of `count` items, filled piece by piece: `fill(index of the first, items)`.
pub(super) fn upload<T: bytemuck::Pod>(
    device: &Arc<Device>,
    what: &'static str,
    usage: vk::BufferUsageFlags,
    count: usize,
    fill: impl Fn(usize, &mut [T]),
) -> Result<Buffer, RasterError> {
    let item = size_of::<T>();
    let buffer = Buffer::on_device(device, what, (count * item) as u64, usage)?;
    let piece = (UPLOAD_BYTES / item).clamp(1, count);
    let mut staging = Buffer::on_host(device, what, (piece * item) as u64)?;
    for start in (0..count).step_by(piece) {
        let items = piece.min(count - start);
        let bytes = items * item;
        fill(start, bytemuck::cast_slice_mut(&mut staging.bytes_mut()[..bytes]));
        device.run(|raw, commands| {
            let regions = [vk::BufferCopy::default().dst_offset((start * item) as u64).size(bytes as u64)];
            let readable = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COPY)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(
                    vk::PipelineStageFlags2::VERTEX_INPUT | vk::PipelineStageFlags2::FRAGMENT_SHADER,
                )
                .dst_access_mask(
                    vk::AccessFlags2::VERTEX_ATTRIBUTE_READ
                        | vk::AccessFlags2::INDEX_READ
                        | vk::AccessFlags2::SHADER_STORAGE_READ,
                )];
            let dependency = vk::DependencyInfo::default().memory_barriers(&readable);
            // SAFETY: the command buffer is recording; both buffers live until `run` returns and hold the regions.
            unsafe {
                raw.cmd_copy_buffer(commands, staging.raw, buffer.raw, &regions);
                raw.cmd_pipeline_barrier2(commands, &dependency);
            }
        })?;
    }
    Ok(buffer)
}
