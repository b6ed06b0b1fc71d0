//! What all integrators share: hits made ready for shading, and rays that leave them.

use std::collections::BTreeMap;

use glam::Vec3;

use super::super::detail;
use super::super::film::FirstHit;
use super::super::material;
use super::super::sampler::{Dimension, Purpose, Sampler};
use super::super::shading::{ShadedPoint, is_outside};
use super::super::{RenderInput, Surfaces};
use super::CameraRay;
use super::bodies::Bodies;
use crate::ray::{Cone, Ray};
use crate::scene::{Aov, Material};
use crate::surface::SurfacePoint;
use crate::trace::{Hit, RayOffset, Tracer};

/// Most surfaces that a shadow ray is asked to pass.
const MOST_HOLES: u32 = 64;

/// The traced scene as an integrator sees it.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// Finds hits.
    pub tracer: &'a dyn Tracer,
    /// Tells what was hit.
    pub surfaces: &'a dyn Surfaces,
    materials: &'a [Material],
    object_materials: &'a [usize],
    offset: RayOffset,
    /// Whether any material has holes: only then a shadow ray must look at what it meets.
    has_holes: bool,
    /// Whether the film keeps the albedo of first hits.
    keeps_albedo: bool,
    /// Of camera rays.
    pub cone: Cone,
}

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Met<'a> {
    /// As the tracer reported it.
    pub hit: Hit,
    /// The surface there.
    pub point: SurfacePoint,
    /// Index of its material.
    pub index: usize,
    /// Its material.
    pub material: &'a Material,
    /// Whether the ray came from the outer side.
    pub from_outside: bool,
}

impl<'a> Stage<'a> {
    /// The stage of `input`.
    pub fn new(input: &RenderInput<'a>) -> Self {
        Self {
            tracer: input.tracer,
            surfaces: input.surfaces,
            materials: input.materials,
            object_materials: input.object_materials,
            offset: RayOffset::for_scene(input.tracer.bounds().diagonal()),
            has_holes: input.materials.iter().any(Material::has_holes),
            keeps_albedo: input.film.aovs.has(Aov::Albedo),
            cone: Cone::from_eye(
                input
                    .camera
                    .pixel_spread(input.film.width, input.film.height),
            ),
        }
    }

