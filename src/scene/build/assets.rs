//! Pictures by file, each loaded once however often a scene names it.

use std::collections::HashMap;
use std::hash::Hash;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

use super::MapFile;
use crate::image::{
    self, Channel, ColorImage, ColorPixels, ColorSpace, EnvironmentImage, ImageError,
};
use crate::scene::error::AssetError;
use crate::surface::{DisplacementMap, Wrap};

/// What has been loaded so far.
#[derive(Default)]
pub(super) struct Assets {
    heights: HashMap<(PathBuf, String, Wrap), Arc<DisplacementMap>>,
    colors: HashMap<(PathBuf, ColorSpace, [u32; 3]), Arc<ColorImage>>,
    environments: HashMap<PathBuf, Arc<EnvironmentImage>>,
}

impl Assets {
    /// A channel of a picture as displacement map.
    pub fn heights(
        &mut self,
        path: &Path,
        channel: &Channel,
        wrap: Wrap,
    ) -> Result<Arc<DisplacementMap>, AssetError> {
        let key = (identity(path), channel.to_string(), wrap);
        once(&mut self.heights, key, || image::load_heights(path, channel, wrap))
    }

    /// A colour picture, times `tint`.
    pub fn color(
        &mut self,
        path: &Path,
        space: ColorSpace,
        tint: Vec3,
    ) -> Result<Arc<ColorImage>, AssetError> {
        let key = (identity(path), space, tint.to_array().map(f32::to_bits));
        once(&mut self.colors, key, || {
            Ok(tinted(image::load_color(path, space)?, tint))
        })
    }

    /// An equirectangular light.
    pub fn environment(&mut self, path: &Path) -> Result<Arc<EnvironmentImage>, AssetError> {
        once(&mut self.environments, identity(path), || {
            image::load_environment(path)
        })
    }

    /// The displacement maps, in the order of their paths.
    pub fn into_maps(self) -> Vec<MapFile> {
        let file = |((path, ..), map)| MapFile { path, map };
        let mut maps: Vec<_> = self.heights.into_iter().map(file).collect();
        maps.sort_by(|a, b| a.path.cmp(&b.path));
        maps
    }
}

fn once<K: Eq + Hash, T>(
    loaded: &mut HashMap<K, Arc<T>>,
    key: K,
    load: impl FnOnce() -> Result<T, ImageError>,
) -> Result<Arc<T>, AssetError> {
    if let Some(known) = loaded.get(&key) {
        return Ok(known.clone());
    }
    let new = Arc::new(load()?);
    loaded.insert(key, new.clone());
    Ok(new)
}

/// The same for every way to write a path; the path as it is where the file does not exist.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// The sRGB picture that the mesh file at `path` holds, times `tint`.
pub(super) fn embedded_color(
    path: &Path,
    bytes: &[u8],
    tint: Vec3,
) -> Result<Arc<ColorImage>, AssetError> {
    let unpacked = tempfile::NamedTempFile::new().and_then(|mut file| {
        file.write_all(bytes)?;
        Ok(file)
    });
    let unpacked = unpacked.map_err(|source| AssetError::Unpack {
        path: path.to_owned(),
        source,
    })?;
    match image::load_color(unpacked.path(), ColorSpace::Srgb) {
        Ok(image) => Ok(Arc::new(tinted(image, tint))),
        Err(source) => Err(AssetError::Embedded {
            path: path.to_owned(),
            source,
        }),
    }
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
