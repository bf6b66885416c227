//! What engines hand over: depth buffers of three kinds, cameras and shadow maps as matrices, with the epipole inside of
//! the image, on its edge, outside, behind the camera and at infinity, the eye inside and outside of the light's map.
//!
//! Depth texels are z/w of the surface through the whole matrix, as a rasteriser would store them, and rays come from
//! the inverse matrix: neither uses the model's own conversions, which are what these rows judge.

use glam::{DMat4, DVec3, DVec4};
use scatter_core::{Camera, ClipSpace, DepthEncoding, ModelError, Window};

use crate::scenario::{MapFrame, PixelRay, Scenario, Shadow, texels_of};
use crate::stress::row::{Expectation, ROUNDING, StressRow};
use crate::stress::scenes::{self, EYE, SIZE, TARGET};

/// Near plane of most rows \[world units\].
const NEAR: f64 = 0.1;
/// A near plane that leaves forward z few digits.
const VERY_NEAR: f64 = 1e-4;
const FAR: f64 = 100.0;

/// A depth convention.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Depth {
    Forward,
    Reversed,
    ReversedInfinite,
}

/// A kind of camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lens {
    Perspective,
    OffCentre,
    Orthographic,
    /// The eye beside the view's origin: x.w and y.w of a perspective.
    Beside,
    /// A display's pre-rotation by 90°, mirrored.
    Turned,
    /// x.y and y.x of a perspective.
    Sheared,
    /// w row 0 0 1 0.
    LeftHanded,
    /// x.z and y.z of a parallel projection.
    Oblique,
}

impl Lens {
    fn is_parallel(self) -> bool {
        matches!(self, Self::Orthographic | Self::Oblique)
    }

    /// What the plain projection is multiplied with: in the image, and in the view.
    fn around(self) -> [DMat4; 2] {
        let mut around = [DMat4::IDENTITY; 2];
        match self {
            Self::Perspective | Self::OffCentre | Self::Orthographic => {}
            Self::Beside => around[1].w_axis = (-BESIDE).extend(1.0),
            Self::Turned => {
                around[0].x_axis = DVec4::Y;
                around[0].y_axis = DVec4::X;
            }
            Self::Sheared => (around[0].x_axis.y, around[0].y_axis.x) = (0.3, -0.2),
            Self::LeftHanded => around[1].z_axis = DVec4::NEG_Z,
            // Sideways: towards the ground rays would be too short for the rounding of linear z (`depth_rounding`).
            Self::Oblique => (around[1].z_axis.x, around[1].z_axis.y) = (0.45, 0.03),
        }
        around
    }
}

/// Where the eye of [`Lens::Beside`] is in the view.
const BESIDE: DVec3 = DVec3::new(0.31, -0.17, 0.0);

/// Where the epipole is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Epipole {
    Inside,
    Edge,
    Outside,
    Behind,
    Infinity,
}

/// Rows of all combinations.
pub fn rows() -> Vec<StressRow> {
    let depths = [
        ("forward z", Depth::Forward),
        ("reversed z", Depth::Reversed),
        ("infinite reversed z", Depth::ReversedInfinite),
    ];
    let lenses = [
        ("perspective", Lens::Perspective),
        ("off-centre", Lens::OffCentre),
        ("orthographic", Lens::Orthographic),
    ];
    let whole = [
        ("eye beside the origin", Lens::Beside),
        ("turned by 90° and mirrored", Lens::Turned),
        ("sheared", Lens::Sheared),
        ("left-handed", Lens::LeftHanded),
        ("oblique parallel", Lens::Oblique),
    ];
    let epipoles = [
        ("inside", Epipole::Inside),
        ("on the edge", Epipole::Edge),
        ("outside", Epipole::Outside),
        ("behind", Epipole::Behind),
        ("at infinity", Epipole::Infinity),
    ];
    let mut rows = Vec::new();
    for (lens_name, lens) in lenses {
        for (depth_name, depth) in depths {
            // A parallel projection has no infinite far plane: the last kind is the linear one of a deferred renderer.
            let depth_name =
                if lens.is_parallel() && depth == Depth::ReversedInfinite { "view z" } else { depth_name };
            for (epipole_name, epipole) in epipoles {
                for (eye_name, eye_inside) in [("in", true), ("out of", false)] {
                    let name =
                        format!("{lens_name}, {depth_name}, epipole {epipole_name}, eye {eye_name} the map");
                    rows.push(row(name, lens, depth, epipole, eye_inside, NEAR));
                }
            }
        }
    }
    for (lens_name, lens) in whole {
        for (epipole_name, epipole) in [epipoles[0], epipoles[2], epipoles[3]] {
            let name = format!("{lens_name}, reversed z, epipole {epipole_name}");
            rows.push(row(name, lens, Depth::Reversed, epipole, true, NEAR));
        }
    }
    for (depth_name, depth) in depths {
        let name = format!("perspective, {depth_name}, near plane at 1e-4");
        rows.push(row(name, Lens::Perspective, depth, Epipole::Outside, true, VERY_NEAR));
    }
    rows
}

