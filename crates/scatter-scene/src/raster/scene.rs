//! A scene on a device: its depth and shadow maps, in the very conventions of the ray casts.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DMat4;
use rayon::prelude::*;
use scatter_core::{Camera, MapError, MapProjection, MapSource, ModelError};

use super::cards::Cards;
use super::device::RasterDevice;
use super::doubt::{Occluders, texels_in_doubt};
use super::error::RasterError;
use super::mesh::Mesh;
use super::pass::{DepthPass, SceneBox};
use super::pipeline::Pipelines;
use super::target::Target;
use crate::caster::{SceneCaster, TexelLines};

/// A scene's triangles on a device, ready to be drawn from anywhere.
///
/// Several threads may ask for maps; they are drawn one after the other.
pub struct RasterScene {
    device: RasterDevice,
    caster: Arc<SceneCaster>,
    /// Whether rays decide the texels that the device's grid leaves in doubt.
    decides: bool,
    pipelines: Pipelines,
    mesh: Mesh,
    /// None for a scene without cut-outs.
    cards: Option<Cards>,
    /// None for a scene without triangles.
    scene: Option<SceneBox>,
    /// Kept for the next map of the same size.
    target: Mutex<Option<Target>>,
}

impl RasterScene {
    /// Uploads the caster's triangles: the same welded ones that rays are cast against. The caster decides the texels
    /// that the device's grid leaves in doubt.
    pub fn new(device: &RasterDevice, caster: Arc<SceneCaster>) -> Result<Self, RasterError> {
        let centre = caster.bvh().centre;
        let pipelines = Pipelines::new(&device.0, !caster.cards().is_empty())?;
        Ok(Self {
            device: device.clone(),
            decides: true,
            mesh: Mesh::new(&device.0, &caster)?,
            cards: Cards::new(&device.0, pipelines.masks, &caster)?,
            pipelines,
            scene: caster.bounds().map(|bounds| SceneBox { centre, bounds }),
            target: Mutex::new(None),
            caster,
        })
    }

    /// The same scene with maps as the device draws them: faster on a fast device, and silhouettes are off by as much as
    /// its grid.
    pub fn as_drawn(self) -> Self {
        Self { decides: false, ..self }
    }

    /// The device.
    pub fn device(&self) -> &RasterDevice {
        &self.device
    }

    /// Bytes of the mesh on the device.
    pub fn memory_bytes(&self) -> u64 {
        self.mesh.memory_bytes() + self.cards.as_ref().map_or(0, Cards::memory_bytes)
    }

