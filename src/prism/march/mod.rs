//! Ways to find the surface along a path, and the root that all of them end in.

pub mod bent;
pub mod exact;
pub mod polish;
pub mod uniform;

/// The step of the uniform march.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Texels of the map per step.
    Texels(f32),
    /// World units per step.
    World(f32),
}

/// How the surface is looked for inside a prism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum March {
    /// The first crossing of the ray and the surface, whatever the map: no step, nothing is missed.
    Exact,
    /// The paper's march: equal steps along the ray.
    Uniform {
        /// Step length: greater than 0.
        step: Step,
        /// Shift the samples of each ray by a random part of a step (the paper's thin-feature sampling), keyed by
        /// [`Ray::key`](crate::ray::Ray::key) and the base triangle.
        jitter: bool,
    },
}

impl Default for March {
    /// The exact march.
    fn default() -> Self {
        Self::Exact
    }
}

/// Why a march was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
#[error("the march step is {found}; expected a finite number greater than 0")]
pub struct MarchError {
    /// The step that was given.
    pub found: f32,
}

impl March {
    /// Checks the step.
    pub fn validate(self) -> Result<Self, MarchError> {
        let Self::Uniform {
            step: Step::Texels(found) | Step::World(found),
            ..
        } = self
        else {
            return Ok(self);
        };
        if found.is_finite() && found > 0.0 {
            Ok(self)
        } else {
            Err(MarchError { found })
        }
    }
}
