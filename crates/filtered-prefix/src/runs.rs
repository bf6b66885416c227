//! The light rays of one slice as what filters them sees them: runs, with the column that each ends behind, and their colours.

use epipolar::driver::{SliceQueries, SliceView};
use epipolar::rows::{Row, TexturedRow};

/// Runs of a row, from the eye on.
#[derive(Clone, Copy)]
pub struct Runs<'a> {
    /// γ where each run starts, 0 first; one more, ∞.
    pub starts: &'a [f32],
    /// Columns, counted from the light, that see each run lit.
    pub lit: &'a [u32],
    /// Colours, where the light has a texture.
    pub colours: Option<&'a TexturedRow>,
}

impl<'a> Runs<'a> {
    /// Of a row, cut where a texture changes its colour.
    pub fn new(row: &'a Row, colours: Option<&'a TexturedRow>) -> Self {
        match colours {
            None => Self { starts: row.starts(), lit: row.lit(), colours },
            Some(textured) => Self { starts: textured.starts(), lit: textured.lit(), colours },
        }
    }

    /// One channel of the runs' colours; `None` in white light.
    pub fn colour(&self, channel: usize) -> Option<&'a [f32]> {
        self.colours.map(|textured| textured.colour(channel))
    }
}

/// View rays that ask a row, column by column.
#[derive(Debug, Default)]
pub struct Asked {
    /// Which of the slice's queries each is.
    pub queries: Vec<u32>,
    /// Column of each, from the slice's first.
    pub columns: Vec<u32>,
    /// Place of its column in the order of light.
    pub ranks: Vec<u32>,
    /// The light ray in which its ray ends.
    pub gammas: Vec<f32>,
    /// The run in which it ends.
    pub ends: Vec<u32>,
}

impl Asked {
    /// Lengthens all lists to so many.
    pub fn make_room(&mut self, count: usize) {
        for list in [&mut self.queries, &mut self.columns, &mut self.ranks, &mut self.ends] {
            list.resize(count, 0);
        }
        self.gammas.resize(count, 0.0);
    }

    /// All queries of a slice, which end in some runs.
    #[inline(always)]
    pub fn take_all(&mut self, slice: &SliceView<'_>, queries: &SliceQueries, runs: &[u32]) {
        let count = queries.len();
        self.make_room(count);
        self.columns[..count].copy_from_slice(queries.columns());
        self.gammas[..count].copy_from_slice(queries.gammas());
        self.ends[..count].copy_from_slice(&runs[..count]);
        for (query, own) in self.queries[..count].iter_mut().enumerate() {
            *own = query as u32;
        }
        for (rank, &column) in self.ranks.iter_mut().zip(queries.columns()) {
            *rank = slice.order.rank(slice.order.columns[0] + column);
        }
        self.truncate(count);
    }

    /// Keeps some of them, in their order.
    #[inline(always)]
    pub fn keep(&mut self, is_kept: &[bool]) {
        let mut count = 0;
        for (ray, &is_kept) in is_kept[..self.len()].iter().enumerate() {
            // Without a branch: what is not kept is overwritten by the next one.
            for list in [&mut self.queries, &mut self.columns, &mut self.ranks, &mut self.ends] {
                list[count] = list[ray];
            }
            self.gammas[count] = self.gammas[ray];
            count += usize::from(is_kept);
        }
        self.truncate(count);
    }

    /// Shortens all lists to so many.
    pub fn truncate(&mut self, count: usize) {
        for list in [&mut self.queries, &mut self.columns, &mut self.ranks, &mut self.ends] {
            list.truncate(count);
        }
        self.gammas.truncate(count);
    }

    /// The least and the largest of their ranks, which follow their columns, up or down.
    #[inline(always)]
    pub fn rank_range(&self) -> [u32; 2] {
        let [a, b] = [self.ranks[0], self.ranks[self.len() - 1]];
        [a.min(b), a.max(b)]
    }

    /// How many of the runs can be asked for.
    #[inline(always)]
    pub fn used_runs(&self) -> usize {
        self.ends.iter().fold(0, |a, &b| a.max(b)) as usize + 1
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.queries.len()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.queries.capacity()
            + self.columns.capacity()
            + self.ranks.capacity()
            + self.gammas.capacity()
            + self.ends.capacity())
    }
}

/// The farthest and the nearest column behind which light rays end, up to each run: where no run up to a ray's end comes between a
/// view ray and the light, or all do, nothing is to be summed.
#[derive(Debug, Default)]
pub struct Extremes {
    lit: Vec<[u32; 2]>,
}

impl Extremes {
    /// Of a row's runs up to the run `last`.
    #[inline(always)]
    pub fn fill(&mut self, lit: &[u32], last: usize) {
        if self.lit.len() <= last {
            self.lit.resize(last + 1, [0; 2]);
        }
        let (mut least, mut most) = (u32::MAX, 0);
        for (extremes, &lit) in self.lit[..=last].iter_mut().zip(lit) {
            least = least.min(lit);
            most = most.max(lit);
            *extremes = [least, most];
        }
    }

    /// Room for so many runs.
    pub fn reserve(&mut self, runs: usize) {
        self.lit.resize(runs.max(self.lit.len()), [0; 2]);
    }

    /// Whether all runs up to and with one are lit, and whether any is, for a view ray.
    #[inline(always)]
    pub fn all_and_any(&self, run: u32, rank: u32) -> [bool; 2] {
        let [least, most] = self.lit[run as usize];
        [least > rank, most > rank]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * self.lit.capacity()
    }
}

/// What the view rays of a band, whose ranks go from `first` to `last`, know of a run without a look at its depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certain {
    /// All of them see it lit.
    Lit,
    /// None does.
    Dark,
    /// Some do.
    No,
}

/// The depths that a band tells apart: those between its view rays, scaled to [−1, 1]. (Klehm et al. 2014, Section 4.1, clamp what
/// lies outside to the borders; here it is no part of the filtered distribution, whose few numbers are spent on what is in doubt.)
#[derive(Debug, Clone, Copy)]
pub struct DepthScale {
    first: u32,
    last: u32,
    per_column: f64,
}

impl DepthScale {
    /// For view rays of ranks from `first` to `last`.
    pub fn new([first, last]: [u32; 2]) -> Self {
        Self { first, last, per_column: 2.0 / f64::from(last - first + 1) }
    }

    /// What is certain of a run that so many columns see lit.
    #[inline(always)]
    pub fn certain(self, lit: u32) -> Certain {
        if lit > self.last {
            Certain::Lit
        } else if lit <= self.first {
            Certain::Dark
        } else {
            Certain::No
        }
    }

    /// Where the surface of a run lies that so many columns see lit.
    #[inline(always)]
    pub fn surface(self, lit: u32) -> f64 {
        (f64::from(lit) - f64::from(self.first)) * self.per_column - 1.0
    }

    /// Where the view ray of a rank lies: between the surfaces that it sees lit and those that it does not.
    #[inline(always)]
    pub fn view_ray(self, rank: u32) -> f64 {
        (f64::from(rank) - f64::from(self.first) + 0.5) * self.per_column - 1.0
    }
}
