//! What is traced, before any backend: objects, and where they stand.

use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3};

use super::{Hit, INVALID_ID};
use crate::prism::{PrismHit, Prisms};
use crate::ray::{Cone, Footprint, Ray};
use crate::surface::{BaseMesh, SurfacePoint};

/// One traceable shape.
#[derive(Clone)]
pub enum Shape {
    /// Prisms around a displaced surface.
    Displaced(Arc<Prisms>),
    /// An undisplaced mesh as ordinary triangles.
    Triangles(Arc<BaseMesh>),
}

impl Shape {
    /// The mesh, not displaced.
    pub fn mesh(&self) -> &Arc<BaseMesh> {
        match self {
            Self::Displaced(prisms) => prisms.surface().mesh(),
            Self::Triangles(mesh) => mesh,
        }
    }
}

/// Where an object stands.
#[derive(Clone, Debug)]
pub enum Placement {
    /// Once, in world space as it is.
    World,
    /// Once per transform (object to world), through an instance.
    Instances(Vec<Affine3A>),
}

/// A shape, where it stands, and which rays see it.
#[derive(Clone)]
pub struct Object {
    /// The shape.
    pub shape: Shape,
    /// Where.
    pub placement: Placement,
    /// A ray sees the object when `ray.mask & mask != 0`.
    pub mask: u32,
}

/// Everything that is traced.
#[derive(Clone, Default)]
pub struct World {
    objects: Vec<Object>,
    /// (object, index of its transform), in the order of top-level ids.
    top_level: Vec<(u32, Option<u32>)>,
}

/// What a hit hit.
#[derive(Clone, Copy, Debug)]
pub struct Resolved<'w> {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Object to world, if instanced.
    pub transform: Option<&'w Affine3A>,
}

/// An object as it stands once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlacedObject {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Its number in [`World::top_level`].
    pub top: u32,
    /// Whether it stands there through an instance.
    pub instanced: bool,
    /// Base triangles; walls not counted.
    pub triangles: u32,
}

impl PlacedObject {
    /// A hit on it at barycentric coordinates `uv` of a base triangle, such as a tracer reports; without ray
    /// parameter and normal.
    pub fn hit(&self, prim: u32, uv: Vec2) -> Hit {
        let (geom, inst) = if self.instanced {
            (0, self.top)
        } else {
            (self.top, INVALID_ID)
        };
        Hit {
            t: 0.0,
            u: uv.x,
            v: uv.y,
            prim,
            geom,
            inst: [inst],
            ng: Vec3::Z,
        }
    }
}

impl World {
    /// A world of these objects. Top-level ids count the objects in order, an instanced object once per transform.
    pub fn new(objects: Vec<Object>) -> Self {
        let mut top_level = Vec::new();
        for (index, object) in objects.iter().enumerate() {
            match &object.placement {
                Placement::World => top_level.push((index as u32, None)),
                Placement::Instances(t) => {
                    top_level.extend((0..t.len() as u32).map(|k| (index as u32, Some(k))));
                }
            }
        }
        Self { objects, top_level }
    }

    /// The objects.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// (object, index of its transform), in the order of top-level ids.
    pub fn top_level(&self) -> &[(u32, Option<u32>)] {
        &self.top_level
    }

