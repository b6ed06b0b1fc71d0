//! The triangles of one primitive, in the pose of its node: morph targets first, then the skin.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec2, Vec3};

use super::super::draco::{self, Announced, Unpacked};
use super::accessor::{Accessor, Accessors, JOINTS, Kind, QUANTIZED, SIGNED, WEIGHTS};
use super::document::{self, Document, Primitive};
use super::skin::{Influence, Joints};
use super::{LoadMeshErrorKind, malformed};
use crate::scene::load::fan;
use crate::surface::{MeshBuilder, NormalTransform};

/// Codes of primitive modes.
const POINTS: u32 = 0;
pub(super) const LINE_STRIP: u32 = 3;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// How a node poses its mesh.
pub(super) struct Pose<'a> {
    /// Weights of the morph targets.
    pub weights: &'a [f32],
    pub joints: Option<&'a Joints>,
}

/// Reads primitives of one document.
pub(super) struct Reader<'a> {
    pub document: &'a Document,
    pub accessors: &'a Accessors<'a>,
}

/// An attribute, wherever it is from.
enum Values<'a, const N: usize> {
    Accessor(Accessor<'a>),
    Unpacked(Vec<[f32; N]>),
}

impl<const N: usize> Values<'_, N> {
    fn at(&self, vertex: usize) -> [f32; N] {
        match self {
            Self::Accessor(accessor) => accessor.floats(vertex),
            Self::Unpacked(values) => values[vertex],
        }
    }
}

/// A primitive whose attributes are being read.
struct Attributes<'a> {
    reader: &'a Reader<'a>,
    primitive: &'a Primitive,
    unpacked: Option<Unpacked>,
    vertices: usize,
    place: &'a str,
}

impl Reader<'_> {
    /// The triangles in the space of the mesh (of the world, if it has joints), with this set of texture coordinates; none for
    /// points and lines.
    pub fn read(
        &self,
        primitive: &Primitive,
        set: u32,
        pose: &Pose,
        place: &str,
    ) -> Result<MeshBuilder, LoadMeshErrorKind> {
        match primitive.mode {
            TRIANGLES..=FAN => {}
            POINTS..=LINE_STRIP => return Ok(MeshBuilder::default()),
            mode => {
                return Err(malformed(
                    place,
                    format!("its mode is {mode}; expected 0 to 6"),
                ));
            }
        }
        let position = primitive.attributes.get("POSITION").copied();
        let position = position.ok_or_else(|| malformed(place, "it has no POSITION accessor"))?;
        let unpacked = self.unpacked(primitive, position, place)?;
        let vertices = match &unpacked {
            Some(unpacked) => unpacked.vertices(),
            None => self.document.accessors[position].count,
        };
        let mut attributes = Attributes {
            reader: self,
            primitive,
            unpacked,
            vertices,
            place,
        };
        let mut triangles = attributes.triangles()?;
        let used = compact(&mut triangles, vertices);
        let mut mesh = attributes.morphed(&used, set, pose.weights)?;
        mesh.triangles = triangles;
        if let Some(joints) = pose.joints {
            let influences = attributes.influences()?;
            skin(&mut mesh, &used, &influences, joints, place)?;
        }
        Ok(mesh)
    }

    /// The primitive's Draco stream, if it has one.
    fn unpacked(
        &self,
        primitive: &Primitive,
        position: usize,
        place: &str,
    ) -> Result<Option<Unpacked>, LoadMeshErrorKind> {
        let Some(compressed) = primitive.draco() else {
            return Ok(None);
        };
        let what = format!("{place} Draco stream");
        let stream = self.accessors.buffers.view(compressed.buffer_view)?;
        let accessors = &self.document.accessors;
        let announced = Announced {
            vertices: accessors[position].count,
            triangles: primitive.indices.map_or(0, |i| accessors[i].count) / 3,
        };
        let unpacked =
            draco::decode(stream, announced).map_err(|problem| malformed(&what, problem))?;
        Ok(Some(unpacked))
    }
}

