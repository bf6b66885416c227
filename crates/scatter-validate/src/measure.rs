//! Runs one technique on one staged shot: the image, the time in the middle of several runs, what it counted.
//!
//! The image is that of the shot's own camera. Timed frames differ from it and from each other, the camera moving by
//! a pixel ([`StagedShot::with_timed_frame`]), so that nothing is gained by keeping answers. Several lights are several
//! passes that add up.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::time::Instant;

use scatter_core::{
    OptionError, RenderError, RenderStats, ScatterImage, Target, Technique, Unsupported, VolumetricShadow,
};
use scatter_scene::RadianceImage;

use crate::staged_shot::{StageError, StagedShot};

/// What renders: one instance a light, or one for all.
pub enum Renderer<'a> {
    /// A configured technique, an instance for each light's facts.
    PerLight(Vec<Box<dyn VolumetricShadow>>),
    /// A reference.
    Shared(&'a mut dyn VolumetricShadow),
}

/// What a run gave.
#[derive(Debug, Clone)]
pub struct Measurement {
    /// What made the image: a technique's id, or what another program's image is called.
    pub method: String,
    /// In-scattered radiance, all lights together.
    pub image: RadianceImage,
    /// Wall-clock `total` and each stage \[ms\] of the run in the middle; what moved maps to a card and the image back is no part of
    /// the total ([`RenderStats::transfer`]).
    pub time_ms: BTreeMap<String, f64>,
    /// Bytes held between frames, all lights together.
    pub memory_bytes: u64,
    /// Machine-independent counts, all lights together.
    pub counts: BTreeMap<String, u64>,
    /// What was modelled for any light.
    pub modelled: Vec<String>,
}

impl Measurement {
    /// Time of the technique alone \[ms\], if it was run.
    pub fn total_ms(&self) -> Option<f64> {
        self.time_ms.get("total").copied()
    }

    /// What stands in a row that was not run: no time, no image.
    pub(crate) fn nothing(method: &str, size: [u32; 2]) -> Self {
        Self {
            method: method.to_string(),
            image: RadianceImage { size, pixels: Vec::new() },
            time_ms: BTreeMap::new(),
            memory_bytes: 0,
            counts: BTreeMap::new(),
            modelled: Vec::new(),
        }
    }
}

/// A measurement, or the assumption that the shot breaks.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// It ran.
    Measured(Box<Measurement>),
    /// It said beforehand that it cannot.
    Unsupported(Unsupported),
}

impl Renderer<'_> {
    /// A technique configured for a target error, an instance for each light of the shot.
    pub fn configured(
        technique: &dyn Technique,
        target: Target,
        overrides: &[(&str, &str)],
        shot: &StagedShot,
    ) -> Result<Result<Self, OptionError>, StageError> {
        let instances: Result<Vec<_>, _> =
            shot.facts()?.iter().map(|facts| technique.configure(target, overrides, facts)).collect();
        Ok(instances.map(Self::PerLight))
    }

    /// The values of all options that [`Self::configured`] gives its instances. Where lights have different ones, all of
    /// them in the order of the lights, with ` / ` between them.
    pub fn resolved(
        technique: &dyn Technique,
        target: Target,
        overrides: &[(&str, &str)],
        shot: &StagedShot,
    ) -> Result<Result<BTreeMap<String, String>, OptionError>, StageError> {
        let of_lights: Result<Vec<_>, _> =
            shot.facts()?.iter().map(|facts| technique.resolved(target, overrides, facts)).collect();
        Ok(of_lights.map(|of_lights| {
            let mut values = BTreeMap::<String, Vec<String>>::new();
            for (key, value) in of_lights.into_iter().flatten() {
                values.entry(key.to_string()).or_default().push(value);
            }
            let joined = |values: Vec<String>| match values.split_first() {
                Some((first, others)) if others.iter().all(|other| other == first) => first.clone(),
                _ => values.join(" / "),
            };
            values.into_iter().map(|(key, values)| (key, joined(values))).collect()
        }))
    }

    /// Whether every light's frame of a shot is rendered.
    pub(crate) fn supports(&mut self, shot: &StagedShot) -> Result<Result<(), Unsupported>, StageError> {
        for index in 0..shot.light_count() {
            let supported =
                shot.with_frame(index, shot.camera(), |frame| self.of_light(index).supports(frame))?;
            if supported.is_err() {
                return Ok(supported);
            }
        }
        Ok(Ok(()))
    }

    /// The id of what renders.
    fn id(&self) -> &'static str {
        match self {
            Self::PerLight(instances) => instances.first().map_or("", |instance| instance.id()),
            Self::Shared(reference) => reference.id(),
        }
    }

    fn of_light(&mut self, index: usize) -> &mut dyn VolumetricShadow {
        match self {
            Self::PerLight(instances) => instances[index].as_mut(),
            Self::Shared(reference) => *reference,
        }
    }
}

