//! Scenes: built, committed, traced; reopened to be changed.

use std::ptr::NonNull;
use std::sync::Arc;

use glam::Vec3;

use super::geometry::{Kind, count};
use super::user::packet_to_raw;
use super::{Device, EmbreeError, Geometry, HitTest, Instance, Prototype, sys};
use crate::ray::{Aabb, Ray, RayPacket, lanes_of, time_within};
use crate::surface::PointQuery;
use crate::trace::{Closest, Hit, MAX_INSTANCE_LEVELS, RayReach};

const _: () = assert!(MAX_INSTANCE_LEVELS == sys::PM_INSTANCE_LEVELS as usize);

/// Build time against tracing speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BuildQuality {
    /// Fast builds. A geometry that changes is refitted instead of rebuilt, and nothing else is touched: for edits.
    Low,
    /// Between.
    #[default]
    Medium,
    /// Fast rays.
    High,
}

/// How a scene is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneOptions {
    /// Build time against tracing speed.
    pub quality: BuildQuality,
    /// Better for scenes that change often.
    pub dynamic: bool,
    /// Less memory, slower.
    pub compact: bool,
    /// No ray slips through between triangles; user geometries are not touched by this.
    pub robust: bool,
}

impl SceneOptions {
    fn flags(self) -> u32 {
        [
            (self.dynamic, sys::PM_SCENE_DYNAMIC),
            (self.compact, sys::PM_SCENE_COMPACT),
            (self.robust, sys::PM_SCENE_ROBUST),
        ]
        .into_iter()
        .map(|(on, flag)| if on { flag } else { 0 })
        .sum()
    }

    fn raw_quality(self) -> u32 {
        match self.quality {
            BuildQuality::Low => sys::PM_QUALITY_LOW,
            BuildQuality::Medium => sys::PM_QUALITY_MEDIUM,
            BuildQuality::High => sys::PM_QUALITY_HIGH,
        }
    }
}

struct RawScene(NonNull<sys::pm_scene>);

impl Drop for RawScene {
    fn drop(&mut self) {
        // SAFETY: made by pm_scene_new, freed once.
        unsafe { sys::pm_scene_free(self.0.as_ptr()) }
    }
}

/// A scene that can be changed but not traced.
pub struct SceneBuilder {
    // Dropped in this order: Embree calls nothing of a geometry once the scene is gone, and reads nothing of a
    // prototype once its instances are.
    raw: RawScene,
    geometries: Vec<Geometry>,
    prototypes: Vec<Scene>,
    /// Prototypes to be built again by the next commit; each is in range.
    edited: Vec<u32>,
    /// Through all instances so far.
    reach: RayReach,
    options: SceneOptions,
    device: Device,
}

// SAFETY: the scene is used by one thread at a time; what it owns is Send.
unsafe impl Send for SceneBuilder {}

impl SceneBuilder {
    /// An empty scene.
    pub fn new(device: &Device, options: SceneOptions) -> Result<Self, EmbreeError> {
        // SAFETY: a live device.
        let raw = device.guarded(|| unsafe {
            // Qualities and flags are small enumerators.
            sys::pm_scene_new(
                device.raw(),
                options.raw_quality() as i32,
                options.flags() as i32,
            )
        })?;
        let raw = NonNull::new(raw).ok_or_else(|| EmbreeError::Library {
            code: super::ErrorCode::Unknown,
            message: "no scene was made".to_string(),
        })?;
        Ok(Self {
            raw: RawScene(raw),
            geometries: Vec::new(),
            prototypes: Vec::new(),
            edited: Vec::new(),
            reach: RayReach::default(),
            options,
            device: device.clone(),
        })
    }

    /// An empty scene of the same device and options.
    pub(super) fn another(&self) -> Result<Self, EmbreeError> {
        Self::new(&self.device, self.options)
    }

    /// Adds a geometry; ids count up from 0.
    pub fn attach(&mut self, geometry: impl Into<Geometry>) -> Result<u32, EmbreeError> {
        let mut geometry = geometry.into();
        let id = count("geometries", self.geometries.len())?;
        if self.options.quality == BuildQuality::Low && geometry.kind == Kind::User {
            // SAFETY: a live geometry that no scene has yet.
            unsafe { sys::pm_geometry_set_quality(geometry.raw(), sys::PM_QUALITY_REFIT as i32) };
        }
        geometry.commit()?;
        // SAFETY: both live; the geometry is dropped after the scene.
        let attached = self
            .device
            .guarded(|| unsafe { sys::pm_scene_attach(self.raw.0.as_ptr(), geometry.raw(), id) });
        attached?;
        self.geometries.push(geometry);
        Ok(id)
    }

