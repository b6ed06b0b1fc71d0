//! Stanford PLY, text and binary, through ply-rs-bw.

use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    DefaultElement, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType,
};

use super::{LoadMeshErrorKind, LoadedFile, Part, fan};
use crate::surface::MeshBuilder;

/// Reads the bytes of a file. Other elements than `vertex` and `face` are skipped.
pub(super) fn read(bytes: &[u8]) -> Result<LoadedFile, LoadMeshErrorKind> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<DefaultElement>::new()
        .read_header(&mut reader)
        .map_err(|e| malformed("header", &e))?;
    check_counts(&header, reader.get_ref().len())?;
    let has = |name: &str| {
        let vertex = header.elements.get("vertex");
        vertex.is_some_and(|e| e.properties.contains_key(name))
    };
    if !["x", "y", "z"].into_iter().all(has) {
        return Err(LoadMeshErrorKind::Malformed {
            what: "header".into(),
            problem: "no element `vertex` with the properties x, y and z".into(),
        });
    }
    let mut vertices = Vec::new();
    let mut faces = Vec::new();
    for (name, element) in &header.elements {
        let what = format!("element {name:?}");
        match name.as_str() {
            "vertex" => {
                let read = Parser::new().read_payload_for_element(&mut reader, element, &header);
                vertices = read.map_err(|e| malformed(&what, &e))?;
            }
            "face" => {
                let read = Parser::new().read_payload_for_element(&mut reader, element, &header);
                faces = read.map_err(|e| malformed(&what, &e))?;
            }
            _ => {
                Parser::<Skipped>::new()
                    .read_payload_for_element(&mut reader, element, &header)
                    .map_err(|e| malformed(&what, &e))?;
            }
        }
    }
    let has_normals = ["nx", "ny", "nz"].into_iter().all(has);
    let has_texcoords = U_NAMES.into_iter().any(has) && V_NAMES.into_iter().any(has);
    let mesh = builder(&vertices, &faces, has_normals, has_texcoords)?;
    let mut file = LoadedFile::default();
    if !mesh.triangles.is_empty() {
        file.parts.push(Part {
            name: String::new(),
            mesh,
            material: None,
            instances: Vec::new(),
        });
    }
    Ok(file)
}

const U_NAMES: [&str; 4] = ["u", "s", "texture_u", "texture_s"];
const V_NAMES: [&str; 4] = ["v", "t", "texture_v", "texture_t"];

/// Every element takes at least a byte, so a count beyond the bytes left is a lie; without this an element
/// without properties would be read for ever.
fn check_counts(header: &Header, bytes_left: usize) -> Result<(), LoadMeshErrorKind> {
    for (name, element) in &header.elements {
        if element.count > bytes_left {
            return Err(LoadMeshErrorKind::Malformed {
                what: format!("element {name:?}"),
                problem: format!(
                    "the header promises {} of them, but only {bytes_left} bytes follow; is the file cut off?",
                    element.count
                ),
            });
        }
        let named = ["vertex_indices", "vertex_index"];
        for property in named.iter().filter_map(|n| element.properties.get(*n)) {
            if name == "face" && !matches!(property.data_type, PropertyType::List(..)) {
                return Err(LoadMeshErrorKind::Malformed {
                    what: format!("property {:?} of the faces", property.name),
                    problem: "expected a list".into(),
                });
            }
        }
    }
    Ok(())
}

fn malformed(what: &str, error: &ParseError) -> LoadMeshErrorKind {
    // The parser's messages run over several lines.
    let words: Vec<String> = error
        .to_string()
        .split_whitespace()
        .map(str::to_owned)
        .collect();
    let mut problem = words.join(" ");
    if let Some((end, _)) = problem.char_indices().nth(300) {
        problem.truncate(end);
        problem += " ...";
    }
    LoadMeshErrorKind::Malformed {
        what: what.to_owned(),
        problem,
    }
}

fn builder(
    vertices: &[Vertex],
    faces: &[Face],
    has_normals: bool,
    has_texcoords: bool,
) -> Result<MeshBuilder, LoadMeshErrorKind> {
    let mut mesh = MeshBuilder {
        positions: vertices.iter().map(|v| v.position).collect(),
        ..MeshBuilder::default()
    };
    if has_normals {
        mesh.normals = vertices.iter().map(|v| v.normal).collect();
    }
    if has_texcoords {
        mesh.texcoords = vertices.iter().map(|v| v.texcoord).collect();
    }
    for (number, face) in faces.iter().enumerate() {
        let mut corners = Vec::with_capacity(face.corners.len());
        for &index in &face.corners {
            if index < 0 || index as u64 >= vertices.len() as u64 {
                return Err(LoadMeshErrorKind::IndexOutOfRange {
                    place: format!("face {number}"),
                    what: "vertex",
                    index,
                    count: vertices.len(),
                    counted: " (counted from 0)",
                });
            }
            corners.push(index as u32);
        }
        mesh.triangles.extend(fan(&corners));
    }
    Ok(mesh)
}

