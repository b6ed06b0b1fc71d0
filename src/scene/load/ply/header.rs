//! The header of a PLY file, made ready for `ply-rs-bw`.
//!
//! The crate wants UTF-8, LF, plain identifiers and each name once. Exporters write names with blanks and signs, comments in any
//! encoding, and the same property twice, so the header is read here first and handed on with the names that matter.

use std::collections::HashSet;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, PropertyType};

use super::super::{LoadMeshErrorKind, text};
use super::malformed;

/// Pairs of names for the texture coordinates of vertices; the first pair that a file has is read as `s` and `t`.
const TEXCOORDS: [[&str; 2]; 7] = [
    ["s", "t"],
    ["u", "v"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
    ["s0", "t0"],
    ["u0", "v0"],
    ["texcoord_u", "texcoord_v"],
];

/// What the properties that are read are called here, and in files.
const VERTEX: [(&str, &[&str]); 6] = [
    ("x", &["x"]),
    ("y", &["y"]),
    ("z", &["z"]),
    ("nx", &["nx", "normal_x"]),
    ("ny", &["ny", "normal_y"]),
    ("nz", &["nz", "normal_z"]),
];
const FACE: [(&str, &[&str]); 3] = [
    ("corners", &["vertex_indices", "vertex_index"]),
    ("texcoord", &["texcoord", "texcoords"]),
    ("texnumber", &["texnumber", "texture_number"]),
];

/// What the header says.
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// What follows the header, and the line it begins on, from 1.
    pub(super) body: &'a [u8],
    pub(super) body_line: usize,
    /// Names after `comment TextureFile`, as MeshLab writes them.
    pub(super) textures: Vec<&'a [u8]>,
}

/// An element.
pub(super) struct Element {
    /// As the file has it.
    pub(super) name: String,
    /// With the names of this reader.
    pub(super) definition: ElementDef,
    /// The file's names that are not read.
    pub(super) others: Vec<String>,
}

impl Element {
    pub(super) fn has(&self, property: &str) -> bool {
        self.definition.properties.contains_key(property)
    }
}

/// An element's lines.
struct Raw {
    name: String,
    count: String,
    /// Types and name of each property.
    properties: Vec<(String, String)>,
}

impl<'a> Header<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, LoadMeshErrorKind> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let mut lines = text::lines(bytes).enumerate();
        let (_, (_, first)) = lines.next().unwrap_or((0, (0, b"")));
        if first.trim_ascii() != b"ply" {
            return Err(broken(1, first, "`ply`"));
        }
        let mut format = None;
        let mut textures = Vec::new();
        let mut raw: Vec<Raw> = Vec::new();
        for (number, (start, line)) in lines {
            let (keyword, rest) = text::split_word(line);
            let broken = |expected| broken(number + 1, line, expected);
            match keyword {
                b"" | b"obj_info" => {}
                b"comment" => {
                    if let (b"TextureFile", name) = text::split_word(rest) {
                        textures.push(text::unquoted(name));
                    }
                }
                b"format" => format = Some(text::decoded(rest)),
                b"element" => {
                    raw.push(element(rest).ok_or_else(|| broken("`element NAME COUNT`"))?)
                }
                b"property" => {
                    let property = property(rest);
                    let into = raw.last_mut().zip(property);
                    let (element, property) =
                        into.ok_or_else(|| broken("`property TYPE NAME` of an element"))?;
                    element.properties.push(property);
                }
                b"end_header" => {
                    let ends = Ends::of(&bytes[first.len()..]);
                    let (encoding, elements) = definitions(format, &raw)?;
                    return Ok(Self {
                        encoding,
                        elements,
                        body: ends.strip(&bytes[start + line.len()..]),
                        body_line: number + 2,
                        textures,
                    });
                }
                _ => return Err(broken("a statement of a PLY header")),
            }
        }
        Err(LoadMeshErrorKind::Malformed {
            what: "header".into(),
            problem: "it does not end with `end_header`; is the file cut off?".into(),
        })
    }
}

/// How the header's lines end: behind `end_header` numbers may begin with what looks like a line's end.
enum Ends {
    Lf,
    Cr,
    CrLf,
}

impl Ends {
    fn of(behind_first_line: &[u8]) -> Self {
        match behind_first_line {
            [b'\r', b'\n', ..] => Self::CrLf,
            [b'\r', ..] => Self::Cr,
            _ => Self::Lf,
        }
    }

