//! `prismarch completions`: what a shell needs to complete verbs, options and their values.

use std::io::Write;

use clap_complete::{Shell, generate};

use super::error::CliError;

/// Print completions for a shell
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch completions bash > ~/.local/share/bash-completion/completions/prismarch
  prismarch completions zsh > ~/.zfunc/_prismarch
  prismarch completions fish > ~/.config/fish/completions/prismarch.fish")]
pub struct Args {
    /// Which one
    #[arg(value_enum)]
    shell: Shell,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut script = Vec::new();
    generate(args.shell, &mut super::command(), super::NAME, &mut script);
    let mut out = std::io::stdout();
    out.write_all(&script).map_err(CliError::stdout)
}
