//! The stepped volume of one layer: faces patch by patch, and a tree of the depths between which they lie.
//!
//! A patch of 8×8 texels has a list of faces; of a larger square that adaptive tessellation made one, its first patch has
//! it. Nodes of the tree bound the depths of all faces under them, walls on their left and upper borders included, so that
//! whoever looks for what rays may cross goes down only where faces are.

use scatter_core::{ShadowLayer, parallel};

use super::cells::{EMPTY, PATCH, Spreads, Tolerance, flatten, halve, joined, level_count, squares};
use super::face::{Chunk, Face, FaceLists};
use super::patch_faces::{Depths, write};

/// How texels become faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tessellation {
    /// A cap a texel and a wall a step: the base grid, displaced.
    Static,
    /// Squares, rectangles and runs of one depth are one face; depths within the tolerance count as one.
    Adaptive(Tolerance),
}

/// The list of faces of a patch or of a larger square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Where its list starts in its row's, and how many chunks it has.
    start: u32,
    count: u32,
    /// Its square has `PATCH`·2ⁿ texels a side; a patch inside of a larger square has no list and no bounds.
    level: u32,
    /// Nearest and farthest depth of its faces.
    bounds: [f32; 2],
}

/// A row of patches with their faces.
#[derive(Debug, Clone, Default)]
struct PatchRow {
    patches: Vec<Patch>,
    faces: FaceLists,
}

/// A closed mesh around the shadow of one layer of a map.
#[derive(Debug, Clone, Default)]
pub struct SteppedVolume {
    size: [u32; 2],
    /// Rows of patches; there may be more than the map has.
    rows: Vec<PatchRow>,
    /// Depths that the mesh has where they are not those of the map; else empty.
    flattened: Vec<f32>,
    /// Bounds of the squares of each level; level 0 is that of patches.
    bounds: Vec<Vec<[f32; 2]>>,
    spreads: Spreads,
}

impl SteppedVolume {
    /// Builds the mesh anew. Buffers are reused: a map of as many faces as the last one allocates nothing. O(texels).
    pub fn build(&mut self, layer: &ShadowLayer<'_>, tessellation: Tessellation) {
        let size = layer.projection().size();
        self.size = size;
        let texels = layer.texels();
        let merges = tessellation != Tessellation::Static;
        self.flattened.clear();
        if let Tessellation::Adaptive(tolerance) = tessellation {
            self.spreads.build(size, texels);
            if tolerance != Tolerance::EXACT {
                self.flattened.resize(texels.len(), 0.0);
                let spreads = &self.spreads;
                parallel::for_each_row(&mut self.flattened, (size[0] * PATCH) as usize, |row, strip| {
                    flatten((size, texels), spreads, &tolerance, row as u32, strip);
                });
            }
        }
        let depths = if self.flattened.is_empty() { texels } else { &self.flattened };
        let depths = Depths { texels: depths, size };
        let [columns, row_count] = squares(size, 0);
        self.rows.resize_with((row_count as usize).max(self.rows.len()), PatchRow::default);
        let spreads = &self.spreads;
        parallel::for_each_row(&mut self.rows[..row_count as usize], 1, |row, of_row| {
            let PatchRow { patches, faces } = &mut of_row[0];
            faces.clear();
            patches.clear();
            patches.extend((0..columns).map(|column| {
                let place = [column, row as u32];
                let largest = match tessellation {
                    Tessellation::Static => None,
                    Tessellation::Adaptive(tolerance) => spreads.largest(place, &tolerance),
                };
                write_patch(&depths, place, largest.map(|(level, _)| level), merges, faces)
            }));
        });
        self.bound();
    }

    fn bound(&mut self) {
        let count = level_count(self.size);
        self.bounds.resize_with(count.max(self.bounds.len()), Vec::new);
        for (level, bounds) in self.bounds.iter_mut().enumerate() {
            let [columns, rows] = if level < count { squares(self.size, level) } else { [0; 2] };
            bounds.resize((columns * rows) as usize, EMPTY);
        }
        let patches = self.rows[..squares(self.size, 0)[1] as usize].iter().flat_map(|row| &row.patches);
        for (bounds, patch) in self.bounds[0].iter_mut().zip(patches) {
            *bounds = patch.bounds;
        }
        for level in 1..count {
            let (finer, coarser) = self.bounds.split_at_mut(level);
            halve(&finer[level - 1], squares(self.size, level - 1), &mut coarser[0]);
        }
    }

