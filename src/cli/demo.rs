//! `prismarch demo`: writes a ready scene and renders it.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::engine::EngineArgs;
use super::error::CliError;
use super::film::FilmArgs;
use super::march::MarchArgs;
use super::picture::Target;
use super::render::Job;
use super::watch::WatchArgs;
use crate::demo::{DEMOS, Demo, WriteOptions, digest};
use crate::files::Outputs;
use crate::scene::Loaded;

/// Make a ready scene and a picture of it
///
/// Mesh, displacement map, colours and scene file are made by the program itself and written into a folder, then the
/// scene is rendered. All files are there to be changed and rendered again with `prismarch render`. A file that was changed, or
/// that no demo made, is replaced with --force only.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch demo
  prismarch demo --list
  prismarch demo chainmail --out chainmail --size 1280x960 --spp 64
  prismarch demo orb --no-render")]
pub struct Args {
    /// Which one; --list tells them all
    #[arg(default_value = "asteroid")]
    name: String,
    /// Folder for the files, made if it is missing [default: NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files in the folder that no demo made, or that were changed since
    #[arg(long)]
    force: bool,
    /// List the demos
    #[arg(long)]
    list: bool,
    /// Texels across and up of the displacement map, for a quick look [default: as in --list]
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u16).range(256..=16_384))]
    map_size: Option<u16>,
    /// Write the scene, but render nothing
    #[arg(long)]
    no_render: bool,
    #[command(flatten)]
    film: FilmArgs,
    #[command(flatten)]
    engine: EngineArgs,
    /// Print errors and warnings only
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    if args.list {
        return list();
    }
    let demo = find(&args.name)?;
    args.engine.check_backend()?;
    args.engine.start_threads()?;
    let folder = args.out.clone().unwrap_or_else(|| demo.name.into());
    let map_size = args.map_size.map_or(demo.map_size, usize::from);
    if !args.quiet {
        eprintln!("making {} in {}", demo.name, folder.display());
    }
    let options = WriteOptions {
        map_size,
        force: args.force,
        picture: !args.no_render,
    };
    let scene = demo.write(&folder, options)?;
    if args.no_render {
        return writeln!(std::io::stdout(), "{}", scene.display()).map_err(CliError::stdout);
    }
    let picture = folder.join(demo.picture());
    let before = digest(&picture).ok();
    let rendered = render(args, &scene, &picture);
    // A run that was interrupted has written its picture, too; one that failed before has left the old one.
    let kept = if rendered.is_ok() || digest(&picture).ok() != before {
        demo.keep_picture(&folder)
    } else {
        Ok(())
    };
    rendered.and(kept.map_err(CliError::from))
}

fn render(args: &Args, scene: &Path, picture: &Path) -> Result<(), CliError> {
    let mut outputs = Outputs::new();
    Job {
        target: Target::new(picture, &mut outputs)?,
        is_named: true,
        outputs,
        scene,
        film: &args.film,
        load: &|| Ok(Loaded::from_file(scene)?),
        integrator: None,
        samples: None,
        resume: false,
        march: &MarchArgs::default(),
        watch: &WatchArgs::default(),
        stats: None,
        engine: &args.engine,
        quiet: args.quiet,
    }
    .run()
}

fn find(name: &str) -> Result<&'static Demo, CliError> {
    crate::demo::find(name).ok_or_else(|| {
        let names: Vec<_> = DEMOS.iter().map(|demo| demo.name).collect();
        let names = names.join(", ");
        CliError::Usage(format!(
            "there is no demo {name:?}; expected one of {names}"
        ))
    })
}

fn list() -> Result<(), CliError> {
    let mut table = String::new();
    for demo in DEMOS {
        let Demo {
            name,
            title,
            triangles,
            map_size,
            ..
        } = demo;
        let map = format!("{map_size}x{map_size}");
        table += &format!("{name:10} {triangles:>6} triangles, map {map:9}  {title}\n");
    }
    std::io::stdout()
        .write_all(table.as_bytes())
        .map_err(CliError::stdout)
}
