//! How much a sample says of a pixel: by how far their depths are apart (Yusov 2012, Section 6.6).

/// Samples whose weights add up to less serve no pixel.
pub const LEAST_WEIGHT: f32 = 0.05;

/// Depths beyond are no surface.
const FARTHEST: f32 = 1e30;

/// The weight of a sample whose ray ends at one depth for a ray that ends at another, 0 to 1: 1 up to a relative difference of
/// `threshold`, and then its fourth power down.
#[inline(always)]
pub fn weight(end: f32, other: f32, threshold: f32) -> f32 {
    let [end, other] = [end, other].map(|end| end.min(FARTHEST));
    let difference = (end - other).abs();
    let allowed = threshold * end.min(other);
    // A difference of 0 is allowed at the eye itself.
    let quotient = if difference > allowed { allowed / difference } else { 1.0 };
    let square = quotient * quotient;
    square * square
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_whole_within_the_threshold_and_fall_behind_it() {
        assert_eq!(weight(1.0, 1.0, 0.03), 1.0);
        assert_eq!(weight(1.0, 1.029, 0.03), 1.0);
        assert_eq!(weight(0.0, 0.0, 0.03), 1.0);
        assert_eq!(weight(f32::INFINITY, f32::INFINITY, 0.03), 1.0);
        assert!(weight(5.0, f32::INFINITY, 0.03) < 1e-30);
        // Twice the threshold: 2⁻⁴.
        assert!((weight(1.0, 1.06, 0.03) - 0.0625).abs() < 1e-4);
        assert_eq!(weight(2.0, 3.0, 0.1), weight(3.0, 2.0, 0.1));
    }
}
