//! Rows, bands and workers of an image on the caller's rayon pool, or one after the other without the feature `rayon`.
//!
//! Every row is computed alone and written by one thread, so that the number of threads cannot change a bit.

/// Calls `work(index, row)` for every row of `width` ≥ 1 values; the last one may be shorter.
pub fn for_each_row<T: Send>(values: &mut [T], width: usize, work: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        values.par_chunks_mut(width).enumerate().for_each(|(index, row)| work(index, row));
    }
    #[cfg(not(feature = "rayon"))]
    values.chunks_mut(width).enumerate().for_each(|(index, row)| work(index, row));
}

/// Calls `work(index, a, b)` for the rows of two images of one width ≥ 1: radiance and transmittance.
pub fn for_each_row_of_both<T: Send, U: Send>(
    (a, b): (&mut [T], &mut [U]),
    width: usize,
    work: impl Fn(usize, &mut [T], &mut [U]) + Sync + Send,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        a.par_chunks_mut(width)
            .zip(b.par_chunks_mut(width))
            .enumerate()
            .for_each(|(index, (a, b))| work(index, a, b));
    }
    #[cfg(not(feature = "rayon"))]
    a.chunks_mut(width).zip(b.chunks_mut(width)).enumerate().for_each(|(index, (a, b))| work(index, a, b));
}

/// Calls `work(index, a, b, own)` for bands of two images (`lengths[0]` pixels each), each with a piece of a third buffer
/// (`lengths[1]` values) of its own: scratch memory, counts. Bands may differ in cost: a thread that is done early finds
/// single ones to take over.
pub fn for_each_band<T: Send, U: Send>(
    (a, b, own): (&mut [T], &mut [T], &mut [U]),
    lengths: [usize; 2],
    work: impl Fn(usize, &mut [T], &mut [T], &mut [U]) + Sync + Send,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        a.par_chunks_mut(lengths[0])
            .zip(b.par_chunks_mut(lengths[0]))
            .zip(own.par_chunks_mut(lengths[1]))
            .enumerate()
            .with_max_len(1)
            .for_each(|(index, ((a, b), own))| work(index, a, b, own));
    }
    #[cfg(not(feature = "rayon"))]
    a.chunks_mut(lengths[0])
        .zip(b.chunks_mut(lengths[0]))
        .zip(own.chunks_mut(lengths[1]))
        .enumerate()
        .for_each(|(index, ((a, b), own))| work(index, a, b, own));
}

/// Calls both, side by side where the pool has a free thread.
pub fn join(a: impl FnOnce() + Send, b: impl FnOnce() + Send) {
    #[cfg(feature = "rayon")]
    rayon::join(a, b);
    #[cfg(not(feature = "rayon"))]
    {
        a();
        b();
    }
}

/// How many workers keep the pool busy: its threads; 1 without the feature `rayon`.
pub fn worker_count() -> usize {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    1
}

/// Calls `work(worker)` for every worker, side by side: for tasks that they take from a shared list themselves.
pub fn for_each_worker<W: Send>(workers: &mut [W], work: impl Fn(&mut W) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        workers.par_iter_mut().with_max_len(1).for_each(work);
    }
    #[cfg(not(feature = "rayon"))]
    workers.iter_mut().for_each(work);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_and_band_is_visited_once_with_its_own_part() {
        // 7 rows of 5, in bands of 3 rows, the last one short.
        let mut rows = vec![0usize; 35];
        for_each_row(&mut rows, 5, |y, row| {
            row.iter_mut().enumerate().for_each(|(x, value)| *value += 5 * y + x)
        });
        assert!(rows.iter().enumerate().all(|(index, value)| index == *value));

        let (mut a, mut b) = (vec![0usize; 35], vec![0u8; 35]);
        for_each_row_of_both((&mut a, &mut b), 5, |y, a, b| {
            a.fill(y);
            b.fill(y as u8 + 1);
        });
        assert!((0..35).all(|index| a[index] == index / 5 && usize::from(b[index]) == index / 5 + 1));

        let (mut a, mut b, mut own) = (vec![0usize; 35], vec![0usize; 35], vec![0usize; 6]);
        for_each_band((&mut a, &mut b, &mut own), [15, 2], |band, a, b, own| {
            a.fill(band);
            b.fill(10 * band);
            own.fill(a.len());
        });
        assert!((0..35).all(|index| a[index] == index / 15 && b[index] == 10 * a[index]));
        assert_eq!(own, [15, 15, 15, 15, 5, 5]);
    }

    #[test]
    fn every_worker_works_once() {
        let mut workers = vec![0; 2 * worker_count() + 1];
        for_each_worker(&mut workers, |worker| *worker += 1);
        assert!(workers.iter().all(|&count| count == 1));
    }
}
