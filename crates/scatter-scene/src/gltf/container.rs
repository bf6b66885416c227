//! The outside of a glTF asset: GLB chunks or plain JSON, and the bytes of its buffers.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.6.1 (buffers) and 4 (GLB). Departures, all towards
//! acceptance: content decides between GLB and JSON, not the extension; bytes after a GLB's stated length and
//! unknown chunks are skipped; a byte order mark before the JSON is skipped.

use std::cell::OnceCell;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::schema::{Buffer, Root};
use super::uri::{Uri, parse_uri};
use crate::error::{Checked, Fault};

const CUT_OFF: &str = "the file is cut off or damaged: export or copy it again";

/// The JSON of the asset and, in a GLB, its binary chunk.
pub(super) fn split(bytes: &[u8]) -> Checked<(Root, Option<&[u8]>)> {
    if !bytes.starts_with(b"glTF") {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return Ok((parse_json(json)?, None));
    }
    let header = |word: usize| read_u32(bytes, 4 * word).ok_or_else(|| cut_off("GLB header"));
    let version = header(1)?;
    if version != 2 {
        let problem = format!("GLB version {version}");
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
    Ok((parse_json(json)?, bin))
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
                    let bytes = self.load(uri, buffer.byte_length, &place)?;
                    self.loaded[buffer_idx].get_or_init(|| bytes)
                }
            },
        };
        usize::try_from(buffer.byte_length).ok().and_then(|length| bytes.get(..length)).ok_or_else(|| {
            let problem =
                format!("byteLength is {}, but there are {} bytes", buffer.byte_length, bytes.len());
            Fault::invalid(place(), problem, CUT_OFF)
        })
    }

    fn load(&self, uri: &str, byte_length: u64, place: &dyn Fn() -> String) -> Checked<Vec<u8>> {
        let relative = match parse_uri(uri)
            .map_err(|(problem, cure)| Fault::invalid(format!("{}.uri", place()), problem, cure))?
        {
            Uri::Data(bytes) => return Ok(bytes),
            Uri::Relative(path) => path,
        };
        let path = self.folder.join(&relative);
        let read = || {
            let file = File::open(&path)?;
            if !file.metadata()?.is_file() {
                return Err(std::io::Error::other("this is not a regular file"));
            }
            let mut bytes = Vec::new();
            file.take(byte_length).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        read().map_err(|error| {
            let problem = format!("cannot read {}: {error}", path.display());
            Fault::invalid(format!("{}.uri", place()), problem, "put the buffer's file beside the glTF file")
        })
    }
}

fn parse_json(json: &[u8]) -> Checked<Root> {
    serde_json::from_slice(json).map_err(|error| {
        let message = error.to_string();
        // serde_json ends its messages with the place, which we put first.
        let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem);
        let place = format!("JSON line {} column {}", error.line(), error.column());
        Fault::invalid(place, problem, "the file is no valid glTF 2.0: export it again")
    })
}

fn read_u32(bytes: &[u8], offset: usize) -> Option<u32> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*word))
}

fn cut_off(place: impl Into<String>) -> Fault {
    Fault::invalid(place, "it ends too early", CUT_OFF)
}
