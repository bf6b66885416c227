//! The exact image of a [`Scenario`] by brute force: every texel of every map is a convex cell of space, and the ray is
//! clipped against each of them.
//!
//! A texel shadows the points whose texel coordinates lie in it and whose depth is beyond the stored one. For a
//! parallel map these are bounds on linear functions of the ray parameter; for a perspective one they become linear
//! when multiplied by the depth. No walk, no step, no order, nothing of the model's look-ups: what is left of the ray
//! is integrated by [`closed_form`](crate::closed_form). O(texels) a ray, f64: for small maps. The reference that
//! judges everybody is judged by this.

mod pieces;

use glam::DVec3;
use rayon::prelude::*;
use scatter_core::{HeightFalloff, Light, Phase};

use crate::closed_form::{
    Channel, Cone, Fading, Fog, Lamp, PhaseFunction, fog_lamp_radiance, fog_sun_radiance, lamp_radiance,
    sun_radiance,
};
use crate::scenario::{MapFrame, MapLayer, PixelRay, Scenario, Shadow};
use pieces::{Piece, Span, parts};

/// What an image should be, and what its errors are measured by.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// In-scattered radiance, `[y][x]`.
    pub radiance: Vec<[f64; 3]>,
    /// The unoccluded value of each pixel: what `Options::for_error` promises a share of. In a spot's light at least
    /// a hundredth of the lamp's without its cone: where a ray grazes the cone the value itself is as small as one
    /// likes.
    pub scale: Vec<[f64; 3]>,
    /// Transmittance to the end of the ray.
    pub transmittance: Vec<[f64; 3]>,
}

/// Share of the lamp's value without its cone below which a spot's errors are not measured by its own value: the
/// same hundredth as in MODEL.md's figures.
const LEAST_SCALE: f64 = 0.01;

impl Expected {
    /// Whether every pixel has all of its light, or none has any. Of a single pixel nobody knows what is around it.
    pub fn is_even(&self) -> bool {
        /// What is left of a shadow that a stretch of rounding casts.
        const ROUNDING: f64 = 1e-9;
        let values = || self.radiance.iter().flatten().zip(self.scale.iter().flatten());
        let is_lit = values().all(|(&value, &scale)| value >= (1.0 - ROUNDING) * scale);
        let is_dark = values().all(|(&value, &scale)| value <= ROUNDING * scale);
        self.radiance.len() > 1 && (is_lit || is_dark)
    }
}

impl Scenario {
    /// The exact image.
    pub fn expected(&self) -> Expected {
        let rays = self.pixel_rays();
        let pixels: Vec<_> = rays.par_iter().map(|ray| self.pixel(ray)).collect();
        let mut expected = Expected { radiance: vec![], scale: vec![], transmittance: vec![] };
        for ([radiance, scale], ray) in pixels.into_iter().zip(&rays) {
            expected.radiance.push(radiance);
            expected.scale.push(scale);
            let length = match self.fog_on(ray) {
                None => ray.end,
                Some(fog) => fog.column_along(DVec3::ZERO, ray.direction, ray.end),
            };
            expected.transmittance.push(self.medium.sigma_t().map(|sigma| transmittance(sigma, length)));
        }
        expected
    }

    /// Height fog as the start of a ray sees it.
    fn fog_on(&self, ray: &PixelRay) -> Option<Fog> {
        self.medium.height_falloff().map(|falloff: &HeightFalloff| {
            let (up, scale) = (falloff.up(), falloff.scale_height());
            let eye = up.dot(self.camera.eye()) - falloff.base_height();
            Fog { up, start_height: eye + up.dot(ray.origin), scale }
        })
    }

    fn pixel(&self, ray: &PixelRay) -> [[f64; 3]; 2] {
        let whole = [(0.0, ray.end)];
        let lit = without(&whole, self.dark_spans(ray));
        let coloured = self.dimmed(ray, self.coloured(ray, &lit));
        let brightest = self.glass.as_ref().map_or(1.0, |glass| {
            glass.texels.iter().flatten().fold(1.0f32, |most, &factor| most.max(factor))
        });
        let physics = Physics::new(self, ray);
        let radiance = physics.radiance(&coloured, true);
        let clear = [Piece::clear(((0.0, ray.end), [brightest; 3]))];
        let own = physics.radiance(&clear, true);
        let is_spot = matches!(self.light, Light::Spot(_));
        let without_cone = if is_spot { physics.radiance(&clear, false) } else { own };
        [radiance, std::array::from_fn(|c| own[c].max(LEAST_SCALE * without_cone[c]))]
    }

