//! Skins: where the joints of a skin put the vertices of a mesh, in the pose that the nodes stand in.
//!
//! Source: Khronos, glTF 2.0 specification, section 3.7.3. A skinned mesh ignores the transforms of its own node and of
//! that node's parents: its vertices go from mesh space to the world by the weighted sum of
//! `world_from_joint · inverse bind matrix`. Departures: weights are divided by their sum (files hold rounded ones); a
//! vertex without any weight follows its first joint, as in three.js.

use glam::{DMat4, DVec3};
use gltf::json::Root;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked as Known;

use super::accessor::{Elements, JOINTS, MATRICES, WEIGHTS};
use super::container::Buffers;
use super::document::Document;
use super::nodes::Nodes;
use crate::error::{Checked, Fault};

const CURE: &str = "the file is damaged or was exported wrongly: export it again";

/// World from mesh space, for each joint of a skin.
pub(super) struct Skin {
    matrices: Vec<DMat4>,
}

/// Joints and weights of a primitive's vertices: one pair of accessors for four joints each.
pub(super) struct Weighted<'a> {
    skin: &'a Skin,
    sets: Vec<(Elements<'a, 4>, Elements<'a, 4>)>,
}

impl Skin {
    pub(super) fn open(
        document: &Document,
        buffers: &Buffers<'_>,
        nodes: &Nodes,
        skin_idx: usize,
    ) -> Checked<Self> {
        let root = &document.root;
        let place = format!("skins[{skin_idx}]");
        let fault = |problem: String| Err(Fault::invalid(place.as_str(), problem, CURE));
        let Some(skin) = root.skins.get(skin_idx) else {
            return fault(format!("the asset has {} skins", root.skins.len()));
        };
        if let Some(joint) = skin.joints.iter().find(|joint| joint.value() >= root.nodes.len()) {
            return fault(format!("joint {}, but the asset has {} nodes", joint.value(), root.nodes.len()));
        }
        let binds = match skin.inverse_bind_matrices {
            None => None,
            Some(accessor) => {
                let binds = Elements::<16>::open(root, buffers, accessor.value(), &MATRICES)?;
                if binds.count() < skin.joints.len() as u64 {
                    let (joints, binds) = (skin.joints.len(), binds.count());
                    return fault(format!("{joints} joints, but {binds} inverse bind matrices"));
                }
                Some(binds)
            }
        };
        let matrices = skin.joints.iter().enumerate().map(|(i, joint)| {
            let world = nodes.world_from(document, joint.value())?;
            let bind =
                binds.as_ref().map_or(DMat4::IDENTITY, |binds| DMat4::from_cols_array(&binds.get(i as u64)));
            Ok(world * bind)
        });
        Ok(Self { matrices: matrices.collect::<Checked<_>>()? })
    }
}

impl<'a> Weighted<'a> {
    /// The joints of a primitive; `None` if it names none.
    pub(super) fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        primitive: &Primitive,
        skin: &'a Skin,
        vertex_count: u64,
        place: &dyn Fn() -> String,
    ) -> Checked<Option<Self>> {
        let attribute = |semantic| primitive.attributes.get(&Known::Valid(semantic)).map(|a| a.value());
        let mut sets = Vec::new();
        // Sets are numbered without a gap.
        for set in 0.. {
            let (joints, weights) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)));
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            let joints = Elements::open(root, buffers, joints, &JOINTS)?;
            let weights = Elements::open(root, buffers, weights, &WEIGHTS)?;
            if joints.count() < vertex_count || weights.count() < vertex_count {
                let problem = format!("{vertex_count} positions, but fewer joints or weights in set {set}");
                return Err(Fault::invalid(place(), problem, CURE));
            }
            sets.push((joints, weights));
        }
        Ok((!sets.is_empty()).then_some(Self { skin, sets }))
    }

    /// Where vertex `idx`, at `p_mesh` in the bind pose, stands in the world.
    pub(super) fn world(&self, idx: u64, p_mesh: DVec3, place: &dyn Fn() -> String) -> Checked<DVec3> {
        let mut sum = DVec3::ZERO;
        let mut total = 0.0;
        for (joints, weights) in &self.sets {
            for (joint, weight) in joints.get(idx).into_iter().zip(weights.get(idx)) {
                // Unused joints of a vertex may be any number.
                if weight != 0.0 {
                    sum += weight * self.matrix(joint, place)?.transform_point3(p_mesh);
                    total += weight;
                }
            }
        }
        if total != 0.0 {
            return Ok(sum / total);
        }
        let first = self.sets.first().map_or(0.0, |(joints, _)| joints.get(idx)[0]);
        Ok(self.matrix(first, place)?.transform_point3(p_mesh))
    }

    fn matrix(&self, joint: f64, place: &dyn Fn() -> String) -> Checked<&DMat4> {
        self.skin.matrices.get(joint as usize).ok_or_else(|| {
            let problem = format!("joint {joint}, but its skin has {} joints", self.skin.matrices.len());
            Fault::invalid(place(), problem, CURE)
        })
    }
}
