//! Pictures by file, each loaded once however often a scene names it.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

use super::MapFile;
use crate::image::{
    self, Channel, ColorImage, ColorPixels, ColorSpace, EnvironmentImage, ImageError, ScalarImage,
};
use crate::scene::error::AssetError;
use crate::surface::{DisplacementMap, Wrap};

/// A channel of a picture, and how it goes on outside.
type ChannelKey<File, Wraps> = (File, Channel, Wraps);

/// A picture, what its numbers mean, and what they are multiplied by.
type ColorKey<File> = (File, ColorSpace, Vec3);

/// What was loaded, and by what it is known again.
type Loaded<Key, Asset> = Vec<(Key, Arc<Asset>)>;

/// What has been loaded so far.
#[derive(Default)]
pub(super) struct Assets {
    heights: Loaded<ChannelKey<PathBuf, Wrap>, DisplacementMap>,
    scalars: Loaded<ChannelKey<PathBuf, [Wrap; 2]>, ScalarImage>,
    colors: Loaded<ColorKey<PathBuf>, ColorImage>,
    embedded_colors: Loaded<ColorKey<Arc<[u8]>>, ColorImage>,
    embedded_scalars: Loaded<ChannelKey<Arc<[u8]>, [Wrap; 2]>, ScalarImage>,
    environments: Loaded<PathBuf, EnvironmentImage>,
}

impl Assets {
    /// A channel of a picture as displacement map.
    pub fn heights(
        &mut self,
        path: &Path,
        channel: &Channel,
        wrap: Wrap,
    ) -> Result<Arc<DisplacementMap>, AssetError> {
        let key = (identity(path), channel.clone(), wrap);
        once(&mut self.heights, key, || {
            image::load_heights(path, channel, wrap)
        })
    }

    /// A channel of a picture as a parameter of a material; apart from the heights, which are reported and edited.
    pub fn scalar(
        &mut self,
        path: &Path,
        channel: &Channel,
        wrap: [Wrap; 2],
    ) -> Result<Arc<ScalarImage>, AssetError> {
        let key = (identity(path), channel.clone(), wrap);
        once(&mut self.scalars, key, || {
            image::load_scalar(path, channel, wrap)
        })
    }

    /// A colour picture, times `tint`.
    pub fn color(
        &mut self,
        path: &Path,
        space: ColorSpace,
        tint: Vec3,
    ) -> Result<Arc<ColorImage>, AssetError> {
        let key = (identity(path), space, tint);
        once(&mut self.colors, key, || {
            Ok::<_, ImageError>(tinted(image::load_color(path, space)?, tint))
        })
    }

    /// The picture that the mesh file at `path` holds, times `tint`.
    pub fn embedded_color(
        &mut self,
        path: &Path,
        bytes: &Arc<[u8]>,
        space: ColorSpace,
        tint: Vec3,
    ) -> Result<Arc<ColorImage>, AssetError> {
        let key = (bytes.clone(), space, tint);
        once(&mut self.embedded_colors, key, || {
            let image = unpacked(path, bytes, |file| image::load_color(file, space))?;
            Ok::<_, AssetError>(tinted(image, tint))
        })
    }

    /// A channel of the picture that the mesh file at `path` holds.
    pub fn embedded_scalar(
        &mut self,
        path: &Path,
        bytes: &Arc<[u8]>,
        channel: &Channel,
        wrap: [Wrap; 2],
    ) -> Result<Arc<ScalarImage>, AssetError> {
        let key = (bytes.clone(), channel.clone(), wrap);
        once(&mut self.embedded_scalars, key, || {
            unpacked(path, bytes, |file| image::load_scalar(file, channel, wrap))
        })
    }

    /// An equirectangular light.
    pub fn environment(&mut self, path: &Path) -> Result<Arc<EnvironmentImage>, AssetError> {
        once(&mut self.environments, identity(path), || {
            image::load_environment(path)
        })
    }

    /// The displacement maps, in the order of their first use.
    pub fn into_maps(self) -> Vec<MapFile> {
        let maps = self.heights.into_iter();
        maps.map(|((path, ..), map)| MapFile { path, map })
            .collect()
    }
}

/// What `known` has for `key`, else what `load` gives. A scene names few files: no hashing is needed.
fn once<K: PartialEq, T, E: Into<AssetError>>(
    known: &mut Loaded<K, T>,
    key: K,
    load: impl FnOnce() -> Result<T, E>,
) -> Result<Arc<T>, AssetError> {
    if let Some((_, asset)) = known.iter().find(|(k, _)| *k == key) {
        return Ok(asset.clone());
    }
    let asset = Arc::new(load().map_err(Into::into)?);
    known.push((key, asset.clone()));
    Ok(asset)
}

/// The same for every way to write a path; the path as it is where the file does not exist.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// What `load` makes of a picture that the mesh file at `path` holds: its readers want a file.
fn unpacked<T>(
    path: &Path,
    bytes: &[u8],
    load: impl FnOnce(&Path) -> Result<T, ImageError>,
) -> Result<T, AssetError> {
    let unpacked = tempfile::NamedTempFile::new().and_then(|mut file| {
        file.write_all(bytes)?;
        Ok(file)
    });
    let unpacked = unpacked.map_err(|source| AssetError::Unpack {
        path: path.to_owned(),
        source,
    })?;
    load(unpacked.path()).map_err(|source| AssetError::Embedded {
        path: path.to_owned(),
        source,
    })
}

fn tinted(image: ColorImage, tint: Vec3) -> ColorImage {
    if tint == Vec3::ONE {
        return image;
    }
    let (width, height) = (image.width, image.height);
    let pixels = (0..width * height).map(|i| (tint * image.pixel(i % width, i / width)).to_array());
    ColorImage {
        width,
        height,
        pixels: ColorPixels::Linear(pixels.collect()),
    }
}
