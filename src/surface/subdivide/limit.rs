//! Where a vertex comes to lie after refinements without end, and the normals of the surface there.
//!
//! Positions: Halstead, Kass and DeRose 1993 and, for Loop, Hoppe et al. 1994 (eigenvectors of the refinement for the value 1); normals by the
//! eigenvectors of the next two values, on creases and borders too (Biermann, Levin and Zorin 2000). A vertex where sharpness is to end
//! first has its neighbourhood refined, alone, until there is none; where one crease ends there is no closed form, so there it is refined until
//! it does not move any more.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::Scheme;
use super::level::Level;
use super::refine::{Rule, loop_weight};

/// A cross product shorter than this part of its factors' lengths has no direction to speak of.
const PARALLEL: f64 = 1e-9;

/// A vertex at the limit.
#[derive(Debug, Default)]
pub(super) struct Limit {
    pub point: DVec3,
    /// Unit normals, one per sector: faces around the vertex between edges that stay sharp. Zero where there is none.
    pub normals: Vec<DVec3>,
    /// Of each of the vertex's corners, in their order, its sector.
    pub sectors: Vec<usize>,
}

/// Faces around a vertex, counter-clockwise, between two sharp edges or all around.
struct Sector {
    /// Places in the list of the vertex's corners.
    corners: Vec<usize>,
    /// From the vertex: ends of the edges that bound the faces. Of k faces k + 1, or k where there is no sharp edge.
    ends: Vec<DVec3>,
    /// From the vertex: the opposite corners of the faces (Catmull-Clark), or none.
    opposite: Vec<DVec3>,
    is_ring: bool,
}

/// A vertex with the faces around it.
struct Fan<'a> {
    level: &'a Level,
    scheme: Scheme,
    vertex: u32,
    corners: &'a [u32],
}

impl Level {
    /// The limit of the vertex with these corners, which are at least one and all that it has. Faces are regular.
    pub(super) fn limit(&self, corners: &[u32], scheme: Scheme) -> Limit {
        let fan = self.fan(corners, scheme);
        let sharp = fan.sharp_edges();
        let Some(rule) = fan.lasting_rule(&sharp) else {
            return fan.limit_by_refinement();
        };
        let sectors = fan.sectors();
        let normal = |sector: &Sector| sector.normal(rule, scheme);
        Limit {
            point: fan.limit_point(rule, &sharp),
            normals: sectors.iter().map(normal).collect(),
            sectors: fan.sector_of_corners(&sectors),
        }
    }

    /// The same without normals, in less time.
    pub(super) fn limit_point(&self, corners: &[u32], scheme: Scheme) -> DVec3 {
        let fan = self.fan(corners, scheme);
        let sharp = fan.sharp_edges();
        match fan.lasting_rule(&sharp) {
            Some(rule) => fan.limit_point(rule, &sharp),
            None => fan.limit_by_refinement().point,
        }
    }

    fn fan<'a>(&'a self, corners: &'a [u32], scheme: Scheme) -> Fan<'a> {
        Fan {
            level: self,
            scheme,
            vertex: self.corners[corners[0] as usize],
            corners,
        }
    }
}

