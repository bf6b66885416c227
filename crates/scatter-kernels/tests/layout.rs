//! Rung 0 of the ladder: every assembled shader is valid, needs no capability and stays within WebGPU's limits; the shared
//! structs have one layout in Rust and WGSL; the table of bindings is what the shaders bind. No adapter.

use std::collections::BTreeMap;
use std::mem::offset_of;

use scatter_kernels::modules::{self, BindingKind, MODULES, Module};
use scatter_kernels::{FrameUniform, MapLayer, PhaseTerm, flags};

/// WebGPU's guaranteed workgroup memory and storage buffers a stage.
const WORKGROUP_BYTES: u32 = 16_384;
const STORAGE_BUFFERS: usize = 8;

fn parsed(text: &str) -> Result<(naga::Module, naga::valid::ModuleInfo), String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|error| error.emit_to_string(text))?;
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    let info = validator.validate(&module).map_err(|error| error.emit_to_string(text))?;
    Ok((module, info))
}

fn members(module: &naga::Module, name: &str) -> Result<(BTreeMap<String, u32>, u32), String> {
    for (_, ty) in module.types.iter() {
        if let (Some(found), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner)
            && found == name
        {
            let offsets = members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect();
            return Ok((offsets, *span));
        }
    }
    Err(format!("no struct {name}"))
}

/// The first difference between the layouts of the shared structs, if any.
fn layout_of(text: &str) -> Result<(), String> {
    let (module, _) = parsed(text)?;
    macro_rules! same {
        ($rust:ident, [$($field:ident),*]) => {{
            let (offsets, span) = members(&module, stringify!($rust))?;
            let mut expected = BTreeMap::new();
            $(expected.insert(stringify!($field).to_string(), offset_of!($rust, $field) as u32);)*
            if offsets != expected || span != size_of::<$rust>() as u32 {
                return Err(format!("{}: {offsets:?}, {span} bytes in WGSL, {expected:?} in Rust", stringify!($rust)));
            }
        }};
    }
    same!(MapLayer, [start, step, size, quotient, slope, way, place]);
    same!(PhaseTerm, [sigma_s, kind]);
    same!(
        FrameUniform,
        [
            image, kinds, counts, direction, origin, reference, depth, depth_more, light, moment, strength,
            cone, cone_more, sigma_t, fog, phases, glass, maps
        ]
    );
    Ok(())
}

/// The same of the structs of techniques, and their constants.
#[test]
fn structs_of_techniques_have_one_layout() {
    use scatter_kernels::epipolar::{self, EpipolarUniform, SliceData, SliceLine, SliceTask};
    use scatter_kernels::minmax::{self, TreeLayer};
    macro_rules! check {
        ($module:expr, $rust:ident, [$($field:ident),*]) => {{
            let (module, _) = parsed(&$module.assemble()).unwrap();
            let mut expected = BTreeMap::new();
            $(expected.insert(stringify!($field).to_string(), offset_of!($rust, $field) as u32);)*
            let found = members(&module, stringify!($rust)).unwrap();
            assert_eq!(found, (expected, size_of::<$rust>() as u32), stringify!($rust));
        }};
    }
    let tree = minmax::TRAVERSE_FLOAT;
    check!(tree, TreeLayer, [start, step, size, origin, perspective, coarsest, offsets]);
    let (sums, rows) = (epipolar::SUMS, epipolar::ROWS);
    check!(
        sums,
        SliceData,
        [
            view_ray,
            border,
            column,
            column_count,
            first_range,
            first_line,
            line_count,
            first_run,
            room,
            flags,
            padding
        ]
    );
    check!(
        rows,
        SliceLine,
        [
            columns,
            first,
            advance,
            layer,
            strides,
            minor,
            length,
            consumed,
            last_minor,
            depth_base,
            gamma,
            numerator,
            denominator
        ]
    );
    check!(sums, SliceTask, [slice, band, first_rank, column_count]);
    check!(sums, EpipolarUniform, [batch, counts, walked, reach, tables, units, bands, padding]);
    for (module, name, value) in [
        (tree, "FINEST", minmax::FINEST),
        (tree, "COARSEST", minmax::COARSEST),
        (sums, "CHUNK", epipolar::CHUNK),
        (sums, "COLUMNS", epipolar::COLUMNS),
        (sums, "GROUPS_A_ROW", epipolar::GROUPS_A_ROW),
        (sums, "MOST_BANDS", epipolar::MOST_BANDS as u32),
        (sums, "WHOLE", epipolar::WHOLE),
        (sums, "FIRST_OF_FAN", epipolar::flags::FIRST_OF_FAN),
        (sums, "LAST_OF_FAN", epipolar::flags::LAST_OF_FAN),
        (sums, "STEEP", epipolar::flags::STEEP),
    ] {
        assert!(module.assemble().contains(&format!("const {name}: u32 = {value}u;")), "{name}");
    }
}

