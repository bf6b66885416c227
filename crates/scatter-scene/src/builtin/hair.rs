//! `hair`: a head of ten thousand curls against the sun.
//!
//! An OBJ file, as hair comes out of modelling programs: polylines without a radius or an opacity, which the shot gives. The
//! strands leave the scalp along its normal, bend downwards, curl, and slide along the head where they meet it.

use super::glb_writer::GlbScene;
use super::mesh::Mesh;
use super::obj_writer::obj_text;
use super::random::{Random, sin_cos_turns};
use super::shot::BuiltinShot;
use glam::DVec3;
use std::fmt::Write;

pub(super) const SHOT: BuiltinShot = BuiltinShot {
    name: "hair",
    shows: "a head of ten thousand curled strands before a low sun: thin occluders by the thousand along a light ray, each \
            of which takes a part of the light at one depth",
    shot_text: r#"# A head of hair against the sun.
mesh = "hair.obj"

[camera]
eye = [-0.35, 1.35, 2.5]
target = [0.1, 1.2, 0.0]
up = [0.0, 1.0, 0.0]
vertical_fov_degrees = 44.0
resolution = [640, 480]
max_distance = 12.0

[light]
kind = "directional"
direction = [0.45, -0.4, 0.8]
irradiance = [9.0, 8.0, 6.5]

[medium]
scattering = [0.22, 0.22, 0.22]
absorption = [0.02, 0.02, 0.02]
phase = "henyey-greenstein"
g = 0.4

[strands]
radius = 0.0016
opacity = 0.55
"#,
    mesh_extension: "obj",
    mesh_bytes,
    others: &[],
};

/// Strands, and segments of each.
const STRANDS: u32 = 10_000;
const SEGMENTS: u32 = 9;
/// The head: middle and radius \[m\].
pub(super) const HEAD: (DVec3, f64) = (DVec3::new(0.0, 1.3, 0.0), 0.36);

fn mesh_bytes() -> Vec<u8> {
    let mut text = obj_text("a head of hair", &[("bust", &bust()), ("floor", &floor())]);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "o hair");
    let mut random = Random::new(417);
    for strand in head_of_hair(STRANDS, SEGMENTS, &mut random) {
        for p in &strand {
            let [x, y, z] = p.to_array().map(|x| x as f32 + 0.0);
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        // Counted backwards, as files are written that are appended to.
        let _ = write!(text, "l");
        for index in (1..=strand.len()).rev() {
            let _ = write!(text, " -{index}");
        }
        let _ = writeln!(text);
    }
    text.into_bytes()
}

/// Head, neck and shoulders, as a turner would make them.
pub(super) fn bust() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.5, -0.02),
        (0.52, 0.3),
        (0.34, 0.62),
        (0.13, 0.76),
        (0.13, 0.92),
        (0.24, 1.02),
        (0.335, 1.17),
        (0.355, 1.3),
        (0.32, 1.46),
        (0.2, 1.6),
        (0.05, 1.655),
    ];
    mesh.add_lathe(DVec3::ZERO, &profile, 32);
    mesh
}

pub(super) fn floor() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(DVec3::new(-4.0, -0.3, -4.0), DVec3::new(4.0, 0.0, 5.0));
    mesh
}

/// Curls that grow from the upper part of the head.
pub(super) fn head_of_hair(count: u32, segments: u32, random: &mut Random) -> Vec<Vec<DVec3>> {
    (0..count).map(|_| strand(segments, random)).collect()
}

fn strand(segments: u32, random: &mut Random) -> Vec<DVec3> {
    let (middle, radius) = HEAD;
    // The face, towards +z and below, stays free.
    let normal = loop {
        let normal = random.direction();
        if normal.y > -0.25 && !(normal.z > 0.45 && normal.y < 0.45) {
            break normal;
        }
    };
    let mut p = middle + normal * radius;
    let length = random.between(0.5, 0.75) / f64::from(segments);
    let mut along = normal;
    let (start, curl) = (random.unit(), random.between(0.1, 0.2));
    let drift = random.in_ball() * 0.25;
    let mut strand = vec![p];
    for index in 1..=segments {
        let (sine, cosine) = sin_cos_turns(start + curl * f64::from(index));
        let wave = DVec3::new(cosine, 0.0, sine) * 0.55 + drift;
        along = (along + DVec3::NEG_Y * 0.42 + wave * 0.5).normalize();
        p += along * length;
        // Strands lie on the head, they do not enter it.
        let from_middle = p - middle;
        let distance = from_middle.length();
        if distance < 1.02 * radius {
            p = middle + from_middle * (1.02 * radius / distance);
        }
        strand.push(p);
    }
    strand
}

/// The bust and the floor of this shot, for the one that adds smoke.
pub(super) fn add_bust(scene: &mut GlbScene) {
    scene.add_mesh_node("bust", bust());
    scene.add_mesh_node("floor", floor());
}
