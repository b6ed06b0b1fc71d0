//! Modes TRIANGLES and INDICES.

use super::{CUT_OFF, TOO_LONG, take_byte, unzigzag};

/// Bytes of the table of frequent codes at the end of a stream of triangles.
const TABLE: usize = 16;
/// Zeros at the end of a sequence.
const SEQUENCE_TAIL: usize = 4;

/// The last things that were seen, the newest is number 0; a ring of 16.
struct Recent<T> {
    ring: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(nothing: T) -> Self {
        Self {
            ring: [nothing; 16],
            next: 0,
        }
    }

    fn push(&mut self, item: T) {
        self.ring[self.next] = item;
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, age: u8) -> T {
        self.ring[(self.next + 15 - usize::from(age & 15)) % 16]
    }
}

/// What a decoder of triangles knows of those before.
struct Seen {
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// The vertex that would be new.
    next: u32,
    /// The last vertex that was written out.
    last: u32,
}

/// `count` indices, three per triangle.
pub(super) fn triangles(packed: &[u8], count: usize) -> Result<Vec<u32>, String> {
    if !count.is_multiple_of(3) {
        return Err(format!(
            "{count} indices of triangles; expected a multiple of 3"
        ));
    }
    let Some((0xe1, rest)) = packed.split_first() else {
        return Err("it does not begin as triangles do".into());
    };
    let (rest, table) = rest.split_last_chunk::<TABLE>().ok_or(CUT_OFF)?;
    // A code each, so that the count is no more than the bytes there are.
    let (codes, mut data) = rest.split_at_checked(count / 3).ok_or(CUT_OFF)?;
    let mut seen = Seen {
        edges: Recent::new([0; 2]),
        vertices: Recent::new(0),
        next: 0,
        last: 0,
    };
    let mut indices = Vec::with_capacity(count);
    for &code in codes {
        let [a, b, c] = match code {
            0xf0.. => seen.first(code & 15, table, &mut data)?,
            _ => seen.across(code, &mut data)?,
        };
        seen.edges.push([c, b]);
        seen.edges.push([a, c]);
        indices.extend([a, b, c]);
    }
    if !data.is_empty() {
        return Err(TOO_LONG.into());
    }
    Ok(indices)
}

impl Seen {
    /// A triangle across an edge seen lately.
    fn across(&mut self, code: u8, data: &mut &[u8]) -> Result<[u32; 3], String> {
        let [a, b] = self.edges.get(code >> 4);
        let c = match code & 15 {
            0 => self.new_vertex(),
            age @ 1..=12 => return Ok([a, b, self.vertices.get(age)]),
            13 => self.written(self.last.wrapping_sub(1)),
            14 => self.written(self.last.wrapping_add(1)),
            _ => self.read(data)?,
        };
        self.vertices.push(c);
        Ok([a, b, c])
    }

    /// A triangle beside none. How its vertices are coded is in the table or, where `entry` is beyond it, in the data.
    fn first(
        &mut self,
        entry: u8,
        table: &[u8; TABLE],
        data: &mut &[u8],
    ) -> Result<[u32; 3], String> {
        let code = match entry {
            0..=13 => table[usize::from(entry)],
            _ => take_byte(data)?,
        };
        if entry >= 14 && code == 0 {
            self.next = 0;
        }
        let a = if entry == 15 {
            None
        } else {
            Some(self.new_vertex())
        };
        let b = self.old_or_new(code >> 4, entry);
        let c = self.old_or_new(code & 15, entry);
        // Written vertices follow in order, after the new ones have been counted.
        let mut resolve = |vertex: Option<(u32, bool)>| match vertex {
            Some(vertex) => Ok(vertex),
            None => self.read(data).map(|v| (v, true)),
        };
        let (a, _) = resolve(a.map(|a| (a, true)))?;
        let (b, b_is_new) = resolve(b)?;
        let (c, c_is_new) = resolve(c)?;
        self.vertices.push(a);
        for (vertex, is_new) in [(b, b_is_new), (c, c_is_new)] {
            if is_new {
                self.vertices.push(vertex);
            }
        }
        self.edges.push([b, a]);
        Ok([a, b, c])
    }

    /// A vertex by half a code, and whether it is new; `None` for one that is written out.
    fn old_or_new(&mut self, code: u8, entry: u8) -> Option<(u32, bool)> {
        match code {
            0 => Some((self.new_vertex(), true)),
            15 if entry >= 14 => None,
            age => Some((self.vertices.get(age - 1), false)),
        }
    }

    fn new_vertex(&mut self) -> u32 {
        let vertex = self.next;
        self.next = vertex.wrapping_add(1);
        vertex
    }

    fn written(&mut self, vertex: u32) -> u32 {
        self.last = vertex;
        vertex
    }

    fn read(&mut self, data: &mut &[u8]) -> Result<u32, String> {
        let delta = unzigzag(varint(data)?);
        Ok(self.written(self.last.wrapping_add(delta)))
    }
}

/// `count` indices, each a difference to one of the last two runs.
pub(super) fn sequence(packed: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let Some((0xd1, rest)) = packed.split_first() else {
        return Err("it does not begin as indices do".into());
    };
    let end = rest.len().checked_sub(SEQUENCE_TAIL).ok_or(CUT_OFF)?;
    let mut data = &rest[..end];
    if count > data.len() {
        return Err(CUT_OFF.into());
    }
    let mut last = [0_u32; 2];
    let indices = (0..count).map(|_| {
        let code = varint(&mut data)?;
        let last = &mut last[(code & 1) as usize];
        *last = last.wrapping_add(unzigzag(code >> 1));
        Ok(*last)
    });
    let indices = indices.collect::<Result<_, String>>()?;
    if !data.is_empty() {
        return Err(TOO_LONG.into());
    }
    Ok(indices)
}

/// Seven bits per byte, the lowest first (LEB128).
fn varint(data: &mut &[u8]) -> Result<u32, String> {
    let mut number = 0;
    for shift in (0..32).step_by(7) {
        let byte = take_byte(data)?;
        number |= u32::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Ok(number);
        }
    }
    Err("a number in it is longer than 32 bits; is it damaged?".into())
}
