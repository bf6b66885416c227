//! Faces of a stepped light volume: rectangles in the space of a map, square to one of its three axes.
//!
//! A texel's surface is a *cap* at its depth; where two texels that touch have different depths, a *wall* along the light
//! joins them. Faces stand in chunks of sixteen, number by number, so that all of a chunk are looked at together: a map has
//! millions of them.

/// The axis that a face is square to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axis {
    /// Columns: a wall between two texels side by side.
    Column,
    /// Rows: a wall between two texels one above the other.
    Row,
    /// Depth: a cap.
    #[default]
    Depth,
}

/// A rectangle of a mesh, in texels and in depth as the map has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// What it is square to.
    pub axis: Axis,
    /// Its first column border and row border.
    pub first: [u32; 2],
    /// Its last ones; those of a wall's own axis are the first.
    pub last: [u32; 2],
    /// Depths of the texels on the side of the smaller index and of the larger one, between which a wall stands; of a cap both
    /// are its depth. `+∞` is no surface.
    pub depth: [f32; 2],
}

/// Faces of a chunk.
pub const CHUNK: usize = 16;

/// Up to sixteen faces of a patch, number by number.
#[derive(Debug, Clone, Copy, Default)]
pub struct Chunk {
    /// First column and row of the patch: what the others are relative to.
    pub origin: [f32; 2],
    /// First borders of columns and of rows.
    pub first: [[u16; CHUNK]; 2],
    /// From the first borders to the last.
    pub extent: [[u16; CHUNK]; 2],
    /// Depths before and behind, as [`Face::depth`].
    pub depth: [[f32; CHUNK]; 2],
    /// What each is square to.
    pub axis: [Axis; CHUNK],
    /// How many there are.
    pub count: u8,
}

impl Face {
    /// +1 where a ray towards larger indices or depths gets into the shadow there, −1 where it gets out of it.
    pub fn sign(&self) -> i8 {
        // Towards larger indices a ray gets into the shadow where the surface behind is nearer to the light.
        if self.axis == Axis::Depth || self.depth[1] < self.depth[0] { 1 } else { -1 }
    }
}

impl Chunk {
    /// A chunk without faces of a patch that begins with that column and row.
    pub fn of(origin: [u32; 2]) -> Self {
        Self { origin: origin.map(|n| n as f32), ..Self::default() }
    }

    /// One of its faces.
    #[inline(always)]
    pub fn face(&self, index: usize) -> Face {
        let first = [0, 1].map(|axis| self.origin[axis] as u32 + u32::from(self.first[axis][index]));
        let last = [0, 1].map(|axis| first[axis] + u32::from(self.extent[axis][index]));
        Face { axis: self.axis[index], first, last, depth: [self.depth[0][index], self.depth[1][index]] }
    }
}

/// Lists of faces of the patches of a row, patch by patch.
#[derive(Debug, Clone, Default)]
pub struct FaceLists {
    chunks: Vec<Chunk>,
    /// Where the patch that is being written begins, and its first column and row.
    start: usize,
    origin: [u32; 2],
}

impl FaceLists {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.chunks.clear();
        self.start = 0;
    }

    /// Begins the list of a patch; returns the index of its first chunk.
    pub fn begin(&mut self, origin: [u32; 2]) -> usize {
        self.start = self.chunks.len();
        self.origin = origin;
        self.start
    }

    /// Adds a face to the list of the patch that was begun last. It lies in that patch's square.
    #[inline(always)]
    pub fn push(&mut self, face: &Face) {
        let needs_chunk = self.start == self.chunks.len()
            || self.chunks.last().is_none_or(|chunk| usize::from(chunk.count) == CHUNK);
        if needs_chunk {
            self.chunks.push(Chunk::of(self.origin));
        }
        let Some(chunk) = self.chunks.last_mut() else { return };
        let at = usize::from(chunk.count);
        for axis in 0..2 {
            chunk.first[axis][at] = (face.first[axis] - self.origin[axis]) as u16;
            chunk.extent[axis][at] = (face.last[axis] - face.first[axis]) as u16;
            chunk.depth[axis][at] = face.depth[axis];
        }
        chunk.axis[at] = face.axis;
        chunk.count += 1;
    }

    /// All chunks.
    pub fn chunks(&self) -> &[Chunk] {
        &self.chunks
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> usize {
        self.chunks.capacity() * size_of::<Chunk>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_come_out_of_chunks_as_they_were_put_in() {
        let mut lists = FaceLists::default();
        let origin = [65_528, 40_000];
        let faces: Vec<Face> = (0..37)
            .map(|n| Face {
                axis: [Axis::Column, Axis::Row, Axis::Depth][n % 3],
                first: [65_528 + n as u32 % 9, 40_000 + n as u32 % 5],
                last: [65_528 + n as u32 % 9, 72_768],
                depth: [n as f32, f32::INFINITY],
            })
            .collect();
        lists.begin([0, 0]);
        lists.push(&faces[0]);
        let start = lists.begin(origin);
        faces.iter().for_each(|face| lists.push(face));
        let chunks = &lists.chunks()[start..];
        assert_eq!((start, chunks.len()), (1, 3));
        let found: Vec<Face> =
            chunks.iter().flat_map(|chunk| (0..usize::from(chunk.count)).map(|n| chunk.face(n))).collect();
        assert_eq!(found, faces);
        assert_eq!((found[0].sign(), found[2].sign()), (-1, 1));
    }
}
