//! What each kind costs on the same captured segments, as the paper's Table 1, in ratios; the streaming path, its memory, and
//! what a second thread gives.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use scatter::avsm::{Avsm, CurveMaps, DepthRange, Nodes, Options, TranslucentSegment, TransmittanceCurve};
use scatter_core::{Frame, RenderError, ScatterImage, Translucent, TranslucentCapture, VolumetricShadow};
use scatter_validate::StagedShot;

use crate::kinds::{self, Visit};
use crate::segments::{SHOTS, Texels, captured, staged};

/// Texels along the longer side of the curve maps: the technique's default.
const SIDE: u32 = 256;
/// Depths that are looked up in each texel.
const LOOKUPS: u32 = 16;
/// Median of so many runs.
const RUNS: usize = 3;

/// Prints the tables; all times are of one thread, but for those of two.
pub fn print() -> Result<(), Box<dyn Error>> {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let (one, two) = (pool(1)?, pool(2)?);
    for name in SHOTS {
        let shot = staged(name)?;
        let texels = one.install(|| captured(&shot, SIDE).map_err(|error| error.to_string()))?;
        let segments: usize = texels.lists.iter().map(Vec::len).sum();
        println!("\n{name}: {} texels with {segments} segments", texels.lists.len());
        let sort = median(|| {
            let mut lists = texels.lists.clone();
            let start = Instant::now();
            lists.iter_mut().for_each(|list| list.sort_by(|a, b| a.entry.total_cmp(&b.entry)));
            black_box(&lists);
            start.elapsed().as_secs_f64()
        });
        println!("capture {:.1} ms, sort {:.1} ms", 1e3 * texels.capture_seconds, 1e3 * sort);
        let mut table = Table { texels: &texels, rows: Vec::new() };
        kinds::all(&mut table);
        table.print();
        for nodes in [Nodes::Four, Nodes::Eight, Nodes::Sixteen] {
            streaming(&shot, &texels, nodes, &one)?;
        }
        threads(&shot, [&one, &two])?;
    }
    Ok(())
}

fn median(mut run: impl FnMut() -> f64) -> f64 {
    let mut seconds: Vec<f64> = (0..RUNS).map(|_| run()).collect();
    seconds.sort_by(f64::total_cmp);
    seconds[RUNS / 2]
}

struct Table<'a> {
    texels: &'a Texels,
    /// Name, seconds of a build of all texels, and of a lookup.
    rows: Vec<(String, f64, f64)>,
}

impl Visit for Table<'_> {
    fn kind<C: TransmittanceCurve>(&mut self, name: &str, make: impl Fn(DepthRange) -> C) {
        let range = self.texels.range;
        let build = |list: &Vec<TranslucentSegment>| {
            let mut curve = make(range);
            list.iter().for_each(|segment| curve.insert(segment));
            curve.finish();
            curve
        };
        let build_seconds = median(|| {
            let start = Instant::now();
            self.texels.lists.iter().for_each(|list| {
                black_box(build(list));
            });
            start.elapsed().as_secs_f64()
        });
        let curves: Vec<C> = self.texels.lists.iter().map(build).collect();
        // Each lookup in another texel, as rays do: depths by a recurrence that no cache knows.
        let lookup_seconds = median(|| {
            let start = Instant::now();
            let mut sum = 0.0;
            for n in 0..LOOKUPS {
                for (index, curve) in curves.iter().enumerate() {
                    let share = (index as f64 * 0.618_034 + f64::from(n) * 0.414_214).fract();
                    sum += curve.optical_depth(f64::from(range.near) + share * range.length());
                }
            }
            black_box(sum);
            start.elapsed().as_secs_f64() / (curves.len() as f64 * f64::from(LOOKUPS))
        });
        self.rows.push((name.into(), build_seconds, lookup_seconds));
    }
}

impl Table<'_> {
    fn print(&self) {
        let of = |name: &str| self.rows.iter().find(|row| row.0 == name);
        let Some((_, build, lookup)) = of("avsm 8") else { return };
        println!("kind         | build [ms] | of avsm 8's | lookup [ns] | of avsm 8's");
        for (name, own_build, own_lookup) in &self.rows {
            println!(
                "{name:12} | {:10.1} | {:11.2} | {:11.1} | {:.2}",
                1e3 * own_build,
                own_build / build,
                1e9 * own_lookup,
                own_lookup / lookup
            );
        }
    }
}

/// Curves from a source that streams, against those of segments that were captured before.
fn streaming(
    shot: &StagedShot,
    texels: &Texels,
    nodes: Nodes,
    one: &rayon::ThreadPool,
) -> Result<(), Box<dyn Error>> {
    let options = Options { curves: SIDE, nodes, ..Options::default() };
    let mut capture = TranslucentCapture::new();
    let source = shot.caster().occluders().ok_or("no occluders")?;
    let layers = [capture.capture(source, &texels.projection, TranslucentCapture::DEFAULT_LIMIT)?];
    let segments = Translucent::Captured(&layers);
    let seconds = |frame: &Frame<'_>| -> Result<(f64, u64), RenderError> {
        let mut maps = CurveMaps::new();
        maps.build(frame, &options)?;
        let mut failure = None;
        let seconds = median(|| {
            let start = Instant::now();
            failure = maps.build(frame, &options).err();
            start.elapsed().as_secs_f64()
        });
        failure.map_or(Ok((seconds, maps.curve_bytes())), Err)
    };
    let (streamed, from_captured) = shot.with_frame(0, shot.camera(), |frame| {
        one.install(|| {
            let streamed = seconds(frame)?;
            let from_captured = frame.with_translucent(&segments).map_err(scatter_core::MapError::from)?;
            Ok::<_, RenderError>((streamed, seconds(&from_captured)?))
        })
    })??;
    let [width, height] = texels.projection.size();
    let ways = [streamed.0, from_captured.0, from_captured.0 + texels.capture_seconds].map(|s| 1e3 * s);
    println!(
        "{nodes:?}: streamed {:.1} ms; from captured segments {:.1}, with the capture {:.1}; {} bytes of curves in {width}x{height}, \
         {:.1} a texel; segments would take {}",
        ways[0],
        ways[1],
        ways[2],
        streamed.1,
        streamed.1 as f64 / (f64::from(width) * f64::from(height)),
        12 * texels.lists.iter().map(Vec::len).sum::<usize>()
    );
    Ok(())
}

/// A whole frame on one thread and on two.
fn threads(shot: &StagedShot, pools: [&rayon::ThreadPool; 2]) -> Result<(), Box<dyn Error>> {
    let shot_seconds = |pool: &rayon::ThreadPool| -> Result<f64, Box<dyn Error>> {
        let mut technique = Avsm::new(Options::default());
        let mut image = ScatterImage::new();
        let mut failure = None;
        let seconds = shot.with_frame(0, shot.camera(), |frame| {
            pool.install(|| {
                median(|| {
                    let start = Instant::now();
                    failure = technique.render(frame, &mut image).err();
                    start.elapsed().as_secs_f64()
                })
            })
        })?;
        failure.map_or(Ok(seconds), |error| Err(error.into()))
    };
    let [one, two] = [shot_seconds(pools[0])?, shot_seconds(pools[1])?];
    println!("a frame: {:.0} ms on one thread, {:.0} on two: {:.2} times", 1e3 * one, 1e3 * two, one / two);
    Ok(())
}
