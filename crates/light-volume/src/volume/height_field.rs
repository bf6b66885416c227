//! The interpolated surface of a map: cells between texels' centres, two triangles each, and a tree of their depths.
//!
//! Vertices stand at the texels' centres (Billeter et al. 2010, Section 4), cells are divided from their top left to their bottom
//! right, and the half texels at the map's border extend the centres' depths flat to it. A cell with a corner at `+∞` is stepped:
//! each of its quarters has its own texel's depth. Where depths jump (around stepped cells, and at the map's border) the mesh has
//! walls along the light. Cells follow from the texels: only the tree is stored.
//!
//! Cell `(i, j)` lies between the centres of the texels `(i−1, j−1)` and `(i, j)`: there is one more of them along each axis than
//! there are texels.

use scatter_core::{ShadowLayer, parallel};

use super::cells::{EMPTY, PATCH, halve, joined, level_count, squares};

/// A part of the surface over a rectangle of the map: two triangles, or a flat quarter of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// First and last column.
    pub columns: [f32; 2],
    /// First and last row.
    pub rows: [f32; 2],
    /// Column and row of the top left vertex; the others are a texel to the right and below.
    pub corner: [f32; 2],
    /// Depths of the vertices: top left, top right, bottom left, bottom right. All finite.
    pub depths: [f32; 4],
    /// Whether depths may jump at its first and last column, and at its first and last row.
    pub walls: [[bool; 2]; 2],
}

impl Facet {
    /// Whether depths may jump anywhere at its border.
    pub fn has_walls(&self) -> bool {
        self.walls != [[false; 2]; 2]
    }
}

/// The cells of a layer.
#[derive(Debug, Clone, Default)]
pub struct HeightField {
    /// Columns and rows of cells.
    cells: [u32; 2],
    /// Bounds of the depths of the squares of cells of each level; level 0 is that of patches.
    bounds: Vec<Vec<[f32; 2]>>,
}

impl HeightField {
    /// Finds the bounds anew. Buffers are reused. O(texels).
    pub fn build(&mut self, layer: &ShadowLayer<'_>) {
        self.cells = layer.projection().size().map(|n| n + 1);
        let (cells, count) = (self.cells, level_count(self.cells));
        self.bounds.resize_with(count.max(self.bounds.len()), Vec::new);
        for (level, bounds) in self.bounds.iter_mut().enumerate() {
            let [columns, rows] = if level < count { squares(cells, level) } else { [0; 2] };
            bounds.resize((columns * rows) as usize, EMPTY);
        }
        let [columns, _] = squares(cells, 0);
        parallel::for_each_row(&mut self.bounds[0], columns as usize, |row, bounds| {
            for (column, bounds) in bounds.iter_mut().enumerate() {
                *bounds = EMPTY;
                for_each_cell(cells, [column as u32, row as u32], |i, j| {
                    *bounds = joined(*bounds, bounds_of(layer, [i, j]));
                });
            }
        });
        for level in 1..count {
            let (finer, coarser) = self.bounds.split_at_mut(level);
            halve(&finer[level - 1], squares(cells, level - 1), &mut coarser[0]);
        }
    }

    /// Columns and rows of cells.
    pub fn cells(&self) -> [u32; 2] {
        self.cells
    }

    /// The coarsest level of the tree, that of a single square.
    pub fn coarsest(&self) -> usize {
        level_count(self.cells) - 1
    }

    /// Nearest and farthest depth of what rays may cross in a square of a level; the first is greater where there is nothing.
    #[inline(always)]
    pub fn bounds(&self, level: usize, [column, row]: [u32; 2]) -> [f32; 2] {
        let [columns, _] = squares(self.cells, level);
        self.bounds[level][(row * columns + column) as usize]
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        self.bounds.iter().map(|level| level.capacity() * size_of::<[f32; 2]>()).sum::<usize>() as u64
    }
}

/// Calls `each(column, row)` for the cells of a patch.
pub fn for_each_cell(cells: [u32; 2], [column, row]: [u32; 2], mut each: impl FnMut(u32, u32)) {
    for j in row * PATCH..cells[1].min((row + 1) * PATCH) {
        for i in column * PATCH..cells[0].min((column + 1) * PATCH) {
            each(i, j);
        }
    }
}

