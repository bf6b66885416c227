//! Writes meshes under a hierarchy of nodes as one binary glTF 2.0 file.
//!
//! glTF 2.0, sections 3.5 (nodes), 3.6 (buffers and accessors), 4 (the GLB container). The JSON is put together by
//! hand: key order and number format are then ours, and the bytes the same on every platform. Indices are u16
//! where they fit and u32 where not.

use super::mesh::Mesh;
use super::occluder_mesh::OccluderMesh;
use glam::DVec3;
use std::fmt::Write;

/// glTF's constants: `componentType` of u16, u32 and f32, `target` of vertex and index views.
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A sampler's filter and wrap.
const NEAREST: u32 = 9728;
const CLAMP_TO_EDGE: u32 = 33071;

/// The second material, of meshes that are cut out.
const CUT_OUT_MATERIAL: &str = concat!(
    r#",{"name":"leaves","doubleSided":true,"alphaMode":"MASK","alphaCutoff":0.5,"#,
    r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}"#
);

/// Chunk types of a GLB file: "JSON" and "BIN\0".
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BIN_CHUNK: u32 = 0x004e_4942;

/// The meshes and nodes of a file to be written.
#[derive(Debug, Default)]
pub(crate) struct GlbScene {
    meshes: Vec<(String, Mesh)>,
    /// Meshes behind those: points and lines.
    occluders: Vec<(String, OccluderMesh)>,
    /// PNG files; a mesh with texture coordinates is cut out by the first of them.
    textures: Vec<Vec<u8>>,
    nodes: Vec<(Option<NodeId>, Node)>,
}

/// A mesh of the scene; nodes may share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MeshId(usize);

/// A node of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NodeId(usize);

/// A node's name, its placement in its parent, and what hangs there.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    name: String,
    mesh: Option<MeshId>,
    occluder: Option<usize>,
    translation: DVec3,
    /// Unit quaternion x, y, z, w.
    rotation: [f64; 4],
    scale: DVec3,
}

impl Node {
    /// An unmoved node.
    pub(crate) fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            mesh: None,
            occluder: None,
            translation: DVec3::ZERO,
            rotation: [0.0, 0.0, 0.0, 1.0],
            scale: DVec3::ONE,
        }
    }

    /// Hangs a mesh there.
    pub(crate) fn mesh(mut self, mesh: MeshId) -> Self {
        self.mesh = Some(mesh);
        self
    }

    /// Moves its origin to `translation` in the parent's space.
    pub(crate) fn at(mut self, translation: DVec3) -> Self {
        self.translation = translation;
        self
    }

    /// Turns it about the y axis, counter-clockwise seen from above.
    pub(crate) fn turned(mut self, turns: f64) -> Self {
        let (sine, cosine) = super::random::sin_cos_turns(turns / 2.0);
        self.rotation = [0.0, sine, 0.0, cosine];
        self
    }

    /// Scales it along its own axes.
    pub(crate) fn scaled(mut self, scale: DVec3) -> Self {
        self.scale = scale;
        self
    }
}

impl GlbScene {
    /// Takes a mesh, whose name nodes and viewers see.
    pub(crate) fn add_mesh(&mut self, name: impl Into<String>, mesh: Mesh) -> MeshId {
        self.meshes.push((name.into(), mesh));
        MeshId(self.meshes.len() - 1)
    }

    /// Takes the texture, a PNG file, whose alpha cuts out all meshes with texture coordinates.
    pub(crate) fn cut_out_by(&mut self, png: Vec<u8>) {
        self.textures = vec![png];
    }

    /// Hangs a node under `parent`, or at the top.
    pub(crate) fn add_node(&mut self, parent: Option<NodeId>, node: Node) -> NodeId {
        self.nodes.push((parent, node));
        NodeId(self.nodes.len() - 1)
    }

    /// Hangs a mesh of its own at the top, unmoved.
    pub(crate) fn add_mesh_node(&mut self, name: &str, mesh: Mesh) -> NodeId {
        let mesh = self.add_mesh(name, mesh);
        self.add_node(None, Node::new(name).mesh(mesh))
    }

    /// Hangs points or lines at the top, unmoved.
    pub(crate) fn add_occluder_node(&mut self, name: &str, mesh: OccluderMesh) -> NodeId {
        self.occluders.push((name.to_owned(), mesh));
        let node = Node { occluder: Some(self.occluders.len() - 1), ..Node::new(name) };
        self.add_node(None, node)
    }

