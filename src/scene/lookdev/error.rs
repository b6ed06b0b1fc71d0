//! Why a mesh and its maps do not make a scene.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::textures::displacement_suffixes;
use crate::image::ImageError;
use crate::prism::MarchError;
use crate::scene::{AssetError, SceneError};

/// Why a mesh and its maps do not make a scene.
#[derive(Debug, Error)]
pub enum LookdevError {
    /// A mesh or a map.
    #[error(transparent)]
    Asset(Box<AssetError>),
    /// The displacement map is a picture of colours.
    #[error(
        "{source} with --channel r, g or b. A picture of the surface's colours is given with --color; the displacement map is \
         the picture of its heights"
    )]
    Colors {
        /// What was found.
        source: ImageError,
    },
    /// A mesh without texture coordinates, and a map that would be laid on by them.
    #[error(
        "{}: {part} has no texture coordinates, so that no map can be laid on it; have some made: --texcoords box (or spherical, \
         cylindrical, planar), or unwrap it in a modelling program", path.display()
    )]
    NoTexcoords {
        /// The mesh file.
        path: PathBuf,
        /// Which part of it.
        part: String,
    },
    /// What is laid over the scene, or the scene itself.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// How the surface is to be marched.
    #[error(transparent)]
    March(#[from] MarchError),
    /// The folder of maps cannot be read.
    #[error("cannot read the folder {}: {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// No picture of the folder is a displacement map by its name.
    #[error(
        "no displacement map in {}: found {found}; expected a picture whose name ends in one of {} (a size like _4k may follow), \
         or name the file itself: --displacement FILE",
        folder.display(), displacement_suffixes()
    )]
    NoDisplacementMap {
        /// The folder.
        folder: PathBuf,
        /// Its pictures.
        found: String,
    },
    /// Several pictures of the folder are the same map by their names.
    #[error(
        "several maps for {what} in {}: {found}; name the one that is meant: {option} FILE",
        folder.display()
    )]
    SeveralMaps {
        /// The folder.
        folder: PathBuf,
        /// What of.
        what: &'static str,
        /// The pictures.
        found: String,
        /// By what one is chosen.
        option: &'static str,
    },
    /// A path that a scene file cannot hold.
    #[error("{path:?}: the name is no UTF-8 text, so that no scene file can hold it; rename it")]
    Name {
        /// The path.
        path: PathBuf,
    },
    /// The camera would see nothing but the floor.
    #[error(
        "the camera would be below the floor, which hides what stands on it; expected a view from above (--view, --orbit), or no --floor"
    )]
    BelowFloor,
}

impl LookdevError {
    /// Whether the options do not fit each other, and no file is at fault.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Scene(error) => error.is_override(),
            Self::BelowFloor => true,
            _ => false,
        }
    }
}

impl From<AssetError> for LookdevError {
    fn from(error: AssetError) -> Self {
        Self::Asset(Box::new(error))
    }
}
