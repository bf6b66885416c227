//! Every entry of a camera's matrices counts: rays against the definition (what a ray meets is seen at its pixel, through
//! the whole matrix), closed forms, and mutants that lack an entry.

use glam::{DMat4, DQuat, DVec3, DVec4};
use scatter_core::{Camera, ClipSpace, DepthEncoding, ModelError, Projection};

use crate::conventions::Random;

const SIZE: [u32; 2] = [37, 23];

fn camera(view: DMat4, clip: DMat4, space: ClipSpace) -> Result<Camera, ModelError> {
    Camera::from_matrices_in(view.to_cols_array_2d(), clip.to_cols_array_2d(), space, SIZE)
}

fn rows(rows: [[f64; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&rows).transpose()
}

/// Reversed z with an infinite far plane, off-centre.
fn perspective() -> DMat4 {
    rows([[1.2, 0.0, 0.15, 0.0], [0.0, 1.7, -0.2, 0.0], [0.0, 0.0, 0.0, 0.1], [0.0, 0.0, -1.0, 0.0]])
}

fn parallel() -> DMat4 {
    rows([[0.25, 0.0, 0.0, 0.1], [0.0, 0.3, 0.0, -0.2], [0.0, 0.0, 0.01, 1.0], [0.0, 0.0, 0.0, 1.0]])
}

/// What engines put before and behind a projection, each with its name.
fn variants() -> Vec<(&'static str, DMat4)> {
    let quarter = |turns: f64| DMat4::from_rotation_z(turns * std::f64::consts::FRAC_PI_2);
    let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let mut sheared = DMat4::IDENTITY;
    (sheared.x_axis.y, sheared.y_axis.x) = (0.3, -0.4);
    let mut oblique = DMat4::IDENTITY;
    (oblique.z_axis.x, oblique.z_axis.y) = (0.35, -0.2);
    let offset = DMat4::from_translation(DVec3::new(0.032, -0.2, 0.0));
    let behind = DMat4::from_translation(DVec3::new(0.0, 0.0, -0.7));
    let mut keystone = DMat4::IDENTITY;
    (keystone.x_axis.w, keystone.y_axis.w) = (0.1, -0.15);
    let both = |name, before: DMat4, behind: DMat4| {
        [(name, before * perspective() * behind), (name, before * parallel() * behind)]
    };
    let id = DMat4::IDENTITY;
    let mut all: Vec<_> = [
        both("plain", id, id),
        both("turned by 90°", quarter(1.0), id),
        both("turned by 180°", quarter(2.0), id),
        both("turned by 270°", quarter(3.0), id),
        both("turned by 90° and mirrored", mirror * quarter(1.0), id),
        both("mirrored", mirror, id),
        both("sheared", sheared, id),
        both("an eye beside the view's origin", id, offset),
        both("an eye beside the origin, turned", quarter(1.0), offset),
        both("oblique", id, oblique),
        both("oblique, sheared, turned, beside", quarter(1.0) * sheared, oblique * offset),
    ]
    .into_iter()
    .flatten()
    .collect();
    // A projector's keystone has no parallel counterpart: its rays would meet nowhere, and not be parallel in the image.
    all.push(("keystone", keystone * perspective()));
    all.push(("an eye behind the view's origin", perspective() * behind));
    all.push(("three times itself", perspective() * 3.0));
    all.push(("a left-handed one", perspective() * DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0))));
    all.push(("a parallel left-handed one", parallel() * DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0))));
    all
}

fn views() -> [DMat4; 2] {
    let far = DMat4::from_rotation_translation(
        DQuat::from_axis_angle(DVec3::new(0.6, -0.64, 0.48), 2.1),
        DVec3::new(1e3, -2e2, 3e2),
    );
    [DMat4::IDENTITY, far.inverse()]
}

