//! Accessors: typed elements in buffers, with stride, normalised integers and sparse replacements.
//!
//! Source: Khronos, glTF 2.0 specification, sections 3.6.2 and 3.11 (decoding of quantised data, here in f64);
//! KHR_mesh_quantization. Every bound is checked once, when the accessor is opened; nothing is allocated for its
//! count. Departure: alignment is not demanded, since reading does not need it.

use super::container::Buffers;
use super::schema::{Accessor, Root};
use crate::error::{Checked, Fault};

const CURE: &str = "the file is damaged or was exported wrongly: export it again";

/// The elements of one accessor: up to three numbers each, checked to lie within their buffers.
pub(super) struct Elements<'a> {
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
    component: Component,
    /// 1 (SCALAR) or 3 (VEC3).
    component_count: usize,
    normalized: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl<'a> Elements<'a> {
    /// Opens POSITION: VEC3 of floats or, as KHR_mesh_quantization has it, of bytes or shorts.
    pub(super) fn positions(root: &Root, buffers: &'a Buffers<'_>, accessor_idx: usize) -> Checked<Self> {
        let accessor = accessor(root, accessor_idx)?;
        let component = Component::new(accessor.component_type);
        if accessor.kind != "VEC3" || matches!(component, None | Some(Component::U32)) {
            let problem =
                format!("POSITION is {} of component type {}", accessor.kind, accessor.component_type);
            return Err(Fault::invalid(
                place(accessor_idx),
                problem,
                "positions are VEC3 of floats, bytes or shorts",
            ));
        }
        let component = component.unwrap_or(Component::F32);
        Self::open(
            root,
            buffers,
            accessor_idx,
            accessor,
            Format { component, component_count: 3, normalized: accessor.normalized },
        )
    }

    /// Opens vertex indices: SCALAR of unsigned integers.
    pub(super) fn indices(root: &Root, buffers: &'a Buffers<'_>, accessor_idx: usize) -> Checked<Self> {
        let accessor = accessor(root, accessor_idx)?;
        let component =
            unsigned(accessor.component_type).filter(|_| accessor.kind == "SCALAR").ok_or_else(|| {
                let problem = format!(
                    "the indices are {} of component type {}",
                    accessor.kind, accessor.component_type
                );
                Fault::invalid(
                    place(accessor_idx),
                    problem,
                    "indices are SCALAR of component type 5121, 5123 or 5125",
                )
            })?;
        Self::open(
            root,
            buffers,
            accessor_idx,
            accessor,
            Format { component, component_count: 1, normalized: false },
        )
    }

    fn open(
        root: &Root,
        buffers: &'a Buffers<'_>,
        accessor_idx: usize,
        accessor: &Accessor,
        format: Format,
    ) -> Checked<Self> {
        let place = place(accessor_idx);
        let base = match accessor.buffer_view {
            None => None,
            Some(view) => {
                Some(Packed::open(root, buffers, &place, view, accessor.byte_offset, accessor.count, format)?)
            }
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => {
                let component = unsigned(sparse.indices.component_type).ok_or_else(|| {
                    let problem =
                        format!("sparse indices of component type {}", sparse.indices.component_type);
                    Fault::invalid(place.as_str(), problem, "sparse indices are of type 5121, 5123 or 5125")
                })?;
                let at = |what: &str| format!("{place}.sparse.{what}");
                let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
                let scalar = Format { component, component_count: 1, normalized: false };
                let packed = Packed::open(root, buffers, &at("indices"), view, offset, sparse.count, scalar)?;
                let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
                let values = Packed::open(root, buffers, &at("values"), view, offset, sparse.count, format)?;
                // The count was checked against the bytes that are there: this allocation is bounded by the file.
                let indices: Vec<u64> = (0..sparse.count).map(|i| packed.element(i)[0] as u64).collect();
                let is_increasing = indices.windows(2).all(|pair| pair[0] < pair[1]);
                if !is_increasing || indices.last().is_some_and(|&last| last >= accessor.count) {
                    let problem =
                        format!("they do not increase strictly, or pass the count {}", accessor.count);
                    return Err(Fault::invalid(at("indices"), problem, CURE));
                }
                Some(Sparse { indices, values })
            }
        };
        Ok(Self { base, count: accessor.count, sparse })
    }

    /// How many elements there are; they may be fewer bytes than that where no buffer view backs them.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// Element `idx < count` as f64; a scalar stands in the first place.
    pub(super) fn get(&self, idx: u64) -> [f64; 3] {
        debug_assert!(idx < self.count, "the caller checks indices");
        if let Some(sparse) = &self.sparse
            && let Ok(at) = sparse.indices.binary_search(&idx)
        {
            return sparse.values.element(at as u64);
        }
        self.base.as_ref().map_or([0.0; 3], |base| base.element(idx))
    }
}

