//! Cameras: perspective, off-centre and orthographic, and the one ray through each pixel's centre.
//!
//! World space is right-handed, image x goes right and y goes down, row 0 is the top row (MODEL.md). Everything
//! is f64 and relative to the eye, so that an eye 10⁵ units from the origin loses nothing.

use glam::{DMat4, DVec3, DVec4};

use crate::error::{ModelError, checked, checked_direction, checked_point, checked_size};

/// A view ray: where it starts, relative to the camera's eye, and where it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewRay {
    /// Start relative to the eye: zero for a perspective camera, in the image plane for an orthographic one.
    pub origin: DVec3,
    /// Unit direction of travel, away from the camera.
    pub direction: DVec3,
}

/// How pixels become rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// All rays start at the eye; the window is measured in tangents.
    Perspective,
    /// All rays are parallel; the window is measured in world units.
    Orthographic,
}

/// An eye, an orthonormal frame, a window and an image size.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub(crate) eye: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    pub(crate) window: Window,
    pub(crate) projection: Projection,
    pub(crate) size: [u32; 2],
}

/// What the image shows, at distance 1 (perspective, tangents) or at any distance (orthographic, world units).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Left border; may be greater than `right` in a mirrored image, never equal.
    pub left: f64,
    /// Right border.
    pub right: f64,
    /// Bottom border.
    pub bottom: f64,
    /// Top border.
    pub top: f64,
}

impl Camera {
    /// A perspective camera with its window centred on the view direction and square pixels.
    ///
    /// `vertical_fov_degrees` is the full angle from bottom to top, in (0, 180); `size` is `[width, height]`.
    pub fn perspective(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        vertical_fov_degrees: f64,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let range = "an angle in (0, 180) degrees";
        let fov =
            checked("camera.vertical_fov_degrees", vertical_fov_degrees, |v| v > 0.0 && v < 180.0, range)?;
        let half_height = (0.5 * fov).to_radians().tan();
        Self::looking(eye, target, up, Projection::Perspective, Window::centred(half_height, size), size)
    }

    /// A perspective camera with any window, in tangents: jittered, tiled or for one eye of a pair.
    pub fn perspective_off_centre(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        window: Window,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        Self::looking(eye, target, up, Projection::Perspective, window, size)
    }

    /// An orthographic camera that shows `height` world units from bottom to top, with square pixels.
    pub fn orthographic(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        height: f64,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let height = checked("camera.orthographic_height", height, |v| v > 0.0, "a finite number > 0")?;
        Self::looking(eye, target, up, Projection::Orthographic, Window::centred(0.5 * height, size), size)
    }

    /// The camera of an engine: column-major `view_from_world` (rigid, looking along −z, y up) and
    /// `clip_from_view` with y up, as wgpu, Vulkan with a flipped viewport, Direct3D and Metal have it.
    ///
    /// The depth row of `clip_from_view` is not read: near and far belong to
    /// [`DepthEncoding`](crate::DepthEncoding). A jittered or off-centre projection keeps its offset.
    pub fn from_matrices(
        view_from_world: [[f64; 4]; 4],
        clip_from_view: [[f64; 4]; 4],
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let rigid_error = |problem| ModelError::Degenerate {
            what: "camera view_from_world",
            problem,
            cure: "give a rotation and a translation, column-major, without scale",
        };
        let view = DMat4::from_cols_array_2d(&view_from_world);
        let clip = DMat4::from_cols_array_2d(&clip_from_view);
        if !view.is_finite() {
            return Err(rigid_error("an entry is NaN or infinite"));
        }
        let rows = [view.row(0), view.row(1), view.row(2)].map(DVec4::truncate);
        // 1e-4: an f32 matrix of a long-lived engine camera drifts by about 1e-6; a real scale is far off.
        let orthonormal = |a: usize, b: usize| (rows[a].dot(rows[b]) - f64::from(a == b)).abs() < 1e-4;
        let is_rigid = (0..3).all(|a| (a..3).all(|b| orthonormal(a, b)));
        if !is_rigid || view.row(3) != DVec4::W {
            return Err(rigid_error("its rows are not orthonormal"));
        }
        let (right, up, forward) = orthonormalised(rows[0], rows[1], -rows[2]);
        let eye = -(view.w_axis.x * rows[0] + view.w_axis.y * rows[1] + view.w_axis.z * rows[2]);
        let (projection, window) = Window::of_projection(&clip)?;
        let camera = Self { eye, right, up, forward, window, projection, size };
        camera.checked()
    }

