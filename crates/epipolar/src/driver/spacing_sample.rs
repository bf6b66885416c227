//! What interpolation between slices is off by, on a sample of gaps, in the figures that levels are judged by.
//!
//! What lies between two slices depends on the scene, not on the image: open terrain is smooth over many pixels, a rose
//! window changes within half a one. So in some gaps a line somewhere between the two slices gets what its pixels would get,
//! interpolated and halved as theirs are, and is compared with the slice through it: the error itself, along a line instead of
//! at a few pixels. Shares are weighted by the light that they are shares of, so that p99 and RMS are those of the image
//! (MODEL.md, "Error figures"). (Baran et al. 2010 choose one pixel for every scene.)

use scatter_core::{Frame, Level, LightIntegralF32, RayLanes, at_level};

use super::near_ends::ends_on_steps;

/// Rays whose light is found side by side.
const LANES: usize = RayLanes::COUNT;

/// One gap in how many is measured, of `gaps`, that at least `enough` are. Fewer miss rare shafts, more cost as much as the
/// frame: a measured gap costs its two slices, the line, and whatever slices halve it for the line.
pub fn stride(gaps: usize, enough: usize) -> usize {
    (gaps / enough.max(1)).clamp(LEAST_STRIDE, 32)
}

/// Least of [`stride`].
const LEAST_STRIDE: usize = 4;

/// One column in how many is measured, of gaps of a width \[pixels\]: neighbours see nearly the same, and what a wide gap
/// costs are its pixels. In a narrow one few columns have any.
pub fn column_stride(spacing: f64) -> u32 {
    if spacing >= 0.75 { MOST_COLUMN_STRIDE } else { 1 }
}

/// Most of [`column_stride`].
pub const MOST_COLUMN_STRIDE: u32 = 4;

/// Errors of what is darker than this share of the picture's mean are relative to it (MODEL.md, "Error figures").
const DARK: f64 = 0.01;

/// The errors that a frame is to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorTarget {
    /// That of 99 % of its pixels, relative to each.
    pub error: f32,
    /// The RMS of all, relative to their mean.
    pub rms: f32,
    /// The finest and the widest spacing \[pixels\] that are tried.
    pub within: [f64; 2],
    /// How sure the sample is to be.
    pub confidence: Confidence,
}

/// How sure a sample is to be: what is saved on it is paid by slices that a frame does not need, or by frames that miss their
/// target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Confidence {
    /// Gaps that are enough, where the picture has some times as many.
    pub gaps: usize,
    /// Standard deviations that are added to what they say. Fewer, and more frames miss their level; more, and frames whose
    /// light is in a few gaps get slices that they do not need.
    pub sigmas: f64,
    /// What is aimed at beyond the spacings that were measured, of what is allowed: of few gaps less, since nothing tells there how
    /// fast errors grow.
    pub beyond: f64,
}

/// Pixels of a measured gap: where they are, and how far their rays go.
#[derive(Clone, Copy)]
pub struct GapPixels<'a> {
    /// Indices in the image.
    pub places: &'a [u32],
    /// Where rays end \[world units\].
    pub ends: &'a [f32],
    /// The frame, if it is asked which of them end on steps of its map, and from which error on, relative to their radiance.
    pub on_steps: Option<(&'a Frame<'a>, f32)>,
}

/// The light of a frame where nothing shadows it, which shares are weighted by.
#[derive(Clone)]
pub struct Unoccluded<'a> {
    frame: &'a Frame<'a>,
    light: LightIntegralF32<'a>,
}

impl<'a> Unoccluded<'a> {
    /// Of a frame.
    pub fn new(frame: &'a Frame<'a>) -> Self {
        Self { frame, light: LightIntegralF32::new(frame.setup()) }
    }

    /// Radiance of up to sixteen pixels, per channel.
    #[inline(always)]
    fn of(&self, simd: Level, places: &[u32], ends: &[f32]) -> [[f32; LANES]; 3] {
        let width = self.frame.size()[0];
        let rays = RayLanes::from_fn(|lane| {
            let place = places[lane.min(places.len() - 1)];
            self.frame.camera().pixel_ray(place % width, place / width)
        });
        let mut lengths = [0.0; LANES];
        lengths[..ends.len()].copy_from_slice(ends);
        self.light.intervals(simd, &rays, &[0.0; LANES], &lengths)
    }
}

