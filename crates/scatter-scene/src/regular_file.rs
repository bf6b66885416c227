//! Whole files of a sane size.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Fault, SceneError};

/// Longest file that is read, in bytes. Larger meshes exceed [`MAX_POSITIONS`](crate::MAX_POSITIONS) in every format.
const MAX_FILE_BYTES: u64 = 8 << 30;

/// Reads a whole file whose size is sane.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    let open = || {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        Ok((file, metadata))
    };
    let (mut file, metadata) = open().map_err(|e| SceneError::read(path, e))?;
    if !metadata.is_file() {
        // A pipe or a device could go on for ever.
        return Err(Fault::invalid("", "this is not a regular file", "name a file").in_file(path));
    }
    if metadata.len() > MAX_FILE_BYTES {
        let problem = format!("{} bytes, more than the limit of {MAX_FILE_BYTES}", metadata.len());
        return Err(Fault::too_large("", problem, "split or simplify the file").in_file(path));
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|e| SceneError::read(path, e))?;
    Ok(bytes)
}
