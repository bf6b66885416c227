//! The node hierarchy: which nodes the default scene holds, and their f64 world matrices.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.5.2 and 3.5.3: a strict forest, local = T·R·S or a matrix,
//! world = parent's world · local. Iterative, so that no depth can overflow the stack. Departures: quaternions are
//! normalised in f64 (files hold rounded ones); without any scene every parentless node is taken.

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::schema::{Node, Root};
use crate::error::{Checked, Fault};

/// A node of the default scene.
pub(super) struct PlacedNode {
    pub node_idx: usize,
    pub world_from_node: DMat4,
}

/// The nodes of the default scene, parents before children, siblings in the file's order.
pub(super) fn placed_nodes(root: &Root) -> Checked<Vec<PlacedNode>> {
    let parents = checked_parents(root)?;
    let roots = scene_roots(root, &parents)?;
    let mut placed = Vec::new();
    let mut stack: Vec<(usize, DMat4)> = roots.iter().rev().map(|&node| (node, DMat4::IDENTITY)).collect();
    while let Some((node_idx, world_from_parent)) = stack.pop() {
        let node = &root.nodes[node_idx];
        let world_from_node = world_from_parent * local_matrix(root, node_idx)?;
        if !world_from_node.is_finite() {
            let problem = "the product of its and its parents' matrices is not finite";
            return Err(Fault::invalid(node_place(root, node_idx), problem, "export it at a sane scale"));
        }
        placed.push(PlacedNode { node_idx, world_from_node });
        stack.extend(node.children.iter().rev().map(|&child| (child, world_from_node)));
    }
    Ok(placed)
}

/// `nodes[3] "name"`.
pub(super) fn node_place(root: &Root, node_idx: usize) -> String {
    match root.nodes.get(node_idx).and_then(|node| node.name.as_deref()) {
        Some(name) => format!("nodes[{node_idx}] \"{name}\""),
        None => format!("nodes[{node_idx}]"),
    }
}

/// The parent of each node; an error unless the nodes are a forest.
fn checked_parents(root: &Root) -> Checked<Vec<Option<usize>>> {
    const CURE: &str = "every node may have one parent and no cycle: export the file again";
    let count = root.nodes.len();
    let mut parents = vec![None; count];
    for (node_idx, node) in root.nodes.iter().enumerate() {
        for &child in &node.children {
            let place = || node_place(root, node_idx);
            let parent = parents.get_mut(child).ok_or_else(|| {
                let problem = format!("child {child}, but the asset has {count} nodes");
                Fault::invalid(place(), problem, CURE)
            })?;
            if let Some(other) = *parent {
                let problem = format!("its child {child} is also a child of nodes[{other}]");
                return Err(Fault::invalid(place(), problem, CURE));
            }
            *parent = Some(node_idx);
        }
    }
    // With one parent each, what cannot be reached from the parentless nodes lies on or below a cycle.
    let mut reached = vec![false; count];
    let mut stack: Vec<usize> = (0..count).filter(|&i| parents[i].is_none()).collect();
    while let Some(node_idx) = stack.pop() {
        reached[node_idx] = true;
        stack.extend(&root.nodes[node_idx].children);
    }
    match reached.iter().position(|&r| !r) {
        Some(node_idx) => {
            Err(Fault::invalid(node_place(root, node_idx), "it is its own ancestor (a cycle)", CURE))
        }
        None => Ok(parents),
    }
}

fn scene_roots(root: &Root, parents: &[Option<usize>]) -> Checked<Vec<usize>> {
    let scene_idx = match (root.scene, root.scenes.is_empty()) {
        (None, true) => return Ok((0..parents.len()).filter(|&i| parents[i].is_none()).collect()),
        (scene, _) => scene.unwrap_or(0),
    };
    let fault = |problem: String| {
        Fault::invalid(format!("scenes[{scene_idx}]"), problem, "a scene lists root nodes, each once")
    };
    let scene = root.scenes.get(scene_idx).ok_or_else(|| {
        fault(format!("it is the default scene, but the asset has {} scenes", root.scenes.len()))
    })?;
    let mut listed = vec![false; parents.len()];
    for &node in &scene.nodes {
        match parents.get(node) {
            None => return Err(fault(format!("node {node}, but the asset has {} nodes", parents.len()))),
            Some(Some(parent)) => {
                return Err(fault(format!("node {node} is no root but a child of {parent}")));
            }
            Some(None) if listed[node] => return Err(fault(format!("it lists node {node} twice"))),
            Some(None) => listed[node] = true,
        }
    }
    Ok(scene.nodes.clone())
}

fn local_matrix(root: &Root, node_idx: usize) -> Checked<DMat4> {
    let node: &Node = &root.nodes[node_idx];
    let fault = |problem, cure| Err(Fault::invalid(node_place(root, node_idx), problem, cure));
    let Node { matrix, translation, rotation, scale, .. } = node;
    if let Some(matrix) = matrix {
        if translation.is_some() || rotation.is_some() || scale.is_some() {
            return fault("it has a matrix and translation, rotation or scale", "keep one of the two");
        }
        let matrix = DMat4::from_cols_array(matrix);
        if matrix.row(3) != DVec4::W {
            return fault("its matrix is not affine", "the last row (elements 3, 7, 11, 15) is 0 0 0 1");
        }
        return Ok(matrix);
    }
    let rotation = DQuat::from_array(rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    // Scaled first, so that no square overflows or vanishes.
    let largest = DVec4::from(rotation).abs().max_element();
    if largest == 0.0 {
        return fault("its rotation is a zero quaternion", "give a unit quaternion x y z w");
    }
    let rotation = (rotation * (1.0 / largest)).normalize();
    Ok(DMat4::from_scale_rotation_translation(
        scale.map_or(DVec3::ONE, DVec3::from_array),
        rotation,
        translation.map_or(DVec3::ZERO, DVec3::from_array),
    ))
}
