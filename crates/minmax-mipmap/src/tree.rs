//! The quadtree over a shadow map: nearest and farthest depth of blocks of 4×4, 8×8, … texels.
//!
//! The finest level are blocks of 4×4 texels, below that is the map itself: blocks of 2×2 and of 8×8 were measured to be
//! slower, and a quarter as many nodes stay in the caches. Nodes are 16-bit codes ([`DepthCodes`]). All levels stand in one
//! buffer of one pitch, level under level, so that a node's place follows from its level by a shift, without a table:
//!
//! ```text
//!     row(level, j) = 2·rows − (2·side >> level) + j,     side = 2ⁿ ≥ the map's height,   rows = side/4
//! ```

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, u32x16};
use scatter_core::{Level, ShadowLayer, at_level, parallel};

use crate::depth_codes::DepthCodes;

/// The level of the finest nodes: blocks of 2² × 2² texels.
pub(crate) const FINEST: u32 = 2;

/// The coarsest level that is built: 512×512 texels. Rays begin there at the coarsest, and coarser nodes of real maps are
/// neither light nor dark.
const COARSEST: u32 = 9;

/// Columns that every row has beyond its nodes: rows of a power of two of bytes would fall on the same cache lines.
const PADDING: usize = 16;

/// Nodes that are made at once.
const LANES: usize = 16;

/// Nearest and farthest depth of a block, as codes: bits 0 to 15 and 16 to 31.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node(pub u32);

impl Node {
    /// Code of the nearest depth: a ray whose code is ≤ is lit.
    pub fn nearest(self) -> f32 {
        (self.0 & 0xFFFF) as f32
    }

    /// Code of the farthest depth: a ray whose code is ≥ is dark.
    pub fn farthest(self) -> f32 {
        (self.0 >> 16) as f32
    }
}

/// Min/max mipmap of one layer. Buffers are reused from frame to frame.
#[derive(Debug, Clone)]
pub struct MinMaxTree {
    nodes: Vec<u32>,
    pitch: usize,
    /// Nodes of the finest level: columns, rows.
    finest: [usize; 2],
    /// Powers of two ≥ the map's width and height, ≥ 4.
    sides: [u32; 2],
    coarsest: u32,
    codes: DepthCodes,
}

impl Default for MinMaxTree {
    fn default() -> Self {
        let codes = DepthCodes::new([0.0, 1.0], false);
        Self { nodes: Vec::new(), pitch: PADDING, finest: [0; 2], sides: [4; 2], coarsest: FINEST, codes }
    }
}

impl MinMaxTree {
    /// Builds the tree of a layer, whose depths are coded by `codes`. One pass over the texels, O(texels), rows in
    /// parallel; a third of a byte a texel more than the map.
    pub fn build(&mut self, simd: Level, layer: &ShadowLayer<'_>, codes: DepthCodes) {
        let size = layer.projection().size();
        self.codes = codes;
        self.sides = size.map(|n| n.next_power_of_two().max(1 << FINEST));
        self.coarsest = COARSEST.min(self.sides[0].ilog2()).min(self.sides[1].ilog2());
        self.finest = size.map(|n| (n as usize).div_ceil(1 << FINEST));
        self.pitch = self.finest[0].next_multiple_of(LANES) + PADDING;
        let rows = 2 * (self.sides[1] >> FINEST) as usize;
        // Nodes that are not written are never decisive: their place is beyond the map.
        self.nodes.resize(rows * self.pitch, 0);

        let (pitch, finest) = (self.pitch, self.finest);
        parallel::for_each_row(&mut self.nodes[..finest[1] * pitch], pitch, |j, row| {
            at_level!(simd, vectors => finest_row(vectors, layer, &codes, j, row));
        });
        for level in FINEST + 1..=self.coarsest {
            let from = self.first_row(level - 1) * pitch;
            let to = self.first_row(level) * pitch;
            let (below, above) = self.nodes.split_at_mut(to);
            let [columns, rows] = [0, 1].map(|axis| finest[axis].div_ceil(1 << (level - FINEST)));
            let last_below = finest[1].div_ceil(1 << (level - 1 - FINEST)) - 1;
            let columns_below = finest[0].div_ceil(1 << (level - 1 - FINEST));
            let below = &below[from..];
            parallel::for_each_row(&mut above[..rows * pitch], pitch, |j, row| {
                let pair = [2 * j, (2 * j + 1).min(last_below)].map(|j| &below[j * pitch..][..pitch]);
                at_level!(simd, vectors => coarser_row(vectors, pair, columns_below, &mut row[..columns]));
            });
        }
    }

