//! Accessors: typed elements in buffers, with stride, normalised integers and sparse replacements.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.6.2 and 3.11 (decoding of quantised data, here in f64);
//! KHR_mesh_quantization. Every bound is checked once, when the accessor is opened; nothing is allocated for its
//! count. Read here rather than by the iterators of the crate `gltf`: those come back empty where bounds are wrong,
//! panic on types that do not fit, and decode to f32. Departure: alignment is not demanded, since reading does not
//! need it.

use gltf::json::Root;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked as Known;

use super::container::{Buffers, sub_slice};
use crate::error::{Checked, Fault};

const CURE: &str = "the file is damaged or was exported wrongly: export it again";

/// What an accessor is opened as.
pub(super) struct Wanted {
    /// For messages: `POSITION is`.
    pub subject: &'static str,
    pub kind: Type,
    pub components: &'static [ComponentType],
    /// Whether integers are fractions; `None`: as the accessor says.
    pub normalized: Option<bool>,
    /// What would be right, for messages.
    pub cure: &'static str,
}

const SMALL: [ComponentType; 5] =
    [ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];

/// Vertex indices.
pub(super) const INDICES: Wanted = Wanted {
    subject: "the indices are",
    kind: Type::Scalar,
    components: &[ComponentType::U8, ComponentType::U16, ComponentType::U32],
    normalized: Some(false),
    cure: "indices are SCALAR of component type 5121, 5123 or 5125",
};

/// Positions of vertices, their displacements, and translations of instances: floats or, as KHR_mesh_quantization has
/// it, bytes or shorts.
pub(super) const fn vec3(subject: &'static str) -> Wanted {
    let cure = "positions are VEC3 of floats, bytes or shorts";
    Wanted { subject, kind: Type::Vec3, components: &SMALL, normalized: None, cure }
}

/// Texture coordinates.
pub(super) const TEX_COORD: Wanted = Wanted {
    subject: "TEXCOORD is",
    kind: Type::Vec2,
    components: &SMALL,
    normalized: None,
    cure: "texture coordinates are VEC2 of floats, bytes or shorts",
};

/// Quaternions of instances; integers are normalised.
pub(super) const ROTATION: Wanted = Wanted {
    subject: "ROTATION is",
    kind: Type::Vec4,
    components: &[ComponentType::F32, ComponentType::I8, ComponentType::I16],
    normalized: Some(true),
    cure: "rotations are VEC4 of floats, signed bytes or signed shorts",
};

/// Joints of a skin.
pub(super) const JOINTS: Wanted = Wanted {
    subject: "JOINTS is",
    kind: Type::Vec4,
    components: &[ComponentType::U8, ComponentType::U16],
    normalized: Some(false),
    cure: "joints are VEC4 of unsigned bytes or shorts",
};

/// Weights of a skin's joints; integers are normalised.
pub(super) const WEIGHTS: Wanted = Wanted {
    subject: "WEIGHTS is",
    kind: Type::Vec4,
    components: &[ComponentType::F32, ComponentType::U8, ComponentType::U16],
    normalized: Some(true),
    cure: "weights are VEC4 of floats, unsigned bytes or shorts",
};

/// Inverse bind matrices.
pub(super) const MATRICES: Wanted = Wanted {
    subject: "inverseBindMatrices is",
    kind: Type::Mat4,
    components: &[ComponentType::F32],
    normalized: Some(false),
    cure: "inverse bind matrices are MAT4 of floats",
};

/// The elements of one accessor, `N` numbers each, checked to lie within their buffers.
pub(super) struct Elements<'a, const N: usize> {
    /// `None`: all zero (an accessor without a buffer view).
    base: Option<Packed<'a>>,
    count: u64,
    sparse: Option<Sparse<'a>>,
}

struct Sparse<'a> {
    /// Strictly increasing, all below the count.
    indices: Vec<u64>,
    values: Packed<'a>,
}

/// Elements at a constant distance in a slice that is long enough.
struct Packed<'a> {
    bytes: &'a [u8],
    stride: usize,
    format: Format,
}

/// How one element is stored.
#[derive(Clone, Copy)]
struct Format {
    component: ComponentType,
    component_count: usize,
    normalized: bool,
}

impl<'a, const N: usize> Elements<'a, N> {
    /// Opens an accessor of `N` components; an error unless type and bounds are right.
    pub(super) fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        accessor_idx: usize,
        wanted: &Wanted,
    ) -> Checked<Self> {
        debug_assert_eq!(wanted.kind.multiplicity(), N, "{}", wanted.subject);
        let accessor = accessor(root, accessor_idx)?;
        let place = place(accessor_idx);
        let component = match (&accessor.type_, &accessor.component_type) {
            (Known::Valid(kind), Known::Valid(component))
                if *kind == wanted.kind && wanted.components.contains(&component.0) =>
            {
                component.0
            }
            (kind, component) => {
                let problem =
                    format!("{} {} of component type {}", wanted.subject, name(kind), code(component));
                return Err(Fault::invalid(place, problem, wanted.cure));
            }
        };
        let normalized = wanted.normalized.unwrap_or(accessor.normalized);
        let format = Format { component, component_count: N, normalized };
        let count = accessor.count.0;
        let base = match accessor.buffer_view {
            None => None,
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                Some(Packed::open(root, buffers, &place, view.value(), offset, count, format)?)
            }
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => Some(Sparse::open(root, buffers, &place, sparse, count, format)?),
        };
        Ok(Self { base, count, sparse })
    }

    /// How many elements there are; they may be fewer bytes than that where no buffer view backs them.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Element `idx < count` as f64.
    #[inline]
    pub(super) fn get(&self, idx: u64) -> [f64; N] {
        debug_assert!(idx < self.count, "the caller checks indices");
        if let Some(sparse) = &self.sparse
            && let Ok(at) = sparse.indices.binary_search(&idx)
        {
            return sparse.values.element(at as u64);
        }
        self.base.as_ref().map_or([0.0; N], |base| base.element(idx))
    }
}

