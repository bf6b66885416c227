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
mod hair;
mod haze;
mod lamp;
mod mesh;
mod nave;
mod obj_writer;
mod occluder_mesh;
mod random;
mod shot;
mod smoke;
mod smoke_and_hair;
mod stage;
mod sunset;
mod terrain;
#[cfg(test)]
mod tests;
mod tree;
mod valley;
mod valley_mist;

pub use export::{ExportError, export};
pub use shot::{BuiltinFile, BuiltinFiles, BuiltinShot};

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

/// Variants of built-in shots, and shots of smoke and hair, which few techniques render: they are rendered where they are asked
/// for by name.
pub fn builtin_variants() -> &'static [BuiltinShot] {
    static VARIANTS: &[BuiltinShot] =
        &[grove_cards::SHOT, valley_mist::SHOT, smoke::SHOT, hair::SHOT, smoke_and_hair::SHOT];
    VARIANTS
}

impl BuiltinShot {
    /// The shot or variant with this name.
    pub fn find(name: &str) -> Option<&'static Self> {
        builtin_shots().iter().chain(builtin_variants()).find(|shot| shot.name == name)
    }
}
