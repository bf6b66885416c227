//! Where slices lie along the view rays: lengths that are equal near the eye and grow with the distance beyond.
//!
//! Wronski 2014 and its successors place slices at `near·(far/near)^(k/K)` of the view's depth, with nothing in front of `near`.
//! Here `t(u) = near·((1 + far/near)^(u/K) − 1)`: exponential for t ≫ near, linear for t ≪ near, and the first slice begins at
//! the eye, so that no light in front of `near` is lost. Distances count along the rays and not along the camera's axis:
//! the surfaces are spheres, all columns share them, and so one table of extinction serves all rays.

/// The slices of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Slices {
    near: f64,
    far: f64,
    /// `ln(1 + far/near)` a slice.
    growth: f64,
    /// Where slices begin, and where the last one ends: one number more than there are slices \[world units\].
    bounds: Vec<f64>,
    /// The same in f32.
    bounds_f32: Vec<f32>,
    /// Where their middles lie, by number and not by length \[world units\].
    middles: Vec<f64>,
}

impl Slices {
    /// `count` ≥ 1 slices up to `far`, with `near`, both finite and > 0. Reuses the tables.
    pub fn set(&mut self, count: usize, near: f64, far: f64) {
        self.near = near;
        self.far = far;
        self.growth = (far / near).ln_1p() / count as f64;
        self.bounds.clear();
        self.bounds.reserve(count + 1);
        for index in 0..count {
            self.bounds.push(self.distance(index as f64));
        }
        // Without the rounding of an exponential, so that the longest ray ends with the last slice.
        self.bounds.push(far);
        self.middles.clear();
        self.middles.reserve(count);
        for index in 0..count {
            self.middles.push(self.distance(index as f64 + 0.5));
        }
        self.bounds_f32.clear();
        self.bounds_f32.extend(self.bounds.iter().map(|&bound| bound as f32));
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.bounds.len() - 1
    }

    /// Where the last one ends \[world units\].
    pub fn far(&self) -> f64 {
        self.far
    }

    /// Where slices begin, and where the last one ends \[world units\].
    pub fn bounds(&self) -> &[f64] {
        &self.bounds
    }

    /// The same in f32.
    pub fn bounds_f32(&self) -> &[f32] {
        &self.bounds_f32
    }

    /// Where the middles of the slices lie, by number and not by length \[world units\].
    pub fn middles(&self) -> &[f64] {
        &self.middles
    }

    /// Distance of a place in the slices: 0 is the eye, 1 the end of the first slice \[world units\].
    pub fn distance(&self, place: f64) -> f64 {
        self.near * (self.growth * place).exp_m1()
    }

    /// The place of a distance ≥ 0: the inverse of [`Self::distance`].
    pub fn place(&self, distance: f64) -> f64 {
        (distance / self.near).ln_1p() / self.growth
    }

    /// The slice that a distance lies in; the last one for what lies beyond `far`.
    #[inline(always)]
    pub fn slice_of(&self, distance: f32) -> usize {
        // The last bound does not count: what is beyond it is in the last slice.
        let last = self.count();
        self.bounds_f32[1..last].partition_point(|&bound| bound < distance)
    }

    /// Bytes of the tables.
    pub fn memory_bytes(&self) -> u64 {
        ((self.bounds.capacity() + self.middles.capacity()) * size_of::<f64>()
            + self.bounds_f32.capacity() * size_of::<f32>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slices_of(count: usize, near: f64, far: f64) -> Slices {
        let mut slices = Slices::default();
        slices.set(count, near, far);
        slices
    }

    #[test]
    fn the_first_slice_begins_at_the_eye_and_the_last_one_ends_at_far() {
        for (near, far) in [(0.1, 100.0), (1e-6, 1e6), (1e9, 3.0)] {
            for count in [1, 2, 63, 64] {
                let slices = slices_of(count, near, far);
                assert_eq!((slices.bounds()[0], slices.bounds()[count]), (0.0, far));
                assert!(slices.bounds().windows(2).all(|pair| pair[0] < pair[1]), "{near} {far} {count}");
                // ln_1p of expm1 near 0: a few ulp of the slices' number.
                let off = (slices.place(slices.distance(0.3)) - 0.3).abs();
                assert!(off < 1e-9, "{off:e}");
            }
        }
    }

    #[test]
    fn lengths_are_equal_before_near_and_in_proportion_to_the_distance_beyond() {
        let slices = slices_of(200, 1.0, 1e4);
        let length = |slice: usize| slices.bounds()[slice + 1] - slices.bounds()[slice];
        // dt/du = growth·(near + t).
        let at = |t: f64| length(slices.slice_of(t as f32));
        assert!((at(0.01) / length(0) - 1.0).abs() < 0.05);
        assert!((at(2000.0) / at(1000.0) - 2.0).abs() < 0.1);
        // A near that is far away: equal lengths.
        let equal = slices_of(64, 1e9, 3.0);
        let lengths: Vec<f64> = equal.bounds().windows(2).map(|pair| pair[1] - pair[0]).collect();
        assert!(lengths.iter().all(|l| (l * 64.0 / 3.0 - 1.0).abs() < 1e-6), "{lengths:?}");
    }

    #[test]
    fn a_distance_lies_in_the_slice_whose_bounds_hold_it() {
        let slices = slices_of(17, 0.5, 20.0);
        for step in 0..2000 {
            let distance = 0.01 * step as f32;
            let slice = slices.slice_of(distance);
            let [from, to] = [slices.bounds_f32()[slice], slices.bounds_f32()[slice + 1]];
            assert!(distance >= from && distance <= to, "{distance} in {from} to {to}");
        }
        assert_eq!((slices.slice_of(1e9), slices.slice_of(f32::INFINITY)), (16, 16));
    }
}
