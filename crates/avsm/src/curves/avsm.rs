//! Adaptive curves: a fixed number of nodes, compressed while segments stream in (Salvi et al. 2010, Section 3.2).
//!
//! ```text
//! insert:   nodes before the entry          as they are
//!           entry (new), nodes inside       + what the segment has added by their depth
//!           exit (new), nodes behind it     + all of it
//! compress: while there are more than N nodes, remove the inner one whose loss changes the area least
//! ```
//!
//! Departures from the paper:
//! 1. Nodes hold the optical depth, not the transmittance: sums instead of products (`Node` says why).
//! 2. Between nodes the extinction is constant, so that the product of two curves is a curve again and insertion itself is
//!    exact: all error is that of removed nodes.
//! 3. Areas are those of these exponentials ([`Removal::Exponential`]); the paper's triangles are [`Removal::Triangle`].

use crate::curve::{Between, DARK, OPAQUE, TransmittanceCurve, normalised};
use crate::nodes::{Node, optical_depth_after};
use scatter_core::TranslucentSegment;
use scatter_core::exp_f32;

/// Room for a full curve of 16 nodes and a segment's two.
const WORK: usize = 18;

/// A transmittance curve of at most `N` nodes, `N` ≤ 16: 8·N bytes and nothing else (Salvi et al. 2010, Sections 3.2 and 4.1).
///
/// First and last node are kept, nodes never move, and transmittance falls from node to node, after any number of insertions.
/// A segment that lies wholly behind an opaque one is left out. O(N) an insertion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct AvsmCurve<const N: usize> {
    /// Rising; `+∞` of nodes that are free, which follow those that are not.
    depths: [f32; N],
    /// Rising; free nodes have the last one's.
    optical_depths: [f32; N],
}

/// The rule by which a full curve loses a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Removal {
    /// The area under the exponentials between nodes changes least.
    #[default]
    Exponential,
    /// The area of the triangle of three nodes is least, as if transmittance were linear (Section 3.2.1).
    Triangle,
    /// As [`Self::Exponential`], but of the two nodes that an insertion adds the pair is removed whose loss changes the area
    /// least together, where the other rules remove one after the other: O(N²) an insertion.
    LookAhead,
}

impl<const N: usize> Default for AvsmCurve<N> {
    fn default() -> Self {
        Self { depths: [f32::INFINITY; N], optical_depths: [0.0; N] }
    }
}

impl<const N: usize> AvsmCurve<N> {
    /// Puts a segment into the curve, by a rule of removal.
    pub fn insert_by(&mut self, segment: &TranslucentSegment, removal: Removal) {
        self.insert_and_see(segment, removal, |_| ());
    }

