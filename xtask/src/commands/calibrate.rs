//! `calibrate`: how fast this machine runs each technique, beside what the built-in constants say.

use std::time::Instant;

use scatter::{
    Frame, Machine, Outlook, Quality, ScatterImage, SceneFacts, SceneSample, TECHNIQUES, Target, Technique,
    TechniqueSpeed,
};
use scatter_validate::StagedShot;
use scatter_validate::staged_shot::resized;

use crate::Verdict;
use crate::flags::Calibrate;
use crate::machine_file::{default_path, write};
use crate::output::{print, stderr_line};
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::shot;

/// Small shots of four kinds: a hall, foliage, open land, a lamp. More of them change the median by less than what a second run
/// does.
const SHOTS: [&str; 4] = ["arcade", "grove", "valley", "lamp"];
const SIZE: [u32; 2] = [320, 240];
const MAP_SIDE: u32 = 1024;
/// A technique's frame is timed this often: the fastest counts, since whatever else runs on a machine only slows it down.
const RUNS: usize = 3;

/// Measures, prints, writes.
pub fn run(flags: &Calibrate) -> anyhow::Result<Verdict> {
    let path = match &flags.machine {
        Some(path) => path.clone(),
        None => default_path()?,
    };
    let cores = std::thread::available_parallelism().map_or(1, |count| count.get() as u32);
    let progress = Progress::new(Some(SHOTS.len() as u64));
    let mut ratios = vec![[Vec::new(), Vec::new()]; TECHNIQUES.len()];
    for name in SHOTS {
        progress.stage(&format!("{name}: maps"));
        let mut shot = shot(name)?.load()?;
        shot.camera = resized(&shot.camera, SIZE)?;
        let staged = StagedShot::new(shot, MAP_SIDE)?;
        for (threads, which) in [(1, 0), (cores.min(2), 1)] {
            progress.stage(&format!("{name}: {threads} thread(s)"));
            in_pool(Some(threads), |_| {
                staged.with_frame(0, staged.camera(), |frame| {
                    let machine = Machine::built_in().with_threads(1);
                    let sample = SceneSample::of(frame);
                    let outlook = Outlook { frame, sample: &sample, machine: &machine };
                    for (technique, ratios) in TECHNIQUES.iter().zip(&mut ratios) {
                        ratios[which].extend(ratio(*technique, &outlook));
                    }
                })
            })??;
        }
        progress.step();
    }
    drop(progress);
    let mut speeds = Vec::new();
    for (technique, [one, two]) in TECHNIQUES.iter().zip(&mut ratios) {
        let (Some(slowness), Some(of_two)) = (median(one), median(two)) else { continue };
        let gain = (slowness / of_two - 1.0).clamp(0.0, 1.0);
        let thread_gain = (cores > 1).then_some(gain);
        speeds.push(TechniqueSpeed { id: technique.info().id.to_string(), slowness, thread_gain });
    }
    let machine = Machine::measured(scatter_validate::Machine::this().to_string().trim(), speeds);
    write(&path, &machine)?;
    print(&format!("{}\n", machine.name()))?;
    for speed in machine.speeds() {
        let gain =
            speed.thread_gain.map_or(String::new(), |gain| format!(", a second thread adds {gain:.2}"));
        print(&format!(
            "  {:<16} {:.2} times the built-in machine's time{gain}\n",
            speed.id, speed.slowness
        ))?;
    }
    stderr_line(&format!("written to {}", path.display()));
    Ok(Verdict::Well)
}

/// A technique's time over what is predicted, where both are known.
fn ratio(technique: &dyn Technique, outlook: &Outlook<'_>) -> Option<f64> {
    let target = Target::Quality(Quality::Preview);
    let predicted = technique.estimate(target, &[], outlook).ok()?.time_ms;
    let time = fastest(technique, target, outlook.frame, &outlook.sample.facts)?;
    (predicted > 0.0).then_some(time / predicted)
}

fn fastest(technique: &dyn Technique, target: Target, frame: &Frame<'_>, facts: &SceneFacts) -> Option<f64> {
    let mut instance = technique.configure(target, &[], facts).ok()?;
    instance.supports(frame).ok()?;
    let mut out = ScatterImage::new();
    instance.render(frame, &mut out).ok()?;
    let mut fastest = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        instance.render(frame, &mut out).ok()?;
        fastest = fastest.min(start.elapsed().as_secs_f64() * 1e3);
    }
    Some(fastest)
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().saturating_sub(1) / 2).copied()
}
