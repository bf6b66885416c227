//! The interpolated surface of a map: quads between texels' centres and their triangles, patch by patch, and a tree of their depths.
//!
//! Vertices stand at the texels' centres (Billeter et al. 2010, Section 4), cells are divided from their top left to their bottom
//! right, and the half texels at the map's border extend the centres' depths flat to it. A cell with a corner at `+∞` is stepped:
//! each of its quarters has its own texel's depth. Where depths jump (around stepped cells, and at the map's border) the mesh has
//! walls along the light. With a threshold, 2ⁿ × 2ⁿ cells become one quad where their depths allow it (`flatness`), stitched to its
//! neighbours (`stitching`); where depths jump are cells.
//!
//! Cell `(i, j)` lies between the centres of the texels `(i−1, j−1)` and `(i, j)`: there is one more of them along each axis than
//! there are texels. Depths are not stored: facets say where they are in the map.

use scatter_core::{ShadowLayer, parallel};

use super::cells::{EMPTY, PATCH, halve, joined, level_count, squares};
use super::facet::{Facet, PackedFacet};
use super::flatness::Flatness;
use super::stepped::Tessellation;

/// The level of a patch: 2³ cells a side.
const PATCH_LEVEL: usize = PATCH.trailing_zeros() as usize;

/// The facets of a patch, or of the larger quad that begins with it.
#[derive(Debug, Clone, Copy, Default)]
struct Patch {
    start: u32,
    count: u32,
}

/// A row of patches.
#[derive(Debug, Clone, Default)]
struct PatchRow {
    patches: Vec<Patch>,
    facets: Vec<PackedFacet>,
    bounds: Vec<[f32; 2]>,
}

/// The facets of a layer.
#[derive(Debug, Clone, Default)]
pub struct HeightField {
    /// Columns and rows of cells.
    cells: [u32; 2],
    flatness: Flatness,
    /// Rows of patches; there may be more than the map has.
    rows: Vec<PatchRow>,
    /// Bounds of the depths of the squares of cells of each level; level 0 is that of patches.
    bounds: Vec<Vec<[f32; 2]>>,
}

impl HeightField {
    /// Builds the surface anew. Buffers are reused. O(texels).
    pub fn build(&mut self, layer: &ShadowLayer<'_>, tessellation: Tessellation) {
        self.cells = layer.projection().size().map(|n| n + 1);
        let cells = self.cells;
        match tessellation {
            Tessellation::Static => self.flatness.clear(cells),
            Tessellation::Adaptive(tolerance) => self.flatness.build(layer, &tolerance),
        }
        let [columns, row_count] = squares(cells, 0);
        self.rows.resize_with((row_count as usize).max(self.rows.len()), PatchRow::default);
        let flatness = &self.flatness;
        parallel::for_each_row(&mut self.rows[..row_count as usize], 1, |row, of_row| {
            let PatchRow { patches, facets, bounds } = &mut of_row[0];
            patches.clear();
            facets.clear();
            bounds.clear();
            for column in 0..columns {
                let start = facets.len();
                let found = write_patch(layer, flatness, [column, row as u32], facets);
                patches.push(Patch { start: start as u32, count: (facets.len() - start) as u32 });
                bounds.push(found);
            }
        });
        self.bound();
    }

