//! The frame of a JPEG: its components, and what scans have given of them.

use super::{Checked, Scan, short};
use crate::image::MAX_PIXELS;

/// A component of the picture.
pub(super) struct Component {
    pub id: u8,
    /// Blocks across and down in a unit of interleaved components.
    pub sampling: (usize, usize),
    /// Blocks across and down when it comes alone.
    size: (usize, usize),
    /// Blocks across, whole units of interleaved components.
    stride: usize,
    /// By block, of progressive pictures: a bit per coefficient that is not 0, in zigzag order.
    pub nonzero: Vec<u64>,
    /// By coefficient: the bits that the last scan of it left out.
    left_out: [Option<u8>; 64],
    progressive: bool,
}

/// The frame.
pub(super) struct Frame {
    pub progressive: bool,
    pub components: Vec<Component>,
    /// Units of interleaved components across and down.
    units: (usize, usize),
}

impl Frame {
    /// The frame that a segment describes.
    pub fn of(segment: &[u8], progressive: bool) -> Checked<Self> {
        let cut = "its frame's header is too short";
        let [precision, _, _, _, _, count, rest @ ..] = segment else {
            return Err(cut.into());
        };
        if *precision != 8 {
            return Err(format!(
                "{precision}-bit JPEG is not supported; 8 bits are expected"
            ));
        }
        let (height, width) = (
            usize::from(short(segment, 1)?),
            usize::from(short(segment, 3)?),
        );
        if width == 0 || height == 0 || (width * height) as u64 > MAX_PIXELS {
            return Err(format!(
                "it claims {width}x{height} pixels; from 1 to {MAX_PIXELS} are read"
            ));
        }
        let entries = rest.get(..3 * usize::from(*count)).ok_or(cut)?;
        let sampling = |entry: &[u8]| (usize::from(entry[1] >> 4), usize::from(entry[1] & 15));
        let factors = || entries.chunks_exact(3).map(sampling);
        if factors().any(|(h, v)| !(1..=4).contains(&h) || !(1..=4).contains(&v)) {
            return Err("a component's sampling is not in 1 .. 4".into());
        }
        let across = factors()
            .map(|(h, _)| h)
            .max()
            .ok_or("it has no components")?;
        let down = factors()
            .map(|(_, v)| v)
            .max()
            .ok_or("it has no components")?;
        let units = (width.div_ceil(8 * across), height.div_ceil(8 * down));
        let component = |entry: &[u8]| {
            let (h, v) = sampling(entry);
            Component {
                id: entry[0],
                sampling: (h, v),
                size: (
                    (width * h).div_ceil(across).div_ceil(8),
                    (height * v).div_ceil(down).div_ceil(8),
                ),
                stride: units.0 * h,
                nonzero: Vec::new(),
                left_out: [None; 64],
                progressive,
            }
        };
        Ok(Self {
            progressive,
            components: entries.chunks_exact(3).map(component).collect(),
            units,
        })
    }

    /// Units across and down that a scan has: a component that comes alone comes block by block.
    pub fn units(&self, scan: &Scan) -> (usize, usize) {
        match scan.components[..] {
            [(alone, ..)] => self.components[alone].size,
            _ => self.units,
        }
    }

    /// Notes what a scan gives.
    pub fn note(&mut self, scan: &Scan) -> Checked<()> {
        let (first, last) = if self.progressive { scan.band } else { (0, 63) };
        let (high, low) = if self.progressive {
            (scan.high, scan.low)
        } else {
            (0, 0)
        };
        for &(component, ..) in &scan.components {
            for left_out in &mut self.components[component].left_out[first..=last] {
                let before = match high {
                    0 => None,
                    _ => Some(high),
                };
                if *left_out != before {
                    return Err("its scans do not follow one another".into());
                }
                *left_out = Some(low);
            }
        }
        Ok(())
    }

    /// Whether the scans have given all bits of all coefficients.
    pub fn is_complete(&self) -> Checked<()> {
        let whole = |component: &Component| component.left_out.iter().all(|&left| left == Some(0));
        match self.components.iter().all(whole) {
            true => Ok(()),
            false => Err("scans are missing; the file is truncated".into()),
        }
    }
}

impl Component {
    /// Makes room for the blocks of a row of units.
    pub fn reach(&mut self, row: usize, interleaved: bool) -> Checked<()> {
        if !self.progressive {
            return Ok(());
        }
        let rows = if interleaved {
            (row + 1) * self.sampling.1
        } else {
            row + 1
        };
        let blocks = rows * self.stride;
        if blocks > self.nonzero.len() {
            let more = blocks - self.nonzero.len();
            self.nonzero
                .try_reserve(more)
                .map_err(|error| error.to_string())?;
            self.nonzero.resize(blocks, 0);
        }
        Ok(())
    }

    /// The index of a block.
    pub fn place(&self, column: usize, row: usize) -> usize {
        row * self.stride + column
    }
}
