//! Compressed glTF primitives (KHR_draco_mesh_compression) through the draco-core crate.
//!
//! A stream says itself how much it unpacks to, and a few bytes can claim gigabytes. So the decoder is held to
//! what the primitive's accessors announce, and that to what a stream of its length can plausibly carry.

use std::collections::BTreeMap;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute};
use serde::Deserialize;

use crate::files::guard::guarded;

use super::gltf::Kind;

/// Most vertices or triangles per byte of a stream. Regular grids need a few hundredths of a bit each.
const COUNT_PER_BYTE: usize = 4096;

/// Most bytes of attributes per vertex; tangents, colours and joints are decoded, too, and dropped.
const BYTES_PER_VERTEX: u64 = 256;

/// The extension's object in a primitive.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    /// The buffer view with the stream.
    pub buffer_view: usize,
    /// From semantics (`POSITION`) to the ids that the stream knows its attributes by.
    pub attributes: BTreeMap<String, u32>,
}

/// What the accessors of the primitive announce.
#[derive(Clone, Copy, Debug)]
pub(super) struct Announced {
    pub vertices: usize,
    pub triangles: usize,
}

/// A stream unpacked; indices are not checked against its vertices.
#[derive(Debug)]
pub(super) struct Unpacked {
    mesh: Mesh,
    triangles: Vec<[u32; 3]>,
}

/// Unpacks a stream.
///
/// # Errors
///
/// A sentence for the user, if the stream is damaged or larger than announced.
pub(super) fn decode(stream: &[u8], announced: Announced) -> Result<Unpacked, String> {
    let limits = limits(stream.len(), announced)?;
    // The crate means never to panic; that is too much to rely on for every damaged stream.
    let mesh = guarded(|| {
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
        MeshDecoder::new().decode(&mut buffer, &mut mesh)?;
        Ok::<_, draco_core::DracoError>(mesh)
    })?
    .map_err(|e| e.to_string())?;
    Ok(Unpacked {
        triangles: mesh.faces().iter().map(|f| f.map(|p| p.0)).collect(),
        mesh,
    })
}

impl Unpacked {
    pub fn vertices(&self) -> usize {
        self.mesh.num_points()
    }

    /// The triangles, which are gone then.
    pub fn take_triangles(&mut self) -> Vec<[u32; 3]> {
        std::mem::take(&mut self.triangles)
    }

    /// The values of the attribute that the stream knows by `id`, one per vertex; integers perhaps as fractions of their type's
    /// largest.
    ///
    /// # Errors
    ///
    /// A sentence for the user that names `semantic`, if there is no such attribute or it is of another type.
    pub fn values<const N: usize>(
        &self,
        semantic: &str,
        id: u32,
        kinds: &[Kind],
        normalized: bool,
    ) -> Result<Vec<[f32; N]>, String> {
        let attribute: &PointAttribute = self
            .mesh
            .attribute_by_unique_id(id)
            .ok_or_else(|| format!("it has no attribute {id}, named as its {semantic}"))?;
        let (found, components) = (attribute.data_type(), attribute.num_components());
        let kind = kind(found).filter(|kind| kinds.contains(kind) && usize::from(components) == N);
        let kind = kind.ok_or_else(|| {
            let expected: Vec<_> = kinds.iter().map(Kind::to_string).collect();
            let expected = expected.join(" or ");
            format!("its {semantic} has {components} components of {found:?}; expected {N} of {expected}")
        })?;
        let flat = attribute.read_f32s(self.mesh.num_points(), N);
        let (values, _) = flat.as_chunks::<N>();
        let to_float = |x| kind.to_float(x, normalized);
        Ok(values.iter().map(|v| v.map(to_float)).collect())
    }
}

/// The type as glTF has it.
fn kind(found: DataType) -> Option<Kind> {
    Some(match found {
        DataType::Int8 => Kind::I8,
        DataType::Uint8 => Kind::U8,
        DataType::Int16 => Kind::I16,
        DataType::Uint16 => Kind::U16,
        DataType::Uint32 => Kind::U32,
        DataType::Float32 => Kind::F32,
        _ => return None,
    })
}

