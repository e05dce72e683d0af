//! Accessors: typed elements in buffer views, sparse or not, with every range checked.

use super::super::error::{GltfFault, MeshFault};
use super::buffers::Buffers;
use super::document::{self, Document, Whole, find};

/// How one number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Component {
    pub(super) fn of_code(code: Whole) -> Option<Self> {
        Some(match code.0 {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5124 => Self::I32,
            5125 => Self::U32,
            5126 => Self::F32,
            5130 => Self::F64,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number at `k`; `bytes` hold it.
    fn read(self, bytes: &[u8], k: usize) -> f64 {
        fn field<const N: usize>(bytes: &[u8], k: usize) -> [u8; N] {
            let mut taken = [0; N];
            taken.copy_from_slice(&bytes[k * N..(k + 1) * N]);
            taken
        }
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(field(bytes, k))),
            Self::U8 => f64::from(bytes[k]),
            Self::I16 => f64::from(i16::from_le_bytes(field(bytes, k))),
            Self::U16 => f64::from(u16::from_le_bytes(field(bytes, k))),
            Self::I32 => f64::from(i32::from_le_bytes(field(bytes, k))),
            Self::U32 => f64::from(u32::from_le_bytes(field(bytes, k))),
            Self::F32 => f64::from(f32::from_le_bytes(field(bytes, k))),
            Self::F64 => f64::from_le_bytes(field(bytes, k)),
        }
    }

    /// What the integer of a normalised number is divided by.
    pub(super) fn largest(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32_767.0,
            Self::U16 => 65_535.0,
            Self::I32 | Self::U32 | Self::F32 | Self::F64 => 1.0,
        }
    }

    fn is_index(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }
}

/// What an accessor is used for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Use {
    /// The element types that make sense here.
    pub(super) types: &'static [&'static str],
    /// Integers are fractions, whether the accessor says so or not.
    pub(super) is_fraction: bool,
}

impl Use {
    pub(super) const POINT: Self = Self::plain(&["VEC3"]);
    pub(super) const PAIR: Self = Self::plain(&["VEC2"]);
    pub(super) const JOINTS: Self = Self::plain(&["VEC4"]);
    pub(super) const MATRIX: Self = Self::plain(&["MAT4"]);
    pub(super) const INDEX: Self = Self::plain(&["SCALAR"]);
    pub(super) const COLOUR: Self = Self {
        types: &["VEC3", "VEC4"],
        is_fraction: true,
    };
    /// Quaternions, or weights of joints.
    pub(super) const ROTATION: Self = Self {
        types: &["VEC4"],
        is_fraction: true,
    };
    pub(super) const WEIGHTS: Self = Self::ROTATION;

    const fn plain(types: &'static [&'static str]) -> Self {
        Self {
            types,
            is_fraction: false,
        }
    }
}

/// A checked accessor.
#[derive(Debug)]
pub(super) struct Accessor<'a> {
    /// Element `i` begins at `i · stride`, and all of them lie inside; without data all are zero.
    data: Option<&'a [u8]>,
    stride: usize,
    size: usize,
    width: usize,
    component: Component,
    is_normalized: bool,
    sparse: Option<Substitutes<'a>>,
    /// Elements.
    pub(super) count: usize,
}

/// Elements that stand in for those of the base.
#[derive(Debug)]
struct Substitutes<'a> {
    /// Rising.
    elements: Vec<usize>,
    /// Tightly packed.
    values: &'a [u8],
}

impl<'a> Accessor<'a> {
    /// Checks that all elements lie in their buffer view, and that in its buffer.
    pub(super) fn new(
        document: &Document,
        buffers: &'a Buffers<'_>,
        index: Whole,
        purpose: Use,
        path: impl FnOnce() -> String,
    ) -> Result<Self, MeshFault> {
        Self::try_new(document, buffers, index, purpose, path).map_err(MeshFault::Gltf)
    }

