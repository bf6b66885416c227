//! One camera and one light: what is kept between frames, and how a frame is encoded.

use std::sync::Arc;

use scatter_core::{Setup, Unsupported};
use scatter_kernels::epipolar::{self, EpipolarPlan};
use scatter_kernels::minmax::MinMaxPlan;
use scatter_kernels::modules::{Binding, BindingKind, Entry};
use scatter_kernels::{FrameUniform, GpuFrame, Plan, ShadowDepth, flags};

use crate::capabilities;
use crate::composite::Composite;
use crate::error::GpuError;
use crate::gpu::{Compute, Gpu};
use crate::inputs::{Inputs, aspect_of};
use crate::technique::Technique;

/// Format of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Output {
    /// Half floats: 11 bits, up to 65,504.
    #[default]
    Rgba16Float,
    /// Floats.
    Rgba32Float,
}

/// How a view is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewOptions {
    /// By which technique.
    pub technique: Technique,
    /// Into which format.
    pub output: Output,
    /// Camera pixels a side that one pixel of the image stands for: 1, 2 or 4.
    pub scale: u32,
}

/// How an image is composed over a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compose {
    /// `inscattered + transmittance · picture`: the first light of a frame.
    Full,
    /// `inscattered + picture`: every further light.
    LightOnly,
}

/// Where a frame's passes write their times: two stamps a pass, in the order of [`View::passes`].
#[derive(Debug, Clone, Copy)]
pub struct Timing<'a> {
    /// A set of timestamps.
    pub queries: &'a wgpu::QuerySet,
    /// The first of them.
    pub first: u32,
}

/// One camera and one light: buffers, images, bind groups. Allocates when something grew, otherwise never.
#[derive(Debug)]
pub struct View {
    gpu: Gpu,
    options: ViewOptions,
    uniform: wgpu::Buffer,
    images: Option<Images>,
    prepared: Option<Prepared>,
    bound: Option<Bound>,
    names: Vec<&'static str>,
    buffers: Vec<Own>,
    min_max: MinMaxPlan,
    slices: EpipolarPlan,
    composite: Composite,
    fallback: Fallback,
}

#[derive(Debug)]
struct Images {
    size: [u32; 2],
    distance: wgpu::Texture,
    inscattered: wgpu::Texture,
    transmittance: wgpu::Texture,
}

/// A storage buffer of the technique's own.
#[derive(Debug)]
struct Own {
    binding: u32,
    buffer: wgpu::Buffer,
}

/// What [`View::encode`] checks the textures by.
#[derive(Debug)]
struct Prepared {
    uniform: FrameUniform,
    projections: scatter_core::MapLayout,
    texture: Option<scatter_core::MapProjection>,
    shadow: Vec<ShadowDepth>,
    grey: bool,
}

/// Bind groups, made again when a texture is another one.
#[derive(Debug)]
struct Bound {
    key: BoundKey,
    passes: Vec<BoundPass>,
}

#[derive(Debug, PartialEq)]
struct BoundKey {
    depth: wgpu::Texture,
    depth_layer: u32,
    shadow: Option<wgpu::Texture>,
    glass: Option<wgpu::Texture>,
}

#[derive(Debug)]
struct BoundPass {
    compute: Arc<Compute>,
    group: wgpu::BindGroup,
    groups: [u32; 3],
    name: &'static str,
    module: &'static str,
}

/// What is bound where a frame has no maps or no glass.
#[derive(Debug)]
struct Fallback {
    map: wgpu::TextureView,
    glass: wgpu::TextureView,
}

