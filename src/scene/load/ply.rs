//! Stanford PLY, text and binary, through ply-rs-bw.
//!
//! Read: vertices with normals and texture coordinates, faces with texture coordinates of their own, triangle strips, and the
//! pictures that MeshLab names in comments. Elements are read one by one: what is kept of a file is not larger than the file.

mod header;
mod source;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

use glam::{Vec2, Vec3};
use ply_rs_bw::parser::ParseError;

use super::locate::Locator;
use super::polygon::Triangulator;
use super::{
    FileColor, FileMaterial, FileTexture, FileTextureUse, LoadMeshErrorKind, LoadOptions,
    LoadedFile, Parts, Unused, text,
};
use crate::surface::{UvTransform, Wrap};
use header::{Element, Header, is_list};
use source::{Face, Skipped, Source, Vertex};

/// Reads the bytes of the file at `path`.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    options: LoadOptions,
) -> Result<LoadedFile, LoadMeshErrorKind> {
    let header = Header::read(bytes)?;
    check_counts(&header)?;
    let has = |name: &str| {
        header
            .elements
            .iter()
            .any(|e| e.name == "vertex" && e.has(name))
    };
    if !["x", "y", "z"].into_iter().all(has) {
        return Err(LoadMeshErrorKind::Malformed {
            what: "header".into(),
            problem: "no element `vertex` with the properties x, y and z".into(),
        });
    }
    let mut vertices = Vertices {
        has_normals: ["nx", "ny", "nz"].into_iter().all(has),
        has_texcoords: has("s"),
        ..Vertices::default()
    };
    let vertex = header.elements.iter().find(|e| e.name == "vertex");
    let mut faces = Faces {
        vertices: vertex.map_or(0, |e| e.definition.count),
        ..Faces::default()
    };
    let mut source = Source::new(&header);
    for element in &header.elements {
        match &element.name[..] {
            "vertex" => vertices.read(&mut source, element)?,
            "face" => faces.read(&mut source, element)?,
            "tristrips" => faces.read_strips(&mut source, element)?,
            _ => {
                for number in 0..element.definition.count {
                    source.next::<Skipped>(element, number)?;
                }
            }
        }
    }
    let mut unused = left_out(&header);
    let mut warnings = Vec::new();
    let mut locator = Locator::default();
    let materials: Vec<_> = header
        .textures
        .iter()
        .map(|name| textured_material(&mut locator, path, name, &mut warnings))
        .collect();
    let lost = vertices.lost_normals;
    let triangulator = Triangulator::new(options.keep_polygons);
    let mut builder = Builder::new(vertices, &faces, materials.len(), triangulator);
    builder.add(&faces);
    if lost > 0 {
        warnings.push(format!(
            "normals are not finite, and are computed instead: {lost} vertices"
        ));
    }
    unused.add(faces.too_few, "face of fewer than three corners");
    warnings.extend(builder.triangulator.warning());
    let parts = builder.finish();
    let textured = parts
        .parts
        .iter()
        .any(|part| !part.mesh.texcoords.is_empty());
    if !textured {
        unused.add(materials.len(), "texture (no texture coordinates)");
    }
    Ok(LoadedFile {
        parts: parts.finish(|index| materials.get(index).cloned()),
        warnings,
        unused,
        ..LoadedFile::default()
    })
}

/// Every element takes at least a byte, so a count beyond the bytes left is a lie; without this an element
/// without properties would be read for ever.
fn check_counts(header: &Header) -> Result<(), LoadMeshErrorKind> {
    let bytes_left = header.body.len();
    for element in &header.elements {
        let count = element.definition.count;
        if count > bytes_left {
            return Err(LoadMeshErrorKind::Malformed {
                what: format!("element {:?}", element.name),
                problem: format!(
                    "the header promises {count} of them, but only {bytes_left} bytes follow; is the file cut off?"
                ),
            });
        }
        if element.has("corners") && !is_list(element, "corners") {
            return Err(LoadMeshErrorKind::Malformed {
                what: format!("vertex indices of element {:?}", element.name),
                problem: "expected a list".into(),
            });
        }
    }
    Ok(())
}

