//! A part of an interpolated surface that the image pass looks at as one: a quad of cells with its triangles, or a flat quarter of
//! a cell with a hole.

use scatter_core::ShadowLayer;

use super::cells::PATCH;
use super::code::code_of;
use super::stitching::{PLACES, STITCHINGS};

/// A facet in the space of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facet {
    /// First and last column: a half texel at the map's border.
    pub columns: [f32; 2],
    /// First and last row.
    pub rows: [f32; 2],
    /// Column and row of the top left vertex.
    pub corner: [f32; 2],
    /// From there to the other vertices \[texels\], a power of two.
    pub side: f32,
    /// The codes at the places of vertices (`stitching::PLACES`); of those that are none, anything finite.
    pub codes: [f32; 8],
    /// The sides beyond which quads are finer.
    pub finer: u8,
    /// Whether depths may jump at its first and last column, and at its first and last row.
    pub walls: [[bool; 2]; 2],
}

impl Facet {
    /// No facet.
    pub const NONE: Self = Self {
        columns: [0.0; 2],
        rows: [0.0; 2],
        corner: [0.0; 2],
        side: 1.0,
        codes: [0.0; 8],
        finer: 0,
        walls: [[false; 2]; 2],
    };

    /// The least and the greatest code of its vertices.
    #[inline(always)]
    pub fn spread(&self) -> [f32; 2] {
        let [mut least, mut greatest] = [self.codes[0]; 2];
        for code in &self.codes[1..] {
            least = least.min(*code);
            greatest = greatest.max(*code);
        }
        [least, greatest]
    }

    /// Whether all of it lies in one plane: a half cell at the map's border, and a quarter, whose borders are no edges of triangles.
    #[inline(always)]
    pub fn is_plane(&self) -> bool {
        let [[left, right], [top, bottom]] = [self.columns, self.rows];
        right - left < self.side || bottom - top < self.side
    }

    /// Calls `each` for the two ends of every edge between two of its triangles.
    pub fn for_each_chord(&self, mut each: impl FnMut([[f64; 2]; 2])) {
        if self.is_plane() {
            return;
        }
        let half = 0.5 * f64::from(self.side);
        let at = |place: u8| {
            [0, 1].map(|axis| f64::from(self.corner[axis]) + f64::from(PLACES[place as usize][axis]) * half)
        };
        for chord in STITCHINGS[usize::from(self.finer)].chords() {
            each(chord.map(at));
        }
    }

    /// The plane of one of its triangles: a point of it `[column, row, code]`, and the change of its code a column and a row.
    #[inline(always)]
    pub fn plane(&self, triangle: usize) -> ([f64; 3], [f64; 2]) {
        let [a, b, c] = STITCHINGS[usize::from(self.finer)].triangles()[triangle].map(usize::from);
        let place = |p: usize, axis: usize| f64::from(PLACES[p][axis]);
        let code = |p: usize| f64::from(self.codes[p]);
        let way = |p: usize| [place(p, 0) - place(a, 0), place(p, 1) - place(a, 1), code(p) - code(a)];
        let (b, c) = (way(b), way(c));
        let half = 0.5 * f64::from(self.side);
        let per_area = 1.0 / (half * (b[0] * c[1] - b[1] * c[0]));
        let at = |axis: usize| f64::from(self.corner[axis]) + place(a, axis) * half;
        let slopes = [(b[2] * c[1] - c[2] * b[1]) * per_area, (c[2] * b[0] - b[2] * c[0]) * per_area];
        ([at(0), at(1), code(a)], slopes)
    }

    /// The triangle over a point \[texels\].
    #[inline(always)]
    pub fn triangle_at(&self, p: [f64; 2]) -> usize {
        if self.is_plane() {
            return 0;
        }
        let per_half = 2.0 / f64::from(self.side);
        let [x, y] = [0, 1].map(|axis| (p[axis] - f64::from(self.corner[axis])) * per_half);
        STITCHINGS[usize::from(self.finer)].triangle_at([x, y])
    }

    /// The surface's code at a point \[texels\].
    pub fn code_at(&self, p: [f64; 2]) -> f64 {
        let ([u, v, code], [right, below]) = self.plane(self.triangle_at(p));
        code + right * (p[0] - u) + below * (p[1] - v)
    }
}

/// A facet of a patch of cells, whose depths follow from the map's texels.
///
/// Bits 0 to 2 its column in the patch, 3 to 5 its row, 6 to 9 its level, 10 to 13 the sides beyond which quads are finer, 14 to 17
/// the walls, 18 to 20 which quarter of a cell with a hole it is (1 to 4; 0 for a quad).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PackedFacet(u32);

