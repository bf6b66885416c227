//! Klehm's matrix (2014, Section 4.2): a projection with the eye as its centre, after which all view rays of a slice lie in one
//! row, each at one depth, and light rays run along the depth.
//!
//! With `b` the bisectrix of the view rays across the light and `n` square to `b` and to the axis, a point `p` from the eye has
//!
//! ```text
//! row     y = n·p / b·p      constant along view rays and along the slice
//! depth   z = −a·p / b·p     constant along view rays; a: from the eye to the light. Grows with the way of the light
//! column  κ = 1 / b·p        of a sun;  κ = a·(L − p) / b·p of a lamp at L: constant along light rays, falls along view rays
//! ```
//!
//! all linear over linear, so a 4×4 matrix. The lamp's is not in the paper, which takes six spots with six maps: sending the lamp
//! itself to infinity along z is as linear, and one matrix serves all light rays that the view rays cross.
//!
//! Departures: the ranges are those of the view rays' ends, not of a far plane. Columns are uniform in κ, so that of a sun the
//! way a column is 1/κ² of a constant; the paper's Eq. 12 takes it to grow by one factor from texel to texel, which it does not
//! (the cross ratio of four points is kept, not the ratio of neighbouring ways; test
//! `steps_are_harmonic_not_geometric`). Weights come from where the texels' borders are, exactly.

use glam::{DVec3, DVec4};
use scatter_core::{Camera, Frame, Level, Light};

use super::reach::Reach;

/// Widest angle of the view rays across the light \[radians\], where projective maps are asked for: 170°. Wider, and the rows at
/// the sides are less than a tenth as dense as in the middle.
const WIDEST: f64 = 170.0 / 180.0 * std::f64::consts::PI;

/// The same where the map is chosen by itself: 120°, where rows at the sides are a quarter as dense.
const WIDEST_BY_ITSELF: f64 = 120.0 / 180.0 * std::f64::consts::PI;

/// Part of the range of depths that is added at either end: what is clamped there is then behind every view ray, or before it.
const MARGIN: f64 = 1.0 / 64.0;

/// Most that a step of the map's depths, which are f32 from 0 to 1, may be of the way between two pixels: larger, and view rays share
/// depths; smaller, and epipoles beside a corner of the image are refused that a map can be made for.
const COARSEST_DEPTH: f64 = 1.0 / 64.0;

/// Farthest light ray over the nearest one that the map holds; what is nearer is read from the given map. Smaller, and more of
/// the light near the eye is as coarse as there; larger, and the first split is less even.
const FARTHEST_OVER_NEAREST: f64 = 64.0;

/// Part of the splits' borders that is logarithmic, the rest is even (Zhang et al. 2006, whom Section 4.2 follows).
const LOGARITHMIC: f64 = 0.5;

/// Why a frame has no projective map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotRectified {
    /// View rays run along the light, or nearly.
    Epipole,
    /// Rays do not end, or no ray goes anywhere.
    Endless,
}

/// How far a map goes along view rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// To where the frame's own maps end, if view rays go farther: what is behind is lit.
    Maps,
    /// To where view rays end.
    ViewRays,
}

/// Axes and ranges of a projective map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectification {
    /// Eye.
    pub eye: DVec3,
    /// From the eye to the light; unit.
    pub to_light: DVec3,
    /// Bisectrix across the light; unit.
    pub along: DVec3,
    /// Square to both.
    pub across: DVec3,
    /// Distance of a lamp from the eye; `None` for a sun.
    pub lamp: Option<f64>,
    /// Smallest and largest y of view rays.
    pub rows: [f64; 2],
    /// Smallest and largest z of view rays, and a margin.
    pub depths: [f64; 2],
    /// κ of the nearest light ray that the map holds and of the farthest one.
    pub columns: [f64; 2],
}

