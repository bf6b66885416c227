//! The vertices of a primitive where they stand: morphed, and with a skin in the world.

use glam::DVec3;

use super::accessor::Elements;
use super::morph::Morph;
use super::skin::Weighted;
use crate::error::{Checked, Fault};

/// The vertices of one primitive in their pose.
pub(super) struct Posed<'a> {
    pub positions: Elements<'a, 3>,
    pub morph: Morph<'a>,
    pub weighted: Option<Weighted<'a>>,
}

impl Posed<'_> {
    /// The index of a vertex if it is there.
    pub fn checked_idx(&self, idx: u64, place: &dyn Fn() -> String) -> Checked<u64> {
        if idx < self.positions.count() {
            return Ok(idx);
        }
        let problem = format!("vertex index {idx}, but POSITION has {} elements", self.positions.count());
        Err(Fault::invalid(place(), problem, "the file is damaged or was exported wrongly: export it again"))
    }

    /// Where a vertex that is there stands: in mesh space, or, with a skin, in the world's.
    pub fn at(&self, idx: u64, place: &dyn Fn() -> String) -> Checked<DVec3> {
        let mut p_mesh = DVec3::from_array(self.positions.get(idx));
        if let Some(displacement) = self.morph.displacement(idx) {
            p_mesh += displacement;
        }
        if let Some(weighted) = &self.weighted {
            p_mesh = weighted.world(idx, p_mesh, place)?;
        }
        if p_mesh.is_finite() {
            return Ok(p_mesh);
        }
        let problem = format!("POSITION[{idx}] is {p_mesh}, not finite");
        Err(Fault::invalid(place(), problem, "export the mesh with finite coordinates"))
    }
}
