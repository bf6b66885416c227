//! Encodings of text files: byte order marks, and other encodings told by name.

use crate::error::{Checked, Fault};

/// The bytes of a text without its byte order mark; an error that names the encoding of UTF-16 and UTF-32. `as_what`
/// ends the cure: `as UTF-8`.
pub(crate) fn utf8_bytes<'a>(bytes: &'a [u8], as_what: &str) -> Checked<&'a [u8]> {
    if let Some(text) = bytes.strip_prefix(b"\xef\xbb\xbf") {
        return Ok(text);
    }
    match wide_encoding(bytes) {
        None => Ok(bytes),
        Some(name) => {
            Err(Fault::unsupported("", format!("the text is {name}"), format!("save it {as_what}")))
        }
    }
}

fn wide_encoding(bytes: &[u8]) -> Option<&'static str> {
    // The mark of UTF-32LE begins with that of UTF-16LE.
    let marks: [(&[u8], &str); 4] = [
        (b"\xff\xfe\0\0", "UTF-32 (little endian)"),
        (b"\0\0\xfe\xff", "UTF-32 (big endian)"),
        (b"\xff\xfe", "UTF-16 (little endian)"),
        (b"\xfe\xff", "UTF-16 (big endian)"),
    ];
    if let Some((_, name)) = marks.iter().find(|(mark, _)| bytes.starts_with(mark)) {
        return Some(name);
    }
    // Without a mark: texts begin with ASCII, whose other bytes are then zero. Four characters tell.
    let head: &[u8; 8] = bytes.first_chunk()?;
    let zeros = head.map(|byte| byte == 0);
    match zeros {
        [false, true, false, true, false, true, false, true] => Some("UTF-16 (little endian)"),
        [true, false, true, false, true, false, true, false] => Some("UTF-16 (big endian)"),
        [false, true, true, true, false, true, true, true] => Some("UTF-32 (little endian)"),
        [true, true, true, false, true, true, true, false] => Some("UTF-32 (big endian)"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_texts_are_named_with_and_without_their_mark_and_utf8_loses_it() {
        let utf16 =
            |text: &str, bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(bytes).collect::<Vec<u8>>();
        let utf32 = |text: &str, bytes: fn(u32) -> [u8; 4]| {
            text.chars().flat_map(|c| bytes(c.into())).collect::<Vec<u8>>()
        };
        for mark in ["\u{feff}", ""] {
            let text = format!("{mark}v 1 2 3\n");
            for (bytes, name) in [
                (utf16(&text, u16::to_le_bytes), "UTF-16 (little"),
                (utf16(&text, u16::to_be_bytes), "UTF-16 (big"),
                (utf32(&text, u32::to_le_bytes), "UTF-32 (little"),
                (utf32(&text, u32::to_be_bytes), "UTF-32 (big"),
            ] {
                let message = utf8_bytes(&bytes, "as UTF-8").unwrap_err().to_string();
                assert!(message.contains(name) && message.ends_with("; save it as UTF-8"), "{message}");
            }
            assert_eq!(utf8_bytes(text.as_bytes(), "").unwrap(), b"v 1 2 3\n");
        }
        assert_eq!(utf8_bytes(b"v\0", "").unwrap(), b"v\0");
    }
}
