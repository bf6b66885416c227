//! A frame that is accepted is rendered: whatever maps and glass a frame is built with, every technique that supports it
//! is within its promise of the exact walk, or the frame is refused with an error.
//!
//! Frames are made of random parts that fit each other only sometimes: glass for the wrong kind of light, glass that looks
//! elsewhere, maps that start beside the lamp. A technique that reads glass by the kind of its light, say, returns other
//! colours than the walk, which asks every projection as it is.

use glam::{DQuat, DVec3};
use proptest::prelude::*;
use scatter::raymarch_ref::ShadowMapWalk;
use scatter::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, ModelError, Phase,
    RayLight, ScatterImage, SceneFacts, ShadowLayer, ShadowMap, TECHNIQUES, Target, VolumetricShadow,
};

const SIZE: [u32; 2] = [24, 16];
/// Texels a side of all maps.
const SIDE: u32 = 12;
/// What techniques promise, of a pixel's unoccluded light; the marcher is given steps instead, 4,096, of which each
/// change of visibility costs one: of a ray's at most 2·12·2 changes that is 1.2 %. So are froxels, as slices of a column a pixel.
const PROMISE: f64 = 0.02;
/// Epipolar slices may miss what is thinner than half a pixel (`Options::for_error`): of 384 pixels of a picture this
/// small, with texels a tenth of it wide, one in fifty.
const MISSED: usize = 8;

/// The parts of a frame.
#[derive(Debug, Clone)]
struct Parts {
    light: usize,
    map: usize,
    /// Degrees by which the map and the glass are turned away from the light, or 0.
    turned: [f64; 2],
    /// By how much map and glass are shifted away from the lamp, or 0.
    shifted: [f64; 2],
    perspective_glass: bool,
    has_glass: bool,
    direction: [f64; 3],
    g: f64,
    rgb: bool,
    seed: u64,
}

fn parts() -> impl Strategy<Value = Parts> {
    let off = |most: f64| prop_oneof![3 => Just(0.0), 1 => -most..most];
    let offs = move |most: f64| [off(most), off(most)];
    (
        (0..3usize, 0..6usize, any::<bool>(), prop::bool::weighted(0.7)),
        (offs(20.0), offs(0.5)),
        ([-1.0..1.0f64, -1.0..-0.3, -1.0..1.0], -0.7..0.7f64, any::<bool>(), any::<u64>()),
    )
        .prop_map(
            |((light, map, perspective_glass, has_glass), (turned, shifted), (direction, g, rgb, seed))| {
                Parts { light, map, turned, shifted, perspective_glass, has_glass, direction, g, rgb, seed }
            },
        )
}

/// SplitMix64, as a number in [0, 1).
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *seed;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

const LAMP: DVec3 = DVec3::new(0.3, 3.0, -0.4);
const UP: [f64; 3] = [0.2, 0.1, 1.0];

impl Parts {
    fn forward(&self) -> DVec3 {
        DVec3::from(self.direction).normalize()
    }

    /// A projection for the light, turned and shifted as `which` (0: map, 1: glass) is.
    fn projection(&self, which: usize, perspective: bool) -> Result<MapProjection, ModelError> {
        let forward = self.forward();
        let axis = forward.any_orthonormal_vector();
        let turn = DQuat::from_axis_angle(axis, self.turned[which].to_radians());
        let looks = (turn * forward).to_array();
        if perspective {
            let position = LAMP + self.shifted[which] * axis;
            MapProjection::perspective(position.to_array(), looks, UP, 0.9, SIDE)
        } else {
            MapProjection::orthographic((-6.0 * forward).to_array(), looks, UP, [3.0, 2.5], [SIDE; 2])
        }
    }