/// Renders the shot once, and with `repeat` > 1 another `repeat` times for the time (the first run warms up).
pub fn measure(shot: &StagedShot, renderer: &mut Renderer<'_>, repeat: u32) -> Result<Outcome, StageError> {
    if let Err(unsupported) = renderer.supports(shot)? {
        return Ok(Outcome::Unsupported(unsupported));
    }
    let mut out = ScatterImage::new();
    let first = run(shot, renderer, 0, &mut out)?;
    let image = RadianceImage { size: out.size(), pixels: out.inscattered().to_vec() };
    let Run { time_ms, memory_bytes, counts, modelled } = first;
    let time_ms = if repeat > 1 { timed(shot, renderer, 1..=repeat, &mut out)? } else { time_ms };
    let method = renderer.id().to_string();
    let measurement = Measurement { method, image, time_ms, memory_bytes, counts, modelled };
    Ok(Outcome::Measured(Box::new(measurement)))
}

/// Wall-clock `total` and each stage \[ms\] of the run in the middle, over the frames with these numbers (frame n is
/// seen by the shot's camera moved by n pixels, and so is its depth map; `out` holds the last one). What renders should
/// be warm: [`measure`] leaves it so.
pub fn timed(
    shot: &StagedShot,
    renderer: &mut Renderer<'_>,
    frames: RangeInclusive<u32>,
    out: &mut ScatterImage,
) -> Result<BTreeMap<String, f64>, StageError> {
    let runs = frames.map(|frame| run(shot, renderer, frame, out)).collect::<Result<Vec<_>, _>>()?;
    Ok(middle(runs).time_ms)
}

/// All passes of one frame.
#[derive(Debug, Clone, Default)]
struct Run {
    time_ms: BTreeMap<String, f64>,
    memory_bytes: u64,
    counts: BTreeMap<String, u64>,
    modelled: Vec<String>,
}

/// Renders frame number `frame` (0 is the shot's own) and leaves the sum of all lights in `out`.
fn run(
    shot: &StagedShot,
    renderer: &mut Renderer<'_>,
    frame: u32,
    out: &mut ScatterImage,
) -> Result<Run, StageError> {
    let mut run = Run::default();
    let mut pass = ScatterImage::new();
    for index in 0..shot.light_count() {
        let technique = renderer.of_light(index);
        let method = technique.id();
        // The first light renders into `out` itself: with one light nothing is copied or allocated.
        let target = if index == 0 { &mut *out } else { &mut pass };
        let result = shot.with_timed_frame(index, frame, |frame| {
            let start = Instant::now();
            technique
                .render(frame, target)
                .map(|stats| (stats, start.elapsed().saturating_sub(stats.transfer).as_secs_f64() * 1e3))
        })?;
        let wrong = |source| StageError::Render { shot: shot.name().to_string(), method, source };
        let (stats, total) = result.map_err(wrong)?;
        run.add(&stats, total);
        if index > 0 {
            let mismatch = |error: scatter_core::ModelError| wrong(RenderError::Map(error.into()));
            out.add(&pass).map_err(mismatch)?;
        }
    }
    Ok(run)
}

impl Run {
    fn add(&mut self, stats: &RenderStats, total: f64) {
        *self.time_ms.entry("total".into()).or_default() += total;
        for (stage, time) in stats.stages.iter() {
            *self.time_ms.entry(stage.into()).or_default() += time.as_secs_f64() * 1e3;
        }
        for (name, count) in stats.counts.iter() {
            *self.counts.entry(name.into()).or_default() += count;
        }
        for (name, ()) in stats.modelled.iter() {
            if !self.modelled.iter().any(|known| known == name) {
                self.modelled.push(name.into());
            }
        }
        self.memory_bytes += stats.memory_bytes;
    }

    fn total(&self) -> f64 {
        self.time_ms.get("total").copied().unwrap_or_default()
    }
}

/// The run whose total is the median; of an even number the faster one of the two in the middle.
fn middle(mut runs: Vec<Run>) -> Run {
    runs.sort_by(|a, b| a.total().total_cmp(&b.total()));
    let index = runs.len().saturating_sub(1) / 2;
    runs.into_iter().nth(index).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_is_that_of_the_run_in_the_middle() {
        let run = |total: f64| Run { time_ms: BTreeMap::from([("total".into(), total)]), ..Run::default() };
        let of = |totals: &[f64]| middle(totals.iter().map(|&t| run(t)).collect()).total();
        assert_eq!(of(&[9.0, 1.0, 2.0]), 2.0);
        assert_eq!(of(&[9.0, 1.0, 2.0, 3.0]), 2.0);
        assert_eq!(of(&[7.0]), 7.0);
    }

    #[test]
    fn stages_and_counts_of_several_lights_add_up() {
        let mut stats = RenderStats::default();
        stats.stages.push("march", std::time::Duration::from_millis(3));
        stats.counts.push("fetches", 5);
        stats.modelled.push("phase", ());
        stats.memory_bytes = 10;
        let mut run = Run::default();
        run.add(&stats, 4.0);
        run.add(&stats, 6.0);
        assert_eq!((run.total(), run.time_ms["march"]), (10.0, 6.0));
        assert_eq!((run.counts["fetches"], run.memory_bytes), (10, 20));
        assert_eq!(run.modelled, ["phase"]);
    }
}