fn row(name: String, lens: Lens, depth: Depth, epipole: Epipole, eye_inside: bool, near: f64) -> StressRow {
    let scene = scene(lens, depth, epipole, eye_inside, near);
    let tolerance = ROUNDING + depth_rounding(lens, depth, near);
    StressRow::expecting("engine conventions", name, scene, Expectation::Exact, tolerance)
}

/// How far the end of a ray is off as a share of its length, which is at most what it changes of the radiance.
///
/// z near 1 is rounded to 2⁻²⁵. Forward z of a perspective: dv/v = v·(f − n)/(f·n)·2⁻²⁵, for distances of up to 30
/// units. Linear z of a parallel projection: dv = (f − n)·2⁻²⁵, of rays that are 1 unit long and longer. Reversed z of
/// a perspective and view z keep 2⁻²⁴ of their own value, and so of the distance; a finite far plane adds as much.
fn depth_rounding(lens: Lens, depth: Depth, near: f64) -> f64 {
    let half_ulp = f64::from(f32::EPSILON) / 4.0;
    match (lens, depth) {
        (Lens::Orthographic | Lens::Oblique, Depth::Forward | Depth::Reversed) => (FAR - near) * half_ulp,
        (_, Depth::Forward) => 30.0 * (FAR - near) / (FAR * near) * half_ulp,
        (_, Depth::Reversed | Depth::ReversedInfinite) => 4.0 * half_ulp,
    }
}

fn scene(
    lens: Lens,
    depth: Depth,
    epipole: Epipole,
    eye_inside: bool,
    near: f64,
) -> Result<Scenario, ModelError> {
    // A left-handed engine's view looks along +z.
    let flip = if lens == Lens::LeftHanded { lens.around()[1] } else { DMat4::IDENTITY };
    let view = flip * view_from_world();
    let clip = clip_from_view(lens, depth, near);
    let camera = Camera::from_matrices(view.to_cols_array_2d(), clip.to_cols_array_2d(), SIZE)?;
    let mut scene = if lens.is_parallel() && epipole != Epipole::Infinity {
        beside_a_spot(camera, epipole, eye_inside)?
    } else {
        under_a_sun(camera, epipole, eye_inside)?
    };
    let frame = match &mut scene.shadow {
        Shadow::Parallel(layers) => &mut layers[0].frame,
        Shadow::Perspective(layer) => &mut layer.frame,
        Shadow::None | Shadow::Cube { .. } => return Ok(scene),
    };
    frame.by_matrix = true;
    let (rays, buffer) = surface(lens, depth, &view, &clip);
    let encoding = match (depth, lens) {
        (Depth::Reversed, Lens::Beside | Lens::Turned | Lens::Sheared | Lens::LeftHanded | Lens::Oblique) => {
            DepthEncoding::Clip {
                clip_from_world: (clip * view).to_cols_array_2d(),
                space: ClipSpace::WGPU.reversed(),
            }
        }
        (Depth::Forward, _) => DepthEncoding::Forward { near, far: FAR },
        (Depth::Reversed, _) => DepthEncoding::Reversed { near, far: FAR },
        (Depth::ReversedInfinite, Lens::Orthographic) => DepthEncoding::ViewZ,
        (Depth::ReversedInfinite, _) => DepthEncoding::ReversedInfinite { near },
    };
    let mut distances = Vec::new();
    encoding.decode(&scene.camera, &buffer, &mut distances)?;
    scene.distances = distances;
    // A hit beyond max_distance is ignored on both sides.
    let limit = scene.max_distance;
    scene.rays = Some(rays.into_iter().map(|ray| PixelRay { end: ray.end.min(limit), ..ray }).collect());
    Ok(scene)
}

/// Looking from the eye to the target, view −z ahead, y up.
fn view_from_world() -> DMat4 {
    let back = (EYE - TARGET).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let row = |axis: DVec3| axis.extend(-axis.dot(EYE));
    DMat4::from_cols(row(right), row(up), row(back), DVec4::W).transpose()
}

