//! What can be wrong with a scene, and where: every message names file, line, column and key.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A spot in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The scene file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// The line itself, cut to one screen's width.
    pub text: String,
    /// Characters of `text` before the spot.
    caret: usize,
}

/// Longest part of a line that a message shows, characters.
const SHOWN: usize = 100;

impl Place {
    /// The spot where byte range `span` of `source` starts.
    pub(super) fn new(file: &Path, source: &str, span: Range<usize>) -> Self {
        // A span may end past the text (unexpected end of file) or, by error, inside a character.
        let mut start = span.start.min(source.len());
        while !source.is_char_boundary(start) {
            start -= 1;
        }
        let before = &source[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let column = source[line_start..start].chars().count();
        let full = source[line_start..].lines().next().unwrap_or("");
        let skip = column.saturating_sub(SHOWN / 2);
        let text = full.chars().skip(skip).take(SHOWN);
        Self {
            file: file.to_owned(),
            line: before.matches('\n').count() + 1,
            column: column + 1,
            text: text.map(|c| if c.is_control() { ' ' } else { c }).collect(),
            caret: column - skip,
        }
    }

    /// The line with a caret under the spot, to follow a message.
    fn snippet(&self) -> String {
        let number = self.line.to_string();
        let gutter = " ".repeat(number.len());
        let indent = " ".repeat(self.caret);
        let text = &self.text;
        format!("\n {gutter} |\n {number} | {text}\n {gutter} | {indent}^")
    }
}

/// `file:line:column`, as editors and terminals know it.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            file, line, column, ..
        } = self;
        write!(f, "{}:{line}:{column}", file.display())
    }
}

/// Why a scene was refused.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The scene file itself cannot be read.
    #[error("cannot read scene {}: {source}", path.display())]
    Read {
        /// The scene file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not TOML.
    #[error("{place}: {message}{}", place.snippet())]
    Syntax {
        /// Where.
        place: Box<Place>,
        /// What the TOML parser says.
        message: String,
    },
    /// A key that does not belong there, lacks, or has a value that does not fit.
    #[error("{place}: {key}: found {found}; expected {expected}{}", place.snippet())]
    Value {
        /// Where.
        place: Box<Place>,
        /// Full name of the key, like `mesh[0].displacement.scale`.
        key: String,
        /// What the file has.
        found: String,
        /// What fits.
        expected: String,
    },
    /// A file that the scene names, or what is made of it, was refused.
    #[error("{place}: {key}: {source}{}", place.snippet())]
    Asset {
        /// Where the scene names it.
        place: Box<Place>,
        /// Full name of the key.
        key: String,
        /// Why.
        source: Box<AssetError>,
    },
}

impl SceneError {
    /// Whether the scene's file is sound and what was laid over it is not.
    pub fn is_override(&self) -> bool {
        match self {
            Self::Read { .. } => false,
            Self::Syntax { place, .. } | Self::Value { place, .. } | Self::Asset { place, .. } => {
                place.file == Path::new(super::file::OPTION)
            }
        }
    }
}

/// Why a file that a scene or the command line names was refused.
#[derive(Debug, Error)]
pub enum AssetError {
    /// A mesh file.
    #[error(transparent)]
    Mesh(#[from] super::load::LoadMeshError),
    /// A picture.
    #[error(transparent)]
    Image(#[from] crate::image::ImageError),
    /// A picture inside a mesh file.
    #[error("inside {}: {source}", path.display())]
    Embedded {
        /// The mesh file.
        path: PathBuf,
        /// Why.
        source: crate::image::ImageError,
    },
    /// A picture that a statement of a mesh file, or of its material library, names.
    #[error("{from}: {source}")]
    Named {
        /// The statement.
        from: String,
        /// Why.
        source: Box<AssetError>,
    },
    /// The triangles of a mesh file.
    #[error("{}: {part}: {source}", path.display())]
    Geometry {
        /// The mesh file.
        path: PathBuf,
        /// Which part of it.
        part: String,
        /// Why.
        source: crate::surface::MeshError,
    },
    /// The polygons of a mesh file cannot be subdivided.
    #[error("{}: {source}", path.display())]
    Subdivision {
        /// The mesh file.
        path: PathBuf,
        /// Why.
        source: crate::surface::SubdivideError,
    },
    /// A map's heights displace the mesh by too much.
    #[error("{}: {source} (on {part})", path.display())]
    Heights {
        /// The map.
        path: PathBuf,
        /// Which part of the mesh file.
        part: String,
        /// Why.
        source: crate::surface::SurfaceError,
    },
    /// Mesh and map do not make a displaced surface.
    #[error("{part}: {source}")]
    Surface {
        /// Which part of the mesh file.
        part: String,
        /// Why.
        source: crate::surface::SurfaceError,
    },
}

/// Why a scene that is loaded cannot be traced.
#[derive(Debug, Error)]
pub enum UntraceableError {
    /// How a surface is to be marched.
    #[error(transparent)]
    March(#[from] crate::prism::MarchError),
    /// An object is too large, too far out, or under a transform that is too extreme.
    #[error("{}: {object}: {source}", path.display())]
    Object {
        /// The scene file, or the mesh file.
        path: PathBuf,
        /// Its name.
        object: String,
        /// Why.
        source: crate::trace::WorldError,
    },
    /// No ray can come from where the camera is.
    #[error(
        "{}: the camera is at {:?}; with this scene's sizes and instances expected coordinates within +-{reach:e}",
        path.display(), position.to_array()
    )]
    Camera {
        /// The scene file.
        path: PathBuf,
        /// Eye point.
        position: glam::Vec3,
        /// The largest coordinate, of either sign.
        reach: f32,
    },
}

impl AssetError {
    /// The same, with the statement that names the file.
    pub(super) fn named_by(self, from: &str) -> Self {
        Self::Named {
            from: from.to_owned(),
            source: Box::new(self),
        }
    }
}
