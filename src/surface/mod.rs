//! What is traced: a base mesh, a displacement map, and the displaced surface they define.
//!
//! For base triangle vertices v0 v1 v2, unit vertex normals n0 n1 n2 and barycentric coordinates
//! b = (1-u-v, u, v):
//!
//! ```text
//! P(b) = sum b_i v_i      N'(b) = sum b_i n_i      S(b) = P(b) + D(st(b)) N'(b)/|N'(b)|
//! D(st) = scale * (h(st) - midlevel)
//! ```
//!
//! This room knows no prism, no Embree, no picture and no thread pool.

mod displaced;
mod footprint;
mod map;
mod mesh;
mod normals;
mod patch;
mod projection;
mod uv;

pub use displaced::{DisplacedSurface, Displacement, SurfaceError, SurfacePoint};
pub use map::{DisplacementMap, HeightSample, MapError, Texels};
pub use mesh::{BaseMesh, MeshBuilder, MeshError, MeshReport, NormalMode};
pub(crate) use patch::solve;
pub use patch::{Patch, PatchPoint};
pub use projection::Projection;
pub use uv::{UvTransform, Wrap};
