//! Wavefront OBJ through tobj.
//!
//! tobj says nothing of lines, takes an index that resolves to -1 for a missing one, drops faces of one or
//! two corners, makes triangles of polylines, and knows no continued lines. So the text is first checked
//! and rewritten into the plain statements that it reads without surprise.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::{FileMaterial, LoadMeshErrorKind, LoadedFile, Parts, mtl};
use crate::files::input;
use crate::surface::MeshBuilder;

/// tobj's name for faces before any `o` or `g`.
const UNNAMED: &str = "unnamed_object";

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: true,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Reads the bytes of the file at `path`.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<LoadedFile, LoadMeshErrorKind> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|e| LoadMeshErrorKind::NotText {
        line: 1 + bytes[..e.valid_up_to()]
            .iter()
            .filter(|&&b| b == b'\n')
            .count(),
    })?;
    let plain = Plain::new(text)?;
    let libraries = RefCell::new(Libraries::new(path));
    let mut reader = CountingReader::new(plain.text.as_bytes());
    let loaded = tobj::load_obj_buf(&mut reader, &OPTIONS, |name| {
        libraries.borrow_mut().load(name)
    });
    let (models, materials) = loaded.map_err(|e| plain.fault(text, reader.lines, e))?;
    let libraries = libraries.into_inner();
    let mut warnings = libraries.warnings;
    // Without any library the loader has warned already.
    let materials = materials.unwrap_or_default();
    for name in &plain.materials {
        if !materials.is_empty() && !materials.iter().any(|m| m.name == *name) {
            warnings.push(format!("material {name:?} is in no material library"));
        }
    }
    let several = models.len() > 1;
    let mut parts = Parts::default();
    for model in models {
        let name = if model.name == UNNAMED {
            ""
        } else {
            &model.name
        };
        parts.add(name, model.mesh.material_id, builder(&model.mesh));
    }
    let materials: Vec<FileMaterial> = materials
        .iter()
        .zip(&libraries.of_material)
        .map(|(m, library)| mtl::material(m, library))
        .collect();
    let mut parts = parts.finish(|index| materials.get(index).cloned());
    if several {
        for part in &mut parts {
            share_vertices(&mut part.mesh);
        }
    }
    Ok(LoadedFile {
        parts,
        warnings,
        files: Vec::new(),
    })
}

fn builder(mesh: &tobj::Mesh) -> MeshBuilder {
    // A model's faces are alike in what they have (`Plain` sees to it), so the arrays are full or empty.
    MeshBuilder {
        positions: mesh
            .positions
            .as_chunks()
            .0
            .iter()
            .map(|&p| Vec3::from(p))
            .collect(),
        normals: mesh
            .normals
            .as_chunks()
            .0
            .iter()
            .map(|&n| Vec3::from(n))
            .collect(),
        texcoords: mesh
            .texcoords
            .as_chunks()
            .0
            .iter()
            .map(|&t| Vec2::from(t))
            .collect(),
        triangles: mesh.indices.as_chunks().0.to_vec(),
    }
}

/// Makes vertices one that are alike bit for bit: tobj shares vertices within a group only.
fn share_vertices(mesh: &mut MeshBuilder) {
    let old = std::mem::take(mesh);
    let mut seen = HashMap::with_capacity(old.positions.len());
    let new_index: Vec<u32> = (0..old.positions.len())
        .map(|i| {
            let position = old.positions[i];
            let normal = old.normals.get(i);
            let texcoord = old.texcoords.get(i);
            let key = (
                position.to_array().map(f32::to_bits),
                normal.map(|n| n.to_array().map(f32::to_bits)),
                texcoord.map(|t| t.to_array().map(f32::to_bits)),
            );
            *seen.entry(key).or_insert_with(|| {
                mesh.positions.push(position);
                mesh.normals.extend(normal);
                mesh.texcoords.extend(texcoord);
                (mesh.positions.len() - 1) as u32
            })
        })
        .collect();
    mesh.triangles = old
        .triangles
        .iter()
        .map(|t| t.map(|i| new_index[i as usize]))
        .collect();
}

/// The material libraries that were asked for.
struct Libraries<'a> {
    obj: &'a Path,
    warnings: Vec<String>,
    /// Per material in tobj's order, its library.
    of_material: Vec<PathBuf>,
}

impl<'a> Libraries<'a> {
    fn new(obj: &'a Path) -> Self {
        Self {
            obj,
            warnings: Vec::new(),
            of_material: Vec::new(),
        }
    }