    /// How its depths are coded.
    pub fn codes(&self) -> &DepthCodes {
        &self.codes
    }

    /// The coarsest level.
    pub fn coarsest(&self) -> u32 {
        self.coarsest
    }

    /// The finest level: blocks of 4×4 texels.
    pub fn finest(&self) -> u32 {
        FINEST
    }

    /// The node of a level, [`Self::finest`] to [`Self::coarsest`], that contains texel `(i, j)`.
    pub fn node(&self, level: u32, i: u32, j: u32) -> Node {
        let row = self.first_row(level) + (j >> level) as usize;
        Node(self.nodes[row * self.pitch + (i >> level) as usize])
    }

    /// Powers of two ≥ the map's width and height, ≥ 4.
    pub(crate) fn sides(&self) -> [u32; 2] {
        self.sides
    }

    /// All nodes, and how far a row is from the next one.
    pub(crate) fn rows(&self) -> (&[u32], usize) {
        (&self.nodes, self.pitch)
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        (self.nodes.capacity() * size_of::<u32>()) as u64
    }

    fn first_row(&self, level: u32) -> usize {
        (2 * (self.sides[1] >> FINEST) - ((2 * self.sides[1]) >> level)) as usize
    }
}

/// Nodes of one row of blocks of 4×4 texels.
#[inline(always)]
fn finest_row<S: Simd>(simd: S, layer: &ShadowLayer<'_>, codes: &DepthCodes, j: usize, row: &mut [u32]) {
    const SIDE: usize = 1 << FINEST;
    let [width, height] = layer.projection().size().map(|n| n as usize);
    // The last row of blocks may be cut: its last row of texels stands for what is missing.
    let lines: [&[f32]; SIDE] =
        std::array::from_fn(|n| &layer.texels()[(SIDE * j + n).min(height - 1) * width..][..width]);
    let mut nodes = row.chunks_exact_mut(LANES);
    let mut first = 0;
    while first < width {
        let Some(nodes) = nodes.next() else { break };
        let (nearest, farthest) = if first + SIDE * LANES <= width {
            let a = column_bounds(simd, &lines, first);
            let b = column_bounds(simd, &lines, first + LANES);
            let c = column_bounds(simd, &lines, first + 2 * LANES);
            let d = column_bounds(simd, &lines, first + 3 * LANES);
            (
                least_of_pairs(least_of_pairs(a[0], b[0]), least_of_pairs(c[0], d[0])),
                most_of_pairs(most_of_pairs(a[1], b[1]), most_of_pairs(c[1], d[1])),
            )
        } else {
            let (mut nearest, mut farthest) = ([f32::INFINITY; LANES], [0.0f32; LANES]);
            for line in lines {
                for (n, &depth) in line[first..].iter().enumerate() {
                    nearest[n / SIDE] = nearest[n / SIDE].min(depth);
                    farthest[n / SIDE] = farthest[n / SIDE].max(depth);
                }
            }
            (f32x16::from_slice(simd, &nearest), f32x16::from_slice(simd, &farthest))
        };
        codes.encode(simd, nearest, farthest).store_slice(nodes);
        first += SIDE * LANES;
    }
}

/// Least and greatest of four lines in sixteen columns.
#[inline(always)]
fn column_bounds<S: Simd>(simd: S, lines: &[&[f32]; 4], first: usize) -> [f32x16<S>; 2] {
    let a = f32x16::from_slice(simd, &lines[0][first..][..LANES]);
    let b = f32x16::from_slice(simd, &lines[1][first..][..LANES]);
    let c = f32x16::from_slice(simd, &lines[2][first..][..LANES]);
    let d = f32x16::from_slice(simd, &lines[3][first..][..LANES]);
    [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]
}

/// The lesser ones of sixteen pairs of neighbours.
#[inline(always)]
fn least_of_pairs<S: Simd>(a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    let (even, odd) = a.deinterleave(b);
    even.min(odd)
}

