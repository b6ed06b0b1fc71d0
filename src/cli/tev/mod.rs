//! The viewer tev (<https://github.com/Tom94/tev>), told over TCP what a picture in the making looks like.

mod address;
mod packet;
mod viewer;

pub use address::Address;
pub use viewer::{Image, Viewer};
