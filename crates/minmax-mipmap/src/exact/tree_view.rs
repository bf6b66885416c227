//! A mipmap as packets of lanes read it: sixteen nodes at a time.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, u32x16};

use super::lanes::{Indices, Reals, index};
use super::ray_fan::LANES;
use crate::tree::{FINEST, MinMaxTree};

/// A tree's nodes in their one buffer.
#[derive(Clone, Copy)]
pub struct TreeView<'a> {
    nodes: &'a [u32],
    pitch: i32,
    /// Powers of two ≥ the map's width and height.
    pub sides: [i32; 2],
    /// The coarsest level that there is.
    pub coarsest: i32,
}

impl<'a> TreeView<'a> {
    /// Of a tree.
    pub fn new(tree: &'a MinMaxTree) -> Self {
        let (nodes, pitch) = tree.rows();
        let sides = tree.sides().map(|side| side as i32);
        Self { nodes, pitch: pitch as i32, sides, coarsest: tree.coarsest() as i32 }
    }

    /// Where the nodes of column and row of their levels stand.
    #[inline(always)]
    pub fn places<S: Simd>(&self, simd: S, level: Indices<S>, [column, row]: [Indices<S>; 2]) -> Indices<S> {
        let row = row - (index(simd, 2 * self.sides[1]) >> level);
        (row + 2 * (self.sides[1] >> FINEST)) * index(simd, self.pitch) + column
    }

    /// Codes of the nearest and the farthest depth of nodes at their places; places of lanes that are done may be any.
    #[inline(always)]
    pub fn fetch<S: Simd>(&self, simd: S, at: Indices<S>) -> [Reals<S>; 2] {
        let at: u32x16<S> = at.bitcast();
        let at = at.min(self.nodes.len() as u32 - 1).to_array();
        let mut nodes = [0; LANES];
        for lane in 0..LANES {
            nodes[lane] = self.nodes[at[lane] as usize];
        }
        let nodes = u32x16::load_array(simd, nodes);
        [
            (nodes & 0xFFFF).bitcast::<Indices<S>>().to_float(),
            (nodes >> 16).bitcast::<Indices<S>>().to_float(),
        ]
    }
}
