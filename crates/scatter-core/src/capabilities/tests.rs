//! What is named is rendered, what is not named is refused, and refusals say what to give.

use super::*;
use crate::camera::{Camera, Window};
use crate::light::Light;
use crate::map_layout::MapLayout;
use crate::map_projection::MapProjection;
use crate::map_source::MapError;
use crate::translucent::{Translucent, TranslucentSource};
use crate::translucent_segment::TranslucentSegment;

/// All that the model has today, by name.
const ALL: Capabilities = Capabilities {
    lights: LightKind::ALL,
    textures: LightKind::ALL,
    maps: MapKind::ALL,
    cameras: CameraKind::ALL,
    extinctions: ExtinctionKind::ALL,
    phases: PhaseKind::ALL,
    phase_sums: true,
    height_fog: LightKind::ALL,
    translucent: LightKind::ALL,
    endless_rays: true,
    limits: Limits { sun_g: 1.0, lamp_g: 1.0, cascades: 16, layer_texels: u64::MAX },
};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

fn cameras() -> Vec<Camera> {
    let (eye, target) = ([0.0, 4.0, 8.0], [0.0, 1.0, 0.0]);
    let window = Window { left: -0.2, right: 0.9, bottom: -0.5, top: 0.5 };
    vec![
        Camera::perspective(eye, target, UP, 60.0, [4, 3]).unwrap(),
        Camera::perspective_off_centre(eye, target, UP, window, [4, 3]).unwrap(),
        Camera::orthographic(eye, target, UP, 5.0, [4, 3]).unwrap(),
    ]
}

fn lobe(g: f64, sigma_a: [f64; 3]) -> Medium {
    Medium::homogeneous([0.1; 3], sigma_a, Phase::HenyeyGreenstein { g }).unwrap()
}

/// Lights with every layout that fits them.
fn lights() -> Vec<(Light, MapLayout)> {
    let (down, position) = ([0.0, -1.0, 0.0], [0.0, 3.0, 0.0]);
    let sun = Light::directional(down, [1.0; 3]).unwrap();
    let lamp = Light::point(position, [1.0; 3], 0.0).unwrap();
    let spot = Light::spot(position, down, [1.0; 3], 20.0, 30.0, 0.0).unwrap();
    let parallel = MapProjection::orthographic(position, down, UP, [5.0; 2], [8, 8]).unwrap();
    let cone = MapProjection::perspective(position, down, UP, 0.6, 8).unwrap();
    let faces: Vec<_> = (0..6).map(|face| MapProjection::cube_face(position, face, 8).unwrap()).collect();
    let layout = |kind, maps: &[MapProjection]| MapLayout::new(kind, maps).unwrap();
    vec![
        (sun.clone(), MapLayout::UNSHADOWED),
        (sun.clone(), layout(MapKind::Orthographic, &[parallel])),
        (sun, layout(MapKind::Cascades, &[parallel; 3])),
        (lamp.clone(), MapLayout::cube(position, 8).unwrap()),
        (lamp, layout(MapKind::Faces, &faces)),
        (spot, layout(MapKind::Perspective, &[cone])),
    ]
}

#[test]
fn nothing_renders_no_frame_and_all_renders_every_one() {
    for (light, maps) in lights() {
        for camera in &cameras() {
            let medium = lobe(0.5, [0.0; 3]);
            let setup = Setup::new(camera, &light, maps, &medium, 10.0).unwrap();
            assert!(ALL.check_setup(&setup).is_ok());
            assert!(Capabilities::NOTHING.check_setup(&setup).is_err());
        }
    }
}

