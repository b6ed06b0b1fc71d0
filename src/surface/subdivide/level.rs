//! One level of refinement: faces over vertices and edges, how sharp these are, and a point for each vertex.

use std::collections::HashMap;

use glam::DVec3;

use super::Scheme;

/// Faces by their corners, one face after the other.
///
/// A *corner* is a place in `corners`; the edge from it to the face's next corner stands at the same place in `sides`. Sharpness is
/// 0 for what is smooth and infinite for what always stays sharp; in between it is the number of refinements for which it lasts.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    /// Where the corners of each face start, and where the last ones end.
    pub starts: Vec<u32>,
    /// The vertex of each corner.
    pub corners: Vec<u32>,
    /// The edge that leads from each corner to the next.
    pub sides: Vec<u32>,
    /// The two vertices of each edge.
    pub edges: Vec<[u32; 2]>,
    pub edge_sharpness: Vec<f64>,
    pub vertex_sharpness: Vec<f64>,
    pub points: Vec<DVec3>,
}

impl Level {
    pub fn faces(&self) -> usize {
        self.starts.len() - 1
    }

    /// The corners of a face.
    pub fn corners_of(&self, face: usize) -> std::ops::Range<usize> {
        self.starts[face] as usize..self.starts[face + 1] as usize
    }

    /// Which face each corner is of.
    pub fn face_of_corners(&self) -> impl Iterator<Item = u32> {
        (0..self.faces()).flat_map(|f| self.corners_of(f).map(move |_| f as u32))
    }

    pub fn point(&self, corner: usize) -> DVec3 {
        self.points[self.corners[corner] as usize]
    }

    /// The other end of an edge.
    pub fn across(&self, edge: u32, vertex: u32) -> u32 {
        let [a, b] = self.edges[edge as usize];
        if a == vertex { b } else { a }
    }

    /// The corners at each vertex.
    pub fn corners_at_vertices(&self) -> Lists {
        Lists::new(self.points.len(), &self.corners)
    }

