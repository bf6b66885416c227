//! A device without a surface, what it uploads and reads back, and one entry run by itself.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use scatter_kernels::modules::Module;

use super::adapter::{NoAdapter, chosen};
use crate::error::GpuError;
use crate::gpu::{Gpu, GpuOptions};

/// The adapter of the shared device, where one was asked for.
static ASKED: OnceLock<String> = OnceLock::new();

/// A device with no features and WebGPU's default limits.
#[derive(Debug)]
pub struct HarnessDevice {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What it runs on.
    pub info: wgpu::AdapterInfo,
    /// Our pipelines on it.
    pub gpu: Gpu,
}

/// What an entry binds when it runs by itself.
#[derive(Debug, Clone, Copy)]
pub enum Bound<'a> {
    /// A uniform buffer with these bytes.
    Uniform(&'a [u8]),
    /// A storage buffer with these bytes; what it holds in the end is returned.
    Storage(&'a [u8]),
    /// A view of a texture.
    Texture(&'a wgpu::TextureView),
}

impl HarnessDevice {
    /// Of the best adapter, or of the one that is asked for by its number or a part of its name.
    pub fn open(asked: Option<&str>) -> Result<Self, NoAdapter> {
        Self::open_with(asked, wgpu::Features::empty())
    }

    /// The same with timestamps, where the adapter has them.
    pub fn open_timed(asked: Option<&str>) -> Result<Self, NoAdapter> {
        Self::open_with(asked, wgpu::Features::TIMESTAMP_QUERY)
    }

    /// With those of `wanted` that the adapter has.
    fn open_with(asked: Option<&str>, wanted: wgpu::Features) -> Result<Self, NoAdapter> {
        let failed = |error: &dyn std::fmt::Display| NoAdapter(error.to_string());
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        // Without DEBUG: old layers reject the source language in naga's debug information.
        descriptor.flags = wgpu::InstanceFlags::VALIDATION;
        let adapter = chosen(&wgpu::Instance::new(descriptor), asked)?;
        let descriptor =
            wgpu::DeviceDescriptor { required_features: adapter.features() & wanted, ..Default::default() };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| failed(&error))?;
        let gpu = Gpu::new(&device, &GpuOptions::default()).map_err(|error| failed(&error))?;
        Ok(Self { device, queue, info: adapter.get_info(), gpu })
    }

    /// Says which adapter [`Self::shared`] opens, before it is first called; later it changes nothing.
    pub fn share(asked: &str) {
        let _ = ASKED.set(asked.into());
    }

    /// The one device of a process, or why there is none: devices opened side by side fight for a software driver's cores.
    pub fn shared() -> Result<MutexGuard<'static, Self>, NoAdapter> {
        static DEVICE: OnceLock<Result<Mutex<HarnessDevice>, NoAdapter>> = OnceLock::new();
        match DEVICE.get_or_init(|| Self::open(ASKED.get().map(String::as_str)).map(Mutex::new)) {
            Ok(device) => Ok(device.lock().unwrap_or_else(PoisonError::into_inner)),
            Err(none) => Err(none.clone()),
        }
    }

    /// The device in one line, for reports.
    pub fn describe(&self) -> String {
        let wgpu::AdapterInfo { name, driver, driver_info, backend, device_type, .. } = &self.info;
        let kind = match device_type {
            wgpu::DeviceType::Cpu => "CPU device (times are not a GPU's)",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Other => "device of an unknown kind",
        };
        format!("{name}, {driver} {driver_info}, {backend:?}, {kind}, wgpu 30")
    }

    /// Whether it is a software driver on the CPU: its times are not a GPU's.
    pub fn is_emulated(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// A texture of r32float layers with the given size. Texels: [`Self::write`].
    pub fn r32float(&self, size: [u32; 2], layers: u32) -> wgpu::Texture {
        self.texture(size, layers, wgpu::TextureFormat::R32Float)
    }

    /// A texture that is uploaded to and read by shaders.
    pub fn texture(&self, size: [u32; 2], layers: u32, format: wgpu::TextureFormat) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("harness"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
    }

    /// Uploads the texels of one layer, `[row][column]`, from its first texel on.
    pub fn write(&self, texture: &wgpu::Texture, layer: u32, size: [u32; 2], texels: &[u8]) {
        let bytes = texels.len() as u32 / (size[0] * size[1]);
        self.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                aspect: wgpu::TextureAspect::All,
            },
            texels,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(bytes * size[0]),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        );
    }

    /// The texels of a texture's first layer, without padding. `texel` bytes each. Submits and waits.
    pub fn read_texture(&self, texture: &wgpu::Texture, texel: u32) -> Vec<u8> {
        self.read_layer(texture, 0, texel)
    }

    /// The texels of one layer.
    pub fn read_layer(&self, texture: &wgpu::Texture, layer: u32, texel: u32) -> Vec<u8> {
        let (width, height) = (texture.width(), texture.height());
        let row = width * texel;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(padded) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                ..texture.as_image_copy()
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        let padded_rows = self.mapped(&buffer);
        padded_rows.chunks_exact(padded as usize).flat_map(|bytes| &bytes[..row as usize]).copied().collect()
    }

    /// What a buffer holds; it needs `COPY_SRC`. Submits and waits.
    pub fn read_buffer(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        self.mapped(&copy)
    }

    fn mapped(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        buffer.map_async(wgpu::MapMode::Read, .., |result| {
            result.expect("a buffer made to be read maps");
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device is not lost");
        buffer.get_mapped_range(..).expect("it was mapped").to_vec()
    }

    /// Runs one entry of a module by itself; returns what its storage buffers hold in the end, in the order of `bound`.
    pub fn run(
        &self,
        module: &'static Module,
        entry: usize,
        bound: &[(u32, Bound<'_>)],
        groups: [u32; 3],
    ) -> Vec<Vec<u8>> {
        let compute = self.gpu.compute(module, &module.entries[entry]);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let buffers: Vec<_> = bound
            .iter()
            .map(|(_, what)| {
                let (bytes, usage) = match *what {
                    Bound::Uniform(bytes) => (bytes, usage | wgpu::BufferUsages::UNIFORM),
                    Bound::Storage(bytes) => (bytes, usage | wgpu::BufferUsages::STORAGE),
                    Bound::Texture(_) => return None,
                };
                let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("harness"),
                    size: bytes.len() as u64,
                    usage,
                    mapped_at_creation: false,
                });
                self.queue.write_buffer(&buffer, 0, bytes);
                Some(buffer)
            })
            .collect();
        let entries: Vec<_> = bound
            .iter()
            .zip(&buffers)
            .map(|((binding, what), buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: match (what, buffer) {
                    (Bound::Texture(view), _) => wgpu::BindingResource::TextureView(view),
                    (_, Some(buffer)) => buffer.as_entire_binding(),
                    (_, None) => unreachable!("every other kind has a buffer"),
                },
            })
            .collect();
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("harness"),
            layout: &compute.group,
            entries: &entries,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&compute.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
        drop(pass);
        let read: Vec<_> = bound
            .iter()
            .zip(&buffers)
            .filter(|((_, what), _)| matches!(what, Bound::Storage(_)))
            .filter_map(|(_, buffer)| buffer.as_ref())
            .map(|buffer| {
                let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("read back"),
                    size: buffer.size(),
                    usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                    mapped_at_creation: false,
                });
                encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
                copy
            })
            .collect();
        self.queue.submit([encoder.finish()]);
        read.iter().map(|buffer| self.mapped(buffer)).collect()
    }

    /// What `work` returns, or the validation message that it caused.
    pub fn validated<T>(&self, work: impl FnOnce() -> Result<T, GpuError>) -> Result<T, String> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = work();
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(error.to_string()),
            None => result.map_err(|error| error.to_string()),
        }
    }
}
