//! The same world on a pure-Rust BVH (obvhs), for comparison with Embree and where there is none.
//!
//! Two levels: a compressed wide BVH (CWBVH) per object, and one over the places where objects stand.
//! An instance transforms the ray without renormalising its direction, so that t keeps its meaning.
//!
//! **Ties.** Of two hits at exactly the same t the one with the lower (top-level id, primitive) is
//! reported. Embree reports the one it meets first, so the two backends may name different primitives
//! on a shared edge; t is the same.

mod object;
mod quantise;
mod slabs;
mod tree;
mod triangle;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{Affine3A, Mat3A, Vec3};
use thiserror::Error;

use crate::ray::{Aabb, Ray};
use crate::surface::{DisplacementMap, TexelRect};
use crate::trace::{
    Edited, Follow, Hit, INVALID_ID, Maker, Placement, RayReach, Tracer, World, WorldError, grown,
    placed,
};
use object::{Closest, ObjectTree, boxes};
use tree::Tree;

/// An instance's box is grown by this many units in the last place of the terms that make it, for the
/// rounding of the transforms of box and ray.
const INSTANCE_PAD_ULPS: f32 = 16.0;

/// Why a world cannot be traced by this backend.
#[derive(Debug, Error, PartialEq)]
pub enum BvhError {
    /// No backend can trace it.
    #[error("object {}: {source}", source.object())]
    World {
        /// Why.
        #[from]
        source: WorldError,
    },
    /// The tree came out too deep, as a great many primitives in one place can make it.
    #[error(
        "the BVH is {depth} levels deep, traversal reaches {max}; too many primitives lie in one place"
    )]
    TooDeep {
        /// Levels below the root.
        depth: u32,
        /// Most levels.
        max: u32,
    },
    /// A refit got a world of other objects.
    #[error(
        "{what} differs from the world that was built; a refit needs the same kinds and numbers of \
         primitives in the same places"
    )]
    Changed {
        /// Which part.
        what: String,
    },
}

/// A place where an object stands.
struct Place {
    object: u32,
    /// World to object; `None` for objects that stand in world space.
    to_object: Option<Affine3A>,
    mask: u32,
}

/// A [`World`] under obvhs.
pub struct BvhTracer {
    objects: Vec<ObjectTree>,
    /// In the order of top-level ids.
    places: Vec<Place>,
    top: Tree,
    /// [`World::growths`] when the boxes were taken.
    growths: Vec<u64>,
    reach: RayReach,
}

impl BvhTracer {
    /// Builds all trees, on the calling thread.
    ///
    /// # Errors
    ///
    /// [`BvhError`] for boxes and transforms that cannot be traced.
    pub fn new(world: &World) -> Result<Self, BvhError> {
        let reach = world.ray_reach()?;
        let growths = world.growths();
        let objects = world
            .objects()
            .iter()
            .enumerate()
            .map(|(index, object)| ObjectTree::build(&object.shape, index))
            .collect::<Result<Vec<_>, _>>()?;
        let bounds: Vec<Aabb> = objects.iter().map(ObjectTree::bounds).collect();
        let (places, boxes) = places(world, &bounds)?;
        Ok(Self {
            objects,
            places,
            top: Tree::build(&boxes, 1)?,
            growths,
            reach,
        })
    }

    /// Takes an edited state of the same world: new heights or positions, masks and transforms. Far
    /// cheaper than a new tree, which traces faster after large changes.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`BvhError::Changed`] if the numbers of objects, primitives or instances differ. Then
    /// nothing has changed.
    pub fn refit(&mut self, world: &World) -> Result<(), BvhError> {
        self.check_same_layout(world)?;
        let reach = world.ray_reach()?;
        let growths = world.growths();
        let object_boxes = world
            .objects()
            .iter()
            .enumerate()
            .map(|(index, object)| boxes(&object.shape, index))
            .collect::<Result<Vec<_>, _>>()?;
        let bounds: Vec<Aabb> = object_boxes
            .iter()
            .map(|boxes| boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union))
            .collect();
        let (places, place_boxes) = places(world, &bounds)?;

        let new_states = world.objects().iter().zip(&object_boxes);
        for (tree, (object, boxes)) in self.objects.iter_mut().zip(new_states) {
            tree.refit(&object.shape, boxes);
        }
        self.places = places;
        self.top.refit(&place_boxes);
        self.growths = growths;
        self.reach = reach;
        Ok(())
    }

    /// Brings the tracer up to date after an edit of a map in place ([`DisplacementMap::update`]): `world` is the one it was
    /// built from, and all its objects over `map` follow. Trees are refitted only where bounds have grown, and in them only what is above those, also by edits that
    /// another tracer of the same prisms has been told of.
    ///
    /// # Errors
    ///
    /// As [`refit`](Self::refit); then the trees are as they were, and may miss what has grown.
    pub fn map_edited(
        &mut self,
        world: &World,
        map: &Arc<DisplacementMap>,
        rect: TexelRect,
    ) -> Result<Edited, BvhError> {
        let prims_touched = world.map_edited(map, rect);
        Ok(Edited {
            prims_touched,
            committed: self.follow(world)?,
        })
    }

    fn check_same_layout(&self, world: &World) -> Result<(), BvhError> {
        let changed = |what: String| Err(BvhError::Changed { what });
        if world.objects().len() != self.objects.len() {
            return changed("the number of objects".into());
        }
        for (index, (tree, object)) in self.objects.iter().zip(world.objects()).enumerate() {
            if !tree.fits(&object.shape) {
                return changed(format!("the shape of object {index}"));
            }
        }
        let same = |(place, &(object, instance)): (&Place, &(u32, Option<u32>))| {
            place.object == object && place.to_object.is_some() == instance.is_some()
        };
        if world.top_level().len() != self.places.len()
            || !self.places.iter().zip(world.top_level()).all(same)
        {
            return changed("the number of instances".into());
        }
        Ok(())
    }

    /// `ray` in the space of the object at a place, unless the place is hidden from it.
    #[inline]
    fn local_ray(&self, place: &Place, ray: &Ray) -> Option<Ray> {
        if place.mask & ray.mask == 0 {
            return None;
        }
        let Some(to_object) = &place.to_object else {
            return Some(*ray);
        };
        // Valid, by what the world's reach promises.
        Some(Ray {
            origin: to_object.transform_point3(ray.origin),
            direction: to_object.transform_vector3(ray.direction),
            ..*ray
        })
    }

    fn to_hit(&self, closest: Closest) -> Hit {
        let Closest { hit, top } = closest;
        let (geom, inst) = match self.places[top as usize].to_object {
            Some(_) => (0, top),
            None => (top, INVALID_ID),
        };
        Hit {
            t: hit.t,
            u: hit.u,
            v: hit.v,
            prim: hit.prim,
            geom,
            inst: [inst],
            ng: hit.ng,
        }
    }
}