/// What the decoder may unpack; an error if the announcement itself is absurd.
fn limits(bytes: usize, announced: Announced) -> Result<DecodeLimits, String> {
    let Announced {
        vertices,
        triangles,
    } = announced;
    let most = bytes.saturating_mul(COUNT_PER_BYTE);
    for (what, count) in [("vertices", vertices), ("triangles", triangles)] {
        if count > most {
            return Err(format!(
                "its accessors announce {count} {what}, more than {bytes} bytes can hold"
            ));
        }
    }
    // Vertices that were one before may be split for every corner where attributes have seams.
    let vertices = vertices.max(triangles.saturating_mul(3)) as u64;
    let usual = DecodeLimits::default();
    Ok(usual
        .with_max_faces(usual.max_faces.min(triangles as u64))
        .with_max_points(usual.max_points.min(vertices))
        .with_max_decoded_bytes(
            usual
                .max_decoded_bytes
                .min(vertices.saturating_mul(BYTES_PER_VERTEX)),
        ))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::gltf::FLOATS;
    use super::*;
    use draco_core::{
        EncoderBuffer, EncoderOptions, GeometryAttributeType, MeshEncoder, PointIndex,
    };
    use glam::{Vec2, Vec3};

    /// Squares along one side of the test sheet.
    const SIDE: u32 = 6;

    /// What the sheet's accessors would announce.
    pub const SHEET: Announced = Announced {
        vertices: ((SIDE + 1) * (SIDE + 1)) as usize,
        triangles: (2 * SIDE * SIDE) as usize,
    };

    /// The sheet's place over texture coordinates (s, t).
    fn place([s, t]: [f32; 2]) -> Vec3 {
        Vec3::new(3.0 * s, 2.0 * t, s * t)
    }

    fn attribute<const N: usize>(
        kind: GeometryAttributeType,
        values: &[[f32; N]],
    ) -> PointAttribute {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, N as u8, DataType::Float32, false, values.len());
        for (i, value) in values.as_flattened().iter().enumerate() {
            attribute.buffer_mut().write(4 * i, &value.to_le_bytes());
        }
        attribute
    }

    /// A curved sheet with normals (all up) and texture coordinates.
    pub fn sheet(level: i32) -> Vec<u8> {
        let at = |i: u32| i as f32 / SIDE as f32;
        let texcoords: Vec<[f32; 2]> = (0..=SIDE)
            .flat_map(|j| (0..=SIDE).map(move |i| [at(i), at(j)]))
            .collect();
        let positions: Vec<_> = texcoords.iter().map(|&st| place(st).to_array()).collect();
        let normals = vec![[0.0, 0.0, 1.0]; positions.len()];
        let mut mesh = Mesh::new();
        mesh.set_num_points(positions.len());
        mesh.add_attribute(attribute(GeometryAttributeType::Position, &positions));
        mesh.add_attribute(attribute(GeometryAttributeType::Normal, &normals));
        mesh.add_attribute(attribute(GeometryAttributeType::TexCoord, &texcoords));
        for (i, j) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |i| (i, j))) {
            let corner = |di, dj| PointIndex((j + dj) * (SIDE + 1) + i + di);
            mesh.add_face([corner(0, 0), corner(1, 0), corner(1, 1)]);
            mesh.add_face([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
        let mut options = EncoderOptions::new();
        options.set_compression_level(level);
        for (id, bits) in [(0, 14), (1, 10), (2, 14)] {
            options.set_attribute_quantization(id, bits);
        }
        let mut encoder = MeshEncoder::new();
        encoder.set_mesh(mesh);
        let mut out = EncoderBuffer::new();
        encoder.encode(&options, &mut out).unwrap();
        out.data().to_vec()
    }

    fn floats<const N: usize>(unpacked: &Unpacked, id: u32) -> Result<Vec<[f32; N]>, String> {
        unpacked.values("SHEET", id, FLOATS, false)
    }

    #[test]
    fn what_was_encoded_comes_back_at_every_level() {
        for level in 0..=10 {
            let sheet = decode(&sheet(level), SHEET).unwrap();
            assert_eq!(sheet.triangles.len(), SHEET.triangles, "level {level}");
            assert_eq!(sheet.vertices(), SHEET.vertices, "level {level}");
            let positions = floats::<3>(&sheet, 0).unwrap();
            let normals = floats::<3>(&sheet, 1).unwrap();
            let texcoords = floats::<2>(&sheet, 2).unwrap();
            let mut area = 0.0;
            for t in &sheet.triangles {
                for i in t.map(|i| i as usize) {
                    let there = place(texcoords[i]);
                    assert!((Vec3::from(positions[i]) - there).length() < 1e-3);
                    assert!((Vec3::from(normals[i]) - Vec3::Z).length() < 1e-2);
                }
                let [a, b, c] = t.map(|i| Vec2::from(texcoords[i as usize]));
                area += 0.5 * (b - a).perp_dot(c - a);
            }
            // Every square once, none turned over.
            assert!((area - 1.0).abs() < 1e-3, "level {level}: {area}");
        }
    }

    #[test]
    fn a_stream_cut_off_anywhere_is_refused() {
        for level in [0, 7] {
            let whole = sheet(level);
            for length in 0..whole.len() {
                let result = decode(&whole[..length], SHEET);
                assert!(
                    result.is_err(),
                    "level {level}: {length} of {}",
                    whole.len()
                );
            }
        }
    }

    #[test]
    fn damaged_bytes_never_panic_nor_exceed_what_was_announced() {
        for level in [0, 7] {
            let whole = sheet(level);
            for position in 0..whole.len() {
                for flip in [0x01, 0x80, 0xff] {
                    let mut damaged = whole.clone();
                    damaged[position] ^= flip;
                    if let Ok(mesh) = decode(&damaged, SHEET) {
                        assert!(mesh.triangles.len() <= SHEET.triangles);
                        assert!(mesh.vertices() <= 3 * SHEET.triangles);
                    }
                }
            }
        }
    }

    #[test]
    fn more_than_announced_and_absurd_announcements_are_refused() {
        let stream = sheet(7);
        let fewer = Announced {
            triangles: SHEET.triangles - 1,
            ..SHEET
        };
        assert!(decode(&stream, fewer).is_err());
        let absurd = Announced {
            vertices: usize::MAX,
            ..SHEET
        };
        let error = decode(&stream, absurd).unwrap_err();
        assert!(error.contains("announce"), "{error}");
    }

    #[test]
    fn attributes_are_known_by_id_and_shape() {
        let sheet = decode(&sheet(7), SHEET).unwrap();
        let refused = |id, kinds| {
            let error = sheet.values::<3>("NORMAL", id, kinds, false).unwrap_err();
            assert!(error.contains("NORMAL"), "{error}");
        };
        assert!(floats::<3>(&sheet, 1).is_ok());
        refused(9, FLOATS);
        refused(2, FLOATS);
        refused(1, &[Kind::I8]);
    }
}
