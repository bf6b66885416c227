//! A technique of the GPU as a `VolumetricShadow`: uploads, encodes, submits, waits, reads back.

use scatter_core::{
    Capabilities, DepthEncoding, Frame, RenderError, RenderStats, ScatterImage, StageClock, Unsupported,
    VolumetricShadow,
};
use scatter_kernels::epipolar::EpipolarPlan;
use scatter_kernels::plan::MOST_SIDE;
use scatter_kernels::{GpuFrame, ShadowDepth};

use super::device::HarnessDevice;
use crate::capabilities;
use crate::inputs::Inputs;
use crate::technique::Technique;
use crate::view::{Output, View, ViewOptions};

/// The id of the marcher on the GPU.
pub const MARCH_GPU_ID: &str = "raymarch@gpu";

/// The id of exact min/max on the GPU.
pub const MINMAX_GPU_ID: &str = "minmax-mipmap@gpu";

/// The id of epipolar slices on the GPU.
pub const EPIPOLAR_GPU_ID: &str = "epipolar@gpu";

/// Why a planner learns nothing of such a technique's time.
pub(super) const NOT_MODELLED: &str = "nobody has measured its time on a card yet";

/// A technique on the process's shared device ([`HarnessDevice::shared`]).
#[derive(Debug)]
pub struct GpuTechnique {
    pub(super) technique: Technique,
    view: Option<View>,
    pub(super) textures: Option<Textures>,
}

#[derive(Debug)]
pub(super) struct Textures {
    /// Size of the image, of the maps and how many, of the glass.
    sizes: ([u32; 2], [u32; 2], u32, [u32; 2]),
    pub(super) depth: wgpu::Texture,
    pub(super) shadow: wgpu::Texture,
    pub(super) glass: wgpu::Texture,
}

impl GpuTechnique {
    /// Of a technique; the device is opened by the first render.
    pub fn new(technique: Technique) -> Self {
        Self { technique, view: None, textures: None }
    }

    pub(super) fn upload(&mut self, device: &HarnessDevice, frame: &Frame<'_>) {
        let layers: Vec<_> = frame.shadow().layers().collect();
        let largest = layers.iter().fold([1; 2], |[w, h], layer| {
            let [width, height] = layer.projection().size();
            [width.max(w), height.max(h)]
        });
        let glass_size = frame.texture().map_or([1; 2], |glass| glass.projection().size());
        let sizes = (frame.size(), largest, layers.len().max(1) as u32, glass_size);
        if self.textures.as_ref().is_none_or(|textures| textures.sizes != sizes) {
            self.textures = Some(Textures {
                sizes,
                depth: device.r32float(frame.size(), 1),
                shadow: device.r32float(largest, sizes.2),
                glass: device.texture(glass_size, 1, wgpu::TextureFormat::Rgba32Float),
            });
        }
        let Some(textures) = &self.textures else { return };
        device.write(&textures.depth, 0, frame.size(), bytemuck::cast_slice(frame.depth().texels()));
        for (index, layer) in layers.iter().enumerate() {
            let size = layer.projection().size();
            device.write(&textures.shadow, index as u32, size, bytemuck::cast_slice(layer.texels()));
        }
        if let Some(glass) = frame.texture() {
            let texels: Vec<[f32; 4]> = glass.texels().iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
            device.write(&textures.glass, 0, glass_size, bytemuck::cast_slice(&texels));
        }
    }

