//! A band of a slice: view rays whose pixels are answered from the same filtered rows, and the weights of those.

use epipolar::driver::SliceView;

use super::lamp_table::LampTable;

/// View rays of some queries, column by column.
#[derive(Clone, Copy)]
pub struct QueryRays<'a> {
    /// Column of each, from the slice's first.
    pub columns: &'a [u32],
    /// The light ray in which each ends.
    pub gammas: &'a [f32],
}

/// Weights of one band, up to each of its row's runs and to the ends of its view rays; a buffer.
#[derive(Debug, Default)]
pub struct BandWeights {
    /// Up to the start of each run, by the nearer reference and the farther one (which are one where nothing is blended).
    pub starts: [Vec<f32>; 2],
    /// Up to the end of each query's ray.
    pub ends: [Vec<f32>; 2],
    /// Part of the farther reference, of each query.
    pub blend: Vec<f32>,
    /// Half the L1 distance of these weights from the query's own, from above.
    pub apart: Vec<f32>,
    /// What they are off by of a query's lit share, relative to it, from above.
    pub relative: Vec<f32>,
    /// What a lamp's table adds, of all light.
    pub rough: Vec<f32>,
    /// Whether there are two references.
    pub blends: bool,
    pub(super) lamp: LampTable,
}

impl BandWeights {
    /// Room for so many runs and queries.
    pub fn make_room(&mut self, runs: usize, queries: usize) {
        let grow = |list: &mut Vec<f32>, length: usize| {
            if list.len() < length {
                list.resize(length, 0.0);
            }
        };
        self.starts.iter_mut().for_each(|list| grow(list, runs + 1));
        self.ends.iter_mut().for_each(|list| grow(list, queries));
        grow(&mut self.blend, queries);
        grow(&mut self.apart, queries);
        grow(&mut self.relative, queries);
        grow(&mut self.rough, queries);
    }

    /// Room for the tables of a lamp, too.
    pub fn reserve(&mut self, runs: usize, queries: usize, is_lamp: bool) {
        self.make_room(runs, queries);
        if is_lamp {
            self.lamp.reserve();
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        let lists = self.starts.iter().chain(&self.ends).chain([
            &self.blend,
            &self.apart,
            &self.relative,
            &self.rough,
        ]);
        4 * lists.map(Vec::capacity).sum::<usize>() + self.lamp.memory_bytes()
    }
}

/// The column half way between the angles of the first and the last: the paper's bisectrix.
pub(super) fn middle_of(slice: &SliceView<'_>, columns: &[u32]) -> u32 {
    let angle = |column: u32| {
        let index = column as usize;
        slice.sines()[index].atan2(slice.cosines()[index])
    };
    let (first, last) = (columns[0], columns[columns.len() - 1]);
    let middle = 0.5 * (angle(first) + angle(last));
    let ascends = angle(last) >= angle(first);
    let (mut from, mut to) = (first, last);
    while from < to {
        let column = from + (to - from) / 2;
        if (angle(column) < middle) == ascends { from = column + 1 } else { to = column }
    }
    from
}

/// The column of the smallest angle to the light: the first or the last, since angles of a slice ascend or descend.
pub(super) fn nearest_to_light(slice: &SliceView<'_>, columns: &[u32]) -> u32 {
    let (first, last) = (columns[0], columns[columns.len() - 1]);
    let cosine = |column: u32| slice.cosines()[column as usize];
    if cosine(first) >= cosine(last) { first } else { last }
}