/// The accessor's JSON.
pub(super) fn accessor(root: &Root, accessor_idx: usize) -> Checked<&Accessor> {
    root.accessors.get(accessor_idx).ok_or_else(|| {
        let problem = format!("the asset has {} accessors", root.accessors.len());
        Fault::invalid(place(accessor_idx), problem, CURE)
    })
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
        let view = root.buffer_views.get(view_idx).ok_or_else(|| {
            fault(format!("bufferView {view_idx}, but the asset has {}", root.buffer_views.len()))
        })?;
        let buffer = buffers.bytes(view.buffer)?;
        let slice = |bytes: &'a [u8], start: u64, end: Option<u64>| {
            bytes.get(usize::try_from(start).ok()?..usize::try_from(end?).ok()?)
        };
        let end = view.byte_offset.checked_add(view.byte_length);
        let view_bytes = slice(buffer, view.byte_offset, end).ok_or_else(|| {
            let (offset, length) = (view.byte_offset, view.byte_length);
            let problem = format!("{length} bytes from {offset} on do not fit into {} bytes", buffer.len());
            Fault::invalid(format!("bufferViews[{view_idx}]"), problem, CURE)
        })?;
        let size = (format.component.size() * format.component_count) as u64;
        let stride = view.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(fault(format!("byteStride {stride} is less than an element's {size} bytes")));
        }
        // The last element need not be followed by a whole stride.
        let length = match count.checked_sub(1) {
            None => Some(0),
            Some(gaps) => stride.checked_mul(gaps).and_then(|bytes| bytes.checked_add(size)),
        };
        let end = length.and_then(|length| byte_offset.checked_add(length));
        let bytes = slice(view_bytes, byte_offset, end).ok_or_else(|| {
            let held = view_bytes.len();
            fault(format!(
                "{count} elements from byte {byte_offset} on do not fit into the view's {held} bytes"
            ))
        })?;
        // The stride of a single element may be anything.
        Ok(Self { bytes, stride: usize::try_from(stride).unwrap_or(0), format })
    }

    fn element(&self, idx: u64) -> [f64; 3] {
        let Format { component, component_count, normalized } = self.format;
        let start = idx as usize * self.stride;
        let mut values = [0.0; 3];
        for (i, value) in values.iter_mut().take(component_count).enumerate() {
            // `open` checked the bounds: a miss would be a fault of ours, and reads as zero.
            let bytes = self.bytes.get(start + i * component.size()..).unwrap_or_default();
            *value = component.read(bytes, normalized);
        }
        values
    }
}

impl Component {
    fn new(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The first component in `bytes`; normalised integers become c/max, at least −1.
    fn read(self, bytes: &[u8], normalized: bool) -> f64 {
        let two = || bytes.first_chunk().copied().unwrap_or_default();
        let four = || bytes.first_chunk().copied().unwrap_or_default();
        let one = || bytes.first().copied().unwrap_or_default();
        let (value, max) = match self {
            Self::I8 => (f64::from(one() as i8), 127.0),
            Self::U8 => (f64::from(one()), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes(two())), 32767.0),
            Self::U16 => (f64::from(u16::from_le_bytes(two())), 65535.0),
            Self::U32 => (f64::from(u32::from_le_bytes(four())), 4294967295.0),
            Self::F32 => return f64::from(f32::from_le_bytes(four())),
        };
        if normalized { (value / max).max(-1.0) } else { value }
    }
}

fn unsigned(code: u64) -> Option<Component> {
    Component::new(code).filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
}

fn place(accessor_idx: usize) -> String {
    format!("accessors[{accessor_idx}]")
}
