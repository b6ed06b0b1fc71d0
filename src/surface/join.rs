//! Corners that were written twice with other last digits: brought to one position, one normal, one pair of texture coordinates.
//!
//! Files of triangles that stand alone, and parts of a mesh that a program worked out by two ways, have the same corner several times, and
//! rounding may have written it differently. Everything else in this room takes positions for the same bit for bit: so such corners are moved
//! to one of them before. Then smooth normals see all faces around a corner, and displaced sheets share their edges.
//!
//! What a mesh means by small distances must stay. Only corners on open edges (of one triangle) are joined, which is what a corner written
//! twice makes of its edges: the two sides of a thin solid are not. And only where every triangle around is at least four times as high, on its longest edge, as
//! the tolerance: so no two corners of a triangle are joined, none turns over, none loses its area. Elsewhere a smaller
//! tolerance is tried. A corner goes to one that stays where it is, and not on from there: it moves no further than the tolerance, however
//! many lie in a row. Of several orders of the same vertices the outcome is the same.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::mesh::{MeshBuilder, MeshError, has_area};
use super::normals::{unit, weld};

/// Of the diagonal: files with six significant digits are off by up to a unit of the sixth, which is 1e-5 of the largest coordinate.
const ROUNDING: f64 = 1e-5;

/// Triangles are at least this many times as high as what their corners are moved by.
const ROOM: f64 = 4.0;

/// Each tolerance that is tried is this part of the last.
const FINER: f64 = 1.0 / 6.0;

/// Unit normals (radians): files with four decimals are off by up to a unit of the fourth in three coordinates.
const NORMALS: f64 = 2e-4;

/// Texture coordinates: a unit of the sixth decimal in both.
const TEXCOORDS: f64 = 2e-6;

/// What [`MeshBuilder::join`] changed, for one warning line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joined {
    /// Vertices that were moved.
    pub positions: usize,
    /// How far at most, in the mesh's units.
    pub farthest: f32,
    /// Normals that were turned to that of a vertex at the same position.
    pub normals: usize,
    /// Texture coordinates that were set to those of a vertex at the same position.
    pub texcoords: usize,
}

impl MeshBuilder {
    /// A tolerance for [`join`](Self::join) that rounding explains: 1e-5 of the diagonal of the box around the triangles.
    pub fn rounding(&self) -> f32 {
        (ROUNDING * self.diagonal()) as f32
    }

