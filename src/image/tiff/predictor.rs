//! Predictors: what compressed samples were before their differences were taken.

use super::Fault;
use super::codec::Codec;
use super::directory::Order;
use super::layout::Kind;

/// How the samples of a row are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Predictor {
    None,
    /// Differences to the pixel on the left.
    Horizontal,
    /// Floats, byte by byte: all highest bytes first, then differences of bytes.
    Float,
}

const EXPECTED: &str =
    "no predictor, 2 for samples of 8, 16, 32 or 64 bits, or 3 for floats is expected";

impl Predictor {
    pub fn of(number: u64, codec: &Codec, kind: Kind, bits: usize) -> Result<Self, Fault> {
        match (number, kind, bits) {
            // As everywhere: the tag belongs to the compression, and some write it without.
            _ if !codec.has_predictor() => Ok(Self::None),
            (1, ..) => Ok(Self::None),
            (2, _, 8 | 16 | 32 | 64) => Ok(Self::Horizontal),
            // Some write it for large integers, too.
            (3, _, 16 | 24 | 32 | 64) => Ok(Self::Float),
            (2 | 3, ..) => {
                let found = format!("predictor {number} on {bits}-bit samples");
                Err(Fault::Unsupported(found, EXPECTED))
            }
            (other, ..) => Err(Fault::Unsupported(format!("predictor {other}"), EXPECTED)),
        }
    }

    /// Restores a row of pixels with `samples` samples each.
    pub fn undo(self, row: &mut [u8], bits: usize, samples: usize, order: Order) {
        match (self, bits) {
            (Self::None, _) => {}
            (Self::Float, _) => float(row, bits / 8, samples, order),
            (Self::Horizontal, 8) => add::<1>(row, samples, |a, b| [a[0].wrapping_add(b[0])]),
            (Self::Horizontal, 16) => add(row, samples, |a, b| match order {
                Order::Little => u16::from_le_bytes(a)
                    .wrapping_add(u16::from_le_bytes(b))
                    .to_le_bytes(),
                Order::Big => u16::from_be_bytes(a)
                    .wrapping_add(u16::from_be_bytes(b))
                    .to_be_bytes(),
            }),
            (Self::Horizontal, 32) => add(row, samples, |a, b| match order {
                Order::Little => u32::from_le_bytes(a)
                    .wrapping_add(u32::from_le_bytes(b))
                    .to_le_bytes(),
                Order::Big => u32::from_be_bytes(a)
                    .wrapping_add(u32::from_be_bytes(b))
                    .to_be_bytes(),
            }),
            (Self::Horizontal, _) => add(row, samples, |a, b| match order {
                Order::Little => u64::from_le_bytes(a)
                    .wrapping_add(u64::from_le_bytes(b))
                    .to_le_bytes(),
                Order::Big => u64::from_be_bytes(a)
                    .wrapping_add(u64::from_be_bytes(b))
                    .to_be_bytes(),
            }),
        }
    }
}

/// Every sample of `N` bytes is the sum of its difference and the one `samples` before.
fn add<const N: usize>(row: &mut [u8], samples: usize, sum: impl Fn([u8; N], [u8; N]) -> [u8; N]) {
    let (row, _) = row.as_chunks_mut::<N>();
    for i in samples..row.len() {
        row[i] = sum(row[i], row[i - samples]);
    }
}

/// Floats of `size` bytes.
fn float(row: &mut [u8], size: usize, samples: usize, order: Order) {
    add::<1>(row, samples, |a, b| [a[0].wrapping_add(b[0])]);
    let planes = row.to_vec();
    let count = row.len() / size;
    for (i, float) in row.chunks_exact_mut(size).enumerate() {
        for (significance, byte) in planes[i..].iter().step_by(count).take(size).enumerate() {
            let place = match order {
                Order::Little => size - 1 - significance,
                Order::Big => significance,
            };
            float[place] = *byte;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_to_the_same_channel_of_the_pixel_before() {
        let mut row = [1, 10, 1, 255, 2, 255];
        Predictor::Horizontal.undo(&mut row, 8, 2, Order::Little);
        assert_eq!(row, [1, 10, 2, 9, 4, 8]);
        let mut row = [0x00, 0xff, 0x00, 0x02];
        Predictor::Horizontal.undo(&mut row, 16, 1, Order::Big);
        assert_eq!(row, [0x00, 0xff, 0x01, 0x01]);
        let mut row = [0xff, 0x00, 0x02, 0x00];
        Predictor::Horizontal.undo(&mut row, 16, 1, Order::Little);
        assert_eq!(row, [0xff, 0x00, 0x01, 0x01]);
    }

    #[test]
    fn floats_are_put_together_from_their_bytes() {
        // 1.0 is 3f80 0000, 2.0 is 4000 0000: highest bytes 3f 40, then 80 00, then zeros, each less the one before.
        let told = [0x3f, 0x01, 0x40, 0x80, 0x00, 0x00, 0x00, 0x00];
        for (order, bytes) in [
            (Order::Little, [1f32.to_le_bytes(), 2f32.to_le_bytes()]),
            (Order::Big, [1f32.to_be_bytes(), 2f32.to_be_bytes()]),
        ] {
            let mut row = told;
            Predictor::Float.undo(&mut row, 32, 1, order);
            assert_eq!(row, bytes.concat()[..]);
        }
    }
}