/// The greater ones of sixteen pairs of neighbours.
#[inline(always)]
fn most_of_pairs<S: Simd>(a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    let (even, odd) = a.deinterleave(b);
    even.max(odd)
}

/// Nodes that enclose two nodes each.
#[inline(always)]
fn enclosing<S: Simd>(a: u32x16<S>, b: u32x16<S>) -> u32x16<S> {
    // The farthest depth stands in the upper half, so of two nodes the greater one has it.
    (a & 0xFFFF).min(b & 0xFFFF) | (a.max(b) & 0xFFFF_0000)
}

#[inline(always)]
fn row_of<S: Simd>(simd: S, line: &[u32], first: usize) -> u32x16<S> {
    u32x16::from_slice(simd, &line[first..][..LANES])
}

/// Nodes of one row of a level from the two rows below.
#[inline(always)]
fn coarser_row<S: Simd>(simd: S, below: [&[u32]; 2], columns_below: usize, row: &mut [u32]) {
    let mut done = 0;
    for nodes in row.chunks_exact_mut(LANES) {
        // A pair whose second half is beyond the map is not among whole chunks: the last column is made below.
        if 2 * (done + LANES) > columns_below {
            break;
        }
        let [first, second] = [2 * done, 2 * done + LANES];
        let a = enclosing(row_of(simd, below[0], first), row_of(simd, below[1], first));
        let b = enclosing(row_of(simd, below[0], second), row_of(simd, below[1], second));
        let (even, odd) = a.deinterleave(b);
        enclosing(even, odd).store_slice(nodes);
        done += LANES;
    }
    for (i, node) in row.iter_mut().enumerate().skip(done) {
        let columns = [2 * i, (2 * i + 1).min(columns_below - 1)];
        let all = below.iter().flat_map(|line| columns.map(|i| line[i]));
        *node = all.fold(0xFFFF, |node, other| {
            (node & 0xFFFF).min(other & 0xFFFF) | (node >> 16).max(other >> 16) << 16
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::MapProjection;
    use scatter_testing::Random;

    /// Codes of a node against the depths of its texels, for maps of odd sizes on both paths.
    #[test]
    fn nodes_enclose_their_texels_tightly() {
        for (size, simd) in [
            ([1, 1], Level::new()),
            ([3, 5], Level::new()),
            ([64, 4], Level::new()),
            ([257, 130], Level::new()),
            ([130, 257], Level::baseline()),
            ([512, 512], Level::new()),
        ] {
            let mut random = Random(u64::from(size[0]));
            let texels: Vec<f32> = (0..size[0] * size[1])
                .map(|_| if random.below(40) == 0 { f32::INFINITY } else { random.range(2.0, 9.0) as f32 })
                .collect();
            let projection =
                MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [1.0; 2], size)
                    .unwrap();
            let layer = ShadowLayer::new(projection, &texels).unwrap();
            let codes = DepthCodes::new([1.0, 10.0], false);
            // What an earlier map left must not matter.
            let mut tree = MinMaxTree { nodes: vec![0x1234_5678; 99], ..MinMaxTree::default() };
            tree.build(simd, &layer, codes);
            for level in FINEST..=tree.coarsest() {
                for (bj, bi) in (0..size[1].div_ceil(1 << level))
                    .flat_map(|j| (0..size[0].div_ceil(1 << level)).map(move |i| (j, i)))
                {
                    let (mut nearest, mut farthest) = (f32::INFINITY, 0.0f32);
                    for j in bj << level..size[1].min((bj + 1) << level) {
                        for i in bi << level..size[0].min((bi + 1) << level) {
                            nearest = nearest.min(layer.at(i, j));
                            farthest = farthest.max(layer.at(i, j));
                        }
                    }
                    let node = tree.node(level, bi << level, bj << level);
                    let expected = |depth: f32| {
                        if depth == f32::INFINITY {
                            LAST_CODE
                        } else {
                            codes.of_ray([depth.into(), 0.0])[0] as f32
                        }
                    };
                    let (low, high) =
                        (expected(nearest) - node.nearest(), node.farthest() - expected(farthest));
                    assert!(
                        (0.0..1.2).contains(&low) && (0.0..1.2).contains(&high),
                        "{size:?} {level} {bi} {bj}: {low} {high}"
                    );
                }
            }
        }
    }

    const LAST_CODE: f32 = crate::depth_codes::LAST;
}
