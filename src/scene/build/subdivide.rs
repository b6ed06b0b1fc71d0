//! The parts of a mesh file as one surface, refined, and parts again: where they meet, the surface goes on smoothly.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};

use super::super::error::AssetError;
use super::super::file::Subdivision;
use super::super::load::polygon::Triangulator;
use super::super::load::{FileSharpness, Part};
use super::{Builder, Shaping, told};
use crate::surface::{Cage, MeshBuilder, MeshError, NormalTransform, Refined, Scheme};

/// Of a part: faces before, the scheme, levels.
pub(super) type Outcome = (usize, Scheme, u32);

/// Whether a file is to be loaded with its polygons: Loop's scheme takes triangles.
pub(super) fn keeps_polygons(subdivision: Option<Subdivision>) -> bool {
    subdivision.is_some_and(|s| s.scheme != Some(Scheme::Loop))
}

impl Builder {
    /// Brings the parts into shape and refines them; their meshes are then final but for validation. Parts that a file places together are one surface.
    pub(super) fn subdivide(
        &mut self,
        path: &Path,
        parts: &mut [Part],
        sharpness: &FileSharpness,
        shaping: &Shaping,
        subdivision: Subdivision,
    ) -> Result<Vec<Outcome>, AssetError> {
        let mut outcomes = vec![None; parts.len()];
        for first in 0..parts.len() {
            if outcomes[first].is_some() {
                continue;
            }
            let together: Vec<usize> = (first..parts.len())
                .filter(|&i| outcomes[i].is_none() && parts[i].instances == parts[first].instances)
                .collect();
            let mut whole = Whole::new(parts, &together);
            let joined = whole.shape(sharpness, shaping);
            let joined = joined.map_err(|source| AssetError::Geometry {
                path: path.to_owned(),
                part: parts[first].name.clone(),
                source,
            })?;
            if let Some(what) = told(&joined) {
                self.warn(path, what);
            }
            let cage = &whole.cage;
            let scheme = subdivision.scheme.unwrap_or(match cage.is_triangles() {
                true => Scheme::Loop,
                false => Scheme::CatmullClark,
            });
            let refined = cage
                .subdivide(scheme, subdivision.levels, shaping.crease_angle)
                .map_err(|source| AssetError::Subdivision {
                    path: path.to_owned(),
                    source,
                })?;
            if refined.left_out > 0 {
                let left_out = refined.left_out;
                let what = "faces of fewer than three different corners were left out";
                self.warn(path, format!("{left_out} {what}"));
            }
            for (number, mesh) in whole.part(&refined, scheme).into_iter().enumerate() {
                let faces = whole.owners.iter().filter(|&&o| o == number as u32);
                outcomes[together[number]] = Some((faces.count(), scheme, subdivision.levels));
                parts[together[number]].mesh = mesh;
            }
        }
        Ok(outcomes.into_iter().flatten().collect())
    }
}

/// Several parts as one cage.
struct Whole {
    cage: Cage,
    mesh: MeshBuilder,
    /// Of each face, the part.
    owners: Vec<u32>,
    /// Of each part, whether it has texture coordinates.
    textured: Vec<bool>,
}

impl Whole {
    /// Takes the meshes of these parts; their normals are the cage's, not the surface's, and are left out.
    fn new(parts: &mut [Part], together: &[usize]) -> Self {
        let is_textured = |&i: &usize| !parts[i].mesh.texcoords.is_empty();
        let textured: Vec<bool> = together.iter().map(is_textured).collect();
        let mut whole = Self {
            cage: Cage::default(),
            mesh: MeshBuilder::default(),
            owners: Vec::new(),
            textured,
        };
        for (owner, &part) in (0..).zip(together) {
            let part = &mut parts[part];
            let mut mesh = std::mem::take(&mut part.mesh);
            mesh.normals.clear();
            if whole.textured.contains(&true) {
                // Parts without have some that are dropped again.
                mesh.texcoords.resize(mesh.positions.len(), Vec2::ZERO);
            }
            let base = whole.mesh.positions.len() as u32;
            let mut triangles = &mesh.triangles[..];
            let mut fans = part.fans.iter().map(|&n| n as usize);
            while !triangles.is_empty() {
                let (fan, rest) = triangles.split_at(fans.next().unwrap_or(1));
                triangles = rest;
                let Some(&[a, b, _]) = fan.first() else {
                    continue;
                };
                let corners = [a, b].into_iter().chain(fan.iter().map(|t| t[2]));
                let corners = corners.map(|i| i.wrapping_add(base));
                whole.cage.corners.extend(corners);
                whole.cage.sizes.push(fan.len() as u32 + 2);
                whole.owners.push(owner);
            }
            whole.mesh.append(mesh);
        }
        whole
    }

