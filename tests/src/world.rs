//! A random world: triangles, a camera, a light with its maps and its glass, and a medium, all of which can be moved
//! together.
//!
//! The maps are cast once, in the world's own frame; a moved world carries the same texels along. So a property such
//! as "a rigid motion leaves the image unchanged" tests the technique, not the ray caster's luck at an edge.

use glam::{DAffine3, DMat4, DVec3, DVec4};
use proptest::prelude::*;
use scatter_core::{Camera, HeightFalloff, Light, MapProjection, Medium, Phase, RayLight, Scattering};
use scatter_scene::{Scene, SceneCaster};
use scatter_testing::{MapKind, OwnedFrame};

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
    /// How its density falls with height: up, base height, scale height.
    pub fog: Option<(DVec3, f64, f64)>,
    /// Where rays end.
    pub max_distance: f64,
    /// Whether a sun's map is three cascades, one around the other.
    pub cascades: bool,
    /// Coloured glass before the light, `[row][column]` of [`GLASS_SIDE`]² panes that let at most all light through.
    pub glass: Option<Vec<[f32; 3]>>,
    /// Texels along an edge of each of the light's maps.
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
    shadow: Vec<Vec<f32>>,
}

impl std::fmt::Debug for Maps {
    /// Thousands of texels say nothing in a failure's report; they follow from the rest.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let texels = self.shadow.iter().map(Vec::len).sum::<usize>();
        write!(f, "Maps {{ {} + {texels} texels }}", self.depth.len())
    }
}

/// How far the sun's map reaches around the origin, in the world's own frame; that of the largest cascade.
const MAP_RADIUS: f64 = 12.0;
/// How far the smaller cascades reach. Triangles lie within 9 units of the origin.
const CASCADES: [f64; 2] = [3.0, 6.0];
/// Panes along a side of the glass.
pub const GLASS_SIDE: u32 = 5;
/// How far the glass before a sun reaches, and the tangent of the half angle of that before a point light. What lies
/// beside it gets all light.
const GLASS_RADIUS: f64 = 5.0;
const GLASS_TANGENT: f64 = 0.8;