fn kind_of(module: &naga::Module, variable: &naga::GlobalVariable) -> Option<BindingKind> {
    use naga::{ImageClass, ImageDimension, StorageAccess, StorageFormat, TypeInner};
    Some(match (variable.space, &module.types[variable.ty].inner) {
        (naga::AddressSpace::Uniform, _) => BindingKind::Uniform,
        (naga::AddressSpace::Storage { access }, _) if access.contains(StorageAccess::STORE) => {
            BindingKind::StorageReadWrite
        }
        (naga::AddressSpace::Storage { .. }, _) => BindingKind::Storage,
        (_, TypeInner::Image { dim: ImageDimension::D2, arrayed, class }) => match class {
            ImageClass::Sampled { multi: true, .. } => BindingKind::TextureMultisampled,
            ImageClass::Sampled { .. } if *arrayed => BindingKind::TextureArray,
            ImageClass::Sampled { .. } => BindingKind::Texture,
            ImageClass::Storage { format: StorageFormat::R32Float, .. } => BindingKind::WriteR32Float,
            ImageClass::Storage { format: StorageFormat::Rgba16Float, .. } => BindingKind::WriteRgba16Float,
            ImageClass::Storage { format: StorageFormat::Rgba32Float, .. } => BindingKind::WriteRgba32Float,
            _ => return None,
        },
        _ => return None,
    })
}

fn check(module: &Module) -> Result<(), String> {
    let text = module.assemble();
    let (parsed, info) = parsed(&text)?;
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(parsed.to_ctx()).map_err(|error| error.to_string())?;
    for entry in module.entries {
        let index = parsed
            .entry_points
            .iter()
            .position(|point| point.name == entry.name)
            .ok_or_else(|| format!("no entry {}", entry.name))?;
        let point = &parsed.entry_points[index];
        if point.stage == naga::ShaderStage::Compute && point.workgroup_size != entry.workgroup {
            return Err(format!(
                "{}: workgroup {:?}, table {:?}",
                entry.name, point.workgroup_size, entry.workgroup
            ));
        }
        let uses = info.get_entry_point(index);
        let mut workgroup_bytes = 0;
        let mut bound = BTreeMap::new();
        for (handle, variable) in parsed.global_variables.iter() {
            if uses[handle].is_empty() {
                continue;
            }
            if variable.space == naga::AddressSpace::WorkGroup {
                workgroup_bytes += layouter[variable.ty].size;
            }
            if let Some(binding) = &variable.binding {
                let kind = kind_of(&parsed, variable).ok_or("a binding of an unknown kind")?;
                bound.insert(binding.binding, kind);
            }
        }
        let table: BTreeMap<u32, BindingKind> = entry.bindings.iter().map(|b| (b.number, b.kind)).collect();
        if bound != table {
            return Err(format!("{}: the shader binds {bound:?}, the table says {table:?}", entry.name));
        }
        if workgroup_bytes > WORKGROUP_BYTES {
            return Err(format!("{}: {workgroup_bytes} bytes of workgroup memory", entry.name));
        }
        let invocations: u32 = entry.workgroup.iter().product();
        if invocations > 256 {
            return Err(format!("{}: {invocations} invocations a workgroup", entry.name));
        }
        let storage = bound
            .values()
            .filter(|kind| matches!(kind, BindingKind::Storage | BindingKind::StorageReadWrite))
            .count();
        if storage > STORAGE_BUFFERS {
            return Err(format!("{}: {storage} storage buffers", entry.name));
        }
    }
    Ok(())
}

