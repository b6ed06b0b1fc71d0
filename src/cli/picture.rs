//! Where a picture goes: chosen before anything is rendered, written when all is done.

use std::path::{Path, PathBuf};

use super::error::CliError;
use crate::files::{OutputError, Outputs};
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
    /// One more of the outputs, which must be able to be written; the ending must be known.
    pub fn new(path: &Path, outputs: &mut Outputs) -> Result<Self, CliError> {
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
        outputs.add(path)?;
        Ok(Self {
            path: path.to_owned(),
            format,
        })
    }

    /// A target for a picture that was given no name: a PNG called like the scene, or nearly so where that file is read-only, one
    /// of the `outputs` or one of the files that the run reads. The outputs themselves must be none of these.
    pub fn of_scene(scene: &Path, outputs: &Outputs, inputs: &[PathBuf]) -> Result<Self, CliError> {
        let mut tried = 0;
        loop {
            let path = name_of_scene(scene, tried);
            let mut outputs = outputs.clone();
            match outputs.add(&path).and_then(|()| outputs.spare(inputs)) {
                Ok(()) => {
                    let format = Format::Png;
                    return Ok(Self { path, format });
                }
                Err(OutputError::Protected { .. }) => tried += 1,
                Err(taken) if taken.is_usage() => tried += 1,
                Err(other) => return Err(other.into()),
            }
        }
    }

    /// Whether this is the first name that [`Target::of_scene`] looks at.
    pub fn is_usual_of(&self, scene: &Path) -> bool {
        self.path == name_of_scene(scene, 0)
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

/// `rock.png`, `rock.render.png`, `rock.render2.png`, ...
fn name_of_scene(scene: &Path, tried: usize) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    match tried {
        0 => name.push(".png"),
        1 => name.push(".render.png"),
        _ => name.push(format!(".render{tried}.png")),
    }
    name.into()
}
