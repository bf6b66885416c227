//! The row of one slice: the texels that its lines cross, and a min/max binary tree over each line (Chen et al. 2011;
//! Yusov 2012, Section 6.3).
//!
//! A line is cut into blocks of sixteen texel columns, those of the tiles of [`MinMaxTiles`](epipolar::rows::MinMaxTiles).
//!
//! ```text
//! lay          every line's blocks from the tiles, and the levels above them     O(columns/16) a slice
//! read_block   a block's texels and the levels below it                          when the first ray looks into it
//! ```
//!
//! Departures from both papers: a row's upper levels come from tiles that are read once a frame, and only the blocks into
//! which a view ray looks are read from the map at all. A column has two cells that end where the line crosses from texel
//! to texel, where the papers sample one texel a step: so along the slice the row is the map's own visibility. Nodes over
//! tiles are wider than nodes over the row, which costs nodes and changes no answer.

use epipolar::driver::SliceView;
use epipolar::rows::{DepthAlong, MapLine, TILE_SIDE};
use scatter_core::{Frame, at_level};

use super::tree_kind::TreeKind;

/// Texel columns of a block.
pub(super) const BLOCK: usize = TILE_SIDE;

/// The level of a node that is a block.
pub(super) const BLOCK_LEVEL: u32 = BLOCK.trailing_zeros();

/// Nodes of a block below its own, two of them unused: a power of two.
const BLOCK_NODES: usize = 2 * BLOCK;

/// Levels from blocks on, at the most: 2¹⁶ texels are 2¹² blocks.
const UPPER: usize = 14;

/// View coordinates are certain to that many columns: more than f32 rounds at 8,192 columns, well below a column.
const CERTAIN: f32 = 1.0 / 64.0;

/// Nearest and farthest key of a node: keys are depths, or −1/depth of a perspective map, or, in Chen's variant, numbers of lit
/// columns; a ray that stays at or before the nearest is lit, one that stays behind the farthest is dark.
pub(super) type Extrema = [f32; 2];

/// What no ray is before or behind: every ray descends.
const UNDECIDED: Extrema = [f32::NEG_INFINITY, f32::INFINITY];

/// The two cells of a texel column.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cells {
    /// Their keys: depths, or −1/depth.
    pub keys: [f32; 2],
    /// Where the first ends and the second begins \[texels along the line\].
    pub border: f32,
}

/// One line of a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowLine {
    /// Its layer in the shadow map.
    pub layer: usize,
    /// Where it lies.
    pub line: MapLine,
    /// Columns of its first block that lie before the line: columns are counted from the block's first on.
    pub before: u32,
    /// Number of its blocks.
    pub blocks: u32,
    /// The level of its coarsest nodes.
    pub top: u32,
    first_block: usize,
    /// Where the nodes of blocks, and of every level above them, begin.
    upper: [usize; UPPER],
}

/// The lines of one slice through all maps of its light, with their trees. A buffer: it is laid anew for each slice.
#[derive(Debug, Default)]
pub struct SliceRow {
    pub(super) lines: Vec<RowLine>,
    cells: Vec<[Cells; BLOCK]>,
    nodes: Vec<[Extrema; BLOCK_NODES]>,
    upper: Vec<Extrema>,
    is_read: Vec<bool>,
    pub(super) kind: TreeKind,
    view_columns: f32,
    /// Texel columns that were read.
    pub(super) columns_read: u64,
}

impl SliceRow {
    /// Room for any slice of a frame, so that the second frame allocates nothing.
    pub fn reserve(&mut self, frame: &Frame<'_>) {
        let sides = || frame.shadow().layers().map(|layer| layer.projection().size());
        let side = sides().flatten().max().unwrap_or(0) as usize;
        // A sun's slice may meet every cascade, in two stretches each; a lamp's half-plane four faces, or six of any cut.
        let lines = if frame.light().position().is_some() { 6 } else { 2 * sides().count() };
        let blocks = lines * (side.div_ceil(BLOCK) + 2);
        self.clear();
        self.lines.reserve(lines);
        self.make_room(blocks, 3 * blocks + lines * UPPER);
    }

    fn clear(&mut self) {
        self.lines.clear();
        self.columns_read = 0;
    }

    fn make_room(&mut self, blocks: usize, upper: usize) {
        if self.cells.len() < blocks {
            self.cells.resize(blocks, [Cells::default(); BLOCK]);
            self.nodes.resize(blocks, [UNDECIDED; BLOCK_NODES]);
            self.is_read.resize(blocks, false);
        }
        if self.upper.len() < upper {
            self.upper.resize(upper, UNDECIDED);
        }
    }

