//! Memory by part, divided as in the paper's table: what any method needs, and what this one adds.

use serde::Serialize;

use crate::scene::{Light, Loaded, Material, ObjectShape};
use crate::trace::{Shape, Tracer, World};

/// Bytes by part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Memory {
    /// What every method that displaces needs.
    pub common: Common,
    /// What this method adds.
    pub overhead: Overhead,
    /// Common parts and overhead.
    pub total: usize,
    /// Overhead in percent of the total.
    pub overhead_percent: f64,
    /// Colour textures and environments, which are not counted above.
    pub pictures: usize,
}

/// Bytes that every method needs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Common {
    /// Texels of displacement maps.
    pub maps: usize,
    /// Base meshes.
    pub meshes: usize,
    /// The backend's acceleration structure.
    pub bvh: usize,
}

/// Bytes that this method adds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Overhead {
    /// Prisms, 108 bytes per base triangle, 32 per block of up to 32x32 texels, and 28 per wall of closed seams.
    pub prisms: usize,
    /// Min/max pyramids of displacement maps.
    pub pyramids: usize,
    /// Means of displacement maps, for level of detail.
    pub means: usize,
}

impl Memory {
    /// Adds up a built scene; what is shared counts once.
    pub fn of(loaded: &Loaded, world: &World, tracer: &dyn Tracer) -> Self {
        let common = Common {
            maps: map_bytes(loaded) - pyramid_bytes(loaded) - mean_bytes(loaded),
            meshes: mesh_bytes(loaded),
            bvh: tracer.bvh_bytes(),
        };
        let prisms = world.objects().iter().map(|object| match &object.shape {
            Shape::Displaced(prisms) => prisms.bytes(),
            Shape::Triangles(_) => 0,
        });
        let overhead = Overhead {
            prisms: prisms.sum(),
            pyramids: pyramid_bytes(loaded),
            means: mean_bytes(loaded),
        };
        let added = overhead.prisms + overhead.pyramids + overhead.means;
        let total = common.maps + common.meshes + common.bvh + added;
        Self {
            // Not 0: a scene has a mesh.
            overhead_percent: 100.0 * added as f64 / total as f64,
            common,
            overhead,
            total,
            pictures: picture_bytes(loaded),
        }
    }
}

/// The most bytes that this process has had in memory so far; `None` where the system is not Linux, which does not tell.
pub fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}

fn map_bytes(loaded: &Loaded) -> usize {
    loaded.maps.iter().map(|m| m.map.bytes()).sum()
}

fn pyramid_bytes(loaded: &Loaded) -> usize {
    loaded.maps.iter().map(|m| m.map.pyramid().bytes()).sum()
}

fn mean_bytes(loaded: &Loaded) -> usize {
    loaded.maps.iter().map(|m| m.map.mean_bytes()).sum()
}

fn mesh_bytes(loaded: &Loaded) -> usize {
    let meshes = loaded
        .scene
        .objects
        .iter()
        .map(|object| match &object.shape {
            ObjectShape::Displaced(surface, _) => surface.mesh(),
            ObjectShape::Plain(mesh) => mesh,
        });
    meshes.map(|mesh| mesh.bytes()).sum()
}

fn picture_bytes(loaded: &Loaded) -> usize {
    let textures = loaded.scene.materials.iter().flat_map(Material::pictures);
    let environments = loaded.scene.lights.iter().filter_map(|light| match light {
        Light::Environment { image, .. } => {
            let bytes = size_of_val(&image.pixels[..]);
            Some((image.as_ref() as *const _ as usize, bytes))
        }
        _ => None,
    });
    let mut by_address: Vec<(usize, usize)> = textures.chain(environments).collect();
    by_address.sort_unstable();
    by_address.dedup();
    by_address.iter().map(|(_, bytes)| bytes).sum()
}
