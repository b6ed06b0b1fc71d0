//! Embree behind safe types.
//!
//! ```text
//! Device -> SceneBuilder -- attach(UserGeometry | TriangleGeometry | GridGeometry), attach_instance --> commit -> Scene
//! Scene  -- intersect1, occluded1, intersect8, occluded8 from any thread;  Scene -- reopen --> SceneBuilder (edit, commit again)
//! ```
//!
//! Only a committed [`Scene`] can be traced and only an uncommitted [`SceneBuilder`] can be changed; the
//! one becomes the other by value, so nothing is changed under a ray. A scene owns its geometries and the
//! scenes it instances, and each geometry owns what Embree reads through it.
//!
//! All of Embree's versions look the same from here: `ffi/` is where they differ.

#![allow(unsafe_code)] // the C shim; each block says why it is sound

mod device;
mod error;
mod faults;
mod filter;
mod geometry;
mod grids;
mod instance;
#[cfg(feature = "embree4-sys")]
mod interop;
mod part;
mod prisms;
pub mod raw;
mod scene;
mod sys;
#[cfg(test)]
mod tests;
mod tracer;
mod triangles;
mod user;
mod vertices;

pub use device::{Device, DeviceOptions, Memory};
pub use error::{EmbreeError, ErrorCode};
pub use faults::Faults;
pub(crate) use faults::panic_message;
pub use filter::HitFilter;
pub use geometry::Geometry;
pub use grids::{Grid, GridGeometry};
pub use instance::{Instance, Prototype};
pub use scene::{BuildQuality, Coherence, Scene, SceneBuilder, SceneEdit, SceneOptions};
pub use tracer::{EmbreeOptions, EmbreeTracer};
pub use triangles::TriangleGeometry;
pub use user::{HitTest, UserGeometry};

/// The version of the Embree headers this was built with, like `4.3.3`. The library that is loaded may be a
/// later one of the same major number: [`Device::version`].
pub fn version() -> &'static str {
    env!("PRISMARCH_EMBREE")
}
