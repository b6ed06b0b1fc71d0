//! What options are for: the headings that `--help` shows them under.

/// Which files are read, and how.
pub const INPUT: &str = "Input";
/// A mesh without a scene file: its maps and its material.
pub const MESH: &str = "A mesh without a scene file";
/// From where it is seen, and what lights it.
pub const STAGE: &str = "Camera and light of such a mesh";
/// Size, colours and files of the picture.
pub const PICTURE: &str = "Picture";
/// Noise and sharpness against time.
pub const QUALITY: &str = "Quality and time";
/// How displaced surfaces are found.
pub const TRACING: &str = "Displaced surfaces";
/// Pictures rendered bit by bit.
pub const PARTS: &str = "Parts of a picture";
/// Backends, threads, reports.
pub const MACHINE: &str = "Machine and reports";
