//! How one frame is marched: what its scene requires, and the inner loop that does no more than that.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use fearless_simd::prelude::*;
use glam::DVec3;
use scatter_core::{FogRay, Frame, LampRay, Light, MAX_CASCADES, RayLight, SceneFacts, ShadowMap, ViewRay};

use super::NEGLIGIBLE_OPTICAL_DEPTH;
use super::angle_span::AngleSpan;
use super::cascade_maps::{CascadeMaps, Stretches};
use super::fog_lamp_lanes::FogLampLanes;
use super::fog_sun_packet::FogSunMarch;
use super::fog_window::fog_window;
use super::lamp_packet::{ConeLanes, LampMarch, PhaseTerm, march_lamp};
use super::lanes::{LANES, mixed};
use super::lookups::{
    Clear, CubeMap, FaceMaps, Grid, MapLanes, ParallelMap, PerspectiveMap, TextureLookup, Visibility,
};
use super::options::{Distribution, Options};
use super::packet::{Foot, Packet, Span, cube_lanes, lamp_lanes};
use super::sun_packet::{SunMarch, SunSteps};
use super::sun_paths::{StepReach, SunPaths};

/// A frame and what its scene requires.
pub struct Plan<'a> {
    frame: &'a Frame<'a>,
    steps: u32,
    jitter: Option<u32>,
    uniform: bool,
    casts_shadow: bool,
    /// One march serves three channels.
    one_channel: bool,
    grey: bool,
    /// The weakest extinction of a channel that scatters; 0 if one is not extinguished.
    weakest: f64,
    /// Phase functions of a lamp's march; empty if none depends on the angle.
    terms: &'a [PhaseTerm],
    /// What the terms leave out, per channel: σs of a single component, Σσs/4π of isotropic ones.
    scattering: DVec3,
}

impl<'a> Plan<'a> {
    /// `terms` is a buffer to be reused.
    pub fn new(
        frame: &'a Frame<'a>,
        options: &Options,
        facts: &SceneFacts,
        terms: &'a mut Vec<PhaseTerm>,
    ) -> Self {
        let medium = frame.medium();
        let lamp = frame.light().position().is_some();
        let components = medium.components();
        let grey_scattering =
            components.iter().all(|c| c.sigma_s[0] == c.sigma_s[1] && c.sigma_s[1] == c.sigma_s[2]);
        let separable = !lamp || !facts.anisotropic || components.len() == 1 || grey_scattering;
        let one_channel = facts.grey_extinction && separable && frame.texture().is_none();
        terms.clear();
        let mut scattering: DVec3 =
            components.iter().map(|c| DVec3::from(c.sigma_s)).sum::<DVec3>() * scatter_core::INV_4PI;
        if lamp && facts.anisotropic {
            if components.len() == 1 {
                scattering = components[0].sigma_s.into();
                terms.push(PhaseTerm { weight: [1.0; 3], phase: components[0].phase });
            } else {
                scattering = DVec3::ONE;
                terms.extend(components.iter().map(|component| PhaseTerm {
                    weight: component.sigma_s.map(|s| s as f32),
                    phase: component.phase,
                }));
            }
        }
        let scatters = |channel: usize| components.iter().any(|c| c.sigma_s[channel] > 0.0);
        let weakest = (0..3)
            .filter(|&channel| scatters(channel))
            .map(|channel| medium.sigma_t()[channel])
            .fold(f64::INFINITY, f64::min);
        Self {
            frame,
            steps: options.steps,
            jitter: options.jitter,
            uniform: options.distribution == Distribution::Uniform,
            casts_shadow: facts.casts_shadow,
            one_channel,
            grey: facts.grey_extinction,
            weakest,
            terms,
            scattering,
        }
    }

    /// Whether there is anything to march through: without shadow and texture the closed form is all.
    pub fn marches(&self) -> bool {
        self.casts_shadow || self.frame.texture().is_some()
    }

