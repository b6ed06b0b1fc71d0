//! Ready scenes made by the program itself: base mesh, displacement map, colour map, scene file.
//!
//! Everything is procedural and seeded, so that the repository stays small and every run makes the same bytes.

mod asteroid;
mod cavity;
mod chainmail;
mod dragon;
mod drape;
#[cfg(test)]
mod laws;
mod leather;
mod manifest;
mod noise;
mod orb;
mod paint;
mod scatter;
mod shape;
mod stump;
mod sweep;
mod teaser;
mod write;

use crate::surface::MeshBuilder;
pub(crate) use manifest::digest;
pub use write::{WriteDemoError, WriteOptions};

/// What a demo is made of, in memory.
pub struct DemoFiles {
    /// The base mesh, with normals and texture coordinates.
    pub mesh: MeshBuilder,
    /// Heights, bottom row first, `map_size` x `map_size`, 16 bits.
    pub heights: Vec<u16>,
    /// Texels across and up.
    pub map_size: usize,
    /// 8-bit sRGB colour map, bottom row first, `color_size` x `color_size`; empty for none.
    pub colors: Vec<[u8; 3]>,
    /// Texels across and up of the colour map.
    pub color_size: usize,
    /// What else is displaced in the scene.
    pub parts: Vec<Part>,
    /// The scene file (docs/scene.md). It names `NAME.obj`, `NAME_height.png` and `NAME_color.png`.
    pub scene: String,
}

/// A further displaced mesh, written as `PART.obj` and `PART_height.png`.
pub struct Part {
    /// What its files are called.
    pub name: &'static str,
    /// The base mesh, with normals and texture coordinates.
    pub mesh: MeshBuilder,
    /// Heights, bottom row first, `map_size` x `map_size`, 16 bits.
    pub heights: Vec<u16>,
    /// Texels across and up.
    pub map_size: usize,
}

/// One demo.
pub struct Demo {
    /// As on the command line.
    pub name: &'static str,
    /// One line for `--list`.
    pub title: &'static str,
    /// Base triangles of all that is displaced, as in the paper's table.
    pub triangles: usize,
    /// Texels across and up of the displacement map at full size (of the largest).
    pub map_size: usize,
    /// Makes it with a map of the given size (smaller ones are for tests).
    pub make: fn(map_size: usize) -> DemoFiles,
}

/// The demos, in the order of `--list`.
pub const DEMOS: &[Demo] = &[
    asteroid::DEMO,
    chainmail::DEMO,
    leather::DEMO,
    orb::DEMO,
    stump::DEMO,
    dragon::DEMO,
    teaser::GLASS,
    teaser::WET,
];

/// The demo of that name.
pub fn find(name: &str) -> Option<&'static Demo> {
    DEMOS.iter().find(|d| d.name == name)
}
