//! Where a picture goes: checked before anything is rendered, written when all is done.

use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::files::output;
use crate::image::write_png_rgb8;
use crate::render::film::{Frame, FrameInfo};
use crate::render::to_srgb8;
use crate::scene::Film;

/// A file that a picture can be written to.
#[derive(Debug)]
pub struct Target {
    path: PathBuf,
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
        output::check(path)?;
        Ok(Self {
            path: path.to_owned(),
            format,
        })
    }

    /// The path as given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the file can hold more than a picture to look at: it can be merged and gone on with.
    pub fn keeps_all(&self) -> bool {
        self.format == Format::Exr
    }

    /// Writes the picture: PNG with exposure and tone curve, EXR as linear radiance with all that is beside it.
    pub fn write(&self, frame: &Frame, info: &FrameInfo, film: &Film) -> Result<(), CliError> {
        if self.keeps_all() {
            frame.write(&self.path, info)?;
            return Ok(());
        }
        let size = frame.window().size();
        let (width, height) = (size.x as usize, size.y as usize);
        let radiance = frame.radiance();
        // Files are written from the bottom row up, the picture starts at the top.
        let from_bottom = radiance.chunks_exact(width).rev().flatten();
        let encode = |&radiance| to_srgb8(radiance, film.exposure, film.tone);
        let pixels: Vec<_> = from_bottom.map(encode).collect();
        let texts = info.attributes();
        write_png_rgb8(&self.path, width, height, &pixels, &texts)?;
        Ok(())
    }
}