/// The window at distance 1 (or in world units), and an engine's matrix for it with z in [0, 1].
fn clip_from_view(lens: Lens, depth: Depth, near: f64) -> DMat4 {
    let Window { left, right, bottom, top } = match lens {
        Lens::Perspective | Lens::Turned | Lens::LeftHanded => {
            Window { left: -0.9, right: 0.9, bottom: -0.6, top: 0.6 }
        }
        Lens::OffCentre | Lens::Beside | Lens::Sheared => {
            Window { left: -0.4, right: 1.1, bottom: -0.8, top: 0.3 }
        }
        // Its lowest rays that meet the ground start half a unit above it, and are 7 units long.
        Lens::Oblique => Window { left: -4.0, right: 4.5, bottom: -2.0, top: 3.0 },
        Lens::Orthographic => Window { left: -4.0, right: 4.5, bottom: -2.5, top: 3.0 },
    };
    let [image, in_view] = lens.around();
    let (width, height) = (right - left, top - bottom);
    if lens.is_parallel() {
        // z_clip = slope·z_view + offset, z_view from −near to −far.
        let slope = -1.0 / (FAR - near);
        let (slope, offset) =
            if depth == Depth::Forward { (slope, near * slope) } else { (-slope, -FAR * slope) };
        let plain = DMat4::from_cols(
            DVec4::new(2.0 / width, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 2.0 / height, 0.0, 0.0),
            DVec4::new(0.0, 0.0, slope, 0.0),
            DVec4::new(-(right + left) / width, -(top + bottom) / height, offset, 1.0),
        );
        return image * plain * in_view;
    }
    let (slope, offset) = match depth {
        Depth::Forward => (-FAR / (FAR - near), -FAR * near / (FAR - near)),
        Depth::Reversed => (near / (FAR - near), FAR * near / (FAR - near)),
        Depth::ReversedInfinite => (0.0, near),
    };
    let plain = DMat4::from_cols(
        DVec4::new(2.0 / width, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 2.0 / height, 0.0, 0.0),
        DVec4::new((right + left) / width, (top + bottom) / height, slope, -1.0),
        DVec4::new(0.0, 0.0, offset, 0.0),
    );
    image * plain * in_view
}

/// The rays by the inverse of the whole matrix with their true ends on the ground, and what the depth buffer holds there.
fn surface(lens: Lens, depth: Depth, view: &DMat4, clip: &DMat4) -> (Vec<PixelRay>, Vec<f32>) {
    let [width, height] = SIZE.map(f64::from);
    let (world_from_view, world_from_clip) = (view.inverse(), (*clip * *view).inverse());
    let in_view = if lens == Lens::Beside { BESIDE } else { DVec3::ZERO };
    let eye = world_from_view.transform_point3(in_view);
    let rays = texels_of(SIZE, |x, y| {
        let ndc = [2.0 * (f64::from(x) + 0.5) / width - 1.0, 1.0 - 2.0 * (f64::from(y) + 0.5) / height];
        // Two points that the pixel shows, the nearer one first.
        let at = |z: f64| world_from_clip.project_point3(DVec3::new(ndc[0], ndc[1], z));
        let (near, far) = if depth == Depth::Forward { (at(0.25), at(0.5)) } else { (at(0.5), at(0.25)) };
        let direction = (far - near).normalize();
        let origin = if lens.is_parallel() {
            // From the plane of the eye.
            let along = view.transform_vector3(direction).z;
            near - direction * (view.transform_point3(near).z / along) - eye
        } else {
            DVec3::ZERO
        };
        let end = if direction.y < -1e-9 { -(eye + origin).y / direction.y } else { f64::INFINITY };
        PixelRay { origin, direction, end: if end > 0.0 { end } else { f64::INFINITY } }
    });
    let cleared = if depth == Depth::Forward { 1.0 } else { 0.0 };
    let linear = lens.is_parallel() && depth == Depth::ReversedInfinite;
    let buffer = rays.iter().map(|ray| {
        // A rasteriser clips what is beyond its far plane.
        if !(ray.end < 0.9 * FAR) {
            return if linear { f32::INFINITY } else { cleared };
        }
        let p_view = view.transform_point3(eye + ray.origin + ray.end * ray.direction);
        let p_clip = *clip * p_view.extend(1.0);
        if linear { -p_view.z as f32 } else { (p_clip.z / p_clip.w) as f32 }
    });
    let buffer = buffer.collect();
    (rays, buffer)
}

/// The light's place on the image, in pixels.
fn place(epipole: Epipole) -> [f64; 2] {
    match epipole {
        Epipole::Inside | Epipole::Behind | Epipole::Infinity => [4.3, 3.2],
        Epipole::Edge => [0.0, 4.1],
        Epipole::Outside => [-7.3, 2.0],
    }
}

