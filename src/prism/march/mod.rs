//! Ways to find the surface along a path, and the root that all of them end in.

pub mod bent;
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

/// Why a march, or a surface for it, was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum MarchError {
    /// A step that does not go forward.
    #[error("the march step is {found}; expected a finite number greater than 0")]
    BadStep {
        /// The step that was given.
        found: f32,
    },
    /// The uniform march sees no walls.
    #[error(
        "the surface's seams are closed, and the uniform march sees no walls; \
         leave them open (seams = \"open\"), or take the exact march (march = \"exact\")"
    )]
    SeamsNeedExact,
    /// The uniform march knows no level of detail.
    #[error(
        "level of detail is asked for, and the uniform march has none; \
         leave it off (lod = \"off\"), or take the exact march (march = \"exact\")"
    )]
    LodNeedsExact,
    /// The uniform march knows no motion.
    #[error(
        "the mesh moves, and the uniform march knows no motion; take the exact march (march = \"exact\")"
    )]
    MotionNeedsExact,
    /// There is no level of detail of what moves.
    #[error("the mesh moves, and what moves has no level of detail; leave it off (lod = \"off\")")]
    MotionHasNoLod,
    /// More primitives than a backend can number: blocks of 32x32 texels, and base triangles with walls.
    #[error(
        "the surface has more than {max} blocks of 32x32 texels and triangles with walls; \
         repeat the map less often, or take the uniform march (march = \"uniform\")"
    )]
    TooManyPrimitives {
        /// Most that are supported.
        max: usize,
    },
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
            Err(MarchError::BadStep { found })
        }
    }
}
