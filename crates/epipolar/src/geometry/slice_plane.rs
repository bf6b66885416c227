//! The half-plane of one slice in rectified coordinates: view rays by column, light rays by γ (Baran et al. 2010,
//! Section 3 and, for lamps, Section 9).
//!
//! A point of the half-plane is `eye + across·q + to_light·p`, q ≥ 0. Its view ray has the angle β to the light with
//! tan β = q/p; β grows along every light ray, from the light on. Instead of β itself this crate uses the pixel
//! column in which the slice shows the point: it is monotone in β, costs one division instead of an arc tangent, and
//! makes every column one view ray of the slice, so that "rectified" view rays are the image's own.

use glam::{DVec2, DVec3};
use scatter_core::Camera;

use super::epipole::{Epipole, STEEPEST};
use super::slices::{Major, Slice};

/// A slice's half-plane and its view rays in rectified coordinates (Baran et al. 2010, Section 3; lamps: Section 9).
///
/// A point is `eye + across·q + to_light·p`, q ≥ 0. Instead of the angle β (tan β = q/p) a view ray's coordinate is the pixel
/// column in which the slice shows it: monotone in β, and one division instead of an arc tangent. f64.
#[derive(Debug, Clone, Copy)]
pub struct SlicePlane {
    /// Unit vector in the plane, perpendicular to the axis, towards the slice's pixels.
    pub across: DVec3,
    /// Unit vector from the eye to the light.
    pub to_light: DVec3,
    /// View ray of the middle of column 0, not normalised: `[across, to_light]` components.
    start: DVec2,
    /// Their change per column.
    step: DVec2,
    /// Homogeneous image coordinate along the major axis, `(x·w, w)` in columns, of a point: rows to be dotted with
    /// (q, p).
    column_row: DVec2,
    depth_row: DVec2,
}

impl SlicePlane {
    /// The half-plane that a perspective camera shows as `slice`.
    pub fn new(camera: &Camera, epipole: &Epipole, slice: &Slice, major: Major) -> Self {
        let to_light = epipole.to_light;
        let exit = direction_through(camera, slice.exit);
        let across = (exit - to_light * exit.dot(to_light)).normalize();
        let per_column = match major {
            Major::X => DVec2::new(1.0, slice.slope),
            Major::Y => DVec2::new(slice.slope, 1.0),
        };
        let change = direction_through(camera, slice.exit + per_column) - exit;
        let in_plane = |v: DVec3| DVec2::new(v.dot(across), v.dot(to_light));
        let (at_exit, step) = (in_plane(exit), in_plane(change));
        let start = at_exit + step * (0.5 - major.of(slice.exit));
        let image = |v: DVec3| {
            let image = camera.image_from_direction(v);
            DVec2::new(major.of(image.truncate()), image.z)
        };
        let (q, p) = (image(across), image(to_light));
        Self {
            across,
            to_light,
            start,
            step,
            column_row: DVec2::new(q.x, p.x),
            depth_row: DVec2::new(q.y, p.y),
        }
    }

    /// `(q, p)` of the view ray of a column, per unit of depth.
    #[inline(always)]
    pub fn view_ray(&self, column: f64) -> DVec2 {
        self.start + self.step * column
    }

    /// The column, homogeneous: numerator and denominator as rows to be dotted with (q, p). A fractional column: the
    /// view ray of column c is at c + ½.
    pub fn column_from_plane(&self) -> [DVec2; 2] {
        [self.column_row, self.depth_row]
    }

    /// `[sin β, cos β]` of the columns from `first` on, the sine at least 1 / [`STEEPEST`]: no view ray of
    /// a pixel between slices has a smaller one.
    #[inline(always)]
    pub fn angles(&self, first: u32, sines: &mut [f32], cosines: &mut [f32]) {
        for (index, (sine, cosine)) in sines.iter_mut().zip(cosines).enumerate() {
            let ray = self.view_ray(f64::from(first) + index as f64);
            let shrink = 1.0 / (ray.x * ray.x + ray.y * ray.y).sqrt();
            *sine = (ray.x * shrink).max(1.0 / STEEPEST) as f32;
            *cosine = (ray.y * shrink) as f32;
        }
    }
}

/// A [`SlicePlane`] for a GPU: f32 alone, from the f64 geometry that a CPU keeps. Each vector is padded to four numbers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SliceRecord {
    /// Unit vector in the plane, perpendicular to the axis; 0.
    pub across: [f32; 4],
    /// Unit vector from the eye to the light; 0.
    pub to_light: [f32; 4],
    /// View ray of column 0 in the plane, `[across, to_light]`, and its change a column.
    pub view_ray: [f32; 4],
    /// Rows of the homogeneous column of a point `(q, p)`: numerator, then depth.
    pub column_from_plane: [f32; 4],
}

impl From<&SlicePlane> for SliceRecord {
    fn from(plane: &SlicePlane) -> Self {
        let vector = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let pair = |a: DVec2, b: DVec2| [a.x as f32, a.y as f32, b.x as f32, b.y as f32];
        Self {
            across: vector(plane.across),
            to_light: vector(plane.to_light),
            view_ray: pair(plane.start, plane.step),
            column_from_plane: pair(plane.column_row, plane.depth_row),
        }
    }
}

/// The ray through an image point, with length 1 along the view direction.
fn direction_through(camera: &Camera, p: DVec2) -> DVec3 {
    let [u, v] = camera.window_from_image(p.x, p.y);
    camera.forward() + camera.right() * u + camera.up() * v
}

#[cfg(test)]
mod tests {
    use scatter_core::Light;

    use super::super::slices::SliceSet;
    use super::*;

    #[test]
    fn columns_of_the_plane_are_columns_of_the_image() {
        let size = [37, 21];
        let camera =
            Camera::perspective([1.0, 2.0, 3.0], [2.0, 1.0, -4.0], [0.0, 1.0, 0.0], 75.0, size).unwrap();
        for travel in [[0.3, -1.0, 0.2], [0.2, -0.1, -1.0], [-0.1, 0.1, 1.0]] {
            let light = Light::directional(travel, [1.0; 3]).unwrap();
            let epipole = Epipole::new(&camera, &light);
            let mut set = SliceSet::default();
            set.distribute(&epipole, size, 1.0);
            for fan in &set.fans {
                for slice in &set.slices[fan.first..][..fan.count] {
                    let plane = SlicePlane::new(&camera, &epipole, slice, fan.major);
                    for column in [0.0, 7.0, 20.0] {
                        let minor = slice.minor_at(fan.major, column + 0.5);
                        let p = match fan.major {
                            Major::X => DVec2::new(column + 0.5, minor),
                            Major::Y => DVec2::new(minor, column + 0.5),
                        };
                        let ray = plane.view_ray(column);
                        if ray.x <= 1e-6 {
                            continue; // The other side of the epipole.
                        }
                        let v = plane.across * ray.x + plane.to_light * ray.y;
                        assert!((v - direction_through(&camera, p)).length() < 1e-9);
                        let [numerator, depth] = plane.column_from_plane();
                        let q = ray * 3.5;
                        // f64 through a few products of numbers up to 1e3.
                        assert!((numerator.dot(q) / depth.dot(q) - (column + 0.5)).abs() < 1e-8);
                    }
                }
            }
        }
    }
}
