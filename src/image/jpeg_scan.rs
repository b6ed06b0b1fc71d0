//! Whether all of a JPEG's picture is there: every code of every scan is read (ITU-T T.81), no pixel is made.
//!
//! Decoders make up what they do not find: grey for what was cut off, and gigabytes of it on the word of a header. A
//! progressive picture keeps a bit per coefficient, an eighth of a byte per sample, taken as blocks come.

mod codes;
mod frame;

use codes::{Bits, Huffman};
use frame::{Component, Frame};

/// Why a file is refused, a sentence for the user.
type Checked<T> = Result<T, String>;

/// What a scan's header says.
struct Scan {
    /// Component of the frame, its DC table and its AC table.
    components: Vec<(usize, usize, usize)>,
    /// First and last coefficient, in zigzag order.
    band: (usize, usize),
    /// Bits left out before this scan, 0 for the first of these coefficients, and after it.
    high: u8,
    low: u8,
}

/// Walks through the first picture of the file.
///
/// # Errors
///
/// What is missing or damaged, or a kind of JPEG that is not decoded: 12 bits, lossless, hierarchical, arithmetic coding.
pub(super) fn check(bytes: &[u8]) -> Checked<()> {
    Walk::default().picture(bytes)
}

/// Most scans: each walks over all blocks, which runs of empty ones pack into next to no bytes. The decoder's limit, too.
const MOST_SCANS: usize = 100;

#[derive(Default)]
struct Walk {
    frame: Option<Frame>,
    scans: usize,
    /// DC and AC tables.
    tables: [[Option<Huffman>; 4]; 2],
    restart_interval: usize,
}

impl Walk {
    fn picture(&mut self, bytes: &[u8]) -> Checked<()> {
        let mut rest = bytes.get(2..).unwrap_or_default();
        loop {
            let marker;
            (marker, rest) = next_marker(rest)?;
            match marker {
                0xd9 => return self.is_complete(),
                // Without a length: restarts that no scan expects, and a start of a picture.
                0x01 | 0xd0..=0xd8 => continue,
                _ => {}
            }
            let segment;
            (segment, rest) = segment_of(rest)?;
            match marker {
                0xc0..=0xc2 => self.start_frame(segment, marker == 0xc2)?,
                0xc4 => self.tables(segment)?,
                0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf | 0xf7 => {
                    return Err(unread(marker));
                }
                0xdd => self.restart_interval = short(segment, 0)?.into(),
                0xda => {
                    self.scans += 1;
                    if self.scans > MOST_SCANS {
                        return Err(format!("it has more than {MOST_SCANS} scans"));
                    }
                    let scan = self.scan_of(segment)?;
                    rest = self.scan(&scan, rest)?;
                }
                0xdc => {
                    return Err(
                        "its height stands behind its first scan, which is not supported".into(),
                    );
                }
                _ => {}
            }
        }
    }

    fn start_frame(&mut self, segment: &[u8], progressive: bool) -> Checked<()> {
        if self.frame.is_some() {
            return Err("it has two frames".into());
        }
        self.frame = Some(Frame::of(segment, progressive)?);
        Ok(())
    }

    /// Huffman tables.
    fn tables(&mut self, mut segment: &[u8]) -> Checked<()> {
        while let Some((&place, rest)) = segment.split_first() {
            let (table, behind) = Huffman::of(rest)?;
            let (class, index) = (usize::from(place >> 4), usize::from(place & 15));
            let slot = self.tables.get_mut(class).and_then(|t| t.get_mut(index));
            *slot.ok_or("a Huffman table has no such place")? = Some(table);
            segment = behind;
        }
        Ok(())
    }

