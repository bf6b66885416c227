//! Cameras from an engine's matrices: every entry is read, or the matrices are refused.
//!
//! With the rows X, Y, W of `clip_from_view`, the image point (a, b) of clip space sees what X·p = a·W·p, Y·p = b·W·p.
//! A perspective's linear parts N = [X; Y; W] have an inverse: all rays pass the eye −N⁻¹·(X.w, Y.w, W.w) in the directions
//! N⁻¹·(a, b, 1). Parallel rays run along the null direction of X and Y from the view's plane z = 0. Both fans are linear
//! in (a, b), so a QR factorisation in the world gives frame, window and shear. f64; the view's inverse is the true one,
//! so that rays are those of the matrices as they are, with what f32 rounded.

use glam::{DMat3, DMat4, DVec3, DVec4};

use crate::camera::{Camera, Projection, Window};
use crate::clip_rows::{ClipRows, ROUNDING};
use crate::clip_space::ClipSpace;
use crate::error::ModelError;

const VIEW: &str = "camera view_from_world";
const CLIP: &str = "camera clip_from_view";

/// How far from orthonormal the view's rows may be. An f32 matrix that was made in one go is off by 1e-6, one that an
/// engine turned a million times by 1e-4. A scale beyond it would make near, far and distances count other units.
const DRIFT: f64 = 1e-4;

/// The fan of a camera's rays over its image: origin or direction at the corner where row 0 begins, and what the whole
/// width and the whole height add.
struct Fan {
    corner: DVec3,
    across: DVec3,
    down: DVec3,
}

impl Camera {
    /// The camera of an engine: column-major `view_from_world` (rotation and translation) and `clip_from_view` with row 0
    /// of the image at y/w = +1, as wgpu, Direct3D, Metal and Vulkan with a flipped viewport have it. Others:
    /// [`Self::from_matrices_in`].
    ///
    /// Of either handedness (w row 0 0 −1 0 or 0 0 1 0), perspective or parallel, forward or reversed z, with any near
    /// and far plane; jittered, off-centre, mirrored and sheared; turned by a display's pre-rotation; with an eye beside
    /// the view's origin; oblique parallel projections. Matrices that come from f32 are read as they are. `size` is
    /// `[width, height]`.
    ///
    /// The z row is read where it decides something: to which side a parallel camera looks (the one on which its volume
    /// lies, z/w from 0 to 1). Near and far belong to [`DepthEncoding`](crate::DepthEncoding).
    ///
    /// # Errors
    ///
    /// A view with a scale, a shear or a last row of its own, singular and row-major matrices, entries that are NaN or
    /// infinite, and a parallel volume on both sides of the eye, which does not say to which side the camera looks.
    pub fn from_matrices(
        view_from_world: [[f64; 4]; 4],
        clip_from_view: [[f64; 4]; 4],
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        camera(view_from_world, ClipRows::new(clip_from_view, CLIP)?, None, size)
    }

    /// As [`Self::from_matrices`], in a clip space of the engine's: row 0 may be at y/w = −1 (Vulkan, OpenGL's images), and
    /// z/w says where a parallel camera looks, wherever its volume lies.
    ///
    /// # Errors
    ///
    /// As [`Self::from_matrices`], and a z row that runs the other way than `space` says, or nowhere.
    pub fn from_matrices_in(
        view_from_world: [[f64; 4]; 4],
        clip_from_view: [[f64; 4]; 4],
        space: ClipSpace,
        size: [u32; 2],
    ) -> Result<Self, ModelError> {
        let mut clip = ClipRows::new(clip_from_view, CLIP)?;
        clip.y = space.y_up(clip.y);
        camera(view_from_world, clip, Some(space), size)
    }
}

fn camera(
    view_from_world: [[f64; 4]; 4],
    clip: ClipRows,
    space: Option<ClipSpace>,
    size: [u32; 2],
) -> Result<Camera, ModelError> {
    let (view, shift) = view_parts(view_from_world)?;
    clip.refuse_row_major()?;
    let world_from_view = view.inverse();
    match clip.parallel()? {
        None => {
            let inverse = clip.inverse_of(clip.w.truncate())?;
            let eye = inverse * -DVec3::new(clip.x.w, clip.y.w, clip.w.w);
            if let Some(space) = space {
                check_depth(&clip, &inverse, space)?;
            }
            let directions = Fan::over(&(world_from_view * inverse), DVec3::Z);
            directions.camera(world_from_view * (eye - shift), None, size)
        }
        Some(clip) => {
            // In the plane z = 0 of the view, along whose normal depth is counted.
            let inverse = clip.inverse_of(DVec3::Z).map_err(|_| {
                clip.error(
                    "it is singular, or its rays run within the plane of the eye",
                    "give an invertible matrix",
                )
            })?;
            let side = side_of_volume(&clip, &inverse, space)?;
            let centre = inverse * -DVec3::new(clip.x.w, clip.y.w, 0.0);
            let mut origins = Fan::over(&(world_from_view * inverse), DVec3::ZERO);
            origins.corner += world_from_view * centre;
            let travel = world_from_view * inverse.z_axis * side;
            origins.camera(world_from_view * -shift, Some(travel), size)
        }
    }
}

