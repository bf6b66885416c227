//! The outside of a glTF asset: GLB chunks or plain JSON, and the bytes of its buffers.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.6.1 (buffers) and 4 (GLB). Departures, all towards
//! acceptance: content decides between GLB and JSON, not the extension; bytes after a GLB's stated length and
//! unknown chunks are skipped; a byte order mark before the JSON is skipped.

use std::cell::OnceCell;
use std::path::Path;

use gltf::json::buffer::View;
use gltf::json::{Buffer, Root};

use super::document::Document;
use super::uri::read_uri;
use crate::error::{Checked, Fault};
use crate::text::utf8_bytes;

/// How to get rid of mesh compression.
pub(super) const DECOMPRESS: &str =
    "export it without mesh compression, or decompress it (gltf-transform copy in.glb out.glb)";

const CUT_OFF: &str = "the file is cut off or damaged: export or copy it again";

/// The JSON of the asset and, in a GLB, its binary chunk.
pub(super) fn split(bytes: &[u8]) -> Checked<(Document, Option<&[u8]>)> {
    if !bytes.starts_with(b"glTF") {
        let json = utf8_bytes(bytes, "as UTF-8, as glTF demands")?;
        return Ok((Document::parse(json)?, None));
    }
    let header = |word: usize| read_u32(bytes, 4 * word).ok_or_else(|| cut_off("GLB header"));
    let version = header(1)?;
    if version != 2 {
        let old = if version == 1 { ": this is a glTF 1.0 file" } else { "" };
        let problem = format!("GLB version {version}{old}");
        return Err(Fault::unsupported("GLB header", problem, "export it as glTF 2.0"));
    }
    let length = header(2)? as usize;
    let Some(mut rest) = bytes.get(12..length) else {
        let problem = format!("it states {length} bytes, the file has {}", bytes.len());
        return Err(Fault::invalid("GLB header", problem, CUT_OFF));
    };
    let mut json = None;
    let mut bin = None;
    for chunk_idx in 0.. {
        if rest.is_empty() {
            break;
        }
        let place = || format!("GLB chunk {chunk_idx}");
        let (Some(length), Some(kind)) = (read_u32(rest, 0), rest.get(4..8)) else {
            return Err(cut_off(place()));
        };
        let body = &rest[8..];
        let Some(chunk) = body.get(..length as usize) else {
            let problem = format!("it states {length} bytes, {} are left", body.len());
            return Err(Fault::invalid(place(), problem, CUT_OFF));
        };
        match kind {
            b"JSON" if chunk_idx == 0 => json = Some(chunk),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        rest = &body[chunk.len()..];
    }
    let json = json.ok_or_else(|| Fault::invalid("GLB chunk 0", "it is not the JSON chunk", CUT_OFF))?;
    Ok((Document::parse(json)?, bin))
}

/// The asset's buffers, read when they are first asked for.
pub(super) struct Buffers<'a> {
    json: &'a [Buffer],
    bin: Option<&'a [u8]>,
    folder: &'a Path,
    loaded: Vec<OnceCell<Vec<u8>>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(json: &'a [Buffer], bin: Option<&'a [u8]>, folder: &'a Path) -> Self {
        Self { json, bin, folder, loaded: json.iter().map(|_| OnceCell::new()).collect() }
    }

    /// The first `byteLength` bytes of a buffer.
    pub(super) fn bytes(&self, buffer_idx: usize) -> Checked<&[u8]> {
        let place = || format!("buffers[{buffer_idx}]");
        let Some(buffer) = self.json.get(buffer_idx) else {
            let problem = format!("the asset has {} buffers", self.json.len());
            return Err(Fault::invalid(place(), problem, CUT_OFF));
        };
        let bytes = match (&buffer.uri, self.bin) {
            (None, Some(bin)) if buffer_idx == 0 => bin,
            (None, _) => {
                let cure = "export a plain GLB, or the buffer beside the file (it may be a compressed asset)";
                return Err(Fault::invalid(place(), "it has neither a uri nor a GLB chunk", cure));
            }
            (Some(uri), _) => match self.loaded[buffer_idx].get() {
                Some(bytes) => bytes,
                None => {
                    let bytes = read_uri(self.folder, uri, buffer.byte_length.0)
                        .map_err(|fault| fault.at(format!("{}.uri", place())))?;
                    self.loaded[buffer_idx].get_or_init(|| bytes)
                }
            },
        };
        usize::try_from(buffer.byte_length.0).ok().and_then(|length| bytes.get(..length)).ok_or_else(|| {
            let problem =
                format!("byteLength is {}, but there are {} bytes", buffer.byte_length.0, bytes.len());
            Fault::invalid(place(), problem, CUT_OFF)
        })
    }

    /// The bytes of a buffer view; a fault about the index alone has no place.
    pub(super) fn view(&self, root: &Root, view_idx: usize) -> Checked<&[u8]> {
        let view = root.buffer_views.get(view_idx).ok_or_else(|| {
            let problem = format!("bufferView {view_idx}, but the asset has {}", root.buffer_views.len());
            Fault::invalid("", problem, CUT_OFF)
        })?;
        self.check_not_compressed(view, view_idx)?;
        let buffer = self.bytes(view.buffer.value())?;
        let offset = view.byte_offset.unwrap_or_default().0;
        let length = view.byte_length.0;
        sub_slice(buffer, offset, offset.checked_add(length)).ok_or_else(|| {
            let problem = format!("{length} bytes from {offset} on do not fit into {} bytes", buffer.len());
            Fault::invalid(format!("bufferViews[{view_idx}]"), problem, CUT_OFF)
        })
    }

    /// An error if only the compressed form of a view is there; where a fallback is, that is read.
    fn check_not_compressed(&self, view: &View, view_idx: usize) -> Checked<()> {
        let names = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
        let others = view.extensions.as_ref().map(|extensions| &extensions.others);
        let Some(name) = names.into_iter().find(|name| others.is_some_and(|o| o.contains_key(*name))) else {
            return Ok(());
        };
        let has_bytes = self.json.get(view.buffer.value()).is_some_and(|buffer| {
            let is_placeholder = buffer.extensions.as_ref().is_some_and(|e| e.others.contains_key(name));
            buffer.uri.is_some() || (!is_placeholder && view.buffer.value() == 0 && self.bin.is_some())
        });
        if has_bytes {
            return Ok(());
        }
        let problem = format!("it is compressed with {name}, which is not read");
        Err(Fault::unsupported(format!("bufferViews[{view_idx}]"), problem, DECOMPRESS))
    }
}

fn read_u32(bytes: &[u8], offset: usize) -> Option<u32> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

fn cut_off(place: impl Into<String>) -> Fault {
    Fault::invalid(place, "it ends too early", CUT_OFF)
}

/// A part of a slice whose ends may be any numbers.
pub(super) fn sub_slice(bytes: &[u8], start: u64, end: Option<u64>) -> Option<&[u8]> {
    bytes.get(usize::try_from(start).ok()?..usize::try_from(end?).ok()?)
}