    /// Makes one corner of those that differ by rounding.
    ///
    /// Vertices on open edges that are no more than `tolerance` apart get one position, that of one of them, unless triangles around are so
    /// small that they would show it: no corners of one triangle are joined, and none loses its area. Then, of vertices at one position,
    /// normals less than 2e-4 rad apart and texture coordinates less than 2e-6 apart (of coordinates beyond 8: 2^-22 of the
    /// largest) become the same. A tolerance of 0 joins nothing.
    ///
    /// # Errors
    ///
    /// What `build` says of arrays, indices and numbers that do not fit.
    pub fn join(&mut self, tolerance: f32) -> Result<Joined, MeshError> {
        self.validate()?;
        let mut joined = Joined::default();
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Ok(joined);
        }
        let mut points = weld(&self.positions);
        let places = self.places(&points, tolerance.into());
        for (i, point) in points.iter_mut().enumerate() {
            let place = places[*point as usize];
            if place != *point {
                let to = self.positions[place as usize];
                let moved = to.as_dvec3().distance(self.positions[i].as_dvec3()) as f32;
                joined.positions += 1;
                joined.farthest = joined.farthest.max(moved);
                self.positions[i] = to;
                *point = place;
            }
        }
        joined.normals = join_values(
            &points,
            &mut self.normals,
            NORMALS,
            |&n| (n != Vec3::ZERO).then(|| n.as_dvec3().normalize()),
            |&a, &b| unit(a.as_dvec3()) == unit(b.as_dvec3()),
        );
        let largest = self.texcoords.iter().map(|st| st.abs().max_element());
        let largest = f64::from(largest.fold(0.0, f32::max));
        joined.texcoords = join_values(
            &points,
            &mut self.texcoords,
            TEXCOORDS.max(largest * 0.5f64.powi(22)),
            |st| Some(st.as_dvec2().extend(0.0)),
            |a, b| a == b,
        );
        Ok(joined)
    }

    /// Of the box around all triangles.
    fn diagonal(&self) -> f64 {
        let used = self.triangles.as_flattened().iter();
        let used = used.filter_map(|&i| Some(self.positions.get(i as usize)?.as_dvec3()));
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in used {
            (low, high) = (low.min(p), high.max(p));
        }
        if low.cmple(high).all() {
            low.distance(high)
        } else {
            0.0
        }
    }

    /// For each point, the one that it is joined to: itself for most.
    fn places(&self, points: &[u32], tolerance: f64) -> Vec<u32> {
        let position = |point: u32| self.positions[point as usize].as_dvec3();
        let room = self.room(points);
        let mut places: Vec<u32> = (0..points.len() as u32).collect();
        let mut order: Vec<u32> = (0..points.len() as u32)
            .filter(|&point| room[point as usize] > 0.0)
            .collect();
        // By position, so that the order of the vertices does not matter: no two are equal.
        order.sort_unstable_by(|&a, &b| in_order(position(a), position(b)));
        if order.is_empty() {
            return places;
        }
        let most = order.iter().map(|&point| room[point as usize]);
        let mut within = tolerance.min(most.fold(0.0, f64::max) / ROOM);
        let least = self.diagonal() * 0.5f64.powi(23);
        let mut stays = vec![false; points.len()];
        loop {
            let fits = |&point: &u32| room[point as usize] >= ROOM * within;
            let mut cells = Cells::new(within);
            // Those to which others have been joined stay, and come first.
            let settled = order.iter().copied().filter(fits);
            for point in settled.filter(|&point| stays[point as usize]) {
                cells.insert(0, position(point), point);
            }
            for point in order.iter().copied().filter(fits) {
                if places[point as usize] != point || stays[point as usize] {
                    continue;
                }
                match cells.nearest(0, position(point)) {
                    Some(place) => {
                        places[point as usize] = place;
                        stays[place as usize] = true;
                    }
                    None => cells.insert(0, position(point), point),
                }
            }
            within *= FINER;
            if within < least {
                return places;
            }
        }
    }

    /// For each point on an open edge the height of the lowest triangle around, on its longest edge; 0 for other points, and where single precision
    /// hardly tells that the triangle has an area.
    fn room(&self, points: &[u32]) -> Vec<f64> {
        let mut room = vec![f64::INFINITY; points.len()];
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        for &corners in &self.triangles {
            let p = corners.map(|i| self.positions[i as usize]);
            // `build` leaves those out.
            if !has_area(p) {
                continue;
            }
            let [a, b, c] = p.map(|p| p.as_dvec3());
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let height = (b - a).cross(c - a).length() / longest;
            let is_sliver = height < ROOM * f64::from(f32::EPSILON) * longest;
            let height = if is_sliver { 0.0 } else { height };
            let corners = corners.map(|i| points[i as usize]);
            for side in 0..3 {
                let (a, b) = (corners[side], corners[(side + 1) % 3]);
                edges.push([a.min(b), a.max(b)]);
                room[a as usize] = room[a as usize].min(height);
            }
        }
        edges.sort_unstable();
        let mut is_open = vec![false; points.len()];
        for edge in edges.chunk_by(|a, b| a == b).filter(|edge| edge.len() == 1) {
            let [a, b] = edge[0];
            (is_open[a as usize], is_open[b as usize]) = (true, true);
        }
        for (room, is_open) in room.iter_mut().zip(is_open) {
            *room = if is_open { *room } else { 0.0 };
        }
        room
    }
}

