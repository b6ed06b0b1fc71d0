//! How surfaces are looked for: options shared by the verbs that trace.

use clap::ValueEnum;

use super::error::CliError;
use super::heading::TRACING;
use super::parse;
use crate::prism::{Lod, March, Step};
use crate::scene::{ObjectShape, Scene};

/// What is taken instead of the scene's marches.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct MarchArgs {
    /// How the surface is looked for inside a prism [default: the scene's, or exact; uniform with a step]
    #[arg(long, value_enum, help_heading = TRACING)]
    march: Option<MarchKind>,
    /// Step of the uniform march in texels of the map [default: the scene's, or 1]
    #[arg(long, value_name = "TEXELS", value_parser = parse::texels, help_heading = TRACING)]
    dt: Option<f32>,
    /// Step of the uniform march in world units
    #[arg(long, value_name = "LENGTH", value_parser = parse::length, conflicts_with = "dt", help_heading = TRACING)]
    dt_world: Option<f32>,
    /// Level of detail: "cone" lets a hit be off by half a pixel and shades with the mean over one [default: the scene's, or off]
    #[arg(long, value_enum, help_heading = TRACING)]
    lod: Option<LodKind>,
    /// Angle of one pixel for --lod cone, radians: the growth of a ray's cone per unit of length [default: the camera's]
    #[arg(long, value_name = "RADIANS", value_parser = parse::spread, help_heading = TRACING)]
    spread: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MarchKind {
    /// The first crossing, whatever the map: no step
    Exact,
    /// Equal steps along the ray, as in the paper
    Uniform,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LodKind {
    /// Every hit is exact
    Off,
    /// Half a pixel is as good
    Cone,
}

impl From<LodKind> for Lod {
    fn from(kind: LodKind) -> Self {
        match kind {
            LodKind::Off => Self::Off,
            LodKind::Cone => Self::Cone,
        }
    }
}

impl MarchArgs {
    /// The angle of a pixel if one is given here, else the scene's camera's.
    pub fn spread(&self, scene: &Scene) -> f32 {
        let camera = scene
            .camera
            .pixel_spread(scene.film.width, scene.film.height);
        self.spread.unwrap_or(camera)
    }

    /// What is said here wins over the scene; `jitter` asks for jittered steps, and so for steps.
    pub fn apply(&self, scene: &mut Scene, jitter: bool) -> Result<(), CliError> {
        if let Some(lod) = self.lod {
            for object in &mut scene.objects {
                if let ObjectShape::Displaced(_, options) = &mut object.shape {
                    options.lod = lod.into();
                }
            }
        }
        let step_here = match (self.dt, self.dt_world) {
            (Some(texels), _) => Some(Step::Texels(texels)),
            (None, Some(length)) => Some(Step::World(length)),
            (None, None) => None,
        };
        let kind = match (self.march, step_here.is_some() || jitter) {
            (Some(MarchKind::Exact), true) => {
                return Err(CliError::Usage(
                    "a step and its jitter (--dt, --dt-world, --jitter) belong to the uniform march; the exact one has no step"
                        .into(),
                ));
            }
            (None, false) => return Ok(()),
            (None, true) => MarchKind::Uniform,
            (Some(kind), _) => kind,
        };
        for object in &mut scene.objects {
            let ObjectShape::Displaced(_, options) = &mut object.shape else {
                continue;
            };
            let (step, scene_jitter) = match options.march {
                March::Uniform { step, jitter } => (step, jitter),
                March::Exact => (Step::Texels(1.0), false),
            };
            options.march = match kind {
                MarchKind::Exact => March::Exact,
                MarchKind::Uniform => March::Uniform {
                    step: step_here.unwrap_or(step),
                    jitter: scene_jitter || jitter,
                },
            };
        }
        Ok(())
    }
}
