//! The built-in shots: small deterministic scenes, each there to show one thing that techniques differ in.

mod arcade;
mod beam;
mod blocks;
mod comb;
mod export;
mod glass;
mod glb_writer;
mod grove;
mod grove_cards;
mod haze;
mod lamp;
mod mesh;
mod nave;
mod obj_writer;
mod random;
mod stage;
mod sunset;
mod terrain;
#[cfg(test)]
mod tests;
mod tree;
mod valley;

pub use export::{ExportError, export};

/// A scene that this crate makes by itself, with its shot file.
#[derive(Debug)]
pub struct BuiltinShot {
    /// The name by which `--shot` finds it, and the stem of its files.
    pub name: &'static str,
    /// What it is there to show, in one sentence.
    pub shows: &'static str,
    /// The shot file.
    shot_text: &'static str,
    /// Ending of the mesh file's name.
    mesh_extension: &'static str,
    /// Makes the mesh file.
    mesh_bytes: MakeBytes,
    /// Names of further files, and what makes them.
    others: &'static [(&'static str, MakeBytes)],
}

/// Makes a file's content: the same bytes at every call.
type MakeBytes = fn() -> Vec<u8>;

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

/// The built-in shots that every table shows, in its order.
pub fn builtin_shots() -> &'static [BuiltinShot] {
    static SHOTS: &[BuiltinShot] = &[
        nave::SHOT,
        grove::SHOT,
        comb::SHOT,
        lamp::SHOT,
        valley::SHOT,
        arcade::SHOT,
        beam::SHOT,
        stage::SHOT,
        sunset::SHOT,
        haze::SHOT,
    ];
    SHOTS
}

/// Variants of built-in shots, which are rendered where they are asked for by name.
pub fn builtin_variants() -> &'static [BuiltinShot] {
    static VARIANTS: &[BuiltinShot] = &[grove_cards::SHOT];
    VARIANTS
}

impl BuiltinShot {
    /// The shot or variant with this name.
    pub fn find(name: &str) -> Option<&'static Self> {
        builtin_shots().iter().chain(builtin_variants()).find(|shot| shot.name == name)
    }

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
