//! The depth-only pipelines: one vertex stage, two-sided, no bias; one clamps depth, the other clips it.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::device::Device;
use super::error::{RasterError, Tried as _};

/// A vertex: its place relative to the scene's centre is `high + low`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    /// The nearest f32.
    pub high: [f32; 3],
    /// What that leaves.
    pub low: [f32; 3],
}

/// What the vertex stage reads of a pass: `Pass` in `depth.wgsl`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PassBlock {
    /// Clip coordinates' rows, each to be dotted with (p − reference, 1).
    pub x: [f32; 4],
    pub y: [f32; 4],
    pub z: [f32; 4],
    pub w: [f32; 4],
    /// The reference point, relative to the scene's centre, as the vertices are.
    pub reference_high: [f32; 3],
    pub padding_0: f32,
    pub reference_low: [f32; 3],
    pub padding_1: f32,
}

pub(super) struct Pipelines {
    pub layout: vk::PipelineLayout,
    clamped: vk::Pipeline,
    clipped: vk::Pipeline,
    device: Arc<Device>,
}

/// SPIR-V of `depth.wgsl`'s vertex stage.
static DEPTH_SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/depth.spv"));

impl Pipelines {
    pub fn new(device: &Arc<Device>) -> Result<Self, RasterError> {
        let mut pipelines = Self {
            layout: vk::PipelineLayout::null(),
            clamped: vk::Pipeline::null(),
            clipped: vk::Pipeline::null(),
            device: device.clone(),
        };
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::VERTEX)
            .size(size_of::<PassBlock>() as u32)];
        let layout = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        // SAFETY: the device lives; 96 bytes are within the 128 that every device has.
        pipelines.layout =
            unsafe { device.raw.create_pipeline_layout(&layout, None) }.tried("create a pipeline layout")?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(DEPTH_SPIRV);
        let module = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a module that naga wrote and validated.
        let module =
            unsafe { device.raw.create_shader_module(&module, None) }.tried("create a shader module")?;
        let made = pipelines.create(module);
        // SAFETY: the module is not needed once the pipelines are there.
        unsafe { device.raw.destroy_shader_module(module, None) };
        made.map(|()| pipelines)
    }

    /// The pipeline that clamps depth to the map's range, or the one that clips what is outside of it.
    pub fn get(&self, clamp: bool) -> vk::Pipeline {
        if clamp { self.clamped } else { self.clipped }
    }

    fn create(&mut self, module: vk::ShaderModule) -> Result<(), RasterError> {
        self.clamped = self.one(module, true)?;
        self.clipped = self.one(module, false)?;
        Ok(())
    }

    fn one(&self, module: vk::ShaderModule, clamp: bool) -> Result<vk::Pipeline, RasterError> {
        let stages = [vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::VERTEX)
            .module(module)
            .name(c"vertex_main")];
        let bindings = [vk::VertexInputBindingDescription::default().stride(size_of::<Vertex>() as u32)];
        let attribute = |location: u32, offset: usize| {
            vk::VertexInputAttributeDescription::default()
                .location(location)
                .format(vk::Format::R32G32B32_SFLOAT)
                .offset(offset as u32)
        };
        let attributes = [
            attribute(0, std::mem::offset_of!(Vertex, high)),
            attribute(1, std::mem::offset_of!(Vertex, low)),
        ];
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .depth_clamp_enable(clamp)
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true);
        let dynamic = [
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            // Parallel maps keep the smallest depth, perspective ones the largest reciprocal.
            vk::DynamicState::DEPTH_COMPARE_OP,
        ];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().depth_attachment_format(vk::Format::D32_SFLOAT);
        let infos = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)];
        // SAFETY: all that the info points to lives on this stack; the layout and the module are the device's.
        let made =
            unsafe { self.device.raw.create_graphics_pipelines(vk::PipelineCache::null(), &infos, None) };
        let made = made.map_err(|(_, code)| code).tried("create the depth pipeline")?;
        Ok(made.first().copied().unwrap_or_default())
    }
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        // SAFETY: all three are its own, and every submission that used them was waited for; null handles are
        // ignored.
        unsafe {
            self.device.raw.destroy_pipeline(self.clamped, None);
            self.device.raw.destroy_pipeline(self.clipped, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;

    /// Offsets as naga lays the shader's structs out.
    static LAYOUT: &[(&str, usize)] = include!(concat!(env!("OUT_DIR"), "/depth_layout.rs"));

    #[test]
    fn the_shader_and_the_host_lay_out_a_pass_alike() {
        let host = [
            ("Pass.x", offset_of!(PassBlock, x)),
            ("Pass.y", offset_of!(PassBlock, y)),
            ("Pass.z", offset_of!(PassBlock, z)),
            ("Pass.w", offset_of!(PassBlock, w)),
            ("Pass.reference_high", offset_of!(PassBlock, reference_high)),
            ("Pass.reference_low", offset_of!(PassBlock, reference_low)),
            ("Pass", size_of::<PassBlock>()),
        ];
        assert_eq!(LAYOUT, host);
    }
}