impl World {
    /// A world of `3..=triangle_count` random triangles within 9 units of the origin, any light, any medium; half of the
    /// suns have cascades, a third of the lights glass, a third of the media is height fog.
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
        let pane = [0.0..=1.0f32, 0.0..=1.0, 0.0..=1.0];
        let glass = prop::option::weighted(
            1.0 / 3.0,
            prop::collection::vec(pane, (GLASS_SIDE * GLASS_SIDE) as usize),
        );
        let triangles = prop::collection::vec(triangle, 3..=triangle_count);
        let up = point(1.0).prop_filter("a direction", |up| up.length() > 0.1);
        let fog = prop::option::weighted(1.0 / 3.0, (up, -3.0..3.0f64, 2.0..40.0f64));
        (triangles, camera, light, (medium, fog), 2.0..20.0f64, any::<bool>(), glass)
            .prop_filter("the lamp is not at the eye", |(_, (eye, _), light, ..)| match light {
                WorldLight::Sun(_) => true,
                WorldLight::Point(p) | WorldLight::Spot(p, ..) => p.distance(*eye) > 0.5,
            })
            .prop_map(|(triangles, (eye, target), light, medium, max_distance, cascades, glass)| {
                let ((mut components, mut sigma_a, grey), fog) = medium;
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
                    fog,
                    max_distance,
                    cascades,
                    glass,
                    map_side: 33,
                    motion: DAffine3::IDENTITY,
                    scale: 1.0,
                    mirror: Mirror::No,
                    maps: None,
                }
                .with_maps()
            })
    }

    /// Casts the maps anew, after triangles or camera changed; before the world is moved.
    pub fn with_maps(mut self) -> Self {
        let caster = self.caster();
        let mut depth = Vec::new();
        caster.depth_map(&self.camera(), &mut depth);
        let texels = |cast: &dyn Fn(&mut Vec<f32>)| {
            let mut texels = Vec::new();
            cast(&mut texels);
            texels
        };
        let shadow = match self.light {
            WorldLight::Point(p) => vec![texels(&|out| {
                caster.cube_map(p.to_array(), self.map_side, out).expect("the lamp's faces can be cast");
            })],
            _ => (self.projections().iter())
                .map(|projection| {
                    texels(&|out| caster.shadow_map(projection, out).expect("the light's map can be cast"))
                })
                .collect(),
        };
        self.maps = Some(Maps { depth, shadow });
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

    /// The same world with every texel of the light's maps at `depth`.
    pub fn with_shadow(mut self, depth: f32) -> Self {
        if let Some(maps) = &mut self.maps {
            maps.shadow.iter_mut().for_each(|texels| texels.fill(depth));
        }
        self
    }

    /// The same world without glass.
    pub fn without_glass(self) -> Self {
        Self { glass: None, ..self }
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
        let medium = Medium::new(self.components.clone(), self.sigma_a).expect("the world's medium is sane");
        let Some((up, base, scale)) = self.fog else { return medium };
        let up = up.normalize();
        let moved = DVec3::from(self.direction(up)).normalize();
        let base = moved.dot(self.point(base * up).into());
        let falloff = HeightFalloff::new(moved.to_array(), base, scale * self.scale);
        medium.with_height_falloff(falloff.expect("the world's fog is sane"))
    }

    /// The projections of a sun's maps or of a spot's.
    fn projections(&self) -> Vec<MapProjection> {
        let sun = |d: DVec3, half: f64| self.parallel(d, half, self.map_side);
        match self.light {
            WorldLight::Sun(d) if self.cascades => {
                CASCADES.into_iter().chain([MAP_RADIUS]).map(|half| sun(d, half)).collect()
            }
            WorldLight::Sun(d) => vec![sun(d, MAP_RADIUS)],
            WorldLight::Spot(p, d, _, outer) => {
                vec![self.fan(p, d, outer.to_radians().tan(), self.map_side)]
            }
            WorldLight::Point(_) => vec![],
        }
    }

    /// The projection of the glass.
    fn glass_projection(&self) -> MapProjection {
        match self.light {
            WorldLight::Sun(d) => self.parallel(d, GLASS_RADIUS, GLASS_SIDE),
            WorldLight::Spot(p, d, _, outer) => self.fan(p, d, outer.to_radians().tan(), GLASS_SIDE),
            WorldLight::Point(p) => self.fan(p, DVec3::NEG_Y, GLASS_TANGENT, GLASS_SIDE),
        }
    }

    /// A parallel projection along `d` through the origin, in space.
    fn parallel(&self, d: DVec3, half: f64, side: u32) -> MapProjection {
        let axis = d.normalize();
        // Linear depth, and w = 1.
        self.in_space(axis, -MAP_RADIUS * axis, half, side, |depth| [depth, DVec4::W])
    }

    /// A perspective projection from `p` along `d`, in space.
    fn fan(&self, p: DVec3, d: DVec3, tangent: f64, side: u32) -> MapProjection {
        // Reversed z with its plane at distance 1.
        self.in_space(d.normalize(), p, tangent, side, |depth| [DVec4::W, depth])
    }

    /// The projection of the world's own frame, after the inverse of its place. `last_rows` makes the third and the
    /// fourth row of the linear depth's.
    fn in_space(
        &self,
        axis: DVec3,
        centre: DVec3,
        half: f64,
        side: u32,
        last_rows: impl FnOnce(DVec4) -> [DVec4; 2],
    ) -> MapProjection {
        let right = axis.any_orthonormal_vector();
        let up = (-axis).cross(right);
        let row = |a: DVec3, scale: f64| (a * scale).extend(-a.dot(centre) * scale);
        let [third, last] = last_rows(row(axis, 1.0));
        let clip_from_own =
            DMat4::from_cols(row(right, 1.0 / half), row(up, 1.0 / half), third, last).transpose();
        let clip = clip_from_own * DMat4::from(self.place().inverse());
        MapProjection::from_clip_from_world(clip.to_cols_array_2d(), [side; 2])
            .expect("the world's projection is sane")
    }

    /// What casts rays against the triangles in space.
    pub fn caster(&self) -> SceneCaster {
        let positions = self.triangles.iter().flatten().map(|&p| self.point(p).into()).collect();
        let triangles = (0..self.triangles.len() as u32).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        SceneCaster::new(&Scene { positions, triangles, ..Scene::default() })
            .expect("the world has triangles")
    }

    /// Everything that the world's frame borrows.
    pub fn frame(&self) -> OwnedFrame {
        let maps = self.maps.as_ref().expect("a world has maps");
        let scaled = |texels: &Vec<f32>| texels.iter().map(|&t| t * self.scale as f32).collect();
        let mut texels: Vec<Vec<f32>> = maps.shadow.iter().map(scaled).collect();
        let (kind, projections) = match self.light {
            WorldLight::Sun(_) if self.cascades => (MapKind::Cascades, self.projections()),
            WorldLight::Sun(_) => (MapKind::Orthographic, self.projections()),
            WorldLight::Spot(..) => (MapKind::Spot, self.projections()),
            WorldLight::Point(p) => {
                let face = |face| MapProjection::cube_face(self.point(p), face, self.map_side);
                let faces = (0..6).map(|index| face(index).expect("a cube's face is sane")).collect();
                texels = texels[0].chunks(texels[0].len() / 6).map(<[f32]>::to_vec).collect();
                (MapKind::Point, faces)
            }
        };
        OwnedFrame {
            camera: self.camera(),
            depth: scaled(&maps.depth),
            light: self.light(),
            kind,
            projections,
            texels,
            medium: self.medium(),
            texture: self.glass.clone().map(|panes| (self.glass_projection(), panes)),
            max_distance: self.max_distance * self.scale,
        }
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
