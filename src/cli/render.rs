//! `prismarch render`: a scene file becomes a picture.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::builder::PossibleValuesParser;
use serde::Serialize;

use super::engine::{Engine, EngineArgs};
use super::error::CliError;
use super::march::MarchArgs;
use super::memory::Memory;
use super::parse::{self, Size};
use super::picture::Target;
use super::progress::Progress;
use crate::image::{OutputError, atomic};
use crate::render::{Picture, RenderInput, RenderStats};
use crate::scene::{Film, Integrator, Loaded, MAX_SPP};
use crate::trace::World;

/// Render a scene file to a picture
///
/// The format of scene files is described in docs/scene.md. The picture is a PNG (filmic tone curve, 8-bit sRGB) or an
/// EXR (linear radiance, 32-bit float), by the ending of its name. It is the same to the bit for any number of threads.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch render scene.toml
  prismarch render scene.toml -o rock.exr --size 1920x1080 --spp 256
  prismarch render scene.toml --march uniform --dt 0.5
  prismarch render scene.toml --backend bvh --threads 4 --stats stats.json --quiet")]
pub struct Args {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Picture, .png or .exr [default: the scene's name with .png, in the current folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    film: FilmArgs,
    /// What is computed, instead of the scene's integrator
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Integrator::names()))]
    integrator: Option<String>,
    #[command(flatten)]
    march: MarchArgs,
    /// Write times, ray counts and memory as JSON
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    #[command(flatten)]
    engine: EngineArgs,
    /// Print errors and warnings only
    #[arg(short, long)]
    quiet: bool,
}

/// What is taken instead of the scene's film settings.
#[derive(Clone, Debug, clap::Args)]
pub struct FilmArgs {
    /// Width and height in pixels, instead of the scene's
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    pub size: Option<Size>,
    /// Samples per pixel, instead of the scene's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SPP)))]
    pub spp: Option<u32>,
    /// Seed of all randomness, instead of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
}

/// Everything that a run of the renderer needs.
pub struct Job<'a> {
    /// Scene file.
    pub scene: &'a Path,
    /// Where the picture goes.
    pub target: Target,
    /// Film settings that win over the scene's.
    pub film: &'a FilmArgs,
    /// The name of an integrator that wins over the scene's.
    pub integrator: Option<&'a str>,
    /// Marches that win over the scene's.
    pub march: &'a MarchArgs,
    /// Where the statistics go.
    pub stats: Option<&'a Path>,
    /// Backend and threads; the threads are started.
    pub engine: &'a EngineArgs,
    /// Say nothing but warnings.
    pub quiet: bool,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    args.engine.check_backend()?;
    let output = args.output.clone().unwrap_or_else(|| {
        let mut name = args.scene.file_stem().unwrap_or_default().to_owned();
        name.push(".png");
        name.into()
    });
    let target = Target::new(&output)?;
    if let Some(stats) = &args.stats {
        atomic::check(stats)?;
    }
    args.engine.start_threads()?;
    Job {
        scene: &args.scene,
        target,
        film: &args.film,
        integrator: args.integrator.as_deref(),
        march: &args.march,
        stats: args.stats.as_deref(),
        engine: &args.engine,
        quiet: args.quiet,
    }
    .run()
}

