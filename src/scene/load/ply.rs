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