/// Sets values at one point that are within `tolerance` of another there to that one. How many changed.
fn join_values<T: Copy>(
    points: &[u32],
    values: &mut [T],
    tolerance: f64,
    place: impl Fn(&T) -> Option<DVec3>,
    are_same: impl Fn(&T, &T) -> bool,
) -> usize {
    if values.is_empty() {
        return 0;
    }
    // Points at which there is more than one value: few of most meshes.
    let mut is_mixed = vec![false; points.len()];
    let mut first = vec![u32::MAX; points.len()];
    for (i, &point) in points.iter().enumerate() {
        let first = &mut first[point as usize];
        if *first == u32::MAX {
            *first = i as u32;
        } else if !are_same(&values[i], &values[*first as usize]) {
            is_mixed[point as usize] = true;
        }
    }
    let mut order: Vec<(u32, DVec3, u32)> = (0u32..)
        .zip(points)
        .filter(|&(_, &point)| is_mixed[point as usize])
        .filter_map(|(i, &point)| Some((point, place(&values[i as usize])?, i)))
        .collect();
    order.sort_unstable_by(|a, b| (a.0.cmp(&b.0)).then(in_order(a.1, b.1)));
    let mut cells = Cells::new(tolerance);
    let mut changed = 0;
    for (point, at, i) in order {
        match cells.nearest(point, at) {
            Some(other) => {
                let other = values[other as usize];
                changed += usize::from(!are_same(&values[i as usize], &other));
                values[i as usize] = other;
            }
            None => cells.insert(point, at, i),
        }
    }
    changed
}

fn in_order(a: DVec3, b: DVec3) -> std::cmp::Ordering {
    let [a, b] = [a.to_array(), b.to_array()];
    a.iter()
        .zip(&b)
        .map(|(a, b)| a.total_cmp(b))
        .find(|order| order.is_ne())
        .unwrap_or(std::cmp::Ordering::Equal)
}

/// Places of groups, no two of one group closer than the tolerance: so there are few in a cell, and looking is quick however many others there are.
struct Cells {
    tolerance: f64,
    size: f64,
    /// The last that came to each cell of each group.
    last: HashMap<(u32, [i64; 3]), u32>,
    /// With the one that came to its cell before.
    entries: Vec<(DVec3, u32, Option<u32>)>,
}

impl Cells {
    fn new(tolerance: f64) -> Self {
        /// As many tolerances wide, most that is near a place is in its own cell.
        const WIDE: f64 = 8.0;
        Self {
            tolerance,
            size: WIDE * tolerance,
            last: HashMap::new(),
            entries: Vec::new(),
        }
    }

    fn cell(&self, at: DVec3) -> [i64; 3] {
        // Beyond the range of i64 cells end; what is not near is told from what is by its distance.
        (at / self.size).floor().to_array().map(|i| i as i64)
    }

    fn insert(&mut self, group: u32, at: DVec3, number: u32) {
        let entry = self.entries.len() as u32;
        let before = self.last.insert((group, self.cell(at)), entry);
        self.entries.push((at, number, before));
    }

    /// The number of the nearest of a group within the tolerance.
    fn nearest(&self, group: u32, at: DVec3) -> Option<u32> {
        let [x0, y0, z0] = self.cell(at - self.tolerance);
        let [x1, y1, z1] = self.cell(at + self.tolerance);
        let mut nearest: Option<(f64, u32)> = None;
        for x in x0..=x1 {
            for y in y0..=y1 {
                for z in z0..=z1 {
                    let mut next = self.last.get(&(group, [x, y, z])).copied();
                    while let Some(entry) = next {
                        let (place, number, before) = self.entries[entry as usize];
                        let distance = place.distance(at);
                        let is_nearer = nearest.is_none_or(|(least, _)| distance < least);
                        if distance <= self.tolerance && is_nearer {
                            nearest = Some((distance, number));
                        }
                        next = before;
                    }
                }
            }
        }
        nearest.map(|(_, number)| number)
    }
}

#[cfg(test)]
mod tests;
