//! All that an engine writes to have shafts: what the marks enclose, at most 60 lines. A test counts them.

use std::error::Error;

use scatter_core::{
    Camera, ClipSpace, DepthEncoding, Light, MapKind, MapLayout, Medium, Setup, ShadowDepthEncoding,
};
use scatter_gpu::{
    Compose, Gpu, GpuFrame, GpuOptions, Inputs, Output, ShadowDepth, Technique, View, ViewOptions, wgpu,
};

use crate::NEAR;
use crate::matrices::{CASCADES, Matrices};
use crate::world::{HDR, World};

/// What the cascades hold: z/w of wgpu's clip space, 1 next to the sun.
pub const CASCADE_DEPTH: ShadowDepthEncoding = ShadowDepthEncoding::Clip(ClipSpace::WGPU.reversed());
/// What the depth buffer holds.
pub const CAMERA_DEPTH: DepthEncoding = DepthEncoding::ReversedInfinite { near: NEAR };

// --- ours: begin
/// A sun's shafts in a camera's picture.
pub struct Shafts {
    view: View,
    light: Light,
    medium: Medium,
    reach: f64,
}

impl Shafts {
    /// Once a camera and light.
    pub fn new(
        device: &wgpu::Device,
        light: Light,
        medium: Medium,
        reach: f64,
    ) -> Result<Self, Box<dyn Error>> {
        let gpu = Gpu::new(device, &GpuOptions::default())?;
        let options =
            ViewOptions { technique: Technique::MinmaxMipmap, output: Output::Rgba16Float, scale: 1 };
        Ok(Self { view: View::new(&gpu, options)?, light, medium, reach })
    }

    /// Once a frame: after opaque geometry, before transparent one.
    pub fn encode(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        world: &World,
        matrices: &Matrices,
    ) -> Result<(), Box<dyn Error>> {
        let [width, height] = [world.depth.width(), world.depth.height()];
        let (view, clip) = (matrices.view_from_world, matrices.clip_from_view);
        let (view, clip) = (view.to_cols_array_2d(), clip.to_cols_array_2d());
        let camera = Camera::from_matrices(view, clip, [width, height])?;
        let map = [world.cascades.width(), world.cascades.height()];
        let (mut projections, mut meanings) = (Vec::with_capacity(CASCADES), Vec::with_capacity(CASCADES));
        for (layer, cascade) in matrices.cascades.iter().enumerate() {
            let matrix = cascade.to_cols_array_2d();
            let (projection, meaning) = ShadowDepth::of_clip(CASCADE_DEPTH, matrix, map, layer as u32)?;
            projections.push(projection);
            meanings.push(meaning);
        }
        let layout = MapLayout::new(MapKind::Cascades, &projections)?;
        let setup = Setup::new(&camera, &self.light, layout, &self.medium, self.reach)?;
        let frame = GpuFrame { setup, depth: CAMERA_DEPTH, shadow: &meanings, exposure: 1.0 };
        let viewport = [0, 0, width, height];
        let (depth, shadow) = (&world.depth, Some(&world.cascades));
        let inputs = Inputs { depth, depth_layer: 0, viewport, shadow, glass: None };
        self.view.prepare(queue, &frame, viewport)?;
        self.view.encode(encoder, &setup, &inputs, None)?;
        self.view.encode_composite(encoder, &world.hdr_view, HDR, viewport, Compose::Full)?;
        Ok(())
    }
}
// --- ours: end

impl Shafts {
    /// What ours holds on the GPU.
    pub fn view(&self) -> &View {
        &self.view
    }
}
