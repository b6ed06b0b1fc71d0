//! The elements of a PLY file, one by one.

use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{Encoding, Property, PropertyAccess, PropertyAccessResult};

use super::super::LoadMeshErrorKind;
use super::super::text::{self, Lines};
use super::header::{Element, Header};
use super::malformed;

/// Infinity in the crate's grammar, which knows neither its name nor NaN's.
const INFINITE: &str = "9e999";

/// What is still to be read.
pub(super) struct Source<'a> {
    encoding: Encoding,
    /// Of a text file: its lines, and the number of the last one that was read.
    lines: Lines<'a>,
    line: usize,
    /// Of a binary file.
    bytes: &'a [u8],
}

impl<'a> Source<'a> {
    pub(super) fn new(header: &Header<'a>) -> Self {
        Self {
            encoding: header.encoding,
            lines: text::lines(header.body),
            line: header.body_line - 1,
            bytes: header.body,
        }
    }

    /// Reads one element, its number from 0.
    pub(super) fn next<E: PropertyAccess>(
        &mut self,
        element: &Element,
        number: usize,
    ) -> Result<E, LoadMeshErrorKind> {
        let parser = Parser::new();
        let definition = &element.definition;
        let read: Result<E, ParseError> = match self.encoding {
            Encoding::Ascii => {
                let line = self.line_of(element, number)?;
                parser.read_ascii_element(&line, definition)
            }
            Encoding::BinaryLittleEndian => {
                parser.read_little_endian_element(&mut self.bytes, definition)
            }
            Encoding::BinaryBigEndian => {
                parser.read_big_endian_element(&mut self.bytes, definition)
            }
        };
        read.map_err(|e| malformed(&self.place(element, number), &e))
    }

    /// Where the element is that was read last.
    pub(super) fn place(&self, element: &Element, number: usize) -> String {
        let name = &element.name;
        match self.encoding {
            Encoding::Ascii => format!("line {}: {name} {number}", self.line),
            _ => format!("{name} {number}"),
        }
    }

    /// The next line that is not blank, with its numbers spelled as the crate knows them.
    fn line_of(&mut self, element: &Element, number: usize) -> Result<String, LoadMeshErrorKind> {
        if element.definition.properties.is_empty() {
            return Ok(String::new());
        }
        loop {
            let Some((_, line)) = self.lines.next() else {
                return Err(LoadMeshErrorKind::Malformed {
                    what: format!("element {:?}", element.name),
                    problem: format!(
                        "the file ends after {number} of {}",
                        element.definition.count
                    ),
                });
            };
            self.line += 1;
            if !line.trim_ascii().is_empty() {
                return Ok(respelled(line));
            }
        }
    }
}

/// `.5`, `1.`, `inf` and `nan` in the crate's grammar; NaN becomes infinite, which is as little of a number.
fn respelled(line: &[u8]) -> String {
    let mut spelled = String::with_capacity(line.len() + 8);
    for word in text::words(line) {
        match text::parse::<f64>(word).filter(|_| !is_plain(word)) {
            Some(f64::NEG_INFINITY) => spelled += &format!("-{INFINITE}"),
            Some(value) if !value.is_finite() => spelled += INFINITE,
            Some(value) => spelled += &value.to_string(),
            None => spelled += &text::decoded(word),
        }
        spelled.push(' ');
    }
    spelled
}

/// Digits, perhaps a point and digits, perhaps an exponent.
fn is_plain(word: &[u8]) -> bool {
    let unsigned = word.strip_prefix(b"-").or(word.strip_prefix(b"+"));
    let mut digits_before = false;
    for &b in unsigned.unwrap_or(word) {
        match b {
            b'0'..=b'9' => digits_before = true,
            b'.' | b'e' | b'E' if digits_before => digits_before = false,
            b'+' | b'-' => {}
            _ => return false,
        }
    }
    digits_before
}

/// A vertex.
#[derive(Default)]
pub(super) struct Vertex {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    pub(super) texcoord: Vec2,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let target = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "s" => &mut self.texcoord.x,
            "t" => &mut self.texcoord.y,
            _ => return PropertyAccessResult::Ignored,
        };
        let value = match property {
            Property::Float(x) => x,
            Property::Double(x) => x as f32,
            _ => match integer(&property) {
                Some(x) => x as f32,
                None => return PropertyAccessResult::UnsupportedType,
            },
        };
        *target = value;
        PropertyAccessResult::Set
    }
}

fn integer(property: &Property) -> Option<i64> {
    match *property {
        Property::Char(x) => Some(x.into()),
        Property::UChar(x) => Some(x.into()),
        Property::Short(x) => Some(x.into()),
        Property::UShort(x) => Some(x.into()),
        Property::Int(x) => Some(x.into()),
        Property::UInt(x) => Some(x.into()),
        _ => None,
    }
}

/// A face, or strips.
#[derive(Default)]
pub(super) struct Face {
    pub(super) corners: Vec<i64>,
    /// Two for each corner.
    pub(super) texcoords: Vec<f32>,
    pub(super) texture: i32,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match (name, property) {
            ("corners", property) => match integers(property) {
                Some(corners) => self.corners = corners,
                None => return PropertyAccessResult::UnsupportedType,
            },
            ("texcoord", Property::ListFloat(list)) => self.texcoords = list,
            ("texcoord", Property::ListDouble(list)) => {
                self.texcoords = list.into_iter().map(|x| x as f32).collect();
            }
            ("texnumber", property) => match integer(&property).map(i32::try_from) {
                Some(texture) => self.texture = texture.unwrap_or(-1),
                None => return PropertyAccessResult::UnsupportedType,
            },
            ("texcoord", _) => return PropertyAccessResult::UnsupportedType,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn integers(property: Property) -> Option<Vec<i64>> {
    Some(match property {
        Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
        Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
        Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
        Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
        _ => return None,
    })
}

/// An element that is read past.
pub(super) struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
