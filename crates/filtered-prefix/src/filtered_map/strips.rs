//! Which pixels are answered from which rows of a filtered map.
//!
//! A pixel lies between the middles of two rows. Borders of rows are straight lines in the image (`n·p = c·b·p`), so the pixels of some
//! neighbouring rows are one run of columns in each image row. Rows are filtered strip by strip, and their pixels answered while
//! the strip's numbers are still in the CPU's cache; a whole map of them has no room there.

use super::places::RowPlaces;

/// Rows that one task filters and answers, about: the row that two tasks share is filtered by both.
const A_TASK: usize = 64;

/// Bytes of numbers that a strip may have, so that they stay in a second-level cache; more if four rows have more.
const BYTES: usize = 1 << 20;

/// Fewest and most rows of numbers that are kept; powers of two.
const KEPT: [usize; 2] = [4, 16];

/// Rows that are kept at a time, of so many bytes each; a power of two.
pub fn kept_rows(bytes_a_row: usize) -> usize {
    let [fewest, most] = KEPT;
    let mut kept = fewest;
    while kept < most && 2 * kept * bytes_a_row <= BYTES {
        kept *= 2;
    }
    kept
}

/// How a frame's pixels are cut into strips and tasks.
#[derive(Debug, Clone, Copy)]
pub struct Strips {
    rows: RowPlaces,
    size: [usize; 2],
    /// The map's rows, and those that are the first of a pixel's two (one, in a nearest fetch).
    map_rows: usize,
    firsts: usize,
    /// Rows of numbers that are kept at a time; a power of two.
    kept: usize,
    blends_rows: bool,
}

/// The pixels of some rows.
#[derive(Debug, Clone, Copy)]
pub struct Strip {
    /// First row of its pixels, and the one behind the last.
    pub first: usize,
    pub end: usize,
    /// Rows whose numbers are needed and that no strip before it in its task has left.
    pub missing: [usize; 2],
    width: usize,
    /// Where the strip begins and ends; `None` where no pixel lies beyond.
    borders: [Option<Border>; 2],
}

impl Strips {
    /// For an image of a size, and a map with so many rows and bytes of numbers a row.
    pub fn new(
        rows: RowPlaces,
        size: [u32; 2],
        (map_rows, bytes_a_row): (usize, usize),
        is_bilinear: bool,
    ) -> Self {
        let kept = kept_rows(bytes_a_row);
        let blends_rows = is_bilinear && map_rows > 1;
        let firsts = if blends_rows { map_rows - 1 } else { map_rows };
        Self { rows, size: size.map(|side| side as usize), map_rows, firsts, kept, blends_rows }
    }

    /// Rows of numbers that are kept; row r is kept as number `r % kept`.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// Whether pixels lie between two rows: in bilinear fetches from maps of several.
    pub fn blends_rows(&self) -> bool {
        self.blends_rows
    }

    /// Rows of a strip: those that are kept, but for the one behind its last pixels.
    fn a_strip(&self) -> usize {
        self.kept - 1
    }

    /// Strips of a task.
    fn strips_a_task(&self) -> usize {
        A_TASK.div_ceil(self.a_strip())
    }

    /// How many tasks there are.
    pub fn task_count(&self) -> usize {
        self.firsts.div_ceil(self.strips_a_task() * self.a_strip())
    }

    /// The strips of a task, in order.
    pub fn of_task(&self, task: usize) -> impl Iterator<Item = Strip> + '_ {
        let first = task * self.strips_a_task() * self.a_strip();
        let strips = (0..self.strips_a_task()).map(move |index| first + index * self.a_strip());
        strips.take_while(|&row| row < self.firsts).map(move |row| {
            let end = (row + self.a_strip()).min(self.firsts);
            let needed = if self.blends_rows { end + 1 } else { end };
            let shared = usize::from(self.blends_rows && row > first);
            Strip {
                first: row,
                end,
                missing: [row + shared, needed.min(self.map_rows)],
                width: self.size[0],
                borders: [(row > 0).then(|| self.border(row)), (end < self.firsts).then(|| self.border(end))],
            }
        })
    }

    /// Where pixels whose first row is `row` begin.
    fn border(&self, row: usize) -> Border {
        let shift = if self.blends_rows { 0.5 } else { 0.0 };
        Border(self.rows.behind(row as f64 + shift))
    }
}

