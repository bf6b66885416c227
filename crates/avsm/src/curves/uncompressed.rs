//! Uncompressed curves: every segment's ends are nodes. The truth that the others are measured against.

use crate::curve::{Between, OPAQUE, TransmittanceCurve, normalised};
use crate::nodes::{Node, optical_depth_of, visit_nodes};
use scatter_core::TranslucentSegment;

/// The exact curve of any number of segments: at most two nodes each, which lie between segments' ends. Sums in f64, nodes
/// rounded to f32.
#[derive(Debug, Clone, Default)]
pub struct UncompressedCurve {
    builder: ExactNodes,
    segments: Vec<TranslucentSegment>,
    nodes: Vec<Node>,
}

impl UncompressedCurve {
    /// Forgets all segments and keeps the memory.
    pub fn clear(&mut self) {
        self.segments.clear();
        self.nodes.clear();
    }

    /// The nodes after [`TransmittanceCurve::finish`].
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}

impl TransmittanceCurve for UncompressedCurve {
    fn insert(&mut self, segment: &TranslucentSegment) {
        self.segments.push(*segment);
        // Nodes that lack a segment are none.
        self.nodes.clear();
    }

    fn finish(&mut self) {
        self.builder.build(&self.segments, &mut self.nodes);
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        if self.nodes.is_empty() {
            let crossed = self
                .segments
                .iter()
                .filter_map(normalised)
                .map(|segment| segment.optical_depth_before(depth));
            crossed.sum::<f64>().min(OPAQUE.into())
        } else {
            optical_depth_of(&self.nodes, Between::Exponential, depth)
        }
    }

    fn first_depth(&self) -> f32 {
        let segments = self.segments.iter().filter_map(normalised);
        segments.map(|segment| segment.entry).fold(f32::INFINITY, f32::min)
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        if self.nodes.is_empty() && !self.segments.is_empty() {
            let mut nodes = Vec::new();
            ExactNodes::default().build(&self.segments, &mut nodes);
            return visit_nodes(&nodes, Between::Exponential, depths, each);
        }
        visit_nodes(&self.nodes, Between::Exponential, depths, each);
    }
}

/// Makes the nodes of the exact curve of a list of segments. Holds its buffers for the next list.
#[derive(Debug, Clone, Default)]
pub struct ExactNodes {
    sorted: Vec<TranslucentSegment>,
    depths: Vec<f32>,
    open: Vec<TranslucentSegment>,
}

impl ExactNodes {
    /// Overwrites `nodes` with the curve's: at each segment's end the sum of what has been crossed there, and two nodes at
    /// the depth of a hair. O(n·(log n + segments that overlap)).
    ///
    /// Sums are added up anew at every node over the segments that are open there: rates that are added and taken away again
    /// would leave the rounding of the densest one in all that follows.
    pub fn build(&mut self, segments: &[TranslucentSegment], nodes: &mut Vec<Node>) {
        let Self { sorted, depths, open } = self;
        nodes.clear();
        sorted.clear();
        sorted.extend(segments.iter().filter_map(normalised));
        sorted.sort_unstable_by(|a, b| a.entry.total_cmp(&b.entry).then(a.exit.total_cmp(&b.exit)));
        depths.clear();
        depths.extend(sorted.iter().flat_map(|segment| [segment.entry, segment.exit]));
        depths.sort_unstable_by(f32::total_cmp);
        depths.dedup();
        open.clear();
        let mut closed = 0.0f64;
        let mut next = 0;
        let node = |depth: f32, sum: f64| Node { depth, optical_depth: sum.min(OPAQUE.into()) as f32 };
        for &depth in depths.iter() {
            let partly: f64 = open.iter().map(|segment| segment.optical_depth_before(depth.into())).sum();
            nodes.push(node(depth, closed + partly));
            open.retain(|segment| {
                let ends = segment.exit <= depth;
                closed += if ends { f64::from(segment.optical_depth) } else { 0.0 };
                !ends
            });
            let mut step = 0.0;
            while let Some(segment) = sorted.get(next).filter(|segment| segment.entry <= depth) {
                if segment.exit > depth {
                    open.push(*segment);
                } else {
                    step += f64::from(segment.optical_depth);
                }
                next += 1;
            }
            if step > 0.0 {
                closed += step;
                let partly: f64 = open.iter().map(|segment| segment.optical_depth_before(depth.into())).sum();
                nodes.push(node(depth, closed + partly));
            }
            if closed >= f64::from(OPAQUE) {
                break;
            }
        }
        // Sums of other orders may differ by an ulp.
        let mut highest = 0.0f32;
        for node in nodes.iter_mut() {
            highest = highest.max(node.optical_depth);
            node.optical_depth = highest;
        }
    }

    /// Bytes that its buffers hold.
    pub fn memory_bytes(&self) -> u64 {
        let segments = (self.sorted.capacity() + self.open.capacity()) * size_of::<TranslucentSegment>();
        (segments + self.depths.capacity() * size_of::<f32>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_the_sum_over_all_segments() {
        let mut curve = UncompressedCurve::default();
        for n in 0..300u32 {
            let x = (n as f32 * 0.37).sin() * 5.0 + 6.0;
            let length = (n % 7) as f32 * 0.3;
            let segment =
                TranslucentSegment { entry: x, exit: x + length, optical_depth: 0.01 * (n % 5) as f32 };
            curve.insert(&segment);
        }
        let slowly: Vec<f64> = (0..2000).map(|n| curve.optical_depth(f64::from(n) * 0.007)).collect();
        curve.finish();
        assert!(curve.nodes().len() > 250);
        for (n, expected) in slowly.into_iter().enumerate() {
            let found = curve.optical_depth(n as f64 * 0.007);
            // Nodes are rounded to f32.
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected), "{n}: {found} {expected}");
        }
    }

    #[test]
    fn nothing_is_left_behind_an_opaque_surface() {
        let mut curve = UncompressedCurve::default();
        curve.insert(&TranslucentSegment::hair(2.0, 1.0));
        curve.insert(&TranslucentSegment::volume(1.0, 3.0, 0.5));
        curve.finish();
        assert!((curve.transmittance(2.0) - (-0.5f64).exp()).abs() < 1e-7);
        assert_eq!(curve.transmittance(2.0 + 1e-9), 0.0);
    }
}
