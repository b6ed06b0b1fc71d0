//! The container: byte order, directories (IFDs), the numbers in them, and which of them is the picture.

use std::collections::{BTreeMap, HashSet};
use std::io::{BufRead, Read as _, Seek, SeekFrom};

use super::Fault;

/// Of all numbers in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Little,
    Big,
}

impl Order {
    /// The number of up to eight bytes.
    fn number(self, bytes: &[u8]) -> u64 {
        let join = |number: u64, &byte: &u8| number << 8 | u64::from(byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, join),
            Self::Big => bytes.iter().fold(0, join),
        }
    }
}

/// A file whose header was read.
pub(super) struct Source<R> {
    reader: R,
    length: u64,
    pub order: Order,
    /// BigTIFF: offsets and counts of eight bytes.
    big: bool,
}

impl<R: BufRead + Seek> Source<R> {
    /// The file, and where its first directory is.
    pub fn open(mut reader: R) -> Result<(Self, u64), Fault> {
        let mut source = Self {
            length: reader.seek(SeekFrom::End(0))?,
            reader,
            order: Order::Little,
            big: false,
        };
        let start = source.bytes(0, 8, "the header")?;
        source.order = match &start[..2] {
            b"II" => Order::Little,
            b"MM" => Order::Big,
            _ => return Err(Fault::broken("its byte order is neither II nor MM")),
        };
        let number = |range| source.order.number(range);
        match number(&start[2..4]) {
            42 => {
                let first = number(&start[4..]);
                Ok((source, first))
            }
            43 if number(&start[4..6]) == 8 => {
                source.big = true;
                let first = source.bytes(8, 8, "the header")?;
                let first = source.order.number(&first);
                Ok((source, first))
            }
            43 => Err(Fault::broken("BigTIFF with offsets of other than 8 bytes")),
            other => Err(Fault::broken(format!(
                "version {other}; 42 or 43 is expected"
            ))),
        }
    }

    /// So many bytes of the file, if it has them; `what` they are is said if not.
    pub fn bytes(&mut self, offset: u64, count: u64, what: &str) -> Result<Vec<u8>, Fault> {
        let length = self.length;
        if offset.checked_add(count).is_none_or(|end| end > length) {
            return Err(Fault::broken(format!(
                "{what} of {count} bytes at {offset} is beyond the end of the file, {length} bytes"
            )));
        }
        self.reader.seek(SeekFrom::Start(offset))?;
        let mut bytes = Vec::new();
        usize::try_from(count)
            .ok()
            .and_then(|count| bytes.try_reserve_exact(count).ok())
            .ok_or_else(|| Fault::broken(format!("no memory for {what} of {count} bytes")))?;
        (&mut self.reader).take(count).read_to_end(&mut bytes)?;
        if bytes.len() as u64 != count {
            return Err(Fault::broken(format!("{what} ends too early")));
        }
        Ok(bytes)
    }

    /// Bytes from an offset to the end of the file.
    pub fn rest(&self, offset: u64) -> u64 {
        self.length.saturating_sub(offset)
    }
}

/// A tag's values as they stand in a directory.
struct Entry {
    kind: u64,
    count: u64,
    /// The values, or where they are.
    field: Vec<u8>,
}

/// A directory: one page.
pub(super) struct Directory {
    entries: BTreeMap<u16, Entry>,
    /// Where the next one is; 0 for none.
    next: u64,
}

impl Directory {
    fn read<R: BufRead + Seek>(source: &mut Source<R>, offset: u64) -> Result<Self, Fault> {
        const WHAT: &str = "a directory";
        let (size, word) = if source.big { (8, 8) } else { (2, 4) };
        let count = source.bytes(offset, size, WHAT)?;
        let count = source.order.number(&count);
        let length = count
            .checked_mul(4 + 2 * word)
            .and_then(|length| length.checked_add(word))
            .ok_or_else(|| Fault::broken(format!("a directory of {count} entries")))?;
        let bytes = source.bytes(offset + size, length, WHAT)?;
        let (entries, next) = bytes.split_at((length - word) as usize);
        let mut directory = Self {
            entries: BTreeMap::new(),
            next: source.order.number(next),
        };
        for entry in entries.chunks_exact(4 + 2 * word as usize) {
            let (tag, rest) = entry.split_at(2);
            let (kind, rest) = rest.split_at(2);
            let (count, field) = rest.split_at(word as usize);
            let tag = source.order.number(tag) as u16;
            directory.entries.entry(tag).or_insert_with(|| Entry {
                kind: source.order.number(kind),
                count: source.order.number(count),
                field: field.to_vec(),
            });
        }
        Ok(directory)
    }

