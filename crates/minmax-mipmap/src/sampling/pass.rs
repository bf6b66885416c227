//! The slices of a fan, one after the other: samples, marches, interpolation, and the pixels in the gaps between them.

use epipolar::driver::{FrameLight, Shares, SliceAngles, SliceScene, SliceView};
use epipolar::geometry::{ColumnOrder, Fan, FanPixels, Major, Slice};
use glam::DVec2;
use scatter_core::at_level;

use super::gap::{GapPass, LEFT_AT_ONCE, Side};
use super::lattice::Lattice;
use super::line_samples::{LineSamples, SampleSettings, light_ray};
use super::pixel_lights::weight_of;
use crate::options::{Edges, MOST_HALVINGS, Options};
use crate::slices::{SliceMarch, SliceRay};

/// Rays that correct pixels before their sums are read.
const BATCH: usize = 64;

/// What the slices of a frame share.
pub struct SamplingPass<'a> {
    pub scene: SliceScene<'a>,
    pub light: &'a FrameLight<'a>,
    pub slices: &'a [Slice],
    pub shares: &'a Shares,
    /// What pixels would have without a shadow; `None` where every ray sees light.
    pub lights: Option<&'a [f32]>,
    pub options: &'a Options,
    pub lattice: Lattice,
    /// Channels whose shares differ, 1 or 3.
    pub channels: usize,
}

/// Buffers of one worker, kept from frame to frame.
#[derive(Debug, Default)]
pub struct Worker {
    angles: SliceAngles,
    march: SliceMarch,
    /// The slice before a gap and the one behind it.
    sides: [Side; 2],
    /// The slices through the middle of gaps that are halved, one a depth.
    middles: [Side; MOST_HALVINGS as usize],
    /// Pixels that are to be marched.
    pub left: Vec<[u32; 2]>,
    steep: Vec<[u32; 2]>,
    pub counts: Counts,
}

/// Counts that do not depend on the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub slices: u64,
    pub samples: u64,
    pub marched: u64,
    pub corrected: u64,
}

/// Most samples of a slice of an image.
pub fn most_samples(size: [u32; 2], options: &Options) -> usize {
    let [width, height] = size.map(f64::from);
    (options.samples as usize).min(width.hypot(height).ceil() as usize + 2).max(2)
}

impl Worker {
    /// Grows all buffers to what any slice of such a frame may need; forgets what was counted.
    pub fn reserve(&mut self, pass: &SamplingPass<'_>) {
        let size = pass.scene.frame.size();
        let columns = size[0].max(size[1]) as usize;
        let samples = most_samples(size, pass.options);
        self.angles.reserve(columns);
        self.march.reserve(pass.scene.frame, samples.max(BATCH));
        let halvings = pass.options.halvings as usize;
        for side in self.sides.iter_mut().chain(&mut self.middles[..halvings]) {
            side.samples.reserve(samples, pass.channels);
            side.line.reserve(columns);
            side.columns.reserve(columns, pass.channels);
        }
        // A column of a gap and a row of the image have no more pixels.
        for list in [&mut self.left, &mut self.steep] {
            list.clear();
            list.reserve(LEFT_AT_ONCE + columns);
        }
        self.counts = Counts::default();
    }

    /// What its marches looked at.
    pub fn march(&self) -> &SliceMarch {
        &self.march
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.angles.memory_bytes()
            + self.march.memory_bytes()
            + self
                .sides
                .iter()
                .chain(&self.middles)
                .map(|side| {
                    side.samples.memory_bytes() + side.line.memory_bytes() + side.columns.memory_bytes()
                })
                .sum::<usize>()
            + (self.left.capacity() + self.steep.capacity()) * size_of::<[u32; 2]>()
    }
}

