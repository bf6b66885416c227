//! The nearest and the farthest depth of each tile of a shadow map, so that a row steps over what is one run anyway.
//!
//! Indoors most light ends at a roof before any view ray sees it, outdoors most of it reaches the ground behind all of
//! them: whole stretches of a row are lit for no column, or for every one. Sixteen texels that cannot differ are known by
//! their extrema. (Min/max trees along rows, as in Chen et al. 2011, have to be built for each slice; these tiles are
//! built once a frame, in one pass over the map.)

use scatter_core::{Level, ShadowMap, at_level};

/// Texels along a side of a tile: a register of the widest kind. Fewer cost more than they let rows step over.
pub const TILE: usize = 16;

/// Extrema of the tiles of all layers of a shadow map.
#[derive(Debug, Clone, Default)]
pub struct Extrema {
    /// `[nearest, farthest]` depth a tile, row by row, layer by layer.
    tiles: Vec<[f32; 2]>,
    /// First tile of each layer.
    firsts: [usize; 7],
    /// Tiles along a row, per layer.
    widths: [usize; 6],
}

/// Extrema of the tiles of one layer.
#[derive(Debug, Clone, Copy)]
pub struct LayerExtrema<'a> {
    /// `[nearest, farthest]` depth a tile, row by row; ∞ is no surface.
    pub tiles: &'a [[f32; 2]],
    /// Tiles along a row.
    pub width: usize,
}

impl Extrema {
    /// Reads a shadow map: once, at the speed of memory. Layers after the sixth have none.
    pub fn rebuild(&mut self, level: Level, map: &ShadowMap<'_>) {
        let mut count = 0;
        for (index, layer) in map.layers().take(6).enumerate() {
            let [width, height] = layer.projection().size().map(|size| (size as usize).div_ceil(TILE));
            self.firsts[index] = count;
            self.widths[index] = width;
            count += width * height;
            self.firsts[index + 1..].fill(count);
        }
        if self.tiles.len() < count {
            self.tiles.resize(count, [0.0; 2]);
        }
        for (index, layer) in map.layers().take(6).enumerate() {
            let tiles = &mut self.tiles[self.firsts[index]..self.firsts[index + 1]];
            let columns = layer.projection().size()[0] as usize;
            for_each_row(tiles, self.widths[index], |row, tiles| {
                let texels = &layer.texels()[row * TILE * columns..];
                let texels = &texels[..texels.len().min(TILE * columns)];
                at_level!(level, fill_row(tiles, texels, columns));
            });
        }
    }

    /// Those of layer `index` of the map that was read last.
    pub fn layer(&self, index: usize) -> LayerExtrema<'_> {
        LayerExtrema {
            tiles: &self.tiles[self.firsts[index]..self.firsts[index + 1]],
            width: self.widths[index],
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.tiles.capacity() * size_of::<[f32; 2]>()
    }
}

/// Columns that are read side by side, row after row: sixteen cache lines, which is what memory likes to be asked for.
const STRIP: usize = 16 * TILE;

/// A row of tiles; at most [`TILE`] rows of texels.
#[inline(always)]
fn fill_row(tiles: &mut [[f32; 2]], texels: &[f32], columns: usize) {
    for (strip, tiles) in tiles.chunks_mut(STRIP / TILE).enumerate() {
        let first = strip * STRIP;
        let width = STRIP.min(columns - first);
        // One lane a column. Depths are never NaN.
        let (mut near, mut far) = ([f32::INFINITY; STRIP], [f32::NEG_INFINITY; STRIP]);
        for row in texels.chunks_exact(columns) {
            let lanes = near.iter_mut().zip(&mut far).zip(&row[first..first + width]);
            for ((near, far), &depth) in lanes {
                *near = if depth < *near { depth } else { *near };
                *far = if depth > *far { depth } else { *far };
            }
        }
        let lanes = near.chunks_exact(TILE).zip(far.chunks_exact(TILE));
        for (tile, (near, far)) in tiles.iter_mut().zip(lanes) {
            let nearest = near.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a });
            let farthest = far.iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a });
            *tile = [nearest, farthest];
        }
    }
}

fn for_each_row(tiles: &mut [[f32; 2]], width: usize, work: impl Fn(usize, &mut [[f32; 2]]) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        tiles.par_chunks_mut(width.max(1)).enumerate().for_each(|(row, tiles)| work(row, tiles));
    }
    #[cfg(not(feature = "rayon"))]
    tiles.chunks_mut(width.max(1)).enumerate().for_each(|(row, tiles)| work(row, tiles));
}
