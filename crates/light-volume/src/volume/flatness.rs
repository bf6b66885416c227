//! Which squares of an interpolated surface two triangles may stand for: the edge map and its hierarchy (Billeter et al. 2010,
//! Section 4.1).
//!
//! The paper filters the map with a Laplacian, builds a hierarchy of what it finds, and subdivides where a threshold is exceeded;
//! neighbours never differ by more than one level. Here the filter is the second difference along a quad's four sides and its
//! diagonal, `z(middle) − (z(a) + z(b))/2`, anew at each level over that level's distance. That is by how much the level's two
//! triangles miss the next finer level's vertices; between its vertices the difference of the two surfaces is linear. So
//!
//! ```text
//! off(quad) = max over its four parts of off(part) + max of its five second differences
//! ```
//!
//! bounds by how much the quad's triangles miss the base grid, and the threshold is a bound of the mesh's error along the light. A
//! Laplacian vanishes on saddles, which no plane is near to, and of one texel's distance says nothing of a long smooth slope.
//! Stitched quads have other triangles, which are off by the five differences once more.

use scatter_core::{ShadowLayer, parallel};

use super::cells::Tolerance;
use super::code::code_of;

/// How far quads are off, in codes; level n has quads of 2ⁿ cells a side, from 1 on.
#[derive(Debug, Clone, Default)]
pub struct Flatness {
    /// Columns and rows of cells.
    cells: [u32; 2],
    /// `∞` for a quad that is to be subdivided. Levels above the last one with a whole quad are empty.
    levels: Vec<Vec<f32>>,
}

/// Quads of a level along columns and rows.
fn quads(cells: [u32; 2], level: usize) -> [u32; 2] {
    cells.map(|n| n.div_ceil(1 << level))
}

impl Flatness {
    /// Every quad is to be subdivided: the base grid.
    pub fn clear(&mut self, cells: [u32; 2]) {
        self.cells = cells;
        self.levels.iter_mut().for_each(Vec::clear);
    }

    /// Of a layer's cells. Buffers are reused. O(texels).
    pub fn build(&mut self, layer: &ShadowLayer<'_>, tolerance: &Tolerance) {
        self.clear(layer.projection().size().map(|n| n + 1));
        for level in 1.. {
            let [columns, rows] = quads(self.cells, level);
            if level > 15 || (columns < 2 && rows < 2) {
                return;
            }
            if self.levels.len() < level {
                self.levels.push(Vec::new());
            }
            let (finer, of_level) = self.levels.split_at_mut(level - 1);
            let of_level = &mut of_level[0];
            of_level.resize((columns * rows) as usize, f32::INFINITY);
            let finer = finer.last().map(Vec::as_slice);
            let cells = self.cells;
            parallel::for_each_row(of_level, columns as usize, |row, values| {
                for (column, value) in values.iter_mut().enumerate() {
                    let place = [column as u32, row as u32];
                    let parts = match finer {
                        None => is_regular(layer, place).then_some(0.0),
                        Some(finer) => parts_off(finer, quads(cells, level - 1), place),
                    };
                    *value =
                        parts.map_or(f32::INFINITY, |parts| off(layer, (level, place), parts, tolerance));
                }
            });
            if of_level.iter().all(|value| *value == f32::INFINITY) {
                of_level.clear();
                return;
            }
        }
    }

    /// Whether all of a quad's cells are within one quad of its level or of a coarser one. All cells are, at level 0.
    #[inline(always)]
    pub fn is_whole(&self, level: usize, [column, row]: [u32; 2]) -> bool {
        if level == 0 {
            return true;
        }
        let Some(values) = self.levels.get(level - 1) else { return false };
        let [columns, rows] = quads(self.cells, level);
        column < columns
            && row < rows
            && values.get((row * columns + column) as usize).is_some_and(|value| *value < f32::INFINITY)
    }

    /// The level of the quad that a cell is in.
    #[inline(always)]
    pub fn level_of(&self, [i, j]: [u32; 2]) -> usize {
        let mut level = 0;
        while self.is_whole(level + 1, [i >> (level + 1), j >> (level + 1)]) {
            level += 1;
        }
        level
    }

    /// The sides beyond which quads are finer than one of that level and place, as `STITCHINGS` has them.
    pub fn finer_sides(&self, level: usize, [column, row]: [u32; 2]) -> u8 {
        if level == 0 {
            return 0;
        }
        // No quad above level 0 touches the border of the cells.
        let beyond = [[column, row - 1], [column + 1, row], [column, row + 1], [column - 1, row]];
        beyond.iter().enumerate().map(|(side, place)| u8::from(!self.is_whole(level, *place)) << side).sum()
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.levels.iter().map(|level| level.capacity() * size_of::<f32>()).sum::<usize>() as u64
    }
}

