//! Lights: a sun, a lamp, a lamp with a cone, and the colour texture that one can carry.

use glam::DVec3;

use crate::error::{
    ModelError, checked, checked_direction, checked_len, checked_point, checked_rgb, checked_size,
};
use crate::map_projection::MapProjection;
use crate::texel_walk::TexelWalk;

/// The light of one pass; several lights are several passes whose images add up.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Parallel light that nothing attenuates before it reaches the medium's point.
    Directional(DirectionalLight),
    /// An ideal point.
    Point(PointLight),
    /// An ideal point with the cone of KHR_lights_punctual.
    Spot(SpotLight),
}

/// A sun.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionalLight {
    pub(crate) direction: DVec3,
    pub(crate) irradiance: [f64; 3],
}

/// A lamp that shines in all directions with intensity `I·exp(−σt·d)/d²` at distance d.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLight {
    pub(crate) position: DVec3,
    pub(crate) intensity: [f64; 3],
    pub(crate) radius: f64,
}

/// A lamp with a cone: intensity times `saturate((cos θ − cos outer)·s)²`, `s = 1/max(0.001, cos inner − cos outer)`.
#[derive(Debug, Clone, PartialEq)]
pub struct SpotLight {
    pub(crate) lamp: PointLight,
    pub(crate) direction: DVec3,
    pub(crate) cos_inner: f64,
    pub(crate) cos_outer: f64,
    pub(crate) outer: f64,
}

impl Light {
    /// A sun that shines along `direction` (any length > 0) with RGB `irradiance` \[W/m²\], ≥ 0.
    pub fn directional(direction: [f64; 3], irradiance: [f64; 3]) -> Result<Self, ModelError> {
        let direction = checked_direction("light.direction", direction)?;
        let irradiance = checked_rgb("light.irradiance", irradiance)?;
        Ok(Self::Directional(DirectionalLight { direction, irradiance }))
    }

    /// A lamp at `position` with RGB `intensity` \[W/sr\], ≥ 0. `radius` ≥ 0: view rays that pass closer are taken at
    /// that distance (0: an ideal point).
    pub fn point(position: [f64; 3], intensity: [f64; 3], radius: f64) -> Result<Self, ModelError> {
        PointLight::new(position, intensity, radius).map(Self::Point)
    }

    /// A lamp with a cone around `direction`; half angles in degrees, 0 ≤ inner ≤ outer ≤ 90, outer > 0.
    pub fn spot(
        position: [f64; 3],
        direction: [f64; 3],
        intensity: [f64; 3],
        inner_degrees: f64,
        outer_degrees: f64,
        radius: f64,
    ) -> Result<Self, ModelError> {
        let outer_range = "an angle in (0, 90] degrees";
        let outer =
            checked("light.outer_cone_degrees", outer_degrees, |v| v > 0.0 && v <= 90.0, outer_range)?;
        let inner_range = "an angle from 0 to outer_cone_degrees";
        let inner =
            checked("light.inner_cone_degrees", inner_degrees, |v| (0.0..=outer).contains(&v), inner_range)?;
        Ok(Self::Spot(SpotLight {
            lamp: PointLight::new(position, intensity, radius)?,
            direction: checked_direction("light.direction", direction)?,
            cos_inner: inner.to_radians().cos(),
            cos_outer: outer.to_radians().cos(),
            outer: outer.to_radians(),
        }))
    }

    /// Where the lamp is; `None` for a sun.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Directional(_) => None,
            Self::Point(lamp) => Some(lamp.position),
            Self::Spot(spot) => Some(spot.lamp.position),
        }
    }

    /// RGB irradiance of a sun \[W/m²\] or intensity of a lamp \[W/sr\].
    pub fn strength(&self) -> [f64; 3] {
        match self {
            Self::Directional(sun) => sun.irradiance,
            Self::Point(lamp) => lamp.intensity,
            Self::Spot(spot) => spot.lamp.intensity,
        }
    }

    /// The same light, `factor` ≥ 0 times as strong.
    pub fn scaled(&self, factor: f64) -> Result<Self, ModelError> {
        let rgb = checked_rgb("light strength", self.strength().map(|s| s * factor))?;
        let mut light = self.clone();
        match &mut light {
            Self::Directional(sun) => sun.irradiance = rgb,
            Self::Point(lamp) => lamp.intensity = rgb,
            Self::Spot(spot) => spot.lamp.intensity = rgb,
        }
        Ok(light)
    }
}

