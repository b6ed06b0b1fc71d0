//! Texels: as they are given, and as a map keeps them.

use std::fmt;
use std::ops::Range;
use std::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, Ordering::Relaxed};

use super::Wrap;

/// The precision of a map's texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelKind {
    /// 8-bit integers.
    U8,
    /// 16-bit integers.
    U16,
    /// 32-bit floats.
    F32,
}

impl TexelKind {
    /// Bytes per texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::F32 => 4,
        }
    }

    /// The stored value that means height 1.
    pub fn unit(self) -> f32 {
        match self {
            Self::U8 => 255.0,
            Self::U16 => 65535.0,
            Self::F32 => 1.0,
        }
    }

    /// 1 / [`unit`](Self::unit).
    pub(crate) fn per_unit(self) -> f32 {
        match self {
            Self::U8 => 1.0 / 255.0,
            Self::U16 => 1.0 / 65535.0,
            Self::F32 => 1.0,
        }
    }
}

/// `8-bit`, `16-bit` or `float`.
impl fmt::Display for TexelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::U8 => "8-bit",
            Self::U16 => "16-bit",
            Self::F32 => "float",
        })
    }
}

/// Heights in the precision they came in, bottom row first.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// h = texel / 255.
    U8(Vec<u8>),
    /// h = texel / 65535.
    U16(Vec<u16>),
    /// h as stored (half-float maps are widened).
    F32(Vec<f32>),
}

impl Texels {
    /// The precision.
    pub fn kind(&self) -> TexelKind {
        match self {
            Self::U8(_) => TexelKind::U8,
            Self::U16(_) => TexelKind::U16,
            Self::F32(_) => TexelKind::F32,
        }
    }

    /// Number of texels.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(t) => t.len(),
            Self::U16(t) => t.len(),
            Self::F32(t) => t.len(),
        }
    }

    /// True for no texels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes per texel.
    pub fn texel_bytes(&self) -> usize {
        self.kind().bytes()
    }

    /// The stored value that means height 1.
    pub fn unit(&self) -> f32 {
        self.kind().unit()
    }

    /// The first height that is NaN or infinite: its index and value.
    pub(super) fn not_finite(&self) -> Option<(usize, f32)> {
        let Self::F32(t) = self else { return None };
        let index = t.iter().position(|h| !h.is_finite())?;
        Some((index, t[index]))
    }
}

/// A type of texel, and the atomic that a map keeps it in. Loads and stores are relaxed: on every architecture with
/// Embree they cost what plain ones do.
pub(crate) trait Texel: Copy + PartialOrd + Into<f32> + Send + Sync {
    /// Of the same size and layout.
    type Atomic: Send + Sync;
    fn into_atomic(self) -> Self::Atomic;
    fn load(from: &Self::Atomic) -> Self;
    fn store(self, to: &Self::Atomic);
}

impl Texel for u8 {
    type Atomic = AtomicU8;
    fn into_atomic(self) -> AtomicU8 {
        AtomicU8::new(self)
    }
    #[inline(always)]
    fn load(from: &AtomicU8) -> Self {
        from.load(Relaxed)
    }
    #[inline(always)]
    fn store(self, to: &AtomicU8) {
        to.store(self, Relaxed);
    }
}

impl Texel for u16 {
    type Atomic = AtomicU16;
    fn into_atomic(self) -> AtomicU16 {
        AtomicU16::new(self)
    }
    #[inline(always)]
    fn load(from: &AtomicU16) -> Self {
        from.load(Relaxed)
    }
    #[inline(always)]
    fn store(self, to: &AtomicU16) {
        to.store(self, Relaxed);
    }
}

impl Texel for f32 {
    type Atomic = AtomicU32;
    fn into_atomic(self) -> AtomicU32 {
        AtomicU32::new(self.to_bits())
    }
    #[inline(always)]
    fn load(from: &AtomicU32) -> Self {
        Self::from_bits(from.load(Relaxed))
    }
    #[inline(always)]
    fn store(self, to: &AtomicU32) {
        to.store(self.to_bits(), Relaxed);
    }
}

/// The texels of a map of width x height: (width + 1) x (height + 1) of them, one more column and row as the wrap modes
/// continue them, so that the four corners of every cell lie at fixed offsets; then [`Self::TAIL`] more, so that nine
/// texels from any one on, and a 32-bit gather of the last 8-bit texel, stay inside.
#[derive(Debug)]
pub(crate) enum StoredTexels {
    U8(Box<[AtomicU8]>),
    U16(Box<[AtomicU16]>),
    /// Bits of floats.
    F32(Box<[AtomicU32]>),
}

