//! What `tradeoff` and the report of `validate` share: shots measured one after the other, and the trade of speed for
//! accuracy as a section of a page.

use scatter::Technique;
use scatter_scene::{RasterDevice, Shot};
use scatter_validate::report::TradeSection;
use scatter_validate::tradeoff::charts::trade_plot;
use scatter_validate::tradeoff::tables::{level_table, rung_table};
use scatter_validate::tradeoff::{Limits, ShotTrade, Sweep, level_rows};
use scatter_validate::{JudgeError, Settings};

use crate::flags::Rendering;
use crate::progress::Progress;
use crate::run::in_pool;
use crate::select::{ShotSource, baseline, load, resolution};

/// Longest frame of a setting beyond which finer ones are left out with `--quick` \[ms\].
const QUICK_FRAME_MS: f64 = 150.0;

/// What a sweep is called on a page.
pub const HEADING: &str = "Speed and accuracy: time to each quality level";

/// Techniques on shots.
pub struct Job {
    /// How they are rendered.
    pub rendering: Rendering,
    /// The techniques.
    pub techniques: Vec<&'static dyn Technique>,
    /// The shots.
    pub sources: Vec<ShotSource>,
    /// How techniques are run.
    pub settings: Settings,
}

/// What the tables of settings mean.
pub const RUNGS_MEAN: &str = "Settings: errors against truth-shadow-map, /ray against truth-raycast; level: the finest that \
                          is reached; *: on the Pareto front, no setting of any technique is both faster on one thread \
                          and more exact.";
/// What the table of levels means.
pub const LEVELS_MEAN: &str = "Time to each quality level (p99 and rel_rmse both within it): a technique's cheapest setting \
                           that reaches it, ms on one thread, in brackets the marcher's time at its own cheapest over \
                           it; the map's error: rel_rmse of truth-shadow-map against truth-raycast, below which more \
                           accuracy is of no use.";

/// What the table of winners means.
pub const WINNERS_MEAN: &str = "The fastest technique to each quality level on one thread, at its cheapest setting that reaches it: how many \
                            times the marcher takes at its own cheapest, and the next technique with what it takes more. \
                            Last, on how many shots each technique is the fastest.";

impl Job {
    /// A job with the settings that were asked for; `raster` draws the maps, if there is one.
    pub fn new(
        rendering: Rendering,
        techniques: Vec<&'static dyn Technique>,
        sources: Vec<ShotSource>,
        raster: Option<RasterDevice>,
    ) -> Self {
        let settings = Settings {
            quality: rendering.quality,
            overrides: rendering.set.clone(),
            resolution: resolution(&rendering),
            raster,
            repeat: rendering.repeat,
            threads: 0,
        };
        Self { rendering, techniques, sources, settings }
    }

    /// Every setting of every technique on every shot, and how many threads there were.
    pub fn sweep(&self) -> anyhow::Result<(Vec<ShotTrade>, usize)> {
        let mut limits = Limits::default();
        if self.rendering.quick {
            limits.frame_ms = QUICK_FRAME_MS;
        }
        let techniques = self.techniques.clone();
        self.on_every_shot(|settings, shot, progress| {
            let (techniques, baseline) = (techniques.clone(), baseline());
            Sweep { techniques, baseline, settings, limits }.run(shot, progress)
        })
    }

    /// A sweep as a section of a page.
    pub fn section(&self, trades: &[ShotTrade], threads: usize) -> TradeSection {
        let levels: Vec<_> = trades.iter().flat_map(level_rows).collect();
        TradeSection {
            introduction: format!("{}. {LEVELS_MEAN}", self.heading(threads)),
            plots: trades.iter().map(trade_plot).collect(),
            table: level_table(&levels, &map_errors(trades)),
            meaning_of_details: RUNGS_MEAN.into(),
            details: trades
                .iter()
                .map(|trade| (format!("All settings on {}", trade.shot), rung_table(trade)))
                .collect(),
        }
    }

    /// Loads one shot after the other and measures it, in a pool of the threads that were asked for; with how many
    /// there are.
    pub fn on_every_shot<R: Send>(
        &self,
        measure: impl Fn(Settings, Shot, &mut dyn FnMut(&str)) -> Result<R, JudgeError> + Sync,
    ) -> anyhow::Result<(Vec<R>, usize)> {
        let rendering = &self.rendering;
        let progress = Progress::new(Some(self.sources.len() as u64));
        in_pool(rendering.threads, |threads| {
            let settings = Settings { threads, ..self.settings.clone() };
            let mut results = Vec::new();
            for source in &self.sources {
                progress.stage(&format!("{}: loading", source.label()));
                let shot = load(source, rendering)?;
                results.push(measure(settings.clone(), shot, &mut |stage| progress.stage(stage))?);
                progress.step();
            }
            Ok((results, threads))
        })?
    }

    /// The settings in a line.
    pub fn heading(&self, threads: usize) -> String {
        let rendering = &self.rendering;
        let size = match (rendering.size, rendering.quick) {
            (Some([width, height]), _) => format!("{width}x{height}"),
            (None, true) => "Small images".into(),
            (None, false) => "Images of the shots' own sizes".into(),
        };
        let maps = resolution(rendering);
        let repeat = rendering.repeat;
        format!("{size}, shadow map {maps}, all: {threads} threads, median of {repeat}")
    }
}

/// Each shot with the relative RMSE of its map.
pub fn map_errors(trades: &[ShotTrade]) -> Vec<(String, f64)> {
    trades.iter().map(|trade| (trade.shot.clone(), trade.map_error.rel_rmse)).collect()
}