    fn try_render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, String> {
        let device = HarnessDevice::shared().map_err(|none| format!("no GPU: {none}"))?;
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        self.upload(&device, frame);
        clock.lap(&mut stats, "upload");
        let options = ViewOptions { technique: self.technique, output: Output::Rgba32Float, scale: 1 };
        let view = match &mut self.view {
            Some(view) => view,
            none => none.insert(View::new(&device.gpu, options).map_err(|error| error.to_string())?),
        };
        let Some(textures) = &self.textures else { return Err("nothing was uploaded".into()) };
        let shadow = linear_layers(frame);
        let (gpu_frame, inputs) = textures.engine_frame(frame, &shadow);
        let viewport = inputs.viewport;
        let mut encoder = device.device.create_command_encoder(&Default::default());
        device.validated(|| {
            view.prepare(&device.queue, &gpu_frame, viewport)?;
            view.encode(&mut encoder, frame.setup(), &inputs, None)
        })?;
        clock.lap(&mut stats, "prepare");
        device.queue.submit([encoder.finish()]);
        device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| error.to_string())?;
        clock.lap(&mut stats, "gpu");
        let (Some(light), Some(through)) = (view.inscattered(), view.transmittance()) else {
            return Err("nothing was encoded".into());
        };
        let [light, through] = [light, through].map(|image| device.read_texture(image, 16));
        let (inscattered, transmittance) = out.overwritten(frame.size());
        let texels = |bytes: &[u8]| -> Vec<[f32; 4]> { bytemuck::pod_collect_to_vec(bytes) };
        for (pixel, [r, g, b, _]) in inscattered.iter_mut().zip(texels(&light)) {
            *pixel = [r, g, b];
        }
        for (pixel, [r, g, b, _]) in transmittance.iter_mut().zip(texels(&through)) {
            *pixel = [r, g, b];
        }
        // Given back here, for freeing so many pages takes time of its own.
        drop((light, through));
        clock.lap(&mut stats, "read back");
        let plan = view.plan(frame.size(), 1);
        stats.counts.push("workgroups", plan.workgroups());
        stats.counts.push("texel loads", plan.passes.iter().map(|pass| pass.loads).sum());
        stats.counts.push("atomics", plan.passes.iter().map(|pass| pass.atomics).sum());
        stats.memory_bytes = view.memory_bytes();
        stats.transfer = ["upload", "read back"].iter().filter_map(|stage| stats.stages.get(stage)).sum();
        Ok(stats)
    }
}

/// What the uploaded maps hold: linear depths, a map a layer.
pub(super) fn linear_layers(frame: &Frame<'_>) -> Vec<ShadowDepth> {
    (0..frame.shadow().layer_count() as u32).map(ShadowDepth::linear).collect()
}

impl Textures {
    /// The frame and its textures as an engine hands them over.
    pub(super) fn engine_frame<'a>(
        &'a self,
        frame: &Frame<'a>,
        shadow: &'a [ShadowDepth],
    ) -> (GpuFrame<'a>, Inputs<'a>) {
        let [width, height] = frame.size();
        let gpu_frame =
            GpuFrame { setup: *frame.setup(), depth: DepthEncoding::AlongRay, shadow, exposure: 1.0 };
        let inputs = Inputs {
            depth: &self.depth,
            depth_layer: 0,
            viewport: [0, 0, width, height],
            shadow: (!shadow.is_empty()).then_some(&self.shadow),
            glass: frame.texture().map(|_| &self.glass),
        };
        (gpu_frame, inputs)
    }
}

impl VolumetricShadow for GpuTechnique {
    fn id(&self) -> &'static str {
        match self.technique {
            Technique::RayMarch { .. } => MARCH_GPU_ID,
            Technique::MinmaxMipmap => MINMAX_GPU_ID,
            Technique::Epipolar(_) => EPIPOLAR_GPU_ID,
        }
    }

    fn capabilities(&self) -> Capabilities {
        capabilities::of(self.technique)
    }

    fn supports(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        self.capabilities().check(frame)?;
        fits(frame)?;
        match &self.technique {
            Technique::Epipolar(settings) => EpipolarPlan::check(frame.setup(), settings)
                .map_err(|large| Unsupported { reason: large.to_string().into() }),
            Technique::RayMarch { .. } | Technique::MinmaxMipmap => Ok(()),
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        self.try_render(frame, out)
            .map_err(|reason| RenderError::Unsupported(Unsupported { reason: reason.into() }))
    }
}

/// Whether the frame's textures are as small as WebGPU guarantees.
fn fits(frame: &Frame<'_>) -> Result<(), Unsupported> {
    let maps = frame.shadow().layers().map(|layer| layer.projection().size());
    let glass = frame.texture().map(|glass| glass.projection().size());
    let sides = maps.chain(glass).chain([frame.size()]).flatten();
    match sides.max() {
        Some(side) if side > MOST_SIDE => Err(Unsupported {
            reason: format!("an image or a map of {side} texels a side; give at most {MOST_SIDE}").into(),
        }),
        _ => Ok(()),
    }
}
