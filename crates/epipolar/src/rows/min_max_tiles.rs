//! The nearest and the farthest depth of each tile of a shadow map, so that a row steps over what is one run anyway.
//!
//! Indoors most light ends at a roof before any view ray sees it, outdoors most of it reaches the ground behind all of
//! them: whole stretches of a row are lit for no column, or for every one. Sixteen texels that cannot differ are known by
//! their extrema. (Min/max trees along rows, as in Chen et al. 2011, have to be built for each slice; these tiles are
//! built once a frame, in one pass over the map.)

use scatter_core::{Level, MAX_CASCADES, ShadowMap, at_level, parallel};

/// Texels along a side of the tiles that rows step over: a register of the widest kind. Fewer cost more than they let rows
/// step over.
pub const TILE_SIDE: usize = 16;

/// Texels along a side of the finest tiles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TileSide {
    /// 4: the leaves of a tree that single rays descend.
    Four,
    /// 8.
    Eight,
    /// [`TILE_SIDE`]: what rows step over.
    #[default]
    Sixteen,
}

/// Extrema of the tiles of all layers of a shadow map, in one level or in all of them: the base of a 2D min/max tree.
///
/// Level 0 has tiles of a [`TileSide`], each further level tiles of twice the side, up to a level of one tile. Depths are those
/// of the map: `+∞` is no surface.
#[derive(Debug, Clone, Default)]
pub struct MinMaxTiles {
    /// `[nearest, farthest]` depth a tile, row by row, level by level, layer by layer.
    extrema: Vec<[f32; 2]>,
    levels: Vec<LevelPlace>,
    /// First level of each layer.
    firsts: Vec<usize>,
}

/// Where the tiles of one level of one layer are.
#[derive(Debug, Clone, Copy)]
struct LevelPlace {
    first: usize,
    size: [usize; 2],
}

/// Extrema of the tiles of one level of one layer.
#[derive(Debug, Clone, Copy)]
pub struct LayerTiles<'a> {
    /// `[nearest, farthest]` depth a tile, `[row][column]`; ∞ is no surface.
    pub extrema: &'a [[f32; 2]],
    /// Tiles along a row.
    pub width: usize,
}

impl MinMaxTiles {
    /// Reads all layers of a shadow map for the tiles that rows step over: once, at the speed of memory.
    pub fn rebuild(&mut self, simd: Level, map: &ShadowMap<'_>) {
        self.lay_out(map, TILE_SIDE, false);
        self.fill_finest::<TILE_SIDE>(simd, map);
    }

    /// Reads all layers of a shadow map and makes every level. A third more than the finest level costs.
    pub fn rebuild_levels(&mut self, simd: Level, map: &ShadowMap<'_>, finest: TileSide) {
        let side = match finest {
            TileSide::Four => 4,
            TileSide::Eight => 8,
            TileSide::Sixteen => 16,
        };
        self.lay_out(map, side, true);
        match finest {
            TileSide::Four => self.fill_finest::<4>(simd, map),
            TileSide::Eight => self.fill_finest::<8>(simd, map),
            TileSide::Sixteen => self.fill_finest::<16>(simd, map),
        }
        for layer in 0..self.firsts.len() {
            for level in 1..self.level_count(layer) {
                let [below, own] = [level - 1, level].map(|level| self.levels[self.firsts[layer] + level]);
                // A level lies behind the one below it.
                let (finer, coarser) = self.extrema.split_at_mut(own.first);
                let finer = &finer[below.first..];
                for (row, tiles) in coarser[..own.size[0] * own.size[1]].chunks_mut(own.size[0]).enumerate() {
                    for (column, tile) in tiles.iter_mut().enumerate() {
                        *tile = [f32::INFINITY, f32::NEG_INFINITY];
                        for y in 2 * row..(2 * row + 2).min(below.size[1]) {
                            for x in 2 * column..(2 * column + 2).min(below.size[0]) {
                                let [near, far] = finer[y * below.size[0] + x];
                                *tile = [tile[0].min(near), tile[1].max(far)];
                            }
                        }
                    }
                }
            }
        }
    }

    /// Number of levels of a layer of the map that was read last, the finest included.
    pub fn level_count(&self, layer: usize) -> usize {
        let end = self.firsts.get(layer + 1).copied().unwrap_or(self.levels.len());
        end - self.firsts[layer]
    }

    /// Forgets the map that was read last: rows then read every texel, and are the same.
    pub fn forget(&mut self) {
        self.levels.clear();
        self.firsts.clear();
    }

    /// Whether a map was read and not forgotten.
    pub fn are_read(&self) -> bool {
        !self.firsts.is_empty()
    }

