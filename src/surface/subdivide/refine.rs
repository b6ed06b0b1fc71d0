//! From a level to the next: Catmull and Clark 1978, Loop 1987; creases and corners by DeRose, Kass and Truong 1998, blended where their
//! sharpness ends, as OpenSubdiv blends them.
//!
//! Vertices of the next level are those of this one, then one per edge, then (Catmull-Clark) one per face. Its face `c` is the one at
//! this level's corner `c`, and that corner is its first; behind those Loop has the middle triangle of each face.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Scheme;
use super::level::{Level, around};

/// What is left of a sharpness after a refinement.
fn less(sharpness: f64) -> f64 {
    (sharpness - 1.0).max(0.0)
}

/// How a vertex moves.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    /// As its whole neighbourhood says; a vertex where one crease ends, too.
    Smooth,
    /// Along the two sharp edges.
    Crease,
    /// Not at all.
    Corner,
}

impl Rule {
    pub fn of(vertex_sharpness: f64, sharp_edges: u32) -> Self {
        match sharp_edges {
            _ if vertex_sharpness > 0.0 => Self::Corner,
            0 | 1 => Self::Smooth,
            2 => Self::Crease,
            _ => Self::Corner,
        }
    }
}

/// Loop's weight of each of n neighbours.
pub(super) fn loop_weight(n: f64) -> f64 {
    let a = 3.0 / 8.0 + (TAU / n).cos() / 4.0;
    (5.0 / 8.0 - a * a) / n
}

/// What a vertex's edges and faces add up to.
#[derive(Clone, Copy, Default)]
struct Sums {
    edges: u32,
    /// Other ends of the edges.
    ends: DVec3,
    /// Middles of the faces.
    faces: DVec3,
    sharp: u32,
    /// Other ends of the edges that are sharp.
    sharp_ends: DVec3,
    still_sharp: u32,
    /// Of the edges that are sharp at the next level, too.
    still_sharp_ends: DVec3,
    /// Sharpness that ends with this refinement, and of how many.
    ending: f64,
    endings: u32,
}

impl Sums {
    fn end(&mut self, sharpness: f64) {
        if sharpness > 0.0 && less(sharpness) == 0.0 {
            self.ending += sharpness;
            self.endings += 1;
        }
    }

    fn add_edge(&mut self, end: DVec3, sharpness: f64) {
        self.edges += 1;
        self.ends += end;
        if sharpness > 0.0 {
            self.sharp += 1;
            self.sharp_ends += end;
        }
        if less(sharpness) > 0.0 {
            self.still_sharp += 1;
            self.still_sharp_ends += end;
        }
        self.end(sharpness);
    }

    fn moved(&self, point: DVec3, sharpness: f64, scheme: Scheme) -> DVec3 {
        let before = Rule::of(sharpness, self.sharp);
        let after = Rule::of(less(sharpness), self.still_sharp);
        let place = |rule, sharp_ends: DVec3| match rule {
            Rule::Corner => point,
            Rule::Crease => 0.75 * point + 0.125 * sharp_ends,
            Rule::Smooth => self.smooth(point, scheme),
        };
        let sharper = place(before, self.sharp_ends);
        if before == after {
            return sharper;
        }
        let mut all = *self;
        all.end(sharpness);
        // Something ends, else the rule would stay.
        let part = (all.ending / f64::from(all.endings)).min(1.0);
        place(after, self.still_sharp_ends).lerp(sharper, part)
    }

    fn smooth(&self, point: DVec3, scheme: Scheme) -> DVec3 {
        let n = f64::from(self.edges);
        match scheme {
            Scheme::CatmullClark => (1.0 - 2.0 / n) * point + (self.ends + self.faces) / (n * n),
            Scheme::Loop => {
                let weight = loop_weight(n);
                (1.0 - n * weight) * point + weight * self.ends
            }
        }
    }
}

impl Level {
    /// The next level. Loop's faces must be triangles.
    pub fn refined(&self, scheme: Scheme) -> Self {
        let mut next = self.refined_topology(scheme);
        next.points = self.refined_points(scheme);
        next
    }

