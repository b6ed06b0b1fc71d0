//! How the pairs of a level are stored.

use std::sync::atomic::{AtomicU16, AtomicU32, Ordering::Relaxed};

/// Smallest and largest.
pub type Bounds<T> = (T, T);

/// The pairs of one level, row by row, then [`Entries::TAIL`] of zero, so that a 32-bit gather of the last pair stays
/// inside.
#[derive(Debug)]
pub(crate) enum Entries {
    /// Low byte the smallest, high byte the largest.
    U8(Box<[AtomicU16]>),
    /// Low half the smallest, high half the largest.
    U16(Box<[AtomicU32]>),
    /// Bits of two floats per pair, the smallest first. A reader may see one of them before and one after an edit.
    F32(Box<[AtomicU32]>),
}

/// A type of texel, and how two are packed into one entry.
pub trait Pack: Copy + PartialOrd + Send + Sync {
    type Packed: Copy + Send + Sync + Default;
    fn pack(bounds: Bounds<Self>) -> Self::Packed;
    fn unpack(packed: Self::Packed) -> Bounds<Self>;
    /// `packed` as stored; the tail is already there.
    fn entries(packed: Vec<Self::Packed>) -> Entries;
}

impl Pack for u8 {
    type Packed = u16;
    #[inline(always)]
    fn pack((low, high): (u8, u8)) -> u16 {
        u16::from(low) | u16::from(high) << 8
    }
    #[inline(always)]
    fn unpack(packed: u16) -> (u8, u8) {
        (packed as u8, (packed >> 8) as u8)
    }
    fn entries(packed: Vec<u16>) -> Entries {
        Entries::U8(packed.into_iter().map(AtomicU16::new).collect())
    }
}

impl Pack for u16 {
    type Packed = u32;
    #[inline(always)]
    fn pack((low, high): (u16, u16)) -> u32 {
        u32::from(low) | u32::from(high) << 16
    }
    #[inline(always)]
    fn unpack(packed: u32) -> (u16, u16) {
        (packed as u16, (packed >> 16) as u16)
    }
    fn entries(packed: Vec<u32>) -> Entries {
        Entries::U16(packed.into_iter().map(AtomicU32::new).collect())
    }
}

impl Pack for f32 {
    type Packed = [u32; 2];
    /// Zeros lose their sign: which of two equal zeros is found first must not matter.
    #[inline(always)]
    fn pack((low, high): (f32, f32)) -> [u32; 2] {
        [(low + 0.0).to_bits(), (high + 0.0).to_bits()]
    }
    #[inline(always)]
    fn unpack([low, high]: [u32; 2]) -> (f32, f32) {
        (f32::from_bits(low), f32::from_bits(high))
    }
    fn entries(packed: Vec<[u32; 2]>) -> Entries {
        let bits = packed.into_flattened();
        Entries::F32(bits.into_iter().map(AtomicU32::new).collect())
    }
}

impl Entries {
    /// Pairs of zeros after the last one.
    pub const TAIL: usize = 2;

    /// Pair `index`.
    #[inline]
    pub fn get(&self, index: usize) -> Bounds<f32> {
        match self {
            Self::U8(e) => {
                let (low, high) = u8::unpack(e[index].load(Relaxed));
                (low.into(), high.into())
            }
            Self::U16(e) => {
                let (low, high) = u16::unpack(e[index].load(Relaxed));
                (low.into(), high.into())
            }
            Self::F32(e) => {
                let pair = &e[2 * index..2 * index + 2];
                f32::unpack([pair[0].load(Relaxed), pair[1].load(Relaxed)])
            }
        }
    }

    /// Replaces pair `index`; for integers, `low` and `high` are integers of the type.
    pub fn set(&self, index: usize, (low, high): Bounds<f32>) {
        match self {
            Self::U8(e) => e[index].store(u8::pack((low as u8, high as u8)), Relaxed),
            Self::U16(e) => e[index].store(u16::pack((low as u16, high as u16)), Relaxed),
            Self::F32(e) => {
                let pair = f32::pack((low, high));
                e[2 * index].store(pair[0], Relaxed);
                e[2 * index + 1].store(pair[1], Relaxed);
            }
        }
    }

    /// Pairs, those after the last one not counted. There is at least one.
    #[inline(always)]
    pub fn count(&self) -> usize {
        let all = match self {
            Self::U8(e) => e.len(),
            Self::U16(e) => e.len(),
            Self::F32(e) => e.len() / 2,
        };
        all - Self::TAIL
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        match self {
            Self::U8(e) => size_of_val(&e[..]),
            Self::U16(e) | Self::F32(e) => size_of_val(&e[..]),
        }
    }
}