    fn scan_of(&self, segment: &[u8]) -> Checked<Scan> {
        let frame = self.frame.as_ref().ok_or("a scan comes before the frame")?;
        let cut = "a scan's header is too short";
        let (&count, rest) = segment.split_first().ok_or(cut)?;
        let count = usize::from(count);
        if !(1..=4).contains(&count) || rest.len() < 2 * count + 3 {
            return Err(cut.into());
        }
        let (pairs, rest) = rest.split_at(2 * count);
        let mut components: Vec<(usize, usize, usize)> = Vec::new();
        for pair in pairs.chunks_exact(2) {
            let index = frame.components.iter().position(|c| c.id == pair[0]);
            let index = index.ok_or("a scan is of a component that the frame has not")?;
            if components.iter().any(|&(known, ..)| known == index) {
                return Err("a scan has a component twice".into());
            }
            components.push((index, usize::from(pair[1] >> 4), usize::from(pair[1] & 15)));
        }
        let scan = Scan {
            components,
            band: (rest[0].into(), rest[1].into()),
            high: rest[2] >> 4,
            low: rest[2] & 15,
        };
        let fits = match frame.progressive {
            false => true,
            true => {
                let (first, last) = scan.band;
                first <= last
                    && last < 64
                    && (first > 0 || last == 0)
                    && (first == 0 || count == 1)
                    && (scan.high == 0 || scan.high == scan.low + 1)
            }
        };
        match fits {
            true => Ok(scan),
            false => Err("a scan's header is no step of a progression".into()),
        }
    }

    /// Reads a scan's blocks and gives what stands behind them.
    fn scan<'b>(&mut self, scan: &Scan, coded: &'b [u8]) -> Checked<&'b [u8]> {
        let frame = self.frame.as_mut().ok_or("a scan comes before the frame")?;
        frame.note(scan)?;
        let (columns, rows) = frame.units(scan);
        let mut bits = Bits::new(coded);
        let mut blocks = Blocks {
            tables: &self.tables,
            scan,
            progressive: frame.progressive,
            empty: 0,
        };
        let mut units = 0usize;
        for row in 0..rows {
            for &(component, ..) in &scan.components {
                frame.components[component].reach(row, scan.components.len() > 1)?;
            }
            for column in 0..columns {
                if self.restart_interval > 0
                    && units > 0
                    && units.is_multiple_of(self.restart_interval)
                {
                    bits.restart(units / self.restart_interval - 1)?;
                    blocks.empty = 0;
                }
                units += 1;
                for &(component, dc, ac) in &scan.components {
                    let component = &mut frame.components[component];
                    let (across, down) = match scan.components.len() {
                        1 => (1, 1),
                        _ => component.sampling,
                    };
                    for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                        let place = component.place(column * across + x, row * down + y);
                        blocks.read(&mut bits, component, place, dc, ac)?;
                    }
                }
            }
        }
        Ok(bits.rest())
    }

    fn is_complete(&self) -> Checked<()> {
        match &self.frame {
            Some(frame) => frame.is_complete(),
            None => Err("it has no frame".into()),
        }
    }
}

/// How blocks of a scan are read.
struct Blocks<'a> {
    tables: &'a [[Option<Huffman>; 4]; 2],
    scan: &'a Scan,
    progressive: bool,
    /// Blocks to come whose band is empty (an end-of-band run).
    empty: u32,
}

