//! What can be attached to a scene, whatever its kind.

use std::any::Any;
use std::ptr::NonNull;
use std::sync::Arc;

use super::filter::{FilterData, HitFilter};
use super::{Device, EmbreeError, sys};

/// A geometry of any kind, not yet attached to a scene. Seen by every ray until its mask is set.
pub struct Geometry {
    raw: NonNull<sys::pm_geometry>,
    /// What Embree reads or calls through the geometry; dropped after `raw` is freed.
    pub(super) keep: Arc<dyn Any + Send + Sync>,
    filter: Option<Arc<FilterData>>,
    pub(super) kind: Kind,
    pub(super) device: Device,
}

/// What may be done with a geometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    User,
    /// Triangles or grids: what has a [`VertexBuffer`](super::vertices::VertexBuffer).
    Mesh,
    Instance {
        prototype: u32,
    },
}

// SAFETY: a geometry is changed only through `&mut self` or by value; what it keeps is Send + Sync.
unsafe impl Send for Geometry {}

impl Drop for Geometry {
    fn drop(&mut self) {
        // SAFETY: made by the shim, freed once. A scene drops its geometries after itself, so that
        // Embree calls nothing of it any more.
        unsafe { sys::pm_geometry_free(self.raw.as_ptr()) }
    }
}

impl Geometry {
    /// Owns what `make` returns.
    ///
    /// # Safety
    /// `make` returns null or a new geometry of `kind` whose pointers lead into `keep`.
    pub(super) unsafe fn from_raw(
        device: &Device,
        kind: Kind,
        keep: Arc<dyn Any + Send + Sync>,
        make: impl FnOnce() -> *mut sys::pm_geometry,
    ) -> Result<Self, EmbreeError> {
        let mut made = std::ptr::null_mut();
        let outcome = device.guarded(|| made = make());
        match (NonNull::new(made), outcome) {
            (None, outcome) => Err(outcome.err().unwrap_or(EmbreeError::Library {
                code: super::ErrorCode::Unknown,
                message: "no geometry was made".to_string(),
            })),
            (Some(raw), outcome) => {
                let geometry = Self {
                    raw,
                    keep,
                    filter: None,
                    kind,
                    device: device.clone(),
                };
                outcome.map(|()| geometry)
            }
        }
    }

    /// A ray sees the geometry when `ray.mask & mask != 0`.
    pub fn with_mask(self, mask: u32) -> Self {
        // SAFETY: a live geometry that no scene has yet.
        unsafe { sys::pm_geometry_set_mask(self.raw.as_ptr(), mask) };
        self
    }

    /// Lets `filter` decide of every candidate hit whether it counts; a rejected one lets the ray go on to
    /// what is behind. Called from many threads, in no order, also for hits that turn out not to be the first.
    /// A ray whose direction is far from length 1 is shown along one near it, with the t of that.
    pub fn with_filter(mut self, filter: HitFilter) -> Self {
        let data = Arc::new(FilterData::new(filter, self.device.faults()));
        // SAFETY: a live geometry that no scene has yet; `data` is dropped after it is freed.
        unsafe { data.install(self.raw.as_ptr()) };
        self.filter = Some(data);
        self
    }

    pub(super) fn raw(&self) -> *mut sys::pm_geometry {
        self.raw.as_ptr()
    }

    /// Tells Embree that the geometry is ready, or has changed.
    pub(super) fn commit(&mut self) -> Result<(), EmbreeError> {
        // SAFETY: a live geometry, exclusively borrowed, of a scene that is not traced now.
        self.device
            .guarded(|| unsafe { sys::pm_geometry_commit(self.raw.as_ptr()) })
    }
}

/// Ids and counts are 32-bit, and the largest means "none".
pub(super) fn count(what: &'static str, found: usize) -> Result<u32, EmbreeError> {
    const MAX: u32 = u32::MAX - 1;
    match u32::try_from(found) {
        Ok(n) if n <= MAX => Ok(n),
        _ => Err(EmbreeError::TooMany {
            what,
            found,
            max: MAX as usize,
        }),
    }
}

/// A number of time steps: at least 1, and no more than Embree knows.
pub(super) fn time_steps(found: usize) -> Result<u32, EmbreeError> {
    const MAX: usize = crate::surface::MovingSurface::MAX_TIME_STEPS;
    match u32::try_from(found) {
        Ok(0) => Err(EmbreeError::NoTimeSteps),
        Ok(n) if found <= MAX => Ok(n),
        _ => Err(EmbreeError::TooMany {
            what: "time steps",
            found,
            max: MAX,
        }),
    }
}
