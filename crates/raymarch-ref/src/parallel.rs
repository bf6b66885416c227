//! Rows and bands of an image on the caller's rayon pool, or one after the other without the feature `rayon`.
//!
//! Every row is computed alone, so that the number of threads cannot change a bit.

/// Calls `work(index, row)` for every row of `width` values; the last one may be shorter.
pub fn for_each_row<T: Send>(values: &mut [T], width: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        values.par_chunks_mut(width).enumerate().for_each(|(index, row)| work(index, row));
    }
    #[cfg(not(feature = "rayon"))]
    values.chunks_mut(width).enumerate().for_each(|(index, row)| work(index, row));
}

/// Calls `work(index, a, b, c)` for bands of two images (`lengths[0]` pixels each) with a piece of scratch memory
/// (`lengths[1]` values) of their own.
pub fn for_each_band<T: Send, U: Send>(
    (a, b, scratch): (&mut [T], &mut [T], &mut [U]),
    lengths: [usize; 2],
    work: impl Fn(usize, &mut [T], &mut [T], &mut [U]) + Sync,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        a.par_chunks_mut(lengths[0])
            .zip(b.par_chunks_mut(lengths[0]))
            .zip(scratch.par_chunks_mut(lengths[1]))
            .enumerate()
            // Bands differ in cost: a thread that is done early finds single ones to take over.
            .with_max_len(1)
            .for_each(|(index, ((a, b), scratch))| work(index, a, b, scratch));
    }
    #[cfg(not(feature = "rayon"))]
    a.chunks_mut(lengths[0])
        .zip(b.chunks_mut(lengths[0]))
        .zip(scratch.chunks_mut(lengths[1]))
        .enumerate()
        .for_each(|(index, ((a, b), scratch))| work(index, a, b, scratch));
}
