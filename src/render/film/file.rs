//! Frames as EXR files, and back.
//!
//! A file has the mean of every sum, and the counts from which the means become sums again. That is exact, bit for
//! bit, for pixels that have all their samples. Where samples are still to come the sums are written too, as the upper and lower
//! halves of their 64 bits: going on or merging then loses nothing.

use std::path::Path;
use std::sync::Arc;

use glam::UVec2;

use super::column::{Column, OBJECT_LAYER};
use super::error::FrameError;
use super::frame::Frame;
use super::info::{FrameInfo, attribute};
use super::objects::{Objects, layer_key};
use super::pixel::Pixel;
use super::slot::{Layout, MEANS};
use crate::files::OutputError;
use crate::image::{
    ExrChannel, ExrPicture, ExrSamples, read_exr, read_exr_header, write_exr_picture,
};
use crate::scene::{Aov, AovSet};

const AOVS: &str = "prismarch/aovs";

/// A frame, and what is told of it.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameFile {
    /// The pixels.
    pub frame: Frame,
    /// What they are.
    pub info: FrameInfo,
}

impl Frame {
    /// Writes an EXR file, whole or not at all.
    pub fn write(&self, path: &Path, info: &FrameInfo) -> Result<(), OutputError> {
        let window = self.window();
        let size = window.size();
        let mut attributes = info.attributes();
        let aovs = self.layout().aovs();
        attributes.push((AOVS.into(), aovs.to_string()));
        if aovs.has(Aov::Object) {
            attributes.extend([
                (object_attribute("name"), OBJECT_LAYER.into()),
                (object_attribute("hash"), "MurmurHash3_32".into()),
                (object_attribute("conversion"), "uint32_to_float32".into()),
                (
                    object_attribute("manifest"),
                    self.objects().manifest().into(),
                ),
            ]);
        }
        let picture = ExrPicture {
            display: (info.size.x as usize, info.size.y as usize),
            // Windows are inside of pictures, whose sides are far below 2^31.
            position: (window.start.x as i32, window.start.y as i32),
            width: size.x as usize,
            height: size.y as usize,
            channels: channels(self, !info.is_final()),
            attributes,
        };
        write_exr_picture(path, picture)
    }
}

impl FrameFile {
    /// Reads what [`Frame::write`] wrote. The frame knows neither film nor scene: [`Frame::go_on_with`].
    pub fn read(path: &Path) -> Result<Self, FrameError> {
        let picture = read_exr(path)?;
        let info = info(path, &picture)?;
        let layout = Arc::new(Layout::new(aovs(path, &picture.attributes)?));
        let objects = if layout.aovs().has(Aov::Object) {
            let name = object_attribute("manifest");
            Objects::of_manifest(attribute(path, &picture.attributes, &name)?)
        } else {
            Objects::default()
        };
        let bounds = info.bounds();
        let mut frame = Frame::empty(
            bounds.window,
            bounds.samples,
            None,
            layout,
            Arc::new(objects),
        );
        fill(path, &mut frame, &picture, !info.is_final())?;
        Ok(Self { frame, info })
    }

    /// What the file at `path` tells of its picture; the pixels are not looked at.
    pub fn read_info(path: &Path) -> Result<FrameInfo, FrameError> {
        info(path, &read_exr_header(path)?)
    }

    /// Fails unless this, read from `path`, is what was left of `new`, which is begun from the file `scene`.
    pub fn check_resumes(&self, path: &Path, new: &Self, scene: &Path) -> Result<(), FrameError> {
        new.info.check_same(scene, &self.info, path)?;
        self.frame.check_channels(path, &new.frame, scene)?;
        let [found, expected] = [&self.info, &new.info].map(|info| {
            let parts: Vec<String> = info.parts.iter().map(|part| part.to_string()).collect();
            format!("{} of {} spp", parts.join("; "), info.spp)
        });
        if found == expected {
            return Ok(());
        }
        Err(FrameError::Differs {
            path: path.to_owned(),
            other: scene.to_owned(),
            what: "pixels and samples".into(),
            found,
            expected,
        })
    }
}

fn object_attribute(name: &str) -> String {
    format!("cryptomatte/{}/{name}", layer_key(OBJECT_LAYER))
}

