//! Threads, and the backend that traces: options shared by all verbs.

use clap::ValueEnum;

use super::error::CliError;
use super::heading::MACHINE;
use crate::trace::{Tracer, World};

/// Most threads that may be asked for.
const MAX_THREADS: i64 = 1024;

/// Options of tracing.
#[derive(Clone, Debug, clap::Args)]
pub struct EngineArgs {
    /// What finds the prisms
    #[arg(long, value_enum, default_value_t, help_heading = MACHINE)]
    pub backend: Backend,
    /// Threads, for building and tracing [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MAX_THREADS), help_heading = MACHINE)]
    pub threads: Option<u16>,
}

/// What finds the prisms that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Backend {
    /// Intel Embree
    Embree,
    /// The pure-Rust BVH obvhs, for comparison
    Bvh,
}

impl Default for Backend {
    /// Embree where it is built in.
    fn default() -> Self {
        if cfg!(feature = "embree") {
            Self::Embree
        } else {
            Self::Bvh
        }
    }
}

/// A backend that holds a world.
pub trait Engine: Sync {
    /// What traces.
    fn tracer(&self) -> &dyn Tracer;

    /// Fails if rays got lost since it was asked last.
    fn check(&self) -> Result<(), CliError>;
}

impl EngineArgs {
    /// Starts the threads. Once per process, before anything runs on them.
    pub fn start_threads(&self) -> Result<(), CliError> {
        let Some(threads) = self.threads.map(usize::from) else {
            return Ok(());
        };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|source| CliError::Threads { threads, source })
    }

    /// Fails if the backend is not built in: asked before any work is done.
    pub fn check_backend(&self) -> Result<(), CliError> {
        let missing = |feature, how| {
            let backend = format!("this prismarch was built without {feature}");
            Err(CliError::Usage(format!("{backend}; {how}")))
        };
        match self.backend {
            Backend::Embree if !cfg!(feature = "embree") => missing(
                "Embree",
                "install Debian's libembree-dev and build with `cargo build --release --features embree`, \
                 or use --backend bvh",
            ),
            Backend::Bvh if !cfg!(feature = "bvh") => missing(
                "the pure-Rust BVH",
                "build with `cargo build --release --features bvh`, or use --backend embree",
            ),
            _ => Ok(()),
        }
    }

    /// Builds the backend over a world; not from a thread of the pool, where Embree's own would wait for it.
    pub fn build(&self, world: &World) -> Result<Box<dyn Engine>, CliError> {
        match self.backend {
            #[cfg(feature = "embree")]
            Backend::Embree => {
                let options = crate::embree::EmbreeOptions {
                    threads: self.threads.map_or(0, usize::from),
                    ..Default::default()
                };
                let tracer = crate::embree::EmbreeTracer::new(world, &options);
                tracer
                    .map(|t| Box::new(t) as Box<dyn Engine>)
                    .map_err(|e| failed("Embree", &e))
            }
            #[cfg(feature = "bvh")]
            Backend::Bvh => {
                let tracer = crate::bvh::BvhTracer::new(world);
                tracer
                    .map(|t| Box::new(t) as Box<dyn Engine>)
                    .map_err(|e| failed("obvhs", &e))
            }
            #[cfg(not(all(feature = "embree", feature = "bvh")))]
            _ => {
                let _ = world;
                self.check_backend()
                    .and(Err(CliError::Usage("no backend is built in".into())))
            }
        }
    }
}

#[cfg(any(feature = "embree", feature = "bvh"))]
fn failed(backend: &'static str, error: &dyn std::error::Error) -> CliError {
    CliError::Backend {
        backend,
        reason: error.to_string(),
    }
}

#[cfg(feature = "embree")]
impl Engine for crate::embree::EmbreeTracer {
    fn tracer(&self) -> &dyn Tracer {
        self
    }

    fn check(&self) -> Result<(), CliError> {
        Self::check(self).map_err(|e| failed("Embree", &e))
    }
}

#[cfg(feature = "bvh")]
impl Engine for crate::bvh::BvhTracer {
    fn tracer(&self) -> &dyn Tracer {
        self
    }

    fn check(&self) -> Result<(), CliError> {
        Ok(())
    }
}
