//! Small random scenes of every kind of light, map, medium and camera, and a reference that samples them densely.

use std::f64::consts::PI;

use glam::DVec3;
use scatter_core::{
    Camera, CubeShadow, DepthMap, Frame, Light, LightTexture, MapProjection, Medium, Phase, Scattering,
    ShadowLayer, ShadowMap, VolumetricShadow,
};

/// SplitMix64: the same numbers on every machine.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in 0..count.
    pub fn below(&mut self, count: u32) -> u32 {
        (self.next() % u64::from(count)) as u32
    }

    pub fn direction(&mut self) -> DVec3 {
        let z: f64 = self.range(-1.0, 1.0);
        let angle = self.range(0.0, 2.0 * PI);
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }

    pub fn rgb(&mut self, low: f64, high: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.range(low, high))
    }
}

/// The kinds of shadow map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKind {
    Unshadowed,
    Orthographic,
    Cascades,
    Spot,
    SpotCube,
    Point,
}

pub const ALL_KINDS: [MapKind; 6] = [
    MapKind::Unshadowed,
    MapKind::Orthographic,
    MapKind::Cascades,
    MapKind::Spot,
    MapKind::SpotCube,
    MapKind::Point,
];

/// Everything that a frame borrows.
#[derive(Clone)]
pub struct Scene {
    pub camera: Camera,
    pub depth: Vec<f32>,
    pub light: Light,
    pub kind: MapKind,
    pub lamp: DVec3,
    pub projections: Vec<MapProjection>,
    pub texels: Vec<Vec<f32>>,
    pub medium: Medium,
    pub texture: Option<(MapProjection, Vec<[f32; 3]>)>,
    pub max_distance: f64,
}

/// What a random scene is to have.
#[derive(Debug, Clone, Copy)]
pub struct Recipe {
    pub kind: MapKind,
    /// Largest side of a map in texels.
    pub map_side: u32,
    pub size: [u32; 2],
    pub textured: bool,
    /// Where the scene lies: every position is shifted by it.
    pub centre: DVec3,
}

impl Recipe {
    pub fn of(kind: MapKind) -> Self {
        Self { kind, map_side: 13, size: [5, 3], textured: false, centre: DVec3::ZERO }
    }
}

