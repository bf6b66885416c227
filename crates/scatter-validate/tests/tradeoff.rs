//! Sweep and motion judged by techniques whose error is known: shadow-map truth, made brighter by a factor.

use raymarch_ref::ShadowMapWalk;
use scatter_core::{
    Camera, Capabilities, Estimate, Frame, Light, Medium, NoEstimate, OptionError, Outlook, Phase,
    RenderError, RenderStats, ScatterImage, SceneFacts, Target, Technique, TechniqueInfo, Unsupported,
    VolumetricShadow,
};
use scatter_scene::{Scene, Shot, ShotLight};
use scatter_validate::tradeoff::{Limits, Motion, MotionRow, Rung, ShotTrade, Sweep, level_rows};
use scatter_validate::{Settings, Verdict};

/// What is wrong with the image.
#[derive(Debug, Clone, Copy)]
enum Fault {
    /// Every pixel is brighter by this fraction.
    Factor(f32),
    /// The same, with a sign that changes from frame to frame.
    Alternating(f32),
    /// One value is no number.
    NotANumber,
    /// Nothing is rendered at all.
    Refuses,
}

struct Faulty {
    id: &'static str,
    fault: Fault,
    walk: ShadowMapWalk,
    frame: u32,
}

impl VolumetricShadow for Faulty {
    fn id(&self) -> &'static str {
        self.id
    }

    fn capabilities(&self) -> Capabilities {
        self.walk.capabilities()
    }

    fn supports(&self, _: &Frame<'_>) -> Result<(), Unsupported> {
        match self.fault {
            Fault::Refuses => Err(Unsupported { reason: "on strike".into() }),
            _ => Ok(()),
        }
    }

    fn render(&mut self, frame: &Frame<'_>, out: &mut ScatterImage) -> Result<RenderStats, RenderError> {
        let stats = self.walk.render(frame, out)?;
        let sign = if self.frame.is_multiple_of(2) { 1.0 } else { -1.0 };
        self.frame += 1;
        let (pixels, _) = out.pixels_mut();
        match self.fault {
            Fault::Factor(error) => pixels.iter_mut().flatten().for_each(|value| *value *= 1.0 + error),
            Fault::Alternating(error) => {
                pixels.iter_mut().flatten().for_each(|value| *value *= 1.0 + sign * error)
            }
            Fault::NotANumber => pixels[7][1] = f32::NAN,
            Fault::Refuses => {}
        }
        Ok(stats)
    }
}

/// Promises of 5 % and more, levels at half of their error, and a ladder that ends in a needless rung.
struct Known {
    info: TechniqueInfo,
    fault: Option<Fault>,
}

const fn info(id: &'static str) -> TechniqueInfo {
    TechniqueInfo::of_reference(id, "", ShadowMapWalk::CAPABILITIES)
}

static KNOWN: Known = Known { info: info("known"), fault: None };
static BROKEN: Known = Known { info: info("broken"), fault: Some(Fault::NotANumber) };
static IDLE: Known = Known { info: info("idle"), fault: Some(Fault::Refuses) };
static STEADY: Known = Known { info: info("steady"), fault: Some(Fault::Factor(0.125)) };
static JITTERY: Known = Known { info: info("jittery"), fault: Some(Fault::Alternating(0.125)) };

impl Technique for Known {
    fn info(&self) -> &'static TechniqueInfo {
        match self.info.id {
            "known" => &KNOWN.info,
            "broken" => &BROKEN.info,
            "idle" => &IDLE.info,
            "steady" => &STEADY.info,
            _ => &JITTERY.info,
        }
    }

    fn configure(
        &self,
        target: Target,
        overrides: &[(&str, &str)],
        _: &SceneFacts,
    ) -> Result<Box<dyn VolumetricShadow>, OptionError> {
        let refused = || OptionError::BadValue {
            technique: "known",
            key: "error",
            value: String::new(),
            range: String::new(),
        };
        let by_hand = overrides.iter().find_map(|(_, value)| value.parse::<f32>().ok());
        let error = match (by_hand, target) {
            (Some(error), _) => error,
            (None, Target::Quality(level)) => 0.5 * level.error() as f32,
            (None, Target::Error(error)) if error >= 0.05 => error as f32,
            (None, Target::Error(_)) => return Err(refused()),
        };
        let fault = self.fault.unwrap_or(Fault::Factor(error));
        Ok(Box::new(Faulty { id: self.info.id, fault, walk: ShadowMapWalk::new(), frame: 0 }))
    }

    fn resolved(
        &self,
        _: Target,
        _: &[(&str, &str)],
        _: &SceneFacts,
    ) -> Result<Vec<(&'static str, String)>, OptionError> {
        Ok(Vec::new())
    }

    fn ladder(&self) -> Vec<Vec<(&'static str, String)>> {
        ["0.3", "0.05", "0.0007", "0.0003"].map(|error| vec![("error", error.to_string())]).to_vec()
    }

    fn estimate(&self, _: Target, _: &[(&str, &str)], _: &Outlook<'_>) -> Result<Estimate, NoEstimate> {
        Err(NoEstimate::because("a test"))
    }
}

