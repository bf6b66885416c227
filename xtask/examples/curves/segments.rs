//! The segments that the tables are made of: all texels of a light's map around the occluders of a built-in shot.

use std::error::Error;
use std::time::Instant;

use scatter::avsm::{CurveMaps, DepthRange, Options, TranslucentSegment};
use scatter_core::{MapProjection, TranslucentCapture, TranslucentSource};
use scatter_scene::{BuiltinShot, export, load_shot};
use scatter_validate::StagedShot;

/// The shots of smoke and hair.
pub const SHOTS: [&str; 3] = ["smoke", "hair", "smoke-and-hair"];

/// A built-in shot as a picture of 320 × 240, with its maps of 512² texels.
pub fn staged(name: &str) -> Result<StagedShot, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    export(folder.path(), &[BuiltinShot::find(name).ok_or("no such shot")?])?;
    let mut shot = load_shot(&folder.path().join(format!("{name}.toml")))?;
    shot.camera = shot.camera.with_size([320, 240])?;
    Ok(StagedShot::new(shot, 512)?)
}

/// Segments of all texels of a map.
pub struct Texels {
    /// Of each texel that has any, in the order in which they were submitted.
    pub lists: Vec<Vec<TranslucentSegment>>,
    /// Of all.
    pub range: DepthRange,
    /// Where the map looks.
    pub projection: MapProjection,
    /// Seconds that the capture took, its memory being there.
    pub capture_seconds: f64,
}

/// The map that the technique lays around the occluders of a shot, with `side` texels along its longer side, captured.
pub fn captured(shot: &StagedShot, side: u32) -> Result<Texels, Box<dyn Error>> {
    let projection = shot.with_frame(0, shot.camera(), |frame| {
        let mut maps = CurveMaps::new();
        maps.build(frame, &Options { curves: side, ..Options::default() })?;
        Ok::<_, scatter_core::RenderError>(*maps.layers()[0].projection())
    })??;
    let source: &dyn TranslucentSource = shot.caster().occluders().ok_or("no occluders")?;
    let mut capture = TranslucentCapture::new();
    capture.capture(source, &projection, TranslucentCapture::DEFAULT_LIMIT)?;
    let start = Instant::now();
    let layer = capture.capture(source, &projection, TranslucentCapture::DEFAULT_LIMIT)?;
    let capture_seconds = start.elapsed().as_secs_f64();
    let pairs = layer.offsets().windows(2);
    let lists: Vec<_> = pairs
        .map(|pair| layer.segments()[pair[0] as usize..pair[1] as usize].to_vec())
        .filter(|list| !list.is_empty())
        .collect();
    let range = DepthRange::of(layer.segments());
    Ok(Texels { lists, range, projection, capture_seconds })
}

/// 141 segments of three puffs of smoke, whose exact curve has about 280 nodes: the paper's example, in 64 texels.
pub fn puffs() -> Texels {
    let at = |n: u32, seed: u32| (f64::from(n * 37 + seed * 101) * 0.618_034).fract() as f32;
    let segment = |n: u32, seed: u32| {
        let middle = [2.0, 7.0, 13.0][n as usize % 3] + 0.8 * at(n, seed) - 0.4;
        let half = 0.02 + 0.15 * at(n + 500, seed);
        let optical_depth = 0.04 * at(n + 900, seed);
        TranslucentSegment { entry: middle - half, exit: middle + half, optical_depth }
    };
    let lists: Vec<Vec<_>> = (0..64).map(|seed| (0..141).map(|n| segment(n, seed)).collect()).collect();
    let range = DepthRange::of(lists.iter().flatten());
    // Of no map.
    let projection = MapProjection::cube_face([0.0; 3], 0, 8).expect("a face of a cube");
    Texels { lists, range, projection, capture_seconds: 0.0 }
}