    /// The shadowed parts of a ray, in any order; they may touch, and overlap in rounding.
    fn dark_spans(&self, ray: &PixelRay) -> Vec<Span> {
        let eye = self.camera.eye();
        match &self.shadow {
            Shadow::None => Vec::new(),
            Shadow::Parallel(layers) => {
                let mut dark = Vec::new();
                let mut covered = Vec::new();
                for MapLayer { frame, texels } in layers {
                    let path = Path::new(frame, frame.right(), eye, ray);
                    dark.extend(without(&path.dark(texels, ray.end), covered.clone()));
                    covered.extend(path.inside(ray.end));
                }
                dark
            }
            Shadow::Perspective(MapLayer { frame, texels }) => {
                Path::new(frame, frame.right(), eye, ray).dark(texels, ray.end)
            }
            Shadow::Cube { side, texels } => {
                let position = self.light.position().unwrap_or(eye);
                let area = (side * side) as usize;
                FACES
                    .iter()
                    .zip(texels.chunks_exact(area))
                    .flat_map(|(&(forward, up), texels)| {
                        let frame = MapFrame {
                            origin: position,
                            forward,
                            up,
                            half: [1.0; 2],
                            size: [*side; 2],
                            perspective: true,
                            by_matrix: false,
                        };
                        // Seen from inside, a cube's columns run against the hand of all other maps.
                        Path::new(&frame, -frame.right(), eye, ray).dark(texels, ray.end)
                    })
                    .collect()
            }
        }
    }

    /// The lit parts with the colour of the glass before them.
    fn coloured(&self, ray: &PixelRay, lit: &[Span]) -> Vec<(Span, [f32; 3])> {
        let Some(glass) = &self.glass else { return lit.iter().map(|&span| (span, [1.0; 3])).collect() };
        let path = Path::new(&glass.frame, glass.frame.right(), self.camera.eye(), ray);
        let mut pieces: Vec<_> = without(lit, path.inside(ray.end).into_iter().collect())
            .into_iter()
            .map(|s| (s, [1.0; 3]))
            .collect();
        path.cells(ray.end, |texel, cell| {
            let colour = glass.texels[texel];
            pieces.extend(lit.iter().filter_map(|span| common(*span, cell)).map(|span| (span, colour)));
        });
        pieces
    }
}

impl Scenario {
    /// The lit pieces with what smoke and hair do to their light.
    fn dimmed(&self, ray: &PixelRay, pieces: Vec<(Span, [f32; 3])>) -> Vec<Piece> {
        let Some(smoke) = &self.smoke else { return pieces.into_iter().map(Piece::clear).collect() };
        let path = Path::new(&smoke.frame, smoke.frame.right(), self.camera.eye(), ray);
        let inside: Vec<Span> = path.inside(ray.end).into_iter().collect();
        let mut dimmed = Vec::new();
        for (span, colour) in &pieces {
            let outside = without(&[*span], inside.clone());
            dimmed.extend(outside.into_iter().map(|span| Piece::clear((span, *colour))));
        }
        path.cells(ray.end, |texel, cell| {
            for part in parts(&smoke.texels[texel], path.depth, cell) {
                for (span, colour) in &pieces {
                    let common = common(*span, part.span);
                    dimmed.extend(common.map(|span| part.cut(span, *colour)));
                }
            }
        });
        dimmed
    }
}

/// Forward and up of the cube faces +X −X +Y −Y +Z −Z (the cube map convention of Direct3D, Vulkan and wgpu: up is
/// −t of the face's coordinates).
const FACES: [(DVec3, DVec3); 6] = [
    (DVec3::X, DVec3::Y),
    (DVec3::NEG_X, DVec3::Y),
    (DVec3::Y, DVec3::NEG_Z),
    (DVec3::NEG_Y, DVec3::Z),
    (DVec3::Z, DVec3::Y),
    (DVec3::NEG_Z, DVec3::Y),
];

/// Texel coordinates and depth along a ray: value and slope. A perspective map's coordinates still carry the factor
/// depth.
struct Path {
    u: [f64; 2],
    v: [f64; 2],
    depth: [f64; 2],
    size: [u32; 2],
    perspective: bool,
}

