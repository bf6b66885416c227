//! A random world: triangles, a camera, a light, a medium and the light's map, all of which can be moved together.
//!
//! The maps are cast once, in the world's own frame; a moved world carries the same texels along. So a property such
//! as "a rigid motion leaves the image unchanged" tests the technique, not the ray caster's luck at an edge.

use glam::{DAffine3, DMat4, DVec3};
use proptest::prelude::*;
use raymarch_ref::{Options, RayMarch, ShadowMapWalk};
use scatter::epipolar::{Epipolar, Options as EpipolarOptions};
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, MapProjection, Medium, Phase, RayLight, ScatterImage,
    Scattering, SceneFacts, ShadowLayer, ShadowMap, Target, Technique, VolumetricShadow,
};
use scatter_scene::{RaycastTruth, Scene, SceneCaster};

/// What renders a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Exact visibility by the triangles.
    RaycastTruth,
    /// The exact walk through the map.
    ShadowMapWalk,
    /// The marcher with that many steps.
    RayMarch(u32),
    /// Epipolar integration with uniform slices a quarter of a pixel apart and eight terms: without choices that
    /// rounding could tip over.
    Epipolar,
}

/// A light, before it is moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WorldLight {
    /// A sun: direction.
    Sun(DVec3),
    /// A lamp: position.
    Point(DVec3),
    /// A lamp with a cone: position, axis, inner and outer half angle in degrees.
    Spot(DVec3, DVec3, f64, f64),
}

/// Whether a world is reflected at x = 0 before it is moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mirror {
    /// As it is.
    No,
    /// Reflected: left is right.
    Yes,
}

/// Everything that a frame needs, in the world's own frame, and how that frame lies in space.
#[derive(Debug, Clone)]
pub struct World {
    /// Three corners a triangle.
    pub triangles: Vec<[DVec3; 3]>,
    /// Eye and target; up is y.
    pub eye: DVec3,
    /// Where the camera looks.
    pub target: DVec3,
    /// Width and height of the image.
    pub size: [u32; 2],
    /// The light.
    pub light: WorldLight,
    /// Irradiance or intensity.
    pub strength: [f64; 3],
    /// The medium's components.
    pub components: Vec<Scattering>,
    /// Its absorption.
    pub sigma_a: [f64; 3],
    /// Where rays end.
    pub max_distance: f64,
    /// Texels along an edge of the light's map.
    pub map_side: u32,
    /// The rigid motion that carries the world into space.
    pub motion: DAffine3,
    /// The uniform scale before it.
    pub scale: f64,
    /// The reflection before that.
    pub mirror: Mirror,
    /// Depths of the camera and of the light, cast in the world's own frame.
    maps: Option<Maps>,
}

#[derive(Clone)]
struct Maps {
    depth: Vec<f32>,
    shadow: Vec<f32>,
}

impl std::fmt::Debug for Maps {
    /// Thousands of texels say nothing in a failure's report; they follow from the rest.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Maps {{ {} + {} texels }}", self.depth.len(), self.shadow.len())
    }
}

/// Around which point and how far the sun's map reaches, in the world's own frame.
const MAP_RADIUS: f64 = 12.0;

impl World {
    /// A world of `3..=triangle_count` random triangles within 6 units of the origin, any light, any medium.
    pub fn any(triangle_count: usize) -> impl Strategy<Value = Self> {
        let point = |r: f64| [-r..r, -r..r, -r..r].prop_map(DVec3::from);
        let triangle = (point(5.0), point(2.0), point(2.0)).prop_map(|(a, u, v)| [a, a + u, a + v]);
        let light = prop_oneof![
            point(1.0).prop_map(WorldLight::Sun),
            point(5.0).prop_map(WorldLight::Point),
            (point(5.0), point(1.0), 1.0..30.0f64, 0.0..45.0f64)
                .prop_map(|(p, d, inner, more)| WorldLight::Spot(p, d, inner, inner + more)),
        ]
        .prop_filter("a direction", |light| match light {
            WorldLight::Sun(d) | WorldLight::Spot(_, d, ..) => d.length() > 0.1,
            WorldLight::Point(_) => true,
        });
        let phase = prop_oneof![
            Just(Phase::Isotropic),
            Just(Phase::Rayleigh),
            (-0.9..0.9f64).prop_map(|g| Phase::HenyeyGreenstein { g }),
        ];
        let component = ([0.001..0.3f64, 0.001..0.3, 0.001..0.3], phase)
            .prop_map(|(sigma_s, phase)| Scattering { sigma_s, phase });
        let medium =
            (prop::collection::vec(component, 1..3), [0.0..0.1f64, 0.0..0.1, 0.0..0.1], any::<bool>());
        let camera = (point(6.0), point(2.0)).prop_filter("a view", |(e, t)| {
            let d = *t - *e;
            d.length() > 0.5 && d.cross(DVec3::Y).length() > 0.1 * d.length()
        });
        (prop::collection::vec(triangle, 3..=triangle_count), camera, light, medium, 2.0..20.0f64)
            .prop_filter("the lamp is not at the eye", |(_, (eye, _), light, ..)| match light {
                WorldLight::Sun(_) => true,
                WorldLight::Point(p) | WorldLight::Spot(p, ..) => p.distance(*eye) > 0.5,
            })
            .prop_map(
                |(triangles, (eye, target), light, (mut components, mut sigma_a, grey), max_distance)| {
                    if grey {
                        // The grey inner loops are different code.
                        components.iter_mut().for_each(|c| c.sigma_s = [c.sigma_s[0]; 3]);
                        sigma_a = [sigma_a[0]; 3];
                    }
                    Self {
                        triangles,
                        eye,
                        target,
                        size: [9, 7],
                        light,
                        strength: [3.0, 2.0, 1.0],
                        components,
                        sigma_a,
                        max_distance,
                        map_side: 33,
                        motion: DAffine3::IDENTITY,
                        scale: 1.0,
                        mirror: Mirror::No,
                        maps: None,
                    }
                    .with_maps()
                },
            )
    }

