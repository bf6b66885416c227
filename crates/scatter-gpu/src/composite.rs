//! The image over the engine's picture: one full-screen triangle, two where the extinction is coloured.

use std::sync::{Mutex, PoisonError};

use scatter_kernels::modules::COMPOSITE;

use crate::gpu::Gpu;

/// Pipelines a target format, a bind group.
#[derive(Debug)]
pub(crate) struct Composite {
    layout: wgpu::BindGroupLayout,
    group: Option<wgpu::BindGroup>,
    pipelines: Mutex<Vec<(wgpu::TextureFormat, Pipelines)>>,
}

#[derive(Debug, Clone)]
struct Pipelines {
    grey: wgpu::RenderPipeline,
    through: wgpu::RenderPipeline,
    light: wgpu::RenderPipeline,
}

impl Composite {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let layout = gpu.group_layout(COMPOSITE.entries[1].bindings, wgpu::ShaderStages::VERTEX_FRAGMENT);
        Self { layout, group: None, pipelines: Mutex::default() }
    }

    pub(crate) fn bind(
        &mut self,
        gpu: &Gpu,
        uniform: &wgpu::Buffer,
        [distance, inscattered, transmittance]: [&wgpu::Texture; 3],
    ) {
        let [distance, inscattered, transmittance] =
            [distance, inscattered, transmittance].map(|image| image.create_view(&Default::default()));
        let entry = |binding, view| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(view),
        };
        self.group = Some(gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(gpu.label()),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                entry(3, &distance),
                entry(8, &inscattered),
                entry(9, &transmittance),
            ],
        }));
    }

    pub(crate) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (target, format, viewport): (&wgpu::TextureView, wgpu::TextureFormat, [u32; 4]),
        (full, grey): (bool, bool),
    ) {
        let pipelines = self.pipelines_for(gpu, format);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composite"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        let [x, y, width, height] = viewport.map(|n| n as f32);
        pass.set_viewport(x, y, width, height, 0.0, 1.0);
        pass.set_bind_group(0, self.group.as_ref(), &[]);
        let draws: &[&wgpu::RenderPipeline] = match (full, grey) {
            (true, true) => &[&pipelines.grey],
            (true, false) => &[&pipelines.through, &pipelines.light],
            (false, _) => &[&pipelines.light],
        };
        for pipeline in draws {
            pass.set_pipeline(pipeline);
            pass.draw(0..3, 0..1);
        }
    }

    fn pipelines_for(&self, gpu: &Gpu, format: wgpu::TextureFormat) -> Pipelines {
        let mut known = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, pipelines)) = known.iter().find(|(of, _)| *of == format) {
            return pipelines.clone();
        }
        let blend = |src_factor, dst_factor| wgpu::BlendState {
            color: wgpu::BlendComponent { src_factor, dst_factor, operation: wgpu::BlendOperation::Add },
            // The picture's own alpha stays.
            alpha: wgpu::BlendComponent {
                src_factor: wgpu::BlendFactor::Zero,
                dst_factor: wgpu::BlendFactor::One,
                operation: wgpu::BlendOperation::Add,
            },
        };
        let (zero, one) = (wgpu::BlendFactor::Zero, wgpu::BlendFactor::One);
        let made = Pipelines {
            grey: self.pipeline(gpu, format, "composite_grey", blend(one, wgpu::BlendFactor::SrcAlpha)),
            through: self.pipeline(gpu, format, "composite_through", blend(zero, wgpu::BlendFactor::Src)),
            light: self.pipeline(gpu, format, "composite_light", blend(one, one)),
        };
        known.push((format, made.clone()));
        made
    }

    fn pipeline(
        &self,
        gpu: &Gpu,
        format: wgpu::TextureFormat,
        entry: &str,
        blend: wgpu::BlendState,
    ) -> wgpu::RenderPipeline {
        let shader = gpu.shader(&COMPOSITE);
        gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(entry),
            layout: Some(&gpu.pipeline_layout(&self.layout)),
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: Some("composite_vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    blend: Some(blend),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: gpu.cache(),
        })
    }
}
