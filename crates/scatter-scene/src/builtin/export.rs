//! Writes built-in shots into a folder, as files that any loader can read.

use super::shot::{BuiltinFile, BuiltinShot};
use crate::atomic::write_atomically;
use crate::error::SceneError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a shot could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The folder does not exist and cannot be made: name one that may be written to.
    #[error("{}: cannot make the folder: {source}; name one that you may write to", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] SceneError),
}

/// Writes the files of each shot into `dir` (made if needed) and returns the paths of the shot files.
///
/// Each file appears whole or not at all, the shot file last: a shot file that exists has its mesh.
pub fn export(dir: &Path, shots: &[&BuiltinShot]) -> Result<Vec<PathBuf>, ExportError> {
    fs::create_dir_all(dir).map_err(|source| ExportError::Folder { path: dir.to_owned(), source })?;
    shots
        .iter()
        .map(|shot| {
            let files = shot.files();
            for file in files.others.iter().chain([&files.mesh]) {
                write_whole(dir, file)?;
            }
            write_whole(dir, &files.shot)
        })
        .collect()
}

fn write_whole(dir: &Path, file: &BuiltinFile) -> Result<PathBuf, ExportError> {
    let path = dir.join(&file.name);
    write_atomically(&path, |writer| writer.write_all(&file.bytes))?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exported_files_are_the_shot_s_own() {
        let dir = tempfile::tempdir().unwrap();
        let shot = BuiltinShot::find("lamp").unwrap();
        let paths = export(&dir.path().join("new/folder"), &[shot]).unwrap();
        let files = shot.files();
        assert_eq!(paths, [dir.path().join("new/folder/lamp.toml")]);
        assert_eq!(fs::read(&paths[0]).unwrap(), files.shot.bytes);
        assert_eq!(fs::read(paths[0].with_file_name(&files.mesh.name)).unwrap(), files.mesh.bytes);
        assert_eq!(fs::read_dir(paths[0].parent().unwrap()).unwrap().count(), 2, "nothing else is left");
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        fs::write(&file, "in the way").unwrap();
        let error = export(&file.join("below"), &[]).unwrap_err().to_string();
        assert!(error.contains("below") && error.contains("name one"), "{error}");
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        // A folder stands where the mesh would go, so the renaming fails.
        fs::create_dir_all(dir.path().join("lamp.obj/full")).unwrap();
        let error = export(dir.path(), &[BuiltinShot::find("lamp").unwrap()]).unwrap_err().to_string();
        assert!(error.contains("lamp.obj"), "{error}");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "only the folder in the way");
    }
}
