//! One module: checked by naga without a capability, and written as SPIR-V, HLSL and MSL.

use anyhow::anyhow;
use naga::back::{hlsl, msl, spv};
use scatter_gpu::kernels::Module;

/// A module in four languages.
pub struct Translation {
    /// The module's name.
    pub name: &'static str,
    /// The assembled text.
    pub wgsl: String,
    /// For Vulkan, little-endian words.
    pub spirv: Vec<u8>,
    /// For Direct3D 12.
    pub hlsl: String,
    /// For Metal.
    pub msl: String,
    /// Workgroup memory of all its entries together.
    pub workgroup_bytes: u32,
}

/// The translation of a module, or what a compiler says against it.
pub fn translated(module: &Module) -> anyhow::Result<Translation> {
    let wgsl = module.assemble();
    let fault = |stage: &str, error: String| anyhow!("{}: {stage}: {error}", module.name);
    let parsed =
        naga::front::wgsl::parse_str(&wgsl).map_err(|error| fault("WGSL", error.emit_to_string(&wgsl)))?;
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    let info =
        validator.validate(&parsed).map_err(|error| fault("validation", error.emit_to_string(&wgsl)))?;
    // With the defaults of what may be overridden.
    let (parsed, info) =
        naga::back::pipeline_constants::process_overrides(&parsed, &info, None, &Default::default())
            .map_err(|error| fault("overrides", error.to_string()))?;
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(parsed.to_ctx()).map_err(|error| fault("layout", error.to_string()))?;
    let in_workgroup = parsed
        .global_variables
        .iter()
        .filter(|(_, variable)| variable.space == naga::AddressSpace::WorkGroup);
    let workgroup_bytes = in_workgroup.map(|(_, variable)| layouter[variable.ty].size).sum();
    let words = spv::write_vec(&parsed, &info, &spv::Options::default(), None)
        .map_err(|error| fault("SPIR-V", error.to_string()))?;
    let mut written = String::new();
    hlsl::Writer::new(&mut written, &hlsl::Options::default(), &hlsl::PipelineOptions::default())
        .write(&parsed, &info, None)
        .map_err(|error| fault("HLSL", error.to_string()))?;
    // Bindings of Metal are the application's.
    let metal = msl::Options { fake_missing_bindings: true, ..Default::default() };
    let (msl, _) = msl::write_string(&parsed, &info, &metal, &msl::PipelineOptions::default())
        .map_err(|error| fault("MSL", error.to_string()))?;
    Ok(Translation {
        name: module.name,
        wgsl,
        spirv: words.into_iter().flat_map(u32::to_le_bytes).collect(),
        hlsl: written,
        msl,
        workgroup_bytes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scatter_gpu::kernels::modules;

    #[test]
    fn every_module_is_written_in_all_languages() {
        for module in modules::all() {
            let found = translated(module).unwrap();
            // SPIR-V's magic number; an entry's name survives in the others.
            assert_eq!(found.spirv[..4], 0x0723_0203_u32.to_le_bytes(), "{}", module.name);
            assert!(
                found.hlsl.contains(module.entries[0].name) && found.msl.contains(module.entries[0].name)
            );
            assert!(found.workgroup_bytes <= 16_384, "{}: {} bytes", module.name, found.workgroup_bytes);
        }
    }

    #[test]
    fn a_broken_module_is_named_with_its_line() {
        let broken = Module { name: "broken", files: &["fn f() -> f32 {\n  return 1u;\n}"], entries: &[] };
        let error = translated(&broken).err().unwrap().to_string();
        assert!(error.starts_with("broken: ") && error.contains("2 │"), "{error}");
    }
}