impl<'a> Attributes<'a> {
    /// The attribute `semantic` of the primitive, one element per vertex.
    fn values<const N: usize>(
        &self,
        semantic: &str,
        kinds: &[Kind],
    ) -> Result<Option<Values<'a, N>>, LoadMeshErrorKind> {
        let Some(&index) = self.primitive.attributes.get(semantic) else {
            return Ok(None);
        };
        let packed = self.primitive.draco().zip(self.unpacked.as_ref());
        let packed =
            packed.and_then(|(draco, unpacked)| Some((*draco.attributes.get(semantic)?, unpacked)));
        let accessor = &self.reader.document.accessors[index];
        let Some((id, unpacked)) = packed else {
            if accessor.is_nothing() && (semantic == "POSITION" || self.unpacked.is_some()) {
                return Err(self.nothing(semantic));
            }
            let accessor = self.accessor::<N>(semantic, index, kinds)?;
            return Ok(Some(Values::Accessor(accessor)));
        };
        let what = format!("{} Draco stream", self.place);
        let values = unpacked.values::<N>(
            semantic,
            id,
            kinds,
            (accessor.normalized && kinds != JOINTS) || self.is_fraction(semantic),
        );
        let values = values.map_err(|problem| malformed(&what, problem))?;
        if semantic == "POSITION" {
            check_bounds(&values, accessor, &what)?;
        }
        Ok(Some(Values::Unpacked(values)))
    }

    /// The error that an accessor has no bytes where zeros cannot be meant.
    fn nothing(&self, what: &str) -> LoadMeshErrorKind {
        let problem =
            format!("its {what} has no bytes; are they in an extension that is not read?");
        malformed(self.place, problem)
    }

    /// The core specification knows no integers for texture coordinates but fractions, and some exporters do not say so.
    fn is_fraction(&self, semantic: &str) -> bool {
        semantic.starts_with("TEXCOORD_") && !self.reader.document.uses("KHR_mesh_quantization")
    }

    /// An accessor with one element per vertex.
    fn accessor<const N: usize>(
        &self,
        semantic: &str,
        index: usize,
        kinds: &[Kind],
    ) -> Result<Accessor<'a>, LoadMeshErrorKind> {
        let what = format!("{} {semantic}", self.place);
        let accessor = self.reader.accessors.open::<N>(index, kinds, &what)?;
        if accessor.count() != self.vertices {
            let problem = format!(
                "{} elements for {} vertices",
                accessor.count(),
                self.vertices
            );
            return Err(malformed(&what, problem));
        }
        Ok(if self.is_fraction(semantic) {
            accessor.as_fractions()
        } else {
            accessor
        })
    }

    /// The primitive's triangles, each index that of a vertex.
    fn triangles(&mut self) -> Result<Vec<[u32; 3]>, LoadMeshErrorKind> {
        let triangles = match (&mut self.unpacked, self.primitive.indices) {
            // Whatever the mode, a stream holds single triangles.
            (Some(unpacked), _) => unpacked.take_triangles(),
            (None, Some(indices)) if self.reader.document.accessors[indices].is_nothing() => {
                return Err(self.nothing("indices"));
            }
            (None, Some(indices)) => {
                let what = format!("{} indices", self.place);
                let accessor = self.reader.accessors.open_indices(indices, &what)?;
                let indices = |i| accessor.index(i);
                triangles(self.primitive.mode, accessor.count(), indices, self.place)?
            }
            (None, None) => {
                // Before as many indices are made of them.
                self.values::<3>("POSITION", QUANTIZED)?;
                triangles(self.primitive.mode, self.vertices, |i| i as u32, self.place)?
            }
        };
        let mut indices = triangles.as_flattened().iter();
        match indices.find(|&&i| i as usize >= self.vertices) {
            Some(&index) => Err(LoadMeshErrorKind::IndexOutOfRange {
                place: self.place.to_owned(),
                what: "vertex",
                index: index.into(),
                count: self.vertices,
                counted: " (counted from 0)",
            }),
            None => Ok(triangles),
        }
    }

    /// The vertices `used`, with the morph targets added by their weights.
    fn morphed(
        &self,
        used: &[u32],
        set: u32,
        weights: &[f32],
    ) -> Result<MeshBuilder, LoadMeshErrorKind> {
        let targets = &self.primitive.targets;
        if !weights.is_empty() && weights.len() != targets.len() {
            let problem = format!(
                "{} weights for {} morph targets",
                weights.len(),
                targets.len()
            );
            return Err(malformed(self.place, problem));
        }
        let texcoord = format!("TEXCOORD_{set}");
        let positions = self.morphed_values::<3>("POSITION", QUANTIZED, used, weights)?;
        let normals = self.morphed_values::<3>("NORMAL", SIGNED, used, weights)?;
        let texcoords = self.morphed_values::<2>(&texcoord, QUANTIZED, used, weights)?;
        Ok(MeshBuilder {
            positions: positions.into_iter().map(Vec3::from).collect(),
            normals: normals.into_iter().map(Vec3::from).collect(),
            // glTF's v points down.
            texcoords: texcoords
                .into_iter()
                .map(|[s, t]| Vec2::new(s, 1.0 - t))
                .collect(),
            triangles: Vec::new(),
        })
    }

    fn morphed_values<const N: usize>(
        &self,
        semantic: &str,
        kinds: &[Kind],
        used: &[u32],
        weights: &[f32],
    ) -> Result<Vec<[f32; N]>, LoadMeshErrorKind> {
        let Some(values) = self.values::<N>(semantic, kinds)? else {
            return Ok(Vec::new());
        };
        let mut sums: Vec<[f32; N]> = used.iter().map(|&v| values.at(v as usize)).collect();
        let targets = self.primitive.targets.iter().zip(weights);
        for (number, (target, &weight)) in targets
            .enumerate()
            .filter(|(_, (_, weight))| **weight != 0.0)
        {
            let Some(&index) = BTreeMap::get(target, semantic) else {
                continue;
            };
            let name = format!("target {number} {semantic}");
            let deltas = self.accessor::<N>(&name, index, kinds)?;
            for (sum, &vertex) in sums.iter_mut().zip(used) {
                let delta: [f32; N] = deltas.floats(vertex as usize);
                for (sum, delta) in sum.iter_mut().zip(delta) {
                    *sum += weight * delta;
                }
            }
        }
        Ok(sums)
    }

    /// The sets of joints and their weights.
    fn influences(&self) -> Result<Vec<[Values<'a, 4>; 2]>, LoadMeshErrorKind> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = self.values::<4>(&format!("JOINTS_{set}"), JOINTS)?;
            let weights = self.values::<4>(&format!("WEIGHTS_{set}"), WEIGHTS)?;
            match (joints, weights) {
                (Some(joints), Some(weights)) => sets.push([joints, weights]),
                (None, None) if set > 0 => break,
                _ => {
                    let problem = format!(
                        "its node has a skin; expected both JOINTS_{set} and WEIGHTS_{set}"
                    );
                    return Err(malformed(self.place, problem));
                }
            }
        }
        Ok(sets)
    }
}

