//! `March::default()` finds the first intersection with S, for every ray: each case against an f64 oracle that shares
//! nothing with the kernels but S's definition.
//!
//! One line per case and engine: `cargo test --release --test exact -- --nocapture`. What the columns mean and what is
//! allowed is in `exact/judge.rs`.

#[path = "../benches/common/mod.rs"]
mod common;
#[path = "exact/judge.rs"]
mod judge;
#[path = "exact/maps.rs"]
mod maps;
#[path = "exact/meshes.rs"]
mod meshes;
mod oracle;
#[path = "oracle/tests.rs"]
mod oracle_tests;
#[path = "exact/rays.rs"]
mod rays;

#[path = "exact/hostile.rs"]
mod hostile;
#[path = "exact/regular.rs"]
mod regular;
