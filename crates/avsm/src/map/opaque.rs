//! The opaque surface on the light ray through a curve map's texel, as the shadow map has it.

use scatter_core::{MapProjection, ShadowMap};

/// Depth, in the curve map, of what the shadow map stores on the light ray through the centre of texel `(i, j)`; `+∞` if it
/// stores nothing there. By nearest texel, of layer `own` if the ray lies in it, else of the first that contains the ray: a
/// cascade's curves go on where the finer one ends.
pub fn opaque_depth(shadow: &ShadowMap<'_>, own: usize, map: &MapProjection, [i, j]: [u32; 2]) -> f32 {
    let Some((origin, step)) = map.light_ray(f64::from(i) + 0.5, f64::from(j) + 0.5) else {
        return f32::INFINITY;
    };
    let found = shadow.layer(own).into_iter().chain(shadow.layers()).find_map(|layer| {
        let projection = layer.projection();
        // The ray has one place in a map of the same light, whatever its depth: that of its way from a lamp, where all rays
        // start, and of its start in a sun's.
        let path = projection.ray(origin, glam::DVec3::ZERO, step);
        let place = if projection.is_perspective() { path.step } else { path.start };
        let [u, v] = if projection.is_perspective() {
            [place.x / place.z, place.y / place.z]
        } else {
            [place.x, place.y]
        };
        let [width, height] = projection.size().map(f64::from);
        let in_front = !projection.is_perspective() || place.z > 0.0;
        let inside = in_front && u >= 0.0 && v >= 0.0 && u < width && v < height;
        inside.then(|| (f64::from(layer.at(u as u32, v as u32)) - path.start.z) / path.step.z)
    });
    // Depths before the plane that the curve map begins at shadow all of it.
    found.map_or(f32::INFINITY, |depth| depth.max(0.0) as f32)
}
