//! The in-slice problem, whatever solves it: runs of light rays, queries of view rays, and the buffers of the sums.

/// A factor's values at a light ray: one a term of the factorisation.
pub type Terms<const N: usize> = [f32; N];

/// The pixels to be answered, in the order of their columns.
#[derive(Debug, Clone, Copy)]
pub struct Queries<'a> {
    /// Column of each, counted from the light.
    pub ranks: &'a [u32],
    /// The run in which its ray ends.
    pub runs: &'a [u32],
}

/// The runs of a row up to some reach, as some consecutive columns see them.
#[derive(Debug, Clone, Copy)]
pub struct Runs<'a, const N: usize> {
    /// Per run the columns that see it lit, counted from the light.
    pub lit: &'a [u32],
    /// `∫ Γ` up to the start of each run, and to the end of the last.
    pub prefix: &'a [Terms<N>],
    /// Colour of each run, if the light has any.
    pub colour: Option<&'a [f32]>,
    /// First rank of a query, and the one after the last.
    pub columns: [u32; 2],
}

/// The in-slice problem `Σ Γ(γ) over γ < D, S(γ) > β` for many (D, β) at once (Baran et al. 2010, Section 4): runs and queries.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a, const N: usize> {
    /// What is summed.
    pub runs: Runs<'a, N>,
    /// Up to where; ranks within the runs' `columns`.
    pub queries: Queries<'a>,
    /// `∫ Γ` up to the end of each query's ray.
    pub ends: &'a [Terms<N>],
    /// Whether queries come with ascending ranks; else descending.
    pub ascending: bool,
}

impl<const N: usize> Runs<'_, N> {
    /// Number of columns.
    #[inline(always)]
    pub(crate) fn column_count(&self) -> usize {
        (self.columns[1] - self.columns[0]) as usize
    }

    /// What a run weighs from its start to `end`.
    #[inline(always)]
    pub(crate) fn part(&self, run: usize, end: &Terms<N>) -> Terms<N> {
        let start = &self.prefix[run];
        let colour = self.colour.map_or(1.0, |colour| colour[run]);
        std::array::from_fn(|term| colour * (end[term] - start[term]))
    }

    /// What a whole run weighs.
    #[inline(always)]
    pub(crate) fn whole(&self, run: usize) -> Terms<N> {
        self.part(run, &self.prefix[run + 1])
    }

    /// How many of the problem's columns see a run lit.
    #[inline(always)]
    pub(crate) fn lit_columns(&self, run: usize) -> usize {
        self.lit[run].clamp(self.columns[0], self.columns[1]) as usize - self.columns[0] as usize
    }

    /// The part up to `end` of the run in which the ray of a column with that rank ends, if it is lit there. Without a
    /// branch: whether a pixel is lit is what nobody can foresee.
    #[inline(always)]
    pub fn last_part(&self, run: usize, rank: u32, end: &Terms<N>) -> Terms<N> {
        let lit = if self.lit[run] > rank { 1.0 } else { 0.0 };
        self.part(run, end).map(|term| lit * term)
    }
}

impl<const N: usize> Problem<'_, N> {
    /// A query's column within the problem.
    #[inline(always)]
    pub(crate) fn column(&self, query: usize) -> usize {
        (self.queries.ranks[query] - self.runs.columns[0]) as usize
    }

    /// What the run in which a query's ray ends adds to it.
    #[inline(always)]
    pub(crate) fn last_part(&self, query: usize) -> Terms<N> {
        let run = self.queries.runs[query] as usize;
        self.runs.last_part(run, self.queries.ranks[query], &self.ends[query])
    }
}

#[inline(always)]
pub(crate) fn add<const N: usize>(sum: &mut Terms<N>, terms: &Terms<N>) {
    *sum = std::array::from_fn(|term| sum[term] + terms[term]);
}

/// Elements of a block of sums: runs of a block, blocks of a span. Larger ones add more a run, smaller ones need more levels.
pub(crate) const BLOCK: usize = 16;

/// Runs of a span of blocks.
pub(crate) const SPAN: usize = BLOCK * BLOCK;

/// Floats of a cache line.
const LINE: usize = 16;

/// Buffers of the sums, kept from slice to slice.
#[derive(Debug, Clone, Default)]
pub struct SumScratch {
    pub(crate) sums: Vec<f32>,
    pub(crate) blocks: Vec<f32>,
    pub(crate) heads: Vec<u32>,
    pub(crate) next: Vec<u32>,
}

impl SumScratch {
    /// Grows buffers to what rows of `runs` runs, `columns` columns and `queries` queries need.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize, terms: usize) {
        let longest = runs.max(columns) + 2;
        let spanned = longest.next_multiple_of(SPAN);
        grow(&mut self.sums, LINE + spanned * terms, 0.0);
        grow(&mut self.blocks, LINE + (spanned / BLOCK + spanned / SPAN + 1) * terms, 0.0);
        grow(&mut self.heads, longest, 0);
        grow(&mut self.next, runs.max(queries) + 1, 0);
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.sums.capacity() + self.blocks.capacity() + self.heads.capacity() + self.next.capacity())
    }
}

fn grow<T: Clone>(buffer: &mut Vec<T>, length: usize, value: T) {
    if buffer.len() < length {
        buffer.resize(length, value);
    }
}

/// Groups of N numbers of a flat buffer, from where a cache line begins: a wide store over the border between two lines
/// takes twice as long, and what is read behind it waits.
#[inline(always)]
pub(crate) fn groups<const N: usize>(flat: &mut [f32], count: usize) -> &mut [Terms<N>] {
    let border = flat.as_ptr().align_offset(4 * LINE).min(LINE);
    &mut flat[border..].as_chunks_mut::<N>().0[..count]
}