impl View {
    /// Of a device. Errors name options out of range.
    pub fn new(gpu: &Gpu, options: ViewOptions) -> Result<Self, GpuError> {
        if !matches!(options.scale, 1 | 2 | 4) {
            return Err(refused(format!("a scale of {}; give 1, 2 or 4", options.scale)));
        }
        if let Technique::RayMarch { steps, .. } = options.technique
            && !(1..=65_536).contains(&steps)
        {
            return Err(refused(format!("{steps} steps a ray; give 1 to 65536")));
        }
        if let Technique::Epipolar(settings) = options.technique {
            settings.check().map_err(refused)?;
        }
        let device = gpu.device();
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(gpu.label()),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let one = |dimension| {
            texture(gpu, [1; 2], wgpu::TextureFormat::R32Float, wgpu::TextureUsages::TEXTURE_BINDING)
                .create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(dimension),
                    ..Default::default()
                })
        };
        let fallback = Fallback {
            map: one(wgpu::TextureViewDimension::D2Array),
            glass: one(wgpu::TextureViewDimension::D2),
        };
        Ok(Self {
            gpu: gpu.clone(),
            options,
            uniform,
            images: None,
            prepared: None,
            bound: None,
            names: Vec::new(),
            buffers: Vec::new(),
            min_max: MinMaxPlan::default(),
            slices: EpipolarPlan::default(),
            composite: Composite::new(gpu),
            fallback,
        })
    }

    /// Sets a frame up on the CPU and writes it to the GPU: once a frame and view, before [`Self::encode`] and between two
    /// submits. `viewport` is that of [`Inputs`].
    pub fn prepare(
        &mut self,
        queue: &wgpu::Queue,
        frame: &GpuFrame<'_>,
        viewport: [u32; 4],
    ) -> Result<(), GpuError> {
        let setup = &frame.setup;
        capabilities::of(self.options.technique).check_setup(setup)?;
        let mut uniform = FrameUniform::new(frame, [viewport[0], viewport[1]])?;
        if let Technique::RayMarch { steps, jitter, uniform: equal } = self.options.technique {
            let march_flags =
                u32::from(jitter.is_some()) * flags::MARCH_JITTER + u32::from(equal) * flags::MARCH_UNIFORM;
            uniform.counts = [uniform.counts[0], steps, jitter.unwrap_or(0), march_flags];
        }
        uniform.depth_more[1] = self.options.scale as f32;
        match &self.options.technique {
            Technique::RayMarch { .. } => {}
            Technique::MinmaxMipmap => self.min_max.rebuild(setup)?,
            Technique::Epipolar(settings) => self.slices.rebuild(setup, settings)?,
        }
        self.grow_images(setup)?;
        self.write_own(queue, setup.size())?;
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let mut shadow = self.prepared.take().map_or_else(Vec::new, |prepared| prepared.shadow);
        shadow.clear();
        shadow.extend_from_slice(frame.shadow);
        self.prepared = Some(Prepared {
            uniform,
            projections: *setup.maps(),
            texture: setup.texture().copied(),
            shadow,
            grey: setup.medium().is_grey(),
        });
        Ok(())
    }

    /// Grows the technique's own buffers, and writes what the CPU has planned.
    fn write_own(&mut self, queue: &wgpu::Queue, size: [u32; 2]) -> Result<(), GpuError> {
        let plan = self.plan(size, 1);
        plan.check()?;
        for buffer in &plan.buffers {
            self.grow_buffer(buffer.binding, buffer.bytes);
        }
        let contents: &[(u32, &[u8])] = match self.options.technique {
            Technique::RayMarch { .. } => &[],
            Technique::MinmaxMipmap => &[(1, bytemuck::cast_slice(self.min_max.layers()))],
            Technique::Epipolar(_) => &[
                (epipolar::UNIFORM, bytemuck::cast_slice(self.slices.uniforms())),
                (10, bytemuck::cast_slice(self.slices.slices())),
                (11, bytemuck::cast_slice(self.slices.lines())),
                (13, bytemuck::cast_slice(self.slices.tasks())),
                (14, bytemuck::cast_slice(self.slices.ranges())),
                (15, bytemuck::cast_slice(self.slices.nodes())),
            ],
        };
        for &(binding, bytes) in contents {
            if let Some(own) = self.buffers.iter().find(|own| own.binding == binding)
                && !bytes.is_empty()
            {
                queue.write_buffer(&own.buffer, 0, bytes);
            }
        }
        Ok(())
    }

    /// Records the passes; `setup` is that of the prepared frame. Nothing is recorded if there is an error.
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        setup: &Setup<'_>,
        inputs: &Inputs<'_>,
        timing: Option<Timing<'_>>,
    ) -> Result<(), GpuError> {
        let prepared = self.prepared.as_ref().ok_or(GpuError::Order("call prepare before encode"))?;
        let same = prepared.projections == *setup.maps() && prepared.texture.as_ref() == setup.texture();
        let size = [prepared.uniform.image[0], prepared.uniform.image[1]];
        let at = [prepared.uniform.image[2], prepared.uniform.image[3]];
        if !same || size != setup.size() || at != [inputs.viewport[0], inputs.viewport[1]] {
            return Err(GpuError::Order(
                "encode a frame with the set-up and the viewport that it was prepared with",
            ));
        }
        inputs.check(setup, &prepared.shadow)?;
        self.bind(inputs, size)?;
        let Some(bound) = &self.bound else { return Err(GpuError::Order("call prepare before encode")) };
        for (index, pass) in bound.passes.iter().enumerate() {
            // Room for what another direction of view would ask; a stamp is written all the same.
            if timing.is_none() && pass.groups.contains(&0) {
                continue;
            }
            let first = timing.map(|timing| timing.first + 2 * index as u32);
            let mut recorded = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(pass.name),
                timestamp_writes: timing.zip(first).map(|(timing, first)| wgpu::ComputePassTimestampWrites {
                    query_set: timing.queries,
                    beginning_of_pass_write_index: Some(first),
                    end_of_pass_write_index: Some(first + 1),
                }),
            });
            recorded.set_pipeline(&pass.compute.pipeline);
            recorded.set_bind_group(0, &pass.group, &[]);
            recorded.dispatch_workgroups(pass.groups[0], pass.groups[1], pass.groups[2]);
        }
        Ok(())
    }

    /// Draws the image over a picture of linear HDR: after opaque geometry, before transparent one. `viewport` is where in the
    /// target.
    pub fn encode_composite(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
        viewport: [u32; 4],
        how: Compose,
    ) -> Result<(), GpuError> {
        let Some(prepared) = self.prepared.as_ref().filter(|_| self.bound.is_some()) else {
            return Err(GpuError::Order("call prepare and encode before encode_composite"));
        };
        self.composite.encode(
            &self.gpu,
            encoder,
            (target, format, viewport),
            (how == Compose::Full, prepared.grey),
        );
        Ok(())
    }

    /// The image: RGB in-scattered radiance × exposure, mean transmittance. `None` before the first [`Self::prepare`].
    pub fn inscattered(&self) -> Option<&wgpu::Texture> {
        self.images.as_ref().map(|images| &images.inscattered)
    }

    /// RGB transmittance; its alpha is the distance of the ray's end.
    pub fn transmittance(&self) -> Option<&wgpu::Texture> {
        self.images.as_ref().map(|images| &images.transmittance)
    }

    /// Names of the passes, in order, after the first [`Self::encode`]; one pair of timestamps each.
    pub fn passes(&self) -> &[&'static str] {
        &self.names
    }

    /// Bytes of all textures and buffers that the view holds.
    pub fn memory_bytes(&self) -> u64 {
        let images = self.images.as_ref().map_or(0, |images| {
            let area = |texture: &wgpu::Texture| u64::from(texture.width()) * u64::from(texture.height());
            let texel = if self.options.output == Output::Rgba16Float { 8 } else { 16 };
            4 * area(&images.distance) + 2 * texel * area(&images.inscattered)
        });
        images
            + 2 * size_of::<FrameUniform>() as u64
            + self.buffers.iter().map(|own| own.buffer.size()).sum::<u64>()
    }

    fn grow_images(&mut self, setup: &Setup<'_>) -> Result<(), GpuError> {
        let size = setup.size();
        if self.images.as_ref().is_some_and(|images| images.size == size) {
            return Ok(());
        }
        if let Some(&side) = size.iter().find(|&&side| side > scatter_kernels::plan::MOST_SIDE) {
            return Err(GpuError::TooLarge(scatter_kernels::TooLarge {
                what: "the image's side",
                needed: side.into(),
                unit: "pixels",
                limit: scatter_kernels::plan::MOST_SIDE.into(),
                cure: "give a smaller image",
            }));
        }
        let gpu = &self.gpu;
        let usage = wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let format = match self.options.output {
            Output::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
            Output::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        };
        let image = size.map(|side| side.div_ceil(self.options.scale));
        let images = Images {
            size,
            distance: texture(gpu, size, wgpu::TextureFormat::R32Float, usage),
            inscattered: texture(gpu, image, format, usage),
            transmittance: texture(gpu, image, format, usage),
        };
        self.composite.bind(
            gpu,
            &self.uniform,
            [&images.distance, &images.inscattered, &images.transmittance],
        );
        self.images = Some(images);
        self.bound = None;
        Ok(())
    }

    /// A storage buffer of the technique's own with at least so many bytes.
    fn grow_buffer(&mut self, binding: u32, bytes: u64) {
        if self.buffers.iter().any(|own| own.binding == binding && own.buffer.size() >= bytes) {
            return;
        }
        let is_uniform = binding == epipolar::UNIFORM;
        let kind = if is_uniform { wgpu::BufferUsages::UNIFORM } else { wgpu::BufferUsages::STORAGE };
        let buffer = self.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(self.gpu.label()),
            size: bytes,
            usage: kind | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        self.buffers.retain(|own| own.binding != binding);
        self.buffers.push(Own { binding, buffer });
        self.bound = None;
    }

    /// The dispatches of a frame of `size`, whose depth texture has so many samples a pixel.
    pub fn plan(&self, size: [u32; 2], samples: u32) -> Plan {
        let (scale, float) = (self.options.scale, self.options.output == Output::Rgba32Float);
        match self.options.technique {
            Technique::RayMarch { steps, .. } => Plan::march(size, scale, samples, steps, float),
            Technique::MinmaxMipmap => Plan::min_max(&self.min_max, size, scale, samples, float),
            Technique::Epipolar(_) => Plan::epipolar(&self.slices, size, scale, samples, float),
        }
    }

    /// Counters of the technique, u32 each, to be read when the caller likes: \[0\] pixels that a loop's bound cut off; of
    /// epipolar slices \[1\] stretches of 256 texel columns whose rows had no room to be cut exactly.
    /// They count up until the caller clears them. `None` of the marcher, which has no such bound.
    pub fn status(&self) -> Option<&wgpu::Buffer> {
        self.buffers.iter().find(|own| own.binding == 8).map(|own| &own.buffer)
    }

    fn bind(&mut self, inputs: &Inputs<'_>, size: [u32; 2]) -> Result<(), GpuError> {
        let plan = self.plan(size, inputs.depth.sample_count());
        plan.check()?;
        let key = BoundKey {
            depth: inputs.depth.clone(),
            depth_layer: inputs.depth_layer,
            shadow: inputs.shadow.cloned(),
            glass: inputs.glass.cloned(),
        };
        let names = || plan.passes.iter().map(|pass| pass.module.name);
        let is_bound =
            |bound: &&mut Bound| bound.key == key && bound.passes.iter().map(|pass| pass.module).eq(names());
        if let Some(bound) = self.bound.as_mut().filter(is_bound) {
            // How much there is to do may change with every frame.
            for (bound, pass) in bound.passes.iter_mut().zip(&plan.passes) {
                bound.groups = pass.groups;
            }
            return Ok(());
        }
        let Some(images) = &self.images else { return Err(GpuError::Order("call prepare before encode")) };
        let view = |texture: &wgpu::Texture, dimension, layer: Option<u32>| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(dimension),
                aspect: aspect_of(texture.format()),
                base_array_layer: layer.unwrap_or(0),
                array_layer_count: layer.map(|_| 1),
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let (d2, array) = (wgpu::TextureViewDimension::D2, wgpu::TextureViewDimension::D2Array);
        let depth = view(inputs.depth, d2, Some(inputs.depth_layer));
        let maps =
            inputs.shadow.map_or_else(|| self.fallback.map.clone(), |texture| view(texture, array, None));
        let glass =
            inputs.glass.map_or_else(|| self.fallback.glass.clone(), |texture| view(texture, d2, Some(0)));
        let [distance, inscattered, transmittance] =
            [&images.distance, &images.inscattered, &images.transmittance].map(|image| view(image, d2, None));
        let own = |number: u32| self.buffers.iter().find(|own| own.binding == number);
        let resource = |binding: &Binding, batch: u32| match binding.number {
            epipolar::UNIFORM => own(epipolar::UNIFORM).map_or_else(
                || self.uniform.as_entire_binding(),
                |own| {
                    wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                        buffer: &own.buffer,
                        offset: u64::from(batch) * Plan::UNIFORM_STRIDE,
                        size: wgpu::BufferSize::new(Plan::UNIFORM_STRIDE),
                    })
                },
            ),
            number if matches!(binding.kind, BindingKind::Storage | BindingKind::StorageReadWrite) => {
                own(number)
                    .map_or_else(|| self.uniform.as_entire_binding(), |own| own.buffer.as_entire_binding())
            }
            0 => self.uniform.as_entire_binding(),
            1 => wgpu::BindingResource::TextureView(&depth),
            2 | 3 => wgpu::BindingResource::TextureView(&distance),
            4 => wgpu::BindingResource::TextureView(&maps),
            5 => wgpu::BindingResource::TextureView(&glass),
            6 => wgpu::BindingResource::TextureView(&inscattered),
            _ => wgpu::BindingResource::TextureView(&transmittance),
        };
        let group = |compute: &Compute, entry: &Entry, batch: u32| {
            let entries: Vec<_> = entry
                .bindings
                .iter()
                .map(|binding| wgpu::BindGroupEntry {
                    binding: binding.number,
                    resource: resource(binding, batch),
                })
                .collect();
            self.gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.gpu.label()),
                layout: &compute.group,
                entries: &entries,
            })
        };
        let passes = plan
            .passes
            .iter()
            .map(|pass| {
                let compute = self.gpu.compute(pass.module, pass.entry);
                let group = group(&compute, pass.entry, pass.batch);
                BoundPass { compute, group, groups: pass.groups, name: pass.name, module: pass.module.name }
            })
            .collect();
        self.names = plan.passes.iter().map(|pass| pass.name).collect();
        self.bound = Some(Bound { key, passes });
        Ok(())
    }
}

fn refused(reason: String) -> GpuError {
    GpuError::Unsupported(Unsupported { reason: reason.into() })
}

fn texture(
    gpu: &Gpu,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device().create_texture(&wgpu::TextureDescriptor {
        label: Some(gpu.label()),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