    /// Takes a scene in order to instance it. One level: `scene` must not have prototypes of its own.
    pub fn add_prototype(&mut self, scene: Scene) -> Result<Prototype, EmbreeError> {
        if !scene.0.prototypes.is_empty() {
            return Err(EmbreeError::NestedInstances);
        }
        let id = count("prototypes", self.prototypes.len())?;
        self.prototypes.push(scene);
        Ok(Prototype(id))
    }

    /// Adds an instance of one of this scene's prototypes; ids are those of [`attach`](Self::attach).
    pub fn attach_instance(&mut self, instance: &Instance) -> Result<u32, EmbreeError> {
        let id = instance.prototype.0;
        let scene = self
            .prototypes
            .get(id as usize)
            .ok_or(EmbreeError::NotInScene {
                what: "prototype",
                id,
            })?;
        let reach = self.reach.through(&instance.transform)?;
        // SAFETY: prototypes are dropped after geometries, and edited in place only.
        let geometry = unsafe { instance.geometry(&self.device, scene) }?;
        let id = self.attach(geometry)?;
        self.reach = reach;
        Ok(id)
    }

    /// Asks about rays within `reach` only, which must be no more than what the instances leave.
    pub(super) fn narrow(&mut self, reach: RayReach) {
        self.reach = reach;
    }

    /// Gives user geometry `id` another hit test. With as many primitives as before and
    /// [`BuildQuality::Low`] the next commit refits.
    pub fn replace<T: HitTest + 'static>(
        &mut self,
        id: u32,
        test: Arc<T>,
    ) -> Result<(), EmbreeError> {
        self.edit().replace(id, test)
    }

    /// Tells that the bounds of user geometry `id` have changed.
    pub fn changed(&mut self, id: u32) -> Result<(), EmbreeError> {
        self.edit().changed(id)
    }

    /// Lets `change` move the vertices of triangle or grid geometry `id`.
    pub fn move_vertices(
        &mut self,
        id: u32,
        change: impl FnOnce(&mut [[f32; 3]]),
    ) -> Result<(), EmbreeError> {
        self.edit().move_vertices(id, change)
    }

    fn edit(&mut self) -> SceneEdit<'_> {
        SceneEdit {
            geometries: &mut self.geometries,
        }
    }

    /// A prototype, to be edited; the next commit builds it again and its instances follow.
    pub fn prototype_mut(&mut self, prototype: Prototype) -> Result<SceneEdit<'_>, EmbreeError> {
        let id = prototype.0;
        let scene = self
            .prototypes
            .get_mut(id as usize)
            .ok_or(EmbreeError::NotInScene {
                what: "prototype",
                id,
            })?;
        self.edited.push(id);
        Ok(scene.0.edit())
    }

    /// Builds. Runs outside rayon's pool, whose threads Embree's would fight for the cores.
    pub fn commit(mut self) -> Result<Scene, EmbreeError> {
        self.commit_in_place()?;
        Ok(Scene(self))
    }

    fn commit_in_place(&mut self) -> Result<(), EmbreeError> {
        if rayon::current_thread_index().is_none() {
            return self.commit_here();
        }
        std::thread::scope(|scope| {
            scope
                .spawn(|| self.commit_here())
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }

    fn commit_here(&mut self) -> Result<(), EmbreeError> {
        for id in std::mem::take(&mut self.edited) {
            self.prototypes[id as usize].0.commit_here()?;
            let kind = Kind::Instance { prototype: id };
            for instance in self.geometries.iter_mut().filter(|g| g.kind == kind) {
                instance.commit()?;
            }
        }
        let raw = self.raw.0.as_ptr();
        // SAFETY: a live scene, exclusively borrowed: nobody traces it.
        let built = self.device.guarded(|| unsafe { sys::pm_scene_commit(raw) });
        built?;
        self.device.check()
    }
}

/// The part of a scene that can change in place: the hit tests of its user geometries and the vertices of the others.
pub struct SceneEdit<'s> {
    geometries: &'s mut [Geometry],
}