    /// Casts the maps anew, after triangles or camera changed; before the world is moved.
    pub fn with_maps(mut self) -> Self {
        let caster = self.caster();
        let mut maps = Maps { depth: Vec::new(), shadow: Vec::new() };
        caster.depth_map(&self.camera(), &mut maps.depth);
        match self.light {
            WorldLight::Point(p) => caster.cube_map(p.to_array(), self.map_side, &mut maps.shadow),
            _ => caster.shadow_map(&self.projection(), &mut maps.shadow),
        }
        .expect("the world's maps can be cast");
        self.maps = Some(maps);
        self
    }

    /// The world reflected at x = 0, its depth map with it. The map of a sun or a spot is carried along by its
    /// projection; cube faces are bound to the world's axes and are left as they are.
    pub fn mirrored(mut self) -> Self {
        self.mirror = Mirror::Yes;
        if let Some(maps) = &mut self.maps {
            maps.depth.chunks_mut(self.size[0] as usize).for_each(<[f32]>::reverse);
        }
        self
    }

    /// Whether the light's map is bound to the world's axes, so that a rotation needs another one.
    pub fn has_cube_map(&self) -> bool {
        matches!(self.light, WorldLight::Point(_))
    }

    /// The same world with every texel of the light's map at `depth`.
    pub fn with_shadow(mut self, depth: f32) -> Self {
        if let Some(maps) = &mut self.maps {
            maps.shadow.fill(depth);
        }
        self
    }