impl Rectification {
    /// Of a frame under a sun or a lamp. O(pixels), one pass over the depth map.
    ///
    /// `by_itself` is whether nobody has asked for it: then it is refused earlier.
    pub fn new(
        frame: &Frame<'_>,
        by_itself: bool,
        extent: Extent,
        (reach, simd): (&mut Reach, Level),
    ) -> Result<Self, NotRectified> {
        let camera = frame.camera();
        let eye = camera.eye();
        let (to_light, lamp) = match frame.light() {
            Light::Directional(sun) => (-sun.direction(), None),
            Light::Point(_) | Light::Spot(_) => {
                let to_lamp = frame.light().position().unwrap_or_default() - eye;
                (to_lamp.normalize(), Some(to_lamp.length()))
            }
        };
        let corners = corners(camera);
        let (along, across) = bisectrix(&corners, camera, to_light, by_itself)?;
        let (mut rows, mut depths) = ([f64::MAX, f64::MIN], [f64::MAX, f64::MIN]);
        for corner in corners {
            let w = along.dot(corner);
            let (y, z) = (across.dot(corner) / w, -to_light.dot(corner) / w);
            rows = [rows[0].min(y), rows[1].max(y)];
            depths = [depths[0].min(z), depths[1].max(z)];
        }
        let [_, a_column, _] = Self::view_rays(camera);
        // At an epipole in a corner of the image, beside which the wedge is narrow all the same, depths go to infinity.
        if !((depths[1] - depths[0]) * f64::from(f32::EPSILON) <= COARSEST_DEPTH * a_column.length()) {
            return Err(NotRectified::Epipole);
        }
        let margin = MARGIN * (depths[1] - depths[0]);
        let farthest = reach.farthest((frame, simd), &Self::view_rays(camera), (along, to_light, lamp));
        let whole = Self {
            eye,
            to_light,
            along,
            across,
            lamp,
            rows,
            depths: [depths[0] - margin, depths[1] + margin],
            columns: [0.0, farthest],
        };
        let farthest = match extent {
            Extent::Maps => whole.end_of_maps(frame, farthest),
            Extent::ViewRays => farthest,
        };
        if !farthest.is_finite() || (lamp.is_none() && farthest <= 0.0) {
            return Err(NotRectified::Endless);
        }
        let nearest = whole.column(whole.place(farthest) / FARTHEST_OVER_NEAREST);
        Ok(Self { columns: [nearest, farthest], ..whole })
    }