impl SceneEdit<'_> {
    /// As [`SceneBuilder::replace`].
    pub fn replace<T: HitTest + 'static>(
        &mut self,
        id: u32,
        test: Arc<T>,
    ) -> Result<(), EmbreeError> {
        let geometry = self.user_geometry(id)?;
        geometry.replace_test(test)?;
        geometry.commit()
    }

    /// As [`SceneBuilder::changed`].
    pub fn changed(&mut self, id: u32) -> Result<(), EmbreeError> {
        self.user_geometry(id)?.commit()
    }

    /// As [`SceneBuilder::move_vertices`].
    pub fn move_vertices(
        &mut self,
        id: u32,
        change: impl FnOnce(&mut [[f32; 3]]),
    ) -> Result<(), EmbreeError> {
        let geometry = self
            .geometries
            .get_mut(id as usize)
            .filter(|g| g.kind == Kind::Mesh)
            .ok_or(EmbreeError::NotInScene {
                what: "triangle or grid geometry",
                id,
            })?;
        geometry.move_vertices(change)?;
        geometry.commit()
    }

    fn user_geometry(&mut self, id: u32) -> Result<&mut Geometry, EmbreeError> {
        self.geometries
            .get_mut(id as usize)
            .filter(|g| g.kind == Kind::User)
            .ok_or(EmbreeError::NotInScene {
                what: "user geometry",
                id,
            })
    }
}

/// What Embree may expect of the rays of a packet; answers do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coherence {
    /// They go the same way from about the same place, like those of neighbouring pixels.
    Coherent,
    /// They part soon.
    Incoherent,
}

/// A committed scene: traceable from any number of threads, and unchangeable.
pub struct Scene(SceneBuilder);

// SAFETY: Embree allows any number of threads to trace a committed scene, and nothing else is done through
// `&Scene`; hit tests and filters are Sync.
unsafe impl Sync for Scene {}

impl Scene {
    /// The same scene, to be changed and committed again.
    pub fn reopen(self) -> SceneBuilder {
        self.0
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.0.device
    }

    pub(super) fn raw(&self) -> *mut sys::pm_scene {
        self.0.raw.0.as_ptr()
    }

    /// The box over everything; [`Aabb::EMPTY`] for an empty scene.
    pub fn bounds(&self) -> Aabb {
        let mut out = [0.0; 6];
        // SAFETY: a live, committed scene; room for six floats.
        unsafe { sys::pm_scene_bounds(self.raw(), out.as_mut_ptr()) };
        let [x0, y0, z0, x1, y1, z1] = out;
        let bounds = Aabb {
            min: Vec3::new(x0, y0, z0),
            max: Vec3::new(x1, y1, z1),
        };
        if bounds.is_valid() {
            bounds
        } else {
            Aabb::EMPTY
        }
    }

    /// The rays that Embree is asked about: others hit nothing.
    pub fn ray_reach(&self) -> RayReach {
        self.0.reach
    }

    /// The first hit with t in (tnear, tfar); none for a ray that is not within [`ray_reach`](Self::ray_reach).
    pub fn intersect1(&self, ray: &Ray) -> Option<Hit> {
        self.0.reach.intersect(ray, |ray| self.intersect_asked(ray))
    }

    #[inline(always)]
    fn intersect_asked(&self, ray: &Ray) -> Option<Hit> {
        let mut hit = BLANK_HIT;
        // SAFETY: a live, committed scene; the shim reads the ray and writes the hit.
        let found = unsafe { sys::pm_intersect1(self.raw(), &ray_to_raw(ray), &mut hit) };
        found.then(|| hit_from_raw(&hit))
    }

    /// Whether there is any hit with t in (tnear, tfar).
    pub fn occluded1(&self, ray: &Ray) -> bool {
        // SAFETY: a live, committed scene; the shim reads the ray.
        let ask = |ray: &Ray| unsafe { sys::pm_occluded1(self.raw(), &ray_to_raw(ray)) };
        let first = |ray: &Ray| self.intersect_asked(ray);
        self.0.reach.occluded(ray, ask, first)
    }

    /// The nearest point of the user geometries, by their [`HitTest::closest`], no further than `radius` (which may be infinite); none for a
    /// point that is not finite or a radius that is NaN or negative. Distances are the world's, under any instance.
    ///
    /// Embree's own triangles and grids are not looked at.
    pub fn closest(&self, point: Vec3, radius: f32) -> Option<Closest> {
        self.closest_at(point, radius, 0.0)
    }

