//! Files as inputs and outputs: what is read is a regular file, what is written appears complete or not at all.

pub(crate) mod guard;
pub mod input;
pub mod output;

pub use output::OutputError;
