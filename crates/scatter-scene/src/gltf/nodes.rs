//! The node hierarchy: which nodes the default scene holds, and their f64 world matrices.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.5.2 and 3.5.3: a strict forest, local = T·R·S or a matrix,
//! world = parent's world · local; KHR_node_visibility. Iterative, so that no depth can overflow the stack. Departures:
//! quaternions are normalised in f64 (files hold rounded ones), a last row that is 0 0 0 1 up to f32 rounding is taken
//! for it; without any scene every parentless node is taken; a scene that lists a child beside its parent gets it once,
//! under its parent, with a note.

use glam::{DMat4, DQuat, DVec3, DVec4};

use gltf::json::Root;

use super::document::Document;
use super::exact::NodeNumbers;
use crate::error::{Checked, Fault};

/// How far the last row of a matrix may be from 0 0 0 1: products and inverses of f32 matrices leave some 1e-7 an entry,
/// deep hierarchies ten times that. A matrix that is meant to be projective differs by far more.
const LAST_ROW_ROUNDING: f64 = 1e-5;

/// The nodes of an asset, where they stand.
pub(super) struct Nodes {
    /// The nodes of the default scene, parents before children, siblings in the file's order.
    pub placed: Vec<PlacedNode>,
    parents: Vec<Option<usize>>,
    /// World matrices of the placed nodes, by the node's index.
    worlds: Vec<Option<DMat4>>,
}

/// A node of the default scene.
pub(super) struct PlacedNode {
    pub node_idx: usize,
    pub world_from_node: DMat4,
    /// Neither it nor one of its ancestors is switched off: of those that are, only the cameras count.
    pub is_visible: bool,
}

impl Nodes {
    /// Places the nodes of the default scene; an error unless the nodes are a forest.
    pub(super) fn new(document: &Document, notes: &mut Vec<String>) -> Checked<Self> {
        let root = &document.root;
        let parents = checked_parents(root)?;
        let roots = scene_roots(root, &parents, notes)?;
        let mut nodes = Self { placed: Vec::new(), worlds: vec![None; parents.len()], parents };
        let mut stack: Vec<_> = roots.iter().rev().map(|&node| (node, DMat4::IDENTITY, true)).collect();
        while let Some((node_idx, world_from_parent, is_parent_visible)) = stack.pop() {
            let world_from_node = world_from_parent * local_matrix(document, node_idx)?;
            checked_matrix(root, node_idx, world_from_node)?;
            let is_visible = is_parent_visible && !is_switched_off(root, node_idx);
            nodes.placed.push(PlacedNode { node_idx, world_from_node, is_visible });
            nodes.worlds[node_idx] = Some(world_from_node);
            stack.extend(children(root, node_idx).rev().map(|child| (child, world_from_node, is_visible)));
        }
        Ok(nodes)
    }

    /// The world matrix of any node that exists, in the default scene or not: a joint need not be in it.
    pub(super) fn world_from(&self, document: &Document, node_idx: usize) -> Checked<DMat4> {
        let mut matrix = DMat4::IDENTITY;
        let mut next = Some(node_idx);
        while let Some(idx) = next {
            if let Some(world) = self.worlds[idx] {
                matrix = world * matrix;
                break;
            }
            matrix = local_matrix(document, idx)? * matrix;
            next = self.parents[idx];
        }
        checked_matrix(&document.root, node_idx, matrix)?;
        Ok(matrix)
    }
}

fn checked_matrix(root: &Root, node_idx: usize, world: DMat4) -> Checked<()> {
    if world.is_finite() {
        return Ok(());
    }
    let problem = "the product of its and its parents' matrices is not finite";
    Err(Fault::invalid(node_place(root, node_idx), problem, "export it at a sane scale"))
}

fn is_switched_off(root: &Root, node_idx: usize) -> bool {
    let extension = |name| root.nodes[node_idx].extensions.as_ref().and_then(|e| e.others.get(name));
    extension("KHR_node_visibility").is_some_and(|e| e["visible"] == false)
}

