//! Caps and walls of a square of texels: rectangles of equal depth, runs of equal steps.
//!
//! A square owns its caps and the walls on its left and upper border; at the map's own right and lower border those walls as
//! well. So every wall has one owner, and the mesh is closed whatever squares lie beside each other.

use super::face::{Axis, Face, FaceLists};

/// A map as the mesh sees it: no surface outside.
#[derive(Clone, Copy)]
pub struct Depths<'a> {
    /// `[row][column]`.
    pub texels: &'a [f32],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Depths<'_> {
    #[inline(always)]
    fn at(&self, i: u32, j: u32) -> f32 {
        self.texels[j as usize * self.size[0] as usize + i as usize]
    }

    /// Depths before and behind the column border `i`, in row `j`.
    #[inline(always)]
    fn across_columns(&self, i: u32, j: u32) -> [f32; 2] {
        let before = if i == 0 { f32::INFINITY } else { self.at(i - 1, j) };
        let behind = if i == self.size[0] { f32::INFINITY } else { self.at(i, j) };
        [before, behind]
    }

    /// Depths before and behind the row border `j`, in column `i`.
    #[inline(always)]
    fn across_rows(&self, i: u32, j: u32) -> [f32; 2] {
        let before = if j == 0 { f32::INFINITY } else { self.at(i, j - 1) };
        let behind = if j == self.size[1] { f32::INFINITY } else { self.at(i, j) };
        [before, behind]
    }
}

/// Writes the faces of the texels `[x0, x1) × [y0, y1)`: of a patch of at most 8×8, or of a larger square if `is_flat` says
/// that all of it has one depth. With `merges`, equal texels and equal steps side by side become one face.
pub fn write(
    depths: &Depths<'_>,
    [x0, y0]: [u32; 2],
    [x1, y1]: [u32; 2],
    (is_flat, merges): (bool, bool),
    faces: &mut FaceLists,
) {
    if is_flat && merges {
        let depth = depths.at(x0, y0);
        if depth < f32::INFINITY {
            faces.push(&Face { axis: Axis::Depth, first: [x0, y0], last: [x1, y1], depth: [depth; 2] });
        }
    } else {
        write_caps(depths, [x0, y0], [x1, y1], merges, faces);
    }
    for i in borders([x0, x1], depths.size[0], is_flat) {
        let steps = |j| depths.across_columns(i, j);
        runs([y0, y1], merges, steps, |j, end, depth| {
            faces.push(&Face { axis: Axis::Column, first: [i, j], last: [i, end], depth });
        });
    }
    for j in borders([y0, y1], depths.size[1], is_flat) {
        let steps = |i| depths.across_rows(i, j);
        runs([x0, x1], merges, steps, |i, end, depth| {
            faces.push(&Face { axis: Axis::Row, first: [i, j], last: [end, j], depth });
        });
    }
}

/// The borders that walls of a square may stand on: the first one, those inside of it unless it is flat, and the map's own
/// last one.
fn borders([first, last]: [u32; 2], size: u32, is_flat: bool) -> impl Iterator<Item = u32> {
    let inner = if is_flat { first + 1 } else { last };
    (first..inner).chain((last == size).then_some(last))
}

/// Caps of at most 8×8 texels: from each texel that has none yet as far right, and then as far down, as depths are equal.
fn write_caps(
    depths: &Depths<'_>,
    [x0, y0]: [u32; 2],
    [x1, y1]: [u32; 2],
    merges: bool,
    faces: &mut FaceLists,
) {
    let bits = |i: u32, length: u32, j: u32| ((1u64 << length) - 1) << (8 * (j - y0) + (i - x0));
    let mut covered = 0u64;
    for j in y0..y1 {
        for i in x0..x1 {
            let depth = depths.at(i, j);
            if covered & bits(i, 1, j) != 0 || depth == f32::INFINITY {
                continue;
            }
            let (mut width, mut height) = (1, 1);
            if merges {
                let is_free = |i: u32, j: u32| depths.at(i, j) == depth && covered & bits(i, 1, j) == 0;
                while i + width < x1 && is_free(i + width, j) {
                    width += 1;
                }
                while j + height < y1 && (i..i + width).all(|i| is_free(i, j + height)) {
                    height += 1;
                }
            }
            for j in j..j + height {
                covered |= bits(i, width, j);
            }
            let last = [i + width, j + height];
            faces.push(&Face { axis: Axis::Depth, first: [i, j], last, depth: [depth; 2] });
        }
    }
}

/// Calls `each(start, end, step)` for runs of equal steps along `[first, last)`; texels of one depth make no step.
#[inline(always)]
fn runs(
    [first, last]: [u32; 2],
    merges: bool,
    step_at: impl Fn(u32) -> [f32; 2],
    mut each: impl FnMut(u32, u32, [f32; 2]),
) {
    let (mut start, mut open) = (first, [0.0; 2]);
    for n in first..last {
        let step = step_at(n);
        if step != open || !merges {
            if open[0] != open[1] {
                each(start, n, open);
            }
            (start, open) = (n, step);
        }
    }
    if open[0] != open[1] {
        each(start, last, open);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(depths: &Depths<'_>, merges: bool) -> Vec<Face> {
        let mut lists = FaceLists::default();
        lists.begin([0, 0]);
        write(depths, [0, 0], depths.size, (false, merges), &mut lists);
        let chunks = lists.chunks().iter();
        chunks.flat_map(|chunk| (0..usize::from(chunk.count)).map(|n| chunk.face(n))).collect()
    }

    #[test]
    fn equal_texels_are_one_cap_and_equal_steps_one_wall() {
        // A pit of 2×3 texels in a plate that fills the map.
        let is_pit = |n: u32| (2..4).contains(&(n % 6)) && (1..4).contains(&(n / 6));
        let texels: Vec<f32> = (0..30).map(|n| if is_pit(n) { 9.0 } else { 4.0 }).collect();
        let depths = Depths { texels: &texels, size: [6, 5] };
        let faces = written(&depths, true);
        let count = |axis| faces.iter().filter(|face| face.axis == axis).count();
        // The pit's bottom, and what is left of the plate in four pieces; the pit's sides, and the sides of the map.
        assert_eq!([Axis::Depth, Axis::Column, Axis::Row].map(count), [5, 4, 4], "{faces:?}");
        let area = |face: &Face| (face.last[0] - face.first[0]) * (face.last[1] - face.first[1]);
        assert_eq!(faces.iter().map(area).sum::<u32>(), 30);
        assert_eq!(faces.iter().filter(|face| face.depth.contains(&f32::INFINITY)).count(), 4);
        // Unmerged: a cap a texel, and a wall a step of a texel.
        let faces = written(&depths, false);
        let count = |axis| faces.iter().filter(|face| face.axis == axis).count();
        let expected = [30, 2 * 3 + 2 * 5, 2 * 2 + 2 * 6];
        assert_eq!([Axis::Depth, Axis::Column, Axis::Row].map(count), expected);
    }
}
