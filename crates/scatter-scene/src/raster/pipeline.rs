//! The depth-only pipelines: two-sided, no bias; one clamps depth, the other clips it. For cut-outs the same two, with a
//! fragment stage that discards.

use std::mem::offset_of;
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

/// A corner of a cut-out. Neighbours share places but not texture coordinates, so nothing is indexed.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CardVertex {
    /// Its place, as a [`Vertex`].
    pub high: [f32; 3],
    pub low: [f32; 3],
    /// Its place on the mask \[texels\], before wrapping.
    pub texel: [f32; 2],
    /// First word, columns, rows, wraps: `CardPoint.mask` in `depth.wgsl`.
    pub mask: [u32; 4],
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
    /// Of the masks' bits, for cut-outs.
    pub masks: vk::DescriptorSetLayout,
    opaque: Pair,
    /// Null handles for a scene without cut-outs.
    cards: Pair,
    device: Arc<Device>,
}

/// One pipeline that clamps depth to the map's range, and one that clips what is outside of it.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    clamped: vk::Pipeline,
    clipped: vk::Pipeline,
}

/// SPIR-V of all of `depth.wgsl`.
static DEPTH_SPIRV: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/depth.spv"));

impl Pipelines {
    /// The pipelines; those for cut-outs only where they are needed.
    pub fn new(device: &Arc<Device>, has_cards: bool) -> Result<Self, RasterError> {
        let mut pipelines = Self {
            layout: vk::PipelineLayout::null(),
            masks: vk::DescriptorSetLayout::null(),
            opaque: Pair::default(),
            cards: Pair::default(),
            device: device.clone(),
        };
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let masks = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device lives, and every device has storage buffers in its fragment stage.
        pipelines.masks = unsafe { device.raw.create_descriptor_set_layout(&masks, None) }
            .tried("create a descriptor set layout")?;
        let sets = [pipelines.masks];
        let ranges = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::VERTEX)
            .size(size_of::<PassBlock>() as u32)];
        let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&ranges);
        // SAFETY: the device lives; 96 bytes are within the 128 that every device has.
        pipelines.layout =
            unsafe { device.raw.create_pipeline_layout(&layout, None) }.tried("create a pipeline layout")?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(DEPTH_SPIRV);
        let module = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a module that naga wrote and validated.
        let module =
            unsafe { device.raw.create_shader_module(&module, None) }.tried("create a shader module")?;
        let made = pipelines.create(module, has_cards);
        // SAFETY: the module is not needed once the pipelines are there.
        unsafe { device.raw.destroy_shader_module(module, None) };
        made.map(|()| pipelines)
    }

    /// The pipeline that clamps depth to the map's range, or the one that clips what is outside of it.
    pub fn get(&self, clamp: bool) -> vk::Pipeline {
        self.opaque.get(clamp)
    }

    /// The same for cut-outs.
    pub fn for_cards(&self, clamp: bool) -> vk::Pipeline {
        self.cards.get(clamp)
    }

    fn create(&mut self, module: vk::ShaderModule, has_cards: bool) -> Result<(), RasterError> {
        self.opaque.clamped = self.one(module, true, false)?;
        self.opaque.clipped = self.one(module, false, false)?;
        if has_cards {
            self.cards.clamped = self.one(module, true, true)?;
            self.cards.clipped = self.one(module, false, true)?;
        }
        Ok(())
    }

    fn one(&self, module: vk::ShaderModule, clamp: bool, cards: bool) -> Result<vk::Pipeline, RasterError> {
        let stage = |stage: vk::ShaderStageFlags, name: &'static std::ffi::CStr| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(name)
        };
        let opaque_stages = [stage(vk::ShaderStageFlags::VERTEX, c"vertex_main")];
        let card_stages = [
            stage(vk::ShaderStageFlags::VERTEX, c"card_vertex"),
            stage(vk::ShaderStageFlags::FRAGMENT, c"card_fragment"),
        ];
        let stages: &[_] = if cards { &card_stages } else { &opaque_stages };
        let stride = if cards { size_of::<CardVertex>() } else { size_of::<Vertex>() };
        let bindings = [vk::VertexInputBindingDescription::default().stride(stride as u32)];
        let attribute = |location: u32, format: vk::Format, offset: usize| {
            vk::VertexInputAttributeDescription::default()
                .location(location)
                .format(format)
                .offset(offset as u32)
        };
        let place = vk::Format::R32G32B32_SFLOAT;
        let opaque_attributes =
            [attribute(0, place, offset_of!(Vertex, high)), attribute(1, place, offset_of!(Vertex, low))];
        let card_attributes = [
            attribute(0, place, offset_of!(CardVertex, high)),
            attribute(1, place, offset_of!(CardVertex, low)),
            attribute(2, vk::Format::R32G32_SFLOAT, offset_of!(CardVertex, texel)),
            attribute(3, vk::Format::R32G32B32A32_UINT, offset_of!(CardVertex, mask)),
        ];
        let attributes: &[_] = if cards { &card_attributes } else { &opaque_attributes };
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(attributes);
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
            .stages(stages)
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

impl Pair {
    fn get(self, clamp: bool) -> vk::Pipeline {
        if clamp { self.clamped } else { self.clipped }
    }
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        // SAFETY: all are its own, and every submission that used them was waited for; null handles are ignored.
        unsafe {
            for Pair { clamped, clipped } in [self.opaque, self.cards] {
                self.device.raw.destroy_pipeline(clamped, None);
                self.device.raw.destroy_pipeline(clipped, None);
            }
            self.device.raw.destroy_pipeline_layout(self.layout, None);
            self.device.raw.destroy_descriptor_set_layout(self.masks, None);
        }
    }
}

#[cfg(test)]
mod tests {
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
        // The structs between two stages have no layout of the host's.
        let shared: Vec<_> = LAYOUT.iter().filter(|(name, _)| !name.starts_with("CardPoint")).collect();
        assert_eq!(shared, host.iter().collect::<Vec<_>>());
    }
}
