//! `prismarch man`: manual pages, of the program and of each verb.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Command;
use clap_mangen::Man;

use super::error::CliError;
use crate::files::{Outputs, output};

/// Print the manual page, or write those of all verbs
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch man | man -l -
  prismarch man render | man -l -
  prismarch man --out ~/.local/share/man/man1")]
pub struct Args {
    /// The verb whose page is printed [default: the program's own]
    verb: Option<String>,
    /// Existing folder for all pages, prismarch.1, prismarch-render.1 and so on, instead of printing one
    #[arg(long, value_name = "DIR", conflicts_with = "verb")]
    out: Option<PathBuf>,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut program = super::command();
    program.build();
    // clap's own `help` has nothing to tell.
    let verbs = program
        .get_subcommands()
        .filter(|verb| verb.get_name() != "help");
    let verbs: Vec<Command> = verbs.cloned().collect();
    if let Some(folder) = &args.out {
        let mut pages = vec![(super::NAME.to_owned(), program)];
        pages.extend(verbs.into_iter().map(|verb| (name(&verb), verb)));
        let path = |name: &str| folder.join(format!("{name}.1"));
        let mut outputs = Outputs::new();
        for (name, _) in &pages {
            outputs.add(&path(name))?;
        }
        for (name, command) in pages {
            let page = page(&command)?;
            output::write(&path(&name), |out| out.write_all(&page))?;
        }
        return Ok(());
    }
    let chosen = match &args.verb {
        None => program,
        Some(named) => {
            let known: Vec<_> = verbs
                .iter()
                .map(|verb| verb.get_name().to_owned())
                .collect();
            let mut verbs = verbs.into_iter();
            verbs.find(|verb| verb.get_name() == named).ok_or_else(|| {
                let known = known.join(", ");
                CliError::Usage(format!(
                    "there is no verb {named:?}; expected one of {known}"
                ))
            })?
        }
    };
    io::stdout()
        .write_all(&page(&chosen)?)
        .map_err(CliError::stdout)
}

/// What a verb's page is called: `prismarch-render`.
fn name(verb: &Command) -> String {
    format!("{}-{}", super::NAME, verb.get_name())
}

fn page(command: &Command) -> Result<Vec<u8>, CliError> {
    let mut page = Vec::new();
    let man = Man::new(command.clone()).source(concat!("prismarch ", env!("CARGO_PKG_VERSION")));
    man.render(&mut page).map_err(CliError::stdout)?;
    Ok(page)
}
