//! Where a pass draws: the depth image, kept for the next map of the same size, and its way back to the host.

use std::sync::Arc;

use ash::vk;

use super::cards::Cards;
use super::device::Device;
use super::error::RasterError;
use super::memory::{Buffer, DEPTH_RANGE, DepthImage};
use super::mesh::Mesh;
use super::pass::DepthPass;
use super::pipeline::Pipelines;

/// A depth image with the buffer that its rows come back through.
pub(super) struct Target {
    image: DepthImage,
    staging: Buffer,
    /// Rows that the staging buffer holds.
    strip_rows: u32,
}

/// Bytes of the staging buffer: 64 MiB hold a 4096² map at once; larger ones come back strip by strip, so that a map
/// needs its own memory once and not twice.
const STRIP_BYTES: u64 = 64 << 20;

impl Target {
    /// A target for passes of this size, ≥ 1 a side.
    pub fn new(device: &Arc<Device>, size: [u32; 2]) -> Result<Self, RasterError> {
        let [width, height] = size;
        let limit = device.largest_map;
        if width > limit || height > limit {
            return Err(RasterError::TooLarge { width, height, limit });
        }
        let row = u64::from(width) * size_of::<f32>() as u64;
        let strip_rows = (STRIP_BYTES / row).clamp(1, u64::from(height)) as u32;
        let staging = Buffer::on_host(device, "reading a depth map back", row * u64::from(strip_rows))?;
        let image = DepthImage::new(device, size)?;
        Ok(Self { image, staging, strip_rows })
    }

    /// Whether the pass can be drawn here.
    pub fn fits(&self, pass: &DepthPass) -> bool {
        self.image.size == pass.size
    }

    /// Draws the pass and fills `out`, `[row][column]`, with decoded depths. `out` has the pass's size.
    pub fn render(
        &mut self,
        device: &Device,
        pipelines: &Pipelines,
        mesh: (&Mesh, Option<&Cards>),
        pass: &DepthPass,
        out: &mut [f32],
    ) -> Result<(), RasterError> {
        let [width, height] = pass.size;
        let strip = self.strip_rows as usize * width as usize;
        for (index, out) in out.chunks_mut(strip).enumerate() {
            let first_row = index as u32 * self.strip_rows;
            let rows = self.strip_rows.min(height - first_row);
            device.run(|raw, commands| {
                if index == 0 {
                    self.draw(raw, commands, pipelines, mesh, pass);
                }
                self.copy_rows(raw, commands, first_row, rows);
            })?;
            let stored: &[f32] = bytemuck::cast_slice(self.staging.bytes());
            pass.store.decode(&stored[..out.len()], out);
        }
        Ok(())
    }

    fn draw(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        pipelines: &Pipelines,
        (mesh, cards): (&Mesh, Option<&Cards>),
        pass: &DepthPass,
    ) {
        let [width, height] = self.image.size;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let clear = vk::ClearValue {
            depth_stencil: vk::ClearDepthStencilValue { depth: pass.store.cleared(), stencil: 0 },
        };
        let depth = vk::RenderingAttachmentInfo::default()
            .image_view(self.image.view)
            .image_layout(vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(clear);
        let rendering =
            vk::RenderingInfo::default().render_area(area).layer_count(1).depth_attachment(&depth);
        // Row 0 of the image is Vulkan's y = −1.
        let viewports = [vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        let compare = if pass.store.is_reversed() { vk::CompareOp::GREATER } else { vk::CompareOp::LESS };
        // What an earlier pass left is overwritten, once its copy is done.
        let before = self.barrier(
            (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED),
            DRAWN,
        );
        let after = self.barrier(
            DRAWN,
            (
                vk::PipelineStageFlags2::COPY,
                vk::AccessFlags2::TRANSFER_READ,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            ),
        );
        let (before, after) = ([before], [after]);
        // SAFETY: the command buffer is recording; image, pipelines, mesh and cut-outs belong to this device and outlive the
        // submission, which `Device::run` waits for; the index counts lie within the mesh's index buffer, and its
        // indices within its vertex buffer; a cut-out's words are those of its mask.
        unsafe {
            let dependency = vk::DependencyInfo::default().image_memory_barriers(&before);
            device.cmd_pipeline_barrier2(commands, &dependency);
            device.cmd_begin_rendering(commands, &rendering);
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, pipelines.get(pass.clamp));
            device.cmd_set_viewport(commands, 0, &viewports);
            device.cmd_set_scissor(commands, 0, &[area]);
            device.cmd_set_depth_compare_op(commands, compare);
            let block = bytemuck::bytes_of(&pass.block);
            device.cmd_push_constants(commands, pipelines.layout, vk::ShaderStageFlags::VERTEX, 0, block);
            if let Some((vertices, indices)) = mesh.buffers() {
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices], &[0]);
                device.cmd_bind_index_buffer(commands, indices, 0, vk::IndexType::UINT32);
                for [first, count] in mesh.draws() {
                    device.cmd_draw_indexed(commands, count, 1, first, 0, 0);
                }
            }
            if let Some(cards) = cards {
                let (vertices, count) = cards.vertices();
                let (graphics, pipeline) = (vk::PipelineBindPoint::GRAPHICS, pipelines.for_cards(pass.clamp));
                device.cmd_bind_pipeline(commands, graphics, pipeline);
                device.cmd_bind_descriptor_sets(commands, graphics, pipelines.layout, 0, &[cards.set()], &[]);
                device.cmd_bind_vertex_buffers(commands, 0, &[vertices], &[0]);
                device.cmd_draw(commands, count, 1, 0, 0);
            }
            device.cmd_end_rendering(commands);
            let dependency = vk::DependencyInfo::default().image_memory_barriers(&after);
            device.cmd_pipeline_barrier2(commands, &dependency);
        }
    }

    fn copy_rows(&self, device: &ash::Device, commands: vk::CommandBuffer, first: u32, count: u32) {
        let regions = [vk::BufferImageCopy::default()
            .image_subresource(DEPTH_LAYER)
            .image_offset(vk::Offset3D { x: 0, y: first as i32, z: 0 })
            .image_extent(vk::Extent3D { width: self.image.size[0], height: count, depth: 1 })];
        let visible = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: the command buffer is recording; the image has this layout since `draw`; the rows lie within the
        // image, and fit the staging buffer.
        unsafe {
            device.cmd_copy_image_to_buffer(commands, self.image.raw, layout, self.staging.raw, &regions);
            let dependency = vk::DependencyInfo::default().memory_barriers(&visible);
            device.cmd_pipeline_barrier2(commands, &dependency);
        }
    }

    fn barrier(&self, from: Use, to: Use) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .image(self.image.raw)
            .subresource_range(DEPTH_RANGE)
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .old_layout(from.2)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)
            .new_layout(to.2)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
    }
}

/// All that the image has.
const DEPTH_LAYER: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::DEPTH,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// Stages, accesses and layout of one use of the image.
type Use = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// The depth test's use.
const DRAWN: Use = (
    vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw()
            | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
    ),
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
            | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
    ),
    vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
);
