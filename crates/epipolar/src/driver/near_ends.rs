//! Rays that end on the very surface that the shadow map holds there, cut a few texels before their ends.
//!
//! A map's surface is a staircase, a step a texel. Where light meets a wall that is one sheet from its other side, rays that end on
//! the wall end between the steps: the last bit of each is lit or not, other for every pixel, and no two slices tell what lies
//! between them, however close they are. Beside what a whole ray scatters that is little; in the dark it is all there is, and
//! errors of levels are relative to it down to a hundredth of the picture's mean (MODEL.md, "Error figures"). So slices are asked
//! up to a point before the steps, and what lies beyond it is walked, texel by texel: a few of them a pixel.

use scatter_core::{Frame, RayLanes, parallel, walked_beyond};

/// Texels before its end in which a ray is cut. More cost more, fewer leave rays at a grazing angle among steps.
const TEXELS: f64 = 6.0;

/// Largest part of a ray that is cut off: beyond that a texel is as large as what is seen.
const MOST_CUT: f64 = 0.5;

/// Where the rays of a frame's pixels are cut; a buffer.
#[derive(Debug, Default)]
pub struct NearEnds {
    /// A number a pixel; empty if none is cut.
    ends: Vec<f32>,
}

impl NearEnds {
    /// Cuts those rays of a frame that end on steps of its map. O(pixels · layers).
    pub fn find(&mut self, frame: &Frame<'_>) {
        let [width, height] = frame.size().map(|side| side as usize);
        self.ends.clear();
        self.ends.extend_from_slice(&frame.depth().texels()[..width * height]);
        parallel::for_each_row(&mut self.ends, width, |y, ends| {
            for (x, end) in ends.iter_mut().enumerate() {
                if let Some(cut) = cut_end(frame, [x as u32, y as u32]) {
                    *end = cut as f32;
                }
            }
        });
    }

    /// Where rays are cut, a number a pixel, if some are.
    pub fn ends(&self) -> Option<&[f32]> {
        (!self.ends.is_empty()).then_some(&self.ends[..])
    }

    /// Where slices are asked that the rays end, a number a pixel; without those that are cut the frame's own depth.
    pub fn or_depth<'a>(&'a self, frame: &Frame<'a>) -> &'a [f32] {
        if self.ends.is_empty() { frame.depth().texels() } else { &self.ends }
    }

    /// Adds what rays scatter beyond their cuts to the radiance of up to sixteen pixels of a row from `(x, y)` on, but for those of the
    /// lanes `except`.
    pub fn add_beyond(
        &self,
        frame: &Frame<'_>,
        [x, y]: [u32; 2],
        lanes: usize,
        except: u32,
        radiance: &mut [[f32; RayLanes::COUNT]; 3],
    ) {
        let first = (y * frame.size()[0] + x) as usize;
        let Some(cuts) = self.ends.get(first..first + lanes) else { return };
        for (lane, (&cut, &end)) in cuts.iter().zip(&frame.depth().texels()[first..]).enumerate() {
            if cut < end && except & 1 << lane == 0 {
                let beyond = walked_beyond(frame, x + lane as u32, y, f64::from(cut)).as_vec3().to_array();
                for (values, beyond) in radiance.iter_mut().zip(beyond) {
                    values[lane] += beyond;
                }
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * self.ends.capacity()
    }

    /// Room for a frame's pixels, of which none is cut.
    pub fn reserve(&mut self, pixels: usize) {
        self.ends.clear();
        self.ends.reserve(pixels);
    }
}

/// Whether the ray of a pixel ends on steps of the frame's map: see [`NearEnds`].
pub fn ends_on_steps(frame: &Frame<'_>, place: u32) -> bool {
    let width = frame.size()[0];
    cut_end(frame, [place % width, place / width]).is_some()
}

/// Where the ray of a pixel is cut if it ends among texels of which some see its end lit and some do not; `None` where it is not.
fn cut_end(frame: &Frame<'_>, [x, y]: [u32; 2]) -> Option<f64> {
    let end = frame.ray_end(x, y);
    // Rays that end in the air end on no surface.
    if !(end < frame.max_distance()) {
        return None;
    }
    let camera = frame.camera();
    let ray = camera.pixel_ray(x, y);
    for layer in frame.shadow().layers() {
        let projection = layer.projection();
        let path = projection.ray(camera.eye(), ray.origin, ray.direction);
        let at = path.start + path.step * end;
        let [width, height] = projection.size();
        let depth = if projection.is_perspective() { at.z } else { 1.0 };
        let (u, v) = (at.x / depth, at.y / depth);
        // The first layer that holds the point decides.
        let is_inside = (0.0..f64::from(width)).contains(&u) && (0.0..f64::from(height)).contains(&v);
        if !(depth > 0.0 && is_inside) {
            continue;
        }
        let around = |middle: f64, size: u32| {
            let middle = middle as u32;
            middle.saturating_sub(1)..(middle + 2).min(size)
        };
        let (mut lit, mut count) = (0, 0);
        for j in around(v, height) {
            for i in around(u, width) {
                lit += u32::from(at.z <= f64::from(layer.at(i, j)));
                count += 1;
            }
        }
        if lit == 0 || lit == count {
            return None;
        }
        // Texels that the ray crosses a unit of its length, where it ends.
        let along = if projection.is_perspective() { path.step.z } else { 0.0 };
        let crossed = [path.step.x - u * along, path.step.y - v * along].map(|step| (step / depth).abs());
        let cut = end - TEXELS / crossed[0].max(crossed[1]);
        return (cut > (1.0 - MOST_CUT) * end).then_some(cut);
    }
    None
}
