//! What mesh files may do: options shared by the verbs that load them.

use super::heading::INPUT;
use crate::scene::load::LoadOptions;

/// Options of loading.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct LoadArgs {
    /// Let glTF files name buffers and pictures outside of their own folder
    #[arg(long, help_heading = INPUT)]
    allow_external: bool,
}

impl LoadArgs {
    /// For the loader.
    pub fn options(self) -> LoadOptions {
        LoadOptions {
            allow_external: self.allow_external,
            ..LoadOptions::default()
        }
    }
}
