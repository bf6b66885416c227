//! What a frame asks of slices, found on a sample of them: the numbers that choose between techniques on slices.

use std::f64::consts::PI;

use scatter_core::{Frame, RenderStats, StageClock, simd_level};

use super::slice_view::{SliceAngles, SliceScene, SliceView};
use crate::geometry::{ColumnOrder, Epipole, FanPixels, Major, SliceSet};
use crate::rows::{MinMaxTiles, Row};

/// Slices that are sampled, about. Fewer miss a scene's one window, more cost as much as a preview.
const SAMPLE: usize = 64;

/// Facts of a frame's slices, beside [`SceneFacts`](scatter_core::SceneFacts): of a sample of 64 slices, even in angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceFacts {
    /// Where the image shows the light, or the point opposite to it, in pixels; `None` at infinity.
    pub epipole: Option<[f64; 2]>,
    /// Whether that is the light itself: it is before the camera.
    pub towards_light: bool,
    /// Whether it lies within the image.
    pub epipole_on_screen: bool,
    /// Smallest and largest angle β between a view ray and the light \[radians, 0 to π\]; 0 or π itself where the epipole is on
    /// screen.
    pub angles: [f64; 2],
    /// Mean number of shadows' edges along a slice: neighbouring light rays that end more than one view ray apart.
    pub transitions: f64,
    /// Largest number of them.
    pub most_transitions: u64,
    /// Mean number of runs of a slice: light rays that end at the same view ray.
    pub runs: f64,
    /// Mean total variation of where a slice's view rays end, across the light, over the farthest end: 2 for one wall
    /// before a far background, large in foliage.
    pub end_variation: f64,
    /// How many slices were sampled.
    pub slices: u32,
}

impl SliceFacts {
    /// Samples a frame that a perspective camera sees; the time is the stage `slice-facts` of `stats`.
    ///
    /// One pass over the shadow map for its tiles, and 64 rows. Allocates its buffers:
    /// it is for choosing a technique, not for every frame.
    pub fn of(frame: &Frame<'_>, stats: &mut RenderStats) -> Self {
        let mut clock = StageClock::start();
        let epipole = Epipole::new(frame.camera(), frame.light());
        let mut slices = SliceSet::default();
        slices.distribute_count(&epipole, frame.size(), SAMPLE);
        let mut tiles = MinMaxTiles::default();
        tiles.rebuild(simd_level(), frame.shadow());
        let scene = SliceScene { frame, epipole, tiles: &tiles, simd: simd_level() };
        let mut sample = Sample::default();
        for fan in &slices.fans {
            let mut pixels = FanPixels::default();
            pixels.find(&epipole, frame.size(), fan, &slices.slices);
            let ascending = fan.ascending == epipole.outward;
            let order = ColumnOrder { columns: pixels.columns, ascending };
            // The border between two fans is in both of them.
            for slice in &slices.slices[fan.first..][..fan.count - 1] {
                if order.count() > 0 {
                    sample.add(&SliceView::new(scene, *slice, fan.major, order, &mut SliceAngles::default()));
                }
            }
        }
        let facts = sample.facts(frame, &epipole);
        clock.lap(stats, "slice-facts");
        facts
    }
}

/// Sums over slices.
#[derive(Default)]
struct Sample {
    row: Row,
    slices: u32,
    transitions: u64,
    most_transitions: u64,
    runs: u64,
    end_variation: f64,
    /// Smallest angle, and π less the largest.
    from_ends: Option<[f64; 2]>,
}

impl Sample {
    fn add(&mut self, slice: &SliceView<'_>) {
        let [width, height] = slice.frame().size();
        // The columns in which the slice is within the image, and the light rays in which their pixels' rays end.
        let mut ends = Vec::new();
        for (index, column) in (slice.order.columns[0]..slice.order.columns[1]).enumerate() {
            let minor = slice.slice.minor_at(slice.major, f64::from(column) + 0.5);
            let breadth = if slice.major == Major::X { height } else { width };
            if !(0.0..f64::from(breadth)).contains(&minor) {
                continue;
            }
            let (x, y) =
                if slice.major == Major::X { (column, minor as u32) } else { (minor as u32, column) };
            let (sine, cosine) = (f64::from(slice.sines()[index]), f64::from(slice.cosines()[index]));
            let end = slice.frame().ray_end(x, y).min(1e18);
            ends.push(slice.light.light_ray(end, sine, cosine));
            let angle = sine.atan2(cosine);
            let [least, from_pi] = self.from_ends.unwrap_or([PI; 2]);
            self.from_ends = Some([least.min(angle), from_pi.min(PI - angle)]);
        }
        let Some(farthest) = ends.iter().copied().reduce(f64::max) else { return };
        self.slices += 1;
        if farthest > 0.0 {
            self.end_variation +=
                ends.windows(2).map(|pair| (pair[1] - pair[0]).abs() / farthest).sum::<f64>();
        }
        let mut texels = 0;
        let slice = slice.up_to(farthest as f32);
        slice.for_each_line(|_, line| texels += line.columns as usize);
        self.row.clear(2 * texels + 8 * ends.len() + 64);
        slice.rectify(0.0, &mut self.row);
        let jumps = self.row.lit().windows(2).filter(|pair| pair[0].abs_diff(pair[1]) > 1).count() as u64;
        self.transitions += jumps;
        self.most_transitions = self.most_transitions.max(jumps);
        self.runs += self.row.len() as u64;
    }

    fn facts(&self, frame: &Frame<'_>, epipole: &Epipole) -> SliceFacts {
        let [width, height] = frame.size().map(f64::from);
        let place = (epipole.image.z > 0.0).then(|| (epipole.image.truncate() / epipole.image.z).to_array());
        let on_screen = place.is_some_and(|[x, y]| (0.0..width).contains(&x) && (0.0..height).contains(&y));
        let [least, from_pi] = self.from_ends.unwrap_or([0.0; 2]);
        let count = f64::from(self.slices.max(1));
        SliceFacts {
            epipole: place,
            towards_light: epipole.outward,
            epipole_on_screen: on_screen,
            angles: [
                if on_screen && epipole.outward { 0.0 } else { least },
                if on_screen && !epipole.outward { PI } else { PI - from_pi },
            ],
            transitions: self.transitions as f64 / count,
            most_transitions: self.most_transitions,
            runs: self.runs as f64 / count,
            end_variation: self.end_variation / count,
            slices: self.slices,
        }
    }
}
