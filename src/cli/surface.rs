//! How maps lie on meshes: values of options that several verbs have.

use clap::ValueEnum;

use crate::surface::{Projection, Wrap};

/// Where texture coordinates come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TexcoordKind {
    /// The mesh file
    File,
    /// Six sides around the mesh, each face takes the nearest
    Box,
    /// Longitude and latitude around the middle of the mesh
    Spherical,
    /// Longitude around the vertical axis, and height
    Cylindrical,
    /// Along the mesh's shortest side
    Planar,
}

impl TexcoordKind {
    /// None for the file's own.
    pub fn projection(self) -> Option<Projection> {
        match self {
            Self::File => None,
            Self::Box => Some(Projection::Box),
            Self::Spherical => Some(Projection::Spherical),
            Self::Cylindrical => Some(Projection::Cylindrical),
            Self::Planar => Some(Projection::Planar),
        }
    }
}

/// A map outside of [0, 1].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WrapKind {
    /// It repeats
    Repeat,
    /// Its border goes on
    Clamp,
    /// It repeats, every second one mirrored
    Mirror,
}

impl From<WrapKind> for Wrap {
    fn from(kind: WrapKind) -> Self {
        match kind {
            WrapKind::Repeat => Self::Repeat,
            WrapKind::Clamp => Self::Clamp,
            WrapKind::Mirror => Self::Mirror,
        }
    }
}
