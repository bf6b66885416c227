//! What is refused, with a message that says what it is and the cure.

use glam::{DMat4, DVec3, DVec4};
use scatter_core::{
    Camera, ClipSpace, DepthEncoding, Frame, Light, MapKind, MapLayout, MapProjection, Medium, ModelError,
    Phase, Setup, ShadowDepthEncoding,
};

fn rows(rows: [[f64; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&rows).transpose()
}

const PERSPECTIVE: [[f64; 4]; 4] =
    [[1.2, 0.0, 0.1, 0.0], [0.0, 1.7, 0.0, 0.0], [0.0, 0.0, 0.0, 0.1], [0.0, 0.0, -1.0, 0.0]];
const PARALLEL: [[f64; 4]; 4] =
    [[0.2, 0.0, 0.0, 0.1], [0.0, 0.2, 0.0, 0.0], [0.0, 0.0, -0.01, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn said<T>(result: Result<T, ModelError>) -> String {
    result.err().map_or(String::new(), |error| error.to_string())
}

fn of(view: DMat4, clip: [[f64; 4]; 4], space: Option<ClipSpace>) -> String {
    let (view, clip) = (view.to_cols_array_2d(), rows(clip).to_cols_array_2d());
    said(match space {
        None => Camera::from_matrices(view, clip, [3, 2]),
        Some(space) => Camera::from_matrices_in(view, clip, space, [3, 2]),
    })
}

fn has(message: &str, parts: &[&str]) {
    assert!(parts.iter().all(|part| message.contains(part)), "“{message}” does not say {parts:?}");
}

#[test]
fn cameras_that_cannot_be_say_why_and_the_cure() {
    let id = DMat4::IDENTITY;
    assert_eq!(of(id, PERSPECTIVE, None), "");
    assert_eq!(of(id, PARALLEL, None), "");
    // Singular: a row of zeros, two rows alike, alike to rounding.
    for bad in [0, 1, 3] {
        let mut clip = PERSPECTIVE;
        clip[bad] = [0.0; 4];
        has(&of(id, clip, None), &["clip_from_view", "give"]);
        let mut clip = PERSPECTIVE;
        clip[bad] = clip[(bad + 1) % 2].map(|v| v * (1.0 + 1e-8));
        if bad != 1 {
            has(&of(id, clip, None), &["clip_from_view", "singular", "invertible"]);
        }
    }
    // Every entry may be NaN or infinite, in either matrix.
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for entry in 0..16 {
            let mut clip = PERSPECTIVE;
            clip[entry / 4][entry % 4] = value;
            has(&of(id, clip, None), &["clip_from_view", "NaN or infinite", "finite numbers"]);
            let mut view = id.to_cols_array();
            view[entry] = value;
            has(&of(DMat4::from_cols_array(&view), PERSPECTIVE, None), &["view_from_world", "NaN"]);
        }
    }
    // Row-major matrices.
    for clip in [
        PERSPECTIVE,
        [[0.2, 0.0, 0.0, 0.1], [0.0, 0.2, 0.0, 0.3], [0.0, 0.0, -0.01, -0.02], [0.0, 0.0, 0.0, 1.0]],
    ] {
        let transposed = rows(clip).to_cols_array_2d();
        has(&of(id, transposed, None), &["row-major", "transpose"]);
    }
    let view = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0));
    has(&of(view.transpose(), PERSPECTIVE, None), &["view_from_world", "last row", "column-major"]);
    has(&of(DMat4::from_scale(DVec3::splat(2.0)), PERSPECTIVE, None), &["orthonormal", "without scale"]);
    has(&of(rows(PERSPECTIVE), PERSPECTIVE, None), &["view_from_world", "clip_from_view"]);
    has(&of(DMat4::ZERO, PERSPECTIVE, None), &["view_from_world"]);
}

#[test]
fn a_z_row_that_contradicts_is_said() {
    let (id, wgpu) = (DMat4::IDENTITY, ClipSpace::WGPU);
    assert_eq!(of(id, PERSPECTIVE, Some(wgpu.reversed())), "");
    has(&of(id, PERSPECTIVE, Some(wgpu)), &["runs the other way", "reversed"]);
    // On both sides of the eye: no way to look, until z is said to grow or to fall.
    let around = [PARALLEL[0], PARALLEL[1], [0.0, 0.0, -0.01, 0.5], PARALLEL[3]];
    has(&of(id, around, None), &["both sides of the eye", "from_matrices_in"]);
    let look = |space| {
        let (id, clip) = (id.to_cols_array_2d(), rows(around).to_cols_array_2d());
        Camera::from_matrices_in(id, clip, space, [3, 2]).unwrap().forward()
    };
    assert_eq!((look(wgpu), look(wgpu.reversed())), (DVec3::NEG_Z, DVec3::Z));
    let flat = [PARALLEL[0], PARALLEL[1], [0.0; 4], PARALLEL[3]];
    has(&of(id, flat, Some(wgpu)), &["z row", "depth row"]);
    has(&of(id, [PARALLEL[0], PARALLEL[1], PARALLEL[2], [0.0, 0.0, 0.0, -1.0]], None), &["negative", "−1"]);
    // Rays within the plane of the eye.
    let along = [[0.0, 0.0, 1.0, 0.0], [0.0, 0.2, 0.0, 0.0], [0.1, 0.0, 0.0, 0.0], PARALLEL[3]];
    has(&of(id, along, Some(wgpu)), &["within the plane of the eye"]);
}