impl SamplingPass<'_> {
    /// Fills the pixels of gaps `range` of a fan.
    pub fn run(&self, fan: &Fan, pixels: &FanPixels, range: std::ops::Range<usize>, worker: &mut Worker) {
        let slices = &self.slices[fan.first..][..fan.count];
        let mut sides = std::mem::take(&mut worker.sides);
        for index in range.start..=range.end {
            sides.swap(0, 1);
            let [_, own] = &mut sides;
            own.line.follow(self.scene.simd, fan, pixels, slices, index);
            self.sample(fan, pixels, &slices[index], own, worker);
            if index > range.start {
                let between = [&slices[index - 1], &slices[index]];
                self.gap((fan, pixels), between, [&sides[0], &sides[1]], 0, worker);
            }
        }
        worker.sides = sides;
    }

    /// Fills the pixels of a gap, or halves it where its slices differ by more than may be interpolated over.
    fn gap(
        &self,
        (fan, pixels): (&Fan, &FanPixels),
        [a, b]: [&Slice; 2],
        sides: [&Side; 2],
        depth: u32,
        worker: &mut Worker,
    ) {
        let samples = sides.map(|side| &side.samples);
        if depth < self.options.halvings && differ(samples, self.options, self.channels) {
            let middle = Slice::through(&self.scene.epipole, fan.major, 0.5 * (a.exit + b.exit));
            let mut own = std::mem::take(&mut worker.middles[depth as usize]);
            own.line.follow(self.scene.simd, fan, pixels, &[*a, middle, *b], 1);
            self.sample(fan, pixels, &middle, &mut own, worker);
            self.gap((fan, pixels), [a, &middle], [sides[0], &own], depth + 1, worker);
            self.gap((fan, pixels), [&middle, b], [&own, sides[1]], depth + 1, worker);
            worker.middles[depth as usize] = own;
            return;
        }
        let gap = GapPass {
            frame: self.scene.frame,
            shares: self.shares,
            lights: self.lights,
            lattice: self.lattice,
            channels: self.channels,
            threshold: self.options.refinement,
            correction: self.options.correction,
        };
        let mut column = 0;
        while column < pixels.ranges.len() {
            let left = &mut worker.left;
            column = at_level!(self.scene.simd, gap.fill((fan, pixels), sides, column, left));
            self.correct(fan.major, worker);
        }
    }

    /// Lays the samples of a slice, marches some and interpolates the others, and all of them to the fan's columns.
    fn sample(&self, fan: &Fan, pixels: &FanPixels, slice: &Slice, side: &mut Side, worker: &mut Worker) {
        self.sample_line(fan, pixels, slice, &mut side.samples, worker);
        let (first, count) = (pixels.columns[0], pixels.ranges.len());
        at_level!(self.scene.simd, side.columns.fill(&side.samples, first, count, self.channels));
    }

    fn sample_line(
        &self,
        fan: &Fan,
        pixels: &FanPixels,
        slice: &Slice,
        samples: &mut LineSamples,
        worker: &mut Worker,
    ) {
        let Self { scene, options, channels, .. } = *self;
        let Worker { angles, march, counts, .. } = worker;
        let settings = SampleSettings {
            samples: options.samples as usize,
            initial: options.initial as usize,
            density: options.density as usize,
            threshold: options.refinement,
        };
        let columns = pixels.columns;
        let place = (slice, fan.major, fan.ascending);
        samples.lay(scene.frame, &scene.epipole, place, &settings, channels);
        if samples.count == 0 || columns[0] == columns[1] {
            samples.count = 0;
            return;
        }
        let order = ColumnOrder { columns, ascending: fan.ascending == scene.epipole.outward };
        let slice = at_level!(scene.simd, SliceView::new(scene, *slice, fan.major, order, angles));
        let reach = at_level!(scene.simd, samples.lay_rays(&slice));
        let slice = slice.up_to(reach);
        march.lay(&slice, options.tree);
        if options.edges == Edges::Row {
            let (mut before, edges) = (None, &mut samples.edges);
            march.ends_are_lit(&slice, &samples.rays, |index, lit| {
                if before.is_some_and(|before| before != lit) {
                    edges.set(index - 1, true);
                }
                before = Some(lit);
            });
        }
        if self.lights.is_some() {
            self.find_lights(&slice, march, samples);
        }
        samples.march_edges();
        self.march(&slice, march, samples);
        counts.slices += 1;
        counts.samples += samples.count as u64;
        counts.marched += samples.marched.count();
    }

    /// Finds what all samples would have without a shadow. Where a cone begins there is an edge: no stretch is interpolated across.
    fn find_lights(&self, slice: &SliceView<'_>, march: &mut SliceMarch, samples: &mut LineSamples) {
        march.clear();
        samples.rays.iter().for_each(|ray| march.unlit_ray(slice, ray));
        march.sums.finish(self.light, self.scene.simd, true);
        samples.lights.clear();
        for ray in 0..samples.count {
            let mut sum = 0.0;
            for channel in 0..self.channels {
                let [_, whole] = march.sums.light(ray, channel, self.channels);
                samples.whole[channel][ray] = whole;
                sum += whole;
            }
            samples.lights.push(weight_of(sum));
        }
        samples.find_rims();
    }

    /// Marches the samples that are marked, and fills in the others.
    fn march(&self, slice: &SliceView<'_>, march: &mut SliceMarch, samples: &mut LineSamples) {
        let (channels, simd) = (self.channels, self.scene.simd);
        let white = self.scene.frame.texture().is_none();
        loop {
            march.clear();
            let mut next = samples.fresh.next(0);
            while let Some(index) = next {
                let reached = march.ray(slice, self.options.tree, self.light, &samples.rays[index]);
                samples.ends_lit.set(index, reached);
                next = samples.fresh.next(index + 1);
            }
            march.sums.finish(self.light, simd, true);
            let (mut next, mut ray) = (samples.fresh.next(0), 0);
            while let Some(index) = next {
                for channel in 0..channels {
                    let [lit, whole] = march.sums.light(ray, channel, channels);
                    samples.lit[channel][index] = lit;
                    samples.whole[channel][index] = whole;
                    let share = march.sums.share(ray, channel, channels, white);
                    samples.shares[channel][index] = if samples.sees_light(index) { share } else { 0.0 };
                }
                (next, ray) = (samples.fresh.next(index + 1), ray + 1);
            }
            // A shadow that begins or ends between two samples, whatever casts it, shows in what they see.
            let Options { edges, contrast, .. } = *self.options;
            if edges == Edges::Depth || !samples.march_contrasts(contrast, FLOOR, channels) {
                break;
            }
        }
        // Of the others, those that need it are asked for what they would have without a shadow: under a sun in uniform air all,
        // which costs less than to choose.
        if let FrameLight::Sun { sigma_t, .. } = *self.light {
            at_level!(simd, samples.fill_wholes(sigma_t, channels));
        } else if self.lights.is_none() {
            march.clear();
            samples.for_each_whole(channels, white, |index| march.unlit_ray(slice, &samples.rays[index]));
            march.sums.finish(self.light, simd, true);
            let mut whole = std::mem::take(&mut samples.whole);
            let mut ray = 0;
            samples.for_each_whole(channels, white, |index| {
                for (channel, whole) in whole[..channels].iter_mut().enumerate() {
                    whole[index] = march.sums.light(ray, channel, channels)[1];
                }
                ray += 1;
            });
            samples.whole = whole;
        }
        samples.interpolate(channels, white);
    }

    /// Marches the pixels that were left, each by its own ray; their places count along a fan's major axis first.
    pub fn correct(&self, major: Major, worker: &mut Worker) {
        let mut left = std::mem::take(&mut worker.left);
        for some in left.chunks(BATCH) {
            worker.march.clear();
            for &[column, row] in some {
                self.march_pixel(major, [column, row], worker);
            }
            worker.march.sums.finish(self.light, self.scene.simd, false);
            let white = self.scene.frame.texture().is_none();
            for (ray, &[column, row]) in some.iter().enumerate() {
                let [x, y] = if major == Major::X { [column, row] } else { [row, column] };
                let place = y as usize * self.scene.frame.size()[0] as usize + x as usize;
                for channel in 0..self.channels {
                    let share = worker.march.sums.share(ray, channel, self.channels, white);
                    self.shares.put(place, channel, share);
                }
            }
        }
        worker.counts.corrected += left.len() as u64;
        left.clear();
        worker.left = left;
    }

    /// Marches the pixels of an image row that were left, as `[x, y]`.
    pub fn correct_pixels(&self, worker: &mut Worker) {
        // Those that are farther from the epipole along x than along y have flat slices; they are marched first.
        let epipole = self.scene.epipole;
        let away = |&[x, y]: &[u32; 2]| epipole.towards(DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        let flat = |place: &[u32; 2]| {
            let away = away(place);
            away.x.abs() >= away.y.abs()
        };
        // Through the epipole itself there is no one slice: pixels on it are walked when the image is resolved.
        worker.left.retain(|place| !epipole.is_too_near(away(place)));
        worker.left.sort_unstable_by_key(|place| !flat(place));
        let steep = worker.left.partition_point(flat);
        worker.steep.clear();
        worker.steep.extend(worker.left.drain(steep..).map(|[x, y]| [y, x]));
        self.correct(Major::X, worker);
        std::mem::swap(&mut worker.left, &mut worker.steep);
        self.correct(Major::Y, worker);
    }

    /// Marches one pixel through the row of its own slice.
    fn march_pixel(&self, major: Major, [column, row]: [u32; 2], worker: &mut Worker) {
        let scene = self.scene;
        let Worker { angles, march, .. } = worker;
        let (along, across) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
        let (x, y, centre) = match major {
            Major::X => (column, row, DVec2::new(along, across)),
            Major::Y => (row, column, DVec2::new(across, along)),
        };
        let away = major.of(scene.epipole.towards(centre));
        let slice = Slice::through(&scene.epipole, major, centre);
        let order =
            ColumnOrder { columns: [column, column + 1], ascending: (away > 0.0) == scene.epipole.outward };
        // One column has nothing for wide registers.
        let slice = SliceView::new(scene, slice, major, order, angles);
        let end = f64::from(scene.frame.ray_end(x, y) as f32);
        let ray = SliceRay::new(&slice, f64::from(column), end);
        let slice = slice.up_to(light_ray(&slice, end, ray.sine, ray.cosine) as f32);
        march.lay(&slice, self.options.tree);
        march.ray(&slice, self.options.tree, self.light, &ray);
    }
}

