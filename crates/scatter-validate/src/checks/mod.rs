//! The rules of the house that every technique keeps, as checks that know it through its trait alone.
//!
//! `cargo xtask stress` runs them for every technique; the workspace's tests run them too, and prove with broken
//! techniques that each can fail.

pub mod allocation;
pub mod counting_allocator;
pub mod finite;
pub mod refusal;
pub mod state;
pub mod threads;

use scatter_core::{ModelError, Phase, RenderError, ScatterImage, Scattering, SceneFacts, VolumetricShadow};

use crate::contender::Contender;
use crate::scenario::{Glass, MapFrame, MapLayer, Scenario, Shadow, texels_of};
use crate::stress::cell::Cell;
use crate::stress::scenes;

/// A rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HouseRule {
    /// No NaN, no infinity, nothing negative, ever.
    Finite,
    /// The same bits for 1, 2 and 3 threads.
    Threads,
    /// The second frame of the same size allocates nothing.
    SecondFrame,
    /// No frame leaves a trace in the next one.
    NoStaleState,
    /// What is not supported is said before any work; what is supported is done.
    Refusal,
}

impl HouseRule {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Finite, Self::Threads, Self::SecondFrame, Self::NoStaleState, Self::Refusal];

    /// What it asks for.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finite => "no NaN, no infinity, nothing negative",
            Self::Threads => "same bits for 1, 2 and 3 threads",
            Self::SecondFrame => "second frame allocates nothing",
            Self::NoStaleState => "no frame leaves a trace in the next",
            Self::Refusal => "unsupported is said before any work",
        }
    }

    /// Runs it on [`house_scenes`].
    pub fn run(self, contender: &Contender<'_>) -> Cell {
        let outcome = match self {
            Self::Finite => finite::check(contender),
            Self::Threads => threads::check(contender),
            Self::SecondFrame => allocation::check(contender),
            Self::NoStaleState => state::check(contender),
            Self::Refusal => refusal::check(contender),
        };
        match outcome {
            Ok(()) => Cell::Ok { error: 0.0 },
            Err(Broken::Rule(what)) => Cell::fault(what),
            Err(Broken::NotRun(why)) => Cell::NotRun(why),
            Err(Broken::Scene(error)) => Cell::fault(format!("a scene of ours is refused: {error}")),
        }
    }
}

/// Why a rule does not hold.
#[derive(Debug, Clone, PartialEq)]
pub enum Broken {
    /// It is broken: where and how.
    Rule(String),
    /// It cannot be tried in this program.
    NotRun(String),
    /// The model refuses a scene of the check.
    Scene(ModelError),
}

impl From<ModelError> for Broken {
    fn from(error: ModelError) -> Self {
        Self::Scene(error)
    }
}

/// Scenes that between them have every kind of light, map, medium and camera. More rows than a band of 32 and columns
/// than a packet, so that threads share an image.
pub fn house_scenes() -> Result<Vec<(&'static str, Scenario)>, ModelError> {
    let size = [21, 37];
    let mut scenes = Vec::new();
    for (name, scene) in scenes::SCENES {
        scenes.push((name, scene()?.seen_by(scenes::camera(size)?)));
    }
    let mut coloured = scenes::sun()?.seen_by(scenes::camera(size)?);
    coloured.glass = Some(coloured_glass());
    coloured.medium = scatter_core::Medium::new(
        vec![
            Scattering { sigma_s: [0.02, 0.04, 0.09], phase: Phase::Rayleigh },
            Scattering { sigma_s: [0.03; 3], phase: Phase::henyey_greenstein(0.76)? },
        ],
        [0.01, 0.0, 0.02],
    )?;
    scenes.push(("sun through coloured glass, two components", coloured));
    scenes.push(("cascades", cascades()?.seen_by(scenes::camera(size)?)));
    scenes.push(("height fog", scenes[0].1.clone().in_fog(glam::DVec3::Y, 0.5, 1.5)?));
    scenes.push(("a lamp in height fog", scenes[1].1.clone().in_fog(glam::DVec3::Y, 0.5, 1.5)?));
    scenes.push(("nothing casts a shadow", Scenario { shadow: Shadow::None, ..scenes[0].1.clone() }));
    let parallel = scatter_core::Camera::orthographic(
        scenes::EYE.to_array(),
        scenes::TARGET.to_array(),
        [0.0, 1.0, 0.0],
        4.0,
        size,
    )?;
    scenes.push(("orthographic camera", scenes::sun()?.seen_by(parallel)));
    Ok(scenes)
}

