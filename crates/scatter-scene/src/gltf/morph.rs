//! Morph targets at the weights that the file gives: displacements that are added to positions.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.7.2.2. A node's weights stand over its mesh's, which stand over
//! zero; animations of weights are not read.

use glam::DVec3;
use gltf::json::Root;
use gltf::json::mesh::Primitive;

use super::accessor::{Elements, vec3};
use super::container::Buffers;
use crate::error::{Checked, Fault};

/// The targets of a primitive that have a weight.
pub(super) struct Morph<'a> {
    targets: Vec<(f64, Elements<'a, 3>)>,
}

impl<'a> Morph<'a> {
    /// Opens the targets whose weight is not zero; further weights belong to nothing and are ignored.
    pub(super) fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        primitive: &Primitive,
        weights: &[f64],
        vertex_count: u64,
        place: &dyn Fn() -> String,
    ) -> Checked<Self> {
        let mut targets = Vec::new();
        for (target_idx, (target, &weight)) in primitive.targets.iter().flatten().zip(weights).enumerate() {
            let Some(accessor) = target.positions.filter(|_| weight != 0.0) else { continue };
            let elements =
                Elements::open(root, buffers, accessor.value(), &vec3("the target's POSITION is"))?;
            if elements.count() != vertex_count {
                let problem = format!(
                    "{vertex_count} positions, but {} in morph target {target_idx}",
                    elements.count()
                );
                return Err(Fault::invalid(
                    place(),
                    problem,
                    "a target moves every vertex: export the file again",
                ));
            }
            targets.push((weight, elements));
        }
        Ok(Self { targets })
    }

    /// How far vertex `idx` is moved, in mesh space.
    pub(super) fn displacement(&self, idx: u64) -> Option<DVec3> {
        let weighted =
            |(weight, target): &(f64, Elements<'_, 3>)| *weight * DVec3::from_array(target.get(idx));
        (!self.targets.is_empty()).then(|| self.targets.iter().map(weighted).sum())
    }
}
