//! Base meshes from the caller's arrays. What hits name are the caller's primitives and vertices, whatever had to be left out.

use glam::{Vec2, Vec3};

use super::buffer::Vertices;
use super::error::Failure;
use crate::surface::{BaseMesh, MeshBuilder, NormalMode, TimeStep, has_area};

/// The parts of a base mesh that do not move.
pub struct Base {
    /// Of the vertices that are used.
    texcoords: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    /// The caller's vertices that are used, in their order.
    used: Vec<u32>,
    vertex_count: usize,
    primitives: u32,
    owners: Owners,
}

/// Whose the triangles are.
enum Owners {
    /// Triangle i is primitive i.
    Same,
    /// Triangle i is of primitive n / 2, and the second half of it where n is odd; ascending.
    Halves(Vec<u32>),
}

/// A place on a triangle.
pub struct Place {
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
    /// Whether u and v run against the caller's.
    pub is_turned: bool,
}

/// The caller's primitives.
pub enum Primitives {
    Triangles(Vec<[u32; 3]>),
    Quads(Vec<[u32; 4]>),
}

impl Primitives {
    /// Triangles are counted in 32 bits, also those of quads; walls at seams come behind them.
    pub const MOST: u32 = u32::MAX / 8;

    fn len(&self) -> usize {
        match self {
            Self::Triangles(all) => all.len(),
            Self::Quads(all) => all.len(),
        }
    }

    /// Of one primitive.
    fn triangles(&self, prim: usize) -> [Option<[u32; 3]>; 2] {
        match self {
            Self::Triangles(all) => [Some(all[prim]), None],
            Self::Quads(all) => {
                let [a, b, c, d] = all[prim];
                [Some([a, b, d]), Some([c, d, b])]
            }
        }
    }
}

impl Base {
    /// Leaves out triangles without area (at `positions`), also those of quads with two equal corners, and vertices that nobody uses.
    pub fn new(
        primitives: Primitives,
        positions: &[[f32; 3]],
        texcoords: &[[f32; 2]],
    ) -> Result<Self, Failure> {
        let vertex_count = positions.len();
        let count = primitives.len();
        let mut triangles = Vec::new();
        let mut owners = Vec::new();
        for prim in 0..count {
            for (second, triangle) in primitives.triangles(prim).into_iter().flatten().enumerate() {
                if let Some(index) = triangle.iter().find(|&&i| i as usize >= vertex_count) {
                    return Err(Failure::data(format!(
                        "primitive {prim} refers to vertex {index}, but there are {vertex_count} (counted from 0)"
                    )));
                }
                // What is no number is told of below.
                let corners = triangle.map(|i| Vec3::from_array(positions[i as usize]));
                if has_area(corners) || corners.iter().any(|p| !p.is_finite()) {
                    triangles.push(triangle);
                    owners.push(2 * prim as u32 + second as u32);
                }
            }
        }
        let mut new = vec![u32::MAX; vertex_count];
        for &i in triangles.as_flattened() {
            new[i as usize] = 0;
        }
        let used: Vec<u32> = (0..vertex_count as u32)
            .filter(|&i| new[i as usize] == 0)
            .collect();
        for (k, &i) in used.iter().enumerate() {
            new[i as usize] = k as u32;
        }
        for i in triangles.as_flattened_mut() {
            *i = new[*i as usize];
        }
        let is_same =
            owners.len() == count && owners.iter().enumerate().all(|(i, &n)| n == 2 * i as u32);
        Ok(Self {
            texcoords: used
                .iter()
                .map(|&i| Vec2::from_array(texcoords[i as usize]))
                .collect(),
            triangles,
            used,
            vertex_count,
            primitives: count as u32,
            owners: if is_same {
                Owners::Same
            } else {
                Owners::Halves(owners)
            },
        })
    }

    /// How many vertices the caller's arrays have.
    pub fn vertex_count(&self) -> usize {
        self.vertex_count
    }

    /// The used ones of the caller's vertices.
    pub fn step(&self, vertices: &Vertices) -> TimeStep {
        let pick = |all: &[[f32; 3]]| -> Vec<Vec3> {
            let used = self.used.iter();
            used.map(|&i| Vec3::from_array(all[i as usize])).collect()
        };
        TimeStep {
            positions: pick(&vertices.positions),
            normals: vertices.normals.as_deref().map(pick).unwrap_or_default(),
        }
    }

    /// The mesh with its vertices at a step.
    pub fn mesh(&self, step: &TimeStep) -> Result<BaseMesh, Failure> {
        let builder = MeshBuilder {
            positions: step.positions.clone(),
            normals: step.normals.clone(),
            texcoords: self.texcoords.clone(),
            triangles: self.triangles.clone(),
        };
        let (mesh, report) = builder.build(NormalMode::File)?;
        if report.degenerate_dropped > 0 {
            return Err(Failure::data(format!(
                "{} triangles that had an area have none with these vertices",
                report.degenerate_dropped
            )));
        }
        Ok(mesh)
    }

    /// From a triangle or wall to the caller's primitive, with its u and v.
    pub fn to_caller(&self, prim: u32, u: f32, v: f32) -> (u32, f32, f32) {
        let Owners::Halves(owners) = &self.owners else {
            return (prim, u, v);
        };
        let Some(&owner) = owners.get(prim as usize) else {
            return (prim - owners.len() as u32 + self.primitives, u, v);
        };
        if owner & 1 == 0 {
            (owner / 2, u, v)
        } else {
            (owner / 2, 1.0 - u, 1.0 - v)
        }
    }

    /// The way back. `None` where the primitive is not there or has no area.
    pub fn to_triangle(&self, prim: u32, u: f32, v: f32) -> Option<Place> {
        let straight = |triangle| Place {
            triangle,
            u,
            v,
            is_turned: false,
        };
        let Owners::Halves(owners) = &self.owners else {
            return Some(straight(prim));
        };
        if prim >= self.primitives {
            let wall = (prim - self.primitives).checked_add(owners.len() as u32)?;
            return Some(straight(wall));
        }
        let first = owners.partition_point(|&n| n < 2 * prim);
        let is_of = |i: usize| owners.get(i).is_some_and(|&n| n / 2 == prim);
        let second = if is_of(first) && is_of(first + 1) {
            first + usize::from(u + v > 1.0)
        } else {
            first
        };
        if !is_of(second) {
            return None;
        }
        let place = straight(second as u32);
        Some(if owners[second] & 1 == 0 {
            place
        } else {
            Place {
                u: 1.0 - u,
                v: 1.0 - v,
                is_turned: true,
                ..place
            }
        })
    }
}
