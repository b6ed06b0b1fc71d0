//! What is asked of the surface beside rays, each against an f64 oracle of its own: interpolation,
//! nearest points, and
//! surfaces that move.

#[path = "../benches/common/mod.rs"]
mod common;
#[path = "exact/maps.rs"]
#[allow(dead_code)] // of another program
mod maps;
#[path = "exact/meshes.rs"]
#[allow(dead_code)] // of another program
mod meshes;

#[path = "queries/closest.rs"]
mod closest;
#[path = "queries/definition.rs"]
mod definition;
#[path = "queries/interpolate.rs"]
mod interpolate;
#[path = "queries/motion.rs"]
mod motion;
#[path = "queries/surfaces.rs"]
mod surfaces;
