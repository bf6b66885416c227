//! The engine's textures, and whether they fit a frame.

use scatter_core::{MapProjection, Setup};
use scatter_kernels::ShadowDepth;

use crate::error::GpuError;

/// What the engine rendered. Textures, not views: so what is wrong with one can be named. Needed usage: `TEXTURE_BINDING`.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Depth of the camera's view: a depth format or r32float, of one or several samples.
    pub depth: &'a wgpu::Texture,
    /// Its layer.
    pub depth_layer: u32,
    /// First pixel, width and height of the camera in it; the size is the camera's.
    pub viewport: [u32; 4],
    /// Maps of the light, in layers or an atlas; `None` without a shadow.
    pub shadow: Option<&'a wgpu::Texture>,
    /// Colours in front of the light: linear RGB.
    pub glass: Option<&'a wgpu::Texture>,
}

impl Inputs<'_> {
    pub(crate) fn check(&self, setup: &Setup<'_>, shadow: &[ShadowDepth]) -> Result<(), GpuError> {
        let [x, y, width, height] = self.viewport;
        let bad = |which, problem: String, cure| Err(GpuError::Texture { which, problem, cure });
        if [width, height] != setup.size() {
            let [w, h] = setup.size();
            return bad(
                "depth",
                format!("has a viewport of {width}x{height} and the camera an image of {w}x{h}"),
                "give both the same size",
            );
        }
        check_texture("depth", self.depth, self.depth_layer)?;
        if !fits(self.depth, [x, y], [width, height]) {
            return bad(
                "depth",
                format!("is smaller than the viewport {:?}", self.viewport),
                "give a larger texture",
            );
        }
        let projections = setup.maps().projections();
        match self.shadow {
            None if projections.is_empty() => {}
            None => return bad("shadow", "is missing".into(), "give the maps, or a set-up without"),
            Some(texture) => {
                for (projection, depth) in projections.iter().zip(shadow) {
                    check_texture("shadow", texture, depth.layer)?;
                    if texture.sample_count() > 1 {
                        return bad("shadow", "has several samples".into(), "give maps of one sample");
                    }
                    check_size("shadow", texture, projection, depth.origin)?;
                }
            }
        }
        match (self.glass, setup.texture()) {
            (None, None) => {}
            (Some(texture), Some(projection)) => {
                check_format("glass", texture)?;
                check_size("glass", texture, projection, [0; 2])?;
            }
            (None, Some(_)) => return bad("glass", "is missing".into(), "give it, or a set-up without"),
            (Some(_), None) => return bad("glass", "has no projection".into(), "add it to the set-up"),
        }
        Ok(())
    }
}

fn check_size(
    which: &'static str,
    texture: &wgpu::Texture,
    projection: &MapProjection,
    origin: [u32; 2],
) -> Result<(), GpuError> {
    let [width, height] = projection.size();
    if fits(texture, origin, [width, height]) {
        return Ok(());
    }
    Err(GpuError::Texture {
        which,
        problem: format!(
            "is {}x{} and a map of {width}x{height} starts at {origin:?}",
            texture.width(),
            texture.height()
        ),
        cure: "give the map's size in texels to its projection",
    })
}

fn fits(texture: &wgpu::Texture, origin: [u32; 2], size: [u32; 2]) -> bool {
    let end = |axis: usize| origin[axis].checked_add(size[axis]);
    end(0).is_some_and(|end| end <= texture.width()) && end(1).is_some_and(|end| end <= texture.height())
}

fn check_texture(which: &'static str, texture: &wgpu::Texture, layer: u32) -> Result<(), GpuError> {
    if layer >= texture.depth_or_array_layers() {
        return Err(GpuError::Texture {
            which,
            problem: format!("has {} layers and layer {layer} is asked for", texture.depth_or_array_layers()),
            cure: "count layers from 0",
        });
    }
    check_format(which, texture)
}

fn check_format(which: &'static str, texture: &wgpu::Texture) -> Result<(), GpuError> {
    let bad = |problem: String, cure| Err(GpuError::Texture { which, problem, cure });
    if texture.dimension() != wgpu::TextureDimension::D2 {
        return bad("is not two-dimensional".into(), "give a D2 texture");
    }
    if !texture.usage().contains(wgpu::TextureUsages::TEXTURE_BINDING) {
        return bad("lacks the usage TEXTURE_BINDING".into(), "add it where the texture is made");
    }
    let format = texture.format();
    let readable = matches!(
        format.sample_type(Some(aspect_of(format)), None),
        Some(wgpu::TextureSampleType::Depth | wgpu::TextureSampleType::Float { .. })
    );
    if !readable {
        return bad(format!("has the format {format:?}"), "give a depth format or one of floats");
    }
    Ok(())
}

/// The aspect that shaders read.
pub(crate) fn aspect_of(format: wgpu::TextureFormat) -> wgpu::TextureAspect {
    if format.has_depth_aspect() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All }
}
