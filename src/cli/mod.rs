//! The command line: one file per verb.
//!
//! Exit codes: 0 done, 1 the machine failed us, 2 usage, 3 bad input, 4 output, 128 + n interrupted by signal n. Results go to stdout, everything else
//! to stderr. Files appear complete or not at all.

mod completions;
mod demo;
mod engine;
mod error;
mod film;
mod heading;
mod hits;
mod info;
mod interrupt;
mod load;
mod man;
mod march;
mod memory;
mod merge;
mod parse;
mod picture;
mod preview;
mod progress;
mod query;
mod rays;
mod render;
mod stats;
mod surface;
mod tev;
mod watch;

use std::process::ExitCode;

use clap::{Command, CommandFactory, Parser, Subcommand};

use crate::files::keep_caught_panics_quiet;
use error::CliError;

/// Exit codes, and where to read on.
const AFTER_HELP: &str = "\
Examples:
  prismarch demo                                   make a cratered asteroid and a picture of it
  prismarch render rock.obj --displacement h.png   a picture of a mesh under its displacement map
  prismarch render rock.obj --displacement h.png --save scene.toml
  prismarch render scene.toml -o rock.png          render a scene
  prismarch merge a.exr b.exr -o whole.exr         put parts of a picture together
  prismarch info scene.toml                        triangles, maps, memory
  prismarch query --mesh m.obj --map h.png --scale 0.1 --rays rays.csv -o hits.csv

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 bad input, 4 output could not be written,
128 + n interrupted by signal n (what is done is written).
`prismarch VERB --help` tells more of a verb.";

/// What the program is called.
const NAME: &str = "prismarch";

/// Ray traces displaced surfaces without tessellating them.
///
/// A low-poly mesh and a displacement map are traced directly: no micro-triangles, 108 bytes per base triangle
/// and 32 per block of up to 32x32 texels beside the map.
#[derive(Parser)]
#[command(name = NAME, version, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Demo(demo::Args),
    Render(Box<render::Args>),
    Merge(merge::Args),
    Info(info::Args),
    Query(query::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// All verbs and options.
fn command() -> Command {
    Cli::command()
}

/// Runs the program on the process's arguments.
pub fn main() -> ExitCode {
    keep_caught_panics_quiet();
    let outcome = match Cli::try_parse() {
        Ok(cli) => run(cli.verb),
        Err(usage) => return explain(&usage),
    };
    match outcome {
        Ok(()) | Err(CliError::ReaderGone) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("prismarch: error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(verb: Verb) -> Result<(), CliError> {
    match verb {
        Verb::Render(args) => render::run(&args),
        Verb::Merge(args) => merge::run(&args),
        Verb::Query(args) => query::run(&args),
        Verb::Info(args) => info::run(&args),
        Verb::Demo(args) => demo::run(&args),
        Verb::Completions(args) => completions::run(&args),
        Verb::Man(args) => man::run(&args),
    }
}

/// Help and version go to stdout; a usage error to stderr, with the program's name before it.
fn explain(usage: &clap::Error) -> ExitCode {
    if usage.use_stderr() {
        eprint!("prismarch: {}", usage.render());
        ExitCode::from(error::USAGE)
    } else {
        // A reader that has seen enough is no error.
        let _ = usage.print();
        ExitCode::SUCCESS
    }
}

/// Says what was taken of the input without being asked for.
fn note(notes: &[String]) {
    for note in notes {
        eprintln!("prismarch: {note}");
    }
}

/// Says what was mended in the input, and what of it has no effect.
fn warn(warnings: &[String]) {
    for warning in warnings {
        eprintln!("prismarch: warning: {warning}");
    }
}
