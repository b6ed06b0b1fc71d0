//! prismarch ray traces displaced surfaces without tessellating them.

pub mod prism;
pub mod ray;
pub mod surface;
pub mod trace;