    /// Light rays that the given maps do not hold are lit: none is needed behind the last one that they do.
    fn end_of_maps(&self, frame: &Frame<'_>, farthest: f64) -> f64 {
        if self.lamp.is_some() {
            return farthest;
        }
        let mut last = 0.0f64;
        for layer in frame.shadow().layers() {
            let [width, height] = layer.projection().size().map(f64::from);
            for (u, v) in [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)] {
                let Some((origin, _)) = layer.projection().light_ray(u, v) else { return farthest };
                last = last.max(self.along.dot(origin - self.eye));
            }
        }
        if last > 0.0 { farthest.max(1.0 / last) } else { farthest }
    }

    /// Where along a view ray a column is, in a number that light is spread evenly over: the way across the light under a sun,
    /// the angle at a lamp \[radians\].
    pub fn place(&self, column: f64) -> f64 {
        match self.lamp {
            None => 1.0 / column,
            Some(_) => 1f64.atan2(column),
        }
    }

    /// The inverse of [`Self::place`].
    pub fn column(&self, place: f64) -> f64 {
        match self.lamp {
            None => 1.0 / place,
            Some(_) => place.cos() / place.sin(),
        }
    }

    /// κ at the borders of `count` splits: border `index` of `count + 1`.
    pub fn split_border(&self, index: u32, count: u32) -> f64 {
        let [near, far] = self.columns;
        if index == 0 {
            return near;
        }
        if index >= count {
            return far;
        }
        let part = f64::from(index) / f64::from(count);
        let (near, far) = (self.place(near), self.place(far));
        let (even, logarithmic) = (near + (far - near) * part, near * (far / near).powf(part));
        self.column(even + LOGARITHMIC * (logarithmic - even))
    }

    /// Column-major `clip_from_world` of a split between two κ, the nearer one first: x from −1 to 1 along it, y from −1 to 1
    /// over the rows, z from 0 to 1 over the depths.
    pub fn clip_from_world(&self, [near, far]: [f64; 2]) -> [[f64; 4]; 4] {
        // Linear functions of a world point.
        let linear = |axis: DVec3| axis.extend(-axis.dot(self.eye));
        let (w, n, z) = (linear(self.along), linear(self.across), linear(-self.to_light));
        let light = match self.lamp {
            None => DVec4::new(0.0, 0.0, 0.0, 1.0),
            Some(distance) => z + DVec4::new(0.0, 0.0, 0.0, distance),
        };
        let x = (w * near - light) * (2.0 / (near - far)) - w;
        let [low, high] = self.rows;
        let y = (n - w * low) * (2.0 / (high - low)) - w;
        let [first, last] = self.depths;
        let z = (z - w * first) / (last - first);
        let rows = [x, y, z, w].map(|row| row.to_array());
        std::array::from_fn(|column| std::array::from_fn(|row| rows[row][column]))
    }

    /// A light ray of the map: a point of it at `b·p` = 1 for a lamp, or on the plane of the eye for a sun, and its direction;
    /// from the eye.
    pub fn light_ray(&self, column: f64, y: f64) -> (DVec3, DVec3) {
        let towards = self.along + self.across * y;
        match self.lamp {
            None => (towards / column, -self.to_light),
            Some(distance) => (self.to_light * distance, towards - self.to_light * column),
        }
    }

    /// The view ray of the first pixel, and its change a column and a row; lengths of 1 along the view direction.
    pub fn view_rays(camera: &Camera) -> [DVec3; 3] {
        let first = direction_through(camera, 0.5, 0.5);
        let [column, row] = [[1.5, 0.5], [0.5, 1.5]].map(|[x, y]| direction_through(camera, x, y) - first);
        [first, column, row]
    }

    /// Smallest and largest z of what the image shows of the slice y; of a slice beside it those of all view rays.
    pub fn depths_of_slice(&self, camera: &Camera, y: f64) -> [f64; 2] {
        let [mut least, mut most] = self.depths;
        let [width, height] = camera.size().map(f64::from);
        // The image of the view ray of a depth is linear in it.
        let at = camera.image_from_direction(self.along + self.across * y);
        let a_depth = camera.image_from_direction(-self.to_light);
        let inside = |v: DVec3| [v.x, width * v.z - v.x, v.y, height * v.z - v.y];
        for (value, slope) in inside(at).into_iter().zip(inside(a_depth)) {
            let crossing = -value / slope;
            if slope > 0.0 {
                least = least.max(crossing);
            } else if slope < 0.0 {
                most = most.min(crossing);
            }
        }
        if least < most { [least, most] } else { self.depths }
    }

    /// z of the point of a light ray that is `s` directions from its start ([`Self::light_ray`]).
    pub fn depth_at(&self, column: f64, s: f64) -> f64 {
        match self.lamp {
            None => s * column,
            Some(distance) => column - distance / s,
        }
    }
}

/// The view ray through an image point, with length 1 along the view direction.
fn direction_through(camera: &Camera, x: f64, y: f64) -> DVec3 {
    let [u, v] = camera.window_from_image(x, y);
    camera.forward() + camera.right() * u + camera.up() * v
}

/// Directions of the image's corners.
fn corners(camera: &Camera) -> [DVec3; 4] {
    let [width, height] = camera.size().map(f64::from);
    [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]].map(|[x, y]| direction_through(camera, x, y))
}

