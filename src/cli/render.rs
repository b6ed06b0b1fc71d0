//! `prismarch render`: a scene file, or a mesh and its maps, becomes a picture.

mod mesh;

use std::io::Write;
use std::net::TcpStream;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;

use super::engine::{Engine, EngineArgs};
use super::error::CliError;
use super::film::FilmArgs;
use super::heading::{INPUT, MACHINE, PARTS, PICTURE, QUALITY};
use super::interrupt::Interrupt;
use super::load::LoadArgs;
use super::march::MarchArgs;
use super::memory::Memory;
use super::parse;
use super::picture::Target;
use super::stats::{Clock, Seconds, Stats};
use super::watch::{WatchArgs, Watched};
use crate::files::Outputs;
use crate::render::film::{Frame, FrameFile, FrameInfo, Objects, Source};
use crate::render::{Outcome, RenderInput};
use crate::scene::{Aov, AovSet, Film, Integrator, Loaded, Scene, View};
use crate::trace::World;
pub use mesh::Given;
use mesh::MeshArgs;

/// Render a mesh and its maps, or a scene file, to a picture
///
/// A mesh is framed by a camera and lit by sun and sky; --save writes the scene file that it stands for, to go on from. The format of scene files is described in docs/scene.md. The picture is a PNG (tone curve, 8-bit sRGB) or an EXR (linear
/// radiance, 32-bit float, and what --aovs names), by the ending of its name; docs/render.md describes both. It is the same to the bit
/// for any number of threads. Ctrl-C and SIGTERM write what is done and end with 128 + the signal's number.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch render rock.obj --displacement rock_height.png
  prismarch render rock.obj --displacement rock_height.png --scale 0.2 --color rock_color.png --normals smooth -o rock.png
  prismarch render rock.glb --displacement textures/ --view front --orbit 30 --floor
  prismarch render rock.obj --displacement rock_height.png --save scene.toml
  prismarch render scene.toml
  prismarch render scene.toml -o rock.exr --size 1920x1080 --spp 256
  prismarch render scene.toml -o left.exr --crop 0,0,320,480
  prismarch render scene.toml -o second.exr --samples 16..32 --spp 64
  prismarch render scene.toml -o rock.exr --resume
  prismarch render scene.toml -o rock.png --preview
  prismarch render scene.toml -o rock.exr --preview 30 --tev 192.168.1.20:14158
  prismarch render scene.toml --march uniform --dt 0.5
  prismarch render scene.toml --lod cone --spp 1
  prismarch render scene.toml --backend bvh --threads 4 --stats stats.json --quiet")]
pub struct Args {
    /// Scene file (TOML), or a mesh: .obj, .gltf, .glb or .ply
    #[arg(value_name = "SCENE|MESH")]
    scene: PathBuf,
    #[command(flatten)]
    mesh: MeshArgs,
    /// Picture, .png or .exr [default: the scene's or the mesh's name with .png, in the current folder, or .render.png where the
    /// run reads that file]
    #[arg(short, long, value_name = "FILE", help_heading = PICTURE)]
    output: Option<PathBuf>,
    #[command(flatten)]
    film: FilmArgs,
    /// A key of the scene file with another value, like film.spp=64, light.0.strength=2 or material.rock.roughness=0.2; may be
    /// given again
    #[arg(long, value_name = "KEY=VALUE", help_heading = INPUT)]
    set: Vec<String>,
    /// What is computed, instead of the scene's integrator
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Integrator::names()), help_heading = QUALITY)]
    integrator: Option<String>,
    /// Samples A to B - 1 of those of every pixel, to be merged with others [default: all]
    #[arg(long, value_name = "A..B", value_parser = parse::samples, help_heading = PARTS)]
    samples: Option<Range<u32>>,
    /// Go on with the output if it is there: an EXR file of the same scene and options that was interrupted
    #[arg(long, help_heading = PARTS)]
    resume: bool,
    #[command(flatten)]
    march: MarchArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Write times, ray counts and memory as JSON
    #[arg(long, value_name = "FILE", help_heading = MACHINE)]
    stats: Option<PathBuf>,
    #[command(flatten)]
    load: LoadArgs,
    #[command(flatten)]
    engine: EngineArgs,
    /// Print errors and warnings only
    #[arg(short, long, help_heading = MACHINE)]
    quiet: bool,
}

