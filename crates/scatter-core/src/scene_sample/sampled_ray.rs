//! One pixel's ray: what it sees, and what it would cost those who walk it.

use crate::frame::Frame;
use crate::ray_layers::{layer_pieces, lit_part};
use crate::ray_light::RayLight;
use crate::texel_walk::TexelWalk;

use super::block_runs::BlockRuns;
use super::half_map::HalfMap;
use super::march_spread::{MarchSpread, Variances};

/// What a walk along one pixel's ray found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledRay {
    /// In-scattered radiance, the mean of the channels, exact but for the colours of glass and for smoke, which are left out.
    pub radiance: f64,
    /// The same where nothing shadows.
    pub unoccluded: f64,
    /// How long it is, where light that is left to be seen ends \[world units\].
    pub length: f64,
    /// Texels crossed.
    pub texels: f64,
    /// Nodes of a min/max mipmap, from blocks of 4×4 texels on, that a walk down from 128×128 visits.
    pub nodes: f64,
    /// Those of them from 16×16 texels on.
    pub coarse_nodes: f64,
    /// Texels in blocks of 4×4 that such a walk does not decide as a whole.
    pub leaf_texels: f64,
    /// Pieces that different maps of the light decide about.
    pub pieces: f64,
    /// Lit stretches.
    pub lit_runs: f64,
    /// Changes between light and shadow.
    pub transitions: f64,
    /// What marches are off by.
    pub march_spread: MarchSpread,
    /// By how much radiance changes when the maps have half as many texels a side; `None` where that was not walked.
    pub half_map_change: Option<f64>,
}

/// Walks rays; keeps its memory, and counts work.
#[derive(Debug, Default)]
pub struct RayWalker {
    runs: BlockRuns,
    lit: Vec<[f64; 2]>,
    half_map: HalfMap,
    /// In texels looked at.
    pub work: u64,
}

/// What a ray takes beside its texels, in texels; and what a lit stretch takes, of a sun and of a lamp.
const WORK_OF_RAY: u64 = 60;
const WORK_OF_SUN: u64 = 10;
const WORK_OF_LAMP: u64 = 150;

impl RayWalker {
    /// Walks the ray of a pixel through all texels that it crosses, and on request through maps of half as many a side.
    pub fn walk(&mut self, frame: &Frame<'_>, x: u32, y: u32, with_half_map: bool) -> SampledRay {
        let (camera, end) = (frame.camera(), frame.ray_end(x, y));
        let ray = camera.pixel_ray(x, y);
        let maps = frame.setup().maps();
        self.lit.clear();
        let (mut texels, mut pieces) = (0u64, 0u32);
        let [mut nodes, mut coarse_nodes, mut leaf_texels] = [0u32; 3];
        let (runs, lit, half_map) = (&mut self.runs, &mut self.lit, &mut self.half_map);
        half_map.start();
        let mut push = |a: f64, b: f64| match lit.last_mut() {
            Some([_, end]) if *end == a => *end = b,
            _ => lit.push([a, b]),
        };
        layer_pieces(maps, camera.eye(), &ray, [0.0, end], |piece| {
            pieces += 1;
            let Some(layer) = piece.layer.and_then(|index| frame.shadow().layer(index)) else {
                half_map.light(piece.t_min, piece.t_max);
                return push(piece.t_min, piece.t_max);
            };
            let path = layer.projection().ray(camera.eye(), ray.origin, ray.direction);
            let (slope, mut start) = (path.step.z, piece.t_min);
            let mut before = path.start.z + slope * start;
            runs.start();
            for mut span in TexelWalk::new(layer.projection(), &path, piece.t_min, piece.t_max) {
                // As in `lit_stretches`: slits that rounding leaves belong to the texel beside them.
                span.t_min = start;
                start = span.t_max;
                let stored = layer.at(span.i, span.j);
                let after = path.start.z + slope * span.t_max;
                let own = [before.min(after), before.max(after)];
                // Most texels are lit or dark as a whole: no crossing to be solved.
                if f64::from(stored) >= own[1] {
                    push(span.t_min, span.t_max);
                } else if !(f64::from(stored) < own[0])
                    && let Some((a, b)) = lit_part(f64::from(stored), &path, &span)
                {
                    push(a, b);
                }
                texels += 1;
                if with_half_map {
                    half_map.add(&layer, &path, &span);
                }
                runs.add([span.i, span.j], stored, own.map(|depth| depth as f32));
                before = after;
            }
            half_map.end_piece(&layer, &path);
            let visited = runs.visits();
            nodes += visited.nodes;
            coarse_nodes += visited.coarse_nodes;
            leaf_texels += visited.texels;
        });
        let light = RayLight::new(frame.light(), frame.medium(), camera.eye(), &ray);
        let mean = |a: f64, b: f64| light.interval(a, b).element_sum() / 3.0;
        let mut variances = Variances::default();
        let mut radiance = 0.0;
        let mut transitions = 0;
        // Steps are even in length, and near a lamp in angle.
        let lamp = light.lamp_ray();
        let even = |t: f64| match &lamp {
            Some(lamp) => ((t - lamp.closest) / lamp.distance).atan(),
            None => t,
        };
        let whole = even(marched_end(frame, end)) - even(0.0);
        for &[a, b] in &self.lit {
            let own = mean(a, b);
            radiance += own;
            let edges = u32::from(a > 0.0) + u32::from(b < end);
            transitions += edges;
            variances.add((even(b.min(marched_end(frame, end))) - even(a)) / whole, own, edges);
        }
        let of_stretch = if lamp.is_some() { WORK_OF_LAMP } else { WORK_OF_SUN };
        let (mut looked_at, mut stretches) = (texels, 1 + self.lit.len());
        let half_map_change = with_half_map.then(|| {
            stretches += self.half_map.lit().len();
            looked_at += self.half_map.texels();
            self.half_map.lit().iter().map(|&[a, b]| mean(a, b)).sum::<f64>() - radiance
        });
        self.work += looked_at + WORK_OF_RAY + of_stretch * stretches as u64;
        SampledRay {
            radiance,
            unoccluded: mean(0.0, end),
            length: marched_end(frame, end),
            texels: texels as f64,
            nodes: nodes.into(),
            coarse_nodes: coarse_nodes.into(),
            leaf_texels: leaf_texels.into(),
            pieces: pieces.into(),
            lit_runs: self.lit.len() as f64,
            transitions: transitions.into(),
            march_spread: variances.spread(),
            half_map_change,
        }
    }
}

/// Where a march ends at the latest: nothing is left of the light after thirty optical depths.
fn marched_end(frame: &Frame<'_>, end: f64) -> f64 {
    let sigma = frame.medium().sigma_t().into_iter().fold(f64::INFINITY, f64::min);
    if end.is_finite() { end } else { 30.0 / sigma.max(1e-12) }
}
