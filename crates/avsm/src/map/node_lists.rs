//! Curves of any number of nodes for all texels of a map: bands of rows, each with a flat list of its own.

use scatter_core::{TranslucentSegment, parallel};

use crate::curve::Between;
use crate::curves::deep::DeepNodes;
use crate::curves::uncompressed::ExactNodes;
use crate::nodes::Node;

/// Rows of a band, which one thread fills.
const BAND: usize = 8;

/// Node lists of a map, `[row][column]`. Buffers are reused from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct NodeLists {
    width: usize,
    between: Between,
    bands: Vec<Band>,
}

#[derive(Debug, Clone, Default)]
struct Band {
    /// Where each texel's nodes begin, and where the last one's end.
    offsets: Vec<u32>,
    nodes: Vec<Node>,
    segments: Vec<TranslucentSegment>,
    own: Vec<Node>,
    exact: ExactNodes,
    deep: DeepNodes,
}

impl NodeLists {
    /// Builds the curves of `width` × `height` texels; `segments(texel, list)` appends a texel's segments to a list. With a
    /// threshold they are deep shadow maps', without they are exact.
    pub fn build(
        &mut self,
        [width, height]: [u32; 2],
        threshold: Option<f32>,
        segments: impl Fn(usize, &mut Vec<TranslucentSegment>) + Sync + Send,
    ) {
        self.width = width as usize;
        self.between = if threshold.is_some() { Between::Linear } else { Between::Exponential };
        let texels = width as usize * height as usize;
        let length = BAND * self.width;
        self.bands.resize_with(texels.div_ceil(length), Band::default);
        parallel::for_each_row(&mut self.bands, 1, |index, band| {
            let Some(Band { offsets, nodes, segments: list, own, exact, deep }) = band.first_mut() else {
                return;
            };
            offsets.clear();
            nodes.clear();
            offsets.push(0);
            for texel in index * length..texels.min((index + 1) * length) {
                list.clear();
                segments(texel, list);
                match threshold {
                    None => exact.build(list, own),
                    Some(threshold) => deep.build(list, threshold, own),
                }
                nodes.extend_from_slice(own);
                offsets.push(nodes.len() as u32);
            }
        });
    }

    /// How τ runs between two nodes.
    pub fn between(&self) -> Between {
        self.between
    }

    /// The nodes of a texel.
    pub fn nodes(&self, texel: usize) -> &[Node] {
        let length = BAND * self.width;
        let band = &self.bands[texel / length];
        let at = texel % length;
        &band.nodes[band.offsets[at] as usize..band.offsets[at + 1] as usize]
    }

    /// Bytes that it holds, its scratch memory included.
    pub fn memory_bytes(&self) -> u64 {
        let of = |band: &Band| {
            let nodes = (band.nodes.capacity() + band.own.capacity()) * size_of::<Node>();
            let segments = band.segments.capacity() * size_of::<TranslucentSegment>();
            (nodes + segments + band.offsets.capacity() * size_of::<u32>()) as u64
                + band.exact.memory_bytes()
                + band.deep.memory_bytes()
        };
        self.bands.iter().map(of).sum::<u64>() + (self.bands.capacity() * size_of::<Band>()) as u64
    }
}
