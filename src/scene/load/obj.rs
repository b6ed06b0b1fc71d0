//! Wavefront OBJ: vertices first, then the faces over them.
//!
//! A positive index may name what stands further down, so the file is gone through twice.

mod tags;

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::num::NonZeroU32;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::mtl::Libraries;
use super::polygon::Triangulator;
use super::{FileSharpness, LoadMeshErrorKind, LoadOptions, LoadedFile, Parts, Unused, text};

/// Reads the bytes of the file at `path`.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    options: LoadOptions,
) -> Result<LoadedFile, LoadMeshErrorKind> {
    let text = text::plain(bytes).map_err(|line| LoadMeshErrorKind::NotText { line })?;
    let data = Data::read(&text)?;
    let mut libraries = Libraries::new(path, &data.materials);
    for name in &data.libraries {
        libraries.open(name);
    }
    let mut faces = Faces::new(&data, &libraries, options);
    for (line, statement) in text::statements(&text) {
        faces.statement(line, &statement)?;
    }
    let more = faces.warnings();
    let (parts, sharpness) = (faces.parts, faces.sharpness);
    let mut unused = data.unused();
    let (materials, files, mut warnings) = libraries.finish(&mut unused);
    warnings.extend(more);
    Ok(LoadedFile {
        parts: parts.finish(|index| materials.get(index).cloned()),
        sharpness,
        warnings,
        unused,
        files,
        ..LoadedFile::default()
    })
}

/// What faces refer to.
#[derive(Default)]
struct Data {
    positions: Vec<Vec3>,
    texcoords: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// What stands after `mtllib`, each once, in the file's order.
    libraries: Vec<Vec<u8>>,
    /// Names after `usemtl`.
    materials: BTreeSet<String>,
    /// How many vertices have colours.
    coloured: usize,
    /// What smoothing groups are called.
    smoothing: BTreeSet<Vec<u8>>,
    /// Lines of statements that are not read, by keyword.
    others: BTreeMap<Vec<u8>, usize>,
}

impl Data {
    fn read(text: &[u8]) -> Result<Self, LoadMeshErrorKind> {
        let mut data = Self::default();
        let mut libraries = HashSet::new();
        for (line, statement) in text::statements(text) {
            let (keyword, rest) = text::split_word(&statement);
            let syntax = |expected| syntax(line, &statement, expected);
            match keyword {
                b"v" => data.position(rest).map_err(syntax)?,
                b"vt" => {
                    let texcoord = numbers::<2>(rest, 1);
                    let texcoord = texcoord.ok_or_else(|| syntax("`vt` and 1 to 3 numbers"))?;
                    data.texcoords.push(texcoord.into());
                }
                b"vn" => {
                    let normal = numbers::<3>(rest, 3);
                    let normal = normal.ok_or_else(|| syntax("`vn` and 3 numbers"))?;
                    data.normals.push(normal.into());
                }
                b"usemtl" => {
                    data.materials.insert(material_name(rest));
                }
                b"mtllib" => {
                    if libraries.insert(rest.to_owned()) {
                        data.libraries.push(rest.to_owned());
                    }
                }
                b"s" => {
                    data.smoothing.insert(rest.to_owned());
                }
                b"f" | b"fo" | b"o" | b"g" | b"t" | b"" => {}
                other => *data.others.entry(other.to_owned()).or_default() += 1,
            }
        }
        Ok(data)
    }

    /// What has no effect. One smoothing group for all is what is done anyhow, and normals of the file leave nothing to smooth.
    fn unused(&self) -> Unused {
        let mut unused = Unused::default();
        if self.coloured > 0 {
            unused.add_of("colours", self.coloured, "vertex");
        }
        if self.normals.is_empty() && self.smoothing.len() > 1 {
            unused.add(self.smoothing.len(), "group of smoothing");
        }
        for (keyword, &lines) in &self.others {
            unused.add_of(&text::shown(keyword), lines, "line");
        }
        unused
    }

    /// Three numbers, perhaps a weight, perhaps a colour.
    fn position(&mut self, rest: &[u8]) -> Result<(), &'static str> {
        let position = numbers::<3>(rest, 3).ok_or("`v` and 3 numbers")?;
        let mut more = text::words(rest).skip(3);
        let mut position = Vec3::from(position);
        match (more.next(), more.next()) {
            (Some(weight), None) => {
                let weight = text::parse(weight).filter(|&w: &f32| w != 0.0);
                position /= weight.ok_or("a weight w other than 0")?;
            }
            (_, colour) => self.coloured += usize::from(colour.is_some()),
        }
        self.positions.push(position);
        Ok(())
    }
}