impl Follow for BvhTracer {
    type Error = BvhError;

    fn follow(&mut self, world: &World) -> Result<bool, BvhError> {
        self.check_same_layout(world)?;
        let growths = world.growths();
        let grown = grown(&self.growths, &growths);
        if !grown.is_empty() {
            let boxes_of = |&index: &usize| boxes(&world.objects()[index].shape, index);
            let new = grown.iter().map(boxes_of).collect::<Result<Vec<_>, _>>()?;
            let mut bounds: Vec<Aabb> = self.objects.iter().map(ObjectTree::bounds).collect();
            for (&index, boxes) in grown.iter().zip(&new) {
                bounds[index] = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
            }
            let (places, place_boxes) = places(world, &bounds)?;
            for (&index, boxes) in grown.iter().zip(&new) {
                self.objects[index].refit(&world.objects()[index].shape, boxes);
            }
            self.places = places;
            self.top.refit(&place_boxes);
            self.growths = growths;
        }
        Ok(!grown.is_empty())
    }

    fn maker(&self) -> Maker<Self, BvhError> {
        Box::new(Self::new)
    }
}

impl Tracer for BvhTracer {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.reach.intersect(ray, |ray| self.intersect_asked(ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let ask = |ray: &Ray| self.occluded_asked(ray);
        let first = |ray: &Ray| self.intersect_asked(ray);
        self.reach.occluded(ray, ask, first)
    }

    fn bounds(&self) -> Aabb {
        self.top.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        let trees: usize = self.objects.iter().map(ObjectTree::bytes).sum();
        trees + self.top.bytes() + size_of_val(&self.places[..])
    }

    fn name(&self) -> String {
        "obvhs".into()
    }
}

impl BvhTracer {
    #[inline(always)]
    fn intersect_asked(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Closest> = None;
        self.top.traverse(ray, |top| {
            let place = &self.places[top as usize];
            if let Some(local) = self.local_ray(place, ray) {
                self.objects[place.object as usize].intersect(&local, top, &mut best);
            }
            ControlFlow::Continue(best.map_or(ray.tfar, |best| best.tfar()))
        });
        best.map(|closest| self.to_hit(closest))
    }

    #[inline(always)]
    fn occluded_asked(&self, ray: &Ray) -> bool {
        self.top.traverse(ray, |top| {
            let place = &self.places[top as usize];
            match self.local_ray(place, ray) {
                Some(local) if self.objects[place.object as usize].occluded(&local) => {
                    ControlFlow::Break(())
                }
                _ => ControlFlow::Continue(ray.tfar),
            }
        })
    }
}

/// Every place of the world in the order of top-level ids, and the box of what stands there;
/// `bounds[object]` is in the object's own space.
fn places(world: &World, bounds: &[Aabb]) -> Result<(Vec<Place>, Vec<Aabb>), BvhError> {
    let mut places = Vec::with_capacity(world.top_level().len());
    let mut boxes = Vec::with_capacity(world.top_level().len());
    for &(object, instance) in world.top_level() {
        let described = &world.objects()[object as usize];
        let bounds = bounds[object as usize];
        let (to_object, placed) = match (&described.placement, instance) {
            (Placement::Instances(transforms), Some(instance)) => {
                let transform = &transforms[instance as usize];
                let placed = transformed(bounds, transform);
                if !placed.is_traceable() {
                    return Err(WorldError::Placed {
                        object: object as usize,
                        instance: instance as usize,
                        bounds: placed,
                    }
                    .into());
                }
                (Some(transform.inverse()), placed)
            }
            _ => (None, bounds),
        };
        places.push(Place {
            object,
            to_object,
            mask: described.mask,
        });
        boxes.push(placed);
    }
    Ok((places, boxes))
}

/// The box over a transformed box, grown by [`INSTANCE_PAD_ULPS`].
fn transformed(bounds: Aabb, transform: &Affine3A) -> Aabb {
    let around = placed(bounds, transform);
    // Terms may cancel, so the error is measured by their magnitudes and not by the box.
    let m = transform.matrix3;
    let magnitudes = Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let reach = magnitudes * bounds.min.abs().max(bounds.max.abs())
        + Vec3::from(transform.translation.abs());
    let pad = Vec3::splat(reach.max_element() * INSTANCE_PAD_ULPS * f32::EPSILON);
    Aabb {
        min: around.min - pad,
        max: around.max + pad,
    }
}
