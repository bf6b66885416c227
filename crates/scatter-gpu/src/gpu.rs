//! A device and the pipelines made on it.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use scatter_kernels::modules::{Binding, BindingKind, Entry, MODULES, Module};

use crate::error::GpuError;

/// A device with its pipelines; cheap to clone.
#[derive(Clone, Debug)]
pub struct Gpu(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    device: wgpu::Device,
    label: String,
    cache: Option<wgpu::PipelineCache>,
    shaders: Mutex<HashMap<&'static str, wgpu::ShaderModule>>,
    pipelines: Mutex<HashMap<(&'static str, &'static str), Arc<Compute>>>,
}

/// How a [`Gpu`] is made.
#[derive(Debug, Clone, Default)]
pub struct GpuOptions<'a> {
    /// Where compiled pipelines are kept.
    pub cache: Option<&'a wgpu::PipelineCache>,
    /// Prefix of all labels.
    pub label: &'a str,
}

/// A compute pipeline with the layout of its group.
#[derive(Debug)]
pub(crate) struct Compute {
    pub pipeline: wgpu::ComputePipeline,
    pub group: wgpu::BindGroupLayout,
}

impl Gpu {
    /// Of a device that has at least what WebGPU guarantees; no feature is needed. Pipelines are made when they are first
    /// used, or by [`Self::warm_up`].
    pub fn new(device: &wgpu::Device, options: &GpuOptions<'_>) -> Result<Self, GpuError> {
        let (has, needed) = (device.limits(), wgpu::Limits::default());
        macro_rules! at_least {
            ($($name:ident),*) => {
                $(if has.$name < needed.$name {
                    return Err(GpuError::Limit {
                        name: stringify!($name),
                        needed: u64::from(needed.$name),
                        has: u64::from(has.$name),
                    });
                })*
            };
        }
        at_least!(
            max_compute_workgroup_storage_size,
            max_compute_invocations_per_workgroup,
            max_compute_workgroup_size_x,
            max_compute_workgroups_per_dimension,
            max_storage_buffers_per_shader_stage,
            max_storage_textures_per_shader_stage,
            max_storage_buffer_binding_size,
            max_uniform_buffer_binding_size,
            max_sampled_textures_per_shader_stage,
            max_texture_dimension_2d
        );
        Ok(Self(Arc::new(Shared {
            device: device.clone(),
            label: if options.label.is_empty() { "scatter".into() } else { options.label.into() },
            cache: options.cache.cloned(),
            shaders: Mutex::default(),
            pipelines: Mutex::default(),
        })))
    }

    /// Makes all compute pipelines now instead of on first use.
    pub fn warm_up(&self) {
        let own = scatter_kernels::minmax::MODULES.iter().chain(&scatter_kernels::epipolar::MODULES);
        for module in MODULES.iter().chain(own) {
            for entry in module.entries.iter().filter(|entry| entry.workgroup[0] > 0) {
                self.compute(module, entry);
            }
        }
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.0.device
    }

    pub(crate) fn label(&self) -> &str {
        &self.0.label
    }

    pub(crate) fn cache(&self) -> Option<&wgpu::PipelineCache> {
        self.0.cache.as_ref()
    }

    pub(crate) fn shader(&self, module: &'static Module) -> wgpu::ShaderModule {
        let mut shaders = self.0.shaders.lock().unwrap_or_else(PoisonError::into_inner);
        shaders
            .entry(module.name)
            .or_insert_with(|| {
                self.0.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some(module.name),
                    source: wgpu::ShaderSource::Wgsl(module.assemble().into()),
                })
            })
            .clone()
    }

    pub(crate) fn group_layout(
        &self,
        bindings: &[Binding],
        visibility: wgpu::ShaderStages,
    ) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = bindings
            .iter()
            .map(|binding| wgpu::BindGroupLayoutEntry {
                binding: binding.number,
                visibility,
                ty: binding_type(binding.kind),
                count: None,
            })
            .collect();
        self.0.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(self.label()),
            entries: &entries,
        })
    }

    pub(crate) fn pipeline_layout(&self, group: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
        self.0.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.label()),
            bind_group_layouts: &[Some(group)],
            immediate_size: 0,
        })
    }

    pub(crate) fn compute(&self, module: &'static Module, entry: &'static Entry) -> Arc<Compute> {
        let key = (module.name, entry.name);
        let mut pipelines = self.0.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = pipelines.get(&key) {
            return known.clone();
        }
        let group = self.group_layout(entry.bindings, wgpu::ShaderStages::COMPUTE);
        let pipeline = self.0.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry.name),
            layout: Some(&self.pipeline_layout(&group)),
            module: &self.shader(module),
            entry_point: Some(entry.name),
            // Shaders write workgroup memory before they read it.
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: self.cache(),
        });
        let made = Arc::new(Compute { pipeline, group });
        pipelines.insert(key, made.clone());
        made
    }
}

fn binding_type(kind: BindingKind) -> wgpu::BindingType {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = |view_dimension, multisampled| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension,
        multisampled,
    };
    let write = |format| wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    match kind {
        BindingKind::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::Storage => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        BindingKind::StorageReadWrite => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        BindingKind::Texture => texture(wgpu::TextureViewDimension::D2, false),
        BindingKind::TextureMultisampled => texture(wgpu::TextureViewDimension::D2, true),
        BindingKind::TextureArray => texture(wgpu::TextureViewDimension::D2Array, false),
        BindingKind::WriteR32Float => write(wgpu::TextureFormat::R32Float),
        BindingKind::WriteRgba16Float => write(wgpu::TextureFormat::Rgba16Float),
        BindingKind::WriteRgba32Float => write(wgpu::TextureFormat::Rgba32Float),
    }
}