/// Faces become parts as they are read.
struct Faces<'a> {
    data: &'a Data,
    libraries: &'a Libraries<'a>,
    parts: Parts,
    /// Per part and indices of position, texture coordinate and normal, the part's vertex.
    vertices: HashMap<(u32, Corner), u32>,
    triangulator: Triangulator,
    group: String,
    material: Option<usize>,
    so_far: Counts,
    /// Of the face at hand.
    corners: Vec<Corner>,
    positions: Vec<Vec3>,
    sharpness: FileSharpness,
    without_normals: Dropped,
    without_texcoords: Dropped,
    unread_tags: Dropped,
}

/// Indices, counted from 1 as the file counts.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Corner {
    v: NonZeroU32,
    vt: Option<NonZeroU32>,
    vn: Option<NonZeroU32>,
}

/// What the index stands for.
fn of<T: Copy>(values: &[T], index: NonZeroU32) -> T {
    values[index.get() as usize - 1]
}

/// How many of each have been defined above a face: negative indices count back from there.
#[derive(Default)]
struct Counts {
    v: usize,
    vt: usize,
    vn: usize,
}

/// Lines that lost something, faces most of them.
#[derive(Default)]
struct Dropped {
    lines: usize,
    first_line: usize,
}

impl Dropped {
    fn add(&mut self, line: usize) {
        if self.lines == 0 {
            self.first_line = line;
        }
        self.lines += 1;
    }

    fn warning(&self, what: &str, lines: &str) -> Option<String> {
        let Self {
            lines: count,
            first_line,
        } = self;
        (*count > 0).then(|| format!("{what}: {count} {lines}, the first at line {first_line}"))
    }
}

impl<'a> Faces<'a> {
    fn new(data: &'a Data, libraries: &'a Libraries<'a>, options: LoadOptions) -> Self {
        Self {
            data,
            libraries,
            parts: Parts::default(),
            vertices: HashMap::new(),
            triangulator: Triangulator::new(options.keep_polygons),
            group: String::new(),
            material: None,
            so_far: Counts::default(),
            corners: Vec::new(),
            positions: Vec::new(),
            sharpness: FileSharpness::default(),
            without_normals: Dropped::default(),
            without_texcoords: Dropped::default(),
            unread_tags: Dropped::default(),
        }
    }