    /// As [`Self::insert_by`]; returns by how much the insertion may have changed the integral of the curve: added up over
    /// all insertions, a bound of `∫|T − T_exact| dz`, in units of depth.
    ///
    /// Constant extinction between nodes makes it one: the removal of a node changes τ to one side alone, so the change of the
    /// area is the integral of its own magnitude, and what is inserted later multiplies it by at most 1.
    ///
    /// The bound is that of the exponential between nodes and leaves out rounding, 6e-8 of τ a node and insertion.
    pub fn insert_bounded(&mut self, segment: &TranslucentSegment, removal: Removal) -> f64 {
        let mut bound = 0.0;
        self.insert_and_see(segment, removal, |[left, node, right]| {
            let area = |a: Node, b: Node| {
                let [from, to] = [a, b].map(|node| f64::from(node.optical_depth));
                let length = f64::from(b.depth) - f64::from(a.depth);
                let x = to - from;
                (-from).exp() * length * if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 }
            };
            bound += (area(left, node) + area(node, right) - area(left, right)).abs();
        });
        bound
    }

    #[inline]
    fn insert_and_see(
        &mut self,
        segment: &TranslucentSegment,
        removal: Removal,
        mut removed: impl FnMut([Node; 3]),
    ) {
        const { assert!(N >= 3 && N + 2 <= WORK, "3 to 16 nodes") };
        let Some(segment) = normalised(segment) else { return };
        let TranslucentSegment { entry, exit, optical_depth } = segment;
        let count = self.count();
        let before_entry = self.depths.iter().filter(|depth| **depth <= entry).count();
        let before_exit = before_entry.max(self.depths.iter().filter(|depth| **depth < exit).count());
        let at_entry = self.at(before_entry, count, entry);
        if at_entry >= OPAQUE {
            return;
        }
        let at_exit = self.at(before_exit, count, exit);
        // A hair's density is never asked for: no node lies between its ends.
        let density = if exit > entry { optical_depth / (exit - entry) } else { 0.0 };
        let mut depths = [f32::INFINITY; WORK];
        let mut sums = [0.0f32; WORK];
        let mut push = |at: usize, depth: f32, sum: f32| (depths[at], sums[at]) = (depth, sum);
        for index in 0..N {
            let (depth, sum) = (self.depths[index], self.optical_depths[index]);
            if index < before_entry {
                push(index, depth, sum);
            } else if index < before_exit {
                push(index + 1, depth, sum + (density * (depth - entry)).min(optical_depth));
            } else {
                push(index + 2, depth, sum + optical_depth);
            }
        }
        push(before_entry, entry, at_entry);
        push(before_exit + 1, exit, at_exit + optical_depth);
        let mut filled = count + 2;
        // Rounding of an interpolation may break the order by an ulp, and sums may pass what opaque is.
        let mut highest = 0.0f32;
        for sum in &mut sums[..filled] {
            highest = highest.max(*sum).min(OPAQUE);
            *sum = highest;
        }
        if filled > N {
            let mut left = [0.0f32; WORK];
            for (left, sum) in left.iter_mut().zip(&sums) {
                *left = exp_f32(-sum);
            }
            while filled > N {
                let index = match removal {
                    Removal::Exponential => least(filled, |at| exponential_change(&depths, &sums, &left, at)),
                    Removal::Triangle => least(filled, |at| triangle(&depths, &left, at)),
                    Removal::LookAhead if filled > N + 1 => {
                        first_of_least_pair(filled, &depths, &sums, &left)
                    }
                    Removal::LookAhead => least(filled, |at| exponential_change(&depths, &sums, &left, at)),
                };
                let node = |at: usize| Node { depth: depths[at], optical_depth: sums[at] };
                removed([index - 1, index, index + 1].map(node));
                for at in index..filled - 1 {
                    (depths[at], sums[at], left[at]) = (depths[at + 1], sums[at + 1], left[at + 1]);
                }
                filled -= 1;
                depths[filled] = f32::INFINITY;
            }
        }
        // Free nodes hold what has been crossed before them, so that no lookup needs to know how many there are.
        let last = sums[filled - 1];
        sums[filled..].fill(last);
        self.depths.copy_from_slice(&depths[..N]);
        self.optical_depths.copy_from_slice(&sums[..N]);
    }

    /// Depths and optical depths of all nodes, free ones at `+∞` with the last one's optical depth.
    pub(crate) fn lanes(&self) -> (&[f32; N], &[f32; N]) {
        (&self.depths, &self.optical_depths)
    }

    /// How many nodes there are, 0 to N.
    pub fn count(&self) -> usize {
        self.depths.iter().filter(|depth| **depth < f32::INFINITY).count()
    }

    /// The nodes in the order of their depths.
    pub fn nodes(&self) -> impl Iterator<Item = Node> + '_ {
        self.node_list().into_iter().take(self.count())
    }

    /// τ at a depth that has `before` of the `count` nodes before it.
    fn at(&self, before: usize, count: usize, depth: f32) -> f32 {
        if before == 0 {
            return 0.0;
        }
        let (left, left_sum) = (self.depths[before - 1], self.optical_depths[before - 1]);
        if before >= count || depth <= left {
            return left_sum;
        }
        let (right, right_sum) = (self.depths[before], self.optical_depths[before]);
        (left_sum + (right_sum - left_sum) * ((depth - left) / (right - left))).clamp(left_sum, right_sum)
    }

    fn node_list(&self) -> [Node; N] {
        std::array::from_fn(|at| Node { depth: self.depths[at], optical_depth: self.optical_depths[at] })
    }

    pub(crate) fn optical_depth_by(&self, between: Between, depth: f64) -> f64 {
        let before = self.depths.iter().filter(|node| f64::from(**node) < depth).count();
        optical_depth_after(&self.node_list()[..self.count()], before, between, depth)
    }

    pub(crate) fn visit_by(&self, between: Between, [from, to]: [f64; 2], mut each: impl FnMut(f64, f64)) {
        each(from, self.optical_depth_by(between, from));
        for (depth, sum) in self.depths.iter().zip(&self.optical_depths) {
            let depth = f64::from(*depth);
            if from <= depth && depth < to {
                each(depth, (*sum).into());
            }
        }
        each(to, self.optical_depth_by(between, to));
    }
}