/// Leaves only the vertices that triangles use: returned in rising order, and renumbered so. Many primitives may share the
/// vertices of one large accessor.
fn compact(triangles: &mut [[u32; 3]], vertices: usize) -> Vec<u32> {
    let mut used = triangles.as_flattened().to_vec();
    used.sort_unstable();
    used.dedup();
    if used.len() < vertices {
        for index in triangles.as_flattened_mut() {
            *index = used.partition_point(|v| v < index) as u32;
        }
    }
    used
}

/// Moves the vertices, numbers `used` of the primitive, by their joints. Where those mirror, triangles are turned round, so that
/// outside stays outside.
fn skin(
    mesh: &mut MeshBuilder,
    used: &[u32],
    influences: &[[Values<4>; 2]],
    joints: &Joints,
    place: &str,
) -> Result<(), LoadMeshErrorKind> {
    let mut mirrored = Vec::with_capacity(used.len());
    let mut all: Vec<Influence> = Vec::new();
    for (i, &vertex) in used.iter().enumerate() {
        all.clear();
        for [joints, weights] in influences {
            all.extend(
                joints
                    .at(vertex as usize)
                    .into_iter()
                    .zip(weights.at(vertex as usize)),
            );
        }
        let blended: Affine3A = joints.blended(&all, vertex as usize, place)?;
        let normals = NormalTransform::new(&blended);
        mesh.positions[i] = blended.transform_point3(mesh.positions[i]);
        if let Some(normal) = mesh.normals.get_mut(i) {
            *normal = normals.apply(*normal);
        }
        mirrored.push(normals.mirrors());
    }
    for triangle in &mut mesh.triangles {
        let corners = triangle.map(|i| usize::from(mirrored[i as usize]));
        if corners.iter().sum::<usize>() >= 2 {
            triangle.swap(1, 2);
        }
    }
    Ok(())
}

