//! Instances: a scene that stands in another one, under a transform.

use std::sync::Arc;

use glam::Affine3A;

use super::geometry::Kind;
use super::{Device, EmbreeError, Geometry, Scene, sys};

/// A scene that a [`SceneBuilder`](super::SceneBuilder) owns in order to instance it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prototype(pub(super) u32);

/// Where one instance of a prototype stands.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// What is instanced.
    pub prototype: Prototype,
    /// Object to world; one that [`RayReach::through`](crate::trace::RayReach::through) takes.
    pub transform: Affine3A,
    /// A ray sees the instance when `ray.mask & mask != 0`, and then asks the masks inside it.
    pub mask: u32,
}

impl Instance {
    /// # Safety
    /// `scene` outlives the geometry, and its rays are within reach through the transform.
    pub(super) unsafe fn geometry(
        &self,
        device: &Device,
        scene: &Scene,
    ) -> Result<Geometry, EmbreeError> {
        let columns = self.transform.to_cols_array();
        let kind = Kind::Instance {
            prototype: self.prototype.0,
        };
        // SAFETY: the shim copies the transform; the scene outlives the geometry by this function's contract.
        let geometry = unsafe {
            Geometry::from_raw(device, kind, Arc::new(()), || {
                sys::pm_geometry_new_instance(device.raw(), scene.raw(), columns.as_ptr())
            })
        };
        Ok(geometry?.with_mask(self.mask))
    }
}