impl<const N: usize> TransmittanceCurve for AvsmCurve<N> {
    fn insert(&mut self, segment: &TranslucentSegment) {
        self.insert_by(segment, Removal::default());
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        self.optical_depth_by(Between::Exponential, depth)
    }

    fn first_depth(&self) -> f32 {
        self.depths[0]
    }

    fn dark_depth(&self) -> f32 {
        let dark = self.optical_depths.iter().position(|sum| *sum >= DARK);
        dark.map_or(f32::INFINITY, |index| self.depths[index])
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self.visit_by(Between::Exponential, depths, each);
    }
}

/// The same nodes with transmittance linear between them (Salvi et al. 2010, Eq. 2): the paper's faster lookup.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct LinearAvsm<const N: usize>(pub AvsmCurve<N>);

impl<const N: usize> Default for LinearAvsm<N> {
    fn default() -> Self {
        Self(AvsmCurve::default())
    }
}

impl<const N: usize> TransmittanceCurve for LinearAvsm<N> {
    const BETWEEN: Between = Between::Linear;

    fn insert(&mut self, segment: &TranslucentSegment) {
        self.0.insert(segment);
    }

    fn optical_depth(&self, depth: f64) -> f64 {
        self.0.optical_depth_by(Between::Linear, depth)
    }

    fn first_depth(&self) -> f32 {
        self.0.first_depth()
    }

    fn dark_depth(&self) -> f32 {
        self.0.dark_depth()
    }

    fn visit(&self, depths: [f64; 2], each: impl FnMut(f64, f64)) {
        self.0.visit_by(Between::Linear, depths, each);
    }
}

/// The inner node, 1 to `filled − 2`, with the least change; a change that is not a number counts as the largest.
#[inline(always)]
fn least(filled: usize, change: impl Fn(usize) -> f32) -> usize {
    least_with_change(filled, change).1
}

#[inline(always)]
fn least_with_change(filled: usize, change: impl Fn(usize) -> f32) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for at in 1..WORK - 1 {
        let value = change(at);
        if at < filled - 1 && value < best.0 {
            best = (value, at);
        }
    }
    best
}

/// The node to be removed before the one that is then the least, so that both changes together are least.
fn first_of_least_pair(filled: usize, depths: &[f32; WORK], sums: &[f32; WORK], left: &[f32; WORK]) -> usize {
    let mut best = (f32::INFINITY, 1);
    for first in 1..filled - 1 {
        let own = exponential_change(depths, sums, left, first);
        let without = |values: &[f32; WORK]| {
            let mut rest = *values;
            rest.copy_within(first + 1.., first);
            rest
        };
        let (depths, sums, left) = (without(depths), without(sums), without(left));
        let then = least_with_change(filled - 1, |at| exponential_change(&depths, &sums, &left, at)).0;
        if own + then < best.0 {
            best = (own + then, first);
        }
    }
    best.1
}

/// Twice the area of the triangle of a node and its neighbours (Section 3.2.1).
#[inline(always)]
fn triangle(depths: &[f32; WORK], left: &[f32; WORK], at: usize) -> f32 {
    let (before, after) = (at - 1, at + 1);
    let outer = (depths[after] - depths[before]) * (left[after] - left[at]);
    let inner = (depths[after] - depths[at]) * (left[after] - left[before]);
    (outer - inner).abs()
}

/// By how much the area under the curve changes without a node, extinction constant between nodes.
#[inline(always)]
fn exponential_change(depths: &[f32; WORK], sums: &[f32; WORK], left: &[f32; WORK], at: usize) -> f32 {
    // Of unit length: (T_a − T_b)/(τ_b − τ_a); below 0.03 the series, whose next term is x³/24 of it, 1e-6.
    let mean = |a: usize, b: usize| {
        let x = sums[b] - sums[a];
        let series = left[a] * (1.0 - x * (0.5 - x * (1.0 / 6.0)));
        let quotient = (left[a] - left[b]) / x;
        if x < 0.03 { series } else { quotient }
    };
    let [first, second] = [depths[at] - depths[at - 1], depths[at + 1] - depths[at]];
    let whole = mean(at - 1, at + 1);
    // Both halves against the whole, so that long flat curves do not cancel.
    (first * (mean(at - 1, at) - whole) + second * (mean(at, at + 1) - whole)).abs()
}
