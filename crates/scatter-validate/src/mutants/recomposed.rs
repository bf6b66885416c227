//! A technique composed from public stages, the exact walk's lit stretches and an integrand of its own, so that a part of
//! the integrand can be left out.

use scatter_core::{
    Capabilities, Frame, Light, LightKind, RenderError, RenderStats, ScatterImage, TechniqueInfo, ViewRay,
    VolumetricShadow,
};

use raymarch_ref::ShadowMapWalk;

/// What is left out of, or wrong in, the integrand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhysicsFault {
    /// `exp(−σt·d)` between lamp and point.
    LightLegForgotten,
    /// `1/d²` of a lamp.
    InverseSquareForgotten,
    /// `exp(−σt·t)` between point and eye.
    ViewLegForgotten,
    /// The angle is taken between the two directions away from the point.
    PhaseAngleReversed,
}

impl PhysicsFault {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::LightLegForgotten,
        Self::InverseSquareForgotten,
        Self::ViewLegForgotten,
        Self::PhaseAngleReversed,
    ];

    /// A few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::LightLegForgotten => "extinction from lamp to point left out",
            Self::InverseSquareForgotten => "1/d² of the lamp left out",
            Self::ViewLegForgotten => "extinction from point to eye left out",
            Self::PhaseAngleReversed => "phase angle between ways out",
        }
    }

    /// Group and name of the row that must reject it.
    pub fn rung(self) -> (&'static str, &'static str) {
        match self {
            Self::LightLegForgotten | Self::InverseSquareForgotten => ("optical depth σt·D", "1e0, point"),
            Self::ViewLegForgotten => ("optical depth σt·D", "1e0, sun"),
            Self::PhaseAngleReversed => ("phase functions", "g = 0.5, point"),
        }
    }
}

/// The technique; correct without a fault.
#[derive(Debug, Clone, Copy)]
pub struct Recomposed {
    /// What is wrong with it.
    pub fault: Option<PhysicsFault>,
}

/// Samples of a lit stretch: the midpoint rule over the angle at the lamp leaves 1/n² of smooth factors.
const SAMPLES: u32 = 64;

/// What tools see of it.
pub(super) static INFO: TechniqueInfo = TechniqueInfo::of_reference(
    "recomposed",
    "lit stretches of the exact walk, integrated by the midpoint rule",
    Capabilities {
        lights: &[LightKind::Directional, LightKind::Point],
        textures: &[],
        height_fog: &[],
        translucent: &[],
        ..ShadowMapWalk::CAPABILITIES
    },
);

impl VolumetricShadow for Recomposed {
    fn id(&self) -> &'static str {
        INFO.id
    }

    fn capabilities(&self) -> Capabilities {
        INFO.capabilities
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        self.supports(frame)?;
        out.resize(frame.size());
        let width = frame.size()[0];
        let (inscattered, transmittance) = out.pixels_mut();
        for (index, (radiance, through)) in inscattered.iter_mut().zip(transmittance).enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            let ray = frame.camera().pixel_ray(x, y);
            let mut sum = [0.0; 3];
            ShadowMapWalk::lit_stretches(frame, x, y, |a, b| self.add(frame, &ray, [a, b], &mut sum));
            *radiance = sum.map(|value| value as f32);
            *through = frame.medium().transmittance(frame.ray_end(x, y)).map(|t| t as f32);
        }
        Ok(RenderStats::default())
    }
}

impl Recomposed {
    /// `σs·p·Lin·exp(−σt·t)` by the midpoint rule, in the variable that makes 1/d² constant beside a lamp.
    fn add(&self, frame: &Frame<'_>, ray: &ViewRay, [a, b]: [f64; 2], sum: &mut [f64; 3]) {
        let lamp = frame.light().position().map(|position| position - frame.camera().eye() - ray.origin);
        let foot = lamp.map_or(0.0, |lamp| lamp.dot(ray.direction));
        let h = lamp.map_or(1.0, |lamp| lamp.cross(ray.direction).length());
        let angles = lamp.map(|_| [((a - foot) / h).atan(), ((b - foot) / h).atan()]);
        let has = |fault: PhysicsFault| self.fault == Some(fault);
        for sample in 0..SAMPLES {
            let share = (f64::from(sample) + 0.5) / f64::from(SAMPLES);
            let (t, dt) = match angles {
                None => (a + share * (b - a), (b - a) / f64::from(SAMPLES)),
                Some([from, to]) => {
                    let angle = from + share * (to - from);
                    (foot + h * angle.tan(), h / angle.cos().powi(2) * (to - from) / f64::from(SAMPLES))
                }
            };
            let from_lamp = lamp.map(|lamp| ray.direction * t - lamp);
            let d = from_lamp.map_or(0.0, |way| way.length());
            let travel = match (frame.light(), from_lamp) {
                (Light::Directional(sun), _) => sun.direction(),
                (_, Some(way)) => way / d,
                _ => return,
            };
            let reversed = if has(PhysicsFault::PhaseAngleReversed) { -1.0 } else { 1.0 };
            let cos_theta = reversed * travel.dot(-ray.direction);
            let square =
                if lamp.is_none() || has(PhysicsFault::InverseSquareForgotten) { 1.0 } else { d * d };
            let view_leg = if has(PhysicsFault::ViewLegForgotten) { 0.0 } else { t };
            let light_leg = if has(PhysicsFault::LightLegForgotten) { 0.0 } else { d };
            let scattering = frame.medium().scattering_towards(0.5 * (1.0 - cos_theta));
            for (channel, sum) in sum.iter_mut().enumerate() {
                let sigma_t = frame.medium().sigma_t()[channel];
                let strength = frame.light().strength()[channel] / square;
                *sum += scattering[channel] * strength * (-sigma_t * (view_leg + light_leg)).exp() * dt;
            }
        }
    }
}
