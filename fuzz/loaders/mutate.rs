//! Damage to files, drawn from a seed: what bad disks, bad programs and bad people do.
#![allow(dead_code)] // whoever includes it uses its own part

/// Marsaglia's xorshift, 64 bits: the same numbers everywhere.
pub struct Random(u64);

impl Random {
    /// Any seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 16
    }

    /// 0 .. `count` - 1; 0 where there is none.
    pub fn below(&mut self, count: usize) -> usize {
        self.next() as usize % count.max(1)
    }
}

/// Words that mean trouble where a number or a name is expected.
const WORDS: [&str; 24] = [
    "0",
    "-1",
    "1",
    "2",
    "255",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "1e38",
    "1e39",
    "-1e-45",
    "1e400",
    "nan",
    "inf",
    "0x10",
    "",
    "\"",
    "\\",
    "..",
    "\u{fffd}",
];

/// Numbers that mean trouble in binary files.
const NUMBERS: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x1_0000,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 60,
    u64::MAX,
];

/// One to four kinds of damage to a copy of `whole`; `other` is a file to take pieces from.
pub fn damaged(random: &mut Random, whole: &[u8], other: &[u8], is_text: bool) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=random.below(4) {
        if is_text && random.below(3) > 0 {
            replace_word(random, &mut bytes);
        } else {
            damage(random, &mut bytes, other);
        }
    }
    bytes
}

fn damage(random: &mut Random, bytes: &mut Vec<u8>, other: &[u8]) {
    let at = random.below(bytes.len());
    match random.below(10) {
        0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        2 if !bytes.is_empty() => bytes[at] = random.below(256) as u8,
        3 | 4 => overwrite_number(random, bytes, at),
        5 => bytes.truncate(at),
        6 => {
            let end = at + random.below((bytes.len() - at).min(64));
            bytes.drain(at..end);
        }
        7 => {
            let from = random.below(bytes.len());
            let piece = bytes[from..(from + random.below(64)).min(bytes.len())].to_vec();
            bytes.splice(at..at, piece);
        }
        8 => {
            let from = random.below(other.len());
            let piece = &other[from..(from + random.below(64)).min(other.len())];
            let end = (at + piece.len()).min(bytes.len());
            bytes.splice(at..end, piece.iter().copied());
        }
        _ => bytes.extend((0..random.below(32)).map(|k| k as u8)),
    }
}

/// In one, two, four or eight bytes, of either order.
fn overwrite_number(random: &mut Random, bytes: &mut [u8], at: usize) {
    let number = NUMBERS[random.below(NUMBERS.len())];
    let size = 1 << random.below(4);
    let little = number.to_le_bytes();
    let mut digits = little[..size].to_vec();
    if random.below(2) == 0 {
        digits.reverse();
    }
    for (byte, digit) in bytes.iter_mut().skip(at).zip(digits) {
        *byte = digit;
    }
}

/// Another word where one stands.
fn replace_word(random: &mut Random, bytes: &mut Vec<u8>) {
    let is_word =
        |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_' | b'/');
    let at = random.below(bytes.len());
    let Some(start) = bytes[at..].iter().position(is_word).map(|k| at + k) else {
        return;
    };
    let length = bytes[start..]
        .iter()
        .take_while(|byte| is_word(byte))
        .count();
    let word = WORDS[random.below(WORDS.len())];
    bytes.splice(start..start + length, word.bytes());
}

/// Makes the lengths and check sums of a damaged file fit again, so that what is behind them is reached.
pub fn mend(bytes: &mut [u8]) {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        mend_png(bytes);
    } else if bytes.starts_with(b"glTF") && bytes.len() >= 12 {
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
    }
}

/// PNG: length, type, data, CRC-32 of type and data.
fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = bytes.get(at..at + 4) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]) as usize;
        let Some(end) = at
            .checked_add(8)
            .and_then(|start| start.checked_add(length))
            .filter(|end| end + 4 <= bytes.len())
        else {
            return;
        };
        let sum = crc32fast::hash(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&sum.to_be_bytes());
        at = end + 4;
    }
}
