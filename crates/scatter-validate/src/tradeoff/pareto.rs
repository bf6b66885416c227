//! The Pareto front of costs: the points that no other point beats.

/// Which points no other one beats: none is at most as large in both coordinates and smaller in one. Equal points are
/// on the front together; points with a NaN never are, and beat nothing. O(n log n).
pub fn on_front(points: &[[f64; 2]]) -> Vec<bool> {
    // −0 and 0 are one cost: adding 0 makes both 0.
    let points: Vec<[f64; 2]> = points.iter().map(|point| point.map(|v| v + 0.0)).collect();
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&i| !points[i].iter().any(|v| v.is_nan())).collect();
    order.sort_by(|&a, &b| {
        let ([ax, ay], [bx, by]) = (points[a], points[b]);
        ax.total_cmp(&bx).then(ay.total_cmp(&by))
    });
    let mut front = vec![false; points.len()];
    // By growing x: a point is on the front if its y is below those of all smaller x, which the last one on the front
    // has the lowest of.
    let mut last: Option<[f64; 2]> = None;
    for index in order {
        let point = points[index];
        let is_free = last.is_none_or(|last| point[1] < last[1] || point == last);
        if is_free {
            front[index] = true;
            last = Some(point);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The definition, word by word.
    fn beats(a: [f64; 2], b: [f64; 2]) -> bool {
        a[0] <= b[0] && a[1] <= b[1] && (a[0] < b[0] || a[1] < b[1])
    }

    #[test]
    fn a_staircase_with_what_lies_above_it() {
        let points = [[1.0, 9.0], [2.0, 9.0], [3.0, 4.0], [3.0, 5.0], [4.0, 4.0], [8.0, 0.5], [9.0, 0.7]];
        assert_eq!(on_front(&points), [true, false, true, false, false, true, false]);
    }

    #[test]
    fn equal_points_share_the_front_and_a_nan_is_never_on_it() {
        assert_eq!(
            on_front(&[[1.0, 1.0], [1.0, 1.0], [f64::NAN, 0.0], [0.0, f64::NAN]]),
            [true, true, false, false]
        );
        assert_eq!(on_front(&[[0.0, 1.0], [-0.0, 1.0], [-0.0, 2.0]]), [true, true, false]);
        assert_eq!(on_front(&[[1.0, f64::INFINITY], [2.0, 3.0]]), [true, true]);
        assert!(on_front(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn no_point_of_the_front_is_beaten_and_every_other_point_is(
            // Few values, so that equal coordinates are common.
            points in prop::collection::vec([0u8..12, 0u8..12], 0..40),
        ) {
            let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::from)).collect();
            for (&point, is_front) in points.iter().zip(on_front(&points)) {
                let is_beaten = points.iter().any(|&other| beats(other, point));
                prop_assert_eq!(is_front, !is_beaten);
            }
        }
    }
}