#[test]
fn another_cameras_depth_is_refused() {
    let space = ClipSpace::WGPU.reversed();
    let (id, clip) = (DMat4::IDENTITY.to_cols_array_2d(), rows(PERSPECTIVE));
    let camera = Camera::from_matrices_in(id, clip.to_cols_array_2d(), space, [30, 20]).unwrap();
    let decode = |clip: DMat4, space| {
        let encoding = DepthEncoding::Clip { clip_from_world: clip.to_cols_array_2d(), space };
        said(encoding.decode(&camera, &[0.5; 600], &mut Vec::new()))
    };
    assert_eq!(decode(clip, space), "");
    has(&decode(clip, ClipSpace::WGPU), &["other way", "reversed"]);
    has(&decode(clip, ClipSpace::VULKAN.reversed()), &["other pixels", "clip space"]);
    let aside = clip * DMat4::from_rotation_y(0.05);
    has(&decode(aside, space), &["other pixels", "of the camera itself"]);
}

#[test]
fn a_sun_that_shines_elsewhere_is_told_the_angle() {
    let camera = Camera::perspective([1.0, 2.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 60.0, [3, 2]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let with = |clip: DMat4, space, direction: DVec3| {
        let map = MapProjection::from_clip_from_world_in(clip.to_cols_array_2d(), space, [8, 8])?;
        let sun = Light::directional(direction.to_array(), [1.0; 3])?;
        let maps = MapLayout::new(MapKind::Orthographic, &[map])?;
        Setup::new(&camera, &sun, maps, &medium, 10.0).map(drop)
    };
    let (clip, wgpu, down) = (rows(PARALLEL), ClipSpace::WGPU, DVec3::NEG_Z);
    assert_eq!(said(with(clip, wgpu, down)), "");
    let angle = 0.25f64;
    let off = DVec3::new(angle.to_radians().sin(), 0.0, -angle.to_radians().cos());
    has(&said(with(clip, wgpu, off)), &["look along", "0.250000°", "light.direction"]);
    has(&said(with(clip, wgpu.reversed(), down)), &["180.000000°", "ClipSpace::reversed()"]);
    // Sheared by depth: u and v are constant along another direction than the z axis, and that one is the light's.
    let mut oblique = clip;
    oblique.z_axis.x = 0.2;
    has(&said(with(oblique, wgpu, down)), &["45.000000°"]);
    assert_eq!(said(with(oblique, wgpu, DVec3::new(1.0, 0.0, -1.0))), "");
    has(&said(with(rows(PERSPECTIVE), wgpu, down)), &["perspective shadow map", "last row 0 0 0 1"]);
    let mut tilted = clip;
    tilted.w_axis.w = -1.0;
    has(&said(with(tilted, wgpu, down)), &["negative everywhere"]);
    for entry in 0..16 {
        let mut nan = clip.to_cols_array();
        nan[entry] = f64::NAN;
        has(&said(with(DMat4::from_cols_array(&nan), wgpu, down)), &["clip_from_world", "NaN"]);
    }
    for row in 0..3 {
        let mut singular = clip.transpose();
        *singular.col_mut(row) = DVec4::ZERO;
        has(&said(with(singular.transpose(), wgpu, down)), &["singular", "invertible"]);
    }
}

#[test]
fn shadow_texels_that_mean_nothing_are_named() {
    let decode = |encoding: ShadowDepthEncoding, clip, texels: &[f32]| {
        said(encoding.decode(rows(clip).to_cols_array_2d(), [3, 2], texels, &mut Vec::new()))
    };
    let space = ClipSpace::WGPU.reversed();
    let z = ShadowDepthEncoding::Clip(space);
    assert_eq!(decode(z, PERSPECTIVE, &[0.5; 6]), "");
    for bad in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
        has(&decode(z, PERSPECTIVE, &[0.5, 0.5, 0.5, 0.5, bad, 0.5]), &["(1, 1)", "[0, 1]"]);
    }
    has(&decode(z, PERSPECTIVE, &[0.5; 5]), &["5 values", "6"]);
    has(
        &decode(ShadowDepthEncoding::Clip(ClipSpace::WGPU), PERSPECTIVE, &[0.5; 6]),
        &["other way", "reversed"],
    );
    let share = |near, far| ShadowDepthEncoding::AlongRayShare { space, near, far };
    has(&decode(share(2.0, 1.0), PERSPECTIVE, &[0.5; 6]), &["shadow map far"]);
    has(&decode(share(-1.0, 1.0), PERSPECTIVE, &[0.5; 6]), &["shadow map near"]);
    has(&decode(ShadowDepthEncoding::AlongRay(space), PERSPECTIVE, &[-1.0; 6]), &["(0, 0)", "+∞"]);
}

/// Near 180° a camera is sane up to what f64 holds, and refused before any work where it is not.
#[test]
fn fields_of_view_near_180_degrees_are_cameras_or_errors() {
    let make = |fov| Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], fov, [64, 48]);
    for fov in [179.0, 179.9999, 179.999_999_999, 180.0f64.next_down()] {
        let camera = make(fov).unwrap();
        for (x, y) in [(0, 0), (31, 23), (63, 47)] {
            let direction = camera.pixel_ray(x, y).direction;
            assert!((direction.length() - 1.0).abs() < 1e-12 && direction.dot(camera.forward()) >= 0.0);
        }
    }
    has(&said(make(180.0)), &["vertical_fov_degrees", "(0, 180)"]);
    let depth = scatter_core::DepthMap::new(&[1.0; 64 * 48], [64, 48]).unwrap();
    let camera = make(179.9999).unwrap();
    let sun = Light::directional([1.0, -0.8, -0.2], [1.0; 3]).unwrap();
    let medium = Medium::homogeneous([0.05; 3], [0.0; 3], Phase::Isotropic).unwrap();
    Frame::new(&camera, depth, &sun, &scatter_core::ShadowMap::Unshadowed, &medium, 50.0).unwrap();
}