    /// Lays the lines of a slice, up to its reach, and the trees over their blocks.
    pub fn lay(&mut self, slice: &SliceView<'_>, kind: TreeKind) {
        self.clear();
        self.kind = kind;
        // One more than there are: all of them are told from the last one.
        self.view_columns = slice.order.count() as f32 + 1.0;
        let mut lines = std::mem::take(&mut self.lines);
        slice.for_each_line(|layer, line| {
            let into = line.first % BLOCK as i32;
            let before = if line.advance > 0 { into } else { BLOCK as i32 - 1 - into } as u32;
            let blocks = (line.columns + before).div_ceil(BLOCK as u32);
            lines.push(RowLine { layer, line, before, blocks, top: 0, first_block: 0, upper: [0; UPPER] });
        });
        let (mut block, mut upper) = (0, 0);
        for line in &mut lines {
            line.first_block = block;
            block += line.blocks as usize;
            let mut count = line.blocks as usize;
            line.top = BLOCK_LEVEL;
            for first in &mut line.upper {
                *first = upper;
                upper += count;
                if count <= 1 {
                    break;
                }
                count = count.div_ceil(2);
                line.top += 1;
            }
        }
        self.make_room(block, upper);
        self.is_read[..block].fill(false);
        if kind != TreeKind::None {
            for line in &lines {
                at_level!(slice.scene().simd, self.raise(slice, line));
            }
        }
        self.lines = lines;
    }

    /// The nodes of a line's blocks, from the tiles, and those above them.
    #[inline(always)]
    fn raise(&mut self, slice: &SliceView<'_>, row: &RowLine) {
        let tiles = slice.scene().tiles.layer(row.layer);
        let line = &row.line;
        let along_rows = line.strides[0] == 1;
        let [minor, slope] = line.minor;
        let first_tile = line.first / BLOCK as i32;
        let blocks = row.blocks as usize;
        let nodes = &mut self.upper[row.upper[0]..][..blocks];
        let at = |column: f32| (column - line.consumed).max(0.0).min(line.length);
        // Not negative, so that a cast rounds down.
        let texel = |t: f32| (minor + slope * t).max(0.0).min(line.last_minor) as i32 as usize / BLOCK;
        for (block, node) in nodes.iter_mut().enumerate() {
            let column = (block * BLOCK) as f32 - row.before as f32;
            let ends = [at(column), at(column + BLOCK as f32)];
            let along = (first_tile + line.advance * block as i32) as usize;
            let across = ends.map(texel);
            let [one, other] = across.map(|across| {
                let place =
                    if along_rows { across * tiles.width + along } else { along * tiles.width + across };
                tiles.extrema[place]
            });
            let depths = [one[0].min(other[0]), one[1].max(other[1])];
            *node = match self.kind {
                TreeKind::Chen => {
                    let mut seen = UNDECIDED_NONE;
                    for t in ends {
                        for depth in depths {
                            include(&mut seen, line.view_coordinate(t, depth, self.view_columns));
                        }
                    }
                    [seen[0] - CERTAIN, seen[1] + CERTAIN]
                }
                TreeKind::Yusov | TreeKind::None => depths.map(|depth| key_of(line, depth)),
            };
        }
        let mut count = blocks;
        for level in 1..=(row.top - BLOCK_LEVEL) as usize {
            let (finer, coarser) = self.upper.split_at_mut(row.upper[level]);
            let finer = &finer[row.upper[level - 1]..][..count];
            for (node, below) in coarser.iter_mut().zip(finer.chunks(2)) {
                let [one, other] = [below[0], below[below.len() - 1]];
                *node = [one[0].min(other[0]), one[1].max(other[1])];
            }
            count = count.div_ceil(2);
        }
    }

    /// The extrema of a node: `index` counts nodes of its level along the line. Nodes below blocks are there once
    /// [`Self::read`] has read theirs.
    #[inline(always)]
    pub(super) fn node(&self, row: &RowLine, level: u32, index: u32) -> Extrema {
        if level >= BLOCK_LEVEL {
            return self.upper[row.upper[(level - BLOCK_LEVEL) as usize] + index as usize];
        }
        let below = BLOCK_LEVEL - level;
        let within = index as usize & ((1 << below) - 1);
        // Level by level, the finest first: 0, 16, 24, 28, 30.
        let first = BLOCK_NODES - (BLOCK_NODES >> level);
        self.nodes[row.first_block + (index >> below) as usize][(first + within) & (BLOCK_NODES - 1)]
    }

    /// The cells of a column, of a block that was read.
    #[inline(always)]
    pub(super) fn cells(&self, row: &RowLine, column: u32) -> Cells {
        self.cells[row.first_block + column as usize / BLOCK][column as usize % BLOCK]
    }

    /// Whether a column's block was read.
    #[inline(always)]
    pub(super) fn is_read(&self, row: &RowLine, column: u32) -> bool {
        self.is_read[row.first_block + column as usize / BLOCK]
    }