    /// The file's bytes.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut binary = Vec::new();
        let mut views = Vec::new();
        let mut accessors = Vec::new();
        let mut meshes = Vec::new();
        for (name, mesh) in &self.meshes {
            let position_accessor = accessors.len();
            let [low, high] = mesh.bounds();
            accessors.push(format!(
                r#"{{"bufferView":{},"componentType":{FLOAT},"count":{},"type":"VEC3","min":{low:?},"max":{high:?}}}"#,
                views.len(),
                mesh.positions.len(),
            ));
            let positions = mesh.positions.iter().flatten().flat_map(|x| x.to_le_bytes());
            views.push(append_view(&mut binary, positions, Some(ARRAY_BUFFER)));

            let indices = mesh.triangles.iter().flatten();
            // 65535 itself would be the restart value, which glTF forbids.
            let (component, view) = if mesh.positions.len() <= usize::from(u16::MAX) {
                let bytes = indices.flat_map(|&index| (index as u16).to_le_bytes());
                (UNSIGNED_SHORT, append_view(&mut binary, bytes, Some(ELEMENT_ARRAY_BUFFER)))
            } else {
                let bytes = indices.flat_map(|index| index.to_le_bytes());
                (UNSIGNED_INT, append_view(&mut binary, bytes, Some(ELEMENT_ARRAY_BUFFER)))
            };
            accessors.push(format!(
                r#"{{"bufferView":{},"componentType":{component},"count":{},"type":"SCALAR"}}"#,
                views.len(),
                3 * mesh.triangles.len(),
            ));
            views.push(view);
            let mut attributes = format!(r#""POSITION":{position_accessor}"#);
            let mut material = 0;
            if !mesh.uv.is_empty() {
                // Writing to a string cannot fail.
                let _ = write!(attributes, r#","TEXCOORD_0":{}"#, accessors.len());
                accessors.push(format!(
                    r#"{{"bufferView":{},"componentType":{FLOAT},"count":{},"type":"VEC2"}}"#,
                    views.len(),
                    mesh.uv.len(),
                ));
                let uv = mesh.uv.iter().flatten().flat_map(|x| x.to_le_bytes());
                views.push(append_view(&mut binary, uv, Some(ARRAY_BUFFER)));
                material = 1;
            }
            meshes.push(format!(
                r#"{{"name":"{name}","primitives":[{{"attributes":{{{attributes}}},"indices":{},"material":{material}}}]}}"#,
                position_accessor + 1,
            ));
        }
        for (name, mesh) in &self.occluders {
            meshes.push(occluder_json(name, mesh, &mut binary, &mut views, &mut accessors));
        }
        let (mut cut_out, mut textures) = ("", String::new());
        for png in &self.textures {
            cut_out = CUT_OUT_MATERIAL;
            textures = format!(
                concat!(
                    r#""textures":[{{"source":0,"sampler":0}}],"#,
                    r#""samplers":[{{"magFilter":{},"minFilter":{},"wrapS":{},"wrapT":{}}}],"#,
                    r#""images":[{{"name":"leaves","mimeType":"image/png","bufferView":{}}}],"#
                ),
                NEAREST,
                NEAREST,
                CLAMP_TO_EDGE,
                CLAMP_TO_EDGE,
                views.len(),
            );
            views.push(append_view(&mut binary, png.iter().copied(), None));
        }
        let nodes: Vec<String> = (0..self.nodes.len()).map(|index| self.node_json(index)).collect();
        let json = format!(
            concat!(
                r#"{{"asset":{{"version":"2.0","generator":"scatter-scene"}},"scene":0,"#,
                r#""scenes":[{{"nodes":{}}}],"nodes":[{}],"meshes":[{}],"#,
                r#""materials":[{{"name":"matt","doubleSided":true}}{}],{}"#,
                r#""accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#
            ),
            indices_json(self.children(None)),
            nodes.join(","),
            meshes.join(","),
            cut_out,
            textures,
            accessors.join(","),
            views.join(","),
            binary.len(),
        );
        container(json.into_bytes(), binary)
    }

    /// The nodes that hang under `parent`, in the order in which they were added.
    fn children(&self, parent: Option<NodeId>) -> Vec<usize> {
        (0..self.nodes.len()).filter(|&index| self.nodes[index].0 == parent).collect()
    }

    /// One node; a placement that does nothing is left out.
    fn node_json(&self, index: usize) -> String {
        let node = &self.nodes[index].1;
        let mut json = format!(r#"{{"name":"{}""#, node.name);
        let mut member = |key: &str, value: String| {
            // Writing to a string cannot fail.
            let _ = write!(json, r#","{key}":{value}"#);
        };
        if let Some(MeshId(mesh)) = node.mesh {
            member("mesh", mesh.to_string());
        }
        if let Some(occluder) = node.occluder {
            member("mesh", (self.meshes.len() + occluder).to_string());
        }
        if node.translation != DVec3::ZERO {
            member("translation", format!("{:?}", node.translation.to_array().map(|x| x as f32)));
        }
        if node.rotation != [0.0, 0.0, 0.0, 1.0] {
            member("rotation", format!("{:?}", node.rotation.map(|x| x as f32)));
        }
        if node.scale != DVec3::ONE {
            member("scale", format!("{:?}", node.scale.to_array().map(|x| x as f32)));
        }
        let children = self.children(Some(NodeId(index)));
        if !children.is_empty() {
            member("children", indices_json(children));
        }
        json.push('}');
        json
    }
}

/// One mesh of points or lines; its data is appended.
fn occluder_json(
    name: &str,
    mesh: &OccluderMesh,
    binary: &mut Vec<u8>,
    views: &mut Vec<String>,
    accessors: &mut Vec<String>,
) -> String {
    let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
    for p in &mesh.positions {
        (low, high) = ([0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i])));
    }
    let count = mesh.positions.len();
    let mut attributes = format!(r#""POSITION":{}"#, accessors.len());
    accessors.push(format!(
        r#"{{"bufferView":{},"componentType":{FLOAT},"count":{count},"type":"VEC3","min":{low:?},"max":{high:?}}}"#,
        views.len(),
    ));
    let positions = mesh.positions.iter().flatten().flat_map(|x| x.to_le_bytes());
    views.push(append_view(binary, positions, Some(ARRAY_BUFFER)));
    for (attribute, values) in &mesh.scalars {
        // Writing to a string cannot fail.
        let _ = write!(attributes, r#","{attribute}":{}"#, accessors.len());
        accessors.push(format!(
            r#"{{"bufferView":{},"componentType":{FLOAT},"count":{count},"type":"SCALAR"}}"#,
            views.len(),
        ));
        views.push(append_view(binary, values.iter().flat_map(|x| x.to_le_bytes()), Some(ARRAY_BUFFER)));
    }
    let mut indices = String::new();
    if !mesh.indices.is_empty() {
        indices = format!(r#","indices":{}"#, accessors.len());
        accessors.push(format!(
            r#"{{"bufferView":{},"componentType":{UNSIGNED_INT},"count":{},"type":"SCALAR"}}"#,
            views.len(),
            mesh.indices.len(),
        ));
        let bytes = mesh.indices.iter().flat_map(|index| index.to_le_bytes());
        views.push(append_view(binary, bytes, Some(ELEMENT_ARRAY_BUFFER)));
    }
    let mode = mesh.mode;
    format!(r#"{{"name":"{name}","primitives":[{{"mode":{mode},"attributes":{{{attributes}}}{indices}}}]}}"#)
}

/// Appends bytes as a buffer view of their own, on a multiple of four; returns the view's JSON.
fn append_view(binary: &mut Vec<u8>, bytes: impl Iterator<Item = u8>, target: Option<u32>) -> String {
    let offset = binary.len();
    binary.extend(bytes);
    let length = binary.len() - offset;
    binary.resize(binary.len().next_multiple_of(4), 0);
    let target = target.map(|target| format!(r#","target":{target}"#)).unwrap_or_default();
    format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}{target}}}"#)
}

/// `[1,2,3]`.
fn indices_json(indices: Vec<usize>) -> String {
    format!("{indices:?}").replace(' ', "")
}

/// Header, JSON chunk (padded with spaces), binary chunk (padded with zeros).
fn container(mut json: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut bytes = Vec::with_capacity(total);
    bytes.extend(b"glTF");
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((total as u32).to_le_bytes());
    for (kind, chunk) in [(JSON_CHUNK, json), (BIN_CHUNK, binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(chunk);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, Vec3};

    fn two_boxes() -> GlbScene {
        let mut mesh = Mesh::default();
        mesh.add_box(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
        let mut scene = GlbScene::default();
        let mesh = scene.add_mesh("box", mesh);
        let group = scene.add_node(None, Node::new("group").at(DVec3::new(10.0, 0.0, 0.0)).turned(0.25));
        scene.add_node(Some(group), Node::new("first").mesh(mesh));
        scene.add_node(Some(group), Node::new("second").mesh(mesh).at(DVec3::X).scaled(DVec3::splat(2.0)));
        scene
    }

    #[test]
    fn chunks_are_aligned_and_add_up() {
        let bytes = two_boxes().to_bytes();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!((word(4), word(8) as usize), (2, bytes.len()));
        let json_length = word(12) as usize;
        assert_eq!((word(16), json_length % 4), (JSON_CHUNK, 0));
        let binary_length = word(20 + json_length) as usize;
        assert_eq!((word(24 + json_length), binary_length % 4), (BIN_CHUNK, 0));
        assert_eq!(28 + json_length + binary_length, bytes.len());
    }

    #[test]
    fn nodes_place_their_meshes() {
        let bytes = two_boxes().to_bytes();
        let file = gltf::Gltf::from_slice(&bytes).expect("a valid file");
        let group = file.scenes().next().and_then(|scene| scene.nodes().next()).expect("a top node");
        let matrix = |node: &gltf::Node<'_>| {
            DMat4::from_cols_array_2d(&node.transform().matrix().map(|column| column.map(f64::from)))
        };
        let second = group.children().nth(1).expect("two children");
        let world = matrix(&group) * matrix(&second);
        // (1,0,0) doubled and moved by 1 is (3,0,0); a quarter turn about y takes x to −z; moved by 10.
        let p = world.transform_point3(DVec3::X);
        assert!((p - DVec3::new(10.0, 0.0, -3.0)).abs().max_element() < 1e-6, "{p}");
        let reader = second.mesh().and_then(|mesh| mesh.primitives().next()).expect("a primitive");
        let reader = reader.reader(|_| file.blob.as_deref());
        let high = reader.read_positions().expect("positions").map(Vec3::from).reduce(Vec3::max);
        assert_eq!(high, Some(Vec3::new(1.0, 2.0, 3.0)));
    }
}