fn aovs(path: &Path, attributes: &[(String, String)]) -> Result<AovSet, FrameError> {
    let names = attribute(path, attributes, AOVS)?;
    AovSet::parse(names).ok_or_else(|| FrameError::Attribute {
        path: path.to_owned(),
        name: AOVS.into(),
        found: format!("{names:?}"),
        expected: "names of AOVs".into(),
    })
}

fn info(path: &Path, picture: &ExrPicture) -> Result<FrameInfo, FrameError> {
    let size = UVec2::new(picture.display.0 as u32, picture.display.1 as u32);
    let info = FrameInfo::read(path, size, &picture.attributes)?;
    check_window(path, picture, &info)?;
    Ok(info)
}

/// Fails unless the file's pixels are those that its parts name.
fn check_window(path: &Path, picture: &ExrPicture, info: &FrameInfo) -> Result<(), FrameError> {
    let window = info.bounds().window;
    let (start, size) = (window.start.as_ivec2(), window.size().as_usizevec2());
    let found = (picture.position, (picture.width, picture.height));
    if found == (start.into(), size.into()) {
        return Ok(());
    }
    Err(FrameError::Attribute {
        path: path.to_owned(),
        name: "dataWindow".into(),
        found: format!("{:?} pixels from {:?}", found.1, found.0),
        expected: format!("the window around all parts, {window}"),
    })
}

/// Indices into a frame in the order of a channel's samples: channels have their bottom row first.
fn bottom_first(frame: &Frame) -> impl Iterator<Item = usize> + use<> {
    let size = frame.window().size().as_usizevec2();
    let rows = (0..size.y).rev();
    rows.flat_map(move |row| row * size.x..(row + 1) * size.x)
}

fn channels(frame: &Frame, sums: bool) -> Vec<ExrChannel> {
    let columns = Column::all(frame.layout(), sums);
    let pixels = frame.window().pixels();
    let mut planes = vec![Vec::with_capacity(pixels); columns.len()];
    for index in bottom_first(frame) {
        let pixel = frame.pixel(index).ranked();
        for (plane, column) in planes.iter_mut().zip(&columns) {
            plane.push(column.get(&pixel));
        }
    }
    let channels = columns.iter().zip(planes);
    channels
        .map(|(column, plane)| {
            if column.is_integer() {
                ExrChannel::integers(column.name(), plane)
            } else {
                ExrChannel::floats(column.name(), bytemuck::cast_vec(plane))
            }
        })
        .collect()
}

fn fill(
    path: &Path,
    frame: &mut Frame,
    picture: &ExrPicture,
    sums: bool,
) -> Result<(), FrameError> {
    let columns = Column::all(frame.layout(), sums);
    let planes = columns.iter().map(|column| plane(path, picture, *column));
    let planes: Vec<&[u32]> = planes.collect::<Result<_, _>>()?;
    for (at, index) in bottom_first(frame).enumerate() {
        let mut pixel = Pixel::default();
        for (column, plane) in columns.iter().zip(&planes) {
            let fits = column.set(plane[at], &mut pixel).is_some();
            // No more samples than there are: counts of many files sum up to no overflow.
            if !fits || pixel.counts.taken() as usize > frame.samples().len() {
                let width = frame.window().size().x as usize;
                let place = UVec2::new((index % width) as u32, (index / width) as u32);
                let place = frame.window().start + place;
                return Err(FrameError::Count {
                    path: path.to_owned(),
                    channel: column.name(),
                    x: place.x,
                    y: place.y,
                    found: f32::from_bits(plane[at]),
                });
            }
        }
        if !sums {
            // The mean of all samples is that of the picture, but for filters with negative lobes.
            for channel in 0..3 {
                pixel.sums[MEANS + channel] = pixel.value(channel).into();
            }
        }
        frame.set_pixel(index, &pixel);
    }
    Ok(())
}

/// The bits of the channel of a column.
fn plane<'p>(
    path: &Path,
    picture: &'p ExrPicture,
    column: Column,
) -> Result<&'p [u32], FrameError> {
    let name = column.name();
    let found = picture.channels.iter().find(|channel| channel.name == name);
    match found.map(|channel| &channel.samples) {
        Some(ExrSamples::U32(samples)) if column.is_integer() => Ok(samples),
        Some(ExrSamples::F32(samples)) if !column.is_integer() => Ok(bytemuck::cast_slice(samples)),
        _ => Err(FrameError::NotAFrame {
            path: path.to_owned(),
            missing: format!("channel {name}"),
        }),
    }
}

#[cfg(test)]
mod tests;