    /// Transforms and joins; the cage is then whole.
    fn shape(
        &mut self,
        sharpness: &FileSharpness,
        shaping: &Shaping,
    ) -> Result<crate::surface::Joined, MeshError> {
        // By the place that the file has them at, before anything moves.
        let named = self.sharp_vertices(sharpness);
        self.mesh = std::mem::take(&mut self.mesh).transformed(&shaping.transform);
        if NormalTransform::new(&shaping.transform).mirrors() {
            let mut corners = &mut self.cage.corners[..];
            for &size in &self.cage.sizes {
                let (face, rest) = corners.split_at_mut(size as usize);
                face.reverse();
                corners = rest;
            }
        }
        let tolerance = shaping.join.unwrap_or_else(|| self.mesh.rounding());
        let joined = self.mesh.join(tolerance)?;
        self.cage.positions = std::mem::take(&mut self.mesh.positions);
        self.cage.texcoords = std::mem::take(&mut self.mesh.texcoords);
        (self.cage.creases, self.cage.sharp_vertices) = named;
        Ok(joined)
    }

    fn sharp_vertices(&self, sharpness: &FileSharpness) -> (Vec<Crease>, Vec<(u32, f32)>) {
        if *sharpness == FileSharpness::default() {
            return Default::default();
        }
        let bits = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let positions = (0..).zip(&self.mesh.positions);
        let known: HashMap<_, u32> = positions.map(|(i, &p)| (bits(p), i)).collect();
        let vertex = |p: Vec3| known.get(&bits(p)).copied();
        let creases = sharpness.creases.iter();
        let creases = creases.filter_map(|&([a, b], s)| Some(([vertex(a)?, vertex(b)?], s)));
        let corners = sharpness.corners.iter();
        let corners = corners.filter_map(|&(p, s)| Some((vertex(p)?, s)));
        (creases.collect(), corners.collect())
    }

    /// The refined faces of each part, quads by their better diagonal.
    fn part(&self, refined: &Refined, scheme: Scheme) -> Vec<MeshBuilder> {
        let size = scheme.corners();
        let mut faces: Vec<Vec<u32>> = vec![Vec::new(); self.textured.len()];
        for (face, &origin) in (0..).zip(&refined.origins) {
            faces[self.owners[origin as usize] as usize].push(face);
        }
        let mut triangulator = Triangulator::new(false);
        // Of each vertex, the last part that has it and its number there.
        let mut numbers = vec![(u32::MAX, 0); refined.positions.len()];
        let parts = (0..).zip(&faces).zip(&self.textured);
        let part = |((part, faces), &is_textured): ((u32, &Vec<u32>), &bool)| {
            let mut mesh = MeshBuilder::default();
            for &face in faces {
                let first = face as usize * size;
                let corners = &refined.corners[first..first + size];
                let positions: Vec<Vec3> = corners
                    .iter()
                    .map(|&i| refined.positions[i as usize])
                    .collect();
                for triangle in triangulator.cut(&positions) {
                    let triangle = triangle.map(|i| {
                        let vertex = corners[i as usize] as usize;
                        let number = &mut numbers[vertex];
                        if number.0 != part {
                            *number = (part, mesh.positions.len() as u32);
                            mesh.positions.push(refined.positions[vertex]);
                            mesh.normals.push(refined.normals[vertex]);
                            if is_textured {
                                mesh.texcoords.extend(refined.texcoords.get(vertex));
                            }
                        }
                        number.1
                    });
                    mesh.triangles.push(triangle);
                }
            }
            mesh
        };
        parts.map(part).collect()
    }
}

/// An edge and its sharpness.
type Crease = ([u32; 2], f32);

#[cfg(test)]
mod tests;
