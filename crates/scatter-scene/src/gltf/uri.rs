//! Buffer URIs: `data:` with base64 or percent-encoded bytes, and relative paths.
//!
//! Sources: RFC 2397 (data), RFC 3986 (percent-encoding), RFC 4648 (base64, standard alphabet, padding optional).
//! Departure: schemes, absolute paths and drive letters are refused, so that a file from elsewhere can name only
//! files relative to itself. `..` is legal glTF and allowed.

use std::path::PathBuf;

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Uri {
    /// The decoded bytes of a `data:` URI.
    Data(Vec<u8>),
    /// A path relative to the glTF file.
    Relative(PathBuf),
}

/// Problem and cure.
type UriFault = (&'static str, &'static str);

pub(super) fn parse_uri(uri: &str) -> Result<Uri, UriFault> {
    const DATA_CURE: &str = "write data:application/octet-stream;base64,… or name a file beside this one";
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        let (header, body) = uri.split_once(',').ok_or(("a data URI without a comma", DATA_CURE))?;
        let bytes = percent_decode(body);
        if !header.to_ascii_lowercase().ends_with(";base64") {
            return Ok(Uri::Data(bytes));
        }
        return match base64_decode(&bytes) {
            Some(bytes) => Ok(Uri::Data(bytes)),
            None => Err(("the data URI is no valid base64", DATA_CURE)),
        };
    }
    let cure = "name a file relative to this one";
    let decoded = String::from_utf8(percent_decode(uri)).map_err(|_| ("the path is no UTF-8", cure))?;
    if decoded.is_empty() {
        return Err(("the path is empty", cure));
    }
    // A colon before the first slash is a scheme (http:) or a drive (C:).
    let first_segment = decoded.split(['/', '\\']).next().unwrap_or_default();
    if first_segment.contains(':') {
        return Err(("only data URIs and relative paths are read, no other scheme", cure));
    }
    if first_segment.is_empty() {
        return Err(("the path is absolute", cure));
    }
    Ok(Uri::Relative(PathBuf::from(decoded)))
}

/// `%41` becomes `A`; a percent sign without two digits stays.
fn percent_decode(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let hex = |i: usize| bytes.get(i).and_then(|&b| char::from(b).to_digit(16));
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        match (bytes[i], hex(i + 1), hex(i + 2)) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                i += 3;
            }
            (byte, ..) => {
                decoded.push(byte);
                i += 1;
            }
        }
    }
    decoded
}

fn base64_decode(text: &[u8]) -> Option<Vec<u8>> {
    let digit_count = text.iter().rposition(|&b| b != b'=').map_or(0, |last| last + 1);
    // One digit alone holds six bits, which is no byte; more than two signs of padding belong to nothing.
    if digit_count % 4 == 1 || text.len() - digit_count > 2 {
        return None;
    }
    let mut decoded = Vec::with_capacity(text.len() / 4 * 3 + 3);
    for group in text[..digit_count].chunks(4) {
        let mut bits = 0;
        for &byte in group {
            bits = bits << 6 | base64_digit(byte)?;
        }
        let bytes = (bits << (6 * (4 - group.len()))).to_be_bytes();
        decoded.extend_from_slice(&bytes[1..group.len()]);
    }
    Some(decoded)
}

fn base64_digit(byte: u8) -> Option<u32> {
    let digit = match byte {
        b'A'..=b'Z' => byte - b'A',
        b'a'..=b'z' => byte - b'a' + 26,
        b'0'..=b'9' => byte - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    };
    Some(u32::from(digit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_decodes_the_vectors_of_rfc_4648_with_and_without_padding() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(base64_decode(text.as_bytes()).unwrap(), bytes.as_bytes());
            assert_eq!(base64_decode(text.trim_end_matches('=').as_bytes()).unwrap(), bytes.as_bytes());
        }
        assert_eq!(base64_decode(b"+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        for bad in ["Z", "Zg=", "Zm9vY", "Zm 9", "Zm9\u{e9}", "====", "Z=g="] {
            // One sign of padding instead of two is harmless; everything else is refused.
            assert_eq!(base64_decode(bad.as_bytes()).is_some(), bad == "Zg=", "{bad}");
        }
    }

    #[test]
    fn relative_paths_are_percent_decoded_and_everything_else_is_refused() {
        assert_eq!(parse_uri("a%20b/../c.bin"), Ok(Uri::Relative("a b/../c.bin".into())));
        assert_eq!(parse_uri("100%.bin"), Ok(Uri::Relative("100%.bin".into())));
        assert_eq!(parse_uri("data:,a%00b"), Ok(Uri::Data(b"a\0b".to_vec())));
        for bad in
            ["", "/etc/x", "%2Fetc/x", "\\\\host\\x", "http://a/b", "C:\\x", "file:x", "data:base64", "%ff"]
        {
            assert!(parse_uri(bad).is_err(), "{bad}");
        }
    }
}
