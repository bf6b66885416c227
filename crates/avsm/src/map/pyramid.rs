//! Blocks of a map with the nearest and the farthest of their values: what a ray need not look at texel by texel.

use scatter_core::{MapProjection, MapRay, ModelError, TexelSpan, TexelWalk, parallel};

/// Texels, or blocks of the finer level, along a side of a block. Smaller blocks are more of them to pass, larger ones have
/// more to look at where one does not settle.
const SIDE: u32 = 8;
/// Levels of blocks: 8² and 64² texels.
const LEVELS: usize = 2;

/// Nearest and farthest value of each block of 8² and of 64² texels of a map. Holds its buffers for the next one: 8.2 bytes
/// for 64 texels.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    /// Of the texels and of each level.
    sizes: [Option<MapProjection>; LEVELS + 1],
    blocks: [Vec<[f32; 2]>; LEVELS],
}

impl Pyramid {
    /// Of a map whose texel at `[row][column]` has the nearest and the farthest value `value(texel)`. O(texels).
    pub fn build(
        &mut self,
        map: &MapProjection,
        value: impl Fn(usize) -> [f32; 2] + Sync,
    ) -> Result<(), ModelError> {
        self.sizes[0] = Some(*map);
        let mut size = map.size();
        for level in 0..LEVELS {
            let (finer, coarser) = self.blocks.split_at_mut(level);
            let below = finer.last();
            let [width, height] = size;
            let texel = |at: usize| below.map_or_else(|| value(at), |blocks| blocks[at]);
            let next = size.map(|side| side.div_ceil(SIDE));
            let blocks = &mut coarser[0];
            blocks.clear();
            blocks.resize(next[0] as usize * next[1] as usize, [f32::INFINITY, f32::NEG_INFINITY]);
            parallel::for_each_row(blocks, next[0] as usize, |row, blocks| {
                let first = row as u32 * SIDE;
                for y in first..height.min(first + SIDE) {
                    for x in 0..width {
                        let [near, far] = texel(y as usize * width as usize + x as usize);
                        let block = &mut blocks[(x / SIDE) as usize];
                        *block = [block[0].min(near), block[1].max(far)];
                    }
                }
            });
            // Only the number of blocks matters to a walk.
            self.sizes[level + 1] = Some(map.with_size(next)?);
            size = next;
        }
        Ok(())
    }

    /// Walks the part `[t_min, t_max]` of a ray, all of which lies in the map, from block to block and where `settles(span,
    /// [nearest, farthest])` says no, inside of it; calls `texel` for what is left. Spans of both come in order and without gaps.
    pub fn walk(
        &self,
        path: &MapRay,
        part: [f64; 2],
        settles: &mut impl FnMut(&TexelSpan, [f32; 2]) -> bool,
        texel: &mut impl FnMut(&TexelSpan),
    ) {
        self.walk_level(LEVELS, path, part, settles, texel);
    }

    fn walk_level(
        &self,
        level: usize,
        path: &MapRay,
        [mut start, end]: [f64; 2],
        settles: &mut impl FnMut(&TexelSpan, [f32; 2]) -> bool,
        texel: &mut impl FnMut(&TexelSpan),
    ) {
        let Some(map) = &self.sizes[level] else { return };
        let scale = f64::from(SIDE).powi(-(level as i32));
        let scaled = |mut p: glam::DVec3| {
            p.x *= scale;
            p.y *= scale;
            p
        };
        let level_path = MapRay { start: scaled(path.start), step: scaled(path.step) };
        let mut spans = TexelWalk::new(map, &level_path, start, end);
        let mut next = spans.next();
        while let Some(span) = next {
            next = spans.next();
            // The walk cuts borders by its own roots. Slits that rounding leaves belong to the texel beside them.
            let span =
                TexelSpan { t_min: start, t_max: if next.is_none() { end } else { span.t_max }, ..span };
            start = span.t_max;
            if !(span.t_max > span.t_min) {
                continue;
            }
            match level.checked_sub(1) {
                None => texel(&span),
                Some(finer) => {
                    let at = span.j as usize * map.size()[0] as usize + span.i as usize;
                    if !settles(&span, self.blocks[finer][at]) {
                        self.walk_level(finer, path, [span.t_min, span.t_max], settles, texel);
                    }
                }
            }
        }
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.blocks.iter().map(|blocks| (blocks.capacity() * size_of::<[f32; 2]>()) as u64).sum()
    }
}

/// Depths of a ray at a span's ends, the smaller one first. An endless span of a ray that keeps its depth has that depth.
pub fn depths_on(path: &MapRay, span: &TexelSpan) -> [f64; 2] {
    let at = |t: f64| if path.step.z == 0.0 { path.start.z } else { path.start.z + path.step.z * t };
    let [a, b] = [at(span.t_min), at(span.t_max)];
    if a <= b { [a, b] } else { [b, a] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_walk_by_blocks_sees_what_a_walk_by_texels_sees() {
        let (position, forward, up) = ([0.0, 9.0, 0.0], [0.2, -1.0, 0.3], [0.0, 0.0, 1.0]);
        for map in [
            MapProjection::orthographic(position, forward, up, [4.0, 3.0], [203, 77]).unwrap(),
            MapProjection::perspective(position, forward, up, 0.8, 131).unwrap(),
        ] {
            let [width, height] = map.size();
            let value = |at: usize| ((at * 7919) % 1013) as f32;
            let mut pyramid = Pyramid::default();
            pyramid.build(&map, |at| [value(at); 2]).unwrap();
            let mut texels = 0;
            for n in 0..200 {
                let angle = f64::from(n);
                let start = DVec3::new(3.0 * angle.sin(), 2.0, 2.0 * (1.7 * angle).cos());
                let direction = DVec3::new((0.3 * angle).cos(), -0.2, (0.7 * angle).sin()).normalize();
                let path = map.ray(DVec3::ZERO, start, direction);
                // The part inside of the map.
                let inside: Vec<_> = TexelWalk::new(&map, &path, 0.0, 20.0).collect();
                let (Some(first), Some(last)) = (inside.first(), inside.last()) else { continue };
                let part = [first.t_min, last.t_max];
                let (mut end, mut settled) = (part[0], Vec::new());
                pyramid.walk(
                    &path,
                    part,
                    &mut |span, [near, far]| {
                        // Every third block is settled: what it holds must be all that lies along the ray in it.
                        let settles = (span.i + span.j) % 3 == 0;
                        if settles {
                            settled.push((span.t_min, span.t_max, near, far));
                        }
                        settles
                    },
                    &mut |span| {
                        assert!(span.i < width && span.j < height && span.t_max > span.t_min);
                        let middle = 0.5 * (span.t_min + span.t_max);
                        let p = map.texel_from_world(start + direction * middle);
                        let off = [p.x - f64::from(span.i) - 0.5, p.y - f64::from(span.j) - 0.5];
                        assert!(off.into_iter().all(|off| off.abs() < 0.5 + 1e-6), "{p} {span:?}");
                        end = span.t_max;
                        texels += 1;
                    },
                );
                for (from, to, near, far) in settled {
                    for span in
                        inside.iter().filter(|span| from + 1e-9 < span.t_min && span.t_max < to - 1e-9)
                    {
                        let value = value(span.j as usize * width as usize + span.i as usize);
                        assert!(near <= value && value <= far);
                    }
                }
                assert!(end <= part[1]);
            }
            assert!(texels > 1000, "{texels}");
        }
    }
}
