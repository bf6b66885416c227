//! What is prepared of each layer of a light: its mipmap, coded for the depths that view rays have in it.

use scatter_core::{Frame, Level, MapFan, RayFan, at_level};

use crate::depth_codes::DepthCodes;
use crate::exact::ray_fan::{GROUP, LANES, MapLanes, stretches};
use crate::tree::MinMaxTree;

/// Groups of pixels that are looked at for the range of depths: every fourth one in both directions. What lies outside of
/// the range is slower, not wrong.
const SAMPLED: usize = 4;

/// How much nearer than the farthest point of a ray a perspective map's codes begin: what is nearer to the lamp is told
/// from its shadows texel by texel, and the steps of the codes are a fraction of its depth everywhere else.
const NEAREST_SHARE: f64 = 1.0 / 64.0;

/// The mipmaps of a light's layers. Buffers are reused from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct LayerTrees {
    trees: Vec<MinMaxTree>,
}

impl LayerTrees {
    /// Builds the mipmaps of all layers of a frame's map.
    pub fn build(&mut self, simd: Level, frame: &Frame<'_>, fan: &RayFan) {
        self.trees.resize_with(frame.shadow().layer_count(), MinMaxTree::default);
        for (tree, layer) in self.trees.iter_mut().zip(frame.shadow().layers()) {
            let map_fan = fan.in_map(layer.projection());
            let depths = at_level!(simd, visible_depths(frame, fan, &map_fan));
            let codes = if layer.projection().is_perspective() {
                let [nearest, farthest] = depths;
                DepthCodes::new(
                    [nearest.max(NEAREST_SHARE * farthest), farthest].map(|depth| -1.0 / depth),
                    true,
                )
            } else {
                DepthCodes::new(depths, false)
            };
            tree.build(simd, &layer, codes);
        }
    }

    /// The mipmap of each layer, in order.
    pub fn trees(&self) -> &[MinMaxTree] {
        &self.trees
    }

    /// Bytes that they hold.
    pub fn memory_bytes(&self) -> u64 {
        let trees = self.trees.iter().map(MinMaxTree::memory_bytes).sum::<u64>();
        trees + (self.trees.capacity() * size_of::<MinMaxTree>()) as u64
    }
}

/// Nearest and farthest depth of view rays inside of a map, of a sample of them.
#[inline(always)]
fn visible_depths(frame: &Frame<'_>, fan: &RayFan, map_fan: &MapFan) -> [f64; 2] {
    let [width, height] = frame.size();
    let limit = frame.max_distance();
    let mut depths = [f64::INFINITY, 0.0];
    for y in (0..height).step_by(GROUP[1] as usize * SAMPLED) {
        for x in (0..width).step_by(GROUP[0] as usize * SAMPLED) {
            let (paths, stretch) = (map_fan.paths([x, y]), stretches(fan, [x, y]));
            let (mut from, mut to) = ([0.0; LANES], [0.0; LANES]);
            for (lane, to) in to.iter_mut().enumerate().take(GROUP[0].min(width - x) as usize) {
                *to = f64::from(frame.depth().at(x + lane as u32, y)).min(limit) / stretch[lane];
            }
            map_fan.clip(&paths, &mut from, &mut to);
            for lane in 0..LANES {
                let at = |s: f64| paths.start[2][lane] + paths.step[2][lane] * s;
                let (a, b) = (at(from[lane]), at(to[lane]));
                if from[lane] < to[lane] && a.is_finite() && b.is_finite() {
                    depths = [depths[0].min(a).min(b), depths[1].max(a).max(b)];
                }
            }
        }
    }
    depths
}