impl Path {
    fn new(frame: &MapFrame, right: DVec3, eye: DVec3, ray: &PixelRay) -> Self {
        // Relative to the eye: both it and the map may be far from the origin.
        let start = (eye - frame.origin) + ray.origin;
        let along = |axis: DVec3| [start.dot(axis), ray.direction.dot(axis)];
        let depth = along(frame.forward);
        let weight = if frame.perspective { depth } else { [1.0, 0.0] };
        let texels = |axis: DVec3, half: f64, count: u32| {
            let offset = along(axis);
            let count = f64::from(count);
            [0, 1].map(|n| 0.5 * count * (offset[n] / half + weight[n]))
        };
        Self {
            u: texels(right, frame.half[0], frame.size[0]),
            v: texels(-frame.up, frame.half[1], frame.size[1]),
            depth,
            size: frame.size,
            perspective: frame.perspective,
        }
    }

    /// The part of the ray whose coordinate lies in `[from, to)`.
    fn between(&self, coordinate: [f64; 2], from: u32, to: u32, span: Span) -> Option<Span> {
        let weight = if self.perspective { self.depth } else { [1.0, 0.0] };
        let less = |border: u32| [0, 1].map(|n| coordinate[n] - f64::from(border) * weight[n]);
        let span = clip(less(from), Bound::AtLeastZero, span)?;
        clip(less(to).map(|c| -c), Bound::AboveZero, span)
    }

    fn in_front(&self, end: f64) -> Option<Span> {
        let span = (0.0, end);
        if self.perspective { clip(self.depth, Bound::AboveZero, span) } else { Some(span) }
    }

    /// The part of the ray inside of the map.
    fn inside(&self, end: f64) -> Option<Span> {
        let span = self.between(self.u, 0, self.size[0], self.in_front(end)?)?;
        self.between(self.v, 0, self.size[1], span)
    }

    /// Calls `each(texel, span)` for every texel that the ray passes.
    fn cells(&self, end: f64, mut each: impl FnMut(usize, Span)) {
        let Some(whole) = self.in_front(end) else { return };
        for j in 0..self.size[1] {
            let Some(row) = self.between(self.v, j, j + 1, whole) else { continue };
            for i in 0..self.size[0] {
                if let Some(cell) = self.between(self.u, i, i + 1, row) {
                    each((j * self.size[0] + i) as usize, cell);
                }
            }
        }
    }

    /// The parts of the ray that the texels shadow.
    fn dark(&self, texels: &[f32], end: f64) -> Vec<Span> {
        let mut dark = Vec::new();
        self.cells(end, |texel, cell| {
            let stored = f64::from(texels[texel]);
            if stored < f64::INFINITY {
                let beyond = [self.depth[0] - stored, self.depth[1]];
                dark.extend(clip(beyond, Bound::AboveZero, cell));
            }
        });
        dark
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Bound {
    AtLeastZero,
    AboveZero,
}

/// The part of `span` where `value + slope·t` keeps the bound.
fn clip([value, slope]: [f64; 2], bound: Bound, (start, end): Span) -> Option<Span> {
    let root = -value / slope;
    let (start, end) = if slope > 0.0 {
        (start.max(root), end)
    } else if slope < 0.0 {
        (start, end.min(root))
    } else if value > 0.0 || (value == 0.0 && bound == Bound::AtLeastZero) {
        (start, end)
    } else {
        return None;
    };
    (end > start).then_some((start, end))
}

fn common(a: Span, b: Span) -> Option<Span> {
    let span = (a.0.max(b.0), a.1.min(b.1));
    (span.1 > span.0).then_some(span)
}

/// Gap between two neighbouring texels' shadows, as a share of its distance (of 1 near the eye), that is rounding: both
/// borders are the same border, computed from either side in a few operations of f64.
const ROUNDING_GAP: f64 = 1e-12;

/// What is left of `spans` (disjoint, in order) when `holes` are taken out.
fn without(spans: &[Span], mut holes: Vec<Span>) -> Vec<Span> {
    holes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut joined: Vec<Span> = Vec::with_capacity(holes.len());
    for (from, to) in holes {
        match joined.last_mut() {
            Some((_, end)) if from - *end <= ROUNDING_GAP * end.max(1.0) => *end = end.max(to),
            _ => joined.push((from, to)),
        }
    }
    let mut left = Vec::new();
    for &(mut start, end) in spans {
        for &(from, to) in &joined {
            left.extend(common((start, end), (start, from)));
            start = start.max(to);
        }
        left.extend(common((start, end), (start, end)));
    }
    left
}

/// The light and the medium of one ray, in the terms of the closed forms.
struct Physics<'a> {
    scenario: &'a Scenario,
    ray: &'a PixelRay,
    fog: Option<Fog>,
    components: [Vec<(f64, PhaseFunction)>; 3],
    /// The first channel that is the same as this one: what is known is not integrated again.
    twin: [usize; 3],
}

impl<'a> Physics<'a> {
    fn new(scenario: &'a Scenario, ray: &'a PixelRay) -> Self {
        let medium = &scenario.medium;
        let components = [0, 1, 2].map(|channel| {
            let parts = medium.components().iter();
            parts
                .map(|part| {
                    let phase = match part.phase {
                        Phase::Isotropic => PhaseFunction::Isotropic,
                        Phase::Rayleigh => PhaseFunction::Rayleigh,
                        Phase::HenyeyGreenstein { g } => PhaseFunction::HenyeyGreenstein(g),
                    };
                    (part.sigma_s[channel], phase)
                })
                .collect::<Vec<_>>()
        });
        let same =
            |a: usize, b: usize| components[a] == components[b] && medium.sigma_t()[a] == medium.sigma_t()[b];
        let twin = [0, if same(0, 1) { 0 } else { 1 }, if same(0, 2) { 0 } else { 2 }];
        Self { scenario, ray, fog: scenario.fog_on(ray), components, twin }
    }