/// The view's linear part and its translation, divided by the last entry.
fn view_parts(view_from_world: [[f64; 4]; 4]) -> Result<(DMat3, DVec3), ModelError> {
    let error = |problem, cure| ModelError::Degenerate { what: VIEW, problem, cure };
    let view = DMat4::from_cols_array_2d(&view_from_world);
    if !view.is_finite() {
        return Err(error("an entry is NaN or infinite", "give finite numbers"));
    }
    let last = view.row(3);
    // Against the rotation's entries, which are at most 1; a row-major translation or a projection is far above.
    if !(last.truncate().abs().max_element() <= ROUNDING * last.w.abs()) || last.w == 0.0 {
        return Err(error(
            "its last row is not 0 0 0 1: it is row-major, or holds a projection",
            "give a rotation and a translation, column-major; the projection belongs into clip_from_view",
        ));
    }
    let rows = [0, 1, 2].map(|row| view.row(row) / last.w);
    let [x, y, z] = rows.map(DVec4::truncate);
    let linear = DMat3::from_cols(x, y, z).transpose();
    let off = (linear * linear.transpose() - DMat3::IDENTITY).to_cols_array();
    if off.iter().any(|entry| !(entry.abs() < DRIFT)) {
        return Err(error(
            "its rows are not orthonormal",
            "give a rotation and a translation, column-major, without scale",
        ));
    }
    Ok((linear, DVec3::new(rows[0].w, rows[1].w, rows[2].w)))
}

/// Which way the rays of a parallel camera run along the view's z axis: +1 or −1.
fn side_of_volume(clip: &ClipRows, inverse: &DMat3, space: Option<ClipSpace>) -> Result<f64, ModelError> {
    // z/w along the middle ray: start + slope·(z of the view).
    let slope = clip.z.truncate().dot(inverse.z_axis);
    let start = clip.z.w + clip.z.truncate().dot(inverse * -DVec3::new(clip.x.w, clip.y.w, 0.0));
    if !(slope != 0.0 && (1.0 / slope).is_finite()) {
        return Err(
            clip.error("its z row does not grow along the rays", "give the matrix with its depth row")
        );
    }
    if let Some(space) = space {
        return Ok((slope * space.sign()).signum());
    }
    let (a, b) = (-start / slope, (1.0 - start) / slope);
    let (low, high) = (a.min(b), a.max(b));
    let slack = ROUNDING * (high - low);
    if high <= slack {
        Ok(-1.0)
    } else if low >= -slack {
        Ok(1.0)
    } else {
        Err(clip.error(
            "its volume lies on both sides of the eye, so that it does not say to which side it looks",
            "use Camera::from_matrices_in, which knows how z runs",
        ))
    }
}

/// Whether z/w of a perspective runs as the space says: z = k·w + β along each ray, so z/w = k + β/w falls if β > 0.
fn check_depth(clip: &ClipRows, inverse: &DMat3, space: ClipSpace) -> Result<(), ModelError> {
    let constant = clip.z.w - clip.z.truncate().dot(*inverse * DVec3::new(clip.x.w, clip.y.w, clip.w.w));
    if -constant * space.sign() > 0.0 {
        Ok(())
    } else if constant == 0.0 {
        Err(clip.error("its z/w is the same at every distance", "give the matrix with its depth row"))
    } else {
        Err(clip.error(
            "its z/w runs the other way than the clip space says",
            "say ClipSpace::reversed() of a matrix with reversed z, and of no other",
        ))
    }
}

impl Fan {
    /// `world_from_fan · ((a, b, 0) + middle)` over the clip square, from (−1, 1), where row 0 begins.
    fn over(world_from_fan: &DMat3, middle: DVec3) -> Self {
        Self {
            corner: *world_from_fan * (DVec3::new(-1.0, 1.0, 0.0) + middle),
            across: 2.0 * world_from_fan.x_axis,
            down: -2.0 * world_from_fan.y_axis,
        }
    }

    /// Frame, window and shear: the fan's two steps factorised, the first along `right`. `travel` is the direction of
    /// parallel rays, any length.
    fn camera(&self, eye: DVec3, travel: Option<DVec3>, size: [u32; 2]) -> Result<Camera, ModelError> {
        // Scaled first: at 1e-160 and at 1e160 products are outside of f64.
        let scaled = |v: DVec3| v / v.abs().max_element();
        let right = scaled(self.across).normalize();
        let down = scaled(self.down);
        let up = -(down - right * down.dot(right)).normalize();
        let ahead = travel.unwrap_or(self.corner);
        let normal = right.cross(up);
        let forward = if normal.dot(ahead) < 0.0 { -normal } else { normal };
        // The window of a perspective is measured at distance 1.
        let unit = if travel.is_some() { 1.0 } else { self.corner.dot(forward) };
        let [left, top] = [right, up].map(|axis| self.corner.dot(axis) / unit);
        let window = Window {
            left,
            right: left + self.across.dot(right) / unit,
            top,
            bottom: top + self.down.dot(up) / unit,
        };
        let (projection, travel) = match travel {
            None => (Projection::Perspective, forward),
            Some(travel) => (Projection::Orthographic, travel.normalize()),
        };
        let shear = self.down.dot(right) / unit;
        let camera = Camera { eye, right, up, forward, window, shear, travel, projection, size };
        let sane = eye.is_finite() && right.is_finite() && up.is_finite() && camera.travel.is_finite();
        if sane {
            camera.checked()
        } else {
            Err(ModelError::Degenerate {
                what: CLIP,
                problem: "its image is a line or a point",
                cure: "give an invertible matrix",
            })
        }
    }
}
