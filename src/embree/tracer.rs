//! The whole world under Embree.

use std::sync::Arc;

use glam::Affine3A;

use super::part::{Grown, Nothing, Part};
use super::{
    BuildQuality, Coherence, Device, DeviceOptions, EmbreeError, Geometry, HitTest, Instance,
    Scene, SceneBuilder, SceneOptions, TriangleGeometry, UserGeometry,
};
use crate::ray::{Aabb, Ray, RayPacket};
use crate::surface::{DisplacementMap, TexelRect};
use crate::trace::{Edited, Follow, Hit, Maker, Object, Placement, Shape, Tracer, World, grown};

/// How Embree builds a world.
#[derive(Clone, Debug, Default)]
pub struct EmbreeOptions {
    /// Threads that build; 0 for one per core.
    pub threads: usize,
    /// Build time against tracing speed.
    pub quality: BuildQuality,
    /// Bytes that Embree may hold.
    pub memory_limit: Option<usize>,
}

/// A [`World`] traced by Embree.
pub struct EmbreeTracer {
    scene: Scene,
    /// By object; none for plain triangles.
    parts: Vec<Option<Arc<Part>>>,
    /// What edits have made grow since `scene` was built, under the same ids.
    grown: Option<Scene>,
    /// [`World::growths`] when bounds were last read.
    growths: Vec<u64>,
    device: Device,
    options: SceneOptions,
}

/// Where more than this part of a world's primitives has grown, all is built anew.
const MOST_GROWN: f64 = 0.25;

impl EmbreeTracer {
    /// Builds the world on a device of its own.
    ///
    /// # Errors
    ///
    /// [`EmbreeError::World`] where the world cannot be traced, and what Embree reports.
    pub fn new(world: &World, options: &EmbreeOptions) -> Result<Self, EmbreeError> {
        let config = match options.threads {
            0 => String::new(),
            n => format!("threads={n}"),
        };
        let device = Device::new(&DeviceOptions {
            config,
            memory_limit: options.memory_limit,
        })?;
        let options = SceneOptions {
            quality: options.quality,
            robust: true,
            ..SceneOptions::default()
        };
        Self::on(&device, options, world)
    }

    fn on(device: &Device, options: SceneOptions, world: &World) -> Result<Self, EmbreeError> {
        // Before any bounds are read.
        let growths = world.growths();
        let parts = parts_of(world);
        Ok(Self {
            scene: whole(device, options, world, &parts)?,
            parts,
            grown: None,
            growths,
            device: device.clone(),
            options,
        })
    }

    /// Brings the tracer up to date after an edit of a map in place ([`DisplacementMap::update`]): `world` is the one it was
    /// built from, and all its objects over `map` follow. Something is built only where bounds have grown, also by
    /// edits that another tracer of the same prisms has been told of.
    ///
    /// What has grown is put into a small scene of its own, which is asked before the large one: 64 x 64 texels are there in about a
    /// millisecond, however large the world. [`Self::settle`] makes one of the two again; where a quarter of the world has
    /// grown, this does so.
    ///
    /// # Errors
    ///
    /// What Embree reports; then the tracer is of no use any more.
    ///
    /// # Panics
    ///
    /// If `world` has another number of objects than the one that the tracer was built from.
    pub fn map_edited(
        &mut self,
        world: &World,
        map: &Arc<DisplacementMap>,
        rect: TexelRect,
    ) -> Result<Edited, EmbreeError> {
        let prims_touched = world.map_edited(map, rect);
        Ok(Edited {
            prims_touched,
            committed: self.follow(world)?,
        })
    }

    fn take_grown(&mut self, world: &World) -> Result<(), EmbreeError> {
        let grown: Vec<Option<Arc<Grown>>> = (self.parts.iter())
            .map(|part| part.as_ref().map(|part| Arc::new(part.grown())))
            .collect();
        let all: usize = self.parts.iter().flatten().map(|part| part.len()).sum();
        let left: usize = grown.iter().flatten().map(|grown| grown.len()).sum();
        if left as f64 > MOST_GROWN * all as f64 {
            return self.settle(world);
        }
        let geometry = |index: usize, _: &Object| {
            Ok(match &grown[index] {
                Some(grown) => UserGeometry::new(&self.device, grown.clone())?.into(),
                None => UserGeometry::new(&self.device, Arc::new(Nothing))?.into(),
            })
        };
        self.grown = Some(build(&self.device, self.options, world, geometry)?);
        Ok(())
    }

    /// Builds all anew after edits, so that rays are as fast as those of a new tracer: for when nobody waits. `world` is the one that the
    /// tracer was built from.
    ///
    /// # Errors
    ///
    /// What Embree reports; then the tracer is of no use any more.
    pub fn settle(&mut self, world: &World) -> Result<(), EmbreeError> {
        world.tighten();
        self.growths = world.growths();
        self.parts = parts_of(world);
        self.grown = None;
        self.scene = whole(&self.device, self.options, world, &self.parts)?;
        Ok(())
    }

    /// The first fault since the last call, such as a panic in a kernel: its rays saw a miss.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.scene.device().check()
    }

    /// The scene, for what [`Tracer`] does not offer; after edits, what has grown is in it again when the tracer has been
    /// [settled](Self::settle).
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

