//! Where a picture goes: checked before anything is rendered, written when all is done.

use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::image::{ExrChannel, atomic, write_exr, write_png_rgb8};
use crate::render::{Picture, to_srgb8};
use crate::scene::Film;

/// A file that a picture can be written to.
#[derive(Debug)]
pub struct Target {
    path: PathBuf,
    format: Format,
}

#[derive(Clone, Copy, Debug)]
enum Format {
    Png,
    Exr,
}

impl Target {
    /// Checks that the ending is known and that the folder is there and lets itself be written.
    pub fn new(path: &Path) -> Result<Self, CliError> {
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let format = match &ending.to_lowercase()[..] {
            "png" => Format::Png,
            "exr" => Format::Exr,
            other => {
                return Err(CliError::PictureFormat {
                    path: path.to_owned(),
                    found: match other {
                        "" => "no ending".into(),
                        _ => format!(".{other}"),
                    },
                });
            }
        };
        atomic::check(path)?;
        Ok(Self {
            path: path.to_owned(),
            format,
        })
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the picture: PNG with exposure and tone curve, EXR as linear radiance.
    pub fn write(&self, picture: &Picture, film: &Film) -> Result<(), CliError> {
        let (width, height) = (picture.width as usize, picture.height as usize);
        // Files are written from the bottom row up, the picture starts at the top.
        let from_bottom = picture.pixels.chunks_exact(width).rev().flatten();
        match self.format {
            Format::Png => {
                let encode = |&radiance| to_srgb8(radiance, film.exposure, film.tone);
                let pixels: Vec<_> = from_bottom.map(encode).collect();
                write_png_rgb8(&self.path, width, height, &pixels)?;
            }
            Format::Exr => {
                let pixels: Vec<_> = from_bottom.map(|radiance| radiance.to_array()).collect();
                let channels = ExrChannel::rgb(None, &pixels).into();
                let renderer = concat!("prismarch ", env!("CARGO_PKG_VERSION"));
                let attributes = [("renderer", renderer)];
                write_exr(&self.path, width, height, channels, &attributes)?;
            }
        }
        Ok(())
    }
}