/// Whether none of the four cells of a quad of level 1 lies at the map's border, has a hole at a corner, or lies beside a cell that
/// has: where depths jump is no quad.
fn is_regular(layer: &ShadowLayer<'_>, [column, row]: [u32; 2]) -> bool {
    let [width, height] = layer.projection().size();
    if column == 0 || row == 0 || 2 * column + 2 > width || 2 * row + 2 > height {
        return false;
    }
    // Texels at the quad's corners: 2·column − 1 to 2·column + 1; cells beside it reach one further.
    let span = |n: u32, size: u32| (2 * n - 2, (2 * n + 2).min(size - 1));
    let ((left, right), (top, bottom)) = (span(column, width), span(row, height));
    (top..=bottom).all(|j| {
        let is_beside = j == 2 * row - 2 || j == 2 * row + 2;
        (left..=right).all(|i| {
            let is_corner = is_beside && (i == 2 * column - 2 || i == 2 * column + 2);
            is_corner || layer.at(i, j) < f32::INFINITY
        })
    })
}

/// How far the four parts of a quad are off, if they are whole, and the eight beside them are.
fn parts_off(finer: &[f32], [columns, rows]: [u32; 2], [column, row]: [u32; 2]) -> Option<f32> {
    let (x, y) = (2 * column, 2 * row);
    if x == 0 || y == 0 || x + 2 >= columns || y + 2 >= rows {
        return None;
    }
    let at = |x: u32, y: u32| finer[(y * columns + x) as usize];
    let inner = at(x, y).max(at(x + 1, y)).max(at(x, y + 1).max(at(x + 1, y + 1)));
    let beside = [
        at(x, y - 1).max(at(x + 1, y - 1)),
        at(x + 2, y).max(at(x + 2, y + 1)),
        at(x, y + 2).max(at(x + 1, y + 2)),
        at(x - 1, y).max(at(x - 1, y + 1)),
    ];
    (inner < f32::INFINITY && beside.iter().all(|off| *off < f32::INFINITY)).then_some(inner)
}

/// How far a quad is off whose parts are off by `parts`; `∞` if that is more than the tolerance.
#[inline(always)]
fn off(
    layer: &ShadowLayer<'_>,
    (level, [column, row]): (usize, [u32; 2]),
    parts: f32,
    tolerance: &Tolerance,
) -> f32 {
    let perspective = layer.projection().is_perspective();
    let half = 1 << (level - 1);
    let (x, y) = ((column << level) - 1, (row << level) - 1);
    let code = |i: u32, j: u32| code_of(layer.at(x + i * half, y + j * half), perspective);
    let corners = [code(0, 0), code(2, 0), code(0, 2), code(2, 2)];
    let [a, b, c, d] = corners;
    let second = |middle: f32, a: f32, b: f32| (middle - 0.5 * (a + b)).abs();
    let sides = second(code(1, 0), a, b).max(second(code(1, 2), c, d));
    let sides = sides.max(second(code(0, 1), a, c)).max(second(code(2, 1), b, d));
    let difference = sides.max(second(code(1, 1), a, d));
    let off = parts + difference;
    // A share of the depth: (w' − w)/w = (z − z')/z' for codes z = −1/w, and z' lies between the vertices'.
    let allowed = if perspective {
        tolerance.relative * (corners.iter().fold(f32::INFINITY, |least, code| least.min(code.abs())) - off)
    } else {
        tolerance.absolute
    };
    if off + difference <= allowed { off } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_core::MapProjection;

    fn flatness(texels: &[f32], size: [u32; 2], tolerance: f32) -> Flatness {
        let map =
            MapProjection::orthographic([0.0; 3], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 2], size).unwrap();
        let layer = ShadowLayer::new(map, texels).unwrap();
        let mut flatness = Flatness::default();
        flatness.build(&layer, &Tolerance { absolute: tolerance, relative: 0.0 });
        flatness
    }

    #[test]
    fn planes_become_large_quads_and_neighbours_differ_by_one_level() {
        let size = [67, 45];
        let texels: Vec<f32> = (0..67 * 45)
            .map(|n| {
                let (x, y) = (n % 67, n / 67);
                if (x, y) == (40, 20) { 9.0 } else { 3.0 + 0.25 * x as f32 + 0.5 * y as f32 }
            })
            .collect();
        let found = flatness(&texels, size, 0.0);
        let mut greatest = 0;
        for j in 0..=45 {
            for i in 0..=67 {
                let level = found.level_of([i, j]);
                greatest = greatest.max(level);
                for [x, y] in [[i + 1, j], [i, j + 1]] {
                    assert!(x > 67 || y > 45 || found.level_of([x, y]).abs_diff(level) <= 1, "{i} {j}");
                }
            }
        }
        assert_eq!(greatest, 3);
        assert_eq!(found.level_of([40, 20]), 0);
    }

    #[test]
    fn a_saddle_is_no_plane() {
        let texels: Vec<f32> = (0..33 * 33)
            .map(|n| {
                let (x, y) = ((n % 33) as f32, (n / 33) as f32);
                50.0 + 0.01 * (x * x - y * y)
            })
            .collect();
        let found = flatness(&texels, [33, 33], 0.0);
        assert!((0..34).all(|n| found.level_of([n, 17]) == 0));
    }
}
