//! `prismarch merge`: parts of a picture, rendered apart, become one.

use std::io::Write;
use std::path::PathBuf;

use super::error::CliError;
use super::film::ToneArgs;
use super::picture::Target;
use crate::files::Outputs;
use crate::render::film::{FrameFile, merge};
use crate::scene::Film;

/// Put parts of a picture together
///
/// Parts are EXR files that `prismarch render` wrote of one scene with --crop or --samples, in any mix and order. Tiles merged
/// are the whole picture bit for bit; runs of samples are weighted by their number. Files are refused that differ in scene, seed,
/// size, version or settings, that were interrupted, or that hold the same samples.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch merge left.exr right.exr -o whole.exr
  prismarch merge first.exr second.exr third.exr -o all.exr
  prismarch merge whole.exr -o whole.png --tone agx --exposure 1")]
pub struct Args {
    /// EXR files
    #[arg(required = true, value_name = "EXR")]
    parts: Vec<PathBuf>,
    /// The picture, .exr, or .png to look at
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    tone: ToneArgs,
    /// Print errors and warnings only
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut outputs = Outputs::new();
    let target = Target::new(&args.output, &mut outputs)?;
    outputs.spare(&args.parts)?;
    let Some(FrameFile { frame, info }) = merge(&args.parts)? else {
        return Err(CliError::Usage("no files to merge".into()));
    };
    let mut film = Film::default();
    args.tone.apply(&mut film);
    target.write(&frame, &info, &film)?;
    if args.quiet {
        return Ok(());
    }
    let parts: Vec<String> = info.parts.iter().map(|part| part.to_string()).collect();
    let (path, parts) = (args.output.display(), parts.join("; "));
    writeln!(std::io::stdout(), "{path}: {parts} of {} spp", info.spp).map_err(CliError::stdout)
}