impl StoredTexels {
    /// Texels stored after the last one.
    const TAIL: usize = 16;

    /// Stores `texels`, width * height of them.
    pub fn new(texels: Texels, width: usize, height: usize, wrap: [Wrap; 2]) -> Self {
        match texels {
            Texels::U8(t) => Self::U8(padded(&t, 0, width, height, wrap)),
            Texels::U16(t) => Self::U16(padded(&t, 0, width, height, wrap)),
            Texels::F32(t) => Self::F32(padded(&t, 0.0, width, height, wrap)),
        }
    }

    /// The precision.
    pub fn kind(&self) -> TexelKind {
        match self {
            Self::U8(_) => TexelKind::U8,
            Self::U16(_) => TexelKind::U16,
            Self::F32(_) => TexelKind::F32,
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::U8(t) => size_of_val(&t[..]),
            Self::U16(t) => size_of_val(&t[..]),
            Self::F32(t) => size_of_val(&t[..]),
        }
    }

    /// Texel `index` as stored.
    pub fn get(&self, index: usize) -> f32 {
        match self {
            Self::U8(t) => u8::load(&t[index]).into(),
            Self::U16(t) => u16::load(&t[index]).into(),
            Self::F32(t) => f32::load(&t[index]),
        }
    }

    /// The texels at the corners (0,0) (1,0) (0,1) (1,1) of the cell at `index`, as stored.
    #[inline(always)]
    pub fn cell(&self, index: usize, stride: usize) -> [f32; 4] {
        #[inline(always)]
        fn corners<T: Texel>(t: &[T::Atomic], index: usize, stride: usize) -> [f32; 4] {
            // One check for all four.
            let t = &t[index..index + stride + 2];
            [
                T::load(&t[0]).into(),
                T::load(&t[1]).into(),
                T::load(&t[stride]).into(),
                T::load(&t[stride + 1]).into(),
            ]
        }
        match self {
            Self::U8(t) => corners::<u8>(t, index, stride),
            Self::U16(t) => corners::<u16>(t, index, stride),
            Self::F32(t) => corners::<f32>(t, index, stride),
        }
    }

    /// The smallest and largest of a run of texels, as stored; `None` for an empty one.
    pub fn range(&self, run: Range<usize>) -> Option<(f32, f32)> {
        fn range<T: Texel>(run: &[T::Atomic]) -> Option<(f32, f32)> {
            let (mut low, mut high) = (T::load(run.first()?), T::load(run.first()?));
            for h in run[1..].iter().map(T::load) {
                low = if h < low { h } else { low };
                high = if h > high { h } else { high };
            }
            Some((low.into(), high.into()))
        }
        match self {
            Self::U8(t) => range::<u8>(&t[run]),
            Self::U16(t) => range::<u16>(&t[run]),
            Self::F32(t) => range::<f32>(&t[run]),
        }
    }

    /// Copies the texels from `start` on to `out`, as stored.
    pub fn copy(&self, start: usize, out: &mut [f32]) {
        fn copy<T: Texel>(from: &[T::Atomic], out: &mut [f32]) {
            for (from, out) in from.iter().zip(out) {
                *out = T::load(from).into();
            }
        }
        let run = start..start + out.len();
        match self {
            Self::U8(t) => copy::<u8>(&t[run], out),
            Self::U16(t) => copy::<u16>(&t[run], out),
            Self::F32(t) => copy::<f32>(&t[run], out),
        }
    }
}

/// The texel of a side of `n` that stands once more after the last one.
pub(super) fn repeated(wrap: Wrap, n: usize) -> usize {
    if wrap == Wrap::Repeat { 0 } else { n - 1 }
}

fn padded<T: Texel>(
    t: &[T],
    zero: T,
    width: usize,
    height: usize,
    [across, up]: [Wrap; 2],
) -> Box<[T::Atomic]> {
    let mut out = Vec::with_capacity((width + 1) * (height + 1) + StoredTexels::TAIL);
    for j in (0..height).chain([repeated(up, height)]) {
        let row = &t[j * width..(j + 1) * width];
        out.extend(row.iter().map(|h| h.into_atomic()));
        out.push(row[repeated(across, width)].into_atomic());
    }
    out.extend((0..StoredTexels::TAIL).map(|_| zero.into_atomic()));
    out.into_boxed_slice()
}