impl Fan<'_> {
    /// The edges out of the vertex that are sharp, each once.
    fn sharp_edges(&self) -> Vec<u32> {
        let sides = self.corners.iter().flat_map(|&c| self.sides(c));
        let mut sharp: Vec<u32> = sides
            .filter(|&e| self.level.edge_sharpness[e as usize] > 0.0)
            .collect();
        sharp.sort_unstable();
        sharp.dedup();
        sharp
    }

    /// Whether nothing ends: what is sharp is so for ever.
    fn is_settled(&self, sharp: &[u32]) -> bool {
        let lasts = |s: f64| s == 0.0 || s.is_infinite();
        let edges = sharp.iter().map(|&e| self.level.edge_sharpness[e as usize]);
        edges.chain([self.vertex_sharpness()]).all(lasts)
    }

    fn vertex_sharpness(&self) -> f64 {
        self.level.vertex_sharpness[self.vertex as usize]
    }

    /// The rule of all refinements to come, if there is one with a closed form: not where something ends, nor where one crease does.
    fn lasting_rule(&self, sharp: &[u32]) -> Option<Rule> {
        let is_dart = sharp.len() == 1 && self.vertex_sharpness() == 0.0;
        let rule = Rule::of(self.vertex_sharpness(), sharp.len() as u32);
        (self.is_settled(sharp) && !is_dart).then_some(rule)
    }

    fn limit_point(&self, rule: Rule, sharp: &[u32]) -> DVec3 {
        let point = self.level.points[self.vertex as usize];
        match rule {
            Rule::Corner => point,
            Rule::Crease => {
                let end = |&edge: &u32| self.level.across(edge, self.vertex) as usize;
                let ends = sharp
                    .iter()
                    .map(|edge| self.level.points[end(edge)] - point);
                point + ends.sum::<DVec3>() / 6.0
            }
            Rule::Smooth => {
                let n = self.corners.len() as f64;
                let (mut ends, mut opposite) = (DVec3::ZERO, DVec3::ZERO);
                for face in self.corners.iter().map(|&c| self.face_from(c)) {
                    ends += self.level.point(face[1]) - point;
                    opposite += self.level.point(face[2]) - point;
                }
                point
                    + match self.scheme {
                        Scheme::CatmullClark => (4.0 * ends + opposite) / (n * (n + 5.0)),
                        Scheme::Loop => ends / (n + 3.0 / (8.0 * loop_weight(n))),
                    }
            }
        }
    }

    /// The corners of a regular face from this one on, counter-clockwise.
    fn face_from(&self, corner: u32) -> [usize; 4] {
        let size = self.scheme.corners();
        let corner = corner as usize;
        let first = corner - corner % size;
        [0, 1, 2, 3].map(|i| first + (corner + i) % size)
    }

    /// The edges that a face has at the vertex: the first and the last, counter-clockwise.
    fn sides(&self, corner: u32) -> [u32; 2] {
        let face = self.face_from(corner);
        [face[0], face[self.scheme.corners() - 1]].map(|c| self.level.sides[c])
    }

    fn sectors(&self) -> Vec<Sector> {
        // By the first edge: across an edge that is not sharp there is one face, whose first it is.
        let mut by_first: Vec<(u32, usize)> = (0..)
            .zip(self.corners)
            .map(|(i, &c)| (self.sides(c)[0], i))
            .collect();
        by_first.sort_unstable();
        let is_sharp = |edge: u32| self.level.edge_sharpness[edge as usize] > 0.0;
        let next = |i: usize| {
            let last = self.sides(self.corners[i])[1];
            let found = by_first.partition_point(|&(first, _)| first < last);
            let found = by_first.get(found).filter(|f| f.0 == last);
            found.filter(|_| !is_sharp(last)).map(|&(_, i)| i)
        };
        let mut taken = vec![false; self.corners.len()];
        let mut walk = |start: usize| {
            let mut corners = Vec::new();
            let mut at = Some(start);
            while let Some(i) = at.filter(|&i| !taken[i]) {
                taken[i] = true;
                corners.push(i);
                at = next(i);
            }
            (corners, at.is_some())
        };
        let all = 0..self.corners.len();
        let starts = (all.clone()).filter(|&i| is_sharp(self.sides(self.corners[i])[0]));
        let mut walks: Vec<_> = starts.map(&mut walk).collect();
        walks.extend(
            all.map(&mut walk)
                .filter(|(corners, _)| !corners.is_empty()),
        );
        walks
            .into_iter()
            .map(|(corners, is_ring)| self.sector(corners, is_ring))
            .collect()
    }

    fn sector(&self, corners: Vec<usize>, is_ring: bool) -> Sector {
        let center = self.level.points[self.vertex as usize];
        let from = |corner: usize| self.level.point(corner) - center;
        let faces = || corners.iter().map(|&i| self.face_from(self.corners[i]));
        let size = self.scheme.corners();
        let mut ends: Vec<DVec3> = faces().map(|face| from(face[1])).collect();
        if let (Some(last), false) = (faces().next_back(), is_ring) {
            ends.push(from(last[size - 1]));
        }
        let opposite = match self.scheme {
            Scheme::CatmullClark => faces().map(|face| from(face[2])).collect(),
            Scheme::Loop => Vec::new(),
        };
        Sector {
            corners,
            ends,
            opposite,
            is_ring,
        }
    }

    fn sector_of_corners(&self, sectors: &[Sector]) -> Vec<usize> {
        let mut of = vec![0; self.corners.len()];
        for (number, sector) in sectors.iter().enumerate() {
            for &i in &sector.corners {
                of[i] = number;
            }
        }
        of
    }

    /// Refines the faces around the vertex, and no others, until nothing ends any more, or, where one crease ends, until the vertex stays.
    fn limit_by_refinement(&self) -> Limit {
        /// Rings shrink by a half where few faces meet, and less where many do.
        const MOST: usize = 128;
        /// The vertex has no farther to go than its ring is wide.
        const SMALL: f64 = 1e-13;
        let size = self.scheme.corners() as u32;
        let center = self.level.points[self.vertex as usize];
        let face = |corner: u32| (corner / size) as usize;
        let radius = |part: &Level| {
            let squares = part.points.iter().map(|p| p.length_squared());
            squares.fold(0.0, f64::max).sqrt()
        };
        let (mut part, mut corners) = self.level.around(self.corners, face);
        let least = SMALL * radius(&part);
        let mut moved = DVec3::ZERO;
        for _ in 0..MOST {
            let refined = part.refined(self.scheme);
            moved += refined.points[0];
            // The face at a corner has its number, and begins there.
            let at_vertex: Vec<u32> = corners.iter().map(|&c| c * size).collect();
            (part, corners) = refined.around(&at_vertex, face);
            let fan = part.fan(&corners, self.scheme);
            let sharp = fan.sharp_edges();
            if fan.lasting_rule(&sharp).is_some() {
                let limit = part.limit(&corners, self.scheme);
                return Limit {
                    point: center + moved + limit.point,
                    ..limit
                };
            }
            if fan.is_settled(&sharp) && radius(&part) <= least {
                break;
            }
        }
        let fan = part.fan(&corners, self.scheme);
        let sectors = fan.sectors();
        let normals = sectors.iter().map(Sector::area_normal);
        Limit {
            point: center + moved,
            normals: normals.collect(),
            sectors: fan.sector_of_corners(&sectors),
        }
    }
}

