//! What an engine has before it has shafts: triangles, a depth buffer, four cascades, a picture in linear HDR.

use glam::DVec3;
use scatter_gpu::wgpu;
use scatter_scene::Shot;

use crate::matrices::{CASCADES, Matrices};

/// The picture's format.
pub const HDR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Of the depth buffer and the cascades.
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Bytes from one view's uniform to the next.
const STRIDE: u64 = 256;

/// A shot's triangles on the GPU, and what they are drawn into.
pub struct World {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    uniforms: wgpu::Buffer,
    group: wgpu::BindGroup,
    shadow_pipeline: wgpu::RenderPipeline,
    opaque_pipeline: wgpu::RenderPipeline,
    layers: Vec<wgpu::TextureView>,
    depth_view: wgpu::TextureView,
    /// The camera's depth buffer: reversed z.
    pub depth: wgpu::Texture,
    /// The cascades, a layer each: reversed z.
    pub cascades: wgpu::Texture,
    /// The picture.
    pub hdr_view: wgpu::TextureView,
}

impl World {
    /// Uploads the triangles; images of the camera's size, cascades of `map`² texels.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, shot: &Shot, map: u32) -> Self {
        let positions: Vec<[f32; 3]> = shot.scene.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        let upload = |bytes: &[u8], usage| {
            let buffer = buffer(device, bytes.len().max(4) as u64, usage);
            queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let uniforms = buffer(device, STRIDE * (CASCADES as u64 + 1), wgpu::BufferUsages::UNIFORM);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &uniforms,
                    offset: 0,
                    size: wgpu::BufferSize::new(80),
                }),
            }],
        });
        let depth = target(device, shot.camera.size(), 1, DEPTH);
        let cascades = target(device, [map; 2], CASCADES as u32, DEPTH);
        let hdr_view = target(device, shot.camera.size(), 1, HDR).create_view(&Default::default());
        let layers = (0..CASCADES as u32).map(|layer| {
            cascades.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        });
        Self {
            vertices: upload(bytemuck::cast_slice(&positions), wgpu::BufferUsages::VERTEX),
            indices: upload(bytemuck::cast_slice(&shot.scene.triangles), wgpu::BufferUsages::INDEX),
            index_count: 3 * shot.scene.triangles.len() as u32,
            uniforms,
            group,
            shadow_pipeline: pipeline(device, &layout, None),
            opaque_pipeline: pipeline(device, &layout, Some(HDR)),
            layers: layers.collect(),
            depth_view: depth.create_view(&Default::default()),
            depth,
            cascades,
            hdr_view,
        }
    }

    /// Draws the cascades, then depth and picture.
    pub fn draw(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        matrices: &Matrices,
        sun: DVec3,
    ) {
        let views = [matrices.clip_from_view * matrices.view_from_world];
        for (index, matrix) in views.into_iter().chain(matrices.cascades).enumerate() {
            let mut seen = [0.0; 20];
            seen[..16].copy_from_slice(&matrix.as_mat4().to_cols_array());
            seen[16..19].copy_from_slice(&sun.as_vec3().to_array());
            queue.write_buffer(&self.uniforms, STRIDE * index as u64, bytemuck::cast_slice(&seen));
        }
        for (index, layer) in self.layers.iter().enumerate() {
            self.pass(encoder, &self.shadow_pipeline, None, layer, index + 1);
        }
        self.pass(encoder, &self.opaque_pipeline, Some(&self.hdr_view), &self.depth_view, 0);
    }

    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        colour: Option<&wgpu::TextureView>,
        depth: &wgpu::TextureView,
        view: usize,
    ) {
        let attachment = colour.map(|view| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r: 0.05, g: 0.08, b: 0.13, a: 1.0 }),
                store: wgpu::StoreOp::Store,
            },
        });
        let attachments = [attachment];
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("engine"),
            color_attachments: if colour.is_some() { &attachments } else { &[] },
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                // Reversed: 0 is infinitely far.
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.group, &[(STRIDE * view as u64) as u32]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..1);
    }
}

fn pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    colour: Option<wgpu::TextureFormat>,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("engine"),
        source: wgpu::ShaderSource::Wgsl(include_str!("opaque.wgsl").into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let attributes = wgpu::vertex_attr_array![0 => Float32x3];
    let targets = [colour.map(wgpu::ColorTargetState::from)];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("engine"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &attributes,
            })],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: colour.is_some().then(|| wgpu::FragmentState {
            module: &module,
            entry_point: Some("opaque"),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn buffer(device: &wgpu::Device, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// What is drawn into, read by shaders, and copied from.
pub fn target(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    layers: u32,
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}