    /// All pieces together, with or without the cone of a spot.
    fn radiance(&self, pieces: &[Piece], with_cone: bool) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for piece in pieces {
            let mut per_unit = [0.0; 3];
            for channel in 0..3 {
                let twin = self.twin[channel];
                per_unit[channel] =
                    if twin < channel { per_unit[twin] } else { self.piece(channel, piece, with_cone) };
                sum[channel] += per_unit[channel]
                    * self.scenario.light.strength()[channel]
                    * f64::from(piece.colour[channel]);
            }
        }
        sum
    }

    /// One channel of a lit interval, for a light of strength 1.
    fn piece(&self, channel: usize, piece: &Piece, with_cone: bool) -> f64 {
        let components = &self.components[channel];
        let least = piece.depths[0].min(piece.depths[1]);
        if components.iter().all(|(sigma_s, _)| *sigma_s == 0.0) || least > DARK {
            return 0.0;
        }
        let medium = Channel { components, sigma_t: self.scenario.medium.sigma_t()[channel] };
        let relative = |position: DVec3| position - self.scenario.camera.eye() - self.ray.origin;
        let view = self.ray.direction;
        let lamp = match &self.scenario.light {
            Light::Directional(sun) => {
                let travel = sun.direction();
                return self.faded(
                    piece,
                    |(start, end)| match &self.fog {
                        None => sun_radiance(1.0, travel, &medium, view, start, end),
                        Some(fog) => fog_sun_radiance(1.0, travel, &medium, fog, (view, start, end)),
                    },
                    |fading| fading.sun_radiance(1.0, travel, &medium, view),
                );
            }
            Light::Point(lamp) => Lamp { position: relative(lamp.position()), intensity: 1.0, cone: None },
            Light::Spot(spot) => {
                let (inner, outer) = (spot.cos_inner().clamp(-1.0, 1.0).acos(), spot.outer());
                let cone = with_cone.then_some(Cone { axis: spot.direction(), inner, outer });
                Lamp { position: relative(spot.lamp().position()), intensity: 1.0, cone }
            }
        };
        self.faded(
            piece,
            |(start, end)| match &self.fog {
                None => lamp_radiance(&lamp, &medium, view, start, end),
                Some(fog) => fog_lamp_radiance(&lamp, &medium, fog, (view, start, end)),
            },
            |fading| fading.lamp_radiance(&lamp, &medium, view),
        )
    }

