//! The whole world under Embree.

use std::sync::Arc;

use glam::Affine3A;

use super::{
    BuildQuality, Coherence, Device, DeviceOptions, EmbreeError, Geometry, Instance, Prototype,
    Scene, SceneBuilder, SceneOptions, TriangleGeometry, UserGeometry,
};
use crate::ray::{Aabb, Ray, RayPacket};
use crate::surface::{DisplacementMap, TexelRect};
use crate::trace::{Edited, Hit, Object, Placement, Shape, Tracer, World, grown};

/// How Embree builds a world.
#[derive(Clone, Debug, Default)]
pub struct EmbreeOptions {
    /// Threads that build; 0 for one per core.
    pub threads: usize,
    /// Build time against tracing speed; [`BuildQuality::Low`] whatever is said here if the world is `editable`.
    pub quality: BuildQuality,
    /// For edits that make bounds grow ([`EmbreeTracer::map_edited`]): Embree refits the trees of the objects concerned and leaves
    /// the others alone, instead of building all anew. Every object has a tree of its own then, and plain triangles get a quick
    /// build. Rays on the bench's sphere of 1280 prisms are 10 to 20 % slower, and such an
    /// edit is ready in a third of the time (0.1 ms instead of 0.3).
    pub editable: bool,
    /// Bytes that Embree may hold.
    pub memory_limit: Option<usize>,
}

/// A [`World`] traced by Embree.
pub struct EmbreeTracer {
    scene: Scene,
    /// Where each object is, in the order of the world's.
    places: Vec<Place>,
    /// [`World::growths`] when the scene was committed.
    growths: Vec<u64>,
}

/// An object in the scene.
#[derive(Clone, Copy)]
enum Place {
    Geometry(u32),
    Prototype(Prototype),
    /// Without any instance.
    Nowhere,
}

impl EmbreeTracer {
    /// Builds the world on a device of its own.
    ///
    /// # Errors
    ///
    /// [`EmbreeError::World`] where the world cannot be traced, and what Embree reports.
    pub fn new(world: &World, options: &EmbreeOptions) -> Result<Self, EmbreeError> {
        let reach = world.ray_reach()?;
        let config = match options.threads {
            0 => String::new(),
            n => format!("threads={n}"),
        };
        let device = Device::new(&DeviceOptions {
            config,
            memory_limit: options.memory_limit,
        })?;
        let scene_options = SceneOptions {
            quality: match options.editable {
                true => BuildQuality::Low,
                false => options.quality,
            },
            // Without this Embree drops all trees at every commit.
            dynamic: options.editable,
            robust: true,
            ..SceneOptions::default()
        };
        let mut builder = SceneBuilder::new(&device, scene_options)?;
        // Before any bounds are read.
        let growths = world.growths();
        let mut places = Vec::with_capacity(world.objects().len());
        for object in world.objects() {
            places.push(match &object.placement {
                Placement::World => Place::Geometry(builder.attach(geometry(&device, object)?)?),
                Placement::Instances(transforms) => {
                    attach_instances(&mut builder, &device, scene_options, object, transforms)?
                }
            });
        }
        builder.narrow(reach);
        Ok(Self {
            scene: builder.commit()?,
            places,
            growths,
        })
    }

    /// Brings the tracer up to date after an edit of a map in place ([`DisplacementMap::update`]): `world` is the one it was
    /// built from, and all its objects over `map` follow. Embree is asked for new trees only where bounds have grown, also by
    /// edits that another tracer of the same prisms has been told of.
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
        assert_eq!(world.objects().len(), self.places.len(), "another world");
        let prims_touched = world.map_edited(map, rect);
        let growths = world.growths();
        let grown = grown(&self.growths, &growths);
        if !grown.is_empty() {
            let places = grown.iter().map(|&object| self.places[object]);
            self.scene.change(|scene| {
                for place in places {
                    match place {
                        Place::Geometry(id) => scene.changed(id)?,
                        Place::Prototype(prototype) => {
                            scene.prototype_mut(prototype)?.changed(0)?;
                        }
                        Place::Nowhere => {}
                    }
                }
                Ok(())
            })?;
            self.growths = growths;
        }
        Ok(Edited {
            prims_touched,
            committed: !grown.is_empty(),
        })
    }

    /// The first fault since the last call, such as a panic in a kernel: its rays saw a miss.
    pub fn check(&self) -> Result<(), EmbreeError> {
        self.scene.device().check()
    }

    /// The scene, for what [`Tracer`] does not offer.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

/// Where packets are said to be coherent, Embree keeps them together until two lanes are left, and asks occlusion tests
/// about lanes that miss the box: a prism's test costs more than that saves.
const COHERENCE: Coherence = Coherence::Incoherent;

fn geometry(device: &Device, object: &Object) -> Result<Geometry, EmbreeError> {
    let geometry: Geometry = match &object.shape {
        Shape::Displaced(prisms) => UserGeometry::new(device, prisms.clone())?.into(),
        Shape::Triangles(mesh) => TriangleGeometry::new(device, mesh.clone())?.into(),
    };
    Ok(geometry.with_mask(object.mask))
}

/// One scene of one geometry, whose id there is 0, and one top-level id per transform.
fn attach_instances(
    builder: &mut SceneBuilder,
    device: &Device,
    options: SceneOptions,
    object: &Object,
    transforms: &[Affine3A],
) -> Result<Place, EmbreeError> {
    if transforms.is_empty() {
        return Ok(Place::Nowhere);
    }
    let mut scene = SceneBuilder::new(device, options)?;
    scene.attach(geometry(device, object)?)?;
    let prototype = builder.add_prototype(scene.commit()?)?;
    for &transform in transforms {
        builder.attach_instance(&Instance {
            prototype,
            transform,
            mask: object.mask,
        })?;
    }
    Ok(Place::Prototype(prototype))
}

impl Tracer for EmbreeTracer {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.scene.intersect1(ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.scene.occluded1(ray)
    }

    fn intersect8(&self, rays: &RayPacket) -> [Option<Hit>; RayPacket::LANES] {
        self.scene.intersect8(rays, COHERENCE)
    }

    fn occluded8(&self, rays: &RayPacket) -> u8 {
        self.scene.occluded8(rays, COHERENCE)
    }

    fn bounds(&self) -> Aabb {
        self.scene.bounds()
    }

    fn bvh_bytes(&self) -> usize {
        self.scene.device().memory().current
    }

    fn name(&self) -> String {
        format!("embree {}", self.scene.device().version())
    }
}
