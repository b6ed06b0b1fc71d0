//! Text of any 8-bit encoding, as lines of bytes.
//!
//! OBJ and MTL say nothing of their encoding: statements are ASCII, and names and comments are what the exporter's system wrote.

use std::borrow::Cow;

/// Without a byte order mark, and in bytes where it was UTF-16.
///
/// # Errors
///
/// The line, from 1, of a NUL byte: this is no text.
pub(super) fn plain(bytes: &[u8]) -> Result<Cow<'_, [u8]>, usize> {
    let text = match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, rest @ ..] => Cow::Owned(from_utf16(rest, u16::from_le_bytes)),
        [0xfe, 0xff, rest @ ..] => Cow::Owned(from_utf16(rest, u16::from_be_bytes)),
        _ => Cow::Borrowed(bytes),
    };
    match text.iter().position(|&b| b == 0) {
        Some(at) => Err(lines(&text[..at]).count().max(1)),
        None => Ok(text),
    }
}

fn from_utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Vec<u8> {
    let units = bytes.as_chunks().0.iter().map(|&pair| unit(pair));
    let characters = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
    characters.collect::<String>().into_bytes()
}

/// The lines of a text.
#[derive(Clone)]
pub(super) struct Lines<'a> {
    text: &'a [u8],
    at: usize,
}

/// The lines, each with its offset: they end with LF, CR LF, or CR alone, as on the first Macintoshes.
pub(super) fn lines(text: &[u8]) -> Lines<'_> {
    Lines { text, at: 0 }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let start = self.at;
        let rest = self.text.get(start..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&b| b == b'\n' || b == b'\r');
        let line = &rest[..length.unwrap_or(rest.len())];
        self.at += match &rest[line.len()..] {
            [b'\r', b'\n', ..] => line.len() + 2,
            _ => line.len() + 1,
        };
        Some((start, line))
    }
}

/// The statements without comments, continued lines joined, each with the number of its first line.
pub(super) fn statements(text: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, [u8]>)> {
    let mut lines = lines(text).map(|(_, line)| line).enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut whole = Cow::Borrowed(uncommented(first));
        while continues(&whole) {
            let joined = whole.to_mut();
            joined.pop();
            joined.push(b' ');
            match lines.next() {
                Some((_, next)) => joined.extend_from_slice(uncommented(next)),
                None => break,
            }
        }
        Some((number + 1, whole))
    })
}

/// In Shift-JIS, Big5 and GBK a backslash may be the second half of a character.
fn continues(statement: &[u8]) -> bool {
    match statement {
        [.., before, b'\\'] => before.is_ascii() || std::str::from_utf8(statement).is_ok(),
        _ => statement == b"\\",
    }
}

/// Names may hold a `#`; a comment is a `#` at the start or after a blank.
pub(super) fn uncommented(line: &[u8]) -> &[u8] {
    let start =
        (0..line.len()).find(|&i| line[i] == b'#' && (i == 0 || line[i - 1].is_ascii_whitespace()));
    line[..start.unwrap_or(line.len())].trim_ascii()
}

/// The first word and what follows it, both without blanks around.
pub(super) fn split_word(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii_start();
    let end = text.iter().position(u8::is_ascii_whitespace);
    let (word, rest) = text.split_at(end.unwrap_or(text.len()));
    (word, rest.trim_ascii())
}

/// The words of a statement.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace)
        .filter(|w| !w.is_empty())
}

/// A number or an index.
pub(super) fn parse<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A name without the quotes around it, if it has any.
pub(super) fn unquoted(name: &[u8]) -> &[u8] {
    match name.trim_ascii() {
        [b'"', inner @ .., b'"'] => inner,
        name => name,
    }
}

/// As UTF-8 if it is that, else as Latin-1.
pub(super) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// For a message: decoded and cut to one line of a screen.
pub(super) fn shown(statement: &[u8]) -> String {
    const MOST: usize = 80;
    let text = decoded(&statement[..statement.len().min(4 * MOST)]);
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_line_end_counts_once() {
        for text in ["a\nbc\n\nd", "a\r\nbc\r\n\r\nd\r\n", "a\rbc\r\rd\r"] {
            let found: Vec<_> = lines(text.as_bytes()).collect();
            assert_eq!(found.len(), 4, "{text:?}");
            for (start, line) in &found {
                assert_eq!(&text.as_bytes()[*start..start + line.len()], *line);
            }
            assert_eq!(found[1].1, b"bc");
            assert_eq!(found[3].1, b"d");
        }
        assert_eq!(lines(b"").count(), 0);
    }

    #[test]
    fn byte_order_marks_are_read_and_nul_is_refused() {
        let text = "v 1 é\nf";
        let utf16 = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
            "\u{feff}"
                .encode_utf16()
                .chain(text.encode_utf16())
                .flat_map(unit)
                .collect()
        };
        let marked = format!("\u{feff}{text}");
        for bytes in [
            marked.into_bytes(),
            utf16(u16::to_le_bytes),
            utf16(u16::to_be_bytes),
        ] {
            assert_eq!(plain(&bytes).unwrap(), text.as_bytes());
        }
        assert_eq!(plain(b"v 1\r\nv \0").unwrap_err(), 2);
        assert_eq!(plain(b"\0").unwrap_err(), 1);
    }

    #[test]
    fn a_backslash_continues_a_line_but_not_a_character() {
        let joined: Vec<_> =
            statements(b"f 1 2 \\\r\n3\nusemtl \x83\x5c\nv 1\\\n2 # \\\nv\n\\").collect();
        let texts: Vec<_> = joined
            .iter()
            .map(|(line, text)| (*line, &text[..]))
            .collect();
        let expected: [(usize, &[u8]); 5] = [
            (1, b"f 1 2  3"),
            (3, b"usemtl \x83\x5c"),
            (4, b"v 1 2"),
            (6, b"v"),
            (7, b" "),
        ];
        assert_eq!(texts, expected);
    }

    #[test]
    fn names_may_hold_what_comments_start_with() {
        assert_eq!(uncommented(b" map a#1.png # old"), b"map a#1.png");
        assert_eq!(uncommented(b"# all"), b"");
        assert_eq!(unquoted(b" \"my wood\" "), b"my wood");
        assert_eq!(unquoted(b"\""), b"\"");
        assert_eq!(decoded(b"caf\xe9"), "café");
        assert!(shown(&[b'x'; 1000]).len() < 100);
    }
}
