//! The same picture by the CPU's technique: the engine's depth buffer and cascades read back and decoded, composed alike.

use std::error::Error;

use minmax_mipmap::{MinMaxMipmap, Options};
use scatter_core::{Camera, DepthMap, Frame, Light, Medium, ScatterImage, ShadowMap, VolumetricShadow};
use scatter_gpu::harness::HarnessDevice;
use scatter_gpu::wgpu;
use scatter_scene::RadianceImage;

use crate::matrices::{CASCADES, Matrices};
use crate::shafts::{CAMERA_DEPTH, CASCADE_DEPTH};
use crate::world::World;

/// In-scattered light over `opaque`, the engine's picture before its shafts.
pub fn composed_on_cpu(
    device: &HarnessDevice,
    world: &World,
    matrices: &Matrices,
    (light, medium, reach): (&Light, &Medium, f64),
    opaque: &RadianceImage,
) -> Result<RadianceImage, Box<dyn Error>> {
    let [view, clip] = [matrices.view_from_world, matrices.clip_from_view].map(|m| m.to_cols_array_2d());
    let camera = Camera::from_matrices(view, clip, opaque.size)?;
    let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&device.read_layer(&world.depth, 0, 4));
    let mut distances = Vec::new();
    CAMERA_DEPTH.decode(&camera, &texels, &mut distances)?;

    let map = [world.cascades.width(), world.cascades.height()];
    let layers = (0..CASCADES as u32).flat_map(|layer| device.read_layer(&world.cascades, layer, 4));
    let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&layers.collect::<Vec<u8>>());
    let cascades = matrices.cascades.map(|cascade| cascade.to_cols_array_2d());
    let mut depths = Vec::new();
    let layers = CASCADE_DEPTH.layers(&cascades, map, &texels, &mut depths)?;
    let shadow = ShadowMap::Cascades(&layers);

    let depth = DepthMap::new(&distances, opaque.size)?;
    let frame = Frame::new(&camera, depth, light, &shadow, medium, reach)?;
    let mut image = ScatterImage::new();
    MinMaxMipmap::new(Options::default()).render(&frame, &mut image)?;
    let pixels = opaque.pixels.iter().zip(image.inscattered()).zip(image.transmittance());
    let pixels = pixels.map(|((behind, inscattered), through)| {
        std::array::from_fn(|c| inscattered[c] + through[c] * behind[c])
    });
    Ok(RadianceImage { size: opaque.size, pixels: pixels.collect() })
}

/// A picture of half floats, read back.
pub fn picture(device: &HarnessDevice, texture: &wgpu::Texture) -> RadianceImage {
    let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&device.read_layer(texture, 0, 8));
    let pixels = texels.iter().map(|&[r, g, b, _]| [r, g, b].map(half)).collect();
    RadianceImage { size: [texture.width(), texture.height()], pixels }
}

/// A half float ≥ 0 as f32.
fn half(bits: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023));
    if exponent == 0 {
        return mantissa * 2f32.powi(-24);
    }
    (1.0 + mantissa / 1024.0) * 2f32.powi(exponent - 15)
}

/// Root of the mean square of the difference over the mean of `b`.
pub fn rel_rmse(a: &RadianceImage, b: &RadianceImage) -> f64 {
    let pairs = || {
        a.pixels.iter().flatten().zip(b.pixels.iter().flatten()).map(|(&a, &b)| (f64::from(a), f64::from(b)))
    };
    let count = pairs().count() as f64;
    let mean = pairs().map(|(_, b)| b).sum::<f64>() / count;
    (pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count).sqrt() / mean
}
