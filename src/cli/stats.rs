//! What a run took, as JSON and in one line.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::memory::Memory;
use crate::files::output::{self, OutputError};
use crate::render::RayCounts;

/// What `--stats` writes.
#[derive(Serialize)]
pub struct Stats {
    pub version: &'static str,
    pub scene: String,
    pub picture: String,
    pub backend: String,
    pub simd: &'static str,
    pub threads: usize,
    pub width: u32,
    pub height: u32,
    pub spp: u32,
    /// Samples in the picture, over all pixels.
    pub samples: u64,
    pub seed: u32,
    /// Whether a signal ended the run.
    pub partial: bool,
    pub seconds: Seconds,
    pub rays: Rays,
    /// All rays over the time of rendering.
    pub mrays_per_second: f64,
    pub dropped_samples: u64,
    pub memory: Memory,
    /// The most bytes that the whole process had in memory; only Linux tells.
    pub peak_memory: Option<u64>,
}

/// Wall-clock time by phase.
#[derive(Serialize)]
pub struct Seconds {
    pub load: f64,
    pub build: f64,
    pub render: f64,
    pub write: f64,
    pub total: f64,
}

/// Rays traced, by type.
#[derive(Serialize)]
pub struct Rays {
    camera: u64,
    shadow: u64,
    diffuse: u64,
    reflection: u64,
    refraction: u64,
    total: u64,
}

impl From<&RayCounts> for Rays {
    fn from(rays: &RayCounts) -> Self {
        Self {
            camera: rays.camera,
            shadow: rays.shadow,
            diffuse: rays.diffuse,
            reflection: rays.reflection,
            refraction: rays.refraction,
            total: rays.total(),
        }
    }
}

impl Stats {
    /// Writes all of it as JSON.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        output::write(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })
    }

    /// The line for standard output.
    pub fn summary(&self) -> String {
        let Self {
            picture,
            width,
            height,
            spp,
            mrays_per_second,
            ..
        } = self;
        let seconds = self.seconds.total;
        format!(
            "{picture}: {width}x{height}, {spp} spp, {seconds:.2} s, {mrays_per_second:.2} Mrays/s"
        )
    }
}

/// Measures phases one after the other.
pub struct Clock {
    start: Instant,
    lap: Instant,
}

impl Clock {
    /// Starts it.
    pub fn start() -> Self {
        let now = Instant::now();
        Self {
            start: now,
            lap: now,
        }
    }

    /// Seconds since the last lap.
    pub fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = (now - self.lap).as_secs_f64();
        self.lap = now;
        seconds
    }

    /// Seconds since the start.
    pub fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
