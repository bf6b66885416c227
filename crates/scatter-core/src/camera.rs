//! Cameras: perspective, off-centre and orthographic, and the one ray through each pixel's centre.
//!
//! Whatever matrices an engine hands over, a perspective image is a homography of the rays through one eye and a parallel
//! one an affine image of a plane. By a QR factorisation that is an orthonormal frame, a window and one shear; rays of a
//! parallel camera may besides run at an angle to the frame.
//!
//! World space is right-handed, image x goes right and y goes down, row 0 is the top row (MODEL.md). Everything
//! is f64 and relative to the eye, so that an eye 10⁵ units from the origin loses nothing.

use glam::DVec3;

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
    /// All rays are parallel, square to the window or oblique; the window is measured in world units.
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
    /// How far the window's bottom lies to the right of its top, in the window's unit; 0 but for sheared matrices.
    pub(crate) shear: f64,
    /// Unit direction of a parallel camera's rays; `forward` but for oblique projections, and for perspectives.
    pub(crate) travel: DVec3,
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
        Self { eye, right, up, forward, window, shear: 0.0, travel: forward, projection, size }.checked()
    }

    pub(crate) fn checked(self) -> Result<Self, ModelError> {
        checked_size("image", self.size)?;
        let Window { left, right, bottom, top } = self.window;
        let sane = [left, right, bottom, top, self.shear].iter().all(|v| v.is_finite())
            && left != right
            && bottom != top;
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
        let [u, v] = self.window_from_image(x, y);
        let offset = self.right * u + self.up * v;
        match self.projection {
            Projection::Perspective => {
                ViewRay { origin: DVec3::ZERO, direction: (self.forward + offset).normalize() }
            }
            Projection::Orthographic => ViewRay { origin: offset, direction: self.travel },
        }
    }

    /// Where the image point `(x, y)` in pixels lies in the window: how far along [`Self::right`] and [`Self::up`], in
    /// tangents (perspective) or world units (parallel). The ray of a perspective runs along
    /// `forward + right·u + up·v`; that of a parallel camera starts at `eye + right·u + up·v`.
    pub fn window_from_image(&self, x: f64, y: f64) -> [f64; 2] {
        let Window { left, right, bottom, top } = self.window;
        let down = y / f64::from(self.size[1]);
        let u = left + (right - left) * (x / f64::from(self.size[0])) + self.shear * down;
        [u, top + (bottom - top) * down]
    }

    /// The homogeneous image point `(x·w, y·w, w)` in pixels of a world **direction** (perspective cameras: the
    /// epipole of a sun; `w ≤ 0` lies behind the camera, `w = 0` at infinity).
    pub fn image_from_direction(&self, direction: DVec3) -> DVec3 {
        self.image_from_view(direction.dot(self.right), direction.dot(self.up), direction.dot(self.forward))
    }

    /// The homogeneous image point of a world **position**, as [`Self::image_from_direction`]. For an orthographic
    /// camera `w = 1` everywhere.
    pub fn image_from_world(&self, p_world: DVec3) -> DVec3 {
        let mut p = p_world - self.eye;
        if self.projection == Projection::Orthographic && self.travel != self.forward {
            // Back along the ray into the plane of the eye.
            p -= self.travel * (p.dot(self.forward) / self.travel.dot(self.forward));
        }
        let w = match self.projection {
            Projection::Perspective => p.dot(self.forward),
            Projection::Orthographic => 1.0,
        };
        self.image_from_view(p.dot(self.right), p.dot(self.up), w)
    }

    fn image_from_view(&self, x: f64, y: f64, w: f64) -> DVec3 {
        let Window { left, right, bottom, top } = self.window;
        let down = (y - top * w) / (bottom - top);
        let u = (x - left * w - self.shear * down) / (right - left) * f64::from(self.size[0]);
        DVec3::new(u, down * f64::from(self.size[1]), w)
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

    /// Unit vector across the image plane, away from the camera: the view direction.
    pub fn forward(&self) -> DVec3 {
        self.forward
    }

    /// What the image shows. Of a sheared camera its top border alone, from which lower rows are moved by
    /// [`Self::shear`]: whoever makes rays by hand adds that, and takes the rays of a parallel camera along
    /// [`Self::parallel_direction`].
    pub fn window(&self) -> Window {
        self.window
    }

    /// How far the window's bottom lies to the right of its top, in the window's unit. 0 but for cameras of sheared
    /// matrices ([`Self::from_matrices`]).
    pub fn shear(&self) -> f64 {
        self.shear
    }

    /// Unit direction of all rays of a parallel camera, which is [`Self::forward`] but for oblique projections; `None` for
    /// a perspective.
    pub fn parallel_direction(&self) -> Option<DVec3> {
        (self.projection == Projection::Orthographic).then_some(self.travel)
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
        let down = y / f64::from(self.size[1]);
        let dx = (right - left) * (x / f64::from(self.size[0])) + self.shear * down;
        let dy = (bottom - top) * down;
        let window = Window { left: left + dx, right: right + dx, bottom: bottom + dy, top: top + dy };
        Self { window, ..self.clone() }
    }

    /// The camera of `count` ≥ 1 columns of its image from `first` on, whose pixels are those of this one; columns may lie beyond
    /// its borders.
    pub fn of_columns(&self, first: i32, count: u32) -> Self {
        let Self { window: Window { left, right, .. }, size: [width, height], .. } = *self;
        let column = (right - left) / f64::from(width);
        let [from, to] = [f64::from(first), f64::from(first) + f64::from(count.max(1))];
        let window = Window { left: left + column * from, right: left + column * to, ..self.window };
        Self { window, size: [count.max(1), height], ..self.clone() }
    }
}

impl Window {
    /// A window around the view direction, `2·half_height` high, with square pixels.
    pub fn centred(half_height: f64, size: [u32; 2]) -> Self {
        let half_width = half_height * f64::from(size[0]) / f64::from(size[1].max(1));
        Self { left: -half_width, right: half_width, bottom: -half_height, top: half_height }
    }
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
    fn shifting_by_a_pixel_moves_the_rays_by_a_pixel() {
        let camera = camera();
        let (a, b) = (camera.shifted(1.0, -2.0).ray(4.0, 9.0), camera.ray(5.0, 7.0));
        assert!((a.direction - b.direction).length() < 1e-15);
    }

    #[test]
    fn columns_of_an_image_are_its_pixels_inside_and_beyond() {
        let camera = camera();
        let part = camera.of_columns(60, 16);
        assert_eq!(part.size(), [16, 41]);
        for x in [0.5, 7.0, 15.5] {
            let (a, b) = (part.ray(x, 9.25), camera.ray(60.0 + x, 9.25));
            assert!((a.direction - b.direction).length() < 1e-15);
        }
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
    }
}
