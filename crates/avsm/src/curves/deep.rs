//! Deep shadow maps: as few nodes as keep a threshold, found over the whole curve (Lokovic and Veach 2000, Section 3.3).
//!
//! A greedy line: from a node of the output on, each further node of the exact curve narrows the window of slopes that pass
//! within the threshold of it; where the window closes, the line ends in the middle of the last window, and the next begins.
//!
//! Departure: their input is a line already. Ours is exponential between nodes, so long stretches are cut at so many points
//! that a chord lies within a quarter of the threshold of the curve; the points get the rest.

use crate::curve::{Between, OPAQUE, TransmittanceCurve};
use crate::curves::uncompressed::{ExactNodes, UncompressedCurve};
use crate::nodes::{Node, optical_depth_of, visit_nodes};
use scatter_core::TranslucentSegment;

/// A deep shadow map's texel: transmittance is linear between its nodes and nowhere farther than the threshold from the exact
/// curve. Compresses in [`TransmittanceCurve::finish`]; before, lookups are those of the exact curve.
#[derive(Debug, Clone)]
pub struct DeepCurve {
    threshold: f32,
    exact: UncompressedCurve,
    builder: DeepNodes,
    nodes: Vec<Node>,
}

impl DeepCurve {
    /// Of a threshold: the largest error of a transmittance, above 0 and at most 1; others are taken at the nearest of
    /// 1e-6 and 1.
    pub fn new(threshold: f32) -> Self {
        let threshold = if threshold > 1e-6 { threshold.min(1.0) } else { 1e-6 };
        Self {
            threshold,
            exact: UncompressedCurve::default(),
            builder: DeepNodes::default(),
            nodes: Vec::new(),
        }
    }

    /// The nodes after [`TransmittanceCurve::finish`].
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}

impl TransmittanceCurve for DeepCurve {
    const BETWEEN: Between = Between::Linear;

    fn insert(&mut self, segment: &TranslucentSegment) {
        self.exact.insert(segment);
        self.nodes.clear();
    }

    fn finish(&mut self) {
        self.exact.finish();
        self.builder.compress(self.exact.nodes(), self.threshold, &mut self.nodes);
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        if self.nodes.is_empty() {
            self.exact.optical_depth(depth)
        } else {
            optical_depth_of(&self.nodes, Between::Linear, depth)
        }
    }

    fn first_depth(&self) -> f32 {
        self.exact.first_depth()
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        if self.nodes.is_empty() {
            self.exact.visit(depths, each);
        } else {
            visit_nodes(&self.nodes, Between::Linear, depths, each);
        }
    }
}

/// Makes deep shadow maps' nodes. Holds its buffers for the next curve.
#[derive(Debug, Clone, Default)]
pub struct DeepNodes {
    exact: ExactNodes,
    whole: Vec<Node>,
    /// Depth and transmittance, in the order of depths.
    points: Vec<[f64; 2]>,
}

impl DeepNodes {
    /// Overwrites `nodes` with those of a texel's segments.
    pub fn build(&mut self, segments: &[TranslucentSegment], threshold: f32, nodes: &mut Vec<Node>) {
        let mut whole = std::mem::take(&mut self.whole);
        self.exact.build(segments, &mut whole);
        self.compress(&whole, threshold, nodes);
        self.whole = whole;
    }

    /// Overwrites `nodes` with the compressed ones of an exact curve's. O(points).
    pub fn compress(&mut self, exact: &[Node], threshold: f32, nodes: &mut Vec<Node>) {
        nodes.clear();
        let threshold = f64::from(threshold);
        self.cut(exact, 0.25 * threshold);
        // Nodes are rounded to f32: 6e-8 of τ, and τ·e^{−τ} is below 0.4.
        let allowed = 0.75 * threshold - 1e-7;
        let Some(&[first, _]) = self.points.first() else { return };
        let mut push = |depth: f64, left: f64| {
            let optical_depth =
                if left > 0.0 { (-left.ln()).min(OPAQUE.into()).max(0.0) } else { OPAQUE.into() };
            nodes.push(Node { depth: depth as f32, optical_depth: optical_depth as f32 });
        };
        let (mut start, mut at) = ([first, 1.0], 1);
        push(first, 1.0);
        while let Some(&[depth, left]) = self.points.get(at) {
            if depth <= start[0] {
                // A step where a line ends: a second node at that depth, unless the step is within what is allowed.
                if (left - start[1]).abs() > allowed {
                    start[1] = left.min(start[1]);
                    push(start[0], start[1]);
                }
                at += 1;
                continue;
            }
            // The slopes of falling lines that pass all points so far: never empty at the first one, since the line starts
            // within what is allowed of a curve that falls.
            let mut window = [f64::NEG_INFINITY, 0.0f64];
            let mut end = depth;
            for &[depth, left] in &self.points[at..] {
                let length = depth - start[0];
                // A line that ends below 0 would have to be bent.
                let bounds = [(left - allowed).max(0.0), left + allowed];
                let [low, high] = bounds.map(|bound| (bound - start[1]) / length);
                let narrowed = [window[0].max(low), window[1].min(high)];
                if !(narrowed[0] <= narrowed[1]) {
                    break;
                }
                (window, end) = (narrowed, depth);
                at += 1;
            }
            let slope = 0.5 * (window[0] + window[1]);
            start = [end, (start[1] + slope * (end - start[0])).clamp(0.0, start[1])];
            push(start[0], start[1]);
        }
    }

    /// The exact curve as points whose chords are within `gap` of it: a chord over an optical depth of x from T on lies at most
    /// T·x²/8 above the curve.
    fn cut(&mut self, exact: &[Node], gap: f64) {
        self.points.clear();
        for (index, node) in exact.iter().enumerate() {
            let [depth, sum] = [node.depth, node.optical_depth].map(f64::from);
            if let Some(before) =
                index.checked_sub(1).map(|at| exact[at]).filter(|before| before.depth < node.depth)
            {
                let [from, from_sum] = [before.depth, before.optical_depth].map(f64::from);
                let mut x = from_sum;
                loop {
                    x += (8.0 * gap * x.exp()).sqrt();
                    if !(x < sum) {
                        break;
                    }
                    // Nodes have depths in f32: what is rounded must be the depth alone, for the curve may be steep.
                    let place =
                        f64::from((from + (depth - from) * ((x - from_sum) / (sum - from_sum))) as f32);
                    if from < place && place < depth {
                        let there = from_sum + (sum - from_sum) * ((place - from) / (depth - from));
                        self.points.push([place, (-there).exp()]);
                    }
                    // The rest is a chord from less than the gap down to less.
                    if (-x).exp() < gap {
                        break;
                    }
                }
            }
            self.points.push([depth, (-sum).exp()]);
        }
    }

    /// Bytes that its buffers hold.
    pub fn memory_bytes(&self) -> u64 {
        let own = self.whole.capacity() * size_of::<Node>() + self.points.capacity() * size_of::<[f64; 2]>();
        self.exact.memory_bytes() + own as u64
    }
}