/// Depths at the corners of a cell, those of the border's texels outside of the map.
fn corners(layer: &ShadowLayer<'_>, [i, j]: [u32; 2]) -> [f32; 4] {
    let [width, height] = layer.projection().size();
    let columns = [i.max(1) - 1, i.min(width - 1)];
    let rows = [j.max(1) - 1, j.min(height - 1)];
    [
        layer.at(columns[0], rows[0]),
        layer.at(columns[1], rows[0]),
        layer.at(columns[0], rows[1]),
        layer.at(columns[1], rows[1]),
    ]
}

fn is_stepped(layer: &ShadowLayer<'_>, cell: [u32; 2]) -> bool {
    corners(layer, cell).contains(&f32::INFINITY)
}

/// Where depths may jump at the border of a cell without a hole: beside cells that have one, and at the map's border.
fn walls_of(layer: &ShadowLayer<'_>, [i, j]: [u32; 2]) -> [[bool; 2]; 2] {
    let [width, height] = layer.projection().size();
    let stepped = |i: u32, j: u32| is_stepped(layer, [i, j]);
    [
        [i == 0 || stepped(i - 1, j), i == width || stepped(i + 1, j)],
        [j == 0 || stepped(i, j - 1), j == height || stepped(i, j + 1)],
    ]
}

fn bounds_of(layer: &ShadowLayer<'_>, cell: [u32; 2]) -> [f32; 2] {
    let depths = corners(layer, cell);
    let finite = depths.iter().filter(|depth| depth.is_finite());
    let spread = finite.fold(EMPTY, |spread, depth| joined(spread, [*depth; 2]));
    let jumps =
        spread != EMPTY && (depths.contains(&f32::INFINITY) || walls_of(layer, cell) != [[false; 2]; 2]);
    // Behind a wall a ray in the dark crosses one that is no border of the shadow together with its twin: neither may be left out.
    if jumps { [spread[0], f32::INFINITY] } else { spread }
}

/// Calls `each` for the facets of a cell.
#[inline(always)]
pub fn for_each_facet(layer: &ShadowLayer<'_>, [i, j]: [u32; 2], mut each: impl FnMut(&Facet)) {
    let [width, height] = layer.projection().size();
    let depths = corners(layer, [i, j]);
    let corner = [i as f32 - 0.5, j as f32 - 0.5];
    // Of a border's cell the half inside of the map.
    let span = |n: u32, size: u32| [(n as f32 - 0.5).max(0.0), (n as f32 + 0.5).min(size as f32)];
    let (columns, rows) = (span(i, width), span(j, height));
    if !depths.contains(&f32::INFINITY) {
        each(&Facet { columns, rows, corner, depths, walls: walls_of(layer, [i, j]) });
        return;
    }
    let (middle, centre) = (i as f32, j as f32);
    for (n, depth) in depths.into_iter().enumerate() {
        let columns = if n % 2 == 0 { [columns[0], middle] } else { [middle, columns[1]] };
        let rows = if n / 2 == 0 { [rows[0], centre] } else { [centre, rows[1]] };
        if depth.is_finite() && columns[0] < columns[1] && rows[0] < rows[1] {
            each(&Facet { columns, rows, corner, depths: [depth; 4], walls: [[true; 2]; 2] });
        }
    }
}

/// The facet over a point of a cell, in that cell's right half or not and in its lower half or not; `None` over a hole.
#[inline(always)]
pub fn facet_at(layer: &ShadowLayer<'_>, cell: [u32; 2], [right, below]: [bool; 2]) -> Option<Facet> {
    let mut wanted = None;
    let texel = usize::from(right) + 2 * usize::from(below);
    let stepped = is_stepped(layer, cell);
    for_each_facet(layer, cell, |facet| {
        let is_right = facet.columns[0] >= cell[0] as f32;
        let is_below = facet.rows[0] >= cell[1] as f32;
        if !stepped || usize::from(is_right) + 2 * usize::from(is_below) == texel {
            wanted = Some(*facet);
        }
    });
    wanted
}
