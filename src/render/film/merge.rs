//! Parts of a picture, tiles or runs of samples, put together.

use std::path::PathBuf;

use super::error::FrameError;
use super::file::FrameFile;
use super::info::FrameInfo;

/// Puts files together. Pixels of one file are taken over to the bit; those of several get all their samples, in
/// the order of the samples' numbers, whatever the order of the files.
///
/// Refused are files of different pictures (scene, seed, size, version, ...), partial ones, and such that
/// hold the same samples. `None` if there are no files.
pub fn merge(mut files: Vec<(PathBuf, FrameFile)>) -> Result<Option<FrameFile>, FrameError> {
    files.sort_by_key(|(_, file)| file.info.bounds().samples.start);
    check(&files)?;
    let mut files = files.into_iter();
    let Some((_, first)) = files.next() else {
        return Ok(None);
    };
    let rest: Vec<FrameFile> = files.map(|(_, file)| file).collect();
    let mut info = first.info.clone();
    for file in &rest {
        join(&mut info, &file.info);
    }
    let bounds = info.bounds();
    let mut frame = first.frame.empty_part(bounds.window);
    frame.set_samples(bounds.samples);
    for file in std::iter::once(&first).chain(&rest) {
        frame.merge(&file.frame);
    }
    info.tidy();
    Ok(Some(FrameFile { frame, info }))
}

fn check(files: &[(PathBuf, FrameFile)]) -> Result<(), FrameError> {
    for (index, (path, file)) in files.iter().enumerate() {
        if file.info.partial {
            return Err(FrameError::Partial { path: path.clone() });
        }
        let (first_path, first) = &files[0];
        first.info.check_same(first_path, &file.info, path)?;
        file.frame.check_channels(path, &first.frame, first_path)?;
        for (other, before) in &files[..index] {
            let twice = before.info.parts.iter().find_map(|part| {
                let parts = &mut file.info.parts.iter();
                parts.find_map(|mine| part.intersection(mine))
            });
            if let Some(part) = twice {
                return Err(FrameError::Twice {
                    path: path.clone(),
                    other: other.clone(),
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