/// Part of a slice's samples that may differ from the next slice's.
const DIFFERING: usize = 256;

/// Share of a ray's light below which differences are measured against it.
const FLOOR: f32 = 0.01;

/// Whether two slices differ by more than may be interpolated over, in more than one of [`DIFFERING`] of their samples: where
/// their depths are alike and their shares are not.
fn differ([one, other]: [&LineSamples; 2], options: &Options, channels: usize) -> bool {
    let [one, other] = if one.count >= other.count { [one, other] } else { [other, one] };
    if other.count == 0 {
        return false;
    }
    let mut differing = 0;
    for index in 0..one.count {
        let place = (one.first + one.step * index as f64 - other.first) / other.step + 0.5;
        let beside = (place.max(0.0) as usize).min(other.count - 1);
        let [a, b] = [one.ends[index], other.ends[beside]];
        // What sees no light has no share.
        if !one.sees_light(index) || !other.sees_light(beside) {
            continue;
        }
        // Two endless rays do not differ.
        if a != b && (a - b).abs() > options.refinement * a.min(b) {
            continue;
        }
        let differs = (0..channels).any(|channel| {
            let [a, b] = [one.shares[channel][index], other.shares[channel][beside]];
            (a - b).abs() > options.contrast * (0.5 * (a + b)).max(FLOOR)
        });
        differing += usize::from(differs);
    }
    DIFFERING * differing > one.count
}
