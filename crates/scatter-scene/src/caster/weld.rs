//! Welding: vertices at bit-equal f64 positions become one, so that neighbours share their edges' arithmetic.

use glam::DVec3;

/// Distinct positions and, for each input position, the index of its representative.
pub(super) struct Welded {
    /// Distinct positions in lexicographic order.
    pub positions: Vec<DVec3>,
    /// `[input index]` → index into `positions`.
    pub index_of: Vec<u32>,
}

/// Welds equal positions; +0 and −0 are equal. All positions are finite. `O(n log n)`, no hashing, so the order is
/// the same on every machine.
pub(super) fn weld(positions: &[DVec3]) -> Welded {
    // −0 + 0 is +0: after it equal coordinates have equal bits and total_cmp orders them as numbers.
    let key = |index: u32| positions[index as usize] + DVec3::ZERO;
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by(|&a, &b| {
        let (a, b) = (key(a), key(b));
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
    });
    let mut welded = Welded { positions: Vec::new(), index_of: vec![0; positions.len()] };
    for index in order {
        let p = key(index);
        if welded.positions.last() != Some(&p) {
            welded.positions.push(p);
        }
        welded.index_of[index as usize] = welded.positions.len() as u32 - 1;
    }
    welded.positions.shrink_to_fit();
    welded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_become_one_and_zero_has_no_sign() {
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let input =
            [p(1.0, 0.0, 2.0), p(-0.0, 3.0, 4.0), p(1.0, -0.0, 2.0), p(0.0, 3.0, 4.0), p(1.0, 0.0, 2.5)];
        let welded = weld(&input);
        assert_eq!(welded.positions.len(), 3);
        assert_eq!(welded.index_of[0], welded.index_of[2]);
        assert_eq!(welded.index_of[1], welded.index_of[3]);
        assert_ne!(welded.index_of[0], welded.index_of[4]);
        for (index, &position) in input.iter().enumerate() {
            assert_eq!(welded.positions[welded.index_of[index] as usize], position);
        }
    }
}
