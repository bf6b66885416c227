//! What a technique can do, as data, and the one check of a frame against it.
//!
//! Refusal by default: [`Capabilities::NOTHING`] renders nothing, and a technique names what it does. Whatever a frame
//! needs is collected in one place ([`Needs::of`], by exhaustive patterns over the set-up and its parts) and compared in
//! one place ([`Capabilities::check_setup`], by exhaustive patterns over both sides), so that a feature that is added to
//! a frame does not compile before it is refused, and is then refused by every technique that does not name it.

use std::fmt;

use crate::frame::Frame;
use crate::kinds::{CameraKind, ExtinctionKind, Kind, LightKind, MapKind, PhaseKind, either, names};
use crate::medium::{Medium, Scattering};
use crate::phase::Phase;
use crate::render_error::Unsupported;
use crate::setup::Setup;

/// What one instance of a technique renders; modes and options may change it.
///
/// All lists and limits hold together: a frame is rendered if each of its features is on its list and within its limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capabilities {
    /// Lights.
    pub lights: &'static [LightKind],
    /// Lights that may carry a colour texture.
    pub textures: &'static [LightKind],
    /// Shadow maps.
    pub maps: &'static [MapKind],
    /// Cameras.
    pub cameras: &'static [CameraKind],
    /// Extinctions of the medium.
    pub extinctions: &'static [ExtinctionKind],
    /// Phase functions of the medium's components.
    pub phases: &'static [PhaseKind],
    /// Whether a medium may have several scattering components.
    pub phase_sums: bool,
    /// Lights that may shine in height fog (a medium with a [`HeightFalloff`](crate::HeightFalloff)).
    pub height_fog: &'static [LightKind],
    /// Lights that translucent occluders (smoke, hair) may dim on their way.
    pub translucent: &'static [LightKind],
    /// Whether rays may be endless (`max_distance` = ∞).
    pub endless_rays: bool,
    /// Limits that are numbers.
    pub limits: Limits,
}

/// The numbers among the [`Capabilities`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Largest |g| of a phase function under a sun, 0 to 1; 1 is no limit.
    pub sun_g: f64,
    /// Largest |g| of a phase function around a lamp, 0 to 1; 1 is no limit.
    pub lamp_g: f64,
    /// Most cascades of a sun.
    pub cascades: usize,
    /// Most texels of one layer of a shadow map.
    pub layer_texels: u64,
}

impl Limits {
    /// What nothing satisfies.
    pub const NOTHING: Self = Self { sun_g: 0.0, lamp_g: 0.0, cascades: 0, layer_texels: 0 };
}

/// What a frame asks of a technique.
struct Needs {
    light: LightKind,
    textured: bool,
    map: MapKind,
    camera: CameraKind,
    extinction: ExtinctionKind,
    phases: [bool; PhaseKind::ALL.len()],
    phase_sum: bool,
    height_fog: bool,
    translucent: bool,
    endless: bool,
    largest_g: f64,
    cascades: usize,
    layer_texels: u64,
}

impl Needs {
    fn of(setup: &Setup<'_>) -> Self {
        // Exhaustive on purpose: a new part of a set-up must say here what it needs.
        let Setup { camera, light, medium, max_distance, maps, texture, translucent } = setup;
        let Medium { components, sigma_a: _, sigma_t: _, height_falloff } = medium;
        let mut phases = [false; PhaseKind::ALL.len()];
        let mut largest_g = 0.0f64;
        // Components that scatter nothing count: techniques make tables of all of them.
        for Scattering { sigma_s: _, phase } in components {
            phases[PhaseKind::of(phase) as usize] = true;
            if let Phase::HenyeyGreenstein { g } = phase {
                largest_g = largest_g.max(g.abs());
            }
        }
        Self {
            light: LightKind::of(light),
            textured: texture.is_some(),
            map: maps.kind(),
            camera: CameraKind::of(camera),
            extinction: if medium.is_grey() { ExtinctionKind::Grey } else { ExtinctionKind::Rgb },
            phases,
            phase_sum: components.len() > 1,
            height_fog: height_falloff.is_some(),
            translucent: *translucent,
            endless: *max_distance == f64::INFINITY,
            largest_g,
            cascades: if maps.kind() == MapKind::Cascades { maps.projections().len() } else { 0 },
            layer_texels: maps
                .projections()
                .iter()
                .map(|map| map.size().map(u64::from).iter().product())
                .max()
                .unwrap_or(0),
        }
    }
}