/// Glass of 5 × 3 colours over a part of the sun's map.
pub fn coloured_glass() -> Glass {
    let frame = MapFrame {
        size: [5, 3],
        half: [3.1, 2.3],
        ..scenes::sun_frame(scenes::SUN, scenes::TARGET, [3.1, 2.3], [5, 3])
    };
    let texels = texels_of([5, 3], |i, j| [0.3 + 0.1 * i as f32, 0.5 * j as f32, 1.7]);
    Glass { frame, texels }
}

/// The lamp's scene with glass of 5 × 5 colours before the lamp, towards the middle of the view and narrower than a spot's
/// cone: seen from the lamp, so that its texels grow with the distance.
pub fn behind_lamp_glass(scene: Scenario) -> Scenario {
    let Some(lamp) = scene.light.position() else { return scene };
    let frame = MapFrame::along(lamp, scenes::TARGET - lamp, [0.43; 2], [5; 2], true);
    let texels = texels_of([5; 2], |i, j| [0.3 + 0.1 * i as f32, 0.4 * j as f32, 1.7]);
    Scenario { glass: Some(Glass { frame, texels }), ..scene }
}

/// The sun's scene with its map as the second of three cascades.
pub fn cascades() -> Result<Scenario, ModelError> {
    let mut scenario = scenes::sun()?;
    let cascade = |half: [f64; 2], size: [u32; 2], lift: f32| {
        let frame = scenes::sun_frame(scenes::SUN, scenes::TARGET, half, size);
        MapLayer::filled(
            frame,
            |i, j| if (i * 3 + j) % 5 < 2 { f32::INFINITY } else { 18.0 + lift * (j as f32) },
        )
    };
    scenario.shadow = Shadow::Parallel(vec![
        cascade([2.1, 1.7], [9, 11], 0.3),
        cascade([4.3, 4.9], [13, 7], 0.5),
        cascade([8.9, 9.7], [11, 15], 0.2),
    ]);
    Ok(scenario)
}

/// A new instance for a scene; `None` where it is not supported.
fn instance_for(
    contender: &Contender<'_>,
    scene: &Scenario,
) -> Result<Option<Box<dyn VolumetricShadow>>, Broken> {
    scene.with_frame(|frame| match contender.instance(&SceneFacts::of(frame)) {
        Err(error) => Err(Broken::Rule(format!("cannot be configured: {error}"))),
        Ok(instance) => Ok(instance.supports(frame).is_ok().then_some(instance)),
    })?
}

/// The image of a scene.
fn rendered(
    instance: &mut dyn VolumetricShadow,
    scene: &Scenario,
    image: &mut ScatterImage,
) -> Result<(), Broken> {
    let outcome: Result<_, RenderError> = scene.with_frame(|frame| instance.render(frame, image))?;
    outcome
        .map(|_| ())
        .map_err(|error| Broken::Rule(format!("supports() says yes and render() fails: {error}")))
}

/// The first value that differs between two images: where and by what.
fn first_difference(a: &ScatterImage, b: &ScatterImage) -> Option<String> {
    if a.size() != b.size() {
        return Some(format!("sizes {:?} and {:?}", a.size(), b.size()));
    }
    let width = a.size()[0] as usize;
    for (what, a, b) in [
        ("radiance", a.inscattered(), b.inscattered()),
        ("transmittance", a.transmittance(), b.transmittance()),
    ] {
        let values = a.iter().flatten().zip(b.iter().flatten()).enumerate();
        // Bits, not values: −0 is not 0, and a NaN equals itself.
        if let Some((index, (a, b))) = values.into_iter().find(|(_, (a, b))| a.to_bits() != b.to_bits()) {
            let pixel = index / 3;
            return Some(format!("{what} at pixel ({}, {}): {a:e} and {b:e}", pixel % width, pixel / width));
        }
    }
    None
}
