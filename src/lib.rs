//! prismarch ray traces displaced surfaces without tessellating them.

pub mod demo;
pub mod image;
pub mod prism;
pub mod ray;
pub mod render;
pub mod scene;
pub mod surface;
pub mod trace;