    fn looking(
        eye: [f64; 3],
        target: [f64; 3],
        up: [f64; 3],
        projection: Projection,
        window: Window,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let eye = checked_point("camera.eye", eye)?;
        let target = checked_point("camera.target", target)?;
        let up = checked_direction("camera.up", up)?;
        let forward = checked_direction("camera.target", (target - eye).to_array()).map_err(|_| {
            ModelError::Degenerate {
                what: "camera.target",
                problem: "it is the eye itself",
                cure: "give a point in front of the eye",
            }
        })?;
        let right = forward.cross(up);
        // Below 1e-9 the cross product is rounding noise and the image would roll at random.
        if right.length() < 1e-9 {
            return Err(ModelError::Degenerate {
                what: "camera.up",
                problem: "it is parallel to the view direction",
                cure: "give another up vector",
            });
        }
        let right = right.normalize();
        let up = right.cross(forward);
        Self { eye, right, up, forward, window, projection, size }.checked()
    }

    fn checked(self) -> Result<Self, ModelError> {
        checked_size("image", self.size)?;
        let Window { left, right, bottom, top } = self.window;
        let sane = [left, right, bottom, top].iter().all(|v| v.is_finite()) && left != right && bottom != top;
        if sane {
            Ok(self)
        } else {
            Err(ModelError::Degenerate {
                what: "camera window",
                problem: "it is empty, NaN or infinite",
                cure: "give left ≠ right and bottom ≠ top",
            })
        }
    }

    /// The ray through the centre of pixel `(x, y)`.
    pub fn pixel_ray(&self, x: u32, y: u32) -> ViewRay {
        self.ray(f64::from(x) + 0.5, f64::from(y) + 0.5)
    }

    /// The ray through the image point `(x, y)` in pixels: `(0, 0)` is the top left corner of the image and
    /// `(0.5, 0.5)` the centre of its first pixel.
    pub fn ray(&self, x: f64, y: f64) -> ViewRay {
        let Window { left, right, bottom, top } = self.window;
        let u = left + (right - left) * (x / f64::from(self.size[0]));
        let v = top + (bottom - top) * (y / f64::from(self.size[1]));
        let offset = self.right * u + self.up * v;
        match self.projection {
            Projection::Perspective => {
                ViewRay { origin: DVec3::ZERO, direction: (self.forward + offset).normalize() }
            }
            Projection::Orthographic => ViewRay { origin: offset, direction: self.forward },
        }
    }

    /// The homogeneous image point `(x·w, y·w, w)` in pixels of a world **direction** (perspective cameras: the
    /// epipole of a sun; `w ≤ 0` lies behind the camera, `w = 0` at infinity).
    pub fn image_from_direction(&self, direction: DVec3) -> DVec3 {
        self.image_from_view(direction.dot(self.right), direction.dot(self.up), direction.dot(self.forward))
    }

    /// The homogeneous image point of a world **position**, as [`Self::image_from_direction`]. For an orthographic
    /// camera `w = 1` everywhere.
    pub fn image_from_world(&self, p_world: DVec3) -> DVec3 {
        let p = p_world - self.eye;
        let w = match self.projection {
            Projection::Perspective => p.dot(self.forward),
            Projection::Orthographic => 1.0,
        };
        self.image_from_view(p.dot(self.right), p.dot(self.up), w)
    }

    fn image_from_view(&self, x: f64, y: f64, w: f64) -> DVec3 {
        let Window { left, right, bottom, top } = self.window;
        let u = (x - left * w) / (right - left) * f64::from(self.size[0]);
        let v = (y - top * w) / (bottom - top) * f64::from(self.size[1]);
        DVec3::new(u, v, w)
    }

    /// The eye in world space.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Unit vector to the right of the image.
    pub fn right(&self) -> DVec3 {
        self.right
    }

    /// Unit vector to the top of the image.
    pub fn up(&self) -> DVec3 {
        self.up
    }