/// What the header announces that is not read: properties of elements that are, and other elements.
fn left_out(header: &Header) -> Unused {
    let mut unused = Unused::default();
    for element in &header.elements {
        let Element { name, others, .. } = element;
        if ["vertex", "face", "tristrips"].contains(&&name[..]) {
            for property in others {
                unused.name(&format!("{name}.{property}"));
            }
        } else if element.definition.count > 0 {
            unused.add(element.definition.count, &format!("element {name}"));
        }
    }
    unused
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

/// White under the picture that a comment names.
fn textured_material(
    locator: &mut Locator,
    path: &Path,
    name: &[u8],
    warnings: &mut Vec<String>,
) -> FileMaterial {
    let located = locator.locate(path, name);
    let from = "comment TextureFile".to_owned();
    warnings.extend(located.note.map(|note| format!("{from}: {note}")));
    FileMaterial {
        name: text::decoded(name),
        base_color: FileColor {
            factor: Vec3::ONE,
            texture: Some(FileTextureUse {
                source: FileTexture::Path(located.path),
                wrap: [Wrap::default(); 2],
                uv: UvTransform::default(),
                from,
            }),
        },
        ..FileMaterial::default()
    }
}

/// What the element `vertex` holds.
#[derive(Default)]
struct Vertices {
    positions: Vec<Vec3>,
    has_normals: bool,
    normals: Vec<Vec3>,
    has_texcoords: bool,
    texcoords: Vec<Vec2>,
    lost_normals: usize,
}

impl Vertices {
    fn read(&mut self, source: &mut Source, element: &Element) -> Result<(), LoadMeshErrorKind> {
        for number in 0..element.definition.count {
            let vertex: Vertex = source.next(element, number)?;
            if !vertex.position.is_finite() {
                return Err(LoadMeshErrorKind::Malformed {
                    what: source.place(element, number),
                    problem: "a coordinate is not a finite number".into(),
                });
            }
            self.positions.push(vertex.position);
            if self.has_normals {
                let finite = vertex.normal.is_finite();
                self.lost_normals += usize::from(!finite);
                // Zero stands for one that is missing.
                self.normals
                    .push(if finite { vertex.normal } else { Vec3::ZERO });
            }
            if self.has_texcoords {
                self.texcoords.push(vertex.texcoord);
            }
        }
        Ok(())
    }
}

/// Polygons one after the other. Vertices may come after them in a file, so they are kept until both are there.
#[derive(Default)]
struct Faces {
    /// How many vertices there will be.
    vertices: usize,
    polygons: Vec<Polygon>,
    corners: Vec<u32>,
    /// Texture coordinates of corners, for the polygons that have their own.
    texcoords: Vec<Vec2>,
    too_few: usize,
}

struct Polygon {
    corners: usize,
    /// Whether it has texture coordinates of its own.
    textured: bool,
    texture: i32,
}

impl Faces {
    fn read(&mut self, source: &mut Source, element: &Element) -> Result<(), LoadMeshErrorKind> {
        let own_texcoords = element.has("texcoord");
        for number in 0..element.definition.count {
            let face: Face = source.next(element, number)?;
            let count = face.corners.len();
            if own_texcoords && ![0, 2 * count].contains(&face.texcoords.len()) {
                return Err(LoadMeshErrorKind::Malformed {
                    what: source.place(element, number),
                    problem: format!(
                        "{} numbers are its texture coordinates; expected two for each of its {count} corners",
                        face.texcoords.len()
                    ),
                });
            }
            let textured = own_texcoords && !face.texcoords.is_empty();
            let texcoords = face
                .texcoords
                .as_chunks()
                .0
                .iter()
                .map(|&st| Vec2::from_array(st));
            if count < 3 {
                self.too_few += 1;
                continue;
            }
            self.texcoords.extend(texcoords);
            for index in face.corners {
                self.push_corner(index, &element.name, number)?;
            }
            self.polygons.push(Polygon {
                corners: count,
                textured,
                texture: face.texture,
            });
        }
        Ok(())
    }

    /// Strips as Stanford's tools write them: -1 ends one and begins the next.
    fn read_strips(
        &mut self,
        source: &mut Source,
        element: &Element,
    ) -> Result<(), LoadMeshErrorKind> {
        for number in 0..element.definition.count {
            let strips: Face = source.next(element, number)?;
            for strip in strips.corners.split(|&index| index == -1) {
                for (i, triangle) in strip.windows(3).enumerate() {
                    let &[a, b, c] = triangle else { continue };
                    // Strips turn corners by naming one twice.
                    if a == b || b == c || c == a {
                        continue;
                    }
                    let [a, b] = if i % 2 == 0 { [a, b] } else { [b, a] };
                    for index in [a, b, c] {
                        self.push_corner(index, &element.name, number)?;
                    }
                    self.polygons.push(Polygon {
                        corners: 3,
                        textured: false,
                        texture: 0,
                    });
                }
            }
        }
        Ok(())
    }

    fn push_corner(
        &mut self,
        index: i64,
        what: &str,
        number: usize,
    ) -> Result<(), LoadMeshErrorKind> {
        let vertex = u32::try_from(index)
            .ok()
            .filter(|&i| (i as usize) < self.vertices);
        self.corners
            .push(vertex.ok_or_else(|| LoadMeshErrorKind::IndexOutOfRange {
                place: format!("{what} {number}"),
                what: "vertex",
                index,
                count: self.vertices,
                counted: " (counted from 0)",
            })?);
        Ok(())
    }
}

/// Makes parts of faces: one for each texture, with and without texture coordinates.
struct Builder {
    vertices: Vertices,
    textures: usize,
    parts: Parts,
    /// There is one part, and its vertices are the file's.
    whole: bool,
    /// Else: per part, vertex and texture coordinates, the part's vertex.
    known: HashMap<(u32, u32, Option<[u32; 2]>), u32>,
    triangulator: Triangulator,
}

impl Builder {
    fn new(vertices: Vertices, faces: &Faces, textures: usize, triangulator: Triangulator) -> Self {
        Self {
            vertices,
            textures,
            whole: faces.texcoords.is_empty() && textures == 0,
            parts: Parts::default(),
            known: HashMap::new(),
            triangulator,
        }
    }

    fn add(&mut self, faces: &Faces) {
        let (mut corners, mut texcoords) = (&faces.corners[..], &faces.texcoords[..]);
        let mut positions = Vec::new();
        for polygon in &faces.polygons {
            let (these, others) = corners.split_at(polygon.corners);
            corners = others;
            let own = polygon.textured.then(|| {
                let (own, others) = texcoords.split_at(polygon.corners);
                texcoords = others;
                own
            });
            let corner = |&index: &u32| self.vertices.positions[index as usize];
            positions.clear();
            positions.extend(these.iter().map(corner));
            self.add_polygon(polygon, these, &positions, own);
        }
    }

    fn add_polygon(
        &mut self,
        polygon: &Polygon,
        corners: &[u32],
        positions: &[Vec3],
        own: Option<&[Vec2]>,
    ) {
        let textured = own.is_some() || self.vertices.has_texcoords;
        let texture = usize::try_from(polygon.texture).ok();
        let texture = texture.filter(|&t| textured && t < self.textures);
        let part = self.parts.open("", texture, textured, None);
        let keeps_polygons = self.triangulator.keeps_polygons();
        let triangles = self.triangulator.cut(positions);
        if keeps_polygons {
            self.parts.parts[part].fans.push(triangles.len() as u32);
        }
        for triangle in triangles {
            let triangle = triangle.map(|i| {
                let i = i as usize;
                if self.whole {
                    return corners[i];
                }
                let vertex = corners[i] as usize;
                let texcoord = match own {
                    Some(own) => Some(own[i]),
                    None => self.vertices.texcoords.get(vertex).copied(),
                };
                let key = (
                    part as u32,
                    corners[i],
                    texcoord.map(|st| st.to_array().map(f32::to_bits)),
                );
                match self.known.entry(key) {
                    Entry::Occupied(known) => *known.get(),
                    Entry::Vacant(new) => *new.insert(self.parts.push_vertex(
                        part,
                        positions[i],
                        self.vertices.normals.get(vertex).copied(),
                        texcoord,
                    )),
                }
            });
            self.parts.parts[part].mesh.triangles.push(triangle);
        }
    }

    fn finish(mut self) -> Parts {
        if let ([part], true) = (&mut self.parts.parts[..], self.whole) {
            part.mesh.positions = self.vertices.positions;
            part.mesh.normals = self.vertices.normals;
            part.mesh.texcoords = self.vertices.texcoords;
        }
        self.parts
    }
}

#[cfg(test)]
mod tests;