/// Pixels of some gaps: what each should get and by how much it is off, one worker's. 12 bytes a pixel and channel.
#[derive(Debug, Default)]
pub struct SpacingSample {
    /// Radiance without shadows, with them, and the error of what was found: with a minus sign, zero's too, where the pixel's ray ends
    /// on steps of the map ([`ends_on_steps`]).
    pixels: Vec<[f32; 3]>,
    /// First pixel of each gap.
    gaps: Vec<u32>,
}

impl SpacingSample {
    /// Grows to what a frame may need; forgets all pixels.
    pub fn reserve(&mut self, pixels: usize, channels: usize, gaps: usize) {
        // One gap in `LEAST_STRIDE`, all of whose pixels may be measured; gaps are not all alike.
        let most = channels * (pixels / 2 + 64).min(2 * pixels / LEAST_STRIDE + 4096);
        self.clear();
        self.pixels.reserve(most);
        self.gaps.reserve(gaps / LEAST_STRIDE + 16);
    }

    /// Forgets all pixels.
    pub fn clear(&mut self) {
        self.pixels.clear();
        self.gaps.clear();
    }

    /// Begins a gap.
    pub fn begin(&mut self) {
        self.gaps.push(self.pixels.len() as u32);
    }

    /// Takes pixels of the gap: radiance without shadows, with them, and its error; and whether its ray ends on steps of the map.
    pub fn push(&mut self, pixels: impl Iterator<Item = ([f32; 3], bool)>) {
        self.pixels.extend(pixels.map(|([whole, radiance, error], on_steps)| {
            [whole, radiance, if on_steps { -error.abs() } else { error.abs() }]
        }));
    }

    /// Takes what pixels of the gap get in a channel and what they should get, as shares of their light; `None` stands for
    /// all channels.
    #[inline(always)]
    pub fn count(
        &mut self,
        simd: Level,
        light: &Unoccluded<'_>,
        at: GapPixels<'_>,
        channel: Option<usize>,
        (found, exact): (&[f32], &[f32]),
    ) {
        let pixels = at.places.chunks(LANES).zip(at.ends.chunks(LANES));
        for ((places, ends), (found, exact)) in pixels.zip(found.chunks(LANES).zip(exact.chunks(LANES))) {
            let radiance = at_level!(simd, light.of(simd, places, ends));
            self.push((0..places.len()).map(|lane| {
                let own = match channel {
                    Some(channel) => radiance[channel][lane],
                    None => (radiance[0][lane] + radiance[1][lane] + radiance[2][lane]) / 3.0,
                };
                // What is left to be walked is exact.
                let error = if found[lane] < 0.0 { 0.0 } else { (exact[lane] - found[lane]).abs() };
                // Of those alone that may count: few are.
                let on_steps = at.on_steps.is_some_and(|(frame, counts)| {
                    error > counts * exact[lane] && ends_on_steps(frame, places[lane])
                });
                ([own, own * exact[lane], own * error], on_steps)
            }));
        }
    }

    /// Pixels of each gap.
    fn gaps(&self) -> impl Iterator<Item = &[[f32; 3]]> {
        let ends = self.gaps.iter().skip(1).map(|&first| first as usize).chain([self.pixels.len()]);
        self.gaps.iter().zip(ends).map(|(&first, end)| &self.pixels[first as usize..end])
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.pixels.capacity() * size_of::<[f32; 3]>() + self.gaps.capacity() * size_of::<u32>()
    }
}

/// A sum of numbers that is the same in any order: 2⁻⁶⁴ is a unit.
#[derive(Debug, Clone, Copy, Default)]
struct OrderlessSum(u128);

impl OrderlessSum {
    const UNIT: f64 = 1.0 / 18_446_744_073_709_551_616.0;

    /// `value` in [0, 2⁴⁰]; what is more counts as that.
    fn add(&mut self, value: f64) {
        self.0 += (value.min(1_099_511_627_776.0) / Self::UNIT) as u128;
    }