impl Scene {
    pub fn random(seed: u64, recipe: Recipe) -> Self {
        let mut random = Random(seed);
        let r = &mut random;
        let Recipe { kind, map_side, size, textured, centre } = recipe;
        let eye = centre + r.direction() * r.range(0.5, 3.0);
        let target = centre + r.direction() * 0.4;
        let up = [0.1, 0.9, 0.3];
        let camera = if r.below(4) == 0 {
            Camera::orthographic(eye.into(), target.into(), up, r.range(0.5, 4.0), size)
        } else {
            Camera::perspective(eye.into(), target.into(), up, r.range(10.0, 110.0), size)
        }
        .unwrap();
        let pixels = size[0] * size[1];
        let depth = (0..pixels)
            .map(|_| if r.below(5) == 0 { f32::INFINITY } else { r.range(0.0, 7.0) as f32 })
            .collect();
        let forward = r.direction();
        let lamp = centre + r.direction() * r.range(0.3, 2.5);
        let strength = r.rgb(0.1, 4.0);
        let outer = r.range(5.0, 75.0);
        let inner = outer * r.range(0.0, 1.0);
        let light = match kind {
            MapKind::Unshadowed | MapKind::Orthographic | MapKind::Cascades => {
                Light::directional(forward.into(), strength)
            }
            MapKind::Spot => Light::spot(lamp.into(), forward.into(), strength, inner, outer, 0.0),
            MapKind::SpotCube => Light::spot(lamp.into(), forward.into(), strength, 40.0, 88.0, 0.0),
            MapKind::Point => Light::point(lamp.into(), strength, 0.0),
        }
        .unwrap();
        let side = |r: &mut Random| 1 + r.below(map_side);
        let map_up = [0.3, 0.1, 0.9];
        let sun_map = |r: &mut Random, half: f64| {
            let size = [side(r), side(r)];
            let origin = centre + r.direction() * 0.3 - forward * 4.0;
            let extent = [half * r.range(0.6, 1.0), half * r.range(0.6, 1.0)];
            MapProjection::orthographic(origin.into(), forward.into(), map_up, extent, size).unwrap()
        };
        let projections = match kind {
            MapKind::Unshadowed => vec![],
            MapKind::Orthographic => vec![sun_map(r, 3.0)],
            MapKind::Cascades => (1..=3).map(|n| sun_map(r, f64::from(n))).collect(),
            MapKind::Spot => {
                let tan = outer.to_radians().tan() * r.range(0.7, 1.0);
                let side = side(r);
                vec![MapProjection::perspective(lamp.into(), forward.into(), map_up, tan, side).unwrap()]
            }
            MapKind::SpotCube | MapKind::Point => {
                let side = side(r);
                (0..6).map(|face| MapProjection::cube_face(lamp.into(), face, side).unwrap()).collect()
            }
        };
        let far = if matches!(kind, MapKind::Orthographic | MapKind::Cascades) { 8.0 } else { 4.0 };
        let texels = projections
            .iter()
            .map(|p| {
                let [width, height] = p.size();
                let draw = |_| if r.below(4) == 0 { f32::INFINITY } else { r.range(0.05, far) as f32 };
                (0..width * height).map(draw).collect()
            })
            .collect();
        let texture = textured.then(|| {
            let side = side(r);
            let projection = if light.position().is_none() {
                sun_map(r, 1.5)
            } else {
                MapProjection::perspective(lamp.into(), forward.into(), map_up, 0.8, side).unwrap()
            };
            let [width, height] = projection.size();
            let glass = (0..width * height).map(|_| r.rgb(0.0, 2.0).map(|c| c as f32)).collect();
            (projection, glass)
        });
        Self {
            camera,
            depth,
            light,
            kind,
            lamp,
            projections,
            texels,
            medium: random_medium(r),
            texture,
            max_distance: r.range(3.0, 6.0),
        }
    }

