//! The engine's matrices of a frame, as it gives them to its own vertex shader: f32, column-major, reversed z.

use glam::dcamera::rh::{proj::directx, view};
use glam::{DMat4, DVec3};
use scatter_core::{Camera, Projection};
use scatter_scene::Shot;

use crate::NEAR;

/// How many maps the sun has.
pub const CASCADES: usize = 4;
/// Weight of the logarithmic split against the even one.
const LOGARITHMIC_SHARE: f64 = 0.65;

/// What the vertex shader multiplies with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrices {
    /// World to the camera's space.
    pub view_from_world: DMat4,
    /// Camera's space to clip space: z is 1 at the near plane and 0 at infinity.
    pub clip_from_view: DMat4,
    /// World to the clip space of each cascade, the nearest first: z is 1 next to the sun.
    pub cascades: [DMat4; CASCADES],
}

/// Where a shot is seen from and by which sun.
#[derive(Debug, Clone)]
pub struct Viewpoint {
    eye: DVec3,
    right: DVec3,
    forward: DVec3,
    up: DVec3,
    half_height: f64,
    aspect: f64,
    sun: DVec3,
    corners: [DVec3; 2],
    reach: f64,
    map: u32,
}

impl Viewpoint {
    /// Of a shot with a perspective camera; maps of `map`² texels.
    pub fn new(shot: &Shot, sun: DVec3, map: u32) -> Result<Self, String> {
        let camera: &Camera = &shot.camera;
        if camera.projection() != Projection::Perspective {
            return Err(format!(
                "{}: this engine has perspective cameras only; give another shot",
                shot.name
            ));
        }
        let corners = shot
            .scene
            .positions
            .iter()
            .fold([DVec3::MAX, DVec3::MIN], |[low, high], &p| [low.min(p), high.max(p)]);
        let farthest = (0..8).map(|index| corner(corners, index).distance(camera.eye())).fold(0.0, f64::max);
        let [width, height] = camera.size();
        Ok(Self {
            eye: camera.eye(),
            right: camera.right(),
            forward: camera.forward(),
            up: camera.up(),
            half_height: camera.window().top,
            aspect: f64::from(width) / f64::from(height),
            sun,
            corners,
            reach: farthest.min(shot.max_distance).max(4.0 * NEAR),
            map,
        })
    }

    /// Seen from `moved` world units to the right.
    pub fn matrices(&self, moved: f64) -> Matrices {
        let eye = self.eye + moved * self.right;
        let view_from_world = view::look_to_mat4(eye, self.forward, self.up);
        let fov = 2.0 * self.half_height.atan();
        let clip_from_view = directx::perspective_infinite_reverse(fov, self.aspect, NEAR);
        let cascades = std::array::from_fn(|index| as_f32(self.cascade(eye, index)));
        Matrices {
            view_from_world: as_f32(view_from_world),
            clip_from_view: as_f32(clip_from_view),
            cascades,
        }
    }

    /// A square around the sphere of a stretch of the view, moved by whole texels so that shadows do not swim.
    fn cascade(&self, eye: DVec3, index: usize) -> DMat4 {
        let [near, far] = [index, index + 1].map(|end| self.split(end));
        let half = [self.half_height * self.aspect, self.half_height];
        let ends = [near, far].map(|depth| {
            [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|[x, y]: [f64; 2]| {
                eye + depth * (self.forward + x * half[0] * self.right + y * half[1] * self.up)
            })
        });
        let middle = ends.iter().flatten().sum::<DVec3>() / 8.0;
        let radius = ends.iter().flatten().map(|end| end.distance(middle)).fold(0.0, f64::max);
        let light_from_world = view::look_to_mat4(DVec3::ZERO, self.sun, self.sun.any_orthonormal_vector());
        let texel = 2.0 * radius / f64::from(self.map);
        let at = (light_from_world.transform_point3(middle) / texel).floor() * texel;
        // Near and far planes hold the scene: what is between the sun and the view casts shadows into it.
        let depths = (0..8).map(|index| -light_from_world.transform_point3(corner(self.corners, index)).z);
        let [low, high] = depths.fold([f64::MAX, f64::MIN], |[low, high], z| [low.min(z), high.max(z)]);
        let margin = 0.01 * (high - low) + 0.01;
        let (low, high) = (low - margin, high + margin);
        directx::orthographic(at.x - radius, at.x + radius, at.y - radius, at.y + radius, high, low)
            * light_from_world
    }

    /// Depth at which a cascade ends and the next one begins.
    fn split(&self, end: usize) -> f64 {
        let share = end as f64 / CASCADES as f64;
        let even = NEAR + (self.reach - NEAR) * share;
        let logarithmic = NEAR * (self.reach / NEAR).powf(share);
        LOGARITHMIC_SHARE * logarithmic + (1.0 - LOGARITHMIC_SHARE) * even
    }
}

/// As the shader has it: rounded, so that what is decoded is what was drawn.
fn as_f32(matrix: DMat4) -> DMat4 {
    matrix.as_mat4().as_dmat4()
}

fn corner([low, high]: [DVec3; 2], index: usize) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|axis| if index >> axis & 1 == 0 { low[axis] } else { high[axis] }))
}