/// The accessor's JSON.
pub(super) fn accessor(root: &Root, accessor_idx: usize) -> Checked<&Accessor> {
    root.accessors.get(accessor_idx).ok_or_else(|| {
        let problem = format!("the asset has {} accessors", root.accessors.len());
        Fault::invalid(place(accessor_idx), problem, CURE)
    })
}

impl<'a> Sparse<'a> {
    fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        place: &str,
        sparse: &gltf::json::accessor::sparse::Sparse,
        count: u64,
        format: Format,
    ) -> Checked<Self> {
        let Known::Valid(component) = &sparse.indices.component_type else {
            let problem = "the sparse indices' component type is unknown";
            return Err(Fault::invalid(place, problem, "sparse indices are of type 5121, 5123 or 5125"));
        };
        let at = |what: &str| format!("{place}.sparse.{what}");
        let scalar = Format { component: component.0, component_count: 1, normalized: false };
        let (view, offset) = (sparse.indices.buffer_view.value(), sparse.indices.byte_offset.0);
        let packed = Packed::open(root, buffers, &at("indices"), view, offset, sparse.count.0, scalar)?;
        let (view, offset) = (sparse.values.buffer_view.value(), sparse.values.byte_offset.0);
        let values = Packed::open(root, buffers, &at("values"), view, offset, sparse.count.0, format)?;
        // The count was checked against the bytes that are there: this allocation is bounded by the file.
        let indices: Vec<u64> = (0..sparse.count.0).map(|i| packed.element::<1>(i)[0] as u64).collect();
        let is_increasing = indices.windows(2).all(|pair| pair[0] < pair[1]);
        if !is_increasing || indices.last().is_some_and(|&last| last >= count) {
            let problem = format!("they do not increase strictly, or pass the count {count}");
            return Err(Fault::invalid(at("indices"), problem, CURE));
        }
        Ok(Self { indices, values })
    }
}

impl<'a> Packed<'a> {
    fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        place: &str,
        view_idx: usize,
        byte_offset: u64,
        count: u64,
        format: Format,
    ) -> Checked<Self> {
        let fault = |problem: String| Fault::invalid(place, problem, CURE);
        let view_bytes = buffers.view(root, view_idx).map_err(|fault| match fault.place() {
            "" => fault.at(place),
            _ => fault,
        })?;
        let size = (format.component.size() * format.component_count) as u64;
        // The view is there: its bytes were found.
        let stride = root.buffer_views[view_idx].byte_stride.map_or(size, |stride| stride.0 as u64);
        if stride < size {
            return Err(fault(format!("byteStride {stride} is less than an element's {size} bytes")));
        }
        // The last element need not be followed by a whole stride.
        let length = match count.checked_sub(1) {
            None => Some(0),
            Some(gaps) => stride.checked_mul(gaps).and_then(|bytes| bytes.checked_add(size)),
        };
        let end = length.and_then(|length| byte_offset.checked_add(length));
        let bytes = sub_slice(view_bytes, byte_offset, end).ok_or_else(|| {
            let held = view_bytes.len();
            fault(format!(
                "{count} elements from byte {byte_offset} on do not fit into the view's {held} bytes"
            ))
        })?;
        // The stride of a single element may be anything.
        Ok(Self { bytes, stride: usize::try_from(stride).unwrap_or(0), format })
    }

    #[inline]
    fn element<const N: usize>(&self, idx: u64) -> [f64; N] {
        let Format { component, component_count, normalized } = self.format;
        let start = idx as usize * self.stride;
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().take(component_count).enumerate() {
            // `open` checked the bounds: a miss would be a fault of ours, and reads as zero.
            let bytes = self.bytes.get(start + i * component.size()..).unwrap_or_default();
            *value = read(component, bytes, normalized);
        }
        values
    }
}

/// The first component in `bytes`; normalised integers become c/max, at least −1.
#[inline]
fn read(component: ComponentType, bytes: &[u8], normalized: bool) -> f64 {
    let two = || bytes.first_chunk().copied().unwrap_or_default();
    let four = || bytes.first_chunk().copied().unwrap_or_default();
    let one = || bytes.first().copied().unwrap_or_default();
    let (value, max) = match component {
        ComponentType::I8 => (f64::from(one() as i8), 127.0),
        ComponentType::U8 => (f64::from(one()), 255.0),
        ComponentType::I16 => (f64::from(i16::from_le_bytes(two())), 32767.0),
        ComponentType::U16 => (f64::from(u16::from_le_bytes(two())), 65535.0),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(four())), 4294967295.0),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(four())),
    };
    if normalized { (value / max).max(-1.0) } else { value }
}

fn name(kind: &Known<Type>) -> &'static str {
    match kind {
        Known::Valid(Type::Scalar) => "SCALAR",
        Known::Valid(Type::Vec2) => "VEC2",
        Known::Valid(Type::Vec3) => "VEC3",
        Known::Valid(Type::Vec4) => "VEC4",
        Known::Valid(Type::Mat2) => "MAT2",
        Known::Valid(Type::Mat3) => "MAT3",
        Known::Valid(Type::Mat4) => "MAT4",
        Known::Invalid => "of an unknown type and",
    }
}

fn code(component: &Known<gltf::json::accessor::GenericComponentType>) -> String {
    match component {
        Known::Valid(component) => component.0.as_gl_enum().to_string(),
        Known::Invalid => "that is unknown".to_owned(),
    }
}

fn place(accessor_idx: usize) -> String {
    format!("accessors[{accessor_idx}]")
}