impl Capabilities {
    /// Renders nothing: where every technique starts.
    pub const NOTHING: Self = Self {
        lights: &[],
        textures: &[],
        maps: &[],
        cameras: &[],
        extinctions: &[],
        phases: &[],
        phase_sums: false,
        height_fog: &[],
        translucent: &[],
        endless_rays: false,
        limits: Limits::NOTHING,
    };

    /// Whether the technique renders this frame; otherwise what the frame has and what to give instead.
    /// Cost: one look at each part; no texel is read.
    pub fn check(&self, frame: &Frame<'_>) -> Result<(), Unsupported> {
        // Exhaustive on purpose. Texels, depths and further sources add no feature to what the set-up says.
        let Frame { setup, depth: _, shadow: _, texture: _, map_source: _, translucent: _ } = frame;
        self.check_setup(setup)
    }

    /// As [`Self::check`], before there are any texels.
    pub fn check_setup(&self, setup: &Setup<'_>) -> Result<(), Unsupported> {
        // Exhaustive on purpose, on both sides: a need that nothing is compared with does not compile.
        let Needs {
            light,
            textured,
            map,
            camera,
            extinction,
            phases,
            phase_sum,
            height_fog,
            translucent,
            endless,
            largest_g,
            cascades,
            layer_texels,
        } = Needs::of(setup);
        let &Self {
            lights,
            textures: textured_lights,
            maps,
            cameras,
            extinctions,
            phases: phase_kinds,
            phase_sums,
            height_fog: fog_lights,
            translucent: dimmed_lights,
            endless_rays,
            limits: Limits { sun_g, lamp_g, cascades: most_cascades, layer_texels: most_texels },
        } = self;
        among(cameras, camera)?;
        among(lights, light)?;
        among(maps, map)?;
        among(extinctions, extinction)?;
        for (kind, _) in PhaseKind::ALL.iter().zip(phases).filter(|(_, needed)| *needed) {
            among(phase_kinds, *kind)?;
        }
        refuse_if(phase_sum && !phase_sums, || {
            "a medium of several scattering components; give one component".into()
        })?;
        refuse_if(endless && !endless_rays, || {
            "rays without end (max_distance is ∞); give a finite max_distance".into()
        })?;
        refuse_if(textured && !textured_lights.contains(&light), || {
            format!(
                "{} with a colour texture; {}",
                light.phrase(),
                without_or(textured_lights, "give the light without it")
            )
        })?;
        refuse_if(height_fog && !fog_lights.contains(&light), || {
            let cure = without_or(fog_lights, "give a medium without height_falloff");
            format!("{} in height fog; {cure}", light.phrase())
        })?;
        refuse_if(translucent && !dimmed_lights.contains(&light), || {
            let cure = without_or(dimmed_lights, "give a frame without them");
            format!("{} dimmed by translucent occluders; {cure}", light.phrase())
        })?;
        let (where_, most_g) = match light {
            LightKind::Directional => ("under a sun", sun_g),
            LightKind::Point | LightKind::Spot => ("around a lamp", lamp_g),
        };
        refuse_if(largest_g > most_g, || {
            format!("a phase function with |g| = {largest_g} {where_}; give |g| of at most {most_g}")
        })?;
        refuse_if(cascades > most_cascades, || format!("{cascades} cascades; give at most {most_cascades}"))?;
        refuse_if(layer_texels > most_texels, || {
            format!("a shadow map of {layer_texels} texels; give at most {most_texels} a layer")
        })
    }

