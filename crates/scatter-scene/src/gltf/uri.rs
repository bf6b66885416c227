//! URIs of buffers and images: `data:` and paths relative to the asset.
//!
//! Read by the crates `data-url` (WHATWG Fetch, which forgives missing padding and white space in base64) and
//! `percent-encoding`. Departures: schemes, absolute paths and drive letters are refused, so that a file from elsewhere
//! can name only files relative to itself (`..` is legal glTF and allowed); backslashes, as exporters on Windows write
//! them, part folders; a file whose name holds a percent sign is found by its plain name too.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use data_url::DataUrl;
use percent_encoding::percent_decode_str;

use crate::error::{Checked, Fault};

/// The bytes behind a URI: of a file beside `folder` at most `most`. The fault has no place.
pub(super) fn read_uri(folder: &Path, uri: &str, most: u64) -> Checked<Vec<u8>> {
    if uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")) {
        return data(uri);
    }
    let relative = relative_path(uri)?;
    let mut path = folder.join(&relative);
    let plain = folder.join(uri.replace('\\', "/"));
    // `uri` has passed the checks above, decoded: undecoded it holds no more slashes or colons than that.
    if !path.exists() && plain.exists() {
        path = plain;
    }
    let read = || {
        let file = File::open(&path)?;
        if !file.metadata()?.is_file() {
            // A pipe or a device could go on for ever.
            return Err(std::io::Error::other("it is not a regular file"));
        }
        let mut bytes = Vec::new();
        file.take(most).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|error| {
        let problem = format!("cannot read {}: {error}", path.display());
        Fault::invalid("", problem, "put the file beside the glTF file, or correct its name")
    })
}

fn data(uri: &str) -> Checked<Vec<u8>> {
    let fault = |problem: &str| {
        let cure = "write data:application/octet-stream;base64,… or name a file beside this one";
        Fault::invalid("", problem, cure)
    };
    let url = DataUrl::process(uri).map_err(|_| fault("a data URI without a comma"))?;
    let (bytes, _) = url.decode_to_vec().map_err(|_| fault("the data URI is no valid base64"))?;
    Ok(bytes)
}

fn relative_path(uri: &str) -> Checked<PathBuf> {
    let fault = |problem: &str| Fault::invalid("", problem, "name a file relative to this one");
    let decoded = percent_decode_str(uri).decode_utf8().map_err(|_| fault("the path is no UTF-8"))?;
    let path = decoded.replace('\\', "/");
    if path.is_empty() {
        return Err(fault("the path is empty"));
    }
    // A colon before the first slash is a scheme (http:) or a drive (C:).
    let first_segment = path.split('/').next().unwrap_or_default();
    if first_segment.contains(':') {
        return Err(fault("only data URIs and relative paths are read, no other scheme"));
    }
    if first_segment.is_empty() {
        return Err(fault("the path is absolute"));
    }
    Ok(PathBuf::from(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_decode_the_vectors_of_rfc_4648_with_and_without_padding() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE=", "fooba"),
            ("Zm9vYmFy", "foobar"),
        ] {
            for text in [text, text.trim_end_matches('=')] {
                for header in
                    ["data:;base64,", "data:application/octet-stream;base64,", "DATA:text/plain;BASE64,"]
                {
                    assert_eq!(data(&format!("{header}{text}")).unwrap(), bytes.as_bytes(), "{header}{text}");
                }
            }
        }
        assert_eq!(data("data:;base64,+/+/").unwrap(), [0xfb, 0xff, 0xbf]);
        assert_eq!(data("data:,a%00b").unwrap(), b"a\0b");
        for bad in ["Z", "Zm9vY", "Zm9\u{e9}", "====", "Z=g="] {
            assert!(data(&format!("data:;base64,{bad}")).is_err(), "{bad}");
        }
        assert!(data("data:base64").is_err());
    }

    #[test]
    fn relative_paths_are_decoded_and_everything_else_is_refused() {
        for (uri, path) in [
            ("a%20b/../c.bin", "a b/../c.bin"),
            ("100%.bin", "100%.bin"),
            ("buffers\\room.bin", "buffers/room.bin"),
            (".\\a\\b.bin", "./a/b.bin"),
        ] {
            assert_eq!(relative_path(uri).unwrap(), PathBuf::from(path));
        }
        for bad in ["", "/etc/x", "%2Fetc/x", "\\\\host\\x", "http://a/b", "C:\\x", "file:x", "%ff", "%5cx"] {
            assert!(relative_path(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_file_whose_name_holds_a_percent_sign_is_found() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a%20b.bin"), "raw").unwrap();
        assert_eq!(read_uri(folder.path(), "a%20b.bin", 9).unwrap(), b"raw");
        std::fs::write(folder.path().join("a b.bin"), "decoded").unwrap();
        assert_eq!(read_uri(folder.path(), "a%20b.bin", 3).unwrap(), b"dec");
    }
}