    /// Which object a hit is on, and through which instance.
    pub fn resolve(&self, hit: &Hit) -> Resolved<'_> {
        let (object, instance) = self.top_level[hit.top() as usize];
        let object = object as usize;
        let transform = match (&self.objects[object].placement, instance) {
            (Placement::Instances(t), Some(k)) => Some(&t[k as usize]),
            _ => None,
        };
        Resolved { object, transform }
    }

    /// Every object once per place where it stands, in the order of top-level ids.
    pub fn placed(&self) -> Vec<PlacedObject> {
        let placed = self.top_level.iter().zip(0..);
        let placed = placed.map(|(&(object, instance), top)| PlacedObject {
            object: object as usize,
            top,
            instanced: instance.is_some(),
            triangles: self.objects[object as usize].shape.mesh().triangles().len() as u32,
        });
        placed.collect()
    }

    /// |dS/du x dS/dv| at a hit, square world units; `None` on a wall.
    pub fn area_element(&self, hit: &Hit) -> Option<f32> {
        let Resolved { object, transform } = self.resolve(hit);
        let shape = &self.objects[object].shape;
        if hit.prim as usize >= shape.mesh().triangles().len() {
            return None;
        }
        let [du, dv] = match shape {
            Shape::Displaced(prisms) => {
                let patch = prisms.surface().patch(hit.prim);
                let point = patch.point(f64::from(hit.u), f64::from(hit.v));
                [point.du.as_vec3(), point.dv.as_vec3()]
            }
            Shape::Triangles(mesh) => {
                let [v0, v1, v2] = mesh.corners(hit.prim);
                [v1 - v0, v2 - v0]
            }
        };
        let place = |v: Vec3| transform.map_or(v, |t| t.transform_vector3(v));
        Some(place(du).cross(place(dv)).length())
    }

    /// dP/ds and dP/dt of the undisplaced mesh along its texture coordinates at a hit, in world space; `None` on a
    /// wall, and where the texture coordinates have no area.
    pub fn tangents(&self, hit: &Hit) -> Option<[Vec3; 2]> {
        let Resolved { object, transform } = self.resolve(hit);
        let mesh = self.objects[object].shape.mesh();
        if hit.prim as usize >= mesh.triangles().len() || mesh.texcoords().is_empty() {
            return None;
        }
        let [v0, v1, v2] = mesh.corners(hit.prim);
        let [st0, st1, st2] = mesh.corner_texcoords(hit.prim);
        let (a, b) = (st1 - st0, st2 - st0);
        let inverse = 1.0 / a.perp_dot(b);
        if !inverse.is_finite() {
            return None;
        }
        let place = |v: Vec3| transform.map_or(v, |t| t.transform_vector3(v));
        let (e1, e2) = (v1 - v0, v2 - v0);
        Some([
            place((b.y * e1 - a.y * e2) * inverse),
            place((a.x * e2 - b.x * e1) * inverse),
        ])
    }

    /// All a shader wants to know of a hit, in world space.
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint {
        let Resolved { object, transform } = self.resolve(hit);
        let point = match &self.objects[object].shape {
            Shape::Displaced(prisms) => prisms.point(hit.prim, hit.u, hit.v),
            Shape::Triangles(mesh) => triangle_point(mesh, hit),
        };
        match transform {
            None => point,
            Some(to_world) => transformed(&point, to_world),
        }
    }

    /// The same as seen by the cone around `ray`, which made the hit.
    ///
    /// Where level of detail is off ([`Lod::Off`](crate::prism::Lod)) this is [`Self::surface_point`]. Else both normals are those of the
    /// mean surface over the cone's width, on the side of the hit's, and there is a [`tolerance`](SurfacePoint::tolerance). Under transforms
    /// that stretch, the width is taken as it is along the ray.
    pub fn seen_point(&self, hit: &Hit, ray: &Ray, cone: &Cone) -> SurfacePoint {
        let Resolved { object, transform } = self.resolve(hit);
        let prisms = match &self.objects[object].shape {
            Shape::Displaced(prisms) if prisms.spread() > 0.0 => prisms,
            _ => return self.surface_point(hit),
        };
        let world = cone.footprint(ray, hit.t);
        let direction = match transform {
            None => ray.direction,
            Some(to_world) => to_world.inverse().transform_vector3(ray.direction),
        };
        let footprint = Footprint {
            direction,
            width: world.width * (direction.length() / ray.direction.length()),
        };
        let seen = prisms.seen_point(&PrismHit::from(hit), &footprint);
        let seen = match transform {
            None => seen,
            Some(to_world) => transformed(&seen, to_world),
        };
        SurfacePoint {
            tolerance: prisms.tolerance(ray.direction, hit.t),
            ..seen
        }
    }

    /// [`Prisms::set_spread`] of all objects.
    pub fn set_spread(&self, spread: f32) {
        for object in &self.objects {
            if let Shape::Displaced(prisms) = &object.shape {
                prisms.set_spread(spread);
            }
        }
    }
}

impl From<&Hit> for PrismHit {
    fn from(hit: &Hit) -> Self {
        let &Hit {
            t, u, v, prim, ng, ..
        } = hit;
        Self { prim, t, u, v, ng }
    }
}

fn triangle_point(mesh: &BaseMesh, hit: &Hit) -> SurfacePoint {
    let b = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
    let [v0, v1, v2] = mesh.corners(hit.prim);
    let [n0, n1, n2] = mesh.corner_normals(hit.prim);
    let [st0, st1, st2] = mesh.corner_texcoords(hit.prim);
    let position = b.x * v0 + b.y * v1 + b.z * v2;
    let geometric_normal = (v1 - v0).cross(v2 - v0).normalize();
    let normal = (b.x * n0 + b.y * n1 + b.z * n2).normalize_or(geometric_normal);
    SurfacePoint {
        position,
        base_position: position,
        base_normal: normal,
        geometric_normal,
        shading_normal: normal,
        texcoord: b.x * st0 + b.y * st1 + b.z * st2,
        displacement: 0.0,
        tolerance: 0.0,
    }
}

/// Points by the transform, normals by its inverse transpose (which keeps outer outer under mirroring too); the displacement stays in the object's units.
fn transformed(point: &SurfacePoint, to_world: &Affine3A) -> SurfacePoint {
    let normal_matrix = to_world.matrix3.inverse().transpose();
    let normal = |n: Vec3| (normal_matrix * n).normalize();
    SurfacePoint {
        position: to_world.transform_point3(point.position),
        base_position: to_world.transform_point3(point.base_position),
        base_normal: normal(point.base_normal),
        geometric_normal: normal(point.geometric_normal),
        shading_normal: normal(point.shading_normal),
        ..*point
    }
}
