//! A small glTF builder for tests: views and accessors are appended to one buffer, the rest is plain JSON.

use std::io::Write;
use std::path::{Path, PathBuf};

use scatter_scene::{Scene, SceneError, load_scene};
use serde_json::{Value, json};

/// Component types of the specification.
pub const I8: u64 = 5120;
pub const U8: u64 = 5121;
pub const I16: u64 = 5122;
pub const U16: u64 = 5123;
pub const U32: u64 = 5125;
pub const F32: u64 = 5126;

/// A glTF asset under construction.
pub struct Asset {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Asset {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
            "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}]
        });
        Self { json, bin: Vec::new() }
    }

    /// Appends to a top-level array and returns the new index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Appends bytes as a buffer view, after three bytes that belong to nobody.
    pub fn view(&mut self, bytes: &[u8], stride: Option<u64>) -> usize {
        self.bin.extend([0xAA; 3]);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.push("bufferViews", view)
    }

    pub fn accessor(&mut self, view: usize, component: u64, kind: &str, count: usize) -> usize {
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": kind, "count": count}),
        )
    }

    /// Tightly packed f32 positions.
    pub fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let view = self.view(&f32_bytes(positions.as_flattened()), None);
        self.accessor(view, F32, "VEC3", positions.len())
    }

    /// Indices of any unsigned type.
    pub fn indices(&mut self, component: u64, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = match component {
            U8 => indices.iter().map(|&i| i as u8).collect(),
            U16 => indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect(),
            _ => indices.iter().flat_map(|&i| i.to_le_bytes()).collect(),
        };
        let view = self.view(&bytes, None);
        self.accessor(view, component, "SCALAR", indices.len())
    }

    /// A mesh of one primitive.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// A node that the default scene lists.
    pub fn root_node(&mut self, node: Value) -> usize {
        let idx = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(idx));
        idx
    }

    /// A mesh in a root node of its own.
    pub fn placed(&mut self, primitive: Value) -> usize {
        let mesh = self.mesh(primitive);
        self.root_node(json!({"mesh": mesh}))
    }

    pub fn glb(&self) -> Vec<u8> {
        glb(self.json.to_string().as_bytes(), &self.bin)
    }

    pub fn load(&self) -> Result<Scene, SceneError> {
        load_bytes("built.glb", &self.glb())
    }

    pub fn message(&self) -> String {
        self.load().expect_err("the asset must be refused").to_string()
    }
}

/// A GLB of a JSON text and a binary chunk.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, content, padding) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        let padded = content.len().next_multiple_of(4);
        bytes.extend((padded as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(content);
        bytes.resize(bytes.len() + padded - content.len(), padding);
    }
    let length = bytes.len() as u32;
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    bytes
}

/// Writes bytes to a file of that name in a fresh folder and loads it.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load_scene(&path)
}

pub fn f32_bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

/// Base64 with padding, the plain way: 24 bits a group.
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = group.iter().fold(0u32, |bits, &b| bits << 8 | u32::from(b)) << (8 * (3 - group.len()));
        for k in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * k)) as usize & 63] as char;
            text.push(if k <= group.len() { digit } else { '=' });
        }
    }
    text
}

/// The folder of reference cases and scenes, or `None` with a visible line.
pub fn shared_folder(test: &str) -> Option<PathBuf> {
    match std::env::var_os("SCATTER_SHARED") {
        Some(folder) => Some(Path::new(&folder).to_path_buf()),
        None => {
            // Past the harness, which shows nothing of a test that passes.
            let _ = writeln!(std::io::stderr(), "SKIPPED {test}: SCATTER_SHARED is not set");
            None
        }
    }
}

/// An image as the bytes of a PNG file.
pub fn png(image: &image::DynamicImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
