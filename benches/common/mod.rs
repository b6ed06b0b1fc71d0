//! What the benches and the comparison of backends share: one scene, its rays, a timing loop.

#![allow(dead_code)] // every program uses a part

pub mod boulder;
pub mod closed;
pub mod march;
pub mod numbers;
pub mod rays;
pub mod scene;
pub mod timing;