    /// Fills `out`, `[y][x]`, with the distance along each pixel's ray to its first surface; `+∞` for no surface.
    /// Resizes `out` to the camera's image.
    pub fn depth_map(&self, camera: &Camera, out: &mut Vec<f32>) -> Result<(), RasterError> {
        let [width, height] = camera.size();
        self.resize(out, camera.size(), 1)?;
        let Some(scene) = &self.scene else { return Ok(()) };
        let pass = DepthPass::of_camera(scene, camera);
        let doubts = self.draw(&pass, out)?;
        debug_assert_eq!(out.len(), width as usize * height as usize, "one texel a pixel");
        out.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
            for (x, depth) in row.iter_mut().enumerate().filter(|(_, depth)| depth.is_finite()) {
                let direction = camera.pixel_ray(x as u32, y as u32).direction;
                *depth = (f64::from(*depth) / direction.dot(camera.forward())) as f32;
            }
        });
        decide(&doubts, width, out, |x, y| self.caster.pixel_distance(camera, x, y));
        Ok(())
    }

    /// Fills `out`, `[row][column]`, with the depth of the first surface at each texel's centre; `+∞` for no surface.
    /// Resizes `out`.
    ///
    /// Surfaces before the near plane of a parallel map count, at depth 0: they shadow all that the map sees.
    pub fn shadow_map(&self, projection: &MapProjection, out: &mut Vec<f32>) -> Result<(), RasterError> {
        self.resize(out, projection.size(), 1)?;
        self.shadow_texels(projection, out)
    }

    /// Fills `out`, `[face][row][column]`, with the six faces around `position`. Resizes `out`.
    pub fn cube_map(&self, position: [f64; 3], size: u32, out: &mut Vec<f32>) -> Result<(), RasterError> {
        let faces = (0..6)
            .map(|face| MapProjection::cube_face(position, face, size))
            .collect::<Result<Vec<_>, _>>()?;
        self.resize(out, [size; 2], 6)?;
        let area = size as usize * size as usize;
        faces.iter().zip(out.chunks_mut(area)).try_for_each(|(face, texels)| self.shadow_texels(face, texels))
    }

    fn shadow_texels(&self, projection: &MapProjection, out: &mut [f32]) -> Result<(), RasterError> {
        let Some(scene) = &self.scene else { return Ok(()) };
        let pass = DepthPass::of_map(scene, projection).ok_or(ModelError::Degenerate {
            what: "shadow map projection",
            problem: "it is singular",
            cure: "give an invertible projection",
        })?;
        let doubts = self.draw(&pass, out)?;
        decide(&doubts, projection.size()[0], out, |column, row| {
            self.caster.texel_depth(projection, column, row)
        });
        Ok(())
    }

    /// `count` maps of no surface at all.
    fn resize(&self, out: &mut Vec<f32>, size: [u32; 2], count: usize) -> Result<(), RasterError> {
        self.check(size)?;
        out.clear();
        let texels = size[0] as usize * size[1] as usize * count;
        let bytes = texels as u64 * size_of::<f32>() as u64;
        // A map is by far the largest thing here: failing to hold it is an error, not the end of the process.
        out.try_reserve_exact(texels).map_err(|_| RasterError::OutOfHostMemory { bytes })?;
        out.resize(texels, f32::INFINITY);
        Ok(())
    }

    fn check(&self, [width, height]: [u32; 2]) -> Result<(), RasterError> {
        let limit = self.device.largest_map();
        if width.max(height) > limit {
            return Err(RasterError::TooLarge { width, height, limit });
        }
        Ok(())
    }

    /// Draws the pass; returns the texels that rays are to decide.
    fn draw(&self, pass: &DepthPass, out: &mut [f32]) -> Result<Vec<u32>, RasterError> {
        let device = &self.device.0;
        let mut target = self.target.lock().unwrap_or_else(PoisonError::into_inner);
        // The old image goes before the new one comes: both together may not fit.
        let mut usable = target.take().filter(|target| target.fits(pass));
        if usable.is_none() {
            usable = Some(Target::new(device, pass.size)?);
        }
        let target = target.insert(match usable {
            Some(usable) => usable,
            None => return Ok(Vec::new()),
        });
        target.render(device, &self.pipelines, (&self.mesh, self.cards.as_ref()), pass, out)?;
        if !self.decides {
            return Ok(Vec::new());
        }
        Ok(texels_in_doubt(&pass.screen, device.grid, &Occluders::of(&self.caster), out))
    }
}

impl MapSource for RasterScene {
    fn depth_map(&self, camera: &Camera, out: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(Self::depth_map(self, camera, out)?)
    }

    fn shadow_map(&self, projection: &MapProjection, out: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(Self::shadow_map(self, projection, out)?)
    }

    fn cube_map(&self, position: [f64; 3], size: u32, out: &mut Vec<f32>) -> Result<(), MapError> {
        Ok(Self::cube_map(self, position, size, out)?)
    }

    fn clip_map(
        &self,
        clip_from_world: [[f64; 4]; 4],
        size: [u32; 2],
        out: &mut Vec<f32>,
    ) -> Result<(), MapError> {
        let clip = DMat4::from_cols_array_2d(&clip_from_world);
        let lines = TexelLines::new(&clip, size)?;
        Ok(self.draw_clip(&clip, &lines, size, out)?)
    }
}

impl From<RasterError> for MapError {
    fn from(error: RasterError) -> Self {
        match error {
            RasterError::Model(error) => Self::Model(error),
            error => Self::Source(error.to_string()),
        }
    }
}

impl RasterScene {
    fn draw_clip(
        &self,
        clip: &DMat4,
        lines: &TexelLines,
        size: [u32; 2],
        out: &mut Vec<f32>,
    ) -> Result<(), RasterError> {
        self.resize(out, size, 1)?;
        let Some(scene) = &self.scene else { return Ok(()) };
        let pass = DepthPass::of_clip(scene, [0, 1, 2, 3].map(|row| clip.row(row)), size);
        let doubts = self.draw(&pass, out)?;
        decide(&doubts, size[0], out, |column, row| lines.first_depth(&self.caster, column, row));
        Ok(())
    }
}

/// Casts a ray for each of `doubts`, in parallel.
fn decide(doubts: &[u32], width: u32, out: &mut [f32], cast: impl Fn(u32, u32) -> f32 + Sync) {
    let depths: Vec<f32> = doubts.par_iter().map(|index| cast(index % width, index / width)).collect();
    for (&index, depth) in doubts.iter().zip(depths) {
        out[index as usize] = depth;
    }
}

impl fmt::Debug for RasterScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RasterScene")
            .field("device", &self.device)
            .field("bytes", &self.memory_bytes())
            .finish_non_exhaustive()
    }
}