    /// [`closest`](Self::closest) at a time from 0 to 1, as [`Ray::time`].
    pub fn closest_at(&self, point: Vec3, radius: f32, time: f32) -> Option<Closest> {
        if !PointQuery::new(point, radius).is_valid() {
            return None;
        }
        let mut found = sys::pm_closest {
            distance: 0.0,
            point: [0.0; 3],
            u: 0.0,
            v: 0.0,
            prim: 0,
            geom: 0,
            inst: [0; MAX_INSTANCE_LEVELS],
        };
        let point = point.to_array();
        // SAFETY: a live, committed scene; the shim reads the point and writes what is found.
        let any = unsafe {
            sys::pm_closest1(
                self.raw(),
                point.as_ptr(),
                radius,
                time_within(time),
                &mut found,
            )
        };
        any.then(|| Closest {
            distance: found.distance,
            point: Vec3::from_array(found.point),
            u: found.u,
            v: found.v,
            prim: found.prim,
            geom: found.geom,
            inst: found.inst,
        })
    }

    /// [`intersect1`](Self::intersect1) for every lane: none for empty ones.
    ///
    /// Hits on user geometry are those of single rays to the bit, unless two primitives are hit at the same t, where
    /// either may be named; Embree's own triangles are hit alike up to rounding.
    pub fn intersect8(
        &self,
        rays: &RayPacket,
        coherence: Coherence,
    ) -> [Option<Hit>; RayPacket::LANES] {
        let valid = self.0.reach.admitted(rays);
        if valid & !rays.level(self.0.reach.far()) != 0 {
            return std::array::from_fn(|lane| self.intersect1(&rays.ray(lane)));
        }
        let mut hits = [BLANK_HIT; RayPacket::LANES];
        // SAFETY: a live, committed scene; the shim reads the packet and writes up to eight hits.
        let found = unsafe {
            sys::pm_intersect8(
                self.raw(),
                packet_to_raw(rays),
                valid.into(),
                coherence == Coherence::Coherent,
                hits.as_mut_ptr(),
            )
        };
        std::array::from_fn(|lane| (found >> lane & 1 == 1).then(|| hit_from_raw(&hits[lane])))
    }

    /// [`occluded1`](Self::occluded1) for every lane: bit i tells of lane i, and is 0 for an empty one.
    pub fn occluded8(&self, rays: &RayPacket, coherence: Coherence) -> u8 {
        let valid = self.0.reach.admitted(rays);
        if valid & !rays.level(self.0.reach.far()) != 0 {
            return lanes_of(valid)
                .filter(|&lane| self.occluded1(&rays.ray(lane)))
                .fold(0, |bits, lane| bits | 1 << lane);
        }
        // SAFETY: a live, committed scene; the shim reads the packet.
        let bits = unsafe {
            sys::pm_occluded8(
                self.raw(),
                packet_to_raw(rays),
                valid.into(),
                coherence == Coherence::Coherent,
            )
        };
        bits as u8 // as many bits as lanes
    }
}

const BLANK_HIT: sys::pm_scene_hit = sys::pm_scene_hit {
    at: sys::pm_hit {
        t: 0.0,
        u: 0.0,
        v: 0.0,
        ng: [0.0; 3],
        prim: 0,
    },
    geom: 0,
    inst: [0; MAX_INSTANCE_LEVELS],
};

fn ray_to_raw(ray: &Ray) -> sys::pm_ray {
    sys::pm_ray {
        org: ray.origin.to_array(),
        tnear: ray.tnear,
        dir: ray.direction.to_array(),
        time: time_within(ray.time),
        tfar: ray.tfar,
        mask: ray.mask,
        id: ray.key,
        flags: 0,
    }
}

pub(super) fn hit_from_raw(hit: &sys::pm_scene_hit) -> Hit {
    Hit {
        t: hit.at.t,
        u: hit.at.u,
        v: hit.at.v,
        prim: hit.at.prim,
        geom: hit.geom,
        inst: hit.inst,
        ng: unit(Vec3::from_array(hit.at.ng)),
    }
}

/// Hit tests give unit normals, which stay as they are bit for bit; triangles give twice their area.
fn unit(n: Vec3) -> Vec3 {
    if (n.length_squared() - 1.0).abs() <= 8.0 * f32::EPSILON {
        return n;
    }
    // Scaled first: the square of a small triangle's normal underflows.
    (n / n.abs().max_element()).normalize_or_zero()
}
