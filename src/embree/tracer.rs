//! The whole world under Embree.

use glam::Affine3A;

use super::{
    BuildQuality, Coherence, Device, DeviceOptions, EmbreeError, Geometry, Instance, Scene,
    SceneBuilder, SceneOptions, TriangleGeometry, UserGeometry,
};
use crate::ray::{Aabb, Ray, RayPacket};
use crate::trace::{Hit, Object, Placement, Shape, Tracer, World};

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
}

impl EmbreeTracer {
    /// Builds the world on a device of its own.
    pub fn new(world: &World, options: &EmbreeOptions) -> Result<Self, EmbreeError> {
        let config = match options.threads {
            0 => String::new(),
            n => format!("threads={n}"),
        };
        let device = Device::new(&DeviceOptions {
            config,
            memory_limit: options.memory_limit,
        })?;
        let scene_options = SceneOptions {
            quality: options.quality,
            robust: true,
            ..SceneOptions::default()
        };
        let mut builder = SceneBuilder::new(&device, scene_options)?;
        for object in world.objects() {
            match &object.placement {
                Placement::World => {
                    builder.attach(geometry(&device, object)?)?;
                }
                Placement::Instances(transforms) => {
                    attach_instances(&mut builder, &device, scene_options, object, transforms)?;
                }
            }
        }
        Ok(Self {
            scene: builder.commit()?,
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
) -> Result<(), EmbreeError> {
    if transforms.is_empty() {
        return Ok(());
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
    Ok(())
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