    /// `name` is one file whose name may hold spaces, or several files.
    fn load(&mut self, name: &Path) -> tobj::MTLLoadResult {
        let name = name.to_string_lossy();
        let whole = super::beside(self.obj, &name);
        let files: Vec<PathBuf> = if whole.is_file() {
            vec![whole]
        } else {
            let words = name.split_whitespace();
            words.map(|n| super::beside(self.obj, n)).collect()
        };
        let known = self.of_material.len();
        let mut text = String::new();
        for file in files {
            let cleaned = self.read_library(&file);
            let materials = cleaned.lines().filter(|l| l.starts_with("newmtl "));
            self.of_material.extend(materials.map(|_| file.clone()));
            text += &cleaned;
        }
        tobj::load_mtl_buf(&mut text.as_bytes()).inspect_err(|e| {
            self.of_material.truncate(known);
            self.warnings.push(format!("material library {name}: {e}"));
        })
    }

    /// Its usable statements; none, and a warning, if it cannot be read.
    fn read_library(&mut self, file: &Path) -> String {
        match input::read(file) {
            Ok(bytes) => mtl::clean(&String::from_utf8_lossy(&bytes), file, &mut self.warnings),
            Err(e) => {
                let shown = file.display();
                self.warnings
                    .push(format!("cannot read the material library {shown}: {e}"));
                String::new()
            }
        }
    }
}

/// How many of each element have been defined.
#[derive(Clone, Copy, Default)]
struct Counts {
    v: usize,
    vt: usize,
    vn: usize,
}

impl Counts {
    fn count(&mut self, keyword: &str) {
        match keyword {
            "v" => self.v += 1,
            "vt" => self.vt += 1,
            "vn" => self.vn += 1,
            _ => {}
        }
    }
}

/// The checked and rewritten text.
struct Plain {
    text: String,
    /// Per line of `text`, its line in the file, from 1.
    lines: Vec<usize>,
    /// Names after `usemtl`.
    materials: BTreeSet<String>,
}

impl Plain {
    fn new(text: &str) -> Result<Self, LoadMeshErrorKind> {
        let mut plain = Self {
            text: String::with_capacity(text.len()),
            lines: Vec::new(),
            materials: BTreeSet::new(),
        };
        let mut total = Counts::default();
        for (_, line) in statements(text) {
            total.count(line.split_whitespace().next().unwrap_or(""));
        }
        let mut so_far = Counts::default();
        // tobj keeps one array of normals per group: faces that differ in what they have must not share one.
        let mut group = UNNAMED.to_owned();
        let mut layout = None;
        for (number, line) in statements(text) {
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((&line, ""));
            let rest = rest.trim();
            so_far.count(keyword);
            match keyword {
                "v" => plain.push(number, "v", &coordinates(rest, 3)),
                "vn" => plain.push(number, "vn", &coordinates(rest, 3)),
                "vt" => plain.push(number, "vt", &coordinates(rest, 2)),
                "o" | "g" => {
                    group = if rest.is_empty() { UNNAMED } else { rest }.to_owned();
                    plain.push(number, "g", &group);
                }
                "usemtl" if !rest.is_empty() => {
                    plain.materials.insert(rest.to_owned());
                    plain.push(number, "usemtl", rest);
                }
                "mtllib" => plain.push(number, "mtllib", rest),
                "f" | "fo" => {
                    let this = Some(check_face(number, rest, so_far, total)?);
                    if layout.is_some() && layout != this {
                        plain.push(number, "g", &group);
                    }
                    layout = this;
                    plain.push(number, "f", rest);
                }
                _ => {}
            }
        }
        Ok(plain)
    }

    fn push(&mut self, number: usize, keyword: &str, rest: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.text, "{keyword} {rest}");
        self.lines.push(number);
    }

    /// tobj's error after `read` lines, in the file's terms.
    fn fault(&self, text: &str, read: usize, error: tobj::LoadError) -> LoadMeshErrorKind {
        use tobj::LoadError as E;
        let line = read
            .checked_sub(1)
            .and_then(|i| self.lines.get(i).copied())
            .unwrap_or(0);
        let expected = match error {
            E::PositionParseError => "`v` and 3 numbers",
            E::NormalParseError => "`vn` and 3 numbers",
            E::TexcoordParseError => "`vt` and 1 to 3 numbers",
            E::ScalingByZeroError => "a weight w other than 0",
            _ => {
                return LoadMeshErrorKind::Malformed {
                    what: format!("line {line}"),
                    problem: error.to_string(),
                };
            }
        };
        let found = text.lines().nth(line.saturating_sub(1)).unwrap_or("");
        LoadMeshErrorKind::Syntax {
            line,
            found: found.trim().to_owned(),
            expected,
        }
    }
}

