//! Accessors (sections 3.6.2 and 3.11): typed elements in buffer views, sparse ones too, each checked against its bytes when it is
//! opened. Elements are read one by one, so that a mesh takes what it needs of an accessor that many share.

use std::cell::Cell;
use std::fmt;

use super::buffers::Buffers;
use super::document::{self, Document, Shape};
use super::{LoadMeshErrorKind, malformed};

/// What a number is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene::load) enum Kind {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// What an attribute may be stored as: the core specification's types and those of KHR_mesh_quantization.
pub(in crate::scene::load) const FLOATS: &[Kind] = &[Kind::F32];
pub(in crate::scene::load) const QUANTIZED: &[Kind] =
    &[Kind::F32, Kind::I8, Kind::U8, Kind::I16, Kind::U16];
pub(in crate::scene::load) const SIGNED: &[Kind] = &[Kind::F32, Kind::I8, Kind::I16];
pub(in crate::scene::load) const WEIGHTS: &[Kind] = &[Kind::F32, Kind::U8, Kind::U16];
pub(in crate::scene::load) const JOINTS: &[Kind] = &[Kind::U8, Kind::U16];
const INDICES: &[Kind] = &[Kind::U8, Kind::U16, Kind::U32];

impl Kind {
    fn of(code: u32) -> Option<Self> {
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

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number as a float; where integers are `normalized`, as a fraction of their type's largest (section 3.11).
    pub fn to_float(self, number: f32, normalized: bool) -> f32 {
        let largest = match self {
            Self::I8 => f32::from(i8::MAX),
            Self::U8 => f32::from(u8::MAX),
            Self::I16 => f32::from(i16::MAX),
            Self::U16 => f32::from(u16::MAX),
            Self::U32 | Self::F32 => return number,
        };
        if normalized {
            (number / largest).max(-1.0)
        } else {
            number
        }
    }

    /// The number at the start of `bytes`, 0 if there are too few.
    fn read(self, bytes: &[u8]) -> f32 {
        match self {
            Self::I8 => bytes.first().map_or(0.0, |&b| f32::from(b.cast_signed())),
            Self::U8 => bytes.first().map_or(0.0, |&b| f32::from(b)),
            Self::I16 => bytes
                .first_chunk()
                .map_or(0.0, |b| f32::from(i16::from_le_bytes(*b))),
            Self::U16 => bytes
                .first_chunk()
                .map_or(0.0, |b| f32::from(u16::from_le_bytes(*b))),
            Self::U32 => bytes
                .first_chunk()
                .map_or(0.0, |b| u32::from_le_bytes(*b) as f32),
            Self::F32 => bytes.first_chunk().map_or(0.0, |b| f32::from_le_bytes(*b)),
        }
    }

    /// The same of an unsigned type, exactly.
    fn read_index(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => bytes.first().map_or(0, |&b| b.into()),
            Self::U16 => bytes
                .first_chunk()
                .map_or(0, |b| u16::from_le_bytes(*b).into()),
            _ => bytes.first_chunk().map_or(0, |b| u32::from_le_bytes(*b)),
        }
    }
}

/// As the specification calls it.
impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::I8 => "byte",
            Self::U8 => "unsigned byte",
            Self::I16 => "short",
            Self::U16 => "unsigned short",
            Self::U32 => "unsigned int",
            Self::F32 => "float",
        })
    }
}

impl Shape {
    fn components(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
            Self::Vec4 | Self::Mat2 => 4,
            Self::Mat3 => 9,
            Self::Mat4 => 16,
        }
    }
}

/// Opens the accessors of a document.
pub(super) struct Accessors<'a> {
    document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    /// Elements that may still be made of nothing: those of accessors without bytes.
    zeros: Cell<usize>,
}

/// An accessor whose elements all lie inside its bytes.
#[derive(Clone, Copy)]
pub(super) struct Accessor<'a> {
    kind: Kind,
    normalized: bool,
    count: usize,
    base: Option<Run<'a>>,
    sparse: Option<Sparse<'a>>,
}

/// Elements at equal distances, all inside of `bytes`.
#[derive(Clone, Copy)]
struct Run<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Elements that replace others; the indices rise.
#[derive(Clone, Copy)]
struct Sparse<'a> {
    count: usize,
    kind: Kind,
    indices: Run<'a>,
    values: Run<'a>,
}

impl Run<'_> {
    fn at(&self, element: usize, byte: usize) -> &[u8] {
        self.bytes
            .get(element * self.stride + byte..)
            .unwrap_or_default()
    }
}

impl Sparse<'_> {
    fn index(&self, i: usize) -> usize {
        self.kind.read_index(self.indices.at(i, 0)) as usize
    }

    /// Which of its values stands for this element.
    fn find(&self, element: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.index(middle) < element {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.count && self.index(low) == element).then_some(low)
    }
}

impl Accessor<'_> {
    pub fn count(&self) -> usize {
        self.count
    }

    /// The same with integers as fractions, whatever the accessor says of them.
    pub fn as_fractions(self) -> Self {
        Self {
            normalized: true,
            ..self
        }
    }

    /// Element `index` as floats, `N` as it was opened for.
    pub fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        let element = self.element(index);
        std::array::from_fn(|i| {
            let number = element.map_or(0.0, |(run, at)| {
                self.kind.read(run.at(at, i * self.kind.bytes()))
            });
            self.kind.to_float(number, self.normalized)
        })
    }

    /// Element `index` of indices.
    pub fn index(&self, index: usize) -> u32 {
        self.element(index)
            .map_or(0, |(run, at)| self.kind.read_index(run.at(at, 0)))
    }

    /// Where the element lies, if it is not zero.
    fn element(&self, index: usize) -> Option<(&Run<'_>, usize)> {
        if let Some(sparse) = &self.sparse
            && let Some(i) = sparse.find(index)
        {
            return Some((&sparse.values, i));
        }
        self.base.as_ref().map(|base| (base, index))
    }
}