/// The middle of the wedge that view rays fill across the light, and the axis square to it.
fn bisectrix(
    corners: &[DVec3; 4],
    camera: &Camera,
    to_light: DVec3,
    by_itself: bool,
) -> Result<(DVec3, DVec3), NotRectified> {
    let middle = corners.iter().sum::<DVec3>();
    let ahead = middle - to_light * middle.dot(to_light);
    if !(ahead.length() > 1e-6 * middle.length()) {
        return Err(NotRectified::Epipole);
    }
    let ahead = ahead.normalize();
    let side = to_light.cross(ahead);
    let (mut least, mut most) = (0.0f64, 0.0f64);
    for corner in corners {
        let angle = side.dot(*corner).atan2(ahead.dot(*corner));
        (least, most) = (least.min(angle), most.max(angle));
    }
    let widest = if by_itself { WIDEST_BY_ITSELF } else { WIDEST };
    // Around an epipole in the image the corners are all around.
    if !(most - least < widest) || camera.parallel_direction().is_some() {
        return Err(NotRectified::Epipole);
    }
    let turn = 0.5 * (least + most);
    let along = ahead * turn.cos() + side * turn.sin();
    Ok((along, to_light.cross(along)))
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DQuat};
    use scatter_core::simd_level;
    use scatter_testing::{Filling, MapKind, OwnedFrame, Random};

    use super::*;

    /// Frames from anywhere, far from the origin too, with their projective maps where there are any.
    fn visit_frames(mut visit: impl FnMut(&Frame<'_>, Rectification)) -> [usize; 2] {
        let mut random = Random(5);
        let mut counts = [0; 2];
        for round in 0..200 {
            let kind = MapKind::ALL[round % MapKind::ALL.len()];
            let filling = Filling::Random { seed: round as u64, far: 9.0 };
            let mut frame = OwnedFrame::stock(kind, [13, 7], 16, filling);
            let eye = random.in_cube(3.0);
            let target = (eye + random.direction()).to_array();
            let Ok(camera) = Camera::perspective(eye.to_array(), target, [0.1, 1.0, 0.2], 40.0, [13, 7])
            else {
                continue;
            };
            frame.camera = camera;
            frame.with(|frame| {
                match Rectification::new(frame, false, Extent::Maps, (&mut Reach::default(), simd_level())) {
                    Ok(rectification) => {
                        counts[0] += 1;
                        visit(frame, rectification);
                    }
                    Err(_) => counts[1] += 1,
                }
            });
        }
        counts
    }

    fn clip_of(rectification: &Rectification, p: DVec3) -> DVec3 {
        let clip = DMat4::from_cols_array_2d(&rectification.clip_from_world(rectification.columns));
        let seen = clip * (rectification.eye + p).extend(1.0);
        assert!(seen.w > 0.0);
        seen.truncate() / seen.w
    }

    #[test]
    fn view_rays_are_rows_of_one_depth_and_light_rays_run_along_it() {
        let counts = visit_frames(|frame, rectification| {
            let [width, height] = frame.size();
            for (x, y) in [(0, 0), (width - 1, 0), (3, height - 1), (6, 4)] {
                let direction = frame.camera().pixel_ray(x, y).direction;
                let end = frame.ray_end(x, y);
                let [near, far] = [0.4, 1.0].map(|part| clip_of(&rectification, direction * (part * end)));
                // Products of numbers of up to a thousand.
                assert!((near.y - far.y).abs() < 1e-10 && (near.z - far.z).abs() < 1e-10, "{near} {far}");
                assert!(far.y.abs() < 1.0 && far.z > 0.0 && far.z < 1.0 && near.x < far.x, "{far}");
                // Beyond the last light ray that the frame's own maps hold nothing is needed.
                assert!(far.x < 1.0 + 1e-9 || rectification.lamp.is_none());
                let column = match rectification.lamp {
                    None => 1.0 / (rectification.along.dot(direction) * end),
                    Some(distance) => {
                        let p = direction * end;
                        (distance - rectification.to_light.dot(p)) / rectification.along.dot(p)
                    }
                };
                let row = rectification.across.dot(direction) / rectification.along.dot(direction);
                let (origin, way) = rectification.light_ray(column, row);
                for s in [0.3, 0.9] {
                    let seen = clip_of(&rectification, origin + way * s);
                    let [first, last] = rectification.depths;
                    let z = (rectification.depth_at(column, s) - first) / (last - first);
                    let allowed = 1e-9 * (1.0 + z.abs());
                    assert!((seen.x - far.x).abs() < allowed && (seen.y - far.y).abs() < allowed);
                    assert!((seen.z - z).abs() < allowed, "{seen} {z}");
                }
            }
        });
        println!("{counts:?} frames with and without a map");
        assert!(counts[0] > 60 && counts[1] > 20);
    }

    /// Around a corner the corners of the image span a right angle at the most, however near it is.
    #[test]
    fn an_epipole_in_a_corner_of_the_image_has_no_map() {
        let size = [13u32, 9];
        let [width, height] = size.map(f64::from);
        let filling = Filling::Random { seed: 3, far: 9.0 };
        let stock = OwnedFrame::stock(MapKind::Orthographic, size, 16, filling);
        let Light::Directional(sun) = &stock.light else { panic!("a parallel map has a sun") };
        let (sun, eye) = (sun.direction(), stock.camera.eye());
        // The camera turned until an image point shows the sun, or what is opposite to it.
        let rectified = |x: f64, y: f64, side: f64| {
            let plain =
                Camera::perspective(eye.to_array(), (eye + DVec3::Z).to_array(), [0.0, 1.0, 0.0], 50.0, size);
            let turn = DQuat::from_rotation_arc(plain.unwrap().ray(x, y).direction, -side * sun);
            let (target, up) = ((eye + turn * DVec3::Z).to_array(), (turn * DVec3::Y).to_array());
            let camera = Camera::perspective(eye.to_array(), target, up, 50.0, size).unwrap();
            OwnedFrame { camera, ..stock.filled(filling) }.with(|frame| {
                Rectification::new(frame, false, Extent::Maps, (&mut Reach::default(), simd_level()))
            })
        };
        for (x, y) in [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)] {
            let aside = |by: f64| [x + by * (x / width - 0.5), y + by * (y / height - 0.5)];
            for side in [1.0, -1.0] {
                for by in [0.0, 1e-15, 1e-9, 1e-6] {
                    let [x, y] = aside(by);
                    assert_eq!(rectified(x, y, side), Err(NotRectified::Epipole), "{x} {y} {by} {side}");
                }
                // A pixel away there is one.
                let [x, y] = aside(2.0);
                assert!(rectified(x, y, side).is_ok(), "{x} {y} {side}");
            }
        }
    }

    #[test]
    fn splits_follow_each_other_from_the_nearest_light_ray_to_the_farthest() {
        visit_frames(|_, rectification| {
            for count in [1, 3, 16] {
                let borders: Vec<f64> = (0..=count).map(|k| rectification.split_border(k, count)).collect();
                assert_eq!([borders[0], borders[count as usize]], rectification.columns);
                assert!(borders.windows(2).all(|pair| pair[1] < pair[0]), "{borders:?}");
            }
        });
    }

    /// The paper's Eq. 12 takes the way along a view ray to grow by one factor a texel. Columns even in 1/w make it
    /// `w_i = 1/(a − b·i)`, of which the ratio of neighbouring ways is `(a − b·i)/(a − b·(i + 2))`: it grows along the row.
    #[test]
    fn steps_are_harmonic_not_geometric() {
        let (near, far, count) = (1.0f64, 1.0 / 64.0, 1024);
        let ways: Vec<f64> =
            (0..=count).map(|i| 1.0 / (near + (far - near) * f64::from(i) / f64::from(count))).collect();
        let step = |i: usize| ways[i + 1] - ways[i];
        let (first, last) = (step(1) / step(0), step(count as usize - 1) / step(count as usize - 2));
        // By Eq. 12 from the first three texels, the row would reach this far.
        let reached = ways[0] + step(0) * (first.powi(count) - 1.0) / (first - 1.0);
        println!(
            "factor {first:.4} at first, {last:.4} at last; the row ends at {reached:.1}, not {}",
            ways[count as usize]
        );
        assert!(first < 1.01 && last > 1.1 && reached < 0.2 * ways[count as usize]);
    }
}
