//! Times of a frame on a device: each pass by timestamps where the device has them, else the whole frame on the wall clock.

use std::time::Instant;

use scatter_core::{Frame, Quality, VolumetricShadow};
use scatter_kernels::epipolar::EpipolarSettings;

use super::device::HarnessDevice;
use super::technique::{GpuTechnique, linear_layers};
use crate::error::GpuError;
use crate::technique::Technique;
use crate::view::{Output, Timing, View, ViewOptions};

/// What is timed for reports: a name and the technique, for images of a size.
pub fn timed(size: [u32; 2]) -> Vec<(&'static str, Technique)> {
    let slices = |level| Technique::Epipolar(EpipolarSettings::for_quality(level, size));
    let march = |steps| Technique::RayMarch { steps, jitter: None, uniform: false };
    vec![
        ("raymarch@gpu, 64 steps", march(64)),
        ("raymarch@gpu, 1024 steps", march(1024)),
        ("minmax-mipmap@gpu", Technique::MinmaxMipmap),
        ("epipolar@gpu, game", slices(Quality::Game)),
        ("epipolar@gpu, film", slices(Quality::Film)),
    ]
}

/// A frame's times, medians of several runs, and what its plan counts.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTimes {
    /// The passes in their order.
    pub passes: Vec<PassTime>,
    /// From submit to the end of waiting \[ms\]: all passes, and the driver's own time.
    pub submitted_ms: f64,
    /// The CPU's set-up and recording \[ms\].
    pub prepare_ms: f64,
    /// Bytes of all images and buffers that the view holds.
    pub memory_bytes: u64,
    /// Rays that a loop's bound cut short, in all runs together.
    pub cut_short: u32,
}

/// One pass.
#[derive(Debug, Clone, PartialEq)]
pub struct PassTime {
    /// Its name.
    pub name: &'static str,
    /// Its time by timestamps \[ms\]; `None` where the device has none.
    pub ms: Option<f64>,
    /// Its workgroups.
    pub workgroups: u64,
    /// Texels that it loads, counted from the plan; 0 where that depends on the scene.
    pub loads: u64,
    /// Atomic additions to storage, counted from the plan.
    pub atomics: u64,
}

impl GpuTechnique {
    /// Times a frame `runs` times on a device, after one run to make pipelines, with an image of half floats as engines have it.
    /// Textures are those of a first [`VolumetricShadow::render`]'s kind: uploaded once, not timed.
    pub fn times(
        &mut self,
        device: &HarnessDevice,
        frame: &Frame<'_>,
        runs: u32,
    ) -> Result<FrameTimes, GpuError> {
        self.supports(frame)?;
        self.upload(device, frame);
        let Some(textures) = &self.textures else { return Err(GpuError::Order("nothing was uploaded")) };
        let options = ViewOptions { technique: self.technique, output: Output::Rgba16Float, scale: 1 };
        let mut view = View::new(&device.gpu, options)?;
        let shadow = linear_layers(frame);
        let (gpu_frame, inputs) = textures.engine_frame(frame, &shadow);
        let viewport = inputs.viewport;
        let mut stamps: Option<Stamps> = None;
        let (mut prepared, mut submitted, mut stamped) = (Vec::new(), Vec::new(), Vec::new());
        for run in 0..=runs {
            let start = Instant::now();
            let mut encoder = device.device.create_command_encoder(&Default::default());
            view.prepare(&device.queue, &gpu_frame, viewport)?;
            let timing = stamps.as_ref().map(|stamps| Timing { queries: &stamps.queries, first: 0 });
            view.encode(&mut encoder, frame.setup(), &inputs, timing)?;
            if let Some(stamps) = &stamps {
                stamps.resolve(&mut encoder);
            }
            let recorded = Instant::now();
            device.queue.submit([encoder.finish()]);
            device
                .device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|_| GpuError::Order("the device was lost"))?;
            // The first run makes pipelines, and says how many passes there are.
            if run == 0 {
                stamps = Stamps::new(device, view.passes().len());
                continue;
            }
            prepared.push((recorded - start).as_secs_f64() * 1e3);
            submitted.push(recorded.elapsed().as_secs_f64() * 1e3);
            stamped.extend(stamps.as_ref().map(|stamps| stamps.milliseconds(device)));
        }
        let plan = view.plan(frame.size(), 1);
        let passes = plan.passes.iter().enumerate().map(|(index, pass)| PassTime {
            name: pass.name,
            ms: median(stamped.iter().filter_map(|run| run.get(index).copied()).collect()),
            workgroups: pass.groups.iter().map(|&n| u64::from(n)).product(),
            loads: pass.loads,
            atomics: pass.atomics,
        });
        let status = view.status().map(|buffer| device.read_buffer(buffer));
        Ok(FrameTimes {
            passes: passes.collect(),
            submitted_ms: median(submitted).unwrap_or(f64::NAN),
            prepare_ms: median(prepared).unwrap_or(f64::NAN),
            memory_bytes: view.memory_bytes(),
            cut_short: status.map_or(0, |bytes| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes)[0]),
        })
    }
}

/// Two timestamps a pass.
struct Stamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    count: u32,
}

impl Stamps {
    /// `None` where the device has no timestamps.
    fn new(device: &HarnessDevice, passes: usize) -> Option<Self> {
        if !device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = 2 * passes as u32;
        let queries = device.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("harness"),
            ty: wgpu::QueryType::Timestamp,
            count,
        });
        let resolved = device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("harness"),
            size: 8 * u64::from(count),
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Some(Self { queries, resolved, count })
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..self.count, &self.resolved, 0);
    }

    fn milliseconds(&self, device: &HarnessDevice) -> Vec<f64> {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&device.read_buffer(&self.resolved));
        let period = f64::from(device.queue.get_timestamp_period()) * 1e-6;
        ticks.chunks_exact(2).map(|pass| pass[1].saturating_sub(pass[0]) as f64 * period).collect()
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