    /// Builds the frame; an error where the parts do not fit each other.
    fn with<R>(&self, visit: impl FnOnce(&Frame<'_>) -> R) -> Result<R, ModelError> {
        let mut seed = self.seed;
        let camera = Camera::perspective([0.0, 1.0, 4.0], [0.0, 1.2, 0.0], [0.0, 1.0, 0.0], 60.0, SIZE)?;
        let forward = self.forward().to_array();
        let light = match self.light {
            0 => Light::directional(forward, [3.0, 2.0, 1.0])?,
            1 => Light::point(LAMP.to_array(), [3.0, 2.0, 1.0], 0.0)?,
            _ => Light::spot(LAMP.to_array(), forward, [3.0, 2.0, 1.0], 20.0, 40.0, 0.0)?,
        };
        let area = (SIDE * SIDE) as usize;
        let texels: Vec<f32> = (0..6 * area)
            .map(|_| if random(&mut seed) < 0.4 { f32::INFINITY } else { (9.0 * random(&mut seed)) as f32 })
            .collect();
        let layer = |index: usize, perspective: bool| {
            ShadowLayer::new(self.projection(0, perspective)?, &texels[index * area..][..area])
        };
        let (cascades, faces): ([_; 2], Vec<_>);
        let shadow = match self.map {
            0 => ShadowMap::Unshadowed,
            1 => ShadowMap::Orthographic(layer(0, false)?),
            2 => ShadowMap::Perspective(layer(0, true)?),
            3 => ShadowMap::Cube(CubeShadow::new((LAMP + self.shifted[0]).to_array(), SIDE, &texels)?),
            4 => {
                cascades = [layer(0, false)?, layer(1, false)?];
                ShadowMap::Cascades(&cascades)
            }
            _ => {
                let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(self.turned[0]);
                let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
                faces = axes
                    .iter()
                    .enumerate()
                    .map(|(index, &axis)| {
                        let up = turn * axis.any_orthonormal_vector();
                        let position = LAMP + self.shifted[0];
                        let looks = (turn * axis).to_array();
                        let map =
                            MapProjection::perspective(position.to_array(), looks, up.to_array(), 1.0, SIDE)?;
                        ShadowLayer::new(map, &texels[index * area..][..area])
                    })
                    .collect::<Result<_, _>>()?;
                ShadowMap::Faces(faces.as_array().expect("six axes"))
            }
        };
        let distances: Vec<f32> =
            (0..SIZE[0] * SIZE[1]).map(|_| (1.0 + 6.0 * random(&mut seed)) as f32).collect();
        let absorption = if self.rgb { [0.0, 0.1, 0.3] } else { [0.1; 3] };
        let medium = Medium::homogeneous([0.1; 3], absorption, Phase::henyey_greenstein(self.g)?)?;
        let glass: Vec<[f32; 3]> = (0..area).map(|_| [0, 1, 2].map(|_| random(&mut seed) as f32)).collect();
        let depth = DepthMap::new(&distances, SIZE)?;
        let frame = Frame::new(&camera, depth, &light, &shadow, &medium, 8.0)?;
        if !self.has_glass {
            return Ok(visit(&frame));
        }
        let texture = LightTexture::new(self.projection(1, self.perspective_glass)?, &glass)?;
        Ok(visit(&frame.with_texture(&texture)?))
    }
}

/// Renders the frame with every technique that supports it and compares it with the walk: complaints.
fn complaints(frame: &Frame<'_>) -> Vec<String> {
    let mut truth = ScatterImage::new();
    ShadowMapWalk::new().render(frame, &mut truth).expect("the reference renders every frame");
    let facts = SceneFacts::of(frame);
    let mut found = Vec::new();
    for technique in TECHNIQUES {
        let id = technique.info().id;
        let samples = [("steps", "4096"), ("grid", "24x16x4096")];
        let own = samples.iter().position(|(key, _)| technique.info().option(key).is_ok());
        let overrides = own.map_or(&samples[..0], |index| &samples[index..=index]);
        let mut instance = match technique.configure(Target::Error(PROMISE), overrides, &facts) {
            Ok(instance) => instance,
            Err(error) => return vec![format!("{id}: {error}")],
        };
        if instance.supports(frame).is_err() {
            continue;
        }
        let mut image = ScatterImage::new();
        instance.render(frame, &mut image).expect("a supported frame is rendered");
        let mut beyond = 0;
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            let (eye, ray) = (frame.camera().eye(), frame.camera().pixel_ray(x, y));
            let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
            let whole = light.interval(0.0, frame.ray_end(x, y));
            let off = (0..3).any(|channel| {
                let (value, exact) = (image.at(x, y)[channel], truth.at(x, y)[channel]);
                !(f64::from((value - exact).abs()) <= PROMISE * whole[channel] + 1e-30)
            });
            beyond += usize::from(off);
        }
        if beyond > MISSED {
            found.push(format!("{id}: {beyond} pixels beyond {PROMISE} of the light"));
        }
    }
    found
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, max_shrink_iters: 64, ..ProptestConfig::default() })]

    #[test]
    fn a_frame_that_is_accepted_is_rendered_within_its_promise(parts in parts()) {
        match parts.with(complaints) {
            Ok(complaints) => prop_assert!(complaints.is_empty(), "{complaints:?}"),
            Err(ModelError::Mismatch(reason)) => {
                prop_assert!(reason.contains("; give ") || reason.contains("; build ") || reason.contains(" needs "), "no cure in: {reason}");
            }
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}

#[test]
fn frames_of_every_light_map_and_glass_are_among_the_accepted_ones() {
    let base = Parts {
        light: 0,
        map: 0,
        turned: [0.0; 2],
        shifted: [0.0; 2],
        perspective_glass: false,
        has_glass: true,
        direction: [0.2, -1.0, 0.1],
        g: 0.3,
        rgb: false,
        seed: 7,
    };
    let accepted = |light: usize, map: usize, change: fn(&mut Parts)| {
        let mut parts = Parts { light, map, perspective_glass: light > 0, ..base.clone() };
        change(&mut parts);
        parts.with(complaints).map(|complaints| assert!(complaints.is_empty(), "{complaints:?}")).is_ok()
    };
    for (light, maps) in [(0, &[0, 1, 4][..]), (1, &[0, 3, 5]), (2, &[0, 2, 3, 5])] {
        for map in 0..6 {
            assert_eq!(accepted(light, map, |_| {}), maps.contains(&map), "light {light}, map {map}");
        }
        // Of what the light cannot have, each is refused alone.
        assert!(!accepted(light, maps[0], |parts| parts.perspective_glass = !parts.perspective_glass));
    }
    assert!(!accepted(0, 0, |parts| parts.turned[1] = 1.0), "glass that does not look along the sun");
    assert!(!accepted(2, 0, |parts| parts.shifted[1] = 0.1), "glass that does not start at the lamp");
    assert!(accepted(2, 0, |parts| parts.turned[1] = 10.0), "a lamp's glass may look anywhere");
}