impl DirectionalLight {
    /// Unit vector, the way the light travels.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// RGB irradiance \[W/m²\].
    pub fn irradiance(&self) -> [f64; 3] {
        self.irradiance
    }
}

impl PointLight {
    fn new(position: [f64; 3], intensity: [f64; 3], radius: f64) -> Result<Self, ModelError> {
        Ok(Self {
            position: checked_point("light.position", position)?,
            intensity: checked_rgb("light.intensity", intensity)?,
            radius: checked("light.radius", radius, |v| v >= 0.0, "a finite number ≥ 0")?,
        })
    }

    /// Where it is in the world.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// RGB intensity \[W/sr\].
    pub fn intensity(&self) -> [f64; 3] {
        self.intensity
    }

    /// View rays that pass closer are taken at this distance \[world units\].
    pub fn radius(&self) -> f64 {
        self.radius
    }
}

impl SpotLight {
    /// The lamp without its cone.
    pub fn lamp(&self) -> &PointLight {
        &self.lamp
    }

    /// Unit vector, the axis of the cone, away from the lamp.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// Cosine of the half angle up to which the lamp has its full strength.
    pub fn cos_inner(&self) -> f64 {
        self.cos_inner
    }

    /// Cosine of the half angle from which on it has none.
    pub fn cos_outer(&self) -> f64 {
        self.cos_outer
    }

    /// The outer half angle \[radians\], in (0, π/2].
    pub fn outer(&self) -> f64 {
        self.outer
    }

    /// The cone factor, 0 to 1, for the cosine between the axis and the way the light travels.
    pub fn cone(&self, cos_axis: f64) -> f64 {
        ((cos_axis - self.cos_outer) * self.cone_slope()).clamp(0.0, 1.0).powi(2)
    }

    /// `s` of the cone factor: 1 / max(0.001, cos inner − cos outer).
    pub fn cone_slope(&self) -> f64 {
        // 0.001 is the smallest width that KHR_lights_punctual's reference formula allows.
        1.0 / (self.cos_inner - self.cos_outer).max(0.001)
    }

    /// The cosine from which on the cone factor is 1: `cos inner`, or `cos outer + 0.001` where they coincide (which
    /// can exceed 1: a needle of a cone never reaches its full strength).
    pub fn cos_full(&self) -> f64 {
        self.cos_outer + 1.0 / self.cone_slope()
    }
}

/// A colour texture in front of a light (stained glass): linear RGB by nearest texel; white outside of its texels.
#[derive(Debug, Clone, Copy)]
pub struct LightTexture<'a> {
    projection: MapProjection,
    texels: &'a [[f32; 3]],
}

impl<'a> LightTexture<'a> {
    /// Borrows linear RGB factors ≥ 0, `[row][column]`, row 0 on top; checks every texel once.
    pub fn new(projection: MapProjection, texels: &'a [[f32; 3]]) -> Result<Self, ModelError> {
        let size = projection.size();
        checked_len("light texture", texels.len(), checked_size("light texture", size)?)?;
        let bad = texels.iter().position(|rgb| rgb.iter().any(|&c| !(c.is_finite() && c >= 0.0)));
        if let Some(index) = bad {
            let value =
                texels[index].iter().find(|&&c| !(c.is_finite() && c >= 0.0)).copied().unwrap_or(f32::NAN);
            return Err(ModelError::BadTexel {
                map: "light texture",
                x: (index % size[0] as usize) as u32,
                y: (index / size[0] as usize) as u32,
                value: value.into(),
                range: "a finite linear RGB factor ≥ 0",
            });
        }
        Ok(Self { projection, texels })
    }

    /// Where the texels are.
    pub fn projection(&self) -> &MapProjection {
        &self.projection
    }

