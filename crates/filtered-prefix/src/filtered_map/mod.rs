//! The paper's own way from end to end (Klehm et al. 2014, Section 3.3): a rectified map of fixed size is filtered row by row, M
//! numbers a texel, and every pixel is one fetch of them, bilinear or nearest, and one dot product or one reconstruction.
//!
//! ```text
//! projective map ──▶ strips of rows ──▶ filter (weights, basis, prefix sums as means) ──▶ M numbers a texel
//!                    and their pixels ──▶ column, row, depth of the ray's end ──▶ fetch ──▶ share ──▶ unoccluded closed form × share
//! ```
//!
//! Its cost follows from the picture and the map alone, and so does its memory; it promises nothing. What the crate does by itself
//! (rows of exact runs, certificates) has none of this map. The paper filters the whole map before the first pixel; here the pixels
//! of a few rows are answered as soon as those are filtered (`strips`), so that numbers are read where they were written, in a CPU's
//! cache: the same numbers, from about a megabyte a thread.

mod answer;
mod basis;
mod fetched;
mod filter;
mod numbers;
mod places;

mod references;
mod row_depths;
mod strips;
mod turned;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use epipolar::driver::{Resolve, Shares};
use fearless_simd::Simd;
use scatter_core::{
    Frame, Level, RenderStats, ScatterImage, SceneFacts, StageClock, at_level, parallel, simd_level,
};

use self::answer::Answers;
use self::basis::{MapBasis, Moments, Series};
use self::fetched::TexelLayout;
use self::filter::RowFilter;
use self::numbers::{Number, Numbers};
use self::places::RowPlaces;

use self::references::References;
use self::row_depths::RowDepths;
use self::strips::Strips;
use crate::options::{Basis, Fetch, Options, Weighting};
use crate::projective::OwnMap;

/// A filtered map; its buffers are kept from frame to frame.
#[derive(Debug)]
pub struct FilteredMap {
    workers: Vec<Worker>,
    row_depths: RowDepths,
    shares: Shares,
    simd: Level,
}

/// What a thread has of its own: the numbers of a strip's rows, and how long it filtered and answered.
#[derive(Debug, Default)]
struct Worker {
    numbers: Numbers,
    filtered: Duration,
    answered: Duration,
}

impl Default for FilteredMap {
    /// For the CPU that it runs on.
    fn default() -> Self {
        let (workers, row_depths) = (Vec::new(), RowDepths::default());
        Self { workers, row_depths, shares: Shares::default(), simd: simd_level() }
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
        let shared = (frame, map, rectification);
        // Three channels share one row: their mean.
        let sigma = match options.weighting {
            Some(Weighting::Average) => 0.0,
            _ => frame.medium().sigma_t().iter().sum::<f64>() / 3.0,
        };
        let references = References::new(frame, rectification, &facts, sigma);
        self.row_depths.fill(map, rectification, frame.camera());
        let area = frame.size().map(|side| side as usize).iter().product();
        self.shares.clear(area, 1);
        let is_bilinear = options.fetch != Fetch::Nearest;
        let a_side = options.coefficients as usize + filter::BESIDE;
        let a_texel = a_side * references.count();
        let a_row = a_texel * map.width();
        let bytes = options.storage.bytes();
        let rows = (map.row_count(), a_row * bytes);
        let strips = Strips::new(RowPlaces::new(shared), frame.size(), rows, is_bilinear);
        let layout = TexelLayout {
            references: references.count(),
            sides: references.count().min(2),
            a_texel: a_side,
            width: map.width(),
            last_kept: strips.kept() - 1,
            blends_columns: is_bilinear,
            blends_rows: strips.blends_rows(),
        };
        let work = Work {
            simd: self.simd,
            filter: RowFilter::new(shared, &self.row_depths, references, sigma),
            answers: Answers::new(shared, (&self.row_depths, references), layout, &self.shares),
            strips,
            a_row,
            options,
            next: AtomicUsize::new(0),
        };
        self.workers.resize_with(parallel::worker_count(), Worker::default);
        parallel::for_each_worker(&mut self.workers, |worker| work.run(worker));
        let sum = |time: fn(&Worker) -> Duration| self.workers.iter().map(time).sum::<Duration>();
        let parts = [("prefix", sum(|worker| worker.filtered)), ("answers", sum(|worker| worker.answered))];
        clock.lap_of_parts(&mut stats, parts);
        let walked = Resolve::new(frame, Some((&self.shares, 1)), self.simd).image(out);
        clock.lap(&mut stats, "resolve");
        let texels = map.texel_count();
        stats.counts.push("texels", texels as u64);
        stats.counts.push("bytes a texel", (a_texel * bytes) as u64);
        stats.counts.push("bytes of a whole map", (texels * a_texel * bytes) as u64);
        stats.counts.push("reference rays", references.count() as u64);
        stats.counts.push("queries", area as u64);
        stats.counts.push("walked pixels", walked);
        stats.push_modelled(&facts);
        let numbers: usize = self.workers.iter().map(|worker| worker.numbers.memory_bytes()).sum();
        stats.memory_bytes =
            (numbers + self.row_depths.memory_bytes() + self.shares.memory_bytes() + map.memory_bytes())
                as u64;
        stats
    }
}

