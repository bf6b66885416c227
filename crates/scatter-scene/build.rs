//! Compiles the raster pass's shader to SPIR-V and writes down the layout of its structs, where the feature is on.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    #[cfg(feature = "raster")]
    if let Err(error) = shader::compile() {
        println!("cargo::error={error}");
    }
}

#[cfg(feature = "raster")]
mod shader {
    use std::error::Error;
    use std::fmt::Write as _;
    use std::path::Path;

    use naga::back::spv;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    /// `depth.spv`, and `depth_layout.rs` with every struct's member offsets as naga lays them out.
    pub fn compile() -> Result<(), Box<dyn Error>> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders/scatter-scene/depth.wgsl");
        println!("cargo::rerun-if-changed={}", source.display());
        let text =
            std::fs::read_to_string(&source).map_err(|error| format!("{}: {error}", source.display()))?;
        let module = naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string(&text))?;
        let info = Validator::new(ValidationFlags::all(), Capabilities::IMMEDIATES)
            .validate(&module)
            .map_err(|error| error.emit_to_string(&text))?;
        let mut options = spv::Options { lang_version: (1, 3), ..Default::default() };
        // naga's default turns y upside down, as WebGPU has it; the pass's rows are Vulkan's own.
        options.flags.remove(spv::WriterFlags::ADJUST_COORDINATE_SPACE);
        // All entry points in one module.
        let words = spv::write_vec(&module, &info, &options, None)?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_ne_bytes()).collect();
        let out = std::env::var("OUT_DIR")?;
        std::fs::write(Path::new(&out).join("depth.spv"), bytes)?;
        std::fs::write(Path::new(&out).join("depth_layout.rs"), layout(&module)?)?;
        Ok(())
    }

    /// `(struct.member, offset)` of every struct, and `(struct, size)`.
    fn layout(module: &naga::Module) -> Result<String, std::fmt::Error> {
        let mut text = String::from("&[\n");
        for (_, ty) in module.types.iter() {
            if let (Some(name), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner) {
                for member in members {
                    let member_name = member.name.as_deref().unwrap_or("");
                    writeln!(text, "    (\"{name}.{member_name}\", {}),", member.offset)?;
                }
                writeln!(text, "    (\"{name}\", {span}),")?;
            }
        }
        text.push_str("]\n");
        Ok(text)
    }
}
