//! The four rows of an engine's matrix, read in f64: whether its rays are parallel, and what f32 leaves uncertain.
//!
//! A matrix of f32 holds each number to 2⁻²⁴, and what engines do to it (a quaternion made a matrix, an inverse by
//! cofactors, a product or two) leaves it right to some 2⁻²¹ of its row. So nothing here compares exactly: a last row of
//! 0 0 0 1.0000001 is what `Mat4::inverse` makes of a rigid matrix. A matrix is homogeneous, so a common factor is divided
//! out and means nothing; what else differs from the plain forms by more than [`ROUNDING`] is meant.

use glam::{DMat3, DMat4, DVec3, DVec4};

use crate::error::ModelError;

/// What f32 may have rounded, as a share: 2⁻²⁰, sixteen half-ulps. Matrices that were made, inverted and multiplied in
/// f32 stay at a third of it (`tests/engine_matrices` prints the margin); what is meant by an engine is far above
/// (a field of view of 0.01° is 200 times as much).
pub(crate) const ROUNDING: f64 = 1.0 / 1_048_576.0;

/// Rows of a `clip_from_…` matrix, each to be dotted with (p, 1). All entries are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClipRows {
    pub(crate) x: DVec4,
    pub(crate) y: DVec4,
    pub(crate) z: DVec4,
    pub(crate) w: DVec4,
    what: &'static str,
}

impl ClipRows {
    /// Of a column-major matrix, which errors call `what`.
    pub(crate) fn new(matrix: [[f64; 4]; 4], what: &'static str) -> Result<Self, ModelError> {
        let matrix = DMat4::from_cols_array_2d(&matrix);
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| matrix.row(row));
        let rows = Self { x, y, z, w, what };
        if !matrix.is_finite() {
            return Err(rows.error("an entry is NaN or infinite", "give finite numbers"));
        }
        Ok(rows)
    }

    /// An error if the matrix, which must be a projection by itself, is one only when it is transposed.
    pub(crate) fn refuse_row_major(&self) -> Result<(), ModelError> {
        let last_column = DVec4::new(self.x.w, self.y.w, self.z.w, self.w.w);
        if is_standard(last_column) && !is_standard(self.w) {
            return Err(self.error(
                "its last column is what its last row should be: it is row-major",
                "transpose it; matrices are column-major, for column vectors",
            ));
        }
        Ok(())
    }

    /// The rows if their rays are parallel, divided by w, whose variation is rounding; `None` for a perspective.
    ///
    /// w counts as constant if it varies by less than [`ROUNDING`] between the corners of the clip cube, z from −1 to 1:
    /// both readings then agree to what f32 holds of the image. With s = 1/w, which is linear in clip space, no corner
    /// needs a division.
    pub(crate) fn parallel(&self) -> Result<Option<Self>, ModelError> {
        let scale = if self.w.truncate() == DVec3::ZERO {
            1.0 / self.w.w
        } else {
            let matrix = DMat4::from_cols(self.x, self.y, self.z, self.w).transpose();
            let s = matrix.inverse().row(3);
            let variation = s.truncate().abs().element_sum();
            if !(s.is_finite() && variation <= 0.5 * ROUNDING * s.w.abs()) {
                return Ok(None);
            }
            s.w
        };
        if !scale.is_finite() {
            return Err(self.error("its last row is 0 0 0 0", "give 0 0 0 1, or 0 0 ±1 0 for a perspective"));
        }
        if scale < 0.0 {
            return Err(self.error("w is negative everywhere, so that nothing is seen", "multiply it by −1"));
        }
        let [x, y, z] = [self.x, self.y, self.z].map(|row| row * scale);
        Ok(Some(Self { x, y, z, w: DVec4::W, what: self.what }))
    }

    /// The inverse of three rows' linear parts, of which the third decides what lies ahead.
    ///
    /// An error if the rows' directions are dependent to rounding: then the image is a line.
    pub(crate) fn inverse_of(&self, third: DVec3) -> Result<DMat3, ModelError> {
        let rows = [self.x.truncate(), self.y.truncate(), third];
        let directions = rows.map(|row| row / row.abs().max_element());
        let [a, b, c] = directions.map(DVec3::normalize);
        let inverse = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose().inverse();
        // Rows that agree to a quarter of what f32 rounds are one row.
        if a.cross(b).dot(c).abs() > 0.25 * ROUNDING && inverse.is_finite() {
            Ok(inverse)
        } else {
            Err(self.error(
                "it is singular: two of its rows say the same, or one nothing",
                "give an invertible matrix",
            ))
        }
    }

    /// An error about this matrix.
    pub(crate) fn error(&self, problem: &'static str, cure: &'static str) -> ModelError {
        ModelError::Degenerate { what: self.what, problem, cure }
    }
}

/// Whether it is the last row of a plain projection: 0 0 0 1, 0 0 −1 0 or 0 0 1 0, to rounding.
fn is_standard(row: DVec4) -> bool {
    let near = |plain: DVec4| (row - plain).abs().max_element() <= ROUNDING;
    near(DVec4::W) || near(DVec4::Z) || near(DVec4::NEG_Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(w: [f64; 4]) -> ClipRows {
        let mut matrix =
            [[0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, -0.01, 0.0], [0.0, 0.0, -0.01, 1.0]];
        for (column, entry) in matrix.iter_mut().zip(w) {
            column[3] = entry;
        }
        ClipRows::new(matrix, "clip").unwrap()
    }

    #[test]
    fn a_last_row_that_f32_rounded_is_parallel() {
        for w in [[0.0, 0.0, 0.0, 1.000_000_1], [0.0, -0.0, 0.0, 0.5], [1e-9, 0.0, -1e-9, 1.0]] {
            let parallel = rows(w).parallel().unwrap().unwrap();
            assert!((parallel.x.x - 0.5 / w[3]).abs() < 1e-9, "{w:?}");
        }
        for w in [[0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 1e-5, 1.0]] {
            assert!(rows(w).parallel().unwrap().is_none(), "{w:?}");
        }
        assert!(rows([0.0; 4]).parallel().is_err());
        assert!(rows([0.0, 0.0, 0.0, -1.0]).parallel().is_err());
    }
}