impl Sector {
    fn faces(&self) -> usize {
        self.corners.len()
    }

    fn normal(&self, rule: Rule, scheme: Scheme) -> DVec3 {
        let [right, left] = match rule {
            Rule::Smooth => self.smooth_tangents(scheme),
            Rule::Crease if !self.is_ring => self.crease_tangents(scheme),
            // The edges stay where they are.
            Rule::Corner if !self.is_ring => [self.ends[0], self.ends[self.faces()]],
            _ => return self.area_normal(),
        };
        let area = self.area_normal();
        let normal = right.cross(left);
        if normal.length() <= PARALLEL * right.length() * left.length() {
            return area;
        }
        let normal = normal.normalize_or_zero();
        // At a corner of more than half a turn the two edges are the other way round.
        if rule == Rule::Corner && normal.dot(area) < 0.0 {
            return -normal;
        }
        normal
    }

    fn smooth_tangents(&self, scheme: Scheme) -> [DVec3; 2] {
        let n = self.faces();
        let step = TAU / n as f64;
        let edge_weight = match scheme {
            Scheme::CatmullClark => {
                1.0 + step.cos() + (0.5 * step).cos() * (2.0 * (9.0 + step.cos())).sqrt()
            }
            Scheme::Loop => 1.0,
        };
        let mut tangents = [DVec3::ZERO; 2];
        for i in 0..n {
            let (sin, cos) = (step * i as f64).sin_cos();
            tangents[0] += edge_weight * cos * self.ends[i];
            tangents[1] += edge_weight * sin * self.ends[i];
            if let Some(&opposite) = self.opposite.get(i) {
                let (next_sin, next_cos) = (step * (i + 1) as f64).sin_cos();
                tangents[0] += (cos + next_cos) * opposite;
                tangents[1] += (sin + next_sin) * opposite;
            }
        }
        tangents
    }

    /// Along the crease, and into the sector: what the refinement's rules themselves leave unchanged but for a factor. (The masks of Biermann et al.,
    /// which OpenSubdiv has, are of rules that they changed; both are the same for two faces.) The vertex lies at 0, so its weight does not show.
    fn crease_tangents(&self, scheme: Scheme) -> [DVec3; 2] {
        let k = self.faces();
        let (first, last) = (self.ends[0], self.ends[k]);
        let along = first - last;
        if k == 1 {
            // The bend of the crease, which the face follows ever more, unless there is none.
            let bend = first + last;
            let size = first.length().max(last.length());
            let straight = bend.length() <= PARALLEL * size;
            let face = self.opposite.first().copied().unwrap_or_default();
            return [along, if straight { face } else { bend }];
        }
        let step = PI / k as f64;
        let (sin, cos) = step.sin_cos();
        // The sum of sin(i step).
        let sum = 1.0 / (0.5 * step).tan();
        let (at_crease, edge_weight) = match scheme {
            Scheme::CatmullClark => {
                let weight = 1.0 + cos + ((1.0 + cos) * (9.0 + cos)).sqrt();
                let value = 0.25 + weight / 16.0;
                let at_crease = (value * sin - (weight + 2.0) * sum / 8.0) / (value - 0.25);
                (at_crease, weight)
            }
            Scheme::Loop => ((sin - sum) / (1.0 + 2.0 * cos), 1.0),
        };
        let mut into = at_crease * (first + last);
        for i in 0..k {
            let (sin, next_sin) = ((step * i as f64).sin(), (step * (i + 1) as f64).sin());
            if i > 0 {
                into += edge_weight * sin * self.ends[i];
            }
            if let Some(&opposite) = self.opposite.get(i) {
                into += (sin + next_sin) * opposite;
            }
        }
        [along, into]
    }

    /// The direction of the area that the ends go around.
    fn area_normal(&self) -> DVec3 {
        let around = (0..self.faces()).map(|i| {
            let (a, b) = (self.ends[i], self.ends[(i + 1) % self.ends.len()]);
            match self.opposite.get(i) {
                Some(&c) => a.cross(c) + c.cross(b),
                None => a.cross(b),
            }
        });
        let largest = self.ends.iter().chain(&self.opposite);
        let largest = largest.map(|p| p.length_squared()).fold(0.0, f64::max);
        let area: DVec3 = around.sum();
        if area.length() <= PARALLEL * largest {
            return DVec3::ZERO;
        }
        area.normalize_or_zero()
    }
}