    /// The first hit of `ray`, as the cone around it sees the surface.
    pub fn meet(&self, ray: &Ray, cone: &Cone) -> Option<Met<'a>> {
        let hit = self.tracer.intersect(ray)?;
        Some(self.met(hit, ray, cone))
    }

    /// The same where the hit is known.
    pub fn met(&self, hit: Hit, ray: &Ray, cone: &Cone) -> Met<'a> {
        let point = self.surfaces.seen_point(&hit, ray, cone);
        let index = self.object_materials[self.surfaces.object(&hit)];
        Met {
            hit,
            point,
            index,
            material: &self.materials[index],
            from_outside: is_outside(&point, -ray.direction),
        }
    }

    /// What a camera ray meets first.
    pub fn met_first(&self, camera: &CameraRay) -> Option<Met<'a>> {
        Some(self.met(camera.hit?, &camera.ray, &self.cone))
    }

    /// What `ray` met, ready for shading. `eta` is the index of refraction beyond it over that before it; what is
    /// opaque there is at least as rough as `least_alpha`.
    pub fn shade(&self, ray: &Ray, met: &Met, eta: f32, least_alpha: f32) -> ShadedPoint {
        let inside = !met.from_outside && met.material.is_transmissive();
        let mut parameters = material::parameters(met.material, &met.point, eta, inside);
        if !met.material.is_transmissive() {
            parameters.blur(least_alpha);
        }
        let normal = match &met.material.detail {
            Some(detail) => detail::normal(detail, &met.point, self.surfaces.tangents(&met.hit)),
            None => met.point.shading_normal,
        };
        ShadedPoint::new(&met.point, normal, -ray.direction, parameters)
    }

    /// What the film is told of the first thing that a camera ray met.
    pub fn first_hit(&self, met: &Met, shaded: &ShadedPoint) -> FirstHit {
        let point = &met.point;
        FirstHit {
            albedo: if self.keeps_albedo {
                shaded.bsdf().albedo()
            } else {
                Vec3::ZERO
            },
            normal: point.shading_normal,
            position: point.position,
            texcoord: point.texcoord,
            displacement: point.displacement,
            object: self.surfaces.object(&met.hit),
            prim: met.hit.prim,
        }
    }

    /// A ray that leaves `point` in `direction`, on the side that this is on.
    pub fn ray_from(&self, point: &SurfacePoint, direction: Vec3, key: u32) -> Ray {
        Ray {
            key,
            ..Ray::new(self.start(point, direction), direction)
        }
    }

    fn start(&self, point: &SurfacePoint, direction: Vec3) -> Vec3 {
        let side = if is_outside(point, direction) {
            1.0
        } else {
            -1.0
        };
        let normal = side * point.geometric_normal;
        self.offset
            .apply(point.position + point.tolerance * normal, normal)
    }

    /// The part of light that comes through along `ray`: 0 or 1 but for surfaces with holes. Glass hides what is
    /// behind it.
    pub fn visibility(&self, mut ray: Ray) -> f32 {
        if !self.has_holes {
            return if self.tracer.occluded(&ray) { 0.0 } else { 1.0 };
        }
        let mut part = 1.0;
        for _ in 0..MOST_HOLES {
            let Some(met) = self.meet(&ray, &Cone::default()) else {
                return part;
            };
            part *= 1.0 - material::opacity(met.material, &met.point);
            if part == 0.0 {
                return 0.0;
            }
            ray = self.beyond(&ray, &met);
        }
        0.0
    }

    /// `ray` from behind what it met.
    pub fn beyond(&self, ray: &Ray, met: &Met) -> Ray {
        Ray {
            origin: self.start(&met.point, ray.direction),
            tfar: ray.tfar - met.hit.t,
            ..*ray
        }
    }

    /// All that lies along a ray, whatever hides it.
    fn crossings(&self, ray: Ray) -> impl Iterator<Item = Met<'a>> {
        let mut ray = ray;
        let next = move || {
            let met = self.meet(&ray, &Cone::default())?;
            ray = self.beyond(&ray, &met);
            Some(met)
        };
        std::iter::from_fn(next).take(MOST_HOLES as usize)
    }

    /// The bodies around a point: those whose inner sides a ray from there to the outside meets.
    pub fn bodies_at(&self, position: Vec3) -> Bodies {
        let mut entered = Bodies::default();
        let mut around = Vec::new();
        for met in self.crossings(Ray::new(position, Vec3::Y)) {
            if met.material.is_transmissive() {
                let after = entered
                    .cross(self.materials, met.index, met.from_outside)
                    .beyond;
                if after == entered {
                    around.push(met.index);
                }
                entered = after;
            }
        }
        // The outermost was entered first.
        let enter = |bodies: Bodies, index| bodies.cross(self.materials, index, true).beyond;
        around.into_iter().rev().fold(Bodies::default(), enter)
    }

    /// The opaque object that is around `position`, if any: in all of 26 directions it is left once more than it is entered. Where
    /// `is_lit`, so that light may be inside with the camera, it must also be all that is seen.
    pub fn enclosing_object(&self, position: Vec3, is_lit: bool) -> Option<usize> {
        let steps = [-1.0, 0.0, 1.0];
        let all = steps.map(|x| steps.map(|y| steps.map(|z| Vec3::new(x, y, z))));
        let directions = all.into_iter().flatten().flatten();
        let mut around: Option<Vec<u32>> = None;
        let mut object = None;
        for direction in directions.filter(|d| *d != Vec3::ZERO) {
            // A little askew: rays along the axes of a scene graze its edges.
            let askew = direction.normalize() + Vec3::new(0.013, 0.027, -0.019);
            let ray = Ray::new(position, askew.normalize());
            let left = self.left_along(ray, is_lit);
            let mut both = around
                .take()
                .unwrap_or_else(|| left.keys().copied().collect());
            both.retain(|top| left.contains_key(top));
            object = both.first().map(|top| left[top]);
            object?;
            around = Some(both);
        }
        object
    }

    /// The opaque objects, by the place where they stand, that a ray leaves more often than it enters them. `first_only` leaves out those
    /// behind the first.
    fn left_along(&self, ray: Ray, first_only: bool) -> BTreeMap<u32, usize> {
        let mut places = BTreeMap::new();
        let mut first = None;
        for met in self.crossings(ray) {
            let top = met.hit.top();
            first.get_or_insert(top);
            if !met.material.is_transmissive() && !met.material.has_holes() {
                let (count, _) = places
                    .entry(top)
                    .or_insert((0, self.surfaces.object(&met.hit)));
                *count += if met.from_outside { -1 } else { 1 };
            }
        }
        places.retain(|top, (count, _)| *count > 0 && (!first_only || first == Some(*top)));
        let objects = places.into_iter().map(|(top, (_, object))| (top, object));
        objects.collect()
    }

    /// Whether the ray slips through a hole; the number of its surface so far keeps choices apart.
    pub fn slips(&self, met: &Met, crossing: u32, sampler: &Sampler) -> bool {
        if !met.material.has_holes() {
            return false;
        }
        let dimension = Dimension::new(crossing, Purpose::Opacity);
        sampler.point(dimension).x >= material::opacity(met.material, &met.point)
    }
}