    fn try_new(
        document: &Document,
        buffers: &'a Buffers<'_>,
        index: Whole,
        purpose: Use,
        path: impl FnOnce() -> String,
    ) -> Result<Self, GltfFault> {
        let accessor = find(&document.accessors, index, path)?;
        let kind = |what| GltfFault::AccessorKind {
            accessor: index.0,
            what,
        };
        if !purpose.types.contains(&accessor.element_type.as_str()) {
            return Err(kind("its elements have the wrong number of components"));
        }
        let width = match accessor.element_type.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let component = Component::of_code(accessor.component_type)
            .ok_or_else(|| kind("its component type is not known"))?;
        let size = width * component.bytes();
        let count = accessor.count.0;
        let out_of_range = || GltfFault::AccessorRange { accessor: index.0 };
        let (data, stride) = match accessor.buffer_view {
            Some(view) => {
                let view = buffers.view(view, || format!("accessors[{}].bufferView", index.0))?;
                let stride = view.stride.unwrap_or(size);
                let data = elements(view.bytes, accessor.byte_offset, count, stride, size);
                (Some(data.ok_or_else(out_of_range)?), stride)
            }
            None if accessor.sparse.is_none() => return Err(kind("it has no data")),
            None if count > buffers.total_bytes() => {
                return Err(kind(
                    "it has more elements without data than the file has bytes",
                ));
            }
            None => (None, size),
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(substitutes(buffers, index, sparse, (count, size))?),
            None => None,
        };
        Ok(Self {
            data,
            stride,
            size,
            width,
            component,
            is_normalized: accessor.normalized || purpose.is_fraction,
            sparse,
            count,
        })
    }

    /// Refuses components that cannot number vertices.
    pub(super) fn into_indices(self, index: Whole) -> Result<Self, MeshFault> {
        if self.component.is_index() {
            return Ok(self);
        }
        Err(MeshFault::Gltf(GltfFault::AccessorKind {
            accessor: index.0,
            what: "its indices are not unsigned integers",
        }))
    }

    /// The first components of an element, zero where it has fewer; integers scaled where the document says so.
    ///
    /// # Panics
    /// When there is no such element.
    pub(super) fn get<const N: usize>(&self, element: usize) -> [f64; N] {
        assert!(element < self.count, "an element of an accessor");
        let bytes = match self.substitute(element) {
            Some(bytes) => bytes,
            None => match self.data {
                Some(data) => &data[element * self.stride..],
                None => return [0.0; N],
            },
        };
        let mut values = [0.0; N];
        for (k, value) in values.iter_mut().enumerate().take(self.width) {
            *value = self.component.read(bytes, k);
            if self.is_normalized {
                *value = (*value / self.component.largest()).max(match self.component {
                    Component::F32 | Component::F64 => f64::NEG_INFINITY,
                    _ => -1.0,
                });
            }
        }
        values
    }

    /// How many components an element has.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    fn substitute(&self, element: usize) -> Option<&'a [u8]> {
        let sparse = self.sparse.as_ref()?;
        let place = sparse.elements.binary_search(&element).ok()?;
        Some(&sparse.values[place * self.size..])
    }
}

/// The bytes of `count` elements from `offset` on, when they are all there.
fn elements(
    bytes: &[u8],
    offset: Whole,
    count: usize,
    stride: usize,
    size: usize,
) -> Option<&[u8]> {
    let Some(last) = count.checked_sub(1) else {
        return Some(&[]);
    };
    let data = bytes.get(offset.0..)?;
    let end = last.checked_mul(stride)?.checked_add(size)?;
    (end <= data.len()).then_some(data)
}

/// Reads what stands in for some of `count` elements of `size` bytes.
fn substitutes<'a>(
    buffers: &'a Buffers<'_>,
    accessor: Whole,
    sparse: &document::Sparse,
    (count, size): (usize, usize),
) -> Result<Substitutes<'a>, GltfFault> {
    let kind = |what| GltfFault::AccessorKind {
        accessor: accessor.0,
        what,
    };
    let path = |part| format!("accessors[{}].sparse.{part}.bufferView", accessor.0);
    let out_of_range = || GltfFault::AccessorRange {
        accessor: accessor.0,
    };
    let component = Component::of_code(sparse.indices.component_type)
        .filter(|component| component.is_index())
        .ok_or_else(|| kind("its sparse indices are not unsigned integers"))?;
    let width = component.bytes();
    let found = buffers.view(sparse.indices.buffer_view, || path("indices"))?;
    let indices = elements(
        found.bytes,
        sparse.indices.byte_offset,
        sparse.count.0,
        width,
        width,
    )
    .ok_or_else(out_of_range)?;
    let found = buffers.view(sparse.values.buffer_view, || path("values"))?;
    let offset = sparse.values.byte_offset;
    let values = elements(found.bytes, offset, sparse.count.0, size, size);
    let values = values.ok_or_else(out_of_range)?;
    let elements: Vec<usize> = (0..sparse.count.0)
        .map(|k| component.read(indices, k) as usize)
        .collect();
    if elements.iter().any(|&element| element >= count) {
        return Err(kind("a sparse index is past its last element"));
    }
    if elements.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(kind("its sparse indices do not rise"));
    }
    Ok(Substitutes { elements, values })
}