    fn statement(&mut self, line: usize, statement: &[u8]) -> Result<(), LoadMeshErrorKind> {
        let (keyword, rest) = text::split_word(statement);
        match keyword {
            b"v" => self.so_far.v += 1,
            b"vt" => self.so_far.vt += 1,
            b"vn" => self.so_far.vn += 1,
            b"o" | b"g" => self.group = text::decoded(rest),
            b"usemtl" => self.material = self.libraries.index(&material_name(rest)),
            b"f" | b"fo" => {
                self.read_corners(line, rest)?;
                if self.corners.len() < 3 {
                    return Err(syntax(line, statement, "a face of at least 3 corners"));
                }
                self.add_face();
            }
            b"t" => {
                let positions = &self.data.positions;
                if tags::read(rest, positions, &mut self.sharpness).is_none() {
                    self.unread_tags.add(line);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads a face into `corners`: all of them have texture coordinates, or none.
    fn read_corners(&mut self, line: usize, rest: &[u8]) -> Result<(), LoadMeshErrorKind> {
        self.corners.clear();
        let (mut normals, mut texcoords) = (Kept::default(), Kept::default());
        for word in text::words(rest) {
            let [v, vt, vn] = indices(word)
                .ok_or_else(|| syntax(line, word, "v, v/vt, v//vn or v/vt/vn in whole numbers"))?;
            let count = self.data.positions.len();
            let v = v.unwrap_or(0);
            let v = resolve(v, self.so_far.v, count).ok_or_else(|| {
                LoadMeshErrorKind::IndexOutOfRange {
                    place: format!("line {line}"),
                    what: "vertex",
                    index: v,
                    count: if v < 0 { self.so_far.v } else { count },
                    counted: " (counted from 1)",
                }
            })?;
            let vt = texcoords.keep(vt, self.so_far.vt, self.data.texcoords.len(), |_| true);
            let finite = |i| of(&self.data.normals, i).is_finite();
            let vn = normals.keep(vn, self.so_far.vn, self.data.normals.len(), finite);
            self.corners.push(Corner { v, vt, vn });
        }
        if normals.some_refused {
            self.without_normals.add(line);
        }
        if texcoords.some && texcoords.some_missing {
            self.without_texcoords.add(line);
        }
        if texcoords.some_missing {
            self.corners.iter_mut().for_each(|c| c.vt = None);
        }
        Ok(())
    }

    fn add_face(&mut self) {
        let positions = self.corners.iter().map(|c| of(&self.data.positions, c.v));
        self.positions.clear();
        self.positions.extend(positions);
        let textured = self.corners[0].vt.is_some();
        let part = self.parts.open(&self.group, self.material, textured, None);
        let keeps_polygons = self.triangulator.keeps_polygons();
        let triangles = self.triangulator.cut(&self.positions);
        if keeps_polygons {
            self.parts.parts[part].fans.push(triangles.len() as u32);
        }
        for triangle in triangles {
            let triangle = triangle.map(|i| {
                let corner = self.corners[i as usize];
                match self.vertices.entry((part as u32, corner)) {
                    Entry::Occupied(known) => *known.get(),
                    Entry::Vacant(new) => *new.insert(self.parts.push_vertex(
                        part,
                        self.positions[i as usize],
                        corner.vn.map(|vn| of(&self.data.normals, vn)),
                        corner.vt.map(|vt| of(&self.data.texcoords, vt)),
                    )),
                }
            });
            self.parts.parts[part].mesh.triangles.push(triangle);
        }
    }

    fn warnings(&self) -> Vec<String> {
        let lost = [
            self.without_normals.warning(
                "normals are out of range or not finite, and are computed instead",
                "faces",
            ),
            self.without_texcoords.warning(
                "texture coordinates are out of range or missing at a corner, and are left out",
                "faces",
            ),
            self.unread_tags.warning(
                "creases or corners for subdivision that are no such, and are left out",
                "lines",
            ),
            self.triangulator.warning(),
        ];
        lost.into_iter().flatten().collect()
    }
}

/// What became of one kind of index in a face.
#[derive(Default)]
struct Kept {
    /// Some corners name one.
    some: bool,
    /// Some corners have none that could be used.
    some_missing: bool,
    /// Some name one that cannot be used.
    some_refused: bool,
}

impl Kept {
    fn keep(
        &mut self,
        index: Option<i64>,
        so_far: usize,
        total: usize,
        good: impl Fn(NonZeroU32) -> bool,
    ) -> Option<NonZeroU32> {
        let kept = index.and_then(|i| resolve(i, so_far, total));
        let kept = kept.filter(|&i| good(i));
        self.some |= index.is_some();
        self.some_missing |= kept.is_none();
        self.some_refused |= index.is_some() && kept.is_none();
        kept
    }
}

/// The index counted from 1; none if there is no such thing. Negative ones count back from here.
fn resolve(index: i64, so_far: usize, total: usize) -> Option<NonZeroU32> {
    let (from_1, count) = match index {
        ..0 => (i64::try_from(so_far).ok()?.checked_add(index + 1)?, so_far),
        _ => (index, total),
    };
    let from_1 = u32::try_from(from_1).ok().and_then(NonZeroU32::new)?;
    (from_1.get() as usize <= count).then_some(from_1)
}

/// Of position, texture coordinate and normal, as written.
fn indices(corner: &[u8]) -> Option<[Option<i64>; 3]> {
    let mut found = [None; 3];
    for (i, part) in corner.split(|&b| b == b'/').enumerate() {
        let index = found.get_mut(i)?;
        if !part.is_empty() {
            *index = Some(text::parse(part)?);
        }
    }
    found[0].is_some().then_some(found)
}

/// The first N numbers, at least so many; the others are 0.
fn numbers<const N: usize>(rest: &[u8], least: usize) -> Option<[f32; N]> {
    let mut values = [0.0; N];
    let mut count = 0;
    for (value, word) in values.iter_mut().zip(text::words(rest)) {
        *value = text::parse(word)?;
        count += 1;
    }
    (count >= least).then_some(values)
}

fn material_name(rest: &[u8]) -> String {
    text::decoded(text::unquoted(rest))
}

fn syntax(line: usize, found: &[u8], expected: &'static str) -> LoadMeshErrorKind {
    LoadMeshErrorKind::Syntax {
        line,
        found: text::shown(found),
        expected,
    }
}

#[cfg(test)]
mod tests;
