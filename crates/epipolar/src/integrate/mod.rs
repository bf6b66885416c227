//! Sums over the lit light rays before each pixel: the in-slice problem `Σ Γ(γ)` over `γ < D, S(γ) > β` (Baran et al.
//! 2010, Sections 4 and 5), by five algorithms that are exact to each other.
//!
//! - [`Integrator::Blocks`]: view rays are swept towards the light; runs are added where they become lit, to prefix sums
//!   in three levels. A query is three look-ups, whatever the number of runs.
//! - [`Integrator::Tree`]: the paper's. View rays are swept from the light on; runs that end are zeroed in a
//!   half-stored partial-sum tree (Fenwick 1994), queries are prefix sums.
//! - [`Integrator::Cursor`]: the same sweep, with block sums and a prefix that moves along with the depth.
//! - [`Integrator::Sweep`]: the dual. Runs are swept from the eye on and added where they end; a query is a suffix sum
//!   over the view rays behind its own, asked when the sweep passes its depth.
//! - [`Integrator::Direct`]: O(queries·runs), the definition.

mod blocks;
mod cursor;
mod direct;
mod fenwick;
mod run_index;
mod sweep;
mod tree;

pub use blocks::Blocks;
pub use run_index::RunIndex;

/// Which algorithm sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Integrator {
    /// Prefix sums in three levels.
    #[default]
    Blocks,
    /// Dual streaming sweep.
    Sweep,
    /// Primal partial-sum tree, the paper's.
    Tree,
    /// Primal blocks with a moving prefix.
    Cursor,
    /// The definition, term by term.
    Direct,
}

impl Integrator {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Blocks, Self::Sweep, Self::Tree, Self::Cursor, Self::Direct];

    /// The fastest for a slice: blocks make queries cheap, the sweep runs. Measured to be equal at about as many of the one
    /// as of the other (foliage with slices half a pixel apart).
    pub fn fastest_for(queries: usize, runs: usize) -> Self {
        if queries >= runs { Self::Blocks } else { Self::Sweep }
    }
}

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
    pub tint: Option<&'a [f32]>,
    /// First rank of a query, and the one after the last.
    pub columns: [u32; 2],
}

/// One problem: runs and queries.
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
    fn column_count(&self) -> usize {
        (self.columns[1] - self.columns[0]) as usize
    }

    /// What a run weighs from its start to `end`.
    #[inline(always)]
    fn part(&self, run: usize, end: &Terms<N>) -> Terms<N> {
        let start = &self.prefix[run];
        let tint = self.tint.map_or(1.0, |tint| tint[run]);
        std::array::from_fn(|term| tint * (end[term] - start[term]))
    }

    /// What a whole run weighs.
    #[inline(always)]
    fn whole(&self, run: usize) -> Terms<N> {
        self.part(run, &self.prefix[run + 1])
    }

    /// How many of the problem's columns see a run lit.
    #[inline(always)]
    fn lit_columns(&self, run: usize) -> usize {
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
    fn column(&self, query: usize) -> usize {
        (self.queries.ranks[query] - self.runs.columns[0]) as usize
    }

    /// What the run in which a query's ray ends adds to it.
    #[inline(always)]
    fn last_part(&self, query: usize) -> Terms<N> {
        let run = self.queries.runs[query] as usize;
        self.runs.last_part(run, self.queries.ranks[query], &self.ends[query])
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut Terms<N>, terms: &Terms<N>) {
    *sum = std::array::from_fn(|term| sum[term] + terms[term]);
}

/// Floats of a cache line.
const LINE: usize = 16;

/// Buffers of the integrators, kept from slice to slice.
#[derive(Debug, Clone, Default)]
pub struct IntegratorScratch {
    sums: Vec<f32>,
    blocks: Vec<f32>,
    heads: Vec<u32>,
    next: Vec<u32>,
}

impl IntegratorScratch {
    /// Grows buffers to what rows of `runs` runs, `columns` columns and `queries` queries need.
    pub fn reserve(&mut self, runs: usize, columns: usize, queries: usize, terms: usize) {
        let longest = runs.max(columns) + 2;
        let spanned = longest.next_multiple_of(blocks::SPAN);
        grow(&mut self.sums, LINE + spanned * terms, 0.0);
        grow(&mut self.blocks, LINE + (spanned / cursor::BLOCK + spanned / blocks::SPAN + 1) * terms, 0.0);
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
fn groups<const N: usize>(flat: &mut [f32], count: usize) -> &mut [Terms<N>] {
    let border = flat.as_ptr().align_offset(4 * LINE).min(LINE);
    &mut flat[border..].as_chunks_mut::<N>().0[..count]
}

/// Sums the lit parts of every query's ray into `out`.
#[inline(always)]
pub fn integrate<const N: usize>(
    integrator: Integrator,
    problem: &Problem<'_, N>,
    scratch: &mut IntegratorScratch,
    out: &mut [Terms<N>],
) {
    match integrator {
        Integrator::Blocks => blocks::integrate(problem, scratch, out),
        Integrator::Sweep => sweep::integrate(problem, scratch, out),
        Integrator::Tree => tree::integrate(problem, scratch, out),
        Integrator::Cursor => cursor::integrate(problem, scratch, out),
        Integrator::Direct => direct::integrate(problem, out),
    }
}

#[cfg(test)]
mod tests;
