//! What a ray sees through a map of half as many texels a side, found while it is walked through the whole one.
//!
//! Of every 2×2 texels one is kept, now this and now that one, as a map of that resolution would hold the depth of some point of
//! its texel. What changes tells what the map itself is off by: both are errors of where in a texel its depth is taken.

use crate::map_projection::MapRay;
use crate::ray_layers::lit_part;
use crate::shadow_map::ShadowLayer;
use crate::texel_walk::TexelSpan;

/// The lit stretches of one ray; keeps its memory.
#[derive(Debug, Default)]
pub struct HalfMap {
    lit: Vec<[f64; 2]>,
    /// The block of 2×2 texels that the ray is in, as a span.
    block: Option<TexelSpan>,
    texels: u64,
}

impl HalfMap {
    /// Begins a ray.
    pub fn start(&mut self) {
        self.lit.clear();
        self.block = None;
        self.texels = 0;
    }

    /// Adds a stretch that is lit whatever maps hold.
    pub fn light(&mut self, a: f64, b: f64) {
        match self.lit.last_mut() {
            Some([_, end]) if *end == a => *end = b,
            _ => self.lit.push([a, b]),
        }
    }

    /// Adds the next texel of the whole map.
    #[inline]
    pub fn add(&mut self, layer: &ShadowLayer<'_>, path: &MapRay, span: &TexelSpan) {
        let [i, j] = [span.i >> 1, span.j >> 1];
        match &mut self.block {
            Some(block) if [block.i, block.j] == [i, j] => block.t_max = span.t_max,
            _ => {
                self.end_piece(layer, path);
                self.block = Some(TexelSpan { i, j, ..*span });
            }
        }
    }

    /// Ends a map's piece of the ray.
    pub fn end_piece(&mut self, layer: &ShadowLayer<'_>, path: &MapRay) {
        let Some(block) = self.block.take() else { return };
        let [width, height] = layer.projection().size();
        let kept = kept_of(block.i, block.j);
        let [i, j] = [(2 * block.i + kept[0]).min(width - 1), (2 * block.j + kept[1]).min(height - 1)];
        self.texels += 1;
        if let Some((a, b)) = lit_part(f64::from(layer.at(i, j)), path, &block) {
            self.light(a, b);
        }
    }

    /// What is lit, in order.
    pub fn lit(&self) -> &[[f64; 2]] {
        &self.lit
    }

    /// Texels read.
    pub fn texels(&self) -> u64 {
        self.texels
    }
}

/// Which of its 2×2 texels a block keeps: spread evenly, the R₂ sequence along both axes.
fn kept_of(i: u32, j: u32) -> [u32; 2] {
    let hash = i.wrapping_mul(0xC13F_A9A9).wrapping_add(j.wrapping_mul(0x91E1_0DA5));
    [hash >> 31, (hash >> 30) & 1]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::map_projection::MapProjection;
    use crate::texel_walk::TexelWalk;

    #[test]
    fn it_sees_one_texel_of_each_block_and_nothing_else() {
        // Depths between 0 and 10 below a sun straight down; odd sides, so that the last blocks are halved.
        let (width, height) = (17u32, 15u32);
        let texels: Vec<f32> = (0..width * height).map(|n| (n * 7 % 11) as f32).collect();
        let projection = MapProjection::orthographic(
            [0.0, 10.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [8.5, 7.5],
            [width, height],
        )
        .unwrap();
        let layer = ShadowLayer::new(projection, &texels).unwrap();
        let (origin, direction) = (DVec3::new(-8.1, 9.3, -6.9), DVec3::new(1.0, -0.45, 0.83).normalize());
        let path = projection.ray(origin, DVec3::ZERO, direction);
        let mut half_map = HalfMap::default();
        half_map.start();
        let spans: Vec<TexelSpan> = TexelWalk::new(&projection, &path, 0.0, 17.0).collect();
        spans.iter().for_each(|span| half_map.add(&layer, &path, span));
        half_map.end_piece(&layer, &path);
        let (first, last) = (spans[0].t_min, spans[spans.len() - 1].t_max);
        let [mut lit, mut dark] = [0; 2];
        for n in 0..10_000 {
            let t = first + (last - first) * (f64::from(n) + 0.5) / 10_000.0;
            let place = path.start + path.step * t;
            let [i, j] = [place.x as u32 >> 1, place.y as u32 >> 1];
            let kept = kept_of(i, j);
            let [i, j] = [(2 * i + kept[0]).min(width - 1), (2 * j + kept[1]).min(height - 1)];
            let expected = place.z <= f64::from(layer.at(i, j));
            assert_eq!(half_map.lit().iter().any(|&[a, b]| a <= t && t <= b), expected, "at {t}");
            if expected { lit += 1 } else { dark += 1 }
        }
        assert!(lit > 1000 && dark > 1000 && half_map.texels() < spans.len() as u64, "{lit} {dark}");
        // Every texel of a block is kept somewhere.
        let mut counts = [0; 4];
        (0..1024).for_each(|n| {
            let [x, y] = kept_of(n % 32, n / 32);
            counts[(2 * x + y) as usize] += 1;
        });
        assert!(counts.iter().all(|count| (192..320).contains(count)), "{counts:?}");
    }
}
