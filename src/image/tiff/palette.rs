//! Palettes: colours for indices.

use super::Fault;
use crate::image::samples::Samples;

/// RGB for every index that there can be, in 16 bits or, where the file means no more, in 8.
#[derive(Debug, PartialEq)]
pub(super) enum Colors {
    U8(Vec<[u8; 3]>),
    U16(Vec<[u16; 3]>),
}

impl Colors {
    /// From a colour map: all reds, all greens, all blues.
    ///
    /// Entries have 16 bits. Writers that have 8 put them into both bytes or into the high one, and some into the low one.
    pub fn new(map: Vec<u64>, bits: usize) -> Result<Self, Fault> {
        let colors = 1 << bits;
        if map.len() != 3 * colors || map.iter().any(|&entry| entry > 0xffff) {
            let found = map.len();
            return Err(Fault::broken(format!(
                "a palette of {found} numbers; {} numbers of 16 bits are expected",
                3 * colors
            )));
        }
        let entry = |color: usize, channel: usize| map[channel * colors + color];
        let all = |shift: u32| {
            let color = |color| [0, 1, 2].map(|channel| (entry(color, channel) >> shift) as u8);
            (0..colors).map(color).collect()
        };
        let every = |holds: fn(u64) -> bool| map.iter().all(|&entry| holds(entry));
        Ok(if every(|entry| entry < 256) {
            Self::U8(all(0))
        } else if every(|entry| entry & 0xff == 0) || every(|entry| entry & 0xff == entry >> 8) {
            Self::U8(all(8))
        } else {
            let color = |color| [0, 1, 2].map(|channel| entry(color, channel) as u16);
            Self::U16((0..colors).map(color).collect())
        })
    }
}

/// The colours of indices, interleaved.
pub(super) fn apply(colors: &Colors, indices: Samples) -> Result<Samples, Fault> {
    match indices {
        Samples::U8(indices) => colored(colors, &indices),
        Samples::U16(indices) => colored(colors, &indices),
        _ => Err(Fault::broken(
            "indices of a palette that are no small numbers",
        )),
    }
}

fn colored<I: Copy + Into<usize>>(colors: &Colors, indices: &[I]) -> Result<Samples, Fault> {
    Ok(match colors {
        Colors::U8(colors) => Samples::U8(looked_up(colors, indices)?),
        Colors::U16(colors) => Samples::U16(looked_up(colors, indices)?),
    })
}

fn looked_up<I: Copy + Into<usize>, T: Copy>(
    colors: &[[T; 3]],
    indices: &[I],
) -> Result<Vec<T>, Fault> {
    let mut samples = Vec::new();
    samples
        .try_reserve_exact(3 * indices.len())
        .map_err(|_| Fault::broken("no memory for its colours"))?;
    // There is a colour for every index of so many bits.
    samples.extend(indices.iter().flat_map(|&index| colors[index.into()]));
    Ok(samples)
}
