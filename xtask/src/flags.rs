//! The command line. Flags mean the same in every command that has them.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use scatter::{MAX_CASCADES, Quality};
use scatter_scene::MAX_SIDE;

/// Try, compare and regression-test volumetric-shadow techniques.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", version, propagate_version = true, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Every technique on every built-in shot, against shadow-map truth and ray-cast truth; exit 1 if one is out of tolerance
    Validate(Validate),
    /// Each technique's settings: time against error, and the time to each quality level beside the marcher's
    Tradeoff(Tradeoff),
    /// One shot, one technique, one image
    Render(Render),
    /// A scene and a budget: the technique to take and its settings, predicted time and error, and why
    Plan(Plan),
    /// This machine's speed, for the planner: a minute, once
    Calibrate(Calibrate),
    /// The error figures of two images: the first is the reference
    Compare(Compare),
    /// The techniques with paper, light kinds, media, what they cannot do, options with range and default
    Methods(Methods),
    /// The built-in shots: what each is there to show, triangles, light, optical depth
    Shots(Shots),
    /// The GPU's shaders: checked by naga (and Dawn, where node has it), written as SPIR-V, HLSL and MSL; exit 1 if one is refused
    #[cfg(feature = "gpu")]
    Shaders(Shaders),
    /// A card's correctness and times: functions, twins and truths first, then each pass at 1080p on three shots; exit 1 if a
    /// number is wrong
    #[cfg(feature = "gpu")]
    GpuReport(GpuReport),
    /// Every technique on every extreme, against closed forms; exit 1 if a number is wrong
    Stress(Stress),
    /// Everything CI checks: format, lints, docs, all tests, a quick validate
    Test,
}

/// Flags of `shaders`.
#[cfg(feature = "gpu")]
#[derive(Debug, Args)]
pub struct Shaders {
    /// Write every module into this folder: assembled WGSL, SPIR-V, HLSL, MSL
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub json: bool,
}

/// `gpu-report`.
#[cfg(feature = "gpu")]
#[derive(Debug, Args)]
pub struct GpuReport {
    /// The card, by a part of its name or its number in --list [default: the best]
    #[arg(long, value_name = "NAME|INDEX")]
    pub gpu_adapter: Option<String>,
    /// Print the cards with their numbers, and nothing else
    #[arg(long)]
    pub list: bool,
    /// Write gpu-report.json and gpu-report.txt into this folder
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the JSON document on stdout, everything else on stderr
    #[arg(long)]
    pub json: bool,
    /// Small images and maps: a check of the command itself, whose times say nothing
    #[arg(long)]
    pub quick: bool,
    /// Timed runs a technique; the median counts
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
}

/// What renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Device {
    /// The techniques themselves.
    #[default]
    Cpu,
    /// Their twins on the GPU.
    Gpu,
}

/// What renders, and on which card.
#[derive(Debug, Clone, Args)]
pub struct DeviceFlags {
    /// What renders: the CPU, or the GPU's twins of the techniques that have one (ids end in @gpu)
    #[arg(long, value_name = "DEVICE", value_enum, default_value_t)]
    pub device: Device,
    /// The card, by a part of its name or its number in `gpu-report --list` [default: the best]
    #[arg(long, value_name = "NAME|INDEX")]
    pub gpu_adapter: Option<String>,
}

/// How a shot is rendered.
#[derive(Debug, Clone, Args)]
pub struct Rendering {
    /// Technique by its id; repeatable where several make sense
    #[arg(long = "method", value_name = "ID")]
    pub methods: Vec<String>,
    #[command(flatten)]
    pub on: DeviceFlags,
    /// Error level from which a technique derives its options: preview, game or film
    #[arg(long, value_name = "LEVEL", default_value_t, value_parser = quality)]
    pub quality: Quality,
    /// One option of the technique, over the level's choice; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Image size in pixels; the shot's own by default
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    #[command(flatten)]
    pub maps: Maps,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Timed runs, after one to warm up; the median counts
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeat: u32,
    /// Print one JSON document on stdout, everything else on stderr
    #[arg(long)]
    pub json: bool,
    /// Small images: the whole command within a minute on two cores
    #[arg(long)]
    pub quick: bool,
}

/// Which shadow maps there are, and what makes them.
#[derive(Debug, Clone, Args)]
pub struct Maps {
    /// Texels along a side of the shadow map [default: 2048; 512 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SIDE)))]
    pub shadow_map: Option<u32>,
    /// Give a sun N cascades (2 to 16) of --shadow-map texels a side each, instead of one map; lamps keep their own
    #[arg(long, value_name = "N", value_parser = cascades)]
    pub cascades: Option<u32>,
    /// What makes the shadow map
    #[arg(long, value_name = "SOURCE", default_value = "raycast")]
    pub shadow_source: ShadowSource,
    /// Vulkan device of --shadow-source raster, by a part of its name or its number in `methods` [default: the best]
    #[arg(long, value_name = "NAME|INDEX")]
    pub vulkan_device: Option<String>,
}

