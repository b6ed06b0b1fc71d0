//! Cameras of mesh files, in the space of the file.

use glam::{Affine3A, Vec3};

use super::placing::{self, Broken};

/// Width over height of a picture: beyond these there is no picture.
pub(super) const ASPECTS: std::ops::RangeInclusive<f32> = 1e-4..=1e4;

/// A camera of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileCamera {
    /// That of its node, then its own; either may be empty.
    pub names: [String; 2],
    /// Eye point.
    pub position: Vec3,
    /// Unit vector of the view.
    pub forward: Vec3,
    /// Unit vector, not parallel to the view.
    pub up: Vec3,
    /// What it shows.
    pub projection: FileProjection,
}

/// What a camera of a mesh file shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FileProjection {
    /// Straight lines stay straight.
    Perspective {
        /// Vertical field of view, radians.
        fov: f32,
        /// Width over height, if the file says.
        aspect: Option<f32>,
    },
    /// Parallel rays.
    Orthographic {
        /// Units of the file from the left to the right, above 0.
        width: f32,
        /// From the bottom to the top, above 0.
        height: f32,
    },
}

impl FileCamera {
    /// What messages call it: by its first name that is not empty.
    pub fn name(&self) -> &str {
        let mut names = self.names.iter().map(String::as_str);
        names.find(|name| !name.is_empty()).unwrap_or("")
    }

    /// The camera moved by `transform`.
    ///
    /// # Errors
    ///
    /// A place or a size beyond what is traced, and a view that `transform` leaves no direction or no up.
    pub fn placed(&self, transform: &Affine3A) -> Result<Self, Broken> {
        let forward = placing::direction(transform, self.forward)?;
        let up = placing::direction(transform, self.up)?;
        if forward.cross(up).length() < 1e-4 {
            return Err(Broken(format!("its up {up} is along its view")));
        }
        let right = self.forward.cross(self.up).normalize();
        let sized = |axis: Vec3, size: f32| {
            let size = size * transform.transform_vector3(axis).length();
            let fits = size > 0.0 && size <= crate::ray::MAX_COORDINATE;
            fits.then_some(size)
                .ok_or_else(|| Broken(format!("its picture is {size} units large")))
        };
        Ok(Self {
            names: self.names.clone(),
            position: placing::point(transform, self.position)?,
            forward,
            up,
            projection: match self.projection {
                FileProjection::Orthographic { width, height } => {
                    let (width, height) = (sized(right, width)?, sized(self.up, height)?);
                    if !ASPECTS.contains(&(width / height)) {
                        return Err(Broken(format!("its picture is {width} x {height}")));
                    }
                    FileProjection::Orthographic { width, height }
                }
                perspective @ FileProjection::Perspective { .. } => perspective,
            },
        })
    }
}