    /// Columns and rows of the map.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The depth that the mesh has at a texel; `layer` is the one that it was built of.
    #[inline(always)]
    pub fn depth_at(&self, layer: &ShadowLayer<'_>, i: u32, j: u32) -> f32 {
        let depths = if self.flattened.is_empty() { layer.texels() } else { &self.flattened };
        depths[j as usize * self.size[0] as usize + i as usize]
    }

    /// The coarsest level of the tree, that of a single square.
    pub fn coarsest(&self) -> usize {
        level_count(self.size) - 1
    }

    /// Nearest and farthest depth of the faces under a square of a level; the first is greater where there are none.
    #[inline(always)]
    pub fn bounds(&self, level: usize, [column, row]: [u32; 2]) -> [f32; 2] {
        let [columns, _] = squares(self.size, level);
        self.bounds[level][(row * columns + column) as usize]
    }

    /// The patch in that column and row of patches.
    #[inline(always)]
    pub fn patch(&self, [column, row]: [u32; 2]) -> &Patch {
        &self.rows[row as usize].patches[column as usize]
    }

    /// Faces of a patch in the given row of patches.
    #[inline(always)]
    pub fn faces(&self, row: u32, patch: &Patch) -> &[Chunk] {
        &self.rows[row as usize].faces.chunks()[patch.start as usize..][..patch.count as usize]
    }

    /// Calls `each` for every face.
    pub fn for_each_face(&self, mut each: impl FnMut(Face)) {
        for chunk in self.rows().iter().flat_map(|row| row.faces.chunks()) {
            (0..usize::from(chunk.count)).for_each(|index| each(chunk.face(index)));
        }
    }

    fn rows(&self) -> &[PatchRow] {
        &self.rows[..squares(self.size, 0)[1] as usize]
    }

    /// How many faces it has; each is two triangles.
    pub fn face_count(&self) -> u64 {
        self.rows().iter().flat_map(|row| row.faces.chunks()).map(|chunk| u64::from(chunk.count)).sum()
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        let row_bytes = |row: &PatchRow| {
            row.faces.memory_bytes() + row.patches.capacity() * size_of::<Patch>() + size_of::<PatchRow>()
        };
        let rows: usize = self.rows.iter().map(row_bytes).sum();
        let bounds: usize = self.bounds.iter().map(|level| level.capacity() * size_of::<[f32; 2]>()).sum();
        (rows + bounds + self.flattened.capacity() * size_of::<f32>()) as u64 + self.spreads.memory_bytes()
    }
}

impl Patch {
    /// Its square has `PATCH`·2ⁿ texels a side.
    #[inline(always)]
    pub fn level(&self) -> usize {
        self.level as usize
    }
}

/// The faces of the patch in that column and row, or of the square of `flat_level` that begins with it.
fn write_patch(
    depths: &Depths<'_>,
    [column, row]: [u32; 2],
    flat_level: Option<usize>,
    merges: bool,
    faces: &mut FaceLists,
) -> Patch {
    let level = flat_level.unwrap_or(0);
    let first = [column * PATCH, row * PATCH];
    let start = faces.begin(first);
    let mut patch = Patch { start: start as u32, count: 0, level: level as u32, bounds: EMPTY };
    let within = (1 << level) - 1;
    if (column & within, row & within) != (0, 0) {
        return patch;
    }
    let last = [0, 1].map(|axis| depths.size[axis].min(first[axis] + (PATCH << level)));
    write(depths, first, last, (flat_level.is_some(), merges), faces);
    let chunks = &faces.chunks()[start..];
    patch.count = chunks.len() as u32;
    for chunk in chunks {
        for depth in chunk.depth.iter().flat_map(|depths| &depths[..usize::from(chunk.count)]) {
            patch.bounds = joined(patch.bounds, [*depth; 2]);
        }
    }
    patch
}
