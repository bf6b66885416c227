//! Which pixels are found from slices: one in 1, 2 or 4 along each axis; the others are interpolated between those.

/// Pixels whose coordinates are `factor/2 + n·factor`, and the last one of an axis that ends before the first of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lattice {
    factor: u32,
}

impl Lattice {
    /// One pixel in `factor` ≥ 1 along each axis.
    pub fn new(factor: u32) -> Self {
        Self { factor }
    }

    /// The first coordinate along an axis of `length` pixels.
    #[inline(always)]
    pub fn first(self, length: u32) -> u32 {
        (self.factor / 2).min(length - 1)
    }

    /// Whether a coordinate is one of the lattice's, along an axis of `length` pixels.
    #[inline(always)]
    pub fn holds(self, at: u32, length: u32) -> bool {
        let first = self.first(length);
        self.factor == 1 || (at >= first && (at - first).is_multiple_of(self.factor))
    }

    /// The lattice's coordinates in `from..to`.
    #[inline(always)]
    pub fn within(self, from: i32, to: i32, length: u32) -> impl Iterator<Item = i32> {
        let (first, factor) = (self.first(length) as i32, self.factor as i32);
        // A division a column, where most frames need none.
        let ahead = if factor == 1 { 0 } else { (first - from).rem_euclid(factor) };
        let start = (from + ahead).max(first);
        (start..to).step_by(factor as usize)
    }

    /// The two coordinates of the lattice around a pixel's, and the part of the way from the first to the second; the same one
    /// twice at the image's border.
    #[inline(always)]
    pub fn around(self, at: u32, length: u32) -> ([u32; 2], f32) {
        let first = self.first(length);
        if at < first {
            return ([first; 2], 0.0);
        }
        let before = first + (at - first) / self.factor * self.factor;
        let behind = if before + self.factor < length { before + self.factor } else { before };
        ([before, behind], (at - before) as f32 / self.factor as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_is_one_list_however_it_is_asked() {
        for factor in [1, 2, 4] {
            let lattice = Lattice::new(factor);
            for length in 1..20 {
                let all: Vec<u32> = (0..length).filter(|&at| lattice.holds(at, length)).collect();
                assert!(!all.is_empty(), "{factor} {length}");
                for from in 0..length as i32 {
                    for to in from..=length as i32 {
                        let within: Vec<u32> = lattice.within(from, to, length).map(|at| at as u32).collect();
                        let naive: Vec<u32> =
                            all.iter().copied().filter(|&at| (from..to).contains(&(at as i32))).collect();
                        assert_eq!(within, naive, "{factor} {length} {from} {to}");
                    }
                }
                for at in 0..length {
                    let ([before, behind], part) = lattice.around(at, length);
                    assert!(all.contains(&before) && all.contains(&behind) && (0.0..1.0).contains(&part));
                    // Between its neighbours it is where it is.
                    if before != behind {
                        assert_eq!(before as f32 + part * (behind - before) as f32, at as f32);
                    }
                }
            }
        }
    }
}
