//! Pictures by file, each loaded once however often a scene names it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;

use super::MapFile;
use crate::image::{
    self, Channel, ColorImage, ColorPixels, ColorSpace, EnvironmentImage, ImageError, ScalarImage,
    Source,
};
use crate::scene::error::AssetError;
use crate::scene::load::FileTexture;
use crate::surface::{DisplacementMap, Wrap};

/// A picture that a scene or a mesh file names.
#[derive(Clone, Copy)]
pub(in crate::scene) enum Picture<'a> {
    File(&'a Path),
    /// Inside of the mesh file `mesh`.
    Embedded {
        mesh: &'a Path,
        name: &'a str,
        bytes: &'a [u8],
    },
}

/// Tells pictures apart: the file, and which of those inside of it.
type PictureKey = (PathBuf, Option<String>);

/// A channel of a picture, and how it goes on outside.
type ChannelKey = (PictureKey, Channel, [Wrap; 2]);

/// A displacement map, and the height of texels without data.
type HeightsKey = (PathBuf, Channel, Wrap, Option<f32>);

/// What has been loaded so far.
#[derive(Clone, Default)]
pub(in crate::scene) struct Assets {
    heights: Vec<(HeightsKey, Arc<DisplacementMap>)>,
    scalars: Vec<(ChannelKey, Arc<ScalarImage>)>,
    colors: Vec<((PictureKey, ColorSpace, Vec3), Arc<ColorImage>)>,
    environments: Vec<(PathBuf, Arc<EnvironmentImage>)>,
    stand_in: Option<Arc<ColorImage>>,
}

impl<'a> Picture<'a> {
    /// The picture of a texture of the file `mesh`.
    pub fn of(mesh: &'a Path, texture: &'a FileTexture) -> Self {
        match texture {
            FileTexture::Path(path) => Self::File(path),
            FileTexture::Embedded { name, bytes } => Self::Embedded { mesh, name, bytes },
        }
    }

    fn key(self) -> PictureKey {
        match self {
            Self::File(path) => (identity(path), None),
            Self::Embedded { mesh, name, .. } => (identity(mesh), Some(name.to_owned())),
        }
    }

    fn source(self) -> Source<'a> {
        match self {
            Self::File(path) => Source::File(path),
            Self::Embedded { name, bytes, .. } => Source::Memory {
                name: Path::new(name),
                bytes,
            },
        }
    }

    fn refused(self, source: ImageError) -> AssetError {
        match self {
            Self::File(_) => AssetError::Image(source),
            Self::Embedded { mesh, .. } => AssetError::Embedded {
                path: mesh.to_owned(),
                source,
            },
        }
    }
}

impl Assets {
    /// A channel of a picture as displacement map; `nodata` is the height of texels without.
    pub fn heights(
        &mut self,
        path: &Path,
        channel: &Channel,
        wrap: Wrap,
        nodata: Option<f32>,
    ) -> Result<Arc<DisplacementMap>, AssetError> {
        let key = (identity(path), channel.clone(), wrap, nodata);
        once(&mut self.heights, key, || {
            Ok(image::load_heights(path, channel, wrap, nodata)?)
        })
    }

    /// A channel of a picture as a parameter of a material; apart from the heights, which are reported and edited.
    pub fn scalar(
        &mut self,
        picture: Picture,
        channel: &Channel,
        wrap: [Wrap; 2],
    ) -> Result<Arc<ScalarImage>, AssetError> {
        once(
            &mut self.scalars,
            (picture.key(), channel.clone(), wrap),
            || image::load_scalar(picture.source(), channel, wrap).map_err(|e| picture.refused(e)),
        )
    }

    /// A colour picture, times `tint`.
    pub fn color(
        &mut self,
        picture: Picture,
        space: ColorSpace,
        tint: Vec3,
    ) -> Result<Arc<ColorImage>, AssetError> {
        once(&mut self.colors, (picture.key(), space, tint), || {
            let image = image::load_color(picture.source(), space);
            Ok(tinted(image.map_err(|e| picture.refused(e))?, tint))
        })
    }

    /// An equirectangular light.
    pub fn environment(&mut self, path: &Path) -> Result<Arc<EnvironmentImage>, AssetError> {
        once(&mut self.environments, identity(path), || {
            Ok(image::load_environment(path)?)
        })
    }

    /// What is shown for a colour picture that cannot be read: no one takes it for the real one.
    pub fn stand_in(&mut self) -> Arc<ColorImage> {
        /// Pixels per cell, so that its edges stay sharp though pixels are bilinear.
        const CELL: usize = 16;
        const SIDE: usize = 8 * CELL;
        let checker = || {
            let color = |i: usize| match (i % SIDE / CELL + i / SIDE / CELL) % 2 {
                0 => [255, 0, 255],
                _ => [0, 0, 0],
            };
            Arc::new(ColorImage {
                width: SIDE,
                height: SIDE,
                pixels: ColorPixels::Srgb8((0..SIDE * SIDE).map(color).collect()),
            })
        };
        self.stand_in.get_or_insert_with(checker).clone()
    }

    /// The picture files that have been read, some perhaps more than once.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let heights = self.heights.iter().map(|((path, ..), _)| path);
        let scalars = self.scalars.iter().map(|(((path, _), ..), _)| path);
        let colors = self.colors.iter().map(|(((path, _), ..), _)| path);
        let environments = self.environments.iter().map(|(path, _)| path);
        let all = heights.chain(scalars).chain(colors).chain(environments);
        all.map(PathBuf::as_path)
    }

    /// The displacement maps, in the order of their first use.
    pub fn into_maps(self) -> Vec<MapFile> {
        let maps = self.heights.into_iter();
        maps.map(|((path, ..), map)| MapFile { path, map })
            .collect()
    }
}

/// What `known` has for `key`, else what `load` gives. A scene names few files: no hashing is needed.
fn once<K: PartialEq, T>(
    known: &mut Vec<(K, Arc<T>)>,
    key: K,
    load: impl FnOnce() -> Result<T, AssetError>,
) -> Result<Arc<T>, AssetError> {
    if let Some((_, asset)) = known.iter().find(|(k, _)| *k == key) {
        return Ok(asset.clone());
    }
    let asset = Arc::new(load()?);
    known.push((key, asset.clone()));
    Ok(asset)
}

/// The same for every way to write a path; the path as it is where the file does not exist.
fn identity(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
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
