//! Pixels whose rays end on the very surface that the shadow map holds there.
//!
//! A map's surface is a staircase, a step a texel. Where light meets a wall that is one sheet from its other side, rays that end on
//! the wall end between the steps: the last bit of each is lit or not, other for every pixel, and no two slices tell what lies
//! between them. Beside what a whole ray scatters that is little; in the dark it is all there is, and errors of levels are
//! relative to it down to a hundredth of the picture's mean (MODEL.md, "Error figures").

use scatter_core::Frame;

/// Whether the ray of a pixel, `end` long, ends among texels of which some see its end lit and some do not. O(layers).
pub fn ends_on_steps(frame: &Frame<'_>, place: u32, end: f32) -> bool {
    if !end.is_finite() {
        return false;
    }
    let width = frame.size()[0];
    let camera = frame.camera();
    let ray = camera.pixel_ray(place % width, place / width);
    for layer in frame.shadow().layers() {
        let projection = layer.projection();
        let path = projection.ray(camera.eye(), ray.origin, ray.direction);
        let at = path.start + path.step * f64::from(end);
        let size = projection.size().map(f64::from);
        let [u, v] = if projection.is_perspective() { [at.x / at.z, at.y / at.z] } else { [at.x, at.y] };
        let inside = (0.0..size[0]).contains(&u) && (0.0..size[1]).contains(&v);
        if !inside || (projection.is_perspective() && at.z <= 0.0) {
            continue;
        }
        // The first layer that holds a point decides.
        let around = |middle: f64, size: f64| {
            let middle = middle as u32;
            middle.saturating_sub(1)..(middle + 2).min(size as u32)
        };
        let (mut lit, mut count) = (0, 0);
        for j in around(v, size[1]) {
            for i in around(u, size[0]) {
                lit += u32::from(at.z <= f64::from(layer.at(i, j)));
                count += 1;
            }
        }
        return lit != 0 && lit != count;
    }
    false
}