    fn bound(&mut self) {
        let (cells, count) = (self.cells, level_count(self.cells));
        self.bounds.resize_with(count.max(self.bounds.len()), Vec::new);
        for (level, bounds) in self.bounds.iter_mut().enumerate() {
            let [columns, rows] = if level < count { squares(cells, level) } else { [0; 2] };
            bounds.resize((columns * rows) as usize, EMPTY);
        }
        let [columns, rows] = squares(cells, 0);
        for (bounds, row) in self.bounds[0].chunks_mut(columns as usize).zip(&self.rows[..rows as usize]) {
            bounds.copy_from_slice(&row.bounds);
        }
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

    /// Whether a square of a level is one quad, or lies within one.
    #[inline(always)]
    pub fn is_one_quad(&self, level: usize, place: [u32; 2]) -> bool {
        self.flatness.is_whole(PATCH_LEVEL + level, place)
    }

    /// The facets of a patch, or of the larger quad that begins with it.
    #[inline(always)]
    pub fn facets(&self, [column, row]: [u32; 2]) -> &[PackedFacet] {
        let of_row = &self.rows[row as usize];
        let patch = of_row.patches[column as usize];
        &of_row.facets[patch.start as usize..][..patch.count as usize]
    }

    /// Calls `each` for every facet with the patch that it belongs to.
    pub fn for_each_facet(&self, mut each: impl FnMut(PackedFacet, [u32; 2])) {
        let [columns, rows] = squares(self.cells, 0);
        for row in 0..rows {
            for column in 0..columns {
                self.facets([column, row]).iter().for_each(|facet| each(*facet, [column, row]));
            }
        }
    }

    /// How many triangles it has, walls aside.
    pub fn triangle_count(&self) -> u64 {
        let rows = &self.rows[..squares(self.cells, 0)[1] as usize];
        rows.iter().flat_map(|row| &row.facets).map(|facet| facet.triangle_count()).sum()
    }

    /// The facet over a point of a cell, in that cell's right half or not and in its lower half or not; `None` over a hole.
    #[inline(always)]
    pub fn facet_at(
        &self,
        layer: &ShadowLayer<'_>,
        [i, j]: [u32; 2],
        [right, below]: [bool; 2],
    ) -> Option<Facet> {
        let level = self.flatness.level_of([i, j]);
        let [i, j] = [i, j].map(|n| n >> level << level);
        let packed = if level == 0 && is_stepped(layer, [i, j]) {
            let quarter = usize::from(right) + 2 * usize::from(below);
            if corners(layer, [i, j])[quarter] == f32::INFINITY {
                return None;
            }
            PackedFacet::quarter([i, j], quarter as u32)
        } else {
            let finer = self.flatness.finer_sides(level, [i, j].map(|n| n >> level));
            PackedFacet::quad([i, j], level, finer, [[false; 2]; 2])
        };
        Some(packed.unpacked(layer, [i / PATCH, j / PATCH]))
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let bounds: usize = self.bounds.iter().map(|level| level.capacity() * size_of::<[f32; 2]>()).sum();
        let row_bytes = |row: &PatchRow| {
            row.patches.capacity() * size_of::<Patch>()
                + row.facets.capacity() * size_of::<PackedFacet>()
                + row.bounds.capacity() * size_of::<[f32; 2]>()
                + size_of::<PatchRow>()
        };
        (bounds + self.rows.iter().map(row_bytes).sum::<usize>()) as u64 + self.flatness.memory_bytes()
    }
}

/// Depths at the corners of a cell, row by row; those of the border's texels outside of the map.
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

/// Adds the facets of a patch to a list, or the quad that begins with it; returns the bounds of their depths.
fn write_patch(
    layer: &ShadowLayer<'_>,
    flatness: &Flatness,
    patch: [u32; 2],
    facets: &mut Vec<PackedFacet>,
) -> [f32; 2] {
    let cells = layer.projection().size().map(|n| n + 1);
    let first = patch.map(|n| n * PATCH);
    let level = flatness.level_of(first);
    if level >= PATCH_LEVEL {
        let begins = first.iter().all(|n| n % (1 << level) == 0);
        return if begins { write_quad(layer, flatness, first, level, facets) } else { EMPTY };
    }
    let may_jump = may_jump(layer, first);
    let mut bounds = EMPTY;
    for j in first[1]..cells[1].min(first[1] + PATCH) {
        for i in first[0]..cells[0].min(first[0] + PATCH) {
            let level = flatness.level_of([i, j]);
            if (i | j) % (1 << level) == 0 {
                let of_facet = if level > 0 || !may_jump {
                    write_quad(layer, flatness, [i, j], level, facets)
                } else {
                    write_cell(layer, [i, j], facets)
                };
                bounds = joined(bounds, of_facet);
            }
        }
    }
    bounds
}

/// Whether a patch of cells lies at the map's border, or is near to a hole.
fn may_jump(layer: &ShadowLayer<'_>, [x, y]: [u32; 2]) -> bool {
    let [width, height] = layer.projection().size();
    if x == 0 || y == 0 || x + PATCH > width || y + PATCH > height {
        return true;
    }
    // The texels of its cells, and of those beside them.
    let (columns, rows) =
        (x - x.min(2)..(x + PATCH + 1).min(width), y - y.min(2)..(y + PATCH + 1).min(height));
    rows.into_iter().any(|j| {
        let row = &layer.texels()[(j * width) as usize..][..width as usize];
        row[columns.start as usize..columns.end as usize].contains(&f32::INFINITY)
    })
}

/// A quad without walls.
fn write_quad(
    layer: &ShadowLayer<'_>,
    flatness: &Flatness,
    [i, j]: [u32; 2],
    level: usize,
    facets: &mut Vec<PackedFacet>,
) -> [f32; 2] {
    let finer = flatness.finer_sides(level, [i >> level, j >> level]);
    facets.push(PackedFacet::quad([i, j], level, finer, [[false; 2]; 2]));
    let (x, y, side) = (i - 1, j - 1, 1 << level);
    let mut bounds = EMPTY;
    // Corners, and the middles of sides that are vertices.
    let step = if finer == 0 { side } else { side / 2 };
    for dy in (0..=side).step_by(step as usize) {
        for dx in (0..=side).step_by(step as usize) {
            bounds = joined(bounds, [layer.at(x + dx, y + dy); 2]);
        }
    }
    bounds
}

/// A cell where depths may jump: a quad with walls, or its quarters.
fn write_cell(layer: &ShadowLayer<'_>, cell: [u32; 2], facets: &mut Vec<PackedFacet>) -> [f32; 2] {
    let depths = corners(layer, cell);
    let [width, height] = layer.projection().size();
    if !depths.contains(&f32::INFINITY) {
        let walls = walls_of(layer, cell);
        facets.push(PackedFacet::quad(cell, 0, 0, walls));
        let spread = depths.iter().fold(EMPTY, |spread, depth| joined(spread, [*depth; 2]));
        // Behind a wall a ray in the dark crosses one that is no border of the shadow together with its twin: neither may be left
        // out.
        return if walls == [[false; 2]; 2] { spread } else { [spread[0], f32::INFINITY] };
    }
    let mut nearest = f32::INFINITY;
    for (quarter, depth) in depths.into_iter().enumerate() {
        // Of a border's cell two quarters lie outside of the map.
        let is_inside = |n: u32, size: u32, far: bool| if far { n < size } else { n > 0 };
        let inside =
            is_inside(cell[0], width, quarter % 2 == 1) && is_inside(cell[1], height, quarter / 2 == 1);
        if depth < f32::INFINITY && inside {
            facets.push(PackedFacet::quarter(cell, quarter as u32));
            nearest = nearest.min(depth);
        }
    }
    if nearest < f32::INFINITY { [nearest, f32::INFINITY] } else { EMPTY }
}