/// The statements without comments, continued lines joined, each with the number of its first line.
fn statements(text: &str) -> impl Iterator<Item = (usize, std::borrow::Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let mut whole = std::borrow::Cow::Borrowed(uncommented(first));
        while whole.ends_with('\\') {
            let joined = whole.to_mut();
            joined.pop();
            joined.push(' ');
            match lines.next() {
                Some((_, next)) => joined.push_str(uncommented(next)),
                None => break,
            }
        }
        Some((number + 1, whole))
    })
}

/// Names may hold a `#`; a comment is a `#` at the start or after a blank.
fn uncommented(line: &str) -> &str {
    let start = line
        .match_indices('#')
        .map(|(i, _)| i)
        .find(|&i| line[..i].ends_with(char::is_whitespace) || i == 0);
    line[..start.unwrap_or(line.len())].trim()
}

/// The numbers that are read: a position keeps a fourth (its weight) but no colours, a missing v is 0.
fn coordinates(rest: &str, wanted: usize) -> String {
    let mut words: Vec<&str> = rest.split_whitespace().collect();
    if words.len() != 4 || wanted != 3 {
        words.truncate(wanted);
    }
    if wanted == 2 && words.len() == 1 {
        words.push("0");
    }
    words.join(" ")
}

/// Which of (texture coordinate, normal) the corners of a face have; all of them must agree.
fn check_face(
    line: usize,
    rest: &str,
    so_far: Counts,
    total: Counts,
) -> Result<[bool; 2], LoadMeshErrorKind> {
    let syntax = |found: &str, expected| LoadMeshErrorKind::Syntax {
        line,
        found: found.to_owned(),
        expected,
    };
    let mut layout = None;
    let mut corners = 0;
    for corner in rest.split_whitespace() {
        let mut parts = corner.split('/');
        let [v, vt, vn] = [(); 3].map(|()| parts.next().unwrap_or(""));
        if v.is_empty() || parts.next().is_some() {
            return Err(syntax(corner, "v, v/vt, v//vn or v/vt/vn"));
        }
        let checks = [
            ("vertex", v, so_far.v, total.v),
            ("texture coordinate", vt, so_far.vt, total.vt),
            ("normal", vn, so_far.vn, total.vn),
        ];
        for (what, text, so_far, total) in checks {
            if text.is_empty() {
                continue;
            }
            let index: i64 = text
                .parse()
                .map_err(|_| syntax(corner, "whole numbers as indices"))?;
            // Negative indices count back from the last one defined so far.
            let good = match index {
                1.. => index as u64 <= total as u64,
                _ => index != 0 && index.unsigned_abs() <= so_far as u64,
            };
            if !good {
                return Err(LoadMeshErrorKind::IndexOutOfRange {
                    place: format!("line {line}"),
                    what,
                    index,
                    count: if index < 0 { so_far } else { total },
                    counted: " (counted from 1)",
                });
            }
        }
        let this = [!vt.is_empty(), !vn.is_empty()];
        if *layout.get_or_insert(this) != this {
            return Err(syntax(rest, "corners that are all of one kind"));
        }
        corners += 1;
    }
    layout
        .filter(|_| corners >= 3)
        .ok_or_else(|| syntax(&format!("f {rest}"), "a face of at least 3 corners"))
}

/// Counts the lines that went through.
struct CountingReader<'a> {
    rest: &'a [u8],
    lines: usize,
}

impl<'a> CountingReader<'a> {
    fn new(rest: &'a [u8]) -> Self {
        Self { rest, lines: 0 }
    }
}

impl std::io::Read for CountingReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.rest.read(buffer)
    }
}

impl std::io::BufRead for CountingReader<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.rest)
    }

    fn consume(&mut self, amount: usize) {
        let (gone, rest) = self.rest.split_at(amount);
        self.lines += gone.iter().filter(|&&b| b == b'\n').count();
        self.rest = rest;
    }
}

#[cfg(test)]
mod tests;