#[test]
fn every_module_is_valid_and_binds_what_its_table_says() {
    for module in modules::all() {
        if let Err(problem) = check(module) {
            panic!("{}: {problem}", module.name);
        }
    }
}

#[test]
fn shared_structs_have_one_layout() {
    let text = modules::core::FRAME;
    layout_of(text).unwrap();
    // Mutants: a member moved, a member cut in two.
    for (from, to) in [
        ("    strength: vec4<f32>,", "    strength: vec4<f32>, moved: vec4<f32>,"),
        ("    place: vec4<u32>,", "    place: vec2<u32>, more: vec2<u32>,"),
    ] {
        assert!(text.contains(from));
        layout_of(&text.replace(from, to)).expect_err("a moved member must be seen");
    }
}

#[test]
fn shared_constants_have_one_value() {
    let text = MODULES[0].assemble();
    let (module, _) = parsed(&text).unwrap();
    let value = |name: &str| {
        let (_, constant) =
            module.constants.iter().find(|(_, constant)| constant.name.as_deref() == Some(name)).unwrap();
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(naga::Literal::U32(value)) => f64::from(value),
            naga::Expression::Literal(naga::Literal::F32(value)) => f64::from(value),
            ref other => panic!("{name}: {other:?}"),
        }
    };
    macro_rules! same {
        ($($name:ident),*) => { $(assert_eq!(value(stringify!($name)), f64::from(flags::$name));)* };
    }
    same!(
        LAYER_PERSPECTIVE,
        LAYER_ALONG_RAY,
        LAYER_HAS_CLEARED,
        MAPS_NONE,
        MAPS_ONE,
        MAPS_CASCADES,
        MAPS_FACES,
        LIGHT_SUN,
        LIGHT_POINT,
        LIGHT_SPOT,
        FRAME_PERSPECTIVE,
        FRAME_FOG,
        FRAME_GLASS,
        FRAME_DEPTH_ALONG_RAY,
        FRAME_DEPTH_HAS_CLEARED,
        FRAME_ANISOTROPIC,
        MARCH_JITTER,
        MARCH_UNIFORM
    );
    assert_eq!(value("FARTHEST"), f64::from(scatter_kernels::FARTHEST));
}

/// Rung 0b: naga writes every module for Vulkan, Direct3D and Metal.
#[test]
fn every_module_is_written_as_spir_v_hlsl_and_msl() {
    for module in modules::all() {
        let text = module.assemble();
        let (parsed, info) = parsed(&text).unwrap();
        // With the defaults of what may be overridden.
        let (parsed, info) =
            naga::back::pipeline_constants::process_overrides(&parsed, &info, None, &Default::default())
                .unwrap_or_else(|error| panic!("{}: overrides: {error}", module.name));
        let spirv = naga::back::spv::write_vec(&parsed, &info, &naga::back::spv::Options::default(), None)
            .unwrap_or_else(|error| panic!("{}: SPIR-V: {error}", module.name));
        let options = naga::back::hlsl::Options::default();
        let mut hlsl = String::new();
        naga::back::hlsl::Writer::new(&mut hlsl, &options, &naga::back::hlsl::PipelineOptions::default())
            .write(&parsed, &info, None)
            .unwrap_or_else(|error| panic!("{}: HLSL: {error}", module.name));
        let (msl, _) = naga::back::msl::write_string(
            &parsed,
            &info,
            &naga::back::msl::Options { fake_missing_bindings: true, ..Default::default() },
            &naga::back::msl::PipelineOptions::default(),
        )
        .unwrap_or_else(|error| panic!("{}: MSL: {error}", module.name));
        println!(
            "{}: {} bytes of WGSL, {} of SPIR-V, {} of HLSL, {} of MSL",
            module.name,
            text.len(),
            4 * spirv.len(),
            hlsl.len(),
            msl.len()
        );
    }
}
