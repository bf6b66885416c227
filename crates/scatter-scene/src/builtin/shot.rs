//! What a built-in shot is made of: its shot file, its mesh, and what they name.

/// A scene that this crate makes by itself, with its shot file.
#[derive(Debug)]
pub struct BuiltinShot {
    /// The name by which `--shot` finds it, and the stem of its files.
    pub name: &'static str,
    /// What it is there to show, in one sentence.
    pub shows: &'static str,
    /// The shot file.
    pub(super) shot_text: &'static str,
    /// Ending of the mesh file's name.
    pub(super) mesh_extension: &'static str,
    /// Makes the mesh file.
    pub(super) mesh_bytes: MakeBytes,
    /// Names of further files, and what makes them.
    pub(super) others: &'static [(&'static str, MakeBytes)],
}

/// Makes a file's content: the same bytes at every call.
pub(super) type MakeBytes = fn() -> Vec<u8>;

/// A file in memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltinFile {
    /// Its name, without a folder.
    pub name: String,
    /// What is in it.
    pub bytes: Vec<u8>,
}

/// The files of a shot. They belong into one folder: they name each other by file name alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltinFiles {
    /// The shot file, `NAME.toml`.
    pub shot: BuiltinFile,
    /// The mesh, `NAME.glb` or `NAME.obj`.
    pub mesh: BuiltinFile,
    /// What else the shot file names, such as a light's texture.
    pub others: Vec<BuiltinFile>,
}

impl BuiltinShot {
    /// Makes the shot's files: the same bytes at every call and on every platform. Takes up to a second or two.
    pub fn files(&self) -> BuiltinFiles {
        BuiltinFiles {
            shot: BuiltinFile {
                name: format!("{}.toml", self.name),
                bytes: self.shot_text.as_bytes().to_vec(),
            },
            mesh: BuiltinFile {
                name: format!("{}.{}", self.name, self.mesh_extension),
                bytes: (self.mesh_bytes)(),
            },
            others: self
                .others
                .iter()
                .map(|&(name, bytes)| BuiltinFile { name: name.to_owned(), bytes: bytes() })
                .collect(),
        }
    }
}
