//! Smallest and largest depths of square blocks of a shadow map, level by level: what lets a walk skip texels.
//!
//! The classic min/max quadtree (Tevs et al. 2008 for height fields; Chen et al. 2011 and Yusov 2012 in one
//! dimension for this problem), here two-dimensional and for exactness, not for speed alone. The finest level has
//! blocks of [`FINEST_SIDE`]² texels: below it, reading the texels costs no more than reading their bounds, and a
//! sixteenth of the map's texels is all that the tree holds besides.

use scatter_core::{ShadowMap, parallel};

/// `log2` of the finest blocks' side. Smaller: a tree as large as the map; larger: more single texels to walk.
const FINEST_SHIFT: u32 = 2;
/// Side of the finest blocks in texels.
const FINEST_SIDE: usize = 1 << FINEST_SHIFT;

/// The trees of all layers of a shadow map; its buffers are reused from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct MinMaxTrees {
    /// `[min, max]` of every block, level after level, layer after layer, row-major.
    blocks: Vec<[f32; 2]>,
    levels: Vec<Level>,
    /// Index of each layer's first level; one more at the end.
    layers: Vec<usize>,
}

#[derive(Debug, Clone, Copy)]
struct Level {
    first: usize,
    width: usize,
    height: usize,
}

/// The tree of one layer.
#[derive(Debug, Clone, Copy)]
pub struct MinMaxTree<'a> {
    blocks: &'a [[f32; 2]],
    levels: &'a [Level],
}

impl MinMaxTrees {
    /// Builds the trees of a shadow map: one pass over its texels.
    pub fn build(&mut self, shadow: &ShadowMap<'_>) {
        self.lay_out(shadow);
        for (index, bounds) in self.layers.windows(2).enumerate() {
            let Some(layer) = shadow.layer(index) else { continue };
            let levels = &self.levels[bounds[0]..bounds[1]];
            let width = layer.projection().size()[0] as usize;
            let finest = &mut self.blocks[levels[0].first..][..levels[0].width * levels[0].height];
            let texels = layer.texels();
            parallel::for_each_row(finest, levels[0].width, |y, row| {
                let rows = &texels[y * FINEST_SIDE * width..];
                let rows = &rows[..rows.len().min(FINEST_SIDE * width)];
                for (x, block) in row.iter_mut().enumerate() {
                    let columns = x * FINEST_SIDE..width.min((x + 1) * FINEST_SIDE);
                    *block = bounds_of(
                        rows.chunks_exact(width).flat_map(|row| &row[columns.clone()]).map(|&t| [t, t]),
                    );
                }
            });
            for pair in levels.windows(2) {
                let (fine, coarse) = self.blocks.split_at_mut(pair[1].first);
                let fine = &fine[pair[0].first..];
                parallel::for_each_row(
                    &mut coarse[..pair[1].width * pair[1].height],
                    pair[1].width,
                    |y, row| {
                        let rows = 2 * y..pair[0].height.min(2 * y + 2);
                        for (x, block) in row.iter_mut().enumerate() {
                            let columns = 2 * x..pair[0].width.min(2 * x + 2);
                            *block =
                                bounds_of(rows.clone().flat_map(|j| {
                                    fine[j * pair[0].width..][columns.clone()].iter().copied()
                                }));
                        }
                    },
                );
            }
        }
    }

    /// Level sizes and offsets; gives the block buffer its length.
    fn lay_out(&mut self, shadow: &ShadowMap<'_>) {
        self.levels.clear();
        self.layers.clear();
        let mut total = 0;
        for index in 0..shadow.layer_count() {
            self.layers.push(self.levels.len());
            let Some(layer) = shadow.layer(index) else { continue };
            let [mut width, mut height] =
                layer.projection().size().map(|n| (n as usize).div_ceil(FINEST_SIDE));
            loop {
                self.levels.push(Level { first: total, width, height });
                total += width * height;
                if width == 1 && height == 1 {
                    break;
                }
                (width, height) = (width.div_ceil(2), height.div_ceil(2));
            }
        }
        self.layers.push(self.levels.len());
        self.blocks.resize(total, [0.0; 2]);
    }

    /// The tree of layer `index`.
    pub fn layer(&self, index: usize) -> MinMaxTree<'_> {
        MinMaxTree { blocks: &self.blocks, levels: &self.levels[self.layers[index]..self.layers[index + 1]] }
    }

    /// Bytes that the trees hold.
    pub fn memory_bytes(&self) -> u64 {
        (self.blocks.capacity() * size_of::<[f32; 2]>()
            + self.levels.capacity() * size_of::<Level>()
            + self.layers.capacity() * size_of::<usize>()) as u64
    }
}

impl MinMaxTree<'_> {
    /// The coarsest level; level 0 are the texels themselves, level 1 the finest blocks.
    pub fn top(&self) -> u32 {
        self.levels.len() as u32
    }

    /// `log2` of the side of a block of `level` ≥ 1.
    pub fn shift(level: u32) -> u32 {
        FINEST_SHIFT + level - 1
    }

    /// `[min, max]` of the block of `level` ≥ 1 that holds texel `(i, j)`.
    pub fn bounds(&self, level: u32, i: i32, j: i32) -> [f32; 2] {
        let shift = Self::shift(level);
        let Level { first, width, .. } = self.levels[level as usize - 1];
        self.blocks[first + (j as usize >> shift) * width + (i as usize >> shift)]
    }
}

fn bounds_of(depths: impl Iterator<Item = [f32; 2]>) -> [f32; 2] {
    // Shadow depths are never NaN (ShadowLayer).
    depths.fold([f32::INFINITY, 0.0], |[least, greatest], [low, high]| [least.min(low), greatest.max(high)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::{MapProjection, ShadowLayer};

    #[test]
    fn every_block_bounds_exactly_its_own_texels() {
        let size = [37u32, 22];
        let texels: Vec<f32> = (0..37 * 22).map(|i| ((i * 7919) % 1009) as f32).collect();
        let projection =
            MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 1.0], size)
                .unwrap();
        let shadow = ShadowMap::Orthographic(ShadowLayer::new(projection, &texels).unwrap());
        let mut trees = MinMaxTrees::default();
        trees.build(&shadow);
        let tree = trees.layer(0);
        // 37 texels: 10, 5, 3, 2, 1 blocks a row.
        assert_eq!(tree.top(), 5);
        for level in 1..=tree.top() {
            let side = 1usize << MinMaxTree::shift(level);
            for j in 0..22usize {
                for i in 0..37usize {
                    let (x, y) = (i / side * side, j / side * side);
                    let block =
                        (y..22.min(y + side)).flat_map(|y| &texels[y * 37 + x..y * 37 + 37.min(x + side)]);
                    let least = block.clone().copied().fold(f32::INFINITY, f32::min);
                    let greatest = block.copied().fold(0.0, f32::max);
                    assert_eq!(tree.bounds(level, i as i32, j as i32), [least, greatest], "{level} {i} {j}");
                }
            }
        }
    }
}