    /// Renders the packet at pixel `first` into rows that begin there; `layer_lanes` is a buffer for as many maps as
    /// there are cascades or faces.
    #[inline(always)]
    pub fn march<S: Simd>(
        &self,
        simd: S,
        first: [u32; 2],
        (inscattered, transmittance): (&mut [[f32; 3]], &mut [[f32; 3]]),
        layer_lanes: &mut [MapLanes],
    ) {
        let packet = Packet::new(self.frame, first[0], first[1]);
        let radiance = if !self.marches() {
            self.clear(&packet)
        } else if matches!(self.frame.light(), Light::Directional(_)) {
            self.sun(simd, &packet, layer_lanes)
        } else {
            self.lamp(simd, &packet, layer_lanes)
        };
        let width = self.frame.size()[0] as usize;
        for lane in packet.own_lanes() {
            let (x, y) = packet.pixels[lane];
            let index = (y - first[1]) as usize * width + (x - first[0]) as usize;
            inscattered[index] = radiance[lane].as_vec3().to_array();
            transmittance[index] = self.transmittance(&packet.rays[lane], packet.ends[lane]);
        }
    }

    fn transmittance(&self, ray: &ViewRay, end: f64) -> [f32; 3] {
        let medium = self.frame.medium();
        let sigma_t = medium.sigma_t();
        if let Some(fog) = medium.fog_ray(self.frame.camera().eye(), ray) {
            let column = fog.optical_depth(1.0, end);
            let through = |sigma: f64| if sigma == 0.0 { 1.0 } else { (-sigma * column).exp() as f32 };
            return if self.grey { [through(sigma_t[0]); 3] } else { sigma_t.map(through) };
        }
        if self.grey {
            let value = if sigma_t[0] == 0.0 { 1.0 } else { (-sigma_t[0] * end).exp() };
            return [value as f32; 3];
        }
        medium.transmittance(end).map(|t| t as f32)
    }