/// Everything that a run of the renderer needs.
pub struct Job<'a> {
    /// Scene file, or mesh.
    pub scene: &'a Path,
    /// Loads it.
    pub load: &'a (dyn Fn() -> Result<Loaded, CliError> + Sync),
    /// Where the picture goes.
    pub target: Target,
    /// The user named it; else another name is taken where the scene reads that file.
    pub is_named: bool,
    /// What is written, the picture if it is named.
    pub outputs: Outputs,
    /// Film settings that win over the scene's.
    pub film: &'a FilmArgs,
    /// The name of an integrator that wins over the scene's.
    pub integrator: Option<&'a str>,
    /// Which samples; `None` for all.
    pub samples: Option<Range<u32>>,
    /// Go on with the picture if it is there.
    pub resume: bool,
    /// Marches that win over the scene's.
    pub march: &'a MarchArgs,
    /// What is seen of it meanwhile.
    pub watch: &'a WatchArgs,
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
    let mut outputs = Outputs::new();
    if let Some(stats) = &args.stats {
        outputs.add(stats)?;
    }
    let lookdev = args.mesh.lookdev(&args.scene, args.quiet)?;
    if let Some(save) = &args.mesh.save {
        outputs.add(save)?;
        outputs.spare([&args.scene])?;
    }
    if let (Some(lookdev), Some(save), None) = (&lookdev, &args.mesh.save, &args.output) {
        args.engine.start_threads()?;
        let loaded = args.make(lookdev, &outputs)?;
        super::warn(&loaded.warnings);
        return writeln!(std::io::stdout(), "{}", save.display()).map_err(CliError::stdout);
    }
    let target = match &args.output {
        Some(path) => Target::new(path, &mut outputs)?,
        None => Target::of_scene(&args.scene, &outputs, &[])?,
    };
    outputs.spare([&args.scene])?;
    args.engine.start_threads()?;
    let kept = outputs.clone();
    Job {
        scene: &args.scene,
        load: &|| match &lookdev {
            Some(lookdev) => args.make(lookdev, &kept),
            None => Ok(Loaded::from_file_with(
                &args.scene,
                &args.set,
                args.load.options(),
            )?),
        },
        target,
        is_named: args.output.is_some(),
        outputs,
        film: &args.film,
        integrator: args.integrator.as_deref(),
        samples: args.samples.clone(),
        resume: args.resume,
        march: &args.march,
        watch: &args.watch,
        stats: args.stats.as_deref(),
        engine: &args.engine,
        quiet: args.quiet,
    }
    .run()
}

/// Lets options win over the scene.
fn settle(
    scene: &mut Scene,
    film: &FilmArgs,
    integrator: Option<&str>,
    march: &MarchArgs,
) -> Result<(), CliError> {
    film.apply(&mut scene.film)?;
    if let Some(integrator) = integrator.and_then(Integrator::named) {
        scene.integrator = integrator;
    }
    march.apply(scene, false)
}