/// The triangles of a list, strip or fan, with the winding that the specification gives (section 3.7.2.1).
fn triangles(
    mode: u32,
    count: usize,
    index: impl Fn(usize) -> u32,
    place: &str,
) -> Result<Vec<[u32; 3]>, LoadMeshErrorKind> {
    if mode == TRIANGLES && !count.is_multiple_of(3) {
        let problem = format!("{count} indices; a list of triangles needs a multiple of 3");
        return Err(malformed(place, problem));
    }
    let indices: Vec<u32> = (0..count).map(index).collect();
    Ok(match mode {
        STRIP => {
            let windows = indices.windows(3).enumerate();
            windows
                .map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]])
                .collect()
        }
        FAN => fan(&indices).map(|[first, a, b]| [a, b, first]).collect(),
        _ => indices.as_chunks().0.to_vec(),
    })
}

/// A Draco stream has no checksum, and many a damaged one unpacks to a wild mesh: the box that the accessor
/// must give tells.
fn check_bounds<const N: usize>(
    positions: &[[f32; N]],
    accessor: &document::Accessor,
    what: &str,
) -> Result<(), LoadMeshErrorKind> {
    /// Of the longest side: more than any useful quantisation moves a vertex.
    const SLACK: f32 = 0.05;
    let corner = |numbers: &[f32]| <[f32; N]>::try_from(numbers).ok();
    let Some((min, max)) = corner(&accessor.min).zip(corner(&accessor.max)) else {
        return Ok(());
    };
    // A box of integers is in their own numbers.
    if !accessor.is_float() {
        return Ok(());
    }
    let sides = min.iter().zip(max).map(|(min, max)| max - min);
    let slack = SLACK * sides.fold(0.0, f32::max);
    let inside = |p: &&[f32; N]| (0..N).all(|i| p[i] >= min[i] - slack && p[i] <= max[i] + slack);
    match positions.iter().find(|p| !inside(p)) {
        Some(p) => {
            let problem = format!(
                "it holds the position {p:?}, outside of {min:?} to {max:?} that the file gives; is it damaged?"
            );
            Err(malformed(what, problem))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_turn_the_same_way_as_lists() {
        let of = |mode| triangles(mode, 4, |i| i as u32, "");
        assert_eq!(of(STRIP).unwrap(), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(of(FAN).unwrap(), [[1, 2, 0], [2, 3, 0]]);
        assert!(of(TRIANGLES).is_err());
    }

    #[test]
    fn vertices_that_no_triangle_uses_are_left_out() {
        let mut triangles = [[9, 3, 7], [3, 9, 5]];
        assert_eq!(compact(&mut triangles, 10), [3, 5, 7, 9]);
        assert_eq!(triangles, [[3, 0, 2], [0, 3, 1]]);
        let mut all = [[2, 1, 0]];
        assert_eq!(compact(&mut all, 3), [0, 1, 2]);
        assert_eq!(all, [[2, 1, 0]]);
    }
}