fn under_a_sun(camera: Camera, epipole: Epipole, eye_inside: bool) -> Result<Scenario, ModelError> {
    let [x, y] = place(epipole);
    let towards = camera.ray(x, y).direction;
    let direction = match epipole {
        Epipole::Behind => towards,
        // Across the view: no image point at all for a perspective, and no point of the image plane for parallel rays.
        Epipole::Infinity => 0.8 * camera.right() - 0.6 * camera.up(),
        _ => -towards,
    };
    let mut scene = scenes::sun_along(direction, camera)?;
    if let Shadow::Parallel(layers) = &mut scene.shadow {
        let frame = &mut layers[0].frame;
        let half = if eye_inside { [9.1, 8.3] } else { [2.3, 1.9] };
        // The map that leaves the eye out lies beside it, whatever the direction.
        let aside = if eye_inside { DVec3::ZERO } else { 3.1 * frame.right() };
        let moved =
            scenes::sun_frame(direction, if eye_inside { TARGET } else { EYE } + aside, half, frame.size);
        *frame = MapFrame { by_matrix: true, ..moved };
    }
    Ok(scene)
}

fn beside_a_spot(camera: Camera, epipole: Epipole, eye_inside: bool) -> Result<Scenario, ModelError> {
    let [x, y] = place(epipole);
    // All rays of a parallel camera are as far: the lamp lies on the one of that image point, before or behind the eye.
    let along = if epipole == Epipole::Behind { -2.1 } else { 3.7 };
    let position = EYE + camera.ray(x, y).origin + along * camera.ray(x, y).direction;
    let direction = if eye_inside { EYE - position } else { position - EYE };
    scenes::spot_at(position, direction + DVec3::new(0.1, -0.07, 0.04), camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether the eye lies in the map, by the map's own numbers.
    fn eye_is_inside(scene: &Scenario) -> bool {
        let frame = match &scene.shadow {
            Shadow::Parallel(layers) => layers[0].frame,
            Shadow::Perspective(layer) => layer.frame,
            Shadow::None | Shadow::Cube { .. } => return false,
        };
        let p = scene.camera.eye() - frame.origin;
        let depth = if frame.perspective { p.dot(frame.forward) } else { 1.0 };
        let within = |axis: DVec3, half: f64| p.dot(axis).abs() < half * depth;
        depth > 0.0 && within(frame.right(), frame.half[0]) && within(frame.up, frame.half[1])
    }

    #[test]
    fn the_eye_is_where_the_row_says_and_so_is_the_epipole() {
        let lenses = [
            Lens::Perspective,
            Lens::OffCentre,
            Lens::Orthographic,
            Lens::Beside,
            Lens::Turned,
            Lens::Sheared,
            Lens::LeftHanded,
            Lens::Oblique,
        ];
        for lens in lenses {
            for epipole in
                [Epipole::Inside, Epipole::Edge, Epipole::Outside, Epipole::Behind, Epipole::Infinity]
            {
                for inside in [true, false] {
                    let scene = scene(lens, Depth::Reversed, epipole, inside, NEAR).unwrap();
                    assert_eq!(eye_is_inside(&scene), inside, "{lens:?} {epipole:?}");
                    let image = match &scene.light {
                        scatter_core::Light::Directional(sun) => {
                            scene.camera.image_from_direction(-sun.direction())
                        }
                        light => scene.camera.image_from_world(light.position().unwrap()),
                    };
                    let (w, x) = (image.z, image.x / image.z);
                    match epipole {
                        Epipole::Inside => assert!(w > 0.0 && (x - 4.3).abs() < 1e-9),
                        Epipole::Edge => assert!(w > 0.0 && x.abs() < 1e-9, "{x}"),
                        Epipole::Outside => assert!(w > 0.0 && x < -7.0),
                        Epipole::Behind if !lens.is_parallel() => assert!(w < 0.0),
                        Epipole::Behind => {}
                        Epipole::Infinity => assert!(w.abs() < 1e-9, "{lens:?} {w}"),
                    }
                }
            }
        }
    }

    #[test]
    fn distances_are_decoded_to_what_the_row_allows() {
        let plain = [Lens::Perspective, Lens::OffCentre, Lens::Orthographic];
        let whole = [Lens::Beside, Lens::Turned, Lens::Sheared, Lens::LeftHanded, Lens::Oblique];
        for lens in plain.into_iter().chain(whole) {
            let reversed = [Depth::Reversed].into_iter();
            let others =
                [Depth::Forward, Depth::ReversedInfinite].into_iter().filter(|_| plain.contains(&lens));
            for depth in reversed.chain(others) {
                let scene = scene(lens, depth, Epipole::Inside, true, NEAR).unwrap();
                let rays = scene.rays.as_ref().unwrap();
                assert!(rays.iter().any(|ray| ray.end < 30.0));
                for (ray, &distance) in rays.iter().zip(&scene.distances) {
                    let decoded = f64::from(distance).min(scene.max_distance);
                    let off = (decoded - ray.end).abs() / ray.end;
                    // The f32 distance itself, besides.
                    assert!(
                        off <= depth_rounding(lens, depth, NEAR) + 6e-8,
                        "{lens:?} {depth:?}: {decoded} {}",
                        ray.end
                    );
                }
            }
        }
    }
}