    /// Unit view direction.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// What the image shows.
    pub fn window(&self) -> Window {
        self.window
    }

    /// How pixels become rays.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// `[width, height]` in pixels, each ≥ 1.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The same view at another size (pixels are no longer square where the aspect differs).
    pub fn with_size(&self, size: [u32; 2]) -> Result<Self, ModelError> {
        Self { size, ..self.clone() }.checked()
    }

    /// The same camera moved by `(x, y)` pixels on its image: what a timed loop does so that no frame repeats.
    pub fn shifted(&self, x: f64, y: f64) -> Self {
        let Window { left, right, bottom, top } = self.window;
        let dx = (right - left) * (x / f64::from(self.size[0]));
        let dy = (bottom - top) * (y / f64::from(self.size[1]));
        let window = Window { left: left + dx, right: right + dx, bottom: bottom + dy, top: top + dy };
        Self { window, ..self.clone() }
    }
}

impl Window {
    /// A window around the view direction, `2·half_height` high, with square pixels.
    pub fn centred(half_height: f64, size: [u32; 2]) -> Self {
        let half_width = half_height * f64::from(size[0]) / f64::from(size[1].max(1));
        Self { left: -half_width, right: half_width, bottom: -half_height, top: half_height }
    }

    /// Inverts the x, y and w rows of a projection matrix: x_clip = ±w_clip are the borders.
    fn of_projection(clip: &DMat4) -> Result<(Projection, Self), ModelError> {
        let error = |problem| ModelError::Degenerate {
            what: "camera clip_from_view",
            problem,
            cure: "give a perspective (last row 0 0 -1 0) or an orthographic one (last row 0 0 0 1), column-major",
        };
        let (x, y, w) = (clip.row(0), clip.row(1), clip.row(3));
        if !(x.is_finite() && y.is_finite() && w.is_finite()) {
            return Err(error("an entry is NaN or infinite"));
        }
        if x.x == 0.0 || y.y == 0.0 || x.y != 0.0 || y.x != 0.0 {
            return Err(error("it is singular or sheared"));
        }
        let (projection, shift_x, shift_y) = if w == DVec4::new(0.0, 0.0, -1.0, 0.0) {
            // x_clip = x.x·X + x.z·Z with Z = −1: the window at distance 1.
            (Projection::Perspective, -x.z, -y.z)
        } else if w == DVec4::W {
            (Projection::Orthographic, x.w, y.w)
        } else {
            return Err(error("its last row is neither"));
        };
        let border = |sign: f64, shift: f64, scale: f64| (sign - shift) / scale;
        let window = Self {
            left: border(-1.0, shift_x, x.x),
            right: border(1.0, shift_x, x.x),
            bottom: border(-1.0, shift_y, y.y),
            top: border(1.0, shift_y, y.y),
        };
        Ok((projection, window))
    }
}

