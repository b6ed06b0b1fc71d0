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

mod block;
mod closest;
mod displaced;
mod edit;
mod footprint;
mod frames;
mod grid;
mod interpolate;
mod join;
mod map;
mod means;
mod mesh;
mod motion;
mod normals;
mod patch;
mod projection;
mod pyramid;
mod seams;
pub(crate) mod smooth_normal;
mod subdivide;
mod texels;
mod uv;

pub(crate) use block::TexelBox;
pub use closest::{ClosestPoint, PointQuery};
pub use displaced::{DisplacedSurface, Displacement, SurfaceError, SurfacePoint};
pub use edit::{TexelRect, Update};
pub(crate) use grid::HeightGrid;
pub use grid::HeightSample;
pub use interpolate::{InterpolateError, Interpolated};
pub use join::Joined;
pub use map::{DisplacementMap, MapError};
pub(crate) use mesh::NormalTransform;
#[cfg(feature = "embree")] // for the C library
pub(crate) use mesh::has_area;
pub use mesh::{BaseMesh, MeshBuilder, MeshError, MeshReport, NormalMode};
pub(crate) use motion::Corners;
pub use motion::{MotionError, MovingSurface, TimeStep};
pub(crate) use patch::solve;
pub use patch::{Patch, PatchPoint};
pub use projection::Projection;
pub(crate) use pyramid::Entries;
pub use pyramid::{Level, Pyramid};
pub(crate) use seams::{ChartEdges, Ruled};
pub use seams::{Seams, Wall};
pub use smooth_normal::ShadingNormals;
pub use subdivide::{Cage, Refined, Scheme, SubdivideError};
pub(crate) use texels::{StoredTexels, Texel};
pub use texels::{TexelKind, Texels};
pub use uv::{UvTransform, Wrap};
