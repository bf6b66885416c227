//! Packets of 4×4 pixels: their rays in f64, and where these run through a map in f32.
//!
//! The pixels of a packet take the same step at the same time, so their look-ups fall on the same few cache lines;
//! tiles of 8×8 packets keep the lines of one packet for its neighbours.

use glam::DVec3;
use scatter_core::{Camera, Frame, MapProjection, Projection, ViewRay, Window};

use super::lanes::LANES;
use super::lookups::MapLanes;
use crate::map_segments::inside;

/// Pixels along a packet's side.
pub const PACKET_SIDE: u32 = 4;
/// Pixels along a tile's side. Smaller tiles read the map's lines more often, larger ones keep threads idle.
pub const TILE_SIDE: u32 = 32;

/// Sixteen pixels and their rays. On the image's border pixels are repeated to fill the packet.
#[derive(Debug, Clone)]
pub struct Packet {
    /// Pixel coordinates, row by row.
    pub pixels: [(u32, u32); LANES],
    /// Their rays, relative to the eye.
    pub rays: [ViewRay; LANES],
    /// Where the rays end.
    pub ends: [f64; LANES],
    /// Pixels that the image has: columns and rows of the packet.
    pub extent: [u32; 2],
}

impl Packet {
    /// The packet whose first pixel is `(x, y)`.
    #[inline(always)]
    pub fn new(frame: &Frame<'_>, x: u32, y: u32) -> Self {
        let [width, height] = frame.size();
        let extent = [PACKET_SIDE.min(width - x), PACKET_SIDE.min(height - y)];
        let pixels: [_; LANES] = std::array::from_fn(|lane| {
            let lane = lane as u32;
            (x + (lane % PACKET_SIDE).min(extent[0] - 1), y + (lane / PACKET_SIDE).min(extent[1] - 1))
        });
        Self {
            pixels,
            rays: pixel_rays(frame.camera(), &pixels),
            ends: pixels.map(|(x, y)| frame.ray_end(x, y)),
            extent,
        }
    }

    /// The lanes that stand for pixels of their own.
    pub fn own_lanes(&self) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.extent.map(|n| n as usize);
        (0..height).flat_map(move |row| (0..width).map(move |column| row * PACKET_SIDE as usize + column))
    }
}

/// [`Camera::pixel_ray`] of sixteen pixels, number by number, so that divisions and roots are taken side by side:
/// one at a time they were a quarter of a packet's set-up.
#[inline(always)]
fn pixel_rays(camera: &Camera, pixels: &[(u32, u32); LANES]) -> [ViewRay; LANES] {
    if camera.projection() == Projection::Orthographic {
        return pixels.map(|(x, y)| camera.pixel_ray(x, y));
    }
    let (Window { left, right, bottom, top }, shear) = (camera.window(), camera.shear());
    let [width, height] = camera.size().map(f64::from);
    let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
    for lane in 0..LANES {
        let down = (f64::from(pixels[lane].1) + 0.5) / height;
        u[lane] = left + (right - left) * ((f64::from(pixels[lane].0) + 0.5) / width) + shear * down;
        v[lane] = top + (bottom - top) * down;
    }
    let mut axes = [[0.0; LANES]; 3];
    for (axis, values) in axes.iter_mut().enumerate() {
        let (forward, right, up) = (camera.forward()[axis], camera.right()[axis], camera.up()[axis]);
        for lane in 0..LANES {
            values[lane] = forward + (right * u[lane] + up * v[lane]);
        }
    }
    let mut shrink = [0.0; LANES];
    for lane in 0..LANES {
        let [x, y, z] = axes.map(|values| values[lane]);
        shrink[lane] = 1.0 / (x * x + y * y + z * z).sqrt();
    }
    std::array::from_fn(|lane| ViewRay {
        origin: DVec3::ZERO,
        direction: DVec3::from(axes.map(|values| values[lane])) * shrink[lane],
    })
}

/// A ray's part that is marched, and what a step of its linear parameter is.
#[derive(Debug, Clone, Copy, Default)]
pub struct Span {
    /// Start of the part on the ray \[world units\].
    pub start: f64,
    /// Its end, finite.
    pub end: f64,
}

/// A ray near a lamp: the foot of the perpendicular from the lamp on it, and the distance.
#[derive(Debug, Clone, Copy, Default)]
pub struct Foot {
    /// Ray parameter of the foot \[world units\].
    pub closest: f64,
    /// Distance of the lamp, clamped as the model says \[world units\], > 0.
    pub distance: f64,
}

/// The rays of a packet near a lamp in one map; whether all parts that are marched stay inside of it.
pub fn lamp_lanes(
    projection: &MapProjection,
    eye: DVec3,
    rays: &[ViewRay; LANES],
    feet: &[Foot; LANES],
    spans: &[Span; LANES],
) -> (MapLanes, bool) {
    let mut lanes = MapLanes::default();
    let mut all_inside = true;
    for lane in 0..LANES {
        let (ray, foot, span) = (&rays[lane], feet[lane], spans[lane]);
        let path = projection.ray(eye, ray.origin, ray.direction);
        all_inside &= inside(projection, &path, span.start, span.end) == Some((span.start, span.end))
            || span.start >= span.end;
        set_lamp_lane(&mut lanes, lane, path.start + path.step * foot.closest, path.step * foot.distance);
    }
    (lanes, all_inside)
}

/// The rays of a packet along the world's axes, from the lamp.
pub fn cube_lanes(centre: DVec3, eye: DVec3, rays: &[ViewRay; LANES], feet: &[Foot; LANES]) -> MapLanes {
    let mut lanes = MapLanes::default();
    for lane in 0..LANES {
        let (ray, foot) = (&rays[lane], feet[lane]);
        let start = (eye - centre) + ray.origin + ray.direction * foot.closest;
        set_lamp_lane(&mut lanes, lane, start, ray.direction * foot.distance);
    }
    lanes
}

fn set_lamp_lane(lanes: &mut MapLanes, lane: usize, start: DVec3, step: DVec3) {
    for axis in 0..3 {
        lanes.start[axis][lane] = start[axis] as f32;
        lanes.step[axis][lane] = step[axis] as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_side_by_side_are_those_of_the_camera() {
        let (eye, target, up) = ([3.0, -1.0, 1e5], [0.3, 2.0, 1e5 - 4.0], [0.1, 1.0, 0.2]);
        let window = Window { left: -0.7, right: 1.1, bottom: -0.2, top: 0.9 };
        for camera in [
            Camera::perspective_off_centre(eye, target, up, window, [37, 21]).unwrap(),
            Camera::orthographic(eye, target, up, 5.0, [37, 21]).unwrap(),
        ] {
            let pixels = std::array::from_fn(|lane| (2 * lane as u32, lane as u32));
            for (ray, (x, y)) in pixel_rays(&camera, &pixels).iter().zip(pixels) {
                let exact = camera.pixel_ray(x, y);
                assert_eq!(ray.origin, exact.origin);
                // Three roundings of f64.
                assert!((ray.direction - exact.direction).length() < 4e-16, "{ray:?} {exact:?}");
            }
        }
    }
}