#[derive(Default)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    texcoord: Vec2,
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
            _ if U_NAMES.contains(&name) => &mut self.texcoord.x,
            _ if V_NAMES.contains(&name) => &mut self.texcoord.y,
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

#[derive(Default)]
struct Face {
    corners: Vec<i64>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that is read past.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_bytes;
    use super::*;

    const PROPERTIES: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty float s\nproperty float t\n\
        element face 1\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";

    /// (x, y, z) of a square, with its normal along z and s = x, t = y.
    const SQUARE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn ascii() -> Vec<u8> {
        let mut text = format!("ply\nformat ascii 1.0\n{PROPERTIES}");
        for [x, y] in SQUARE {
            text += &format!("{x} {y} 0 0 0 1 255 {x} {y}\n");
        }
        text += "7 4 0 1 2 3\n";
        text.into_bytes()
    }

    fn binary(big: bool) -> Vec<u8> {
        let order = if big { "big" } else { "little" };
        let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{PROPERTIES}").into_bytes();
        let mut put = |mut value: Vec<u8>| {
            // Given in big endian.
            if !big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for [x, y] in SQUARE {
            put(x.to_be_bytes().into());
            put(f64::from(y).to_be_bytes().into());
            for value in [0.0_f32, 0.0, 0.0, 1.0] {
                put(value.to_be_bytes().into());
            }
            put(vec![255]);
            put(x.to_be_bytes().into());
            put(y.to_be_bytes().into());
        }
        put(vec![7]);
        put(vec![4]);
        for index in 0..4_i32 {
            put(index.to_be_bytes().into());
        }
        bytes
    }

    #[test]
    fn the_three_encodings_give_the_same_mesh() {
        for bytes in [ascii(), binary(false), binary(true)] {
            let file = load_bytes("m.ply", &bytes).unwrap();
            let mesh = &file.parts[0].mesh;
            let corners = SQUARE.map(Vec2::from);
            assert_eq!(mesh.positions, corners.map(|p| p.extend(0.0)));
            assert_eq!(mesh.texcoords, corners);
            assert_eq!(mesh.normals, [Vec3::Z; 4]);
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        }
    }

    #[test]
    fn a_file_cut_off_anywhere_is_refused() {
        for bytes in [ascii(), binary(false), binary(true)] {
            // Without its last line break the text is still whole.
            for length in 0..bytes.len() - 1 {
                assert!(load_bytes("m.ply", &bytes[..length]).is_err(), "{length}");
            }
        }
    }

    fn replaced(from: &str, to: &str) -> LoadMeshErrorKind {
        let text = String::from_utf8(ascii()).unwrap().replace(from, to);
        load_bytes("m.ply", text.as_bytes()).unwrap_err().kind
    }

    #[test]
    fn counts_beyond_the_file_are_refused_at_once() {
        for count in ["4000000000", "18446744073709551615"] {
            let kind = replaced("element vertex 4", &format!("element vertex {count}"));
            assert!(kind.to_string().contains(count), "{kind}");
            let empty = format!("element nothing {count}\nend_header");
            assert!(
                replaced("end_header", &empty)
                    .to_string()
                    .contains("nothing")
            );
        }
        assert!(matches!(
            replaced("7 4 0", "7 4000000000 0"),
            LoadMeshErrorKind::Malformed { .. }
        ));
    }

    #[test]
    fn indices_out_of_range_name_the_face() {
        for index in [4_i64, -1] {
            let kind = replaced("7 4 0 1 2 3", &format!("7 4 0 1 2 {index}"));
            assert!(
                matches!(&kind, LoadMeshErrorKind::IndexOutOfRange { place, index: i, .. }
                    if place == "face 0" && *i == index),
                "{kind:?}"
            );
        }
    }

    #[test]
    fn headers_without_what_is_needed_are_refused() {
        for (from, to) in [
            ("property double y\n", ""),
            ("property list uchar int vertex", "property int vertex"),
            (
                "property list uchar int vertex",
                "property list uchar float vertex",
            ),
            ("format ascii 1.0\n", ""),
            ("ply\n", "plx\n"),
        ] {
            let kind = replaced(from, to);
            assert!(
                matches!(kind, LoadMeshErrorKind::Malformed { .. }),
                "{to:?}: {kind:?}"
            );
        }
        let points = replaced("vertex_indices", "something_else");
        assert!(matches!(points, LoadMeshErrorKind::NoFaces));
    }
}