impl Strip {
    /// The strip's columns in an image row.
    #[inline(always)]
    pub fn columns(&self, y: usize) -> [usize; 2] {
        let [near, far] = self.borders;
        let [first, end] = near.map_or([0, self.width], |border| border.behind(y, self.width));
        // What is not behind the far border: the columns on its other side.
        let [before, after] = match far.map(|border| border.behind(y, self.width)) {
            None => [0, self.width],
            Some([0, end]) => [end, self.width],
            Some([first, _]) => [0, first],
        };
        [first.max(before), end.min(after)]
    }
}

/// Half a plane: pixels are behind it where `g₀ + g₁·x + g₂·y ≤ 0`.
#[derive(Debug, Clone, Copy)]
struct Border([f64; 3]);

impl Border {
    /// The columns behind it in an image row: up to the last one, or from the first one on.
    #[inline(always)]
    fn behind(&self, y: usize, width: usize) -> [usize; 2] {
        let [start, step, down] = self.0;
        let here = start + down * y as f64;
        if step == 0.0 {
            return if here <= 0.0 { [0, width] } else { [0, 0] };
        }
        let root = (-here / step).clamp(-1.0, width as f64);
        if step < 0.0 {
            [root.ceil().max(0.0) as usize, width]
        } else {
            [0, ((root.floor() + 1.0) as usize).min(width)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [53, 37];

    /// A frame's row places: `b` > 0 in all of the image, rows across it at any angle, with the epipole near or far.
    fn random_rows(random: &mut scatter_testing::Random, map_rows: usize) -> RowPlaces {
        loop {
            let [width, height] = SIZE.map(f64::from);
            let below = [1.0, random.range(-0.9, 0.9) / width, random.range(-0.9, 0.9) / height];
            let turn = random.range(0.0, std::f64::consts::TAU);
            // Every eighth has rows along the image's rows, exactly, or columns.
            let turn = if random.index(8) == 0 {
                (random.index(4) as f64) * std::f64::consts::FRAC_PI_2
            } else {
                turn
            };
            let (x, y) = (turn.cos(), turn.sin());
            let (x, y) = (if x.abs() < 1e-9 { 0.0 } else { x }, if y.abs() < 1e-9 { 0.0 } else { y });
            let steps = map_rows as f64 * random.range(0.2, 1.5);
            let above = [random.range(-0.5, 0.5) * steps, x * steps / width, y * steps / height];
            let at = |part: [f64; 3], x: f64, y: f64| part[0] + part[1] * x + part[2] * y;
            let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
            if corners.iter().all(|&(x, y)| at(below, x, y) > 0.05) {
                return RowPlaces { above, below };
            }
        }
    }

    #[test]
    fn every_pixel_is_answered_once_from_rows_that_are_kept() {
        let mut random = scatter_testing::Random(5);
        for case in 0..400 {
            let map_rows = [1, 2, 3, 7, 64, 65, 200][case % 7];
            let is_bilinear = random.index(4) != 0;
            let rows = random_rows(&mut random, map_rows);
            let bytes = [1 << 12, 1 << 17, 1 << 20][random.index(3)];
            let strips = Strips::new(rows, SIZE, (map_rows, bytes), is_bilinear);
            let [width, height] = SIZE.map(|side| side as usize);
            let mut times = vec![0; width * height];
            for task in 0..strips.task_count() {
                let mut kept = vec![None; strips.kept()];
                for strip in strips.of_task(task) {
                    for row in strip.missing[0]..strip.missing[1] {
                        kept[row % strips.kept()] = Some(row);
                    }
                    let last = if is_bilinear && map_rows > 1 { strip.end } else { strip.end - 1 };
                    for row in strip.first..=last {
                        assert_eq!(kept[row % strips.kept()], Some(row), "case {case}");
                    }
                    for y in 0..height {
                        let [first, end] = strip.columns(y);
                        for x in first..end {
                            times[y * width + x] += 1;
                            let at = |part: [f64; 3]| part[0] + part[1] * x as f64 + part[2] * y as f64;
                            let shift = if is_bilinear && map_rows > 1 { 0.5 } else { 0.0 };
                            let place = at(rows.above) / at(rows.below) - shift;
                            // Places of some hundred, by sums of three products.
                            let near = strip.first == 0 || place >= strip.first as f64 - 1e-10;
                            let far = last + 1 >= map_rows || place <= strip.end as f64 + 1e-10;
                            assert!(near && far, "case {case}: {place} in {strip:?}");
                        }
                    }
                }
            }
            assert!(times.iter().all(|&times| times == 1), "case {case}");
        }
    }
}