    /// Reads the block of a column from the map.
    #[inline(never)]
    pub(super) fn read(&mut self, slice: &SliceView<'_>, row: &RowLine, column: u32) {
        let block = column as usize / BLOCK;
        let place = row.first_block + block;
        self.is_read[place] = true;
        self.columns_read += BLOCK as u64;
        let (cells, nodes) = (&mut self.cells[place], &mut self.nodes[place]);
        let texels = slice.texels(row.layer);
        let (kind, view_columns) = (self.kind, self.view_columns);
        at_level!(slice.scene().simd, read_block(row, texels, (kind, view_columns), block, cells, nodes));
        if kind != TreeKind::None {
            // The row's own texels are fewer than those of its tiles.
            self.upper[row.upper[0] + block] = nodes[BLOCK_NODES - 2];
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.lines.capacity() * size_of::<RowLine>()
            + self.cells.capacity() * size_of::<[Cells; BLOCK]>()
            + self.nodes.capacity() * size_of::<[Extrema; BLOCK_NODES]>()
            + self.upper.capacity() * size_of::<Extrema>()
            + self.is_read.capacity()
    }
}

/// The extrema of nothing.
const UNDECIDED_NONE: Extrema = [f32::INFINITY, f32::NEG_INFINITY];

#[inline(always)]
fn include([least, most]: &mut Extrema, value: f32) {
    *least = least.min(value);
    *most = most.max(value);
}

/// What a ray's value on a line is compared with: a depth, or −1/depth, in which a ray through a perspective map is a line.
#[inline(always)]
fn key_of(line: &MapLine, depth: f32) -> f32 {
    match line.depth_along {
        DepthAlong::Parallel { .. } => depth,
        DepthAlong::Perspective { .. } if depth < f32::INFINITY => -1.0 / depth,
        DepthAlong::Perspective { .. } => f32::INFINITY,
    }
}

/// Reads a block's cells, and makes its nodes.
#[inline(always)]
fn read_block(
    row: &RowLine,
    texels: &[f32],
    (kind, view_columns): (TreeKind, f32),
    block: usize,
    cells: &mut [Cells; BLOCK],
    nodes: &mut [Extrema; BLOCK_NODES],
) {
    let line = &row.line;
    let [minor, slope] = line.minor;
    let per_slope = if slope == 0.0 { 0.0 } else { 1.0 / slope };
    let last = line.columns as i32 - 1;
    let (mut from, mut border, mut to) = ([0.0f32; BLOCK], [0.0f32; BLOCK], [0.0f32; BLOCK]);
    let mut places = [[0u32; BLOCK]; 2];
    let strides = line.strides.map(|stride| stride as u32);
    for lane in 0..BLOCK {
        // Lanes before the line and behind it repeat its ends.
        let column = ((block * BLOCK + lane) as i32 - row.before as i32).clamp(0, last);
        let start = (column as f32 - line.consumed).max(0.0).min(line.length);
        let end = (column as f32 + 1.0 - line.consumed).min(line.length);
        // Not negative, so that a cast rounds down.
        let one = (minor + slope * start).max(0.0).min(line.last_minor) as i32 as f32;
        let other = (minor + slope * end).max(0.0).min(line.last_minor) as i32 as f32;
        let crossing = ((one.max(other) - minor) * per_slope).max(start).min(end);
        from[lane] = start;
        to[lane] = end;
        border[lane] = if one == other { end } else { crossing };
        let major = (line.first + line.advance * column) as u32 * strides[0];
        places[0][lane] = major + one as u32 * strides[1];
        places[1][lane] = major + other as u32 * strides[1];
    }
    let depths = places.map(|places| places.map(|place| texels[place as usize]));
    for lane in 0..BLOCK {
        let keys = [key_of(line, depths[0][lane]), key_of(line, depths[1][lane])];
        cells[lane] = Cells { keys, border: border[lane] };
    }
    match kind {
        // One visits all columns.
        TreeKind::None => return,
        TreeKind::Yusov => {
            for (node, cells) in nodes.iter_mut().zip(&*cells) {
                let [one, other] = cells.keys;
                *node = [one.min(other), one.max(other)];
            }
        }
        TreeKind::Chen => {
            for (lane, node) in nodes[..BLOCK].iter_mut().enumerate() {
                let mut seen = UNDECIDED_NONE;
                for (cell, ends) in
                    [[from[lane], border[lane]], [border[lane], to[lane]]].into_iter().enumerate()
                {
                    for t in ends {
                        include(&mut seen, line.view_coordinate(t, depths[cell][lane], view_columns));
                    }
                }
                *node = [seen[0] - CERTAIN, seen[1] + CERTAIN];
            }
        }
    }
    let (mut below, mut count) = (0, BLOCK);
    while count > 1 {
        let own = below + count;
        for index in 0..count / 2 {
            let [one, other] = [nodes[below + 2 * index], nodes[below + 2 * index + 1]];
            nodes[own + index] = [one[0].min(other[0]), one[1].max(other[1])];
        }
        (below, count) = (own, count / 2);
    }
}