/// `validate`.
#[derive(Debug, Clone, Args)]
pub struct Validate {
    /// Shot file, mesh, or name of a built-in shot; repeatable [default: all built-in shots]
    #[arg(long = "shot", value_name = "FILE|NAME")]
    pub shots: Vec<String>,
    #[command(flatten)]
    pub rendering: Rendering,
    /// Write a self-contained HTML report into this folder; measures the trade-off (on small images) and the stress
    /// matrix for it: some two minutes with all shots, and exit 1 if a cell of the matrix is wrong
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Rows of the report's stress matrix, as in `stress`; repeatable [default: all]
    #[arg(long = "row", value_name = "TEXT", requires = "report")]
    pub rows: Vec<String>,
    /// Prove that the checks can fail: every deliberately wrong variant must be rejected; exit 1 if one survives
    #[arg(long, conflicts_with_all = ["shots", "report", "rows", "size", "shadow_map", "cascades", "vulkan_device"])]
    pub mutants: bool,
    /// Grade an image that another renderer made of the one --shot: EXR, row 0 on top; what of it is taken is said
    #[arg(long, value_name = "MINE.exr")]
    pub image: Option<PathBuf>,
    /// Where the picture of the image's difference goes [default: into the --report folder; without one there is none]
    #[arg(long, value_name = "F.png", requires = "image")]
    pub difference: Option<PathBuf>,
    /// Compare with an earlier run's --json: errors must not have grown, times are shown as ratios; exit 1 if one has
    #[arg(long, value_name = "FILE.json")]
    pub baseline: Option<PathBuf>,
    /// Machine file of the planner behind --method auto [default: what calibrate wrote, else the built-in one]
    #[arg(long, value_name = "FILE.toml")]
    pub machine: Option<PathBuf>,
}

