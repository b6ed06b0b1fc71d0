#![cfg_attr(feature = "embree", doc = include_str!("../README.md"))]
#![cfg_attr(
    not(feature = "embree"),
    doc = "Ray traces displaced surfaces without tessellating them."
)]

#[cfg(feature = "bvh")]
pub mod bvh;
#[cfg(feature = "embree")]
mod capi;
pub mod cli;
pub mod demo;
#[cfg(feature = "embree")]
pub mod embree;
pub mod files;
pub mod image;
pub mod prism;
pub mod ray;
pub mod render;
pub mod scene;
pub mod surface;
pub mod trace;