/// A sun, with or without a blind of slats before it: 9 × 7 pixels.
fn shot(slats: u32) -> Shot {
    let mut scene = Scene::default();
    for slat in 0..slats {
        let x = f64::from(slat) - 0.5 * f64::from(slats);
        let corners = [[x, -9.0], [x + 0.5, -9.0], [x + 0.5, 9.0], [x, 9.0]];
        let first = scene.positions.len() as u32;
        scene.positions.extend(corners.map(|[x, z]| glam::DVec3::new(x, 4.0, z)));
        scene.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    let light = Light::directional([0.3, -1.0, 0.2], [3.0, 2.0, 1.0]).unwrap();
    Shot {
        name: "blind".into(),
        camera: Camera::perspective([0.2, 1.0, 6.0], [0.0, 1.5, 0.0], [0.0, 1.0, 0.0], 50.0, [9, 7]).unwrap(),
        lights: vec![ShotLight { light, texture: None }],
        medium: Medium::homogeneous([0.05; 3], [0.01; 3], Phase::Isotropic).unwrap(),
        max_distance: 12.0,
        scene,
        notes: Vec::new(),
    }
}

fn settings() -> Settings {
    Settings {
        quality: Default::default(),
        overrides: Vec::new(),
        resolution: 64.into(),
        raster: None,
        repeat: 2,
        threads: 2,
    }
}

fn sweep(techniques: Vec<&dyn Technique>) -> ShotTrade {
    let sweep = Sweep { techniques, baseline: None, settings: settings(), limits: Limits::default() };
    sweep.run(shot(9), &mut |_| {}).unwrap()
}

fn motion(techniques: Vec<&dyn Technique>, slats: u32) -> Vec<MotionRow> {
    let motion = Motion { techniques, baseline: None, settings: settings(), frames: 6, map_row: true };
    motion.run(shot(slats), &mut |_| {}).unwrap()
}

#[test]
fn every_setting_is_one_rung_with_its_error_whatever_it_is_called() {
    let trade = sweep(vec![&KNOWN]);
    let settings: Vec<String> = trade.rungs.iter().map(|rung| rung.setting.join(", ")).collect();
    // 0.0003 is finer than anybody needs after 0.0007, and 2.5 % is not promised.
    let expected =
        ["preview, error 5 %, error=0.05", "game", "film", "error 10 %", "error=0.3", "error=0.0007"];
    assert_eq!(settings, expected);
    for (rung, error) in trade.rungs.iter().zip([0.05, 0.015, 0.005, 0.1, 0.3, 0.0007]) {
        let figures = rung.row.errors.shadow_map.unwrap();
        // Every value is off by the factor, so that every percentile is; half an f32 ulp of 1 in 7e-4 is 1e-4.
        assert!((figures.p99 / error - 1.0).abs() < 2e-4, "{error}: {figures:?}");
        assert!((figures.bias / error - 1.0).abs() < 2e-4, "{error}: {figures:?}");
        assert!(rung.one_thread_ms() > 0.0 && rung.row.total_ms() > 0.0 && rung.row.errors.raycast.is_some());
    }
}

#[test]
fn a_level_is_reached_by_whatever_setting_is_within_it() {
    let trade = sweep(vec![&KNOWN]);
    let reached: Vec<bool> = level_rows(&trade).iter().map(|row| row.reached.is_some()).collect();
    assert_eq!(reached, [true; 3]);
    let levels: Vec<&str> = trade.rungs.iter().map(|rung| rung.row.level.as_deref().unwrap_or("-")).collect();
    // The relative RMSE of a factor is above it: pixels differ. 10 % is no preview then.
    assert_eq!(levels, ["preview", "game", "film", "-", "-", "film"]);
    assert!(trade.rungs.iter().all(|rung| rung.row.verdict == Some(Verdict::Ok)));
}

#[test]
fn a_nan_fails_and_is_on_no_front_and_what_is_unsupported_says_why() {
    let trade = sweep(vec![&BROKEN, &IDLE, &KNOWN]);
    let of =
        |method: &str| trade.rungs.iter().filter(|rung| rung.row.method == method).collect::<Vec<&Rung>>();
    let broken = of("broken");
    assert_eq!(broken.len(), 1, "all settings do the same");
    assert!(broken[0].row.has_failed() && !broken[0].front && broken[0].row.level.is_none());
    let idle = of("idle");
    assert_eq!(idle.len(), 1);
    assert_eq!(idle[0].row.verdict, Some(Verdict::Unsupported("on strike".into())));
    assert!(!idle[0].is_measured() && !idle[0].front);
    let why = level_rows(&trade).into_iter().find(|row| row.method == "idle").unwrap().unsupported;
    assert_eq!(why.as_deref(), Some("unsupported: on strike"));
    assert!(of("known").iter().any(|rung| rung.front));
}

#[test]
fn an_error_in_proportion_to_the_truth_flickers_as_the_truth_does() {
    let rows = motion(vec![&STEADY], 9);
    let row = &rows[1];
    // 0.125 is a power of two: the error image is an exact eighth of the truth, but for the rounding of 9/8 of it.
    assert!(row.truth_flicker > 0.001, "shafts move: {row:?}");
    assert!((row.flicker / (0.125 * row.truth_flicker) - 1.0).abs() < 1e-3, "{row:?}");
    assert!(rows[0].flicker > 0.0, "the shadow map's own error moves as well: {:?}", rows[0]);
}

#[test]
fn without_shafts_a_constant_error_does_not_flicker_and_an_alternating_one_is_four_times_its_size() {
    let rows = motion(vec![&STEADY, &JITTERY, &IDLE], 0);
    // Every ray is as long and as bright, in every frame: what is left is the rounding of an f32.
    let ulps = 4.0 * f64::from(f32::EPSILON);
    assert!(rows[1].flicker <= ulps && rows[1].truth_flicker <= ulps, "{:?}", rows[1]);
    // Relative to the mean of three channels 3, 2 and 1: their RMS is sqrt(14/3), their mean 2.
    let expected = 4.0 * 0.125 * (14.0f64 / 3.0).sqrt() / 2.0;
    assert!((rows[2].flicker / expected - 1.0).abs() < 1e-5, "{} {expected}", rows[2].flicker);
    assert_eq!(rows[3].unsupported.as_deref(), Some("on strike"));
}