/// Removes the drift of an almost orthonormal frame, keeping its handedness and `forward`.
fn orthonormalised(right: DVec3, up: DVec3, forward: DVec3) -> (DVec3, DVec3, DVec3) {
    let forward = forward.normalize();
    let up = (up - forward * up.dot(forward)).normalize();
    let right = (right - forward * right.dot(forward) - up * right.dot(up)).normalize();
    (right, up, forward)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::perspective([1e5, 2.0, -3.0], [1e5 + 1.0, 2.5, -7.0], [0.0, 1.0, 0.0], 70.0, [63, 41])
            .unwrap()
    }

    #[test]
    fn the_first_row_looks_up_and_the_first_column_looks_left() {
        let camera = camera();
        let corner = camera.pixel_ray(0, 0).direction;
        assert!(corner.dot(camera.up()) > 0.0 && corner.dot(camera.right()) < 0.0);
    }

    #[test]
    fn the_vertical_field_of_view_is_the_angle_from_bottom_to_top() {
        let camera = camera();
        let (top, bottom) = (camera.ray(31.5, 0.0).direction, camera.ray(31.5, 41.0).direction);
        // f64 acos near 70 degrees: a few ulp.
        assert!((top.dot(bottom).acos().to_degrees() - 70.0).abs() < 1e-12);
    }

    #[test]
    fn a_point_on_a_pixel_ray_projects_onto_that_pixel() {
        let height = 9.0;
        let ortho = Camera::orthographic([1.0, 2.0, 3.0], [4.0, 1.0, 0.0], [0.0, 1.0, 0.0], height, [63, 41])
            .unwrap();
        for camera in [camera(), ortho] {
            let ray = camera.ray(17.25, 33.5);
            let p = camera.image_from_world(camera.eye() + ray.origin + 7.5 * ray.direction);
            // 1e5 units from the origin a position is good to 1.5e-11; a pixel is 1e-2 of a unit there.
            assert!((p.x / p.z - 17.25).abs() < 1e-8 && (p.y / p.z - 33.5).abs() < 1e-8, "{p}");
        }
    }

    #[test]
    fn engine_matrices_give_the_camera_they_were_made_from() {
        let reference = camera();
        let view = crate::engine_matrices::look_to(reference.eye(), reference.forward(), reference.up());
        let clip =
            crate::engine_matrices::perspective_infinite_reversed(70f64.to_radians(), 63.0 / 41.0, 0.1);
        let built =
            Camera::from_matrices(view.to_cols_array_2d(), clip.to_cols_array_2d(), [63, 41]).unwrap();
        let (a, b) = (reference.pixel_ray(5, 40), built.pixel_ray(5, 40));
        assert!((a.direction - b.direction).length() < 1e-12);
        // |eye| = 1e5 goes through a product with the rotation: 1e5 · 2⁻⁵² · a few.
        assert!((reference.eye() - built.eye()).length() < 1e-9);
    }

    #[test]
    fn an_off_centre_matrix_keeps_its_offset() {
        let view = crate::engine_matrices::look_to(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y);
        let window = Window { left: -0.3, right: 0.5, bottom: -0.2, top: 0.4 };
        let mut clip = DMat4::ZERO;
        clip.x_axis.x = 2.0 / (window.right - window.left);
        clip.y_axis.y = 2.0 / (window.top - window.bottom);
        clip.z_axis.x = (window.right + window.left) / (window.right - window.left);
        clip.z_axis.y = (window.top + window.bottom) / (window.top - window.bottom);
        clip.z_axis.w = -1.0;
        let built = Camera::from_matrices(view.to_cols_array_2d(), clip.to_cols_array_2d(), [3, 2]).unwrap();
        let w = built.window();
        for (a, b) in [(w.left, -0.3), (w.right, 0.5), (w.bottom, -0.2), (w.top, 0.4)] {
            assert!((a - b).abs() < 1e-15, "{w:?}");
        }
    }

    #[test]
    fn shifting_by_a_pixel_moves_the_rays_by_a_pixel() {
        let camera = camera();
        let (a, b) = (camera.shifted(1.0, -2.0).ray(4.0, 9.0), camera.ray(5.0, 7.0));
        assert!((a.direction - b.direction).length() < 1e-15);
    }

    #[test]
    fn degenerate_cameras_are_errors_that_name_the_field() {
        let make = |target, up, fov, size| Camera::perspective([0.0; 3], target, up, fov, size);
        let (z, y) = ([0.0, 0.0, -1.0], [0.0, 1.0, 0.0]);
        let message = |result: Result<Camera, ModelError>| result.unwrap_err().to_string();
        assert!(message(make([0.0; 3], y, 60.0, [2, 3])).contains("camera.target"));
        assert!(message(make(z, z, 60.0, [2, 3])).contains("camera.up"));
        assert!(message(make(z, [0.0; 3], 60.0, [2, 3])).contains("camera.up"));
        assert!(message(make(z, y, 180.0, [2, 3])).contains("vertical_fov"));
        assert!(message(make(z, y, f64::NAN, [2, 3])).contains("vertical_fov"));
        assert!(message(make(z, y, 60.0, [0, 3])).contains("size"));
        let scaled = DMat4::from_scale(DVec3::splat(2.0)).to_cols_array_2d();
        let clip = crate::engine_matrices::perspective_infinite_reversed(1.0, 1.0, 0.1).to_cols_array_2d();
        assert!(message(Camera::from_matrices(scaled, clip, [2, 3])).contains("orthonormal"));
    }
}