impl Job<'_> {
    /// Loads, builds, renders, writes, and says so in one line.
    pub fn run(&self) -> Result<(), CliError> {
        let mut clock = Clock::start();
        let mut loaded = Loaded::from_file(self.scene)?;
        super::warn(&loaded.warnings);
        self.film.apply(&mut loaded.scene.film);
        if let Some(integrator) = self.integrator.and_then(Integrator::named) {
            loaded.scene.integrator = integrator;
        }
        self.march.apply(&mut loaded.scene, false)?;
        let load = clock.lap();
        let world = loaded.scene.world()?;
        let engine = self.engine.build(&world)?;
        let build = clock.lap();
        let picture = self.render(&loaded, &world, &*engine)?;
        engine.check()?;
        let render = clock.lap();
        self.target.write(&picture, &loaded.scene.film)?;
        let write = clock.lap();
        let stats = Stats {
            version: env!("CARGO_PKG_VERSION"),
            scene: self.scene.display().to_string(),
            picture: self.target.path().display().to_string(),
            backend: engine.tracer().name(),
            simd: crate::prism::SimdLevel::detect().name(),
            threads: rayon::current_num_threads(),
            width: picture.width,
            height: picture.height,
            spp: loaded.scene.film.spp,
            seed: loaded.scene.film.seed,
            seconds: Seconds {
                load,
                build,
                render,
                write,
                total: clock.total(),
            },
            rays: Rays::from(&picture.stats),
            mrays_per_second: picture.stats.rays.total() as f64 / render.max(1e-9) / 1e6,
            dropped_samples: picture.stats.dropped_samples,
            memory: Memory::of(&loaded, &world, engine.tracer()),
        };
        if let Some(path) = self.stats {
            stats.write(path)?;
        }
        if !self.quiet {
            stats.summarise()?;
        }
        Ok(())
    }

    fn render(
        &self,
        loaded: &Loaded,
        world: &World,
        engine: &dyn Engine,
    ) -> Result<Picture, CliError> {
        let scene = &loaded.scene;
        let object_materials: Vec<usize> = scene.objects.iter().map(|o| o.material).collect();
        let input = RenderInput {
            tracer: engine.tracer(),
            surfaces: world,
            camera: &scene.camera,
            film: &scene.film,
            materials: &scene.materials,
            object_materials: &object_materials,
            lights: &scene.lights,
            integrator: &scene.integrator,
        };
        if !scene.camera.allow_inside
            && let Some(object) = crate::render::enclosing_object(&input)
            && let Some(error) = loaded.camera_inside(object)
        {
            return Err(error.into());
        }
        let progress = Progress::new(self.quiet);
        let picture = crate::render::render(&input, &|done, total| progress.report(done, total));
        progress.finish();
        Ok(picture)
    }
}

impl FilmArgs {
    fn apply(&self, film: &mut Film) {
        if let Some(Size { width, height }) = self.size {
            (film.width, film.height) = (width, height);
        }
        film.spp = self.spp.unwrap_or(film.spp);
        film.seed = self.seed.unwrap_or(film.seed);
    }
}

/// What `--stats` writes.
#[derive(Serialize)]
struct Stats {
    version: &'static str,
    scene: String,
    picture: String,
    backend: String,
    simd: &'static str,
    threads: usize,
    width: u32,
    height: u32,
    spp: u32,
    seed: u32,
    seconds: Seconds,
    rays: Rays,
    /// All rays over the time of rendering.
    mrays_per_second: f64,
    dropped_samples: u64,
    memory: Memory,
}

/// Wall-clock time by phase.
#[derive(Serialize)]
struct Seconds {
    load: f64,
    build: f64,
    render: f64,
    write: f64,
    total: f64,
}

#[derive(Serialize)]
struct Rays {
    camera: u64,
    shadow: u64,
    diffuse: u64,
    reflection: u64,
    refraction: u64,
    total: u64,
}

impl From<&RenderStats> for Rays {
    fn from(stats: &RenderStats) -> Self {
        let rays = &stats.rays;
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
    fn write(&self, path: &Path) -> Result<(), OutputError> {
        atomic::write(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            writeln!(file)
        })
    }

    fn summarise(&self) -> Result<(), CliError> {
        let Self {
            picture,
            width,
            height,
            spp,
            mrays_per_second,
            ..
        } = self;
        let seconds = self.seconds.total;
        writeln!(
            std::io::stdout(),
            "{picture}: {width}x{height}, {spp} spp, {seconds:.2} s, {mrays_per_second:.2} Mrays/s"
        )
        .map_err(CliError::stdout)
    }
}

/// Measures phases one after the other.
struct Clock {
    start: Instant,
    lap: Instant,
}

impl Clock {
    fn start() -> Self {
        let now = Instant::now();
        Self {
            start: now,
            lap: now,
        }
    }

    /// Seconds since the last lap.
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let seconds = (now - self.lap).as_secs_f64();
        self.lap = now;
        seconds
    }

    fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
