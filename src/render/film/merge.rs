//! Parts of a picture, tiles or runs of samples, put together.

use std::path::{Path, PathBuf};

use super::error::FrameError;
use super::file::FrameFile;
use super::info::FrameInfo;

/// Puts files together, one of them in memory at a time. Pixels of one file are taken over to the bit; those of several
/// get all their samples, in the order of the samples' numbers, whatever the order of the files.
///
/// Refused are files of different pictures (scene, seed, size, version, ...), partial ones, and such that
/// hold the same samples. `None` if there are no files.
pub fn merge(paths: &[PathBuf]) -> Result<Option<FrameFile>, FrameError> {
    let infos = paths
        .iter()
        .map(|path| Ok((&**path, FrameFile::read_info(path)?)));
    let mut infos: Vec<(&Path, FrameInfo)> = infos.collect::<Result<_, FrameError>>()?;
    infos.sort_by_key(|(_, info)| info.bounds().samples.start);
    check(&infos)?;
    let Some((&(first_path, _), rest)) = infos.split_first() else {
        return Ok(None);
    };
    let first = FrameFile::read(first_path)?;
    let mut info = first.info;
    for (_, other) in rest {
        join(&mut info, other);
    }
    let bounds = info.bounds();
    let mut frame = first.frame.empty_part(bounds.window);
    frame.set_samples(bounds.samples);
    frame.merge(&first.frame);
    for &(path, _) in rest {
        let other = FrameFile::read(path)?.frame;
        other.check_channels(path, &frame, first_path)?;
        frame.merge(&other);
    }
    info.tidy();
    Ok(Some(FrameFile { frame, info }))
}

fn check(files: &[(&Path, FrameInfo)]) -> Result<(), FrameError> {
    for (index, (path, info)) in files.iter().enumerate() {
        if info.partial {
            return Err(FrameError::Partial {
                path: path.to_path_buf(),
            });
        }
        let (first_path, first) = &files[0];
        first.check_same(first_path, info, path)?;
        for (other, before) in &files[..index] {
            let twice = before.parts.iter().find_map(|part| {
                let parts = &mut info.parts.iter();
                parts.find_map(|mine| part.intersection(mine))
            });
            if let Some(part) = twice {
                return Err(FrameError::Twice {
                    path: path.to_path_buf(),
                    other: other.to_path_buf(),
                    part,
                });
            }
        }
    }
    Ok(())
}

fn join(info: &mut FrameInfo, other: &FrameInfo) {
    info.parts.extend_from_slice(&other.parts);
    info.spp = info.spp.max(other.spp);
    if !info.backend.split("; ").any(|known| known == other.backend) {
        info.backend += "; ";
        info.backend += &other.backend;
    }
}
