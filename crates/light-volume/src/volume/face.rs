//! Faces of a stepped light volume: rectangles in the space of a map, square to one of its three axes.
//!
//! A texel's surface is a *cap* at its depth; where two texels that touch have different depths, a *wall* along the light
//! joins them. A face is sixteen bytes, since a map has millions of them.

/// The axis that a face is square to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Columns: a wall between two texels side by side.
    Column,
    /// Rows: a wall between two texels one above the other.
    Row,
    /// Depth: a cap.
    Depth,
}

/// A rectangle of a mesh, in texels and in depth as the map has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// The first texel that it belongs to: its column and row.
    pub texel: [u16; 2],
    /// Texels that it spans along columns and rows, less one. Of a wall the one across tells how far the wall lies behind
    /// [`Self::texel`]: 0 is before it.
    pub span: [u16; 2],
    /// Depths on the side of the smaller index and of the larger one; of a cap both are its depth. `+∞` is no surface.
    pub depth: [f32; 2],
}

/// A face with its axis resolved: where it is across its axis, and between which borders along the two others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Column border, row border, or depth.
    pub at: f32,
    /// Of a wall: borders along the other texel axis. Of a cap: of the columns.
    pub first: [f32; 2],
    /// Of a wall: depths, the nearer one first. Of a cap: borders of the rows.
    pub second: [f32; 2],
    /// +1 where a ray towards larger indices (or depths) gets into the shadow there, −1 where it gets out of it.
    pub sign: i8,
}

impl Face {
    /// A cap over so many columns and rows.
    pub fn cap(texel: [u32; 2], span: [u32; 2], depth: f32) -> Self {
        Self { texel: texel.map(|n| n as u16), span: span.map(|n| (n - 1) as u16), depth: [depth; 2] }
    }

    /// A wall before the column `texel[0] + behind`, over `length` rows.
    pub fn column_wall(texel: [u32; 2], behind: u32, length: u32, depth: [f32; 2]) -> Self {
        Self { texel: texel.map(|n| n as u16), span: [behind as u16, (length - 1) as u16], depth }
    }

    /// A wall before the row `texel[1] + behind`, over `length` columns.
    pub fn row_wall(texel: [u32; 2], behind: u32, length: u32, depth: [f32; 2]) -> Self {
        Self { texel: texel.map(|n| n as u16), span: [(length - 1) as u16, behind as u16], depth }
    }

    /// The face as a rectangle square to that axis.
    #[inline(always)]
    pub fn rectangle(&self, axis: Axis) -> Rectangle {
        let [i, j] = self.texel.map(f32::from);
        let [di, dj] = self.span.map(f32::from);
        let [before, behind] = self.depth;
        let depths = [before.min(behind), before.max(behind)];
        // Towards larger indices a ray gets into the shadow where the surface behind is nearer to the light.
        let sign = if behind < before { 1 } else { -1 };
        match axis {
            Axis::Column => Rectangle { at: i + di, first: [j, j + dj + 1.0], second: depths, sign },
            Axis::Row => Rectangle { at: j + dj, first: [i, i + di + 1.0], second: depths, sign },
            Axis::Depth => {
                Rectangle { at: before, first: [i, i + di + 1.0], second: [j, j + dj + 1.0], sign: 1 }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_are_small_and_know_their_borders() {
        assert_eq!(size_of::<Face>(), 16);
        let wall = Face::column_wall([65_535, 3], 1, 2, [4.0, f32::INFINITY]).rectangle(Axis::Column);
        assert_eq!((wall.at, wall.first, wall.sign), (65_536.0, [3.0, 5.0], -1));
        let wall = Face::row_wall([2, 3], 0, 65_536 - 2, [4.0, 1.0]).rectangle(Axis::Row);
        assert_eq!((wall.at, wall.first, wall.second, wall.sign), (3.0, [2.0, 65_536.0], [1.0, 4.0], 1));
        let cap = Face::cap([0, 5], [65_536, 1], 2.5).rectangle(Axis::Depth);
        assert_eq!((cap.at, cap.first, cap.second), (2.5, [0.0, 65_536.0], [5.0, 6.0]));
    }
}