#[test]
fn what_a_ray_meets_is_seen_at_its_pixel() {
    let mut random = Random(5);
    let mut worst = 0.0f64;
    for (name, clip) in variants() {
        for view in views() {
            let camera = camera(view, clip, ClipSpace::WGPU.reversed())
                .unwrap_or_else(|error| panic!("{name}: {error}"));
            let whole = clip * view;
            for _ in 0..50 {
                let (x, y) = (random.range(0.0, 37.0), random.range(0.0, 23.0));
                let ray = camera.ray(x, y);
                let mut before = f64::NEG_INFINITY;
                for t in [0.3, 1.0, 20.0, 400.0] {
                    let p = camera.eye() + ray.origin + ray.direction * t;
                    let seen = whole * p.extend(1.0);
                    let pixel = [
                        0.5 * f64::from(SIZE[0]) * (seen.x / seen.w + 1.0),
                        0.5 * f64::from(SIZE[1]) * (1.0 - seen.y / seen.w),
                    ];
                    let again = camera.image_from_world(p);
                    let off = [pixel[0] - x, pixel[1] - y, again.x / again.z - x, again.y / again.z - y];
                    worst = off.iter().fold(worst, |worst, off| worst.max(off.abs()));
                    // Reversed z falls along the ray, in front of the eye.
                    assert!(seen.w > 0.0 && -seen.z / seen.w > before, "{name} at {t}");
                    before = -seen.z / seen.w;
                }
            }
        }
    }
    // Positions of 10³ in f64, seen from 0.3 units: 10³·2⁻⁵²/0.3 of 40 pixels, a few times.
    println!("rays miss their pixels by {worst:.1e} of 1e-9");
    assert!(worst < 1e-9);
}

#[test]
fn an_eye_offset_moves_the_eye_by_it() {
    // x_clip = f·(X − 0.032): all rays pass X = 0.032.
    let mut clip = perspective();
    (clip.w_axis.x, clip.w_axis.y) = (-1.2 * 0.032, 1.7 * 0.4);
    let camera = camera(DMat4::IDENTITY, clip, ClipSpace::WGPU.reversed()).unwrap();
    assert!(camera.eye().distance(DVec3::new(0.032, -0.4, 0.0)) < 1e-15, "{}", camera.eye());
    // The ray of clip (a, b) is ((a + 0.15·…)): x = (a − x.z·Z/…)/x.x at Z = −1.
    let direction = DVec3::new((0.25 + 0.15) / 1.2, (-0.5 - 0.2) / 1.7, -1.0).normalize();
    let (x, y) = (0.5 * 37.0 * 1.25, 0.5 * 23.0 * 1.5);
    assert!(camera.ray(x, y).direction.distance(direction) < 1e-15);
    assert_eq!(camera.ray(x, y).origin, DVec3::ZERO);
}