    fn refined_points(&self, scheme: Scheme) -> Vec<DVec3> {
        let middles: Vec<DVec3> = match scheme {
            Scheme::CatmullClark => (0..self.faces())
                .map(|face| {
                    let corners = self.corners_of(face);
                    let n = corners.len() as f64;
                    corners.map(|c| self.point(c)).sum::<DVec3>() / n
                })
                .collect(),
            Scheme::Loop => Vec::new(),
        };
        let mut sums = vec![Sums::default(); self.points.len()];
        // Of each edge: its faces, and the sum of what they give to its point.
        let mut sides = vec![(0_u32, DVec3::ZERO); self.edges.len()];
        for face in 0..self.faces() {
            let middle = middles.get(face).copied().unwrap_or_default();
            for (corner, next) in around(self.corners_of(face)) {
                let gives = match scheme {
                    Scheme::CatmullClark => {
                        sums[self.corners[corner] as usize].faces += middle;
                        middle
                    }
                    Scheme::Loop => {
                        let first = self.starts[face] as usize;
                        self.point(3 * first + 3 - corner - next)
                    }
                };
                let side = &mut sides[self.sides[corner] as usize];
                side.0 += 1;
                side.1 += gives;
            }
        }
        let ends = |&[a, b]: &[u32; 2]| [self.points[a as usize], self.points[b as usize]];
        for (edge, &sharpness) in self.edges.iter().zip(&self.edge_sharpness) {
            let [a, b] = ends(edge);
            sums[edge[0] as usize].add_edge(b, sharpness);
            sums[edge[1] as usize].add_edge(a, sharpness);
        }
        let sharpness = self.vertex_sharpness.iter();
        let vertices = sums.iter().zip(&self.points).zip(sharpness);
        let vertices = vertices.map(|((sums, &p), &sharpness)| sums.moved(p, sharpness, scheme));
        let edges = self.edges.iter().zip(&self.edge_sharpness).zip(&sides);
        let edges = edges.map(|((edge, &sharpness), &(faces, gives))| {
            let [a, b] = ends(edge);
            let middle = 0.5 * (a + b);
            if sharpness >= 1.0 || faces != 2 {
                return middle;
            }
            let smooth = match scheme {
                Scheme::CatmullClark => 0.25 * (a + b + gives),
                Scheme::Loop => 0.375 * (a + b) + 0.125 * gives,
            };
            smooth.lerp(middle, sharpness)
        });
        let mut points = Vec::with_capacity(self.points.len() + self.edges.len() + middles.len());
        points.extend(vertices);
        points.extend(edges);
        points.extend(middles);
        points
    }

    fn refined_topology(&self, scheme: Scheme) -> Self {
        let (vertices, edges) = (self.points.len() as u32, self.edges.len() as u32);
        let of_edge = |edge: u32| vertices + edge;
        // The part of an edge at one of its ends.
        let half = |edge: u32, corner: usize| {
            2 * edge + u32::from(self.edges[edge as usize][0] != self.corners[corner])
        };
        // Of each corner the edge inside of its face: to the middle (Catmull-Clark), or across the corner (Loop).
        let inner = |corner: usize| 2 * edges + corner as u32;
        let mut next = Self::default();
        for (edge, &[a, b]) in (0..).zip(&self.edges) {
            next.edges.push([a, of_edge(edge)]);
            next.edges.push([of_edge(edge), b]);
            let sharpness = less(self.edge_sharpness[edge as usize]);
            next.edge_sharpness.extend([sharpness; 2]);
        }
        for face in 0..self.faces() {
            let middle = vertices + edges + face as u32;
            let corners = self.corners_of(face);
            let mut before = corners.end - 1;
            for corner in corners {
                let (out, back) = (self.sides[corner], self.sides[before]);
                let vertex = self.corners[corner];
                match scheme {
                    Scheme::CatmullClark => {
                        next.corners
                            .extend([vertex, of_edge(out), middle, of_edge(back)]);
                        next.sides.extend([
                            half(out, corner),
                            inner(corner),
                            inner(before),
                            half(back, corner),
                        ]);
                        next.edges.push([of_edge(out), middle]);
                    }
                    Scheme::Loop => {
                        next.corners.extend([vertex, of_edge(out), of_edge(back)]);
                        next.sides
                            .extend([half(out, corner), inner(corner), half(back, corner)]);
                        next.edges.push([of_edge(out), of_edge(back)]);
                    }
                }
                before = corner;
            }
        }
        if scheme == Scheme::Loop {
            for face in 0..self.faces() {
                let first = self.starts[face] as usize;
                let corners = [first, first + 1, first + 2];
                next.corners.extend(corners.map(|c| of_edge(self.sides[c])));
                next.sides.extend([first + 1, first + 2, first].map(inner));
            }
        }
        next.edge_sharpness.resize(next.edges.len(), 0.0);
        let more = match scheme {
            Scheme::CatmullClark => self.edges.len() + self.faces(),
            Scheme::Loop => self.edges.len(),
        };
        next.vertex_sharpness = self.vertex_sharpness.iter().map(|&s| less(s)).collect();
        next.vertex_sharpness.resize(self.points.len() + more, 0.0);
        let size = scheme.corners();
        next.starts = (0..=next.corners.len() / size)
            .map(|face| (face * size) as u32)
            .collect();
        next
    }
}