    fn value(self) -> f64 {
        self.0 as f64 * Self::UNIT
    }
}

/// What a sample says of the whole frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// By how much a target is missed: kept if it is at most 1, and in proportion to the error.
    pub excess: f64,
    /// The share of the light that is lit.
    pub lit_share: f64,
}

/// Puts the samples of all workers together.
///
/// The excess is the larger of two quotients, the 99th percentile of the relative errors over what is allowed, and their RMS
/// over what is allowed. Both with some standard deviations of what another sample of as many gaps may have
/// more of: gaps are drawn one by one, so the variance of a sum over gaps is the sum of its squares. The same for any
/// distribution of gaps over workers.
///
/// Without those `on_steps` of the map: as if pixels whose rays end there had no errors.
pub fn measured<'a>(
    samples: impl Iterator<Item = &'a SpacingSample> + Clone,
    target: ErrorTarget,
    on_steps: bool,
) -> Measured {
    let Confidence { sigmas, .. } = target.confidence;
    let gaps = || samples.clone().flat_map(SpacingSample::gaps);
    // No matter how bright the light is: in units of the brightest pixel.
    let largest = gaps().flatten().flatten().fold(0.0f32, |largest, &value| largest.max(value.abs()));
    if largest == 0.0 {
        return Measured { excess: 0.0, lit_share: 1.0 };
    }
    let [mut light, mut lit, mut squares, mut spread] = [OrderlessSum::default(); 4];
    let mut count = 0;
    for pixels in gaps() {
        let mut sums = [0.0f64; 2];
        for &[whole, radiance, _] in pixels {
            sums = [sums[0] + f64::from(whole / largest), sums[1] + f64::from(radiance / largest)];
        }
        count += pixels.len();
        light.add(sums[0]);
        lit.add(sums[1]);
    }
    let lit_share = (lit.value() / light.value().max(f64::MIN_POSITIVE)).min(1.0);
    let error_of =
        |pixel: &[f32; 3]| if !on_steps && pixel[2].is_sign_negative() { 0.0 } else { pixel[2].abs() };
    for pixels in gaps() {
        let mut sum = 0.0f64;
        for pixel in pixels {
            let error = f64::from(error_of(pixel) / largest);
            sum += error * error;
        }
        squares.add(sum);
        spread.add(sum * sum);
    }
    let [pixels, mean] = [count as f64, lit.value() / count as f64];
    let rms = ((squares.value() + sigmas * spread.value().sqrt()) / pixels).sqrt();
    let floor = (DARK * mean) as f32 * largest;
    // How many pixels are off by more than a multiple of what is allowed, of one in a hundred.
    let over = |multiple: f64| {
        let allowed = (multiple * f64::from(target.error)) as f32;
        let (mut sum, mut squares) = (0u64, 0u64);
        for pixels in gaps() {
            let is_off = |pixel: &&[f32; 3]| error_of(pixel) > allowed * pixel[1].max(floor);
            let own = pixels.iter().filter(is_off).count();
            sum += own as u64;
            squares += (own * own) as u64;
        }
        (sum as f64 + sigmas * (squares as f64).sqrt()) / (0.01 * pixels)
    };
    let rms = rms / (f64::from(target.rms) * mean).max(f64::MIN_POSITIVE);
    Measured { excess: rms.max(least_kept(over)), lit_share }
}

