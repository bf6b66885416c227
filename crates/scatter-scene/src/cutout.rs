//! Alpha cut-outs: triangles of which only the part under a mask is there (MODEL.md, Scenes).

use glam::DVec2;

/// A triangle of which only the part under a mask is there.
///
/// The mask's coordinates are linear over the triangle, as glTF's and OBJ's are. Everywhere where the mask has no
/// texel, light and sight pass; where it has one, the triangle blocks both, from both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cutout {
    /// Its index in [`Scene::triangles`](crate::Scene::triangles).
    pub triangle: u32,
    /// The mask's index in [`Scene::masks`](crate::Scene::masks).
    pub mask: u32,
    /// Texture coordinates of the corners, in the order of the triangle's indices, in units of the texture, before
    /// wrapping: u right, v **down** (glTF's; OBJ's v is `1 − v` here). Finite.
    pub uv: [DVec2; 3],
}

/// Which texels of a texture's base level are there: alpha times factor ≥ cutoff, decided once at load time.
///
/// The texel of a point is the nearest one; a sampler's filter is not used. One bit a texel, in blocks of 8×8.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AlphaMask {
    size: [u32; 2],
    wrap: [Wrap; 2],
    /// Blocks to a row of blocks.
    stride: usize,
    /// `[block row][block column]`; bit `8·(row mod 8) + column mod 8` is a texel. Bits beyond the texture repeat its
    /// last column and row, so that a block at its end is as uniform as what it shows.
    blocks: Vec<u64>,
}

/// What lies beyond a texture's ends, on one axis: glTF's wrap modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// The texture mirrored, then the texture again.
    MirroredRepeat,
    /// Its last texel.
    ClampToEdge,
}

/// Texels of a block's side.
pub(crate) const BLOCK: u32 = 8;

impl AlphaMask {
    /// The mask of a texture of `size` texels, `[columns, rows]`, each at least 1, where `is_there(column, row)`; row 0
    /// is on top, at v = 0. A side of 0 counts as 1.
    pub fn new(size: [u32; 2], wrap: [Wrap; 2], is_there: impl Fn(u32, u32) -> bool) -> Self {
        let size = size.map(|side| side.max(1));
        let [columns, rows] = size.map(|side| side.div_ceil(BLOCK) as usize);
        let block = |index: usize| {
            let first = [(index % columns) as u32 * BLOCK, (index / columns) as u32 * BLOCK];
            (0..64).fold(0u64, |bits, bit| {
                let column = (first[0] + bit % BLOCK).min(size[0] - 1);
                let row = (first[1] + bit / BLOCK).min(size[1] - 1);
                bits | u64::from(is_there(column, row)) << bit
            })
        };
        let blocks = (0..columns * rows).map(block).collect();
        Self { size, wrap, stride: columns, blocks }
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What lies beyond its ends, along u and along v.
    pub fn wrap(&self) -> [Wrap; 2] {
        self.wrap
    }

    /// Whether the texel at texture coordinates `uv` (finite, in units of the texture, v down) is there. Texels are
    /// half-open: a point between two belongs to the one of larger coordinates.
    pub fn is_there(&self, uv: DVec2) -> bool {
        self.is_there_at(uv * DVec2::from(self.size.map(f64::from)))
    }

    /// [`Self::is_there`] in units of a texel.
    pub(crate) fn is_there_at(&self, place: DVec2) -> bool {
        let texel = place.floor();
        let column = self.wrap[0].texel(texel.x, self.size[0]);
        let row = self.wrap[1].texel(texel.y, self.size[1]);
        self.block(column, row) >> (8 * (row % BLOCK) + column % BLOCK) & 1 != 0
    }

    /// The block of a texel within the texture.
    #[inline]
    pub(crate) fn block(&self, column: u32, row: u32) -> u64 {
        self.blocks[(row / BLOCK) as usize * self.stride + (column / BLOCK) as usize]
    }

    /// `[block row][block column]`: bit `8·(row mod 8) + column mod 8` of a block is a texel.
    #[cfg(feature = "raster")]
    pub(crate) fn blocks(&self) -> &[u64] {
        &self.blocks
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        (self.blocks.capacity() * size_of::<u64>()) as u64
    }
}

impl Wrap {
    /// The texel of the texture, of `count` on this axis, that shows at the whole number `texel`.
    #[inline]
    pub(crate) fn texel(self, texel: f64, count: u32) -> u32 {
        let last = f64::from(count - 1);
        // Remainders of whole numbers are exact; a number too large to have a next one is whole.
        match self {
            Self::Repeat => texel.rem_euclid(f64::from(count)) as u32,
            Self::MirroredRepeat => {
                let within = texel.rem_euclid(2.0 * f64::from(count));
                within.min(2.0 * last + 1.0 - within) as u32
            }
            Self::ClampToEdge => texel.clamp(0.0, last) as u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_repeat_mirror_and_end_as_the_wrap_says() {
        // A row of five: there, gone, gone, there, there.
        let row = [true, false, false, true, true];
        let at = |wrap: Wrap, texel: i32| {
            let mask = AlphaMask::new([5, 1], [wrap, Wrap::Repeat], |column, _| row[column as usize]);
            mask.is_there(DVec2::new((f64::from(texel) + 0.5) / 5.0, 0.5))
        };
        for (wrap, expected) in [
            (Wrap::Repeat, [3, 4, 0, 1, 2, 3, 4, 0, 1]),
            (Wrap::MirroredRepeat, [1, 0, 0, 1, 2, 3, 4, 4, 3]),
            (Wrap::ClampToEdge, [0, 0, 0, 1, 2, 3, 4, 4, 4]),
        ] {
            for (texel, shown) in (-2..).zip(expected) {
                assert_eq!(at(wrap, texel), row[shown as usize], "{wrap:?} {texel}");
            }
            // Whole periods away: ten texels are two textures, or one and its mirror image.
            if wrap != Wrap::ClampToEdge {
                assert!((-20..20).all(|texel| at(wrap, texel) == at(wrap, texel + 1_000_000)), "{wrap:?}");
            }
        }
    }

    #[test]
    fn every_texel_of_any_size_is_its_own() {
        for size in [[1, 1], [7, 3], [8, 8], [9, 17], [64, 2]] {
            let there = |column: u32, row: u32| (column * 7 + row * 13 + column * row).is_multiple_of(3);
            let mask = AlphaMask::new(size, [Wrap::Repeat; 2], there);
            for row in 0..size[1] {
                for column in 0..size[0] {
                    // A texel holds its upper left corner.
                    let uv = DVec2::new(f64::from(column), f64::from(row)) + DVec2::new(1e-9, 1e-9);
                    let found = mask.is_there(uv / DVec2::from(size.map(f64::from)));
                    assert_eq!(found, there(column, row), "{size:?} {column} {row}");
                }
            }
        }
    }

    #[test]
    fn coordinates_of_any_size_have_a_texel() {
        let mask =
            AlphaMask::new([3, 5], [Wrap::Repeat, Wrap::MirroredRepeat], |column, row| column + row > 2);
        for u in [0.0, -0.0, 1e-300, -1e-300, 1e15, -1e15, 1e300, -1e300, f64::MAX] {
            let _ = mask.is_there(DVec2::new(u, -u));
        }
        let clamped = AlphaMask::new([3, 5], [Wrap::ClampToEdge; 2], |column, row| column == 2 && row == 0);
        assert!(clamped.is_there(DVec2::new(f64::MAX, f64::MIN)));
    }
}