    fn strip(self, behind_last_line: &[u8]) -> &[u8] {
        match (self, behind_last_line) {
            (Self::CrLf | Self::Lf, [b'\r', b'\n', rest @ ..])
            | (Self::Cr, [b'\r', rest @ ..])
            | (_, [b'\n', rest @ ..]) => rest,
            (_, rest) => rest,
        }
    }
}

fn broken(line: usize, found: &[u8], expected: &'static str) -> LoadMeshErrorKind {
    LoadMeshErrorKind::Malformed {
        what: "header".into(),
        problem: format!(
            "line {line}: found {:?}; expected {expected}",
            text::shown(found)
        ),
    }
}

/// A name may hold blanks: the count is the last word.
fn element(rest: &[u8]) -> Option<Raw> {
    let rest = text::decoded(rest);
    let (name, count) = rest.rsplit_once(char::is_whitespace)?;
    Some(Raw {
        name: name.trim().to_owned(),
        count: count.to_owned(),
        properties: Vec::new(),
    })
}

/// Types and name.
fn property(rest: &[u8]) -> Option<(String, String)> {
    let (first, after) = text::split_word(rest);
    let (types, name) = if first == b"list" {
        let (count, after) = text::split_word(after);
        let (item, name) = text::split_word(after);
        ([first, count, item].join(&b' '), name)
    } else {
        (first.to_vec(), after)
    };
    (!name.is_empty()).then(|| (text::decoded(&types), text::decoded(name)))
}

/// The crate's definitions, from a header with names of our own.
fn definitions(
    format: Option<String>,
    raw: &[Raw],
) -> Result<(Encoding, Vec<Element>), LoadMeshErrorKind> {
    let mut header = "ply\n".to_owned();
    if let Some(format) = format {
        header += &format!("format {format}\n");
    }
    let mut known = HashSet::new();
    let mut others = Vec::new();
    for (number, element) in raw.iter().enumerate() {
        let read = ["vertex", "face", "tristrips"].contains(&&element.name[..]);
        if read && !known.insert(&element.name) {
            return Err(LoadMeshErrorKind::Malformed {
                what: "header".into(),
                problem: format!("it has two elements {:?}", element.name),
            });
        }
        header += &format!("element _{number} {}\n", element.count);
        let names = own_names(element);
        for (i, (types, _)) in element.properties.iter().enumerate() {
            match names[i] {
                Some(name) => header += &format!("property {types} {name}\n"),
                None => header += &format!("property {types} _{i}\n"),
            }
        }
        let unread = element.properties.iter().zip(&names);
        let unread = unread.filter(|(_, name)| name.is_none());
        others.push(unread.map(|((_, name), _)| name.clone()).collect());
    }
    header += "end_header\n";
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut Reader::new(header.as_bytes()))
        .map_err(|e| malformed("header", &e))?;
    let definitions = header.elements.into_values();
    let elements = definitions.zip(raw).zip(others);
    let elements = elements.map(|((definition, raw), others)| Element {
        name: raw.name.clone(),
        definition,
        others,
    });
    Ok((header.encoding, elements.collect()))
}

/// For each property what it is called here, if it is read; of two with one name the first.
fn own_names(element: &Raw) -> Vec<Option<&'static str>> {
    let place = |wanted: &str| {
        element
            .properties
            .iter()
            .position(|(_, name)| name == wanted)
    };
    let mut names = vec![None; element.properties.len()];
    let table: &[(&str, &[&str])] = match &element.name[..] {
        "vertex" => &VERTEX,
        "face" => &FACE,
        "tristrips" => &FACE[..1],
        _ => &[],
    };
    for (own, spellings) in table {
        if let Some(i) = spellings.iter().find_map(|name| place(name)) {
            names[i] = Some(*own);
        }
    }
    if element.name == "vertex" {
        let pairs = TEXCOORDS.iter().map(|pair| pair.map(place));
        if let Some([s, t]) = pairs.filter_map(|[s, t]| Some([s?, t?])).next() {
            (names[s], names[t]) = (Some("s"), Some("t"));
        }
    }
    names
}

/// That `property` is a list.
pub(super) fn is_list(element: &Element, property: &str) -> bool {
    let found = element.definition.properties.get(property);
    found.is_some_and(|p| matches!(p.data_type, PropertyType::List(..)))
}