fn children(root: &Root, node_idx: usize) -> impl DoubleEndedIterator<Item = usize> {
    root.nodes[node_idx].children.iter().flatten().map(|child| child.value())
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
        for child in node.children.iter().flatten().map(|child| child.value()) {
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
        stack.extend(children(root, node_idx));
    }
    match reached.iter().position(|&r| !r) {
        Some(node_idx) => {
            Err(Fault::invalid(node_place(root, node_idx), "it is its own ancestor (a cycle)", CURE))
        }
        None => Ok(parents),
    }
}

/// The roots of the default scene, each once.
fn scene_roots(root: &Root, parents: &[Option<usize>], notes: &mut Vec<String>) -> Checked<Vec<usize>> {
    let scene_idx = match (root.scene, root.scenes.is_empty()) {
        (None, true) => return Ok((0..parents.len()).filter(|&i| parents[i].is_none()).collect()),
        (scene, _) => scene.map_or(0, |scene| scene.value()),
    };
    let fault = |problem: String| {
        Fault::invalid(format!("scenes[{scene_idx}]"), problem, "a scene lists root nodes, each once")
    };
    let scene = root.scenes.get(scene_idx).ok_or_else(|| {
        fault(format!("it is the default scene, but the asset has {} scenes", root.scenes.len()))
    })?;
    let mut is_listed = vec![false; parents.len()];
    for node in scene.nodes.iter().map(|node| node.value()) {
        match is_listed.get_mut(node) {
            None => return Err(fault(format!("node {node}, but the asset has {} nodes", parents.len()))),
            Some(true) => return Err(fault(format!("it lists node {node} twice"))),
            Some(listed) => *listed = true,
        }
    }
    let mut roots = Vec::new();
    let mut below = Vec::new();
    // Whether an ancestor is listed, of every node that was asked for: chains may be long and shared.
    let mut known: Vec<Option<bool>> = vec![None; parents.len()];
    for node in scene.nodes.iter().map(|node| node.value()) {
        let mut chain = vec![node];
        let mut has_listed_ancestor = false;
        let mut next = parents[node];
        while let Some(ancestor) = next {
            if is_listed[ancestor] || known[ancestor] == Some(true) {
                has_listed_ancestor = true;
                break;
            }
            if known[ancestor] == Some(false) {
                break;
            }
            chain.push(ancestor);
            next = parents[ancestor];
        }
        chain.into_iter().for_each(|node| known[node] = Some(has_listed_ancestor));
        if has_listed_ancestor { below.push(node) } else { roots.push(node) }
    }
    if let Some(&first) = below.first() {
        let count = below.len();
        notes.push(format!(
            "scenes[{scene_idx}] lists {} and {} more beside their parents: each is taken once, where its parents put it",
            node_place(root, first),
            count - 1
        ));
    }
    if let Some(&orphan) = roots.iter().find(|&&node| parents[node].is_some()) {
        notes.push(format!(
            "scenes[{scene_idx}] lists {}, a child of a node that is not in the scene: it is placed without its parent",
            node_place(root, orphan)
        ));
    }
    Ok(roots)
}

fn local_matrix(document: &Document, node_idx: usize) -> Checked<DMat4> {
    let fault = |problem, cure| Err(Fault::invalid(node_place(&document.root, node_idx), problem, cure));
    let NodeNumbers { matrix, translation, rotation, scale, .. } = &document.exact.nodes[node_idx];
    if let Some(matrix) = matrix {
        if translation.is_some() || rotation.is_some() || scale.is_some() {
            return fault("it has a matrix and translation, rotation or scale", "keep one of the two");
        }
        let mut matrix = DMat4::from_cols_array(matrix);
        if !((matrix.row(3) - DVec4::W).abs().max_element() <= LAST_ROW_ROUNDING) {
            return fault("its matrix is not affine", "the last row (elements 3, 7, 11, 15) is 0 0 0 1");
        }
        (matrix.x_axis.w, matrix.y_axis.w, matrix.z_axis.w, matrix.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
        return Ok(matrix);
    }
    let rotation = DQuat::from_array((*rotation).unwrap_or([0.0, 0.0, 0.0, 1.0]));
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