    /// A piece by the form of a lit interval where the light does not fade along it, else by `fading`'s integrand. In height
    /// fog, which has no such form, in slices, each with the mean of its transmittance.
    fn faded(&self, piece: &Piece, lit: impl Fn(Span) -> f64, fading: impl Fn(&Fading) -> f64) -> f64 {
        let ((a, b), [from, to]) = (piece.span, piece.depths);
        if from == to {
            return (-from).exp() * lit(piece.span);
        }
        if self.fog.is_none() {
            return fading(&Fading { span: piece.span, depths: piece.depths });
        }
        let at = |index: u32| f64::from(index) / f64::from(SLICES);
        let slice = |index: u32| {
            let (x, y) = (at(index), at(index + 1));
            let [p, q] = [x, y].map(|share| from + (to - from) * share);
            ((-p).exp() - (-q).exp()) / (q - p) * lit((a + (b - a) * x, a + (b - a) * y))
        };
        (0..SLICES).map(slice).sum()
    }
}

/// Optical depth from which on nothing is left in f64 either, infinite ones among them.
const DARK: f64 = 750.0;

/// Slices of a piece in smoke and height fog: wrong by a twelfth of how much the transmittance and the radiance change in a
/// slice, 3e-7 where the smoke has an optical depth of 1.5 and the medium one of 0.05.
const SLICES: u32 = 112;

fn transmittance(sigma: f64, end: f64) -> f64 {
    if sigma == 0.0 { 1.0 } else { (-sigma * end).exp() }
}

#[cfg(test)]
mod tests {
    use scatter_core::ModelError;

    use super::*;
    use crate::closed_form::sun_integral;
    use crate::stress::scenes::{self, SCENES};

    #[test]
    fn spans_are_clipped_half_open() {
        // 2 − t > 0 on [0, 5] ends at 2; a constant on the border belongs to the closed side alone.
        assert_eq!(clip([2.0, -1.0], Bound::AboveZero, (0.0, 5.0)), Some((0.0, 2.0)));
        assert_eq!(clip([-2.0, 1.0], Bound::AtLeastZero, (0.0, f64::INFINITY)), Some((2.0, f64::INFINITY)));
        assert_eq!(clip([0.0, 0.0], Bound::AtLeastZero, (0.0, 1.0)), Some((0.0, 1.0)));
        assert_eq!(clip([0.0, 0.0], Bound::AboveZero, (0.0, 1.0)), None);
    }

    #[test]
    fn holes_may_overlap_touch_and_reach_beyond() {
        let left =
            without(&[(0.0, 10.0)], vec![(8.0, 20.0), (1.0, 3.0), (2.0, 4.0), (4.0, 5.0), (-1.0, 0.5)]);
        assert_eq!(left, [(0.5, 1.0), (5.0, 8.0)]);
        assert_eq!(without(&[(0.0, 1.0), (2.0, 3.0)], vec![(0.5, 2.5)]), [(0.0, 0.5), (2.5, 3.0)]);
    }

    #[test]
    fn nothing_in_the_map_is_the_closed_form_and_all_near_is_dark() -> Result<(), ModelError> {
        let clear =
            scenes::sun()?.with_depths(|_, _, _| f32::INFINITY).in_medium(0.05, 0.01, Phase::Isotropic)?;
        let expected = clear.expected();
        for (ray, value) in clear.pixel_rays().iter().zip(&expected.radiance) {
            // E = 3, σs/4π.
            let exact = 3.0 * 0.05 / (4.0 * std::f64::consts::PI) * sun_integral(0.06, 0.0, ray.end);
            assert!((value[1] / exact - 1.0).abs() < 1e-13, "{value:?} {exact}");
        }
        for (name, scene) in [SCENES[1], SCENES[2]] {
            let dark = scene()?.with_depths(|_, _, _| 0.0).expected();
            assert!(dark.radiance.iter().flatten().all(|&value| value == 0.0), "{name}");
            assert!(dark.scale.iter().flatten().all(|&value| value > 0.0), "{name}");
        }
        Ok(())
    }

    #[test]
    fn the_rays_of_every_scene_are_partly_lit() -> Result<(), ModelError> {
        // A scene that is all light or all shadow would test no edge.
        for (name, scene) in SCENES {
            let expected = scene()?.expected();
            let share: f64 = expected.radiance.iter().flatten().sum::<f64>()
                / expected.scale.iter().flatten().sum::<f64>();
            assert!((0.2..0.9).contains(&share), "{name}: {share}");
        }
        Ok(())
    }
}