/// Where packets are said to be coherent, Embree keeps them together until two lanes are left, and asks occlusion tests
/// about lanes that miss the box: a prism's test costs more than that saves.
const COHERENCE: Coherence = Coherence::Incoherent;

fn parts_of(world: &World) -> Vec<Option<Arc<Part>>> {
    let part = |object: &Object| match &object.shape {
        Shape::Displaced(prisms) => Some(Part::new(prisms)),
        Shape::Triangles(_) => None,
    };
    world.objects().iter().map(part).collect()
}

/// The scene of all that a world has.
fn whole(
    device: &Device,
    options: SceneOptions,
    world: &World,
    parts: &[Option<Arc<Part>>],
) -> Result<Scene, EmbreeError> {
    build(device, options, world, |index, object| {
        Ok(match (&object.shape, &parts[index]) {
            (Shape::Triangles(mesh), _) => TriangleGeometry::new(device, mesh.clone())?.into(),
            (Shape::Displaced(_), Some(part)) => UserGeometry::new(device, part.clone())?.into(),
            (Shape::Displaced(prisms), None) => UserGeometry::new(device, prisms.clone())?.into(),
        })
    })
}

/// A scene of a world's objects, each a geometry.
fn build(
    device: &Device,
    options: SceneOptions,
    world: &World,
    geometry: impl Fn(usize, &Object) -> Result<Geometry, EmbreeError>,
) -> Result<Scene, EmbreeError> {
    let reach = world.ray_reach()?;
    let mut builder = SceneBuilder::new(device, options)?;
    for (index, object) in world.objects().iter().enumerate() {
        match &object.placement {
            Placement::World => {
                builder.attach(geometry(index, object)?.with_mask(object.mask))?;
            }
            // Without any instance it is nowhere.
            Placement::Instances(transforms) if transforms.is_empty() => {}
            Placement::Instances(transforms) => {
                let geometry = geometry(index, object)?.with_mask(object.mask);
                attach_instances(&mut builder, geometry, object.mask, transforms)?;
            }
        }
    }
    builder.narrow(reach);
    builder.commit()
}

/// One scene of one geometry, whose id there is 0, and one top-level id per transform.
fn attach_instances(
    builder: &mut SceneBuilder,
    geometry: Geometry,
    mask: u32,
    transforms: &[Affine3A],
) -> Result<(), EmbreeError> {
    let mut scene = builder.another()?;
    scene.attach(geometry)?;
    let prototype = builder.add_prototype(scene.commit()?)?;
    for &transform in transforms {
        builder.attach_instance(&Instance {
            prototype,
            transform,
            mask,
        })?;
    }
    Ok(())
}

/// The ray up to a hit.
fn until(hit: &Hit, ray: &Ray) -> Ray {
    Ray {
        tfar: hit.t,
        ..*ray
    }
}

impl Follow for EmbreeTracer {
    type Error = EmbreeError;

    fn follow(&mut self, world: &World) -> Result<bool, EmbreeError> {
        assert_eq!(world.objects().len(), self.parts.len(), "another world");
        let growths = world.growths();
        let has_grown = !grown(&self.growths, &growths).is_empty();
        if has_grown {
            self.take_grown(world)?;
            self.growths = growths;
        }
        Ok(has_grown)
    }

    fn maker(&self) -> Maker<Self, EmbreeError> {
        let (device, options) = (self.device.clone(), self.options);
        Box::new(move |world| Self::on(&device, options, world))
    }
}

// The small scene is asked first: through the gaps of the large one a ray would go on to what is far behind.
impl Tracer for EmbreeTracer {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        match self.grown.as_ref().and_then(|grown| grown.intersect1(ray)) {
            Some(hit) => Some(self.scene.intersect1(&until(&hit, ray)).unwrap_or(hit)),
            None => self.scene.intersect1(ray),
        }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.grown
            .as_ref()
            .is_some_and(|grown| grown.occluded1(ray))
            || self.scene.occluded1(ray)
    }

    fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
        let Some(grown) = &self.grown else {
            return self.scene.intersect8(rays, COHERENCE);
        };
        let (first, mut shorter) = (grown.intersect8(rays, COHERENCE), rays.clone());
        for (lane, hit) in first.iter().enumerate() {
            if let Some(hit) = hit {
                shorter.set(lane, &until(hit, &rays.ray(lane)));
            }
        }
        let hits = self.scene.intersect8(&shorter, COHERENCE);
        std::array::from_fn(|lane| hits[lane].or(first[lane]))
    }

    fn occluded8(&self, rays: &RayPacket) -> u8 {
        let grown = self.grown.as_ref();
        let grown = grown.map_or(0, |grown| grown.occluded8(rays, COHERENCE));
        self.scene.occluded8(rays, COHERENCE) | grown
    }

    fn bounds(&self) -> Aabb {
        let grown = self.grown.as_ref().map_or(Aabb::EMPTY, Scene::bounds);
        self.scene.bounds().union(grown)
    }

    fn bvh_bytes(&self) -> usize {
        let parts: usize = self.parts.iter().flatten().map(|part| part.bytes()).sum();
        self.device.memory().current + parts
    }

    fn name(&self) -> String {
        format!("embree {}", self.device.version())
    }
}