    fn ray_light(&self, packet: &Packet, lane: usize) -> RayLight<'_> {
        let frame = self.frame;
        RayLight::new(frame.light(), frame.medium(), frame.camera().eye(), &packet.rays[lane])
    }

    fn clear(&self, packet: &Packet) -> [DVec3; LANES] {
        std::array::from_fn(|lane| self.ray_light(packet, lane).interval(0.0, packet.ends[lane]))
    }

    fn seeds(&self, packet: &Packet) -> Option<[u32; LANES]> {
        let width = self.frame.size()[0];
        self.jitter.map(|seed| packet.pixels.map(|(x, y)| mixed(y.wrapping_mul(width).wrapping_add(x), seed)))
    }

    /// The unoccluded closed form times the share that the march finds lit.
    #[inline(always)]
    fn sun<S: Simd>(&self, simd: S, packet: &Packet, layer_lanes: &mut [MapLanes]) -> [DVec3; LANES] {
        let shares = if self.frame.medium().height_falloff().is_some() {
            self.fog_shares(simd, packet, layer_lanes)
        } else {
            self.uniform_shares(simd, packet, layer_lanes)
        };
        std::array::from_fn(|lane| {
            let whole = self.ray_light(packet, lane).interval(0.0, packet.ends[lane]);
            whole * DVec3::from(shares.map(|channel| f64::from(channel[lane])))
        })
    }

    #[inline(always)]
    fn uniform_shares<S: Simd>(
        &self,
        simd: S,
        packet: &Packet,
        layer_lanes: &mut [MapLanes],
    ) -> [[f32; LANES]; 3] {
        let frame = self.frame;
        let eye = frame.camera().eye();
        let reach = if self.weakest > 0.0 { NEGLIGIBLE_OPTICAL_DEPTH / self.weakest } else { f64::INFINITY };
        // A medium that scatters nothing has no reach; any finite one will do.
        let spans = packet.ends.map(|end| Span { start: 0.0, end: end.min(reach).min(f64::MAX) });
        let sigma_t = frame.medium().sigma_t();
        let texture_lanes = frame.texture().map(|texture| {
            SunPaths::new(texture.projection(), eye, &packet.rays, &spans, self.steps).lanes()
        });
        let march = SunMarch {
            steps: self.steps,
            step_depth: sigma_t.map(|sigma| {
                spans.map(|span| if sigma > 0.0 { sigma * (span.end / f64::from(self.steps)) } else { 0.0 })
            }),
            texture: self.texture(texture_lanes.as_ref()),
            seeds: self.seeds(packet),
        };
        self.sun_shares(simd, &march, (&packet.rays, &spans), layer_lanes)
    }

    /// In height fog only the part of a ray is marched that has light: what is counted from its start.
    #[inline(always)]
    fn fog_shares<S: Simd>(
        &self,
        simd: S,
        packet: &Packet,
        layer_lanes: &mut [MapLanes],
    ) -> [[f32; LANES]; 3] {
        let frame = self.frame;
        let (medium, eye) = (frame.medium(), frame.camera().eye());
        let fogs = packet.rays.each_ref().map(|ray| medium.fog_ray(eye, ray).unwrap_or(FogRay::UNIFORM));
        let windows: [Span; LANES] =
            std::array::from_fn(|lane| fog_window(&fogs[lane], packet.ends[lane], self.weakest));
        let rays: [ViewRay; LANES] = std::array::from_fn(|lane| {
            let ray = packet.rays[lane];
            ViewRay { origin: ray.origin + ray.direction * windows[lane].start, ..ray }
        });
        let spans = windows.map(|window| Span { start: 0.0, end: window.end - window.start });
        let texture_lanes = frame
            .texture()
            .map(|texture| SunPaths::new(texture.projection(), eye, &rays, &spans, self.steps).lanes());
        let march = FogSunMarch {
            texture: self.texture(texture_lanes.as_ref()),
            ..FogSunMarch::new(self.steps, medium.sigma_t(), (&fogs, &windows), self.seeds(packet))
        };
        self.sun_shares(simd, &march, (&rays, &spans), layer_lanes)
    }

    #[inline(always)]
    fn sun_shares<S: Simd>(
        &self,
        simd: S,
        march: &impl SunSteps<S>,
        (rays, spans): (&[ViewRay; LANES], &[Span; LANES]),
        layer_lanes: &mut [MapLanes],
    ) -> [[f32; LANES]; 3] {
        let eye = self.frame.camera().eye();
        match self.frame.shadow() {
            ShadowMap::Orthographic(layer) if self.casts_shadow => {
                let grid = Grid::new(layer.texels(), layer.projection().size());
                let paths = SunPaths::new(layer.projection(), eye, rays, spans, self.steps);
                let lanes = paths.lanes();
                if paths.all_inside {
                    self.sun_channels(simd, march, ParallelMap::<true> { grid, lanes: &lanes })
                } else {
                    self.sun_channels(simd, march, ParallelMap::<false> { grid, lanes: &lanes })
                }
            }
            ShadowMap::Cascades(layers) if self.casts_shadow => {
                let mut reaches = [StepReach::default(); MAX_CASCADES];
                for ((lanes, reach), layer) in layer_lanes.iter_mut().zip(&mut reaches).zip(*layers) {
                    let paths = SunPaths::new(layer.projection(), eye, rays, spans, self.steps);
                    *reach = paths.reach(self.jitter.is_some());
                    if reach.any[0] < reach.any[1] {
                        *lanes = paths.lanes();
                    }
                }
                let stretches = Stretches::new(&reaches[..layers.len()], self.steps);
                self.sun_channels(simd, march, CascadeMaps::new(layers, layer_lanes, &stretches))
            }
            // Without a shadow there is a texture: three channels.
            _ => simd.vectorize(
                #[inline(always)]
                || march.shares::<Clear, 3, false>(simd, Clear),
            ),
        }
    }

    #[inline(always)]
    fn sun_channels<S: Simd, V: Visibility<S>>(
        &self,
        simd: S,
        march: &impl SunSteps<S>,
        visibility: V,
    ) -> [[f32; LANES]; 3] {
        simd.vectorize(
            #[inline(always)]
            || match (self.one_channel, march.is_plain()) {
                (true, true) => march.shares::<V, 1, true>(simd, visibility),
                (false, true) => march.shares::<V, 3, true>(simd, visibility),
                // Two channels more cost little beside a hash or three more texels.
                (_, false) => march.shares::<V, 3, false>(simd, visibility),
            },
        )
    }

    fn texture<'b>(&self, lanes: Option<&'b MapLanes>) -> Option<TextureLookup<'b>>
    where
        'a: 'b,
    {
        let (texture, lanes) = (self.frame.texture()?, lanes?);
        let projection = texture.projection();
        let grid = Grid::new(texture.texels(), projection.size());
        Some(TextureLookup { grid, perspective: projection.is_perspective(), lanes })
    }

    #[inline(always)]
    fn lamp<S: Simd>(&self, simd: S, packet: &Packet, layer_lanes: &mut [MapLanes]) -> [DVec3; LANES] {
        let frame = self.frame;
        let eye = frame.camera().eye();
        let (lamp, spot) = match frame.light() {
            Light::Point(lamp) => (lamp, None),
            Light::Spot(spot) => (spot.lamp(), Some(spot)),
            Light::Directional(_) => return [DVec3::ZERO; LANES],
        };
        let position = lamp.position() - eye;
        let sigma_t = frame.medium().sigma_t();
        let mut march = LampMarch {
            steps: self.steps,
            uniform: self.uniform,
            first: [0.0; LANES],
            step: [0.0; LANES],
            from_end: [0.0; LANES],
            depth_to_foot: [[0.0; LANES]; 3],
            depth_of_distance: [[0.0; LANES]; 3],
            extinction: sigma_t != [0.0; 3],
            fog: frame
                .medium()
                .height_falloff()
                .map(|falloff| FogLampLanes::new(falloff.log_density(eye, position), sigma_t)),
            terms: self.terms,
            cone: spot.map(|spot| ConeLanes {
                along: [0.0; LANES],
                across: [0.0; LANES],
                cos_outer: spot.cos_outer() as f32,
                slope: spot.cone_slope() as f32,
            }),
            texture: None,
            seeds: self.seeds(packet),
        };
        let (mut feet, mut spans) = ([Foot::default(); LANES], [Span::default(); LANES]);
        let steps = f64::from(self.steps);
        for lane in 0..LANES {
            let ray = &packet.rays[lane];
            let lamp_ray = LampRay::new(ray.origin, ray.direction, position, lamp.radius());
            let (closest, h) = (lamp_ray.closest, lamp_ray.distance);
            feet[lane] = Foot { closest, distance: h };
            let mut part = match (&mut march.fog, frame.medium().fog_ray(eye, ray)) {
                (Some(lanes), Some(fog)) => {
                    lanes.set(lane, &fog, &lamp_ray);
                    let reach = fog.reach(self.weakest, NEGLIGIBLE_OPTICAL_DEPTH);
                    AngleSpan::of(lamp_ray, packet.ends[lane].min(reach), 0.0)
                }
                _ => AngleSpan::of(lamp_ray, packet.ends[lane], self.weakest),
            };
            if let (Some(spot), Some(cone)) = (spot, &mut march.cone) {
                let foot = ray.origin + ray.direction * closest - position;
                let (along, across) = (spot.direction().dot(ray.direction), spot.direction().dot(foot) / h);
                (cone.along[lane], cone.across[lane]) = (along as f32, across as f32);
                part = part.within_cone(along, across, spot.cos_outer());
            }
            spans[lane] = part.on_ray(lamp_ray, packet.ends[lane]);
            if self.uniform {
                let span = spans[lane];
                march.first[lane] = ((span.start - closest) / h) as f32;
                march.step[lane] = ((span.end - span.start).max(0.0) / steps / h) as f32;
            } else {
                let step = (part.to - part.from).max(0.0) / steps;
                // Wholly behind the foot: the complement of ξ keeps the digits.
                let from_end = part.from > FRAC_PI_4;
                march.from_end[lane] = f32::from(u8::from(from_end));
                march.first[lane] = if from_end { FRAC_PI_2 - part.from } else { part.from } as f32;
                march.step[lane] = if from_end { -step } else { step } as f32;
            }
            for (channel, sigma) in sigma_t.into_iter().enumerate() {
                march.depth_to_foot[channel][lane] = (sigma * closest) as f32;
                march.depth_of_distance[channel][lane] = (sigma * h) as f32;
            }
        }
        let texture_lanes = frame
            .texture()
            .map(|texture| lamp_lanes(texture.projection(), eye, &packet.rays, &feet, &spans).0);
        march.texture = self.texture(texture_lanes.as_ref());
        let sums = match frame.shadow() {
            ShadowMap::Perspective(layer) if self.casts_shadow => {
                let grid = Grid::new(layer.texels(), layer.projection().size());
                let (lanes, inside) = lamp_lanes(layer.projection(), eye, &packet.rays, &feet, &spans);
                if inside {
                    self.lamp_channels(simd, &march, PerspectiveMap::<true> { grid, lanes: &lanes })
                } else {
                    self.lamp_channels(simd, &march, PerspectiveMap::<false> { grid, lanes: &lanes })
                }
            }
            ShadowMap::Cube(cube) if self.casts_shadow => {
                let grid = Grid::new(cube.texels(), [cube.size(); 2]);
                let lanes = cube_lanes(cube.position(), eye, &packet.rays, &feet);
                self.lamp_channels(simd, &march, CubeMap { grid, lanes: &lanes })
            }
            ShadowMap::Faces(faces) if self.casts_shadow => {
                for (lanes, face) in layer_lanes.iter_mut().zip(*faces) {
                    *lanes = lamp_lanes(face.projection(), eye, &packet.rays, &feet, &spans).0;
                }
                self.lamp_channels(simd, &march, FaceMaps { faces, lanes: layer_lanes })
            }
            // Without a shadow there is a texture: three channels.
            _ => simd.vectorize(
                #[inline(always)]
                || {
                    if march.fog.is_some() {
                        march_lamp::<S, Clear, 3, true>(simd, &march, Clear)
                    } else {
                        march_lamp::<S, Clear, 3, false>(simd, &march, Clear)
                    }
                },
            ),
        };
        let strength = DVec3::from(lamp.intensity()) * self.scattering;
        std::array::from_fn(|lane| {
            let sum = DVec3::from(sums.map(|channel| f64::from(channel[lane])));
            // dt/d² = dφ/h = 2·dξ/h.
            strength * sum * (2.0 / feet[lane].distance)
        })
    }

    #[inline(always)]
    fn lamp_channels<S: Simd, V: Visibility<S>>(
        &self,
        simd: S,
        march: &LampMarch<'_>,
        visibility: V,
    ) -> [[f32; LANES]; 3] {
        simd.vectorize(
            #[inline(always)]
            || {
                match (self.one_channel, march.fog.is_some()) {
                    (true, false) => march_lamp::<S, V, 1, false>(simd, march, visibility),
                    (false, false) => march_lamp::<S, V, 3, false>(simd, march, visibility),
                    // Two channels more are two of five exponentials.
                    (_, true) => march_lamp::<S, V, 3, true>(simd, march, visibility),
                }
            },
        )
    }
}
