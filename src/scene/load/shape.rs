//! Shapes that a scene has without a file.

use glam::{Vec2, Vec3};

use super::{LoadedFile, Part};
use crate::surface::MeshBuilder;

/// A built-in shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::scene) enum Shape {
    /// A square of two triangles: x and z from -1 to 1 at y = 0, facing +y, the whole map on it with u along x and v along -z.
    Plane,
}

impl Shape {
    /// Every shape under its name in scene files.
    pub const NAMES: [(&str, Self); 1] = [("plane", Self::Plane)];

    /// As if it were a file of one part.
    pub fn load(self) -> LoadedFile {
        let (name, mesh) = match self {
            Self::Plane => ("plane", plane()),
        };
        LoadedFile {
            parts: vec![Part {
                name: name.into(),
                mesh,
                material: None,
                instances: Vec::new(),
                fans: vec![2],
            }],
            ..LoadedFile::default()
        }
    }
}

fn plane() -> MeshBuilder {
    let corners = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    MeshBuilder {
        positions: corners.map(|(x, z)| Vec3::new(x, 0.0, z)).to_vec(),
        normals: vec![Vec3::Y; 4],
        texcoords: corners
            .map(|(x, z)| Vec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}