/// Bytes of numbers that fetches with these options may hold, over all threads: a row has up to three references.
pub fn most_bytes(options: &Options) -> usize {
    let a_texel = (options.coefficients as usize + filter::BESIDE) * references::MOST;
    let a_row = a_texel * options.own_map.columns as usize * options.storage.bytes();
    parallel::worker_count() * strips::kept_rows(a_row) * a_row
}

/// Filter and answers of a frame, task by task.
struct Work<'a> {
    simd: Level,
    filter: RowFilter<'a>,
    answers: Answers<'a>,
    strips: Strips,
    /// Numbers of a row.
    a_row: usize,
    options: &'a Options,
    next: AtomicUsize,
}

impl Work<'_> {
    /// Does tasks until there are none left.
    fn run(&self, worker: &mut Worker) {
        let Worker { numbers, filtered, answered } = worker;
        let count = self.a_row * self.strips.kept();
        numbers.make_room(self.options.storage, count);
        (*filtered, *answered) = (Duration::ZERO, Duration::ZERO);
        numbers.visit(self.options.storage, count, Tasks { work: self, times: [filtered, answered] });
    }
}

/// The tasks of one thread, for one kind of number.
struct Tasks<'a> {
    work: &'a Work<'a>,
    times: [&'a mut Duration; 2],
}

impl numbers::Visit for Tasks<'_> {
    fn visit<T: Number>(mut self, numbers: &mut [T]) {
        let Options { basis, coefficients, storage, .. } = *self.work.options;
        match (basis, coefficients) {
            (Basis::Fourier, count) => self.run(numbers, &Series { count: count as usize }),
            (Basis::Moments, 4) => self.run(numbers, &Moments::<2, 6, 8>::new(storage)),
            (Basis::Moments, 6) => self.run(numbers, &Moments::<3, 8, 8>::new(storage)),
            (Basis::Moments, _) => self.run(numbers, &Moments::<4, 10, 16>::new(storage)),
        }
    }
}

impl Tasks<'_> {
    fn run<T: Number>(&mut self, numbers: &mut [T], basis: &impl MapBasis) {
        loop {
            let task = self.work.next.fetch_add(1, Ordering::Relaxed);
            if task >= self.work.strips.task_count() {
                break;
            }
            at_level!(self.work.simd, vectors => self.task(vectors, task, numbers, basis));
        }
    }

    #[inline(always)]
    fn task<S: Simd, T: Number>(&mut self, simd: S, task: usize, numbers: &mut [T], basis: &impl MapBasis) {
        let Work { filter, answers, strips, a_row, .. } = self.work;
        let mut clock = StageClock::start();
        for strip in strips.of_task(task) {
            let [first, end] = strip.missing;
            for row in first..end {
                let numbers = &mut numbers[row % strips.kept() * a_row..][..*a_row];
                basis.filter(simd, filter, row, numbers);
            }
            *self.times[0] += clock.restart();
            answers.strip(simd, &strip, numbers, basis);
            *self.times[1] += clock.restart();
        }
    }
}
