//! Shadow maps of a sun, a spot and a lamp, made, inverted and composed in f32: none is refused, and texels are where the
//! world's points are.

use glam::{DVec3, Mat4, Quat, Vec3};
use scatter_core::{Camera, Light, MapKind, MapLayout, MapProjection, Medium, ModelError, Phase, Setup};

use crate::conventions::{Lens, Place, Random, lenses};

const SIZE: [u32; 2] = [64, 48];

/// f32's unit roundoff.
const U: f64 = 1.0 / 16_777_216.0;

/// A clip coordinate is a sum of three products and a translation that nearly cancel where the map is far from the
/// origin: each entry is right to 16 U of its row (see the cameras), the translation by √3 as much, so the sum is right to
/// 64 U of the sum of the summands' sizes.
const CLIP: f64 = 64.0 * U;

fn setup(light: &Light, maps: &MapLayout) -> Result<(), ModelError> {
    let camera = Camera::perspective([1e6, 2e6, 3e6], [0.0; 3], [0.0, 1.0, 0.0], 60.0, [3, 2])?;
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic)?;
    Setup::new(&camera, light, *maps, &medium, 10.0).map(drop)
}

/// `(u, v, depth)` of a point, from the place's axes and the window.
fn reference(place: &Place, lens: &Lens, p: DVec3) -> DVec3 {
    let [right, up, forward] = place.axes(lens.left_handed);
    let from_place = p - place.position.as_dvec3();
    let depth = from_place.dot(forward);
    let unit = if lens.parallel { 1.0 } else { depth };
    let [l, r, b, t] = lens.window;
    let [u, v] = [(from_place.dot(right) / unit - l) / (r - l), (t - from_place.dot(up) / unit) / (t - b)];
    let v = if lens.name.contains("opengl") { 1.0 - v } else { v };
    let [width, height] = SIZE.map(f64::from);
    DVec3::new(u * width, v * height, if lens.parallel { depth - lens.near } else { depth })
}

#[test]
fn no_sun_and_no_spot_is_refused_and_texels_are_where_they_were_rendered() {
    let mut random = Random(3);
    let (mut worst, mut suns, mut spots) = (0.0f64, 0, 0);
    let (mut angle, mut centre) = (0.0f64, 0.0f64);
    for number in 0..2500 {
        let place = Place::random(&mut random);
        for lens in lenses(&mut random) {
            let clip = (lens.matrix * place.view(number % 4, lens.left_handed)).as_dmat4();
            let map = MapProjection::from_clip_from_world_in(clip.to_cols_array_2d(), lens.space, SIZE)
                .unwrap_or_else(|error| panic!("{}: {error}", lens.name));
            assert_eq!(map.is_perspective(), !lens.parallel, "{}", lens.name);
            let ahead = place.rotation * if lens.left_handed { Vec3::Z } else { Vec3::NEG_Z };
            let (travel, position) = (ahead.as_dvec3().to_array(), place.position.as_dvec3().to_array());
            let (light, kind) = if lens.parallel {
                suns += 1;
                (Light::directional(travel, [1.0; 3]), MapKind::Orthographic)
            } else {
                spots += 1;
                (Light::spot(position, travel, [1.0; 3], 10.0, 20.0, 0.0), MapKind::Perspective)
            };
            let maps = MapLayout::new(kind, &[map]).unwrap();
            setup(&light.unwrap(), &maps).unwrap_or_else(|error| panic!("{} {number}: {error}", lens.name));

            // What the set-up compares, beside what it allows.
            match map.centre() {
                Some(p) => {
                    centre = centre.max(p.distance(position.into()) / (1.0 + DVec3::from(position).length()))
                }
                None => {
                    let [u, v, _] = map.rows().map(|row| row.truncate());
                    let travel = DVec3::from(travel);
                    let off = u.cross(v).normalize().cross(travel.normalize()).length();
                    angle = angle.max(off);
                }
            }

            let [right, up, forward] = place.axes(lens.left_handed);
            let [l, r, b, t] = lens.window;
            let depth = random.range(1.0, 40.0);
            let unit = if lens.parallel { 1.0 } else { depth };
            let (x, y) = (random.range(l, r) * unit, random.range(b, t) * unit);
            let p = place.position.as_dvec3() + right * x + up * y + forward * depth;
            let off = (map.texel_from_world(p) - reference(&place, &lens, p)).abs();
            // Summands of clip x and y, as shares of w: the axis and, off-centre, the view direction.
            let size = p.length() + place.position.as_dvec3().length();
            let border = lens.window.iter().fold(1.0, |most, v| f64::max(most, v.abs()));
            let reach = size.max(unit) / unit * 2.0 * border / (r - l).min(t - b);
            // A parallel depth is a share of the planes' distance.
            let range = if lens.parallel { lens.far } else { 0.0 };
            let [width, height] = SIZE.map(f64::from);
            let sideways = (2.0 * off.x / width).max(2.0 * off.y / height);
            worst = worst.max(sideways / reach).max(off.z / (size + range));
        }
    }
    println!("{suns} suns, {spots} spots, none refused; texels {:.1} of {} roundings", worst / U, CLIP / U);
    println!("suns are {:.1} of 64 roundings off their maps, spots {:.1} of 168", angle / U, centre / U);
    assert!(worst <= CLIP, "{}", worst / U);
}

#[test]
fn six_faces_of_every_convention_cover_the_sphere() {
    let mut random = Random(4);
    let looks = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    for number in 0..600 {
        let place = Place::random(&mut random);
        // Half of them along the world's axes, the others turned.
        let turn = if number % 2 == 0 { Quat::IDENTITY } else { place.rotation };
        let light = Light::point(place.position.as_dvec3().to_array(), [1.0; 3], 0.0).unwrap();
        for left_handed in [false, true] {
            let faces = looks.map(|look| {
                use glam::camera::{lh, rh};
                let (ahead, up) = (turn * look, turn * if look.y == 0.0 { Vec3::Y } else { Vec3::Z });
                let quarter = std::f32::consts::FRAC_PI_2;
                let clip = if left_handed {
                    lh::proj::directx::perspective(quarter, 1.0, 0.1, 100.0)
                        * lh::view::look_to_mat4(place.position, ahead, up)
                } else {
                    rh::proj::directx::perspective_infinite_reverse(quarter, 1.0, 0.1)
                        * rh::view::look_to_mat4(place.position, ahead, up)
                };
                let clip: Mat4 = if number % 3 == 0 { clip.inverse().inverse() } else { clip };
                MapProjection::from_clip_from_world(clip.as_dmat4().to_cols_array_2d(), [16; 2]).unwrap()
            });
            let maps = MapLayout::new(MapKind::Faces, &faces).unwrap();
            // The inverse of a perspective's inverse is off by its condition, 0.1 to 100, besides.
            if number % 3 != 0 {
                setup(&light, &maps).unwrap_or_else(|error| panic!("{number}: {error}"));
            }
        }
    }
}
