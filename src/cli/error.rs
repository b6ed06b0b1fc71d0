//! What ends a run, and with which exit code.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::interrupt::EXIT_BASE;
use super::rays::RayError;
use super::tev::Address;
use crate::demo::WriteDemoError;
use crate::files::OutputError;
use crate::prism::MarchError;
use crate::render::film::FrameError;
use crate::scene::lookdev::LookdevError;
use crate::scene::{AssetError, SceneError, UntraceableError};

/// Exit code of wrong usage; clap's own.
pub const USAGE: u8 = 2;
const FAILED: u8 = 1;
const INPUT: u8 = 3;
const OUTPUT: u8 = 4;

/// What ends a run.
#[derive(Debug, Error)]
pub enum CliError {
    /// The command line asks for what cannot be.
    #[error("{0}")]
    Usage(String),
    /// What is given is no file that is read.
    #[error("{0}")]
    Input(String),
    /// A mesh and maps that make no scene.
    #[error(transparent)]
    Lookdev(#[from] LookdevError),
    /// A scene file, or what it names.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file named on the command line.
    #[error(transparent)]
    Asset(Box<AssetError>),
    /// How a surface is to be marched.
    #[error(transparent)]
    March(#[from] MarchError),
    /// A scene that no backend can trace.
    #[error(transparent)]
    Untraceable(#[from] UntraceableError),
    /// A picture to go on with or to merge.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The ray table.
    #[error(transparent)]
    Rays(#[from] RayError),
    /// The backend cannot build or trace this world.
    #[error("{backend}: {reason}")]
    Backend {
        /// Which one.
        backend: &'static str,
        /// What it says.
        reason: String,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// How many.
        threads: usize,
        /// Why.
        source: rayon::ThreadPoolBuildError,
    },
    /// Signals could not be caught.
    #[error("cannot catch signals: {0}")]
    Signals(io::Error),
    /// A signal ended the run before its end; what was done is written.
    #[error("interrupted; {} is partial{}", path.display(), resume_hint(*.resumable))]
    Interrupted {
        /// The signal.
        signal: i32,
        /// The picture.
        path: PathBuf,
        /// Whether the file can be gone on with.
        resumable: bool,
    },
    /// A file could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The ending of the output is that of no known picture format.
    #[error("cannot write {}: found {found}; expected a name that ends in .png or .exr", path.display())]
    PictureFormat {
        /// The path as given.
        path: PathBuf,
        /// Its ending.
        found: String,
    },
    /// Nobody takes the picture while it renders.
    #[error(
        "cannot reach a viewer at {address} (--tev): {source}; expected a tev that listens there"
    )]
    Viewer {
        /// Where it was looked for.
        address: Address,
        /// What the system said.
        source: io::Error,
    },
    /// A demo's files.
    #[error(transparent)]
    Demo(#[from] WriteDemoError),
    /// Standard output could not be written.
    #[error("cannot write standard output: {0}")]
    Stdout(io::Error),
    /// Whoever read our standard output has stopped: a quiet end.
    #[error("the reader of standard output is gone")]
    ReaderGone,
}

fn resume_hint(resumable: bool) -> &'static str {
    if resumable { ", --resume goes on" } else { "" }
}

impl From<AssetError> for CliError {
    fn from(error: AssetError) -> Self {
        Self::Asset(Box::new(error))
    }
}

impl CliError {
    /// What the process ends with.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::PictureFormat { .. } => USAGE,
            Self::Scene(error) if error.is_override() => USAGE,
            Self::Lookdev(error) if error.is_usage() => USAGE,
            Self::Output(error) if error.is_usage() => USAGE,
            Self::Demo(WriteDemoError::Foreign { .. }) => USAGE,
            Self::Input(_)
            | Self::Lookdev(_)
            | Self::Scene(_)
            | Self::Asset(_)
            | Self::March(_)
            | Self::Untraceable(_)
            | Self::Frame(_)
            | Self::Rays(_) => INPUT,
            Self::Backend { .. } | Self::Threads { .. } | Self::Signals(_) => FAILED,
            // Signals are small numbers.
            Self::Interrupted { signal, .. } => (EXIT_BASE + signal) as u8,
            Self::Output(_) | Self::Viewer { .. } | Self::Demo(_) | Self::Stdout(_) => OUTPUT,
            Self::ReaderGone => 0,
        }
    }

    /// An error of writing standard output.
    pub fn stdout(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            Self::ReaderGone
        } else {
            Self::Stdout(error)
        }
    }
}
