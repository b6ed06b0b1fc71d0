//! Huffman codes of a scan.

use super::Checked;

/// Bits that a code is looked up by at once.
const SHORT: u32 = 9;

/// Longest code.
const LONGEST: usize = 16;

/// A table of codes.
pub(super) struct Huffman {
    /// By the next [`SHORT`] bits: the code's length, 0 for longer ones, and its value.
    short: Vec<(u8, u8)>,
    /// By length: the first code that is too large, aligned to [`LONGEST`] bits, and what leads from a code to its value.
    ends: [(u32, i32); LONGEST + 1],
    values: Vec<u8>,
}

impl Huffman {
    /// A table as a segment has it, and what stands behind it.
    pub fn of(segment: &[u8]) -> Checked<(Self, &[u8])> {
        let cut = "a Huffman table is too short";
        let (counts, rest) = segment.split_at_checked(LONGEST).ok_or(cut)?;
        let total = counts.iter().map(|&count| usize::from(count)).sum();
        let (values, rest) = rest.split_at_checked(total).ok_or(cut)?;
        let mut table = Self {
            short: vec![(0, 0); 1 << SHORT],
            ends: [(0, 0); LONGEST + 1],
            values: values.to_vec(),
        };
        let (mut code, mut index) = (0u32, 0usize);
        for length in 1..=LONGEST {
            let count = u32::from(counts[length - 1]);
            table.ends[length].1 = index as i32 - code as i32;
            if code + count > 1 << length {
                return Err("a Huffman table has more codes than there can be".into());
            }
            for _ in 0..count {
                if length as u32 <= SHORT {
                    let free = SHORT - length as u32;
                    let first = (code << free) as usize;
                    table.short[first..first + (1 << free)].fill((length as u8, values[index]));
                }
                (code, index) = (code + 1, index + 1);
            }
            table.ends[length].0 = code << (LONGEST - length);
            code <<= 1;
        }
        Ok((table, rest))
    }
}

/// The bits of a scan, up to the next marker.
pub(super) struct Bits<'a> {
    bytes: &'a [u8],
    next: usize,
    /// Bits read and not yet used, the oldest highest.
    held: u64,
    count: u32,
}

impl<'a> Bits<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            next: 0,
            held: 0,
            count: 0,
        }
    }

    /// Holds at least 17 bits, unless a marker or the end comes before.
    fn fill(&mut self) {
        while self.count <= 48 {
            let byte = match self.bytes.get(self.next..) {
                Some([0xff, 0, ..]) => {
                    self.next += 2;
                    0xff
                }
                Some([0xff, ..]) | Some([]) | None => return,
                Some([byte, ..]) => {
                    self.next += 1;
                    *byte
                }
            };
            self.held = self.held << 8 | u64::from(byte);
            self.count += 8;
        }
    }

    /// The value of the next code.
    pub fn code(&mut self, table: &Huffman) -> Checked<u8> {
        if self.count < LONGEST as u32 {
            self.fill();
        }
        // Behind the last bit zeros are looked up, and found out by the count.
        let ahead = match self.count {
            count if count >= LONGEST as u32 => (self.held >> (count - LONGEST as u32)) as u32,
            count => (self.held << (LONGEST as u32 - count)) as u32,
        } & 0xffff;
        let (length, value) = table.short[(ahead >> (LONGEST as u32 - SHORT)) as usize];
        let (length, value) = match length {
            0 => {
                let longer = (SHORT as usize + 1..=LONGEST).find(|&l| ahead < table.ends[l].0);
                let length = longer.ok_or("a code that its table has not")?;
                let code = ahead >> (LONGEST - length);
                let index = code as i32 + table.ends[length].1;
                let value = usize::try_from(index)
                    .ok()
                    .and_then(|i| table.values.get(i));
                (
                    length as u32,
                    *value.ok_or("a code that its table has not")?,
                )
            }
            _ => (length.into(), value),
        };
        self.skip(length)?;
        Ok(value)
    }

    /// Passes over bits, at most 64.
    pub fn skip(&mut self, bits: u32) -> Checked<()> {
        if self.count < bits {
            self.fill();
        }
        if self.count < bits {
            // More than are held at once.
            if self.count > 16 {
                let held = self.count;
                self.count = 0;
                return self.skip(bits - held);
            }
            return Err("a scan ends before its last block; the file is truncated".into());
        }
        self.count -= bits;
        Ok(())
    }

    /// The next bits, at most 16, as a number.
    pub fn take(&mut self, bits: u32) -> Checked<u32> {
        if self.count < bits {
            self.fill();
        }
        self.skip(bits)?;
        Ok((self.held >> self.count) as u32 & ((1 << bits) - 1))
    }

    /// Passes the restart marker number `index`.
    pub fn restart(&mut self, index: usize) -> Checked<()> {
        self.fill();
        let expected = 0xd0 + (index % 8) as u8;
        let rest = self.bytes.get(self.next..).unwrap_or_default();
        let fill = rest.iter().take_while(|&&byte| byte == 0xff).count();
        // The rest of a byte is filled up with bits of no meaning.
        if self.count >= 8 || fill == 0 || rest.get(fill) != Some(&expected) {
            return Err("a restart marker is missing".into());
        }
        self.next += fill + 1;
        self.count = 0;
        Ok(())
    }

    /// What stands behind the scan, from where no bit was read on.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.next..).unwrap_or_default()
    }
}
