//! Surfaces that shine, displaced ones too.
//!
//! A point is chosen where the mesh has its parameters: a triangle by its estimated power, then (u, v) uniformly
//! over it. S(u, v) maps it to the displaced surface, and the density per area is P(triangle) * 2 / |dS/du x dS/dv|,
//! exact at every point: nothing is tessellated, and no bright texel is left out. Walls of closed seams shine too,
//! but only rays that go on by chance find them.

use glam::{Vec2, Vec3};

use super::LightSample;
use super::color::luminance;
use super::cumulative::Cumulative;
use crate::render::{RenderInput, Surfaces, material};
use crate::scene::Material;
use crate::surface::SurfacePoint;
use crate::trace::{Hit, PlacedObject};

/// Where each triangle is looked at to estimate its power: its middle, and near its corners.
const PROBES: [Vec2; 4] = [
    Vec2::new(1.0 / 3.0, 1.0 / 3.0),
    Vec2::new(0.15, 0.15),
    Vec2::new(0.7, 0.15),
    Vec2::new(0.15, 0.7),
];

/// Part of the choice that goes by area alone, so that light between the probes is found.
const BY_AREA: f64 = 0.1;

/// All emissive surfaces of a scene.
pub struct MeshLights<'a> {
    surfaces: &'a dyn Surfaces,
    materials: &'a [Material],
    tables: &'a MeshTables,
}

/// Which they are, and how one of their triangles is chosen.
pub struct MeshTables {
    placed: Vec<Emitter>,
    choice: Cumulative,
    power: f32,
}

/// An object as it stands once, and where its triangles begin in the choice.
struct Emitter {
    object: PlacedObject,
    material: usize,
    first: usize,
}

impl MeshTables {
    /// The emissive surfaces of `input`; `None` where nothing shines.
    pub fn new(input: &RenderInput) -> Option<Self> {
        let mut placed = Vec::new();
        let (mut areas, mut powers) = (Vec::new(), Vec::new());
        for object in input.surfaces.placed() {
            let index = input.object_materials[object.object];
            let material = &input.materials[index];
            if !material.is_emissive() {
                continue;
            }
            placed.push(Emitter {
                object,
                material: index,
                first: areas.len(),
            });
            for prim in 0..object.triangles {
                let (area, power) = probe(input.surfaces, material, &object, prim);
                areas.push(f64::from(area));
                powers.push(f64::from(power));
            }
        }
        let power: f64 = powers.iter().sum();
        if power <= 0.0 {
            return None;
        }
        let area: f64 = areas.iter().sum();
        let weights = areas.iter().zip(&powers);
        let weights = weights.map(|(a, p)| BY_AREA * a / area + (1.0 - BY_AREA) * p / power);
        Some(Self {
            placed,
            choice: Cumulative::new(weights),
            power: power as f32,
        })
    }

    /// Radiant power, by luminance, of both sides.
    pub fn power(&self) -> f32 {
        self.power
    }
}

impl<'a> MeshLights<'a> {
    /// Those that `tables` were made of, which are in `input`.
    pub fn new(tables: &'a MeshTables, input: &RenderInput<'a>) -> Self {
        Self {
            surfaces: input.surfaces,
            materials: input.materials,
            tables,
        }
    }

    /// A point of an emissive surface, seen from `position`.
    pub fn sample(&self, position: Vec3, u: Vec2) -> LightSample {
        let placed = &self.tables.placed;
        let (index, rest) = self.tables.choice.choose(u.x);
        // The last that begins at or before it.
        let emitter = &placed[placed.partition_point(|e| e.first <= index) - 1];
        let prim = (index - emitter.first) as u32;
        let hit = emitter.object.hit(prim, barycentric(Vec2::new(rest, u.y)));
        let point = self.surfaces.point(&hit);
        let to = point.position - position;
        let distance = to.length();
        let direction = to / distance;
        let pdf = self.density(index, &hit, &point, position);
        if !(pdf > 0.0 && pdf.is_finite()) {
            return LightSample::NONE;
        }
        let material = &self.materials[emitter.material];
        LightSample {
            direction,
            distance,
            radiance: material::opacity(material, &point) * material::emission(material, &point),
            pdf,
            is_delta: false,
        }
    }

    /// The density per steradian, seen from `position`, with which [`Self::sample`] finds what a ray hit.
    pub fn pdf(&self, hit: &Hit, point: &SurfacePoint, position: Vec3) -> f32 {
        let placed = &self.tables.placed;
        let emitter = placed.binary_search_by_key(&hit.top(), |e| e.object.top);
        match emitter.map(|i| &placed[i]) {
            Ok(e) if hit.prim < e.object.triangles => {
                self.density(e.first + hit.prim as usize, hit, point, position)
            }
            _ => 0.0,
        }
    }

    fn density(&self, index: usize, hit: &Hit, point: &SurfacePoint, position: Vec3) -> f32 {
        let Some(element) = self.surfaces.area_element(hit) else {
            return 0.0;
        };
        let to = point.position - position;
        let cosine = (point.geometric_normal.dot(to) / to.length()).abs();
        let per_area = 2.0 * self.tables.choice.probability(index) / element;
        per_area * to.length_squared() / cosine
    }
}

/// A triangle's displaced area and power, estimated.
fn probe(
    surfaces: &dyn Surfaces,
    material: &Material,
    object: &PlacedObject,
    prim: u32,
) -> (f32, f32) {
    let (mut area, mut power) = (0.0, 0.0);
    for at in PROBES {
        let hit = object.hit(prim, at);
        // (u, v) covers half a unit square.
        let part = 0.5 * surfaces.area_element(&hit).unwrap_or(0.0) / PROBES.len() as f32;
        area += part;
        power += part * luminance(material::emission(material, &surfaces.point(&hit)));
    }
    (area, 2.0 * std::f32::consts::PI * power)
}

/// A uniform point of the unit square folded onto the triangle u, v >= 0, u + v <= 1.
fn barycentric(u: Vec2) -> Vec2 {
    if u.x + u.y > 1.0 { Vec2::ONE - u } else { u }
}