    /// The finest tiles of layer `index` of the map that was read last; none at all if it was forgotten.
    pub fn layer(&self, index: usize) -> LayerTiles<'_> {
        if self.are_read() { self.level(index, 0) } else { LayerTiles { extrema: &[], width: 0 } }
    }

    /// The finest tiles of a layer, to be changed: rows believe what they say.
    pub fn layer_mut(&mut self, index: usize) -> &mut [[f32; 2]] {
        let LevelPlace { first, size: [width, height] } = self.levels[self.firsts[index]];
        &mut self.extrema[first..first + width * height]
    }

    /// The tiles of one level of a layer; level 0 is the finest.
    pub fn level(&self, layer: usize, level: usize) -> LayerTiles<'_> {
        let LevelPlace { first, size: [width, height] } = self.levels[self.firsts[layer] + level];
        LayerTiles { extrema: &self.extrema[first..first + width * height], width }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.extrema.capacity() * size_of::<[f32; 2]>()
            + self.levels.capacity() * size_of::<LevelPlace>()
            + self.firsts.capacity() * size_of::<usize>()
    }

    /// Finds where the levels of all layers lie.
    fn lay_out(&mut self, map: &ShadowMap<'_>, side: usize, all_levels: bool) {
        /// Levels of the largest map: 65,536 texels a side in tiles of four.
        const MOST_LEVELS: usize = 15;
        self.levels.clear();
        self.firsts.clear();
        self.levels.reserve(if all_levels { MAX_CASCADES * MOST_LEVELS } else { MAX_CASCADES });
        self.firsts.reserve(MAX_CASCADES);
        let mut count = 0;
        for layer in map.layers() {
            self.firsts.push(self.levels.len());
            let mut size = layer.projection().size().map(|texels| (texels as usize).div_ceil(side));
            loop {
                self.levels.push(LevelPlace { first: count, size });
                count += size[0] * size[1];
                if !all_levels || size == [1, 1] {
                    break;
                }
                size = size.map(|tiles| tiles.div_ceil(2));
            }
        }
        if self.extrema.len() < count {
            self.extrema.resize(count, [0.0; 2]);
        }
    }

    fn fill_finest<const SIDE: usize>(&mut self, simd: Level, map: &ShadowMap<'_>) {
        for (&index, layer) in self.firsts.iter().zip(map.layers()) {
            let LevelPlace { first, size: [width, height] } = self.levels[index];
            let tiles = &mut self.extrema[first..first + width * height];
            let columns = layer.projection().size()[0] as usize;
            parallel::for_each_row(tiles, width.max(1), |row, tiles| {
                let texels = &layer.texels()[row * SIDE * columns..];
                let texels = &texels[..texels.len().min(SIDE * columns)];
                at_level!(simd, fill_row::<SIDE>(tiles, texels, columns));
            });
        }
    }
}

/// Rows that are read side by side: four streams, which is what memory likes to be asked for.
const ROWS: usize = 4;

/// A row of tiles of a side, and its texels: at most as many rows.
#[inline(always)]
fn fill_row<const SIDE: usize>(tiles: &mut [[f32; 2]], texels: &[f32], columns: usize) {
    tiles.fill([f32::INFINITY, f32::NEG_INFINITY]);
    for rows in texels.chunks(ROWS * columns) {
        // A row that is missing is the first one again.
        let rows: [&[f32]; ROWS] =
            std::array::from_fn(|n| rows.get(n * columns..(n + 1) * columns).unwrap_or(&rows[..columns]));
        for (index, tile) in tiles.iter_mut().enumerate() {
            let first = index * SIDE;
            let [mut near, mut far] = *tile;
            if let Some(pieces) = pieces::<SIDE>(&rows, first) {
                // One lane a column. Depths are never NaN.
                let (mut nears, mut fars) = (*pieces[0], *pieces[0]);
                for piece in &pieces[1..] {
                    for (lane, &depth) in piece.iter().enumerate() {
                        nears[lane] = lesser(nears[lane], depth);
                        fars[lane] = greater(fars[lane], depth);
                    }
                }
                // Halves against halves.
                let mut half = SIDE / 2;
                while half > 0 {
                    for lane in 0..half {
                        nears[lane] = lesser(nears[lane], nears[lane + half]);
                        fars[lane] = greater(fars[lane], fars[lane + half]);
                    }
                    half /= 2;
                }
                (near, far) = (lesser(near, nears[0]), greater(far, fars[0]));
            } else {
                for &depth in rows.iter().flat_map(|row| &row[first..]) {
                    (near, far) = (lesser(near, depth), greater(far, depth));
                }
            }
            *tile = [near, far];
        }
    }
}

/// The texels of a tile that has all of its columns, in each row.
#[inline(always)]
fn pieces<'a, const SIDE: usize>(rows: &[&'a [f32]; ROWS], first: usize) -> Option<[&'a [f32; SIDE]; ROWS]> {
    let mut pieces = [rows[0][first..].first_chunk()?; ROWS];
    for (piece, row) in pieces.iter_mut().zip(rows) {
        *piece = row[first..].first_chunk()?;
    }
    Some(pieces)
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