    /// The level of polygons over points. Edges of one face, of more than two, and of two that do not turn the same way are infinitely
    /// sharp; so are vertices of one face only, those whose faces do not all hang together by edges, and those at which one such edge ends.
    ///
    /// Faces have at least three corners, and no two that follow one another are the same.
    pub fn new(starts: Vec<u32>, corners: Vec<u32>, points: Vec<DVec3>) -> Self {
        let mut level = Self {
            starts,
            vertex_sharpness: vec![0.0; points.len()],
            sides: Vec::with_capacity(corners.len()),
            corners,
            points,
            ..Self::default()
        };
        let mut known: HashMap<[u32; 2], u32> = HashMap::new();
        for face in 0..level.faces() {
            for (corner, next) in around(level.corners_of(face)) {
                let (a, b) = (level.corners[corner], level.corners[next]);
                let edge = *known.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    level.edges.push([a, b]);
                    level.edges.len() as u32 - 1
                });
                level.sides.push(edge);
            }
        }
        drop(known);
        // Edges stand as their first face has them.
        let mut forward = vec![0_u32; level.edges.len()];
        let mut backward = vec![0_u32; level.edges.len()];
        for (&vertex, &edge) in level.corners.iter().zip(&level.sides) {
            let count = match level.edges[edge as usize][0] == vertex {
                true => &mut forward,
                false => &mut backward,
            };
            count[edge as usize] += 1;
        }
        let counts = forward.iter().zip(&backward);
        level.edge_sharpness = counts
            .map(|counts| match counts {
                (1, 1) => 0.0,
                _ => f64::INFINITY,
            })
            .collect();
        level.pin_loose_vertices();
        level
    }

    /// Vertices of one face, of several that do not hang together by edges, and of one edge alone that is sharp by its faces.
    fn pin_loose_vertices(&mut self) {
        // Disjoint sets of corners at one vertex.
        let mut parents: Vec<u32> = (0..self.corners.len() as u32).collect();
        fn root(parents: &mut [u32], mut corner: u32) -> u32 {
            while parents[corner as usize] != corner {
                parents[corner as usize] = parents[parents[corner as usize] as usize];
                corner = parents[corner as usize];
            }
            corner
        }
        // Of each edge, the first corners seen at its two ends.
        let mut seen = vec![[u32::MAX; 2]; self.edges.len()];
        let mut sets = vec![0_u32; self.points.len()];
        let mut faces = vec![0_u32; self.points.len()];
        for face in 0..self.faces() {
            for (corner, next) in around(self.corners_of(face)) {
                sets[self.corners[corner] as usize] += 1;
                faces[self.corners[corner] as usize] += 1;
                let edge = self.sides[corner] as usize;
                for corner in [corner, next] {
                    let end = usize::from(self.edges[edge][0] != self.corners[corner]);
                    let first = &mut seen[edge][end];
                    if *first == u32::MAX {
                        *first = corner as u32;
                    }
                    let (a, b) = (
                        root(&mut parents, *first),
                        root(&mut parents, corner as u32),
                    );
                    parents[a.max(b) as usize] = a.min(b);
                }
            }
        }
        for (corner, &vertex) in self.corners.iter().enumerate() {
            sets[vertex as usize] -= u32::from(parents[corner] != corner as u32);
        }
        let mut sharp = vec![0_u32; self.points.len()];
        for (edge, _) in (self.edges.iter().zip(&self.edge_sharpness)).filter(|e| *e.1 > 0.0) {
            edge.iter().for_each(|&vertex| sharp[vertex as usize] += 1);
        }
        for (vertex, sharpness) in self.vertex_sharpness.iter_mut().enumerate() {
            if sets[vertex] > 1 || faces[vertex] == 1 || sharp[vertex] == 1 {
                *sharpness = f64::INFINITY;
            }
        }
    }

    /// The faces with these corners alone, which are all those of one vertex; it becomes vertex 0 and lies at 0. With the numbers that the
    /// corners have then.
    pub fn around(&self, corners: &[u32], faces: impl Fn(u32) -> usize) -> (Self, Vec<u32>) {
        let center = self.corners[corners[0] as usize];
        let old = || corners.iter().map(|&c| self.corners_of(faces(c)));
        let sorted = |mut all: Vec<u32>| {
            all.sort_unstable();
            all.dedup();
            all
        };
        let all = old().flat_map(|face| self.corners[face].iter().copied());
        let others = sorted(all.filter(|&v| v != center).collect());
        let sides = sorted(
            old()
                .flat_map(|face| self.sides[face].iter().copied())
                .collect(),
        );
        // All are found: they were sorted from the same faces.
        let place = |all: &[u32], one: u32| all.partition_point(|&other| other < one) as u32;
        let vertex = |old: u32| match old == center {
            true => 0,
            false => 1 + place(&others, old),
        };
        let vertices = || [center].into_iter().chain(others.iter().copied());
        let origin = self.points[center as usize];
        let mut part = Self {
            starts: vec![0],
            points: vertices()
                .map(|v| self.points[v as usize] - origin)
                .collect(),
            vertex_sharpness: vertices()
                .map(|v| self.vertex_sharpness[v as usize])
                .collect(),
            edges: (sides.iter())
                .map(|&e| self.edges[e as usize].map(vertex))
                .collect(),
            edge_sharpness: sides
                .iter()
                .map(|&e| self.edge_sharpness[e as usize])
                .collect(),
            ..Self::default()
        };
        let mut at_center = Vec::with_capacity(corners.len());
        for (face, &corner) in old().zip(corners) {
            at_center.push((part.corners.len() + corner as usize - face.start) as u32);
            for c in face {
                part.corners.push(vertex(self.corners[c]));
                part.sides.push(place(&sides, self.sides[c]));
            }
            part.starts.push(part.corners.len() as u32);
        }
        (part, at_center)
    }

    /// Of the limit's masks: each face has as many corners as the scheme's regular one.
    pub fn is_regular(&self, scheme: Scheme) -> bool {
        let sizes = self.starts.windows(2).map(|s| s[1] - s[0]);
        sizes.into_iter().all(|n| n == scheme.corners() as u32)
    }
}

/// The places of a face's corners, each with the one that follows.
pub(super) fn around(corners: std::ops::Range<usize>) -> impl Iterator<Item = (usize, usize)> {
    let (first, end) = (corners.start, corners.end);
    corners.map(move |c| (c, if c + 1 == end { first } else { c + 1 }))
}

/// Lists of numbers, one per key.
pub(super) struct Lists {
    starts: Vec<u32>,
    values: Vec<u32>,
}

impl Lists {
    /// For each of `count` keys the places at which it stands in `keys`, in order.
    fn new(count: usize, keys: &[u32]) -> Self {
        let mut starts = vec![0_u32; count + 2];
        for &key in keys {
            starts[key as usize + 2] += 1;
        }
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut values = vec![0; keys.len()];
        for (place, &key) in keys.iter().enumerate() {
            let next = &mut starts[key as usize + 1];
            values[*next as usize] = place as u32;
            *next += 1;
        }
        Self { starts, values }
    }

    pub fn of(&self, key: usize) -> &[u32] {
        &self.values[self.starts[key] as usize..self.starts[key + 1] as usize]
    }
}