    /// Builds the frame and hands it over.
    pub fn with<R>(&self, use_frame: impl FnOnce(&Frame<'_>) -> R) -> R {
        let layer = |index: usize| ShadowLayer::new(self.projections[index], &self.texels[index]).unwrap();
        let layers: Vec<_> = (0..self.projections.len()).map(layer).collect();
        let cube_texels = self.texels.concat();
        let shadow = match self.kind {
            MapKind::Unshadowed => ShadowMap::Unshadowed,
            MapKind::Orthographic => ShadowMap::Orthographic(layer(0)),
            MapKind::Cascades => ShadowMap::Cascades(&layers),
            MapKind::Spot => ShadowMap::Perspective(layer(0)),
            MapKind::SpotCube | MapKind::Point => {
                let side = self.projections[0].size()[0];
                ShadowMap::Cube(CubeShadow::new(self.lamp.into(), side, &cube_texels).unwrap())
            }
        };
        let depth = DepthMap::new(&self.depth, self.camera.size()).unwrap();
        let frame =
            Frame::new(&self.camera, depth, &self.light, &shadow, &self.medium, self.max_distance).unwrap();
        let texture = self.texture.as_ref().map(|(p, texels)| LightTexture::new(*p, texels).unwrap());
        match &texture {
            Some(texture) => use_frame(&frame.with_texture(texture).unwrap()),
            None => use_frame(&frame),
        }
    }

    pub fn render(&self, technique: &mut dyn VolumetricShadow) -> scatter_core::ScatterImage {
        self.with(|frame| {
            let mut image = scatter_core::ScatterImage::new();
            technique.render(frame, &mut image).unwrap();
            image
        })
    }
}

fn random_medium(r: &mut Random) -> Medium {
    let phase = |r: &mut Random| match r.below(3) {
        0 => Phase::Isotropic,
        1 => Phase::Rayleigh,
        _ => Phase::HenyeyGreenstein { g: r.range(-0.9, 0.9) },
    };
    let thickness = r.range(-3.0, 0.3);
    let scale = 10f64.powf(thickness);
    let mut components: Vec<_> =
        (0..1 + r.below(2)).map(|_| Scattering { sigma_s: r.rgb(0.0, scale), phase: phase(r) }).collect();
    if r.below(2) == 0 {
        for component in &mut components {
            component.sigma_s = [component.sigma_s[0]; 3];
        }
        return Medium::new(components, [0.1 * scale; 3]).unwrap();
    }
    Medium::new(components, r.rgb(0.0, scale)).unwrap()
}

/// What dense sampling finds for one pixel.
pub struct Sampled {
    pub radiance: DVec3,
    /// How far it may be off: every change of visibility or colour lies somewhere within one sample.
    pub uncertainty: f64,
}

/// `∫ f·V dt` of pixel `(x, y)` by the midpoint rule with `count` samples: the integrand as MODEL.md writes it,
/// visibility and colour by look-ups at points. For a lamp, samples are spread evenly over the angle at the lamp.
pub fn dense(frame: &Frame<'_>, x: u32, y: u32, count: u32) -> Sampled {
    let end = frame.ray_end(x, y);
    let eye = frame.camera().eye();
    let ray = frame.camera().pixel_ray(x, y);
    let medium = frame.medium();
    let sigma_t = DVec3::from(medium.sigma_t());
    let lamp = frame.light().position().map(|p| p - eye - ray.origin);
    let closest = lamp.map(|p| p.dot(ray.direction)).unwrap_or(0.0);
    let h = lamp.map(|p| p.cross(ray.direction).length()).unwrap_or(1.0);
    let angles = lamp.map(|_| ((-closest / h).atan(), ((end - closest) / h).atan()));
    let strength = DVec3::from(frame.light().strength());
    let (mut radiance, mut uncertainty, mut in_cone) = (DVec3::ZERO, 0.0, 0u32);
    let mut last = None;
    for i in 0..count {
        let share = (f64::from(i) + 0.5) / f64::from(count);
        let (t, dt) = match angles {
            None => (share * end, end / f64::from(count)),
            Some((from, to)) => {
                let angle = from + share * (to - from);
                (closest + h * angle.tan(), h / angle.cos().powi(2) * (to - from) / f64::from(count))
            }
        };
        let p = ray.origin + ray.direction * t;
        let (travel, cone, attenuation) = match (frame.light(), lamp) {
            (Light::Directional(sun), _) => (sun.direction(), 1.0, (-sigma_t * t).exp()),
            (light, Some(lamp)) => {
                let way = ray.direction * t - lamp;
                let d = way.length();
                let cone = if let Light::Spot(spot) = light {
                    spot.cone(spot.direction().dot(way / d))
                } else {
                    1.0
                };
                (way / d, cone, (-sigma_t * (t + d)).exp() * cone / (d * d))
            }
            _ => unreachable!("a lamp has a position"),
        };
        let cos_theta = travel.dot(-ray.direction);
        let scattering: DVec3 =
            medium.components().iter().map(|c| DVec3::from(c.sigma_s) * c.phase.at(cos_theta)).sum();
        let value = strength * scattering * attenuation * dt;
        let lit = frame.shadow().is_lit(p + eye);
        let colour = frame.texture().map_or([1.0f32; 3], |texture| texture.lookup(p + eye));
        // The cone's border and its bend at the inner angle are edges too.
        let now = (lit, colour, cone > 0.0, cone < 1.0);
        if last.is_some_and(|before| before != now) {
            uncertainty += 2.0 * value.max_element();
        }
        last = Some(now);
        in_cone += u32::from(cone > 0.0);
        if lit {
            radiance += value * DVec3::from(colour.map(f64::from));
        }
    }
    // A ray that grazes the cone has few samples in it: the midpoint rule's 1/n², of a parabola.
    uncertainty += radiance.max_element() / f64::from(in_cone.max(1)).powi(2);
    Sampled { radiance, uncertainty }
}
