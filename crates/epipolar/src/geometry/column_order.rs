//! How the columns of a slice are numbered: from the light on.

use glam::DVec2;

/// The columns of a slice in the order in which its light crosses them.
///
/// A column is a pixel column of a flat fan, or a pixel row of a steep one: one view ray of the slice. Light that reaches
/// a column has passed all columns of a smaller [rank](Self::rank), so "lit" is a number: of a light ray that ends on a
/// surface, the first so many columns see the light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColumnOrder {
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// Whether light crosses the columns in ascending order.
    pub ascending: bool,
}

impl ColumnOrder {
    /// Number of columns.
    pub fn count(&self) -> usize {
        (self.columns[1] - self.columns[0]) as usize
    }

    /// The place of a column in the order of light.
    pub fn rank(&self, column: u32) -> u32 {
        if self.ascending { column - self.columns[0] } else { self.columns[1] - 1 - column }
    }

    /// Rows that give the number of columns before a point of the plane, from the rows that give its column: the
    /// columns c with c + ½ on the light's side of x are `⌊x + ½ − first⌋`, or `⌊last + ½ − x⌋` in descending order.
    pub fn lit_rows(&self, [numerator, depth]: [DVec2; 2]) -> [DVec2; 2] {
        let [first, end] = self.columns.map(f64::from);
        if self.ascending {
            [numerator + depth * (0.5 - first), depth]
        } else {
            [depth * (end + 0.5) - numerator, depth]
        }
    }
}
