//! The sixteen ways to divide a quad whose neighbours may be one level finer (Billeter et al. 2010, Section 4.1).
//!
//! A quad has eight places for vertices, clockwise from its top left corner; the middle of a side is one where the quad beyond that
//! side is finer, so that the side has the same two edges from both sides and there is no T-junction. The diagonal from the top left
//! to the bottom right is always an edge, and each of the halves is a fan beside it:
//!
//! ```text
//!     0───1───2     upper half  0 2 4          lower half  4 6 0
//!     │ ╲     │       1 alone   0 1 4, 1 2 4     5 alone   4 5 0, 5 6 0
//!     7   ╲   3       3 alone   0 3 4, 0 2 3     7 alone   4 7 0, 4 6 7
//!     │     ╲ │       both      0 1 4, 1 3 4,    both      4 5 0, 5 7 0,
//!     6───5───4                 1 2 3                      5 6 7
//! ```
//!
//! So all triangles of a quad stand in one row, neighbours of which share a chord: which chords a straight line crosses follows
//! from the sides by which it comes in and goes out, without a comparison of numbers. Two triangles and one for each finer side:
//! six at the most, as in the paper.

/// The places of vertices, clockwise: column and row in halves of the side.
pub const PLACES: [[u8; 2]; 8] = [[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// How a quad is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stitching {
    /// Its triangles, clockwise, from the lower half's last to the upper half's last.
    triangles: [[u8; 3]; 6],
    count: u8,
    /// Between each triangle and the next, from its left end to its right one: what comes next lies above.
    chords: [[u8; 2]; 5],
    /// The triangle that has the edge from a place clockwise to the next vertex.
    owners: [u8; 8],
}

/// Indexed by the sides beyond which quads are finer: bit 0 the top, 1 the right, 2 the bottom, 3 the left.
pub const STITCHINGS: [Stitching; 16] = all();

impl Stitching {
    /// Its triangles.
    #[inline(always)]
    pub fn triangles(&self) -> &[[u8; 3]] {
        &self.triangles[..self.count as usize]
    }

    /// Its chords; the first lies between the first two triangles.
    #[inline(always)]
    pub fn chords(&self) -> &[[u8; 2]] {
        &self.chords[..self.count as usize - 1]
    }

    /// The triangle that has the edge that begins, clockwise, at a place.
    #[inline(always)]
    pub fn owner(&self, place: usize) -> usize {
        self.owners[place] as usize
    }

    /// The triangle over a point, relative to the top left corner in halves of the side.
    #[inline(always)]
    pub fn triangle_at(&self, [x, y]: [f64; 2]) -> usize {
        let is_above = |&&[p, q]: &&[u8; 2]| {
            let ([px, py], [qx, qy]) = (PLACES[p as usize].map(f64::from), PLACES[q as usize].map(f64::from));
            (qx - px) * (y - py) < (qy - py) * (x - px)
        };
        self.chords().iter().take_while(is_above).count()
    }
}

const fn all() -> [Stitching; 16] {
    let empty = Stitching { triangles: [[0; 3]; 6], count: 0, chords: [[0; 2]; 5], owners: [0; 8] };
    let mut all = [empty; 16];
    let mut sides = 0;
    while sides < 16 {
        all[sides] = stitching(sides as u8);
        sides += 1;
    }
    all
}

const fn stitching(sides: u8) -> Stitching {
    let (top, right, bottom, left) = (sides & 1 != 0, sides & 2 != 0, sides & 4 != 0, sides & 8 != 0);
    // The upper half from the diagonal on: triangles, the chords behind them, the owners of the edges from 0, 1, 2 and 3.
    type Half = ([[u8; 3]; 3], [[u8; 2]; 2], u8, [u8; 4]);
    let none: [u8; 2] = [0; 2];
    let upper: Half = match (top, right) {
        (false, false) => ([[0, 2, 4], [0; 3], [0; 3]], [none; 2], 1, [0, 0, 0, 0]),
        (true, false) => ([[0, 1, 4], [1, 2, 4], [0; 3]], [[1, 4], none], 2, [0, 1, 1, 1]),
        (false, true) => ([[0, 3, 4], [0, 2, 3], [0; 3]], [[0, 3], none], 2, [1, 1, 1, 0]),
        (true, true) => ([[0, 1, 4], [1, 3, 4], [1, 2, 3]], [[1, 4], [1, 3]], 3, [0, 2, 2, 1]),
    };
    // The lower half from the diagonal on, which is the other turned round; owners of the edges from 4, 5, 6 and 7.
    let lower: Half = match (bottom, left) {
        (false, false) => ([[4, 6, 0], [0; 3], [0; 3]], [none; 2], 1, [0, 0, 0, 0]),
        (true, false) => ([[4, 5, 0], [5, 6, 0], [0; 3]], [[0, 5], none], 2, [0, 1, 1, 1]),
        (false, true) => ([[4, 7, 0], [4, 6, 7], [0; 3]], [[7, 4], none], 2, [1, 1, 1, 0]),
        (true, true) => ([[4, 5, 0], [5, 7, 0], [5, 6, 7]], [[0, 5], [7, 5]], 3, [0, 2, 2, 1]),
    };
    let (below, above) = (lower.2, upper.2);
    let mut found =
        Stitching { triangles: [[0; 3]; 6], count: below + above, chords: [[0, 4]; 5], owners: [0; 8] };
    let mut n = 0;
    while n < below {
        found.triangles[(below - 1 - n) as usize] = lower.0[n as usize];
        if n + 1 < below {
            found.chords[(below - 2 - n) as usize] = lower.1[n as usize];
        }
        n += 1;
    }
    n = 0;
    while n < above {
        found.triangles[(below + n) as usize] = upper.0[n as usize];
        if n + 1 < above {
            found.chords[(below + n) as usize] = upper.1[n as usize];
        }
        n += 1;
    }
    n = 0;
    while n < 4 {
        found.owners[n as usize] = below + upper.3[n as usize];
        found.owners[4 + n as usize] = below - 1 - lower.3[n as usize];
        n += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn has(sides: usize, place: u8) -> bool {
        place.is_multiple_of(2) || sides >> (place / 2) & 1 != 0
    }

    /// Twice the area, positive where the corners go clockwise on a screen.
    fn area(corners: [u8; 3]) -> i32 {
        let [a, b, c] = corners.map(|place| PLACES[place as usize].map(i32::from));
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    #[test]
    fn every_edge_has_two_triangles_of_opposite_sense_but_for_the_border_which_has_one() {
        for (sides, stitching) in STITCHINGS.iter().enumerate() {
            assert_eq!(stitching.triangles().len(), 2 + sides.count_ones() as usize);
            let mut edges = std::collections::HashMap::new();
            for (index, triangle) in stitching.triangles().iter().enumerate() {
                assert!(area(*triangle) > 0, "{sides}: {triangle:?}");
                assert!(triangle.iter().all(|&place| has(sides, place)), "{sides}: {triangle:?}");
                for n in 0..3 {
                    let edge = (triangle[n], triangle[(n + 1) % 3]);
                    assert_eq!(edges.insert(edge, index), None, "{sides}: {edge:?} twice");
                }
            }
            let total: i32 = stitching.triangles().iter().map(|triangle| area(*triangle)).sum();
            assert_eq!(total, 8, "the whole quad, once");
            for place in (0..8).filter(|&place| has(sides, place)) {
                let next = (1..8).map(|n| (place + n) % 8).find(|&next| has(sides, next)).unwrap();
                let owner = edges.remove(&(place, next)).expect("an edge of the border");
                assert_eq!(stitching.owner(place as usize), owner, "{sides}: from {place}");
            }
            for (n, &[p, q]) in stitching.chords().iter().enumerate() {
                let ends = [edges.remove(&(p, q)), edges.remove(&(q, p))];
                let mut sorted = ends.map(Option::unwrap);
                sorted.sort_unstable();
                assert_eq!(sorted, [n, n + 1], "{sides}: neighbours in the row share the chord");
            }
            assert!(edges.is_empty(), "{sides}: {edges:?}");
        }
    }

    #[test]
    fn the_triangle_over_a_point_is_the_one_that_contains_it() {
        for stitching in &STITCHINGS {
            for (x, y) in (0..400).map(|n| (f64::from(n % 20) * 0.1 + 0.053, f64::from(n / 20) * 0.1 + 0.041))
            {
                let triangle = stitching.triangles()[stitching.triangle_at([x, y])];
                let corners = triangle.map(|place| PLACES[place as usize].map(f64::from));
                for n in 0..3 {
                    let ([ax, ay], [bx, by]) = (corners[n], corners[(n + 1) % 3]);
                    assert!((bx - ax) * (y - ay) - (by - ay) * (x - ax) > -1e-9, "{triangle:?} {x} {y}");
                }
            }
        }
    }
}