impl Job<'_> {
    /// Loads, builds, renders, writes, and says so in one line.
    pub fn run(mut self) -> Result<(), CliError> {
        let mut clock = Clock::start();
        let viewer = self.watch.connect()?;
        let mut loaded = (self.load)()?;
        self.spare(&loaded.files)?;
        super::warn(&loaded.warnings);
        if !self.quiet {
            super::note(&loaded.notes);
        }
        settle(&mut loaded.scene, self.film, self.integrator, self.march)?;
        loaded.scene.film.progressive |= self.watch.preview.is_some();
        let Some(mut begun) = self.begin(&mut loaded.scene)? else {
            return self.say(&format!("{} is complete", self.target.path().display()));
        };
        let load = clock.lap();
        let world = loaded.scene.world()?;
        loaded.scene.check_camera(&world)?;
        world.set_spread(self.march.spread(&loaded.scene));
        let engine = self.engine.build(&world)?;
        begun.info.backend = engine.tracer().name();
        let build = clock.lap();
        let interrupt = Interrupt::catch()?;
        let outcome = self.render(&loaded, &world, &*engine, &mut begun, &interrupt, viewer)?;
        engine.check()?;
        let render = clock.lap();
        let FrameFile { frame, info } = &mut begun;
        info.partial = outcome.stopped && !frame.is_complete();
        self.target.write(frame, info, &loaded.scene.film)?;
        let write = clock.lap();
        let film = &loaded.scene.film;
        let size = frame.window().size();
        let stats = Stats {
            version: env!("CARGO_PKG_VERSION"),
            scene: self.scene.display().to_string(),
            picture: self.target.path().display().to_string(),
            backend: engine.tracer().name(),
            simd: crate::prism::SimdLevel::detect().name(),
            threads: rayon::current_num_threads(),
            width: size.x,
            height: size.y,
            spp: film.spp,
            samples: frame.taken(),
            seed: film.seed,
            partial: info.partial,
            seconds: Seconds {
                load,
                build,
                render,
                write,
                total: clock.total(),
            },
            rays: (&outcome.rays).into(),
            mrays_per_second: outcome.rays.total() as f64 / render.max(1e-9) / 1e6,
            dropped_samples: frame.dropped(),
            memory: Memory::of(&loaded, &world, engine.tracer()),
            peak_memory: super::memory::peak(),
        };
        if let Some(path) = self.stats {
            stats.write(path)?;
        }
        match interrupt.signal().filter(|_| info.partial) {
            Some(signal) => Err(CliError::Interrupted {
                signal,
                path: self.target.path().to_owned(),
                resumable: self.target.keeps_all(),
            }),
            None => self.say(&stats.summary()),
        }
    }

    /// Fails if what is written was read. A picture that has no name given takes another then.
    fn spare(&mut self, files: &[PathBuf]) -> Result<(), CliError> {
        self.outputs.spare(files)?;
        if self.is_named {
            return Ok(());
        }
        self.target = Target::of_scene(self.scene, &self.outputs, files)?;
        if !self.target.is_usual_of(self.scene) {
            let path = self.target.path().display();
            super::warn(&[format!(
                "the picture is {path}: the file of the scene's name and .png is read-only, or this run reads it"
            )]);
        }
        Ok(())
    }

    /// The frame to be rendered, new or as it was left; `None` if there is nothing left to do.
    fn begin(&self, scene: &mut Scene) -> Result<Option<FrameFile>, CliError> {
        if !self.target.keeps_all() {
            // Nobody would see them.
            scene.film.aovs = AovSet::NONE;
        } else if scene.integrator == Integrator::View(View::Cost) {
            scene.film.aovs = scene.film.aovs.with(Aov::Cost);
        }
        let film = &scene.film;
        let samples = self.samples(film)?;
        let source = Source {
            name: self.scene.display().to_string(),
            hash: scene.fingerprint(),
            integrator: scene.integrator.name().into(),
            backend: String::new(), // not built yet
        };
        let objects = Objects::new(scene.objects.iter().map(|object| &object.name[..]));
        let new = FrameFile {
            info: FrameInfo::new(film, samples.clone(), &source),
            frame: Frame::new(film, samples, objects.clone()),
        };
        if !self.resume {
            return Ok(Some(new));
        }
        if !self.target.keeps_all() {
            return Err(CliError::Usage(
                "only EXR files can be gone on with: expected -o NAME.exr with --resume".into(),
            ));
        }
        let path = self.target.path();
        if !path.exists() {
            return Ok(Some(new));
        }
        let mut old = FrameFile::read(path)?;
        old.check_resumes(path, &new, self.scene)?;
        old.frame.go_on_with(film, objects);
        Ok(old.info.partial.then_some(old))
    }

    /// The numbers of the samples that are asked for.
    fn samples(&self, film: &Film) -> Result<Range<u32>, CliError> {
        let whole = 0..film.spp;
        let Some(samples) = self.samples.clone() else {
            return Ok(whole);
        };
        let Range { start, end } = samples;
        if end > film.spp {
            return Err(CliError::Usage(format!(
                "--samples {start}..{end}: found {end}; expected at most the {} samples of a pixel (--spp)",
                film.spp
            )));
        }
        if film.adaptive.is_some() && samples != whole {
            return Err(CliError::Usage(format!(
                "--samples {start}..{end}: where adaptive sampling ends a pixel is seen from all its samples; \
                 expected --adaptive-threshold off, or tiles (--crop) instead"
            )));
        }
        Ok(samples)
    }

    fn render(
        &self,
        loaded: &Loaded,
        world: &World,
        engine: &dyn Engine,
        begun: &mut FrameFile,
        interrupt: &Interrupt,
        viewer: Option<TcpStream>,
    ) -> Result<Outcome, CliError> {
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
        let FrameFile { frame, info } = begun;
        Watched {
            input,
            interrupt,
            quiet: self.quiet,
            write: &|frame| self.target.write(frame, info, &scene.film),
            preview: self.watch.preview,
            viewer,
            name: self.target.path(),
        }
        .render(frame)
    }

    fn say(&self, line: &str) -> Result<(), CliError> {
        if self.quiet {
            return Ok(());
        }
        writeln!(std::io::stdout(), "{line}").map_err(CliError::stdout)
    }
}
