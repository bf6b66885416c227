//! How much a sequence of images flickers: the second difference over time, `x(t−1) − 2·x(t) + x(t+1)`.
//!
//! It is blind to what stays and to what changes steadily, which the eye follows, and is largest for what goes to and
//! fro from frame to frame: an alternating ±e is 4·e.

/// Second differences of a signal of many values, fed a frame at a time.
#[derive(Debug, Clone, Default)]
pub struct SecondDifference {
    /// The frames t−2 and t−1.
    before: [Vec<f64>; 2],
    frames: usize,
    sum_sq: f64,
    count: u64,
}

impl SecondDifference {
    /// Takes the next frame, as many values as in the first one. Differences that are not finite are left out.
    pub fn push(&mut self, signal: impl IntoIterator<Item = f64>) {
        let next: Vec<f64> = signal.into_iter().collect();
        let [oldest, middle] = &self.before;
        if self.frames >= 2 {
            for ((a, b), c) in oldest.iter().zip(middle).zip(&next) {
                let difference = a - 2.0 * b + c;
                if difference.is_finite() {
                    self.sum_sq += difference * difference;
                    self.count += 1;
                }
            }
        }
        self.before.swap(0, 1);
        self.before[1] = next;
        self.frames += 1;
    }

    /// Root of the mean square over values and times; 0 before the third frame.
    pub fn rms(&self) -> f64 {
        (self.sum_sq / self.count.max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms_of(frames: impl IntoIterator<Item = Vec<f64>>) -> f64 {
        let mut differences = SecondDifference::default();
        frames.into_iter().for_each(|frame| differences.push(frame));
        differences.rms()
    }

    #[test]
    fn what_stays_and_what_changes_steadily_does_not_flicker() {
        assert_eq!(rms_of((0..16).map(|_| vec![0.3, -0.7, 1.1])), 0.0);
        let steady = rms_of((0..16).map(|t| vec![0.25 * f64::from(t), 3.0 - 0.5 * f64::from(t)]));
        assert_eq!(steady, 0.0, "a constant slope, exact in binary");
    }

    #[test]
    fn an_alternating_error_is_four_times_its_size() {
        let e = 0.125;
        let sign = |t: i32| if t % 2 == 0 { e } else { -e };
        assert_eq!(rms_of((0..16).map(|t| vec![sign(t), -sign(t)])), 4.0 * e);
        // In one of two values: 4·e/√2.
        let half = rms_of((0..16).map(|t| vec![sign(t), 9.0]));
        assert!((half - 4.0 * e / 2f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn a_single_flash_counts_in_three_differences() {
        // 1, −2, 1 over 4 differences of 6 frames: sqrt(6/4).
        let flash = rms_of((0..6).map(|t| vec![f64::from(u8::from(t == 2))]));
        assert!((flash - 1.5f64.sqrt()).abs() < 1e-15, "{flash}");
    }

    #[test]
    fn two_frames_are_no_sequence_and_a_nan_is_left_out() {
        assert_eq!(rms_of([vec![1.0], vec![5.0]]), 0.0);
        assert_eq!(rms_of((0..4).map(|t| vec![if t == 1 { f64::NAN } else { 2.0 }])), 0.0);
    }
}
