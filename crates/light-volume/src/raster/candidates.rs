//! Which patches of a mesh the rays of a tile, and then of a block, may cross: down a tree of squares, by a beam around them.

use fearless_simd::Simd;

use super::beam::{Beam, LANES};
use super::block_rays::Bounds;
use super::crossings::make_room;
use crate::volume::cells::{PATCH, squares};
use crate::volume::{SquareTree, code_of};

/// A square with faces.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Its first patch: column and row of patches.
    pub place: [u32; 2],
}

/// Squares with faces that rays of a tile may cross; buffers are reused.
#[derive(Debug, Clone, Default)]
pub struct Candidates {
    /// Column border before and behind, row border before and behind, least and greatest code: sixteen squares each.
    boxes: Vec<[[f32; LANES]; 6]>,
    list: Vec<Candidate>,
    stack: Vec<(u8, [u16; 2])>,
    longest_stack: usize,
}

impl Candidates {
    /// Finds the squares of a mesh that rays within `bounds` may cross. O(squares found · log).
    #[inline(always)]
    pub fn find(&mut self, volume: &impl SquareTree, perspective: bool, bounds: &Bounds) {
        self.list.clear();
        self.boxes.clear();
        self.stack.clear();
        if !(bounds.end > 0.0) {
            return;
        }
        self.longest_stack = 4 * (volume.coarsest() + 1);
        self.stack.push((volume.coarsest() as u8, [0; 2]));
        let size = volume.cells();
        let beam = Beam::new(bounds);
        while let Some((level, place)) = self.stack.pop() {
            let (level, place) = (level as usize, place.map(u32::from));
            let spread = volume.bounds(level, place);
            if !(spread[0] <= spread[1]) {
                continue;
            }
            let first = place.map(|n| (n * (PATCH << level)) as f32 + volume.origin());
            let last = [0, 1]
                .map(|axis| (first[axis] + (PATCH << level) as f32).min(size[axis] as f32 + volume.origin()));
            let codes = spread.map(|depth| code_of(depth, perspective));
            let square = [first[0], last[0], first[1], last[1], codes[0], codes[1]];
            if !beam.crosses(&square) {
                continue;
            }
            if level == 0 || volume.is_whole(level, place) {
                self.push(Candidate { place: place.map(|n| n << level) }, &square);
                continue;
            }
            let finer = squares(size, level - 1);
            for [i, j] in [[1, 1], [0, 1], [1, 0], [0, 0]] {
                let [column, row] = [2 * place[0] + i, 2 * place[1] + j];
                if column < finer[0] && row < finer[1] {
                    self.stack.push((level as u8 - 1, [column as u16, row as u16]));
                }
            }
        }
    }

    fn push(&mut self, candidate: Candidate, square: &[f32; 6]) {
        let lane = self.list.len() % LANES;
        if lane == 0 {
            self.boxes.push([[0.0; LANES]; 6]);
        }
        if let Some(boxes) = self.boxes.last_mut() {
            for (values, value) in boxes.iter_mut().zip(square) {
                values[lane] = *value;
            }
        }
        self.list.push(candidate);
    }

    /// How many sixteens of them there are.
    pub fn sixteens(&self) -> usize {
        self.boxes.len()
    }

    /// A bit for each of sixteen that a narrower beam may cross.
    #[inline(always)]
    pub fn met_by<S: Simd>(&self, simd: S, beam: &Beam, sixteen: usize) -> u64 {
        let count = (self.list.len() - sixteen * LANES).min(LANES);
        beam.crosses_sixteen(simd, &self.boxes[sixteen]) & ((1u64 << count) - 1)
    }

    /// One of sixteen.
    #[inline(always)]
    pub fn at(&self, sixteen: usize, index: usize) -> &Candidate {
        &self.list[sixteen * LANES + index]
    }

    /// How many it needs room for: what it has, or had to look at.
    pub fn len(&self) -> usize {
        self.list.len().max(self.longest_stack)
    }

    /// Makes room for twice as many.
    pub fn make_room(&mut self, most: usize) {
        make_room(&mut self.list, most);
        make_room(&mut self.boxes, most / LANES + 1);
        make_room(&mut self.stack, most);
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        (self.boxes.capacity() * size_of::<[[f32; LANES]; 6]>()
            + self.list.capacity() * size_of::<Candidate>()
            + self.stack.capacity() * size_of::<(u8, [u16; 2])>()) as u64
    }
}
