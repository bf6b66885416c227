//! The paper's own way from end to end (Klehm et al. 2014, Section 3.3): a rectified map of fixed size is filtered as a whole, M
//! numbers a texel, and every pixel is one fetch of them, bilinear or nearest, and one dot product or one reconstruction.
//!
//! ```text
//! projective map ──▶ filter (rows in parallel: weights, basis, prefix sums as means) ──▶ M numbers a texel
//! pixel ──▶ column, row, depth of its ray's end ──▶ fetch ──▶ share ──▶ unoccluded closed form × share
//! ```
//!
//! Its cost follows from the picture and the map alone, and so does its memory; it promises nothing. What the crate does by itself
//! (rows of exact runs, certificates) has none of this map.

mod answer;
mod filter;
mod numbers;
mod references;
mod row_depths;
mod turned;

use epipolar::driver::{Resolve, Shares};
use scatter_core::{Frame, Level, RenderStats, ScatterImage, SceneFacts, StageClock, simd_level};

use self::numbers::{Number, Numbers};
use self::references::References;
use self::row_depths::RowDepths;
use crate::options::{Basis, Options, Weighting};
use crate::projective::{OwnMap, Rectification};

/// A filtered map; kept from frame to frame.
#[derive(Debug)]
pub struct FilteredMap {
    numbers: Numbers,
    row_depths: RowDepths,
    shares: Shares,
    simd: Level,
}

impl Default for FilteredMap {
    /// For the CPU that it runs on.
    fn default() -> Self {
        let (numbers, row_depths) = (Numbers::default(), RowDepths::default());
        Self { numbers, row_depths, shares: Shares::default(), simd: simd_level() }
    }
}

impl FilteredMap {
    /// Fills `out` with a frame whose projective map is made. O(texels·M) and O(pixels·M).
    pub fn render(
        &mut self,
        (frame, map): (&Frame<'_>, &OwnMap),
        options: &Options,
        out: &mut ScatterImage,
    ) -> RenderStats {
        let facts = SceneFacts::of(frame);
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        let Some(rectification) = map.rectification() else { return stats };
        // Three channels share one row: their mean.
        let sigma = match options.weighting {
            Some(Weighting::Average) => 0.0,
            _ => frame.medium().sigma_t().iter().sum::<f64>() / 3.0,
        };
        let references = References::new(frame, rectification, &facts, sigma);
        self.row_depths.fill(map, rectification, frame.camera());
        let count = options.coefficients as usize;
        let a_texel = (count + filter::BESIDE) * references.count();
        let area = frame.size().map(|side| side as usize).iter().product();
        self.shares.clear(area, 1);
        let texels = map.texel_count();
        let mut numbers = std::mem::take(&mut self.numbers);
        numbers.make_room(options.storage, texels * a_texel);
        numbers.visit(
            options.storage,
            texels * a_texel,
            Work {
                own: self,
                frame,
                map,
                rectification,
                references,
                sigma,
                options,
                stats: &mut stats,
                clock: &mut clock,
            },
        );
        self.numbers = numbers;
        let walked = Resolve::new(frame, Some((&self.shares, 1)), self.simd).image(out);
        clock.lap(&mut stats, "resolve");
        stats.counts.push("texels", texels as u64);
        stats.counts.push("bytes a texel", (a_texel * options.storage.bytes()) as u64);
        stats.counts.push("reference rays", references.count() as u64);
        stats.counts.push("queries", area as u64);
        stats.counts.push("walked pixels", walked);
        stats.push_modelled(&facts);
        stats.memory_bytes = (self.numbers.memory_bytes()
            + self.row_depths.memory_bytes()
            + self.shares.memory_bytes()
            + map.memory_bytes()) as u64;
        stats
    }
}

/// Filter and answers, for one kind of number.
struct Work<'a, 'f> {
    own: &'a mut FilteredMap,
    frame: &'a Frame<'f>,
    map: &'a OwnMap,
    rectification: &'a Rectification,
    references: References,
    sigma: f64,
    options: &'a Options,
    stats: &'a mut RenderStats,
    clock: &'a mut StageClock,
}

impl numbers::Visit for Work<'_, '_> {
    fn visit<T: Number>(self, numbers: &mut [T]) {
        let Self { own, frame, map, rectification, references, sigma, options, stats, clock } = self;
        let (own, shared) = (&*own, (frame, map, rectification));
        let filter = filter::RowFilter::new(shared, &own.row_depths, references, sigma);
        let count = options.coefficients as usize;
        let behind = numbers.len() - numbers::BEHIND;
        filter.fill(own.simd, options.basis, count, &mut numbers[..behind]);
        clock.lap(stats, "prefix");
        let numbers = (&*numbers, count);
        let answers = answer::Answers::new(shared, numbers, &own.row_depths, references, options.fetch);
        match options.basis {
            Basis::Fourier => answers.fourier(own.simd, &own.shares),
            Basis::Moments => answers.moments(own.simd, options.storage, &own.shares),
        }
        clock.lap(stats, "answers");
    }
}