    /// All factors, `[row][column]`.
    pub fn texels(&self) -> &'a [[f32; 3]] {
        self.texels
    }

    /// The factor at column `i`, row `j`.
    pub fn at(&self, i: u32, j: u32) -> [f32; 3] {
        self.texels[j as usize * self.projection.size()[0] as usize + i as usize]
    }

    /// Cuts the stretch `[t_min, t_max]` of a ray (`start` relative to `reference`, world space) at the borders of
    /// texels of different colour, and calls `piece(t_min, t_max, factor)` for each part in order.
    pub fn pieces(
        &self,
        reference: DVec3,
        start: DVec3,
        direction: DVec3,
        [t_min, t_max]: [f64; 2],
        mut piece: impl FnMut(f64, f64, [f32; 3]),
    ) {
        const WHITE: [f32; 3] = [1.0; 3];
        let ray = self.projection.ray(reference, start, direction);
        let (mut begin, mut colour) = (t_min, WHITE);
        let mut advance = |from: f64, next: [f32; 3]| {
            if next != colour {
                if from > begin {
                    piece(begin, from, colour);
                }
                (begin, colour) = (from, next);
            }
        };
        let mut inside_until = t_min;
        for span in TexelWalk::new(&self.projection, &ray, t_min, t_max) {
            advance(span.t_min, self.at(span.i, span.j));
            inside_until = span.t_max;
        }
        if inside_until < t_max {
            advance(inside_until, WHITE);
        }
        if t_max > begin {
            piece(begin, t_max, colour);
        }
    }

    /// The factor at a world point; white outside of the texture and behind a perspective one.
    pub fn lookup(&self, p_world: DVec3) -> [f32; 3] {
        let p = self.projection.texel_from_world(p_world);
        let [width, height] = self.projection.size();
        let behind = self.projection.is_perspective() && p.z <= 0.0;
        let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(width) && p.y < f64::from(height) && !behind;
        if inside { self.at(p.x as u32, p.y as u32) } else { [1.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(inner: f64, outer: f64) -> SpotLight {
        match Light::spot([0.0; 3], [0.0, 0.0, -2.0], [1.0; 3], inner, outer, 0.0).unwrap() {
            Light::Spot(spot) => spot,
            _ => unreachable!(),
        }
    }

    #[test]
    fn the_cone_falls_from_one_at_inner_to_zero_at_outer() {
        let spot = spot(20.0, 40.0);
        let cos = |degrees: f64| degrees.to_radians().cos();
        assert!((spot.cone(cos(19.999)) - 1.0).abs() < 1e-15);
        assert_eq!(spot.cone(cos(40.001)), 0.0);
        let middle = 0.5 * (cos(20.0) + cos(40.0));
        assert!(
            (spot.cone(middle) - 0.25).abs() < 1e-12,
            "half way in the cosine is a quarter of the strength"
        );
    }

    #[test]
    fn coinciding_angles_give_a_cone_a_thousandth_wide_in_the_cosine() {
        let spot = spot(30.0, 30.0);
        let cos = 30f64.to_radians().cos();
        assert!((spot.cone(cos + 0.0005) - 0.25).abs() < 1e-9);
        assert_eq!(spot.cone(cos + 0.0011), 1.0);
        assert_eq!(spot.cone(cos - 1e-9), 0.0);
    }

    #[test]
    fn pieces_tile_the_stretch_and_have_the_colour_of_their_middle() {
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [2.0, 1.0], [5, 3])
                .unwrap();
        let texels: Vec<[f32; 3]> = (0..15).map(|n| [(n % 4) as f32, 0.5, (n % 3) as f32]).collect();
        let texture = LightTexture::new(projection, &texels).unwrap();
        let (start, direction) = (DVec3::new(-3.0, -0.9, 1.0), DVec3::new(1.0, 0.3, -0.2).normalize());
        let mut end = 0.0;
        let mut count = 0;
        texture.pieces(DVec3::ZERO, start, direction, [0.0, 9.0], |a, b, colour| {
            assert!(a == end && b > a);
            assert_eq!(colour, texture.lookup(start + direction * (0.5 * (a + b))));
            (end, count) = (b, count + 1);
        });
        assert_eq!(end, 9.0);
        assert!(count >= 6, "white, at least four columns, white: {count}");
    }

    #[test]
    fn impossible_lights_are_errors_that_name_the_field() {
        let message = |light: Result<Light, ModelError>| light.unwrap_err().to_string();
        assert!(message(Light::directional([0.0; 3], [1.0; 3])).contains("light.direction"));
        assert!(message(Light::directional([1.0, f64::NAN, 0.0], [1.0; 3])).contains("light.direction"));
        assert!(message(Light::directional([1.0; 3], [1.0, -1.0, 0.0])).contains("irradiance[1]"));
        assert!(message(Light::point([0.0; 3], [1.0; 3], -1.0)).contains("radius"));
        assert!(message(Light::spot([0.0; 3], [1.0; 3], [1.0; 3], 30.0, 20.0, 0.0)).contains("inner"));
        assert!(message(Light::spot([0.0; 3], [1.0; 3], [1.0; 3], 30.0, 91.0, 0.0)).contains("outer"));
    }
}