/// `tradeoff`.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("repeat", |arg| arg.default_value("3")))]
#[command(mut_arg("quality", |arg| arg.help("Level of --scaling and --motion: preview, game or film")))]
#[command(mut_arg("quick", |arg| arg.help("Small images: the whole command within three minutes on two cores")))]
pub struct Tradeoff {
    /// Shot file, mesh, or name of a built-in shot; repeatable [default: all built-in shots]
    #[arg(long = "shot", value_name = "FILE|NAME")]
    pub shots: Vec<String>,
    #[command(flatten)]
    pub rendering: Rendering,
    /// Instead: time over the resolution of image and map, at five sizes, and its log-log slope, at --quality
    #[arg(long, conflicts_with_all = ["motion", "markdown"])]
    pub scaling: bool,
    /// Instead: how much each technique's error flickers while camera and light move, at --quality; the shadow map's own
    /// too with --method truth-shadow-map
    #[arg(long, conflicts_with_all = ["markdown", "plot"])]
    pub motion: bool,
    /// Print the times to each level as a Markdown table, and nothing else
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
    /// Print which technique is the fastest to each level on each shot, and nothing else (with --markdown as Markdown)
    #[arg(long, conflicts_with_all = ["json", "scaling", "motion"])]
    pub winners: bool,
    /// Write the plots of the shots as one SVG file
    #[arg(long, value_name = "F.svg")]
    pub plot: Option<PathBuf>,
    /// A shot to plot, by its name; repeatable [default: all]
    #[arg(long = "plot-shot", value_name = "NAME", requires = "plot")]
    pub plot_shots: Vec<String>,
    /// Write a self-contained HTML page with plots and tables into this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

/// `render`.
#[derive(Debug, Args)]
pub struct Render {
    /// Shot file, mesh, or name of a built-in shot
    #[arg(long, value_name = "FILE|NAME")]
    pub shot: String,
    #[command(flatten)]
    pub rendering: Rendering,
    /// Write the in-scattered radiance as EXR: channels R, G, B, float32
    #[arg(long, value_name = "F.exr")]
    pub out: Option<PathBuf>,
    /// Write a picture to look at
    #[arg(long, value_name = "F.png")]
    pub png: Option<PathBuf>,
    /// Compare with the exact images
    #[arg(long, value_name = "TRUTH", num_args = 0..=1, default_missing_value = "both")]
    pub compare: Option<CompareWith>,
    /// Write the mesh around the light's shadow, as light-volume has it, with its --set options, as OBJ: walls that have no end
    /// reach to the farthest surface and half as far again
    #[arg(long, value_name = "F.obj")]
    pub export_mesh: Option<PathBuf>,
    /// Machine file of the planner behind --method auto [default: what calibrate wrote, else the built-in one]
    #[arg(long, value_name = "FILE.toml")]
    pub machine: Option<PathBuf>,
}

/// `plan`.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("quality", |arg| arg.help("Level to reach where no budget is given: preview, game or film")))]
pub struct Plan {
    /// Shot file, mesh, or name of a built-in shot; repeatable with --survey [default there: all built-in shots]
    #[arg(long = "shot", value_name = "FILE|NAME")]
    pub shots: Vec<String>,
    #[command(flatten)]
    pub rendering: Rendering,
    /// Least time at an error: preview, game or film, or a number that p99 and rel_rmse are to be within
    #[arg(long, value_name = "LEVEL|NUMBER", conflicts_with_all = ["promise", "time"])]
    pub error: Option<String>,
    /// Least time at a promise: an error of at most this share of each pixel's unoccluded value
    #[arg(long, value_name = "NUMBER", conflicts_with = "time")]
    pub promise: Option<f64>,
    /// Least error within a time
    #[arg(long, value_name = "MS")]
    pub time: Option<f64>,
    /// Then render, and print what was measured beside what was predicted, with what the shadow map itself is off by. With --survey:
    /// the maps alone, a shot a row
    #[arg(long)]
    pub check: bool,
    /// Instead: predicted against measured over all techniques, levels and shots; what auto loses to the best at each level; and how
    /// three times a shot are kept
    #[arg(long, conflicts_with_all = ["error", "promise", "time"])]
    pub survey: bool,
    /// Machine file [default: what calibrate wrote, else the built-in one]
    #[arg(long, value_name = "FILE.toml")]
    pub machine: Option<PathBuf>,
}

/// `calibrate`.
#[derive(Debug, Args)]
pub struct Calibrate {
    /// The file to write [default: scatter-machine.toml in the user's config folder]
    #[arg(long, value_name = "FILE.toml")]
    pub machine: Option<PathBuf>,
}

/// `compare`.
#[derive(Debug, Args)]
pub struct Compare {
    /// The reference
    #[arg(value_name = "A.exr")]
    pub reference: PathBuf,
    /// The image to judge
    #[arg(value_name = "B.exr")]
    pub test: PathBuf,
    /// PNG: white pixels are left out
    #[arg(long, value_name = "M.png")]
    pub mask: Option<PathBuf>,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub json: bool,
}

/// `methods`.
#[derive(Debug, Args)]
pub struct Methods {
    /// Print one JSON document on stdout
    #[arg(long)]
    pub json: bool,
}

/// `shots`.
#[derive(Debug, Args)]
pub struct Shots {
    /// Shot file, mesh, or name of a built-in shot; repeatable [default: all built-in shots]
    #[arg(long = "shot", value_name = "FILE|NAME")]
    pub shots: Vec<String>,
    /// Write the built-in shots into this folder: shot files with their meshes
    #[arg(long, value_name = "DIR")]
    pub export: Option<PathBuf>,
    /// Find the fewest steps with which the marcher reaches each quality level (renders each shot some twenty times)
    #[arg(long)]
    pub steps: bool,
    #[command(flatten)]
    #[command(next_help_heading = "Maps of --steps and --cascades")]
    pub maps: Maps,
    /// Print one JSON document on stdout
    #[arg(long)]
    pub json: bool,
}

/// `stress`.
#[derive(Debug, Args)]
pub struct Stress {
    /// Technique by its id; repeatable [default: all, beside shadow-map truth]
    #[arg(long = "method", value_name = "ID")]
    pub methods: Vec<String>,
    /// Rows whose group or name contains this text; repeatable [default: all]
    #[arg(long = "row", value_name = "TEXT")]
    pub rows: Vec<String>,
    /// One option of the techniques that have it, over their finest setting; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    #[command(flatten)]
    pub on: DeviceFlags,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Print one JSON document on stdout, everything else on stderr
    #[arg(long)]
    pub json: bool,
    /// Write the matrix as a self-contained HTML page into this folder
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

/// What a rendered image is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CompareWith {
    /// The exact image for the same shadow map
    ShadowMap,
    /// The exact image for the triangles
    Raycast,
    /// The exact image for the surface that interpolates the shadow map
    HeightField,
    /// Shadow map and triangles
    Both,
    /// All three
    All,
}

/// What makes shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShadowSource {
    /// Ray casts on the CPU
    Raycast,
    /// The Vulkan raster pass
    Raster,
}

fn quality(text: &str) -> Result<Quality, String> {
    text.parse()
}

fn cascades(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(count) if (2..=MAX_CASCADES as u32).contains(&count) => Ok(count),
        _ => Err(format!("give 2 to {MAX_CASCADES} cascades; without --cascades a sun has one map")),
    }
}

fn key_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().into(), value.trim().into())),
        _ => Err("give KEY=VALUE, for example steps=256".into()),
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    /// Most pixels of an image: 64 Mi, 1.5 GiB of radiance and transmittance.
    const MOST_PIXELS: u64 = 1 << 26;
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some([w, h])
            if (1..=MAX_SIDE).contains(&w)
                && (1..=MAX_SIDE).contains(&h)
                && u64::from(w) * u64::from(h) <= MOST_PIXELS =>
        {
            Ok([w, h])
        }
        _ => Err(format!(
            "give WxH in pixels, for example 640x480, each from 1 to {MAX_SIDE} and {MOST_PIXELS} in all at most"
        )),
    }
}