impl<'a> Accessors<'a> {
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>) -> Self {
        /// What any file may have.
        const FREE: usize = 1 << 22;
        Self {
            document,
            buffers,
            zeros: Cell::new(buffers.len().saturating_add(FREE)),
        }
    }

    /// Accessor number `index`, which `what` names, of elements with `N` components of one of these types.
    pub fn open<const N: usize>(
        &self,
        index: usize,
        kinds: &[Kind],
        what: &str,
    ) -> Result<Accessor<'a>, LoadMeshErrorKind> {
        self.open_shaped(index, shape_of(N), kinds, what)
    }

    /// The same of indices.
    pub fn open_indices(
        &self,
        index: usize,
        what: &str,
    ) -> Result<Accessor<'a>, LoadMeshErrorKind> {
        self.open_shaped(index, Shape::Scalar, INDICES, what)
    }

    fn open_shaped(
        &self,
        index: usize,
        shape: Shape,
        kinds: &[Kind],
        what: &str,
    ) -> Result<Accessor<'a>, LoadMeshErrorKind> {
        let accessor = &self.document.accessors[index];
        let what = format!("{what} (accessor {index})");
        let found = Kind::of(accessor.component_type);
        let kind = found.filter(|kind| kinds.contains(kind) && accessor.shape == shape);
        let kind = kind.ok_or_else(|| {
            let found = found.map_or_else(
                || format!("type {}", accessor.component_type),
                |k| k.to_string(),
            );
            let expected: Vec<_> = kinds.iter().map(Kind::to_string).collect();
            let problem = format!(
                "found {:?} of {found}; expected {shape:?} of {}",
                accessor.shape,
                expected.join(" or ")
            );
            malformed(&what, problem)
        })?;
        let size = kind.bytes() * shape.components();
        let count = accessor.count;
        let base = match accessor.buffer_view {
            Some(view) => Some(self.run(view, accessor.byte_offset, count, size, &what)?),
            None => {
                self.take_zeros(count, &what)?;
                None
            }
        };
        let sparse = accessor.sparse.as_ref();
        let sparse = sparse
            .map(|s| self.sparse(s, count, size, &what))
            .transpose()?;
        Ok(Accessor {
            kind,
            // Joints are indices, whatever is said of them.
            normalized: accessor.normalized && kinds != JOINTS,
            count,
            base,
            sparse,
        })
    }

    fn sparse(
        &self,
        sparse: &document::Sparse,
        count: usize,
        size: usize,
        what: &str,
    ) -> Result<Sparse<'a>, LoadMeshErrorKind> {
        let document::Sparse {
            count: replaced,
            indices,
            values,
        } = sparse;
        let what = format!("{what}, sparse");
        let kind = Kind::of(indices.component_type).filter(|kind| INDICES.contains(kind));
        let kind = kind.ok_or_else(|| {
            let problem = format!(
                "indices of type {}; expected an unsigned type",
                indices.component_type
            );
            malformed(&what, problem)
        })?;
        let sparse = Sparse {
            count: *replaced,
            kind,
            indices: self.run(
                indices.buffer_view,
                indices.byte_offset,
                *replaced,
                kind.bytes(),
                &what,
            )?,
            values: self.run(
                values.buffer_view,
                values.byte_offset,
                *replaced,
                size,
                &what,
            )?,
        };
        let mut next = 0;
        for index in (0..*replaced).map(|i| sparse.index(i)) {
            if index < next || index >= count {
                let problem =
                    format!("index {index}; expected indices that rise and are below {count}");
                return Err(malformed(&what, problem));
            }
            next = index + 1;
        }
        Ok(sparse)
    }

    /// `count` elements of `size` bytes from `offset` of a view on.
    fn run(
        &self,
        view: u32,
        offset: usize,
        count: usize,
        size: usize,
        what: &str,
    ) -> Result<Run<'a>, LoadMeshErrorKind> {
        let view = view as usize;
        let bytes = self.buffers.view(view)?;
        let stride = self.buffers.stride(view).unwrap_or(size);
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))
            .and_then(|n| n.checked_add(offset));
        match end {
            Some(end) if end <= bytes.len() && stride >= size => Ok(Run {
                bytes: &bytes[offset..end],
                stride,
            }),
            _ => {
                let length = bytes.len();
                let problem = format!(
                    "{count} elements of {size} bytes, {stride} apart, from byte {offset} on do not lie inside buffer view {view} of {length} bytes"
                );
                Err(malformed(what, problem))
            }
        }
    }

    fn take_zeros(&self, count: usize, what: &str) -> Result<(), LoadMeshErrorKind> {
        let left = self.zeros.get().checked_sub(count).ok_or_else(|| {
            malformed(
                what,
                format!("{count} elements without bytes; that is more than the file can mean"),
            )
        })?;
        self.zeros.set(left);
        Ok(())
    }
}

/// The shape of elements with so many components.
fn shape_of(components: usize) -> Shape {
    match components {
        2 => Shape::Vec2,
        3 => Shape::Vec3,
        4 => Shape::Vec4,
        16 => Shape::Mat4,
        _ => Shape::Scalar,
    }
}