impl Blocks<'_> {
    fn table(&self, class: usize, index: usize) -> Checked<&Huffman> {
        let table = self.tables[class].get(index).and_then(Option::as_ref);
        table.ok_or_else(|| "a scan uses a Huffman table that is not there".into())
    }

    fn read(
        &mut self,
        bits: &mut Bits,
        component: &mut Component,
        place: usize,
        dc: usize,
        ac: usize,
    ) -> Checked<()> {
        let (first, last) = self.scan.band;
        if !self.progressive {
            self.difference(bits, dc)?;
            return sequential(bits, self.table(1, ac)?);
        }
        match (first, self.scan.high) {
            (0, 0) => self.difference(bits, dc),
            (0, _) => bits.skip(1),
            _ => {
                let known = component
                    .nonzero
                    .get_mut(place)
                    .ok_or("a block outside of the picture")?;
                if self.scan.high == 0 {
                    self.first_band(bits, known, ac, first, last)
                } else {
                    self.refined_band(bits, known, ac, first, last)
                }
            }
        }
    }

    /// The difference to the DC coefficient before.
    fn difference(&self, bits: &mut Bits, dc: usize) -> Checked<()> {
        let length = bits.code(self.table(0, dc)?)?;
        match length {
            0..=16 => bits.skip(length.into()),
            _ => Err("a DC coefficient is too long".into()),
        }
    }

    /// A band of AC coefficients (T.81, G.1.2.2).
    fn first_band(
        &mut self,
        bits: &mut Bits,
        known: &mut u64,
        ac: usize,
        first: usize,
        last: usize,
    ) -> Checked<()> {
        if self.empty > 0 {
            self.empty -= 1;
            return Ok(());
        }
        let mut k = first;
        while k <= last {
            let code = bits.code(self.table(1, ac)?)?;
            let (run, length) = (code >> 4, code & 15);
            match (run, length) {
                (15, 0) => k += 16,
                (_, 0) => {
                    self.empty = (1 << run) - 1 + bits.take(run.into())?;
                    return Ok(());
                }
                _ => {
                    k += usize::from(run);
                    bits.skip(length.into())?;
                    if k > last {
                        return Err("a coefficient beyond its band".into());
                    }
                    *known |= 1 << k;
                    k += 1;
                }
            }
        }
        Ok(())
    }

    /// One more bit of a band of AC coefficients (T.81, G.1.2.3): a bit for each that was not 0, codes for those that become so.
    fn refined_band(
        &mut self,
        bits: &mut Bits,
        known: &mut u64,
        ac: usize,
        first: usize,
        last: usize,
    ) -> Checked<()> {
        let mut k = first;
        while self.empty == 0 && k <= last {
            let code = bits.code(self.table(1, ac)?)?;
            let (mut zeros, length) = (code >> 4, code & 15);
            match length {
                0 if zeros < 15 => {
                    self.empty = (1 << zeros) + bits.take(zeros.into())?;
                    break;
                }
                0 => {}
                1 => bits.skip(1)?,
                _ => return Err("a refined coefficient is too long".into()),
            }
            while k <= last {
                if *known >> k & 1 == 1 {
                    bits.skip(1)?;
                } else if zeros == 0 {
                    break;
                } else {
                    zeros -= 1;
                }
                k += 1;
            }
            if length == 1 {
                if k > last {
                    return Err("a coefficient beyond its band".into());
                }
                *known |= 1 << k;
            }
            k += 1;
        }
        if self.empty > 0 {
            let band = *known & (u64::MAX << k.min(63)) & (u64::MAX >> (63 - last));
            // From 64 on nothing is left, which no shift says.
            let left = if k > last { 0 } else { band.count_ones() };
            bits.skip(left)?;
            self.empty -= 1;
        }
        Ok(())
    }
}

/// The AC coefficients of a block that is coded at once.
fn sequential(bits: &mut Bits, table: &Huffman) -> Checked<()> {
    let mut k = 1;
    while k < 64 {
        let code = bits.code(table)?;
        let (run, length) = (usize::from(code >> 4), code & 15);
        match (run, length) {
            (15, 0) => k += 16,
            (_, 0) => return Ok(()),
            _ => {
                k += run + 1;
                bits.skip(length.into())?;
                if k > 64 {
                    return Err("a coefficient beyond its block".into());
                }
            }
        }
    }
    Ok(())
}

/// The next marker, fill bytes and stray bytes skipped.
fn next_marker(bytes: &[u8]) -> Checked<(u8, &[u8])> {
    let found = bytes
        .windows(2)
        .position(|pair| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff));
    let at = found.ok_or("the end of the file is missing")?;
    Ok((bytes[at + 1], &bytes[at + 2..]))
}

/// A segment's contents, and what stands behind it.
fn segment_of(bytes: &[u8]) -> Checked<(&[u8], &[u8])> {
    let length = usize::from(short(bytes, 0)?);
    let (segment, rest) = bytes
        .split_at_checked(length)
        .ok_or("the file ends inside of a segment")?;
    let segment = segment
        .get(2..)
        .ok_or("a segment is shorter than its length")?;
    Ok((segment, rest))
}

fn short(bytes: &[u8], at: usize) -> Checked<u16> {
    let pair = bytes.get(at..).and_then(|bytes| bytes.first_chunk());
    let pair = pair.ok_or("the file ends inside of a segment")?;
    Ok(u16::from_be_bytes(*pair))
}

/// The kinds of frames that are not decoded.
fn unread(marker: u8) -> String {
    let kind = match marker {
        0xc3 => "lossless",
        0xc5..=0xc7 => "hierarchical",
        0xf7 => "near-lossless (JPEG-LS)",
        _ => "arithmetic-coded",
    };
    format!("{kind} JPEG is not supported; baseline or progressive is expected")
}

#[cfg(test)]
mod tests;
