//! One pixel, texel by texel, in f64: what a technique falls back on where its own geometry degenerates.
//!
//! A scalar walk for the few pixels around an epipole or a depth edge. `raymarch-ref` has its own walk and never calls
//! this one: the judge must not sit in the judged.

use glam::DVec3;

use crate::camera::ViewRay;
use crate::frame::Frame;
use crate::map_projection::MapRay;
use crate::ray_layers::{lit_part, lit_stretches};
use crate::ray_light::RayLight;
use crate::shadow_map::{ShadowLayer, ShadowMap};
use crate::texel_walk::{TexelSpan, TexelWalk};

/// In-scattered RGB radiance \[W/(m²·sr)\] of pixel `(x, y)`, with visibility by nearest texel, exactly: f64, 1e-15 of the
/// unoccluded radiance a stretch. O(texels along the ray), no heap.
pub fn walked_radiance(frame: &Frame<'_>, x: u32, y: u32) -> DVec3 {
    let (camera, end) = (frame.camera(), frame.ray_end(x, y));
    let ray = camera.pixel_ray(x, y);
    let light = RayLight::new(frame.light(), frame.medium(), camera.eye(), &ray);
    let stretch = |a: f64, b: f64| match frame.texture() {
        None => light.interval(a, b),
        Some(texture) => {
            let mut sum = DVec3::ZERO;
            texture.pieces(camera.eye(), ray.origin, ray.direction, [a, b], |a, b, colour| {
                sum += light.interval(a, b) * DVec3::from(colour.map(f64::from));
            });
            sum
        }
    };
    let shadow = frame.shadow();
    if let ShadowMap::Cascades(_) | ShadowMap::Faces(_) = shadow {
        let mut lit = DVec3::ZERO;
        let maps = (shadow, frame.setup().maps());
        lit_stretches(maps, camera.eye(), &ray, [0.0, end], |a, b| lit += stretch(a, b));
        return lit;
    }
    // Layers that do not overlap: shadowed stretches are subtracted from the whole ray, in the order of the layers. Adding
    // up lit ones gives the same to 1e-15, but other last bits than the images that were measured have.
    let mut dark = DVec3::ZERO;
    for layer in shadow.layers() {
        let map_ray = layer.projection().ray(camera.eye(), ray.origin, ray.direction);
        for span in TexelWalk::new(layer.projection(), &map_ray, 0.0, end) {
            if let Some((a, b)) = shadowed_part(&layer, &map_ray, &span) {
                dark += stretch(a, b);
            }
        }
    }
    (stretch(0.0, end) - dark).max(DVec3::ZERO)
}

/// As [`walked_radiance`], of the part of the pixel's ray that lies beyond `from` ≥ 0 alone. O(texels along that part), no heap.
pub fn walked_beyond(frame: &Frame<'_>, x: u32, y: u32, from: f64) -> DVec3 {
    let (camera, end) = (frame.camera(), frame.ray_end(x, y));
    let from = from.min(end);
    let ray = camera.pixel_ray(x, y);
    let mut light = None;
    let mut lit = DVec3::ZERO;
    let mut add = |a: f64, b: f64| {
        // Most parts that are asked for are dark.
        let light =
            light.get_or_insert_with(|| RayLight::new(frame.light(), frame.medium(), camera.eye(), &ray));
        match frame.texture() {
            None => lit += light.interval(a, b),
            Some(texture) => {
                texture.pieces(camera.eye(), ray.origin, ray.direction, [a, b], |a, b, colour| {
                    lit += light.interval(a, b) * DVec3::from(colour.map(f64::from));
                });
            }
        }
    };
    let shadow = frame.shadow();
    let one_map = match shadow {
        ShadowMap::Orthographic(layer) | ShadowMap::Perspective(layer) => {
            lit_inside(layer, camera.eye(), &ray, [from, end], &mut add)
        }
        _ => None,
    };
    if one_map.is_none() {
        lit_stretches((shadow, frame.setup().maps()), camera.eye(), &ray, [from, end], add);
    }
    lit
}

/// As [`lit_stretches`], of a part of a ray that lies within one map: a few texels cost little more than themselves. `None`, and no
/// call of `each`, where it does not.
fn lit_inside(
    layer: &ShadowLayer<'_>,
    eye: DVec3,
    ray: &ViewRay,
    [from, end]: [f64; 2],
    each: &mut impl FnMut(f64, f64),
) -> Option<()> {
    let path = layer.projection().ray(eye, ray.origin, ray.direction);
    let is_inside = |t: f64| {
        let at = path.start + path.step * t;
        let depth = if layer.projection().is_perspective() { at.z } else { 1.0 };
        let [width, height] = layer.projection().size().map(f64::from);
        let is_within = |value: f64, size: f64| value > 0.0 && value < size * depth;
        depth > 0.0 && is_within(at.x, width) && is_within(at.y, height)
    };
    // The map's part of space is convex.
    if !(is_inside(from) && is_inside(end)) {
        return None;
    }
    let mut open: Option<[f64; 2]> = None;
    for span in TexelWalk::new(layer.projection(), &path, from, end) {
        let Some((a, b)) = lit_part(f64::from(layer.at(span.i, span.j)), &path, &span) else { continue };
        match &mut open {
            Some([_, end]) if *end == a => *end = b,
            _ => {
                if let Some([a, b]) = open.replace([a, b]) {
                    each(a, b);
                }
            }
        }
    }
    if let Some([a, b]) = open {
        each(a, b);
    }
    Some(())
}

/// The stretch of a span that lies behind the texel's surface.
fn shadowed_part(layer: &ShadowLayer<'_>, ray: &MapRay, span: &TexelSpan) -> Option<(f64, f64)> {
    let surface = f64::from(layer.at(span.i, span.j));
    let behind = |t: f64| ray.start.z + ray.step.z * t > surface;
    let crossing = ((surface - ray.start.z) / ray.step.z).clamp(span.t_min, span.t_max);
    let (a, b) = match (behind(span.t_min), behind(span.t_max)) {
        (true, true) => (span.t_min, span.t_max),
        (true, false) => (span.t_min, crossing),
        (false, true) => (crossing, span.t_max),
        (false, false) => return None,
    };
    (b > a).then_some((a, b))
}