    fn place(&self) -> DAffine3 {
        let reflection = if self.mirror == Mirror::Yes { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        self.motion * DAffine3::from_scale(self.scale * reflection)
    }

    fn point(&self, p: DVec3) -> [f64; 3] {
        self.place().transform_point3(p).to_array()
    }

    fn direction(&self, d: DVec3) -> [f64; 3] {
        self.place().transform_vector3(d).to_array()
    }

    fn camera(&self) -> Camera {
        Camera::perspective(
            self.point(self.eye),
            self.point(self.target),
            self.direction(DVec3::Y),
            75.0,
            self.size,
        )
        .expect("the world's camera is sane")
    }

    fn light(&self) -> Light {
        match self.light {
            WorldLight::Sun(d) => Light::directional(self.direction(d), self.strength),
            WorldLight::Point(p) => Light::point(self.point(p), self.strength, 0.0),
            WorldLight::Spot(p, d, inner, outer) => {
                Light::spot(self.point(p), self.direction(d), self.strength, inner, outer, 0.0)
            }
        }
        .expect("the world's light is sane")
    }

    fn medium(&self) -> Medium {
        Medium::new(self.components.clone(), self.sigma_a).expect("the world's medium is sane")
    }

    /// The light's projection in space: that of the world's own frame, after the inverse of its place.
    fn projection(&self) -> MapProjection {
        let (axis, centre, perspective) = match self.light {
            WorldLight::Sun(d) => (d.normalize(), -MAP_RADIUS * d.normalize(), None),
            WorldLight::Spot(p, d, _, outer) => (d.normalize(), p, Some(outer.to_radians().tan())),
            WorldLight::Point(_) => unreachable!("a point light has a cube map"),
        };
        let back = -axis;
        let right = axis.any_orthonormal_vector();
        let up = back.cross(right);
        let row = |a: DVec3, scale: f64| (a * scale).extend(-a.dot(centre) * scale);
        // Depth row and last row: linear depth for a sun; reversed z with its plane at distance 1 for a spot.
        let (third, last) = match perspective {
            Some(_) => (glam::DVec4::W, row(axis, 1.0)),
            None => (row(axis, 1.0), glam::DVec4::W),
        };
        let half = perspective.unwrap_or(MAP_RADIUS);
        let clip_from_own =
            DMat4::from_cols(row(right, 1.0 / half), row(up, 1.0 / half), third, last).transpose();
        let clip = clip_from_own * DMat4::from(self.place().inverse());
        MapProjection::from_clip_from_world(clip.to_cols_array_2d(), [self.map_side; 2])
            .expect("the world's projection is sane")
    }

    fn caster(&self) -> SceneCaster {
        let positions = self.triangles.iter().flatten().map(|&p| self.point(p).into()).collect();
        let triangles = (0..self.triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        SceneCaster::new(&Scene { positions, triangles, ..Scene::default() })
            .expect("the world has triangles")
    }

    /// Renders the world.
    pub fn render(&self, method: Method) -> ScatterImage {
        match method {
            Method::RaycastTruth => self.render_with(&mut RaycastTruth::new(&self.caster())),
            Method::ShadowMapWalk => self.render_with(&mut ShadowMapWalk::new()),
            Method::RayMarch(steps) => self.render_with(
                &mut RayMarch::new(Options { steps, ..Options::default() }).expect("sane options"),
            ),
            Method::Epipolar => self.render_with(&mut Epipolar::new(uniform_slices())),
        }
    }

    /// Renders the world with any technique.
    pub fn render_with(&self, technique: &mut dyn VolumetricShadow) -> ScatterImage {
        self.with_frame(|frame| {
            let mut image = ScatterImage::new();
            technique.supports(frame).expect("references support every frame");
            technique.render(frame, &mut image).expect("references render every frame");
            image
        })
    }

    /// Renders the world with a technique configured for it, without options; `None` if it cannot promise the target.
    pub fn render_by(&self, technique: &dyn Technique, target: Target) -> Option<ScatterImage> {
        let instance = self.with_frame(|frame| technique.configure(target, &[], &SceneFacts::of(frame)));
        Some(self.render_with(instance.ok()?.as_mut()))
    }

    fn with_frame<R>(&self, visit: impl FnOnce(&Frame<'_>) -> R) -> R {
        let maps = self.maps.as_ref().expect("a world has maps");
        let (camera, light, medium) = (self.camera(), self.light(), self.medium());
        let scaled = |texels: &[f32]| -> Vec<f32> { texels.iter().map(|&t| t * self.scale as f32).collect() };
        let (depth, shadow) = (scaled(&maps.depth), scaled(&maps.shadow));
        let shadow = match self.light {
            WorldLight::Sun(_) => {
                ShadowMap::Orthographic(ShadowLayer::new(self.projection(), &shadow).expect("checked"))
            }
            WorldLight::Spot(..) => {
                ShadowMap::Perspective(ShadowLayer::new(self.projection(), &shadow).expect("checked"))
            }
            WorldLight::Point(p) => {
                ShadowMap::Cube(CubeShadow::new(self.point(p), self.map_side, &shadow).expect("checked"))
            }
        };
        let depth = DepthMap::new(&depth, self.size).expect("checked");
        let max_distance = self.max_distance * self.scale;
        visit(&Frame::new(&camera, depth, &light, &shadow, &medium, max_distance).expect("a sane frame"))
    }

    /// The closed form of every pixel without shadows, to the end of its ray.
    pub fn unoccluded(&self) -> Vec<[f64; 3]> {
        self.closed_form(&self.light())
    }

    /// What rounding is measured by: the closed form, for a spot that of the lamp without its cone. Where a ray
    /// grazes a cone its own value can be as small as one likes, while its ends are rounded all the same.
    pub fn scale_of_rounding(&self) -> Vec<[f64; 3]> {
        self.closed_form(&match self.light() {
            Light::Spot(spot) => Light::Point(spot.lamp().clone()),
            light => light,
        })
    }

    fn closed_form(&self, light: &Light) -> Vec<[f64; 3]> {
        let maps = self.maps.as_ref().expect("a world has maps");
        let (camera, medium) = (self.camera(), self.medium());
        let [width, height] = self.size;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels
            .zip(&maps.depth)
            .map(|((x, y), &depth)| {
                let end = f64::from(depth).min(self.max_distance) * self.scale;
                let ray_light = RayLight::new(light, &medium, camera.eye(), &camera.pixel_ray(x, y));
                ray_light.interval(0.0, end).to_array()
            })
            .collect()
    }
}

fn uniform_slices() -> EpipolarOptions {
    let mut options =
        EpipolarOptions { spacing: 0.25, aim: None, rank: Some(8), ..EpipolarOptions::default() };
    options.refinement.halvings = 0;
    options
}
