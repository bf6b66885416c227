//! Where in its froxel each pass takes its sample: the same place in all froxels, the same places every time.
//!
//! Engines move the samples of each frame of time by a low-discrepancy sequence and blend frames; here all passes are of one
//! picture. Along the depth the k passes are stratified, across it they follow Halton's sequence in bases 2 and 3
//! (together Hammersley's points in three dimensions), in an order that does not matter since all of them are averaged.

/// Columns, rows and depth of a sample within its froxel, each in [0, 1), of pass `index` of `count`.
pub fn sample_place(index: u32, count: u32) -> [f64; 3] {
    if count <= 1 {
        return [0.5; 3];
    }
    [
        radical_inverse(index + 1, 2),
        radical_inverse(index + 1, 3),
        (f64::from(index) + 0.5) / f64::from(count),
    ]
}

/// The digits of `index` in `base`, mirrored at the point.
fn radical_inverse(mut index: u32, base: u32) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= f64::from(base);
        value += digit * f64::from(index % base);
        index /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_is_the_centre_and_several_fill_the_froxel() {
        assert_eq!(sample_place(0, 1), [0.5; 3]);
        for count in [2u32, 3, 8, 64] {
            let places: Vec<_> = (0..count).map(|index| sample_place(index, count)).collect();
            for axis in 0..3 {
                let mean = places.iter().map(|place| place[axis]).sum::<f64>() / f64::from(count);
                // Depth is stratified about the middle; Halton's mean is off by less than a point's share of its discrepancy.
                let most = if axis == 2 { 1e-12 } else { 1.2 / f64::from(count) };
                assert!((mean - 0.5).abs() <= most, "{count}, axis {axis}: {mean}");
                assert!(places.iter().all(|place| (0.0..1.0).contains(&place[axis])));
            }
        }
        // 1 in base 2 and 3: a half and a third.
        assert_eq!(sample_place(0, 8)[..2], [0.5, 1.0 / 3.0]);
    }
}
