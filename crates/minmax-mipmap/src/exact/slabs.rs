//! Before any ray goes its own way: slabs of a block of 8×8 pixels' rays that are all lit or all dark.
//!
//! A slab is what lies between two depths of the camera on all rays of a block. Its bounds in a parallel map are those of
//! the rays at the block's corners, and two by two nodes of the mipmap hold them. Sixteen slabs a block, of which those
//! that are neither lit nor dark are cut in four once more; only there do rays become segments. Perspective maps, in which
//! bounds are not linear, have one slab.

use super::ray_fan::{LANES, Wide};
use crate::depth_codes::DepthCodes;
use crate::tree::MinMaxTree;

/// Slabs of the first look; each that is mixed is cut in [`PARTS`].
const SLABS: usize = LANES;
/// Parts of a mixed slab.
const PARTS: usize = 4;

/// How far beyond its bounds a slab looks \[texels\]: more than f32 rounds indices of a map of 65536 texels.
const MARGIN: f64 = 0.02;

/// What a slab is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Before all surfaces.
    Lit,
    /// Behind all surfaces.
    Dark,
    /// Some rays may be lit and some dark.
    Mixed,
}

/// Slabs in order, neighbours of one kind joined; they tile the rays.
#[derive(Debug, Clone, Copy)]
pub struct Slabs {
    /// Where each ends \[the camera's depth\], the last one at ∞.
    ends: [f64; SLABS * PARTS],
    kinds: [Kind; SLABS * PARTS],
    count: usize,
}

/// Bounds of a block's rays in a parallel map: least and greatest start and step, of column, row and code.
#[derive(Debug, Clone, Copy)]
pub struct BlockBounds {
    /// `[column, row, code][least, greatest]` at depth 0.
    pub start: [[f64; 2]; 3],
    /// The same a unit of depth.
    pub step: [[f64; 2]; 3],
}

impl Slabs {
    /// One slab of which nothing is known.
    pub const UNKNOWN: Self =
        Self { ends: [f64::INFINITY; SLABS * PARTS], kinds: [Kind::Mixed; SLABS * PARTS], count: 1 };

    /// Of a block whose rays are in the map between two depths, `from < to`.
    #[inline(always)]
    pub fn of(tree: &MinMaxTree, size: [u32; 2], bounds: &BlockBounds, [from, to]: [f64; 2]) -> Self {
        let width = (to - from) / SLABS as f64;
        let mut slabs = Self { count: 0, ..Self::UNKNOWN };
        if !(width > 0.0 && width.is_finite()) {
            return Self::UNKNOWN;
        }
        let mut edges = [0.0; LANES];
        for (n, edge) in edges.iter_mut().enumerate() {
            *edge = from + width * n as f64;
        }
        let coarse = classified(tree, size, bounds, &edges, width);
        let mut n = 0;
        while n < SLABS {
            // Four mixed ones are cut together.
            let (mut mixed, mut cut) = ([0; PARTS], 0);
            let first = n;
            while n < SLABS && cut < PARTS {
                if coarse[n] == Kind::Mixed {
                    mixed[cut] = n;
                    cut += 1;
                }
                n += 1;
            }
            let mut fine = [Kind::Mixed; LANES];
            if cut > 0 {
                let mut parts = [from; LANES];
                for (part, edge) in parts.iter_mut().enumerate() {
                    *edge = edges[mixed[(part / PARTS).min(cut - 1)]]
                        + width * (part % PARTS) as f64 / PARTS as f64;
                }
                fine = classified(tree, size, bounds, &parts, width / PARTS as f64);
            }
            let mut seen = 0;
            for slab in first..n {
                if coarse[slab] == Kind::Mixed {
                    for part in 0..PARTS {
                        let end = edges[slab] + width * (part + 1) as f64 / PARTS as f64;
                        slabs.push(fine[PARTS * seen + part], end);
                    }
                    seen += 1;
                } else {
                    slabs.push(coarse[slab], edges[slab] + width);
                }
            }
        }
        // Rays that end later by rounding belong to the last one.
        slabs.ends[slabs.count - 1] = f64::INFINITY;
        slabs
    }

    /// Kind, start and end of each; the first one begins at −∞.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (Kind, f64, f64)> {
        (0..self.count).map(|n| {
            let start = if n == 0 { f64::NEG_INFINITY } else { self.ends[n - 1] };
            (self.kinds[n], start, self.ends[n])
        })
    }

    #[inline(always)]
    fn push(&mut self, kind: Kind, end: f64) {
        if self.count == 0 || self.kinds[self.count - 1] != kind {
            self.kinds[self.count] = kind;
            self.count += 1;
        }
        self.ends[self.count - 1] = end;
    }
}

/// What the slabs are that begin at `edges` and are `width` deep.
#[inline(always)]
fn classified(
    tree: &MinMaxTree,
    size: [u32; 2],
    bounds: &BlockBounds,
    edges: &Wide,
    width: f64,
) -> [Kind; LANES] {
    let [columns, rows, codes] = [0, 1, 2].map(|axis| ranges(bounds, axis, edges, width));
    let mut kinds = [Kind::Mixed; LANES];
    for (n, kind) in kinds.iter_mut().enumerate() {
        let texels = |range: &[Wide; 2], size: u32| {
            let last = f64::from(size - 1);
            [
                (range[0][n] - MARGIN).max(0.0).min(last) as u32,
                (range[1][n] + MARGIN).max(0.0).min(last) as u32,
            ]
        };
        let (i, j) = (texels(&columns, size[0]), texels(&rows, size[1]));
        let extent = (i[1] - i[0]).max(j[1] - j[0]);
        // The finest level of which two blocks a side hold that many texels and one.
        let level = u32::BITS - (extent | ((1 << tree.finest()) - 1)).leading_zeros();
        if level > tree.coarsest() {
            continue;
        }
        let (mut nearest, mut farthest) = (f32::INFINITY, 0.0f32);
        for (i, j) in [(i[0], j[0]), (i[1], j[0]), (i[0], j[1]), (i[1], j[1])] {
            let node = tree.node(level, i, j);
            nearest = nearest.min(node.nearest());
            farthest = farthest.max(node.farthest());
        }
        let code = |code: f64| DepthCodes::clamp(code as f32);
        if code(codes[1][n]) <= nearest {
            *kind = Kind::Lit;
        } else if code(codes[0][n]) >= farthest {
            *kind = Kind::Dark;
        }
    }
    kinds
}

/// Least and greatest of one coordinate in each slab: bilinear in depth and step, so its bounds are at the ends.
#[inline(always)]
fn ranges(bounds: &BlockBounds, axis: usize, edges: &Wide, width: f64) -> [Wide; 2] {
    let (start, step) = (bounds.start[axis], bounds.step[axis]);
    let mut range = [[0.0; LANES]; 2];
    for n in 0..LANES {
        let (a, b) = (edges[n], edges[n] + width);
        range[0][n] = start[0] + (a * step[0]).min(b * step[0]);
        range[1][n] = start[1] + (a * step[1]).max(b * step[1]);
    }
    range
}