#[test]
fn an_oblique_parallel_projection_has_oblique_rays() {
    // A cabinet projection: depth runs up and to the right by half.
    let (a, b) = (0.5 * 0.5f64.sqrt(), 0.5 * 0.5f64.sqrt());
    let clip = rows([
        [0.25, 0.0, 0.25 * a, 0.0],
        [0.0, 0.25, 0.25 * b, 0.0],
        [0.0, 0.0, -0.01, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    for camera in [
        camera(DMat4::IDENTITY, clip, ClipSpace::WGPU).unwrap(),
        Camera::from_matrices(DMat4::IDENTITY.to_cols_array_2d(), clip.to_cols_array_2d(), SIZE).unwrap(),
    ] {
        assert_eq!(camera.projection(), Projection::Orthographic);
        let ray = camera.ray(37.0, 0.0);
        assert!(ray.direction.distance(DVec3::new(a, b, -1.0).normalize()) < 1e-15, "{ray:?}");
        // It starts in the plane of the eye.
        assert!(ray.origin.distance(DVec3::new(4.0, 4.0, 0.0)) < 1e-14, "{ray:?}");
        assert_eq!(camera.forward(), DVec3::NEG_Z);
    }
}

/// Largest difference of two cameras' rays over the image: starts and directions.
fn difference(a: &Camera, b: &Camera) -> f64 {
    let corners = [[0.0, 0.0], [37.0, 0.0], [0.0, 23.0], [37.0, 23.0], [11.0, 5.0]];
    corners
        .map(|[x, y]| {
            let (p, q) = (a.ray(x, y), b.ray(x, y));
            (a.eye() + p.origin).distance(b.eye() + q.origin) + p.direction.distance(q.direction)
        })
        .into_iter()
        .fold(0.0, f64::max)
}

#[test]
fn a_matrix_that_lacks_an_entry_or_is_transposed_is_another_camera_or_none() {
    let mut random = Random(6);
    let mut mutants = 0;
    for parallel in [false, true] {
        for _ in 0..200 {
            let entry = |random: &mut Random, size: f64| {
                random.range(0.2 * size, size) * if random.unit() < 0.5 { 1.0 } else { -1.0 }
            };
            let mut m = [[0.0; 4]; 4];
            for (row, line) in m.iter_mut().enumerate() {
                for (column, slot) in line.iter_mut().enumerate() {
                    *slot = if row == column { 1.0 } else { entry(&mut random, 0.3) };
                }
            }
            m[2] = if parallel { [0.02, 0.01, 0.05, 0.4] } else { [0.02, 0.01, 0.05, 0.3] };
            m[3] = if parallel { [0.0, 0.0, 0.0, 1.0] } else { [0.1, -0.1, -1.0, 0.2] };
            let space = ClipSpace::WGPU.reversed();
            let Ok(whole) = camera(DMat4::IDENTITY, rows(m), space) else { continue };
            let differs = |m: [[f64; 4]; 4], what: &str| {
                if let Ok(mutant) = camera(DMat4::IDENTITY, rows(m), space) {
                    assert!(difference(&whole, &mutant) > 1e-3, "{what}");
                }
            };
            for row in [0, 1, 3] {
                for column in 0..4 {
                    if m[row][column] != 0.0 {
                        let mut mutant = m;
                        mutant[row][column] = 0.0;
                        differs(mutant, &format!("without entry ({row}, {column})"));
                        mutants += 1;
                    }
                }
            }
            differs(std::array::from_fn(|i| std::array::from_fn(|j| m[j][i])), "transposed");
        }
    }
    println!("{mutants} mutants");
    assert!(mutants > 2000);
}

#[test]
fn depth_through_the_matrix_gives_distances_along_every_kind_of_ray() {
    let mut worst = 0.0f64;
    for (name, clip) in variants() {
        for view in views() {
            for oblique_near in [false, true] {
                let mut clip = clip;
                if oblique_near {
                    // Lengyel's oblique near plane is a z row with all four entries.
                    (clip.x_axis.z, clip.y_axis.z) = (0.003, -0.002);
                }
                let space = ClipSpace::WGPU.reversed();
                let camera = camera(view, clip, space).unwrap();
                let whole = clip * view;
                let distances: Vec<f64> = (0..37 * 23).map(|n| 2.0 + f64::from(n % 50)).collect();
                let buffer: Vec<f32> = (0..37 * 23)
                    .map(|n| {
                        let ray = camera.pixel_ray(n % 37, n / 37);
                        let p = camera.eye() + ray.origin + ray.direction * distances[n as usize];
                        let seen: DVec4 = whole * p.extend(1.0);
                        (seen.z / seen.w) as f32
                    })
                    .collect();
                if buffer.iter().any(|z| !(0.0..=1.0).contains(z)) {
                    assert!(oblique_near, "{name}: the plain planes hold every surface");
                    continue;
                }
                let encoding = DepthEncoding::Clip { clip_from_world: whole.to_cols_array_2d(), space };
                let (mut decoded, mut again) = (Vec::new(), Vec::new());
                encoding.decode(&camera, &buffer, &mut decoded).unwrap_or_else(|e| panic!("{name}: {e}"));
                encoding.encode(&camera, &decoded, &mut again).unwrap();
                for (index, &distance) in distances.iter().enumerate() {
                    // z rounds to 2⁻²⁴ of itself. It is at most 1 and its change with distance is at least
                    // 0.1/52² of a perspective, 0.005 of a parallel one (0.7 of the rays is along z).
                    let slope = if camera.projection() == Projection::Perspective { 3e-5 } else { 5e-3 };
                    let rounding =
                        f64::from(buffer[index]) * 2f64.powi(-24) / slope + distance * 2f64.powi(-23);
                    let off = (f64::from(decoded[index]) - distance).abs();
                    worst = worst.max(off / rounding);
                    assert!((buffer[index] - again[index]).abs() <= 2f32.powi(-22), "{name}");
                }
            }
        }
    }
    println!("distances are off by {worst:.2} of what f32 rounds");
    assert!(worst <= 1.0);
}