    /// The whole numbers of a tag, at most the first `most` of them.
    pub fn numbers<R: BufRead + Seek>(
        &self,
        source: &mut Source<R>,
        tag: u16,
        most: u64,
    ) -> Result<Option<Vec<u64>>, Fault> {
        let Some(entry) = self.entries.get(&tag) else {
            return Ok(None);
        };
        let size = match entry.kind {
            1 | 6 => 1,      // BYTE, SBYTE
            3 | 8 => 2,      // SHORT, SSHORT
            4 | 9 | 13 => 4, // LONG, SLONG, IFD
            16..=18 => 8,    // LONG8, SLONG8, IFD8
            other => {
                return Err(Fault::broken(format!(
                    "tag {tag} is of type {other}; whole numbers are expected"
                )));
            }
        };
        let bytes = entry.bytes(source, tag, size, most)?;
        let numbers = bytes.chunks_exact(size as usize);
        Ok(Some(numbers.map(|n| source.order.number(n)).collect()))
    }

    /// The first whole number of a tag.
    pub fn number<R: BufRead + Seek>(
        &self,
        source: &mut Source<R>,
        tag: u16,
    ) -> Result<Option<u64>, Fault> {
        Ok(self
            .numbers(source, tag, 1)?
            .and_then(|numbers| numbers.first().copied()))
    }

    /// The bytes of a tag, at most the first `most` of them.
    pub fn bytes<R: BufRead + Seek>(
        &self,
        source: &mut Source<R>,
        tag: u16,
        most: u64,
    ) -> Result<Option<Vec<u8>>, Fault> {
        match self.entries.get(&tag) {
            Some(
                entry @ Entry {
                    kind: 1 | 2 | 7, ..
                },
            ) => entry.bytes(source, tag, 1, most).map(Some),
            _ => Ok(None),
        }
    }

    fn is_full_resolution<R: BufRead + Seek>(&self, source: &mut Source<R>) -> Result<bool, Fault> {
        /// Bits of NewSubfileType: a thumbnail or overview, a transparency mask.
        const REDUCED_OR_MASK: u64 = 0b101;
        /// SubfileType, its predecessor: reduced.
        const REDUCED: u64 = 2;
        let kind = self.number(source, NEW_SUBFILE_TYPE)?.unwrap_or(0);
        let old_kind = self.number(source, SUBFILE_TYPE)?.unwrap_or(0);
        Ok(kind & REDUCED_OR_MASK == 0 && old_kind != REDUCED)
    }
}

impl Entry {
    fn bytes<R: BufRead + Seek>(
        &self,
        source: &mut Source<R>,
        tag: u16,
        size: u64,
        most: u64,
    ) -> Result<Vec<u8>, Fault> {
        let wanted = self.count.min(most).saturating_mul(size);
        if self.count.saturating_mul(size) <= self.field.len() as u64 {
            return Ok(self.field[..wanted as usize].to_vec());
        }
        let offset = source.order.number(&self.field);
        source.bytes(offset, wanted, &format!("tag {tag}"))
    }
}

const NEW_SUBFILE_TYPE: u16 = 254;
const SUBFILE_TYPE: u16 = 255;
const SUB_IFDS: u16 = 330;

/// The first page of full resolution: in the chain of pages, else among what hangs below them; else the first page.
pub(super) fn page<R: BufRead + Seek>(
    source: &mut Source<R>,
    first: u64,
) -> Result<Directory, Fault> {
    /// Pages looked at before one of full resolution.
    const MOST: usize = 1024;
    let mut seen = HashSet::new();
    let mut below = Vec::new();
    let mut fallback = None;
    let mut offset = first;
    while offset != 0 && seen.len() < MOST && seen.insert(offset) {
        let page = Directory::read(source, offset)?;
        if page.is_full_resolution(source)? {
            return Ok(page);
        }
        below.extend(
            page.numbers(source, SUB_IFDS, MOST as u64)?
                .unwrap_or_default(),
        );
        offset = page.next;
        fallback.get_or_insert(page);
    }
    for offset in below {
        if seen.len() == MOST {
            break;
        }
        if seen.insert(offset) {
            let page = Directory::read(source, offset)?;
            if page.is_full_resolution(source)? {
                return Ok(page);
            }
        }
    }
    fallback.ok_or_else(|| Fault::broken("it holds no picture"))
}
