//! Lists of nodes: depth and optical depth, in the order of their depths, as curves of any number of nodes store them.

use crate::curve::{Between, DARK};

/// A node of a curve: 8 bytes, as in the paper (Section 4.1). It holds the optical depth rather than the transmittance: a
/// thousand faint hairs near T = 1 would each be rounded to 6e-8, and products are sums.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Depth along the light's axis.
    pub depth: f32,
    /// `τ` up to there, 0 to [`OPAQUE`](crate::OPAQUE).
    pub optical_depth: f32,
}

/// A depth up to which a list of nodes dims nothing, and one behind which it passes [`DARK`](crate::DARK).
pub(crate) fn ends_of(nodes: &[Node]) -> [f32; 2] {
    let first = nodes.first().map_or(f32::INFINITY, |node| node.depth);
    let dark = nodes.iter().find(|node| node.optical_depth >= DARK);
    [first, dark.map_or(f32::INFINITY, |node| node.depth)]
}

/// `τ` at a depth: 0 before the first node, that of the last one behind it; binary search.
pub fn optical_depth_of(nodes: &[Node], between: Between, depth: f64) -> f64 {
    // A point at a node's own depth is before it: at a step it has what is before the step.
    let behind = nodes.partition_point(|node| f64::from(node.depth) < depth);
    optical_depth_after(nodes, behind, between, depth)
}

/// `τ` at a depth with `behind` nodes before it, those alone.
pub(crate) fn optical_depth_after(nodes: &[Node], behind: usize, between: Between, depth: f64) -> f64 {
    match (behind.checked_sub(1).map(|index| nodes[index]), nodes.get(behind)) {
        (None, _) => 0.0,
        (Some(last), None) => last.optical_depth.into(),
        (Some(left), Some(right)) => interpolated(left, *right, between, depth),
    }
}

/// `τ` between two nodes of different depths.
fn interpolated(left: Node, right: Node, between: Between, depth: f64) -> f64 {
    let [from, to] = [left, right].map(|node| f64::from(node.depth));
    let [a, b] = [left, right].map(|node| f64::from(node.optical_depth));
    let share = ((depth - from) / (to - from)).clamp(0.0, 1.0);
    match between {
        Between::Exponential => a + share * (b - a),
        // ln(T_a + share·(T_b − T_a)) relative to T_a, so that dark curves keep their digits.
        Between::Linear => (a - (share * (a - b).exp_m1()).ln_1p()).min(b),
    }
}

/// [`TransmittanceCurve::visit`](crate::TransmittanceCurve::visit) of a list of nodes.
pub fn visit_nodes(nodes: &[Node], between: Between, [from, to]: [f64; 2], mut each: impl FnMut(f64, f64)) {
    each(from, optical_depth_of(nodes, between, from));
    let first = nodes.partition_point(|node| f64::from(node.depth) < from);
    let inside = nodes[first..].iter().take_while(|node| f64::from(node.depth) < to);
    for node in inside {
        each(node.depth.into(), node.optical_depth.into());
    }
    each(to, optical_depth_of(nodes, between, to));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(depth: f32, optical_depth: f32) -> Node {
        Node { depth, optical_depth }
    }

    #[test]
    fn a_point_at_a_step_is_before_it() {
        let step = [node(1.0, 0.0), node(1.0, 0.7), node(3.0, 1.7)];
        for (depth, expected) in
            [(0.5, 0.0), (1.0, 0.0), (1.0 + 1e-9, 0.7), (2.0, 1.2), (3.0, 1.7), (9.0, 1.7)]
        {
            let found = optical_depth_of(&step, Between::Exponential, depth);
            assert!((found - expected).abs() < 1e-7, "{depth}: {found}");
        }
        // Halfway along a line of transmittances.
        let half = 0.5 * ((-0.7f64).exp() + (-1.7f64).exp());
        assert!((optical_depth_of(&step, Between::Linear, 2.0) + half.ln()).abs() < 1e-7);
    }

    #[test]
    fn a_visit_has_its_ends_and_all_knots_between() {
        let nodes = [node(1.0, 0.0), node(1.0, 0.5), node(2.0, 0.5), node(4.0, 2.5)];
        let visited = |depths: [f64; 2]| {
            let mut list = Vec::new();
            visit_nodes(&nodes, Between::Exponential, depths, |z, tau| list.push((z, tau)));
            list
        };
        assert_eq!(visited([0.0, 3.0]), [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (2.0, 0.5), (3.0, 1.5)]);
        assert_eq!(visited([1.0, 1.5]), [(1.0, 0.0), (1.0, 0.0), (1.0, 0.5), (1.5, 0.5)]);
        assert_eq!(visited([5.0, 6.0]), [(5.0, 2.5), (6.0, 2.5)]);
    }
}