impl PackedFacet {
    /// A quad.
    pub fn quad([i, j]: [u32; 2], level: usize, finer: u8, walls: [[bool; 2]; 2]) -> Self {
        let walls = walls.iter().flatten().enumerate().map(|(n, wall)| u32::from(*wall) << (14 + n));
        let place = (i % PATCH) | ((j % PATCH) << 3);
        Self(place | (level as u32) << 6 | u32::from(finer) << 10 | walls.sum::<u32>())
    }

    /// A quarter of a cell: 0 to 3 row by row.
    pub fn quarter([i, j]: [u32; 2], quarter: u32) -> Self {
        Self((i % PATCH) | ((j % PATCH) << 3) | 0xF << 14 | (quarter + 1) << 18)
    }

    /// The first cell of one that belongs to a patch.
    #[inline(always)]
    pub fn cell(self, patch: [u32; 2]) -> [u32; 2] {
        [patch[0] * PATCH + (self.0 & 7), patch[1] * PATCH + (self.0 >> 3 & 7)]
    }

    /// It has 2ⁿ cells a side.
    #[inline(always)]
    pub fn level(self) -> usize {
        (self.0 >> 6 & 0xF) as usize
    }

    /// The sides beyond which quads are finer.
    #[inline(always)]
    pub fn finer(self) -> u8 {
        (self.0 >> 10 & 0xF) as u8
    }

    /// Which quarter of a cell with a hole it is.
    #[inline(always)]
    pub fn quarter_index(self) -> Option<usize> {
        (self.0 >> 18 & 7).checked_sub(1).map(|quarter| quarter as usize)
    }

    /// Whether depths may jump anywhere at its border.
    #[inline(always)]
    pub fn has_walls(self) -> bool {
        self.0 >> 14 & 0xF != 0
    }

    /// Triangles that it is divided into.
    pub fn triangle_count(self) -> u64 {
        2 + u64::from(self.finer().count_ones())
    }

    /// With its depths.
    #[inline(always)]
    pub fn unpacked(self, layer: &ShadowLayer<'_>, patch: [u32; 2]) -> Facet {
        let [i, j] = self.cell(patch);
        let [width, height] = layer.projection().size();
        let (level, finer) = (self.level(), self.finer());
        let mut columns = span([i, i + (1 << level)], width);
        let mut rows = span([j, j + (1 << level)], height);
        let mut codes = codes_of(layer, [i, j], level, finer);
        if let Some(quarter) = self.quarter_index() {
            let ([right, below], own) = ([quarter % 2, quarter / 2], [0, 2, 6, 4][quarter]);
            columns = [[columns[0], i as f32], [i as f32, columns[1]]][right];
            rows = [[rows[0], j as f32], [j as f32, rows[1]]][below];
            codes = [codes[own]; 8];
        }
        let wall = |n: u32| self.0 >> (14 + n) & 1 != 0;
        Facet {
            columns,
            rows,
            corner: [i as f32 - 0.5, j as f32 - 0.5],
            side: (1u32 << level) as f32,
            codes,
            finer,
            walls: [[wall(0), wall(1)], [wall(2), wall(3)]],
        }
    }
}

/// From the first cell's left to the last one's right, of a border's cell the half inside of the map.
#[inline(always)]
fn span([first, end]: [u32; 2], size: u32) -> [f32; 2] {
    [(first as f32 - 0.5).max(0.0), (end as f32 - 0.5).min(size as f32)]
}

/// Codes at the places of vertices of a quad of a level that begins with a cell; places that are none of its have a corner's code.
#[inline(always)]
fn codes_of(layer: &ShadowLayer<'_>, [i, j]: [u32; 2], level: usize, finer: u8) -> [f32; 8] {
    let [width, height] = layer.projection().size();
    let perspective = layer.projection().is_perspective();
    let (first, last) = ([i.max(1) - 1, j.max(1) - 1], [i + (1 << level) - 1, j + (1 << level) - 1]);
    let last = [last[0].min(width - 1), last[1].min(height - 1)];
    let code = |i: u32, j: u32| code_of(layer.at(i, j), perspective);
    let corners =
        [code(first[0], first[1]), code(last[0], first[1]), code(last[0], last[1]), code(first[0], last[1])];
    let mut codes = [0.0; 8];
    for (n, corner) in corners.into_iter().enumerate() {
        codes[2 * n] = corner;
        codes[2 * n + 1] = corner;
    }
    if finer != 0 {
        let middle = [(first[0] + last[0]) / 2, (first[1] + last[1]) / 2];
        codes[1] = code(middle[0], first[1]);
        codes[3] = code(last[0], middle[1]);
        codes[5] = code(middle[0], last[1]);
        codes[7] = code(first[0], middle[1]);
    }
    codes
}
