//! One slice as bytes: its view rays, its border in fixed point, and the columns that its pixels can be in.

use epipolar::geometry::{Epipole, Fan, FanPixels, Major, Slice, SlicePlane};

use super::records::{COLUMNS, MOST_BANDS, SliceData, SliceTask, flags};

/// A fan with its pixels, as its slices are counted along it.
pub(super) struct FanColumns<'a> {
    pub fan: &'a Fan,
    pub pixels: &'a FanPixels,
    /// Pixels of the image across its columns.
    pub breadth: f64,
}

impl FanColumns<'_> {
    /// How many columns it has.
    pub fn count(&self) -> u32 {
        self.pixels.columns[1] - self.pixels.columns[0]
    }

    /// The image column nearest to the epipole, and the change of one from there on.
    pub fn first(&self) -> [i32; 2] {
        let [from, to] = self.pixels.columns.map(|column| column as i32);
        if self.fan.ascending { [from, 1] } else { [to - 1, -1] }
    }

    /// The slice's minor coordinate at k = 0, less ½, and its change a column.
    pub fn line_of(&self, slice: &Slice) -> [f64; 2] {
        let [column, heading] = self.first();
        let start = slice.minor_at(self.fan.major, f64::from(column) + 0.5) - 0.5;
        [start, slice.slope * f64::from(heading)]
    }

    /// Columns `[from, to)`, by k, in which the slice is within the image, with some pixels beyond its borders.
    pub fn inside(&self, [start, change]: [f64; 2], beyond: f64) -> [u32; 2] {
        let (low, high) = (-1.0 - beyond, self.breadth + beyond);
        let count = f64::from(self.count());
        let (mut from, mut to) = (0.0f64, count);
        if change == 0.0 {
            if start < low || start > high {
                return [0, 0];
            }
        } else {
            let (a, b) = ((low - start) / change, (high - start) / change);
            (from, to) = (from.max(a.min(b).floor()), to.min(a.max(b).ceil() + 1.0));
        }
        if from < to { [from as u32, to as u32] } else { [0, 0] }
    }

    /// The slice's record; lines, row and border are still to come.
    pub fn record(&self, plane: &SlicePlane, index: usize, first_range: u32) -> SliceData {
        let [column, heading] = self.first();
        let start = plane.view_ray(f64::from(column));
        let step = (plane.view_ray(f64::from(column + heading)) - start).as_vec2();
        let start = start.as_vec2();
        let is_last = index + 1 == self.fan.count;
        SliceData {
            view_ray: [start.x, start.y, step.x, step.y],
            border: [0; 2],
            column: [column, heading],
            column_count: self.count(),
            first_range,
            first_line: 0,
            line_count: 0,
            first_run: 0,
            room: 0,
            flags: flag(index == 0, flags::FIRST_OF_FAN)
                | flag(is_last, flags::LAST_OF_FAN)
                | flag(self.fan.major == Major::Y, flags::STEEP),
            padding: 0,
        }
    }
}

fn flag(on: bool, flag: u32) -> u32 {
    if on { flag } else { 0 }
}

/// Bits behind the point of borders: lines stay within the image's width plus its height.
pub(super) fn border_bits(size: [u32; 2]) -> u32 {
    /// More than that no pixel can tell.
    const MOST: u32 = 20;
    (30 - (size[0] + size[1]).next_power_of_two().ilog2()).min(MOST)
}

/// A slice's border in fixed point, not below that of the slice before it in its fan: lines that do not cross, so that each pixel
/// lies in one gap, whatever was rounded.
pub(super) fn fixed_border([start, change]: [f64; 2], bits: u32, before: Option<[i32; 2]>) -> [i32; 2] {
    let fixed = |value: f64| (value * f64::from(1u32 << bits)).round().clamp(-1.07e9, 1.07e9) as i32;
    let own = [fixed(start), fixed(change)];
    before.map_or(own, |before| [own[0].max(before[0]), own[1].max(before[1])])
}

/// 1/sin β of a view ray `[across, to_light]`.
fn cosecant(plane: &SlicePlane, column: f64) -> f64 {
    let ray = plane.view_ray(column);
    ray.length() / ray.x.max(1e-300)
}

/// The largest sine of the angle to the light among columns `[from, to)`, by k.
pub(super) fn largest_sine(plane: &SlicePlane, [column, heading]: [i32; 2], [from, to]: [u32; 2]) -> f64 {
    let at = |k: u32| 1.0 / cosecant(plane, f64::from(column) + f64::from(heading) * f64::from(k));
    // Between the ends the sine is larger only where it reaches 1: where the part towards the light changes its sign.
    let along = |k: u32| plane.view_ray(f64::from(column) + f64::from(heading) * f64::from(k)).y;
    let last = to.max(from + 1) - 1;
    if along(from) * along(last) <= 0.0 { 1.0 } else { at(from).max(at(last)) }
}

/// Cuts columns `[from, to)`, by k, into tasks of one band each, and calls `task` for them. `lowest` is the smallest 1/sin β of the
/// image, and bands are octaves of it.
pub(super) fn cut_tasks(
    (plane, [column, heading], column_count): (&SlicePlane, [i32; 2], u32),
    [from, to]: [u32; 2],
    (lowest, band_count): (f64, u32),
    inward: bool,
    mut task: impl FnMut(SliceTask),
) {
    let (column, heading) = (f64::from(column), f64::from(heading));
    let start = plane.view_ray(column);
    let step = plane.view_ray(column + heading) - start;
    // sin β = 1/y where the parts are in the ratio ±1/√(y² − 1): linear in k.
    let mut cuts = [to; 2 * MOST_BANDS + 1];
    let mut count = 0;
    for band in 1..band_count {
        let y = lowest * super::factor_tables::BAND_RATIO.powi(band as i32);
        let ratio = 1.0 / (y * y - 1.0).sqrt();
        for ratio in [ratio, -ratio] {
            let k = (ratio * start.y - start.x) / (step.x - ratio * step.y);
            if k > f64::from(from) && k < f64::from(to) {
                cuts[count] = k.ceil() as u32;
                count += 1;
            }
        }
    }
    cuts[..count].sort_unstable();
    let mut begin = from;
    for &end in &cuts[..=count] {
        if end <= begin {
            continue;
        }
        let middle = 0.5 * (f64::from(begin) + f64::from(end) - 1.0);
        let octave = (cosecant(plane, column + heading * middle) / lowest).log2().floor();
        let band = octave.clamp(0.0, f64::from(band_count - 1)) as u32;
        let mut first = begin;
        while first < end {
            let width = (end - first).min(COLUMNS);
            let first_rank = if inward { column_count - first - width } else { first };
            task(SliceTask { slice: 0, band, first_rank, column_count: width });
            first += width;
        }
        begin = end;
    }
}

/// Columns and rows of pixels whose rays are too near to the light's axis for slices: from, to; from, to.
pub(super) fn too_near(epipole: &Epipole, size: [u32; 2]) -> [u32; 4] {
    let near = epipole.too_near * epipole.image.z;
    let along = |axis: usize| {
        let is_near = |n: &u32| {
            let centre = glam::DVec2::splat(f64::from(*n) + 0.5);
            epipole.towards(centre)[axis].abs() <= near
        };
        let first = (0..size[axis]).find(is_near);
        let last = (0..size[axis]).rfind(is_near);
        first.zip(last).map_or([0, 0], |(first, last)| [first, last + 1])
    };
    let ([left, right], [top, bottom]) = (along(0), along(1));
    [left, right, top, bottom]
}