    /// What is on the lists, a row each: its name and the values in words.
    pub fn describe(&self) -> Vec<(&'static str, String)> {
        let &Self {
            lights,
            textures,
            maps,
            cameras,
            extinctions,
            phases,
            phase_sums,
            height_fog,
            translucent,
            endless_rays,
            limits,
        } = self;
        let sums = if phase_sums { ", sums of them" } else { "" };
        let mut rows = vec![
            ("lights", names(lights)),
            ("textures", names(textures)),
            ("maps", names(maps)),
            ("cameras", names(cameras)),
            ("media", format!("{}; {}{sums}", names(extinctions), names(phases))),
        ];
        if !height_fog.is_empty() {
            rows.push(("height fog", names(height_fog)));
        }
        if !translucent.is_empty() {
            rows.push(("translucent occluders", names(translucent)));
        }
        if endless_rays {
            rows.push(("rays", "finite, endless".into()));
        }
        rows.push(("limits", limits.describe(self)));
        rows.retain(|(_, values)| !values.is_empty());
        rows
    }

    /// What the model has and this instance refuses, a phrase each.
    pub fn cannot(&self) -> Vec<String> {
        let &Self {
            lights,
            textures,
            maps,
            cameras,
            extinctions,
            phases,
            phase_sums,
            height_fog,
            translucent,
            endless_rays,
            limits: Limits { sun_g, lamp_g, cascades: _, layer_texels: _ },
        } = self;
        let mut all = missing(lights);
        all.extend(missing(textures).into_iter().map(|light| format!("{light} with a colour texture")));
        all.extend(missing(height_fog).into_iter().map(|light| format!("{light} in height fog")));
        all.extend(
            missing(translucent).into_iter().map(|light| format!("{light} dimmed by translucent occluders")),
        );
        all.extend(missing(maps));
        all.extend(missing(cameras));
        all.extend(missing(extinctions));
        all.extend(missing(phases));
        let further = [
            (!phase_sums, "media of several scattering components".to_string()),
            (!endless_rays, "rays without end".to_string()),
            (sun_g < 1.0, format!("suns in media with |g| > {sun_g}")),
            (lamp_g < 1.0, format!("lamps in media with |g| > {lamp_g}")),
        ];
        all.extend(further.into_iter().filter(|(refused, _)| *refused).map(|(_, phrase)| phrase));
        all
    }
}

impl Limits {
    fn describe(&self, of: &Capabilities) -> String {
        let &Self { sun_g, lamp_g, cascades, layer_texels } = self;
        let mut parts = Vec::new();
        if sun_g < 1.0 {
            parts.push(format!("|g| ≤ {sun_g} under a sun"));
        }
        if lamp_g < 1.0 {
            parts.push(format!("|g| ≤ {lamp_g} around a lamp"));
        }
        if of.maps.contains(&MapKind::Cascades) {
            parts.push(format!("{cascades} cascades"));
        }
        if layer_texels < u64::MAX {
            parts.push(format!("{layer_texels} texels a layer"));
        }
        parts.join(", ")
    }
}

impl fmt::Display for Capabilities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, (name, values)) in self.describe().iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{name}: {values}")?;
        }
        Ok(())
    }
}

fn among<K: Kind>(accepted: &[K], needed: K) -> Result<(), Unsupported> {
    refuse_if(!accepted.contains(&needed), || {
        let phrases: Vec<_> = accepted.iter().map(|kind| kind.phrase()).collect();
        format!("{}; give {}", needed.phrase(), either(&phrases))
    })
}

/// What to give instead of a feature that only `lights` may have.
fn without_or(lights: &[LightKind], without: &str) -> String {
    if lights.is_empty() {
        return without.into();
    }
    let phrases: Vec<_> = lights.iter().map(|kind| kind.phrase()).collect();
    format!("give it without, or {}", either(&phrases))
}

fn refuse_if(refused: bool, reason: impl FnOnce() -> String) -> Result<(), Unsupported> {
    if refused { Err(Unsupported { reason: reason().into() }) } else { Ok(()) }
}

fn missing<K: Kind>(accepted: &[K]) -> Vec<String> {
    K::ALL.iter().filter(|kind| !accepted.contains(kind)).map(|kind| kind.phrase().into()).collect()
}

#[cfg(test)]
mod tests;