#[test]
fn a_kind_that_is_not_named_is_refused_with_what_to_give_instead() {
    let (cameras, lights) = (cameras(), lights());
    let grey = lobe(0.5, [0.0; 3]);
    let refused = |capabilities: Capabilities, camera: usize, light: usize, medium: &Medium, end: f64| {
        let (light, maps) = &lights[light];
        let setup = Setup::new(&cameras[camera], light, *maps, medium, end).unwrap();
        assert!(ALL.check_setup(&setup).is_ok());
        capabilities.check_setup(&setup).unwrap_err().reason.into_owned()
    };
    let perspective = Capabilities { cameras: &[CameraKind::Perspective], ..ALL };
    assert_eq!(refused(perspective, 2, 0, &grey, 9.0), "an orthographic camera; give a perspective camera");
    assert!(refused(perspective, 1, 0, &grey, 9.0).starts_with("an off-centre perspective camera"));
    let suns = Capabilities { lights: &[LightKind::Directional], ..ALL };
    assert_eq!(refused(suns, 0, 3, &grey, 9.0), "a point light; give a directional light");
    let one_map = Capabilities { maps: &[MapKind::Unshadowed, MapKind::Orthographic], ..ALL };
    assert_eq!(refused(one_map, 0, 2, &grey, 9.0), "cascades; give no shadow map or one parallel shadow map");
    let rgb = lobe(0.5, [0.0, 0.1, 0.2]);
    let greys = Capabilities { extinctions: &[ExtinctionKind::Grey], ..ALL };
    assert_eq!(refused(greys, 0, 0, &rgb, 9.0), "extinction that differs by channel; give grey extinction");
    let even = Capabilities { phases: &[PhaseKind::Isotropic], ..ALL };
    assert_eq!(refused(even, 0, 0, &grey, 9.0), "Henyey-Greenstein scattering; give isotropic scattering");
    let parts = [grey.components(), &[Scattering { sigma_s: [0.1; 3], phase: Phase::Rayleigh }]].concat();
    let air = Medium::new(parts, [0.0; 3]).unwrap();
    let single = Capabilities { phase_sums: false, ..ALL };
    assert!(refused(single, 0, 0, &air, 9.0).contains("give one component"));
    let finite = Capabilities { endless_rays: false, ..ALL };
    assert!(refused(finite, 0, 0, &grey, f64::INFINITY).contains("give a finite max_distance"));
}

#[test]
fn limits_are_for_the_light_that_they_name_and_hold_up_to_their_value() {
    let (cameras, lights) = (cameras(), lights());
    let with = |limits: Limits| Capabilities { limits, ..ALL };
    let needle = lobe(-0.995, [0.0; 3]);
    let check = |limits: Limits, (light, maps): &(Light, MapLayout)| {
        with(limits).check_setup(&Setup::new(&cameras[0], light, *maps, &needle, 9.0).unwrap())
    };
    let lamps = Limits { lamp_g: 0.99, ..ALL.limits };
    assert!(check(lamps, &lights[0]).is_ok(), "a sun's lobe is not a lamp's");
    let reason = check(lamps, &lights[3]).unwrap_err().reason;
    assert_eq!(reason, "a phase function with |g| = 0.995 around a lamp; give |g| of at most 0.99");
    assert!(check(Limits { sun_g: 0.9, ..ALL.limits }, &lights[0]).is_err());
    assert!(check(Limits { cascades: 3, ..ALL.limits }, &lights[2]).is_ok());
    let reason = check(Limits { cascades: 2, ..ALL.limits }, &lights[2]).unwrap_err().reason;
    assert_eq!(reason, "3 cascades; give at most 2");
    assert!(check(Limits { layer_texels: 64, ..ALL.limits }, &lights[1]).is_ok());
    assert!(
        check(Limits { layer_texels: 63, ..ALL.limits }, &lights[1])
            .unwrap_err()
            .reason
            .contains("64 texels")
    );
}

#[test]
fn a_texture_is_refused_by_the_kind_of_its_light() {
    let (camera, medium) = (&cameras()[0], lobe(0.0, [0.0; 3]));
    let (sun, maps) = &lights()[0];
    let projection = MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], UP, [5.0; 2], [8, 8]).unwrap();
    let setup = Setup::new(camera, sun, *maps, &medium, 9.0).unwrap().with_texture(projection).unwrap();
    assert!(Capabilities { textures: &[LightKind::Directional], ..ALL }.check_setup(&setup).is_ok());
    let spots = Capabilities { textures: &[LightKind::Spot], ..ALL }.check_setup(&setup).unwrap_err();
    assert_eq!(spots.reason, "a directional light with a colour texture; give it without, or a spot light");
    assert!(Capabilities { textures: &[], ..ALL }.check_setup(&setup).is_err());
}