/// The least multiple at which no more than all that may is `over`, which falls; to a percent, from a 64th to 64.
fn least_kept(over: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 10;
    let (mut low, mut high) = (-6.0f64, 6.0f64);
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if over(middle.exp2()) > 1.0 { low = middle } else { high = middle }
    }
    high.exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIGMAS: f64 = 0.75;
    const TARGET: ErrorTarget = ErrorTarget {
        error: 0.05,
        rms: 1.0,
        within: [0.1, 4.0],
        confidence: Confidence { gaps: 80, sigmas: SIGMAS, beyond: 0.5 },
    };

    /// Samples of gaps of 100 pixels of radiance a half, of which some are off by `error`.
    fn gaps(over: &[usize], error: f32) -> SpacingSample {
        let mut sample = SpacingSample::default();
        for &over in over {
            sample.begin();
            sample
                .pixels
                .extend((0..100).map(|pixel| [1.0, 0.5, if pixel < over { 0.5 * error } else { 0.0 }]));
        }
        sample
    }

    fn of(sample: &SpacingSample, target: ErrorTarget) -> f64 {
        measured([sample].into_iter(), target, true).excess
    }

    #[test]
    fn the_99th_percentile_counts_and_what_one_gap_says_alone_counts_for_more() {
        assert_eq!(of(&gaps(&[], 1.0), TARGET), 0.0);
        assert!(of(&gaps(&[0; 64], 1.0), TARGET) < 0.016);
        // Of 1,000 pixels ten may be off. Five in five gaps are 5 and a spread of 0.75·√5; in one gap 8.75; seven in one are 12.25.
        for (over, factor) in [(vec![1; 5], 0.0), (vec![5, 0, 0, 0, 0], 0.0), (vec![7, 0, 0, 0, 0], 2.0)] {
            let mut over = over;
            over.resize(10, 0);
            let excess = of(&gaps(&over, 0.1), TARGET);
            // To the steps of the bisection, 2^(12/2¹⁰).
            assert!((excess - factor).abs() < 0.02 * factor.max(1.0), "{excess} {factor}");
        }
    }

    #[test]
    fn it_is_in_proportion_to_the_error() {
        for error in [0.01f32, 0.03, 0.05, 0.2, 1.0] {
            let excess = of(&gaps(&[3; 10], error), TARGET);
            assert!((excess / f64::from(error / 0.05) - 1.0).abs() < 0.01, "{error} {excess}");
        }
    }

    #[test]
    fn the_rms_is_that_of_all_pixels_over_their_mean() {
        let target = ErrorTarget { error: 1.0, rms: 0.01, ..TARGET };
        // RMS 0.005 over 0.5 is just what is allowed; a hundred gaps that agree add SIGMAS·√(1/100) of its square.
        let excess = of(&gaps(&[100; 100], 0.01), target);
        let expected = (1.0 + 0.1 * SIGMAS).sqrt();
        assert!((excess / expected - 1.0).abs() < 1e-3, "{excess} {expected}");
    }

    #[test]
    fn errors_in_the_dark_are_relative_to_a_hundredth_of_the_mean() {
        // Nine tenths are dark but for 1e-3, off by a fifth of it; the mean is 0.0109 or 0.5.
        let sample = |lit: f32| {
            let mut sample = SpacingSample::default();
            sample.begin();
            sample
                .pixels
                .extend((0..100).map(|pixel| if pixel < 90 { [5.0, 1e-3, 2e-4] } else { [5.0, lit, 0.0] }));
            sample
        };
        let dark = of(&sample(5.0), TARGET);
        // Of a mean of 0.5009 a hundredth is 0.005009, which 2e-4 are 3.99 percent of.
        assert!((dark - 0.03993 / 0.05).abs() < 0.01, "{dark}");
        let seen = of(&sample(0.1), TARGET);
        assert!((seen - 0.2 / 0.05).abs() < 0.04, "{seen}");
    }

    #[test]
    fn who_measured_a_gap_does_not_matter() {
        let sample = |errors: &[f32]| {
            let mut sample = SpacingSample::default();
            for &error in errors {
                sample.begin();
                sample.pixels.extend((0..97).map(|pixel| [1.0, 0.3 * error + 0.1, error * pixel as f32]));
            }
            sample
        };
        let errors = [0.1f32, 0.7, 1e-3, 0.33, 0.9, 0.017];
        let whole = measured([&sample(&errors)].into_iter(), TARGET, true);
        let parts = [sample(&[0.9, 1e-3, 0.1]), sample(&[0.017, 0.33, 0.7])];
        assert_eq!(whole, measured(parts.iter(), TARGET, true));
        assert!((whole.lit_share - (0.1 + 0.3 * 2.048 / 6.0)).abs() < 1e-6, "{whole:?}");
    }
}
