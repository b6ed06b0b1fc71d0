//! Files as inputs and outputs: what is read is a regular file, what is written appears complete or not at all, and no run
//! writes over what it reads.

pub(crate) mod guard;
mod identity;
pub mod input;
pub mod output;
mod outputs;

pub use guard::{is_guarded, keep_caught_panics_quiet};
pub use output::OutputError;
pub use outputs::Outputs;