#[test]
fn height_fog_is_refused_by_the_kind_of_its_light() {
    let falloff = crate::HeightFalloff::new([0.0, 1.0, 0.0], 0.0, 2.0).unwrap();
    let (camera, fog) = (&cameras()[0], lobe(0.0, [0.0; 3]).with_height_falloff(falloff));
    let refused = |capabilities: Capabilities, light: usize| {
        let (light, maps) = &lights()[light];
        let setup = Setup::new(camera, light, *maps, &fog, 9.0).unwrap();
        capabilities.check_setup(&setup).map_err(|unsupported| unsupported.reason.into_owned())
    };
    let none = Capabilities { height_fog: &[], ..ALL };
    let suns = Capabilities { height_fog: &[LightKind::Directional], ..ALL };
    assert!(refused(ALL, 0).is_ok() && refused(ALL, 3).is_ok() && refused(suns, 0).is_ok());
    let reason = "a directional light in height fog; give a medium without height_falloff";
    assert_eq!(refused(none, 0).unwrap_err(), reason);
    let reason = "a spot light in height fog; give it without, or a directional light";
    assert_eq!(refused(suns, 5).unwrap_err(), reason);
    assert!(suns.to_string().contains("height fog: directional"));
    assert_eq!(suns.cannot(), ["a point light in height fog", "a spot light in height fog"]);
}

#[test]
fn translucent_occluders_are_refused_by_the_kind_of_their_light() {
    let (camera, medium) = (&cameras()[0], lobe(0.0, [0.0; 3]));
    let source = NoOccluder;
    let refused = |capabilities: Capabilities, light: usize| {
        let (light, maps) = &lights()[light];
        let setup = Setup::new(camera, light, *maps, &medium, 9.0).unwrap();
        assert!(capabilities.check_setup(&setup).is_ok());
        let setup = setup.with_translucent(&Translucent::Source(&source)).unwrap();
        assert!(crate::SceneFacts::of_setup(&setup).translucent);
        capabilities.check_setup(&setup).map_err(|unsupported| unsupported.reason.into_owned())
    };
    let none = Capabilities { translucent: &[], ..ALL };
    let suns = Capabilities { translucent: &[LightKind::Directional], ..ALL };
    assert!(refused(ALL, 0).is_ok() && refused(ALL, 3).is_ok() && refused(suns, 0).is_ok());
    let reason = "a directional light dimmed by translucent occluders; give a frame without them";
    assert_eq!(refused(none, 0).unwrap_err(), reason);
    let reason = "a spot light dimmed by translucent occluders; give it without, or a directional light";
    assert_eq!(refused(suns, 5).unwrap_err(), reason);
    assert!(suns.to_string().contains("translucent occluders: directional"));
    let cannot =
        ["a point light dimmed by translucent occluders", "a spot light dimmed by translucent occluders"];
    assert_eq!(suns.cannot(), cannot);
}

/// A source without occluders.
struct NoOccluder;

impl TranslucentSource for NoOccluder {
    fn capture(
        &self,
        _: &MapProjection,
        _: [u32; 4],
        _: &mut dyn FnMut(u32, TranslucentSegment),
    ) -> Result<(), MapError> {
        Ok(())
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        None
    }

    fn memory_bytes(&self) -> u64 {
        0
    }
}

#[test]
fn the_description_names_what_is_there_and_what_is_not() {
    let some = Capabilities {
        cameras: &[CameraKind::Perspective],
        limits: Limits { lamp_g: 0.99, ..ALL.limits },
        ..ALL
    };
    let text = some.to_string();
    assert!(text.contains("cameras: perspective\n") && text.contains("|g| ≤ 0.99 around a lamp"), "{text}");
    let cannot =
        ["an off-centre perspective camera", "an orthographic camera", "lamps in media with |g| > 0.99"];
    assert_eq!(some.cannot(), cannot);
    assert!(ALL.cannot().is_empty());
}
