//! One mesh and its maps as a scene, for a first look: framed by a camera, under sun and sky, perhaps on a floor.
//!
//! The scene is made as the text of a scene file and loaded like one, so that what is saved is what is rendered. First a draft of it is
//! loaded, with whatever the command line says; from its mesh and map come the scale, the camera and the floor's place.

mod draft;
mod error;
mod scale;
mod text;
mod textures;
mod value;
mod view;

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3};

use super::build::Assets;
use super::file::SceneFile;
use super::load::LoadOptions;
use super::{AssetError, Loaded, SceneError};
use crate::image::ImageError;
use crate::prism::PrismOptions;
use crate::surface::{Projection, SurfaceError, Wrap};
pub use draft::Draft;
pub use error::LookdevError;
use scale::Scale;
use text::Numbers;
pub use textures::TextureSet;
pub use view::View;

/// A mesh, its maps, and how they are to be looked at.
#[derive(Clone, Debug)]
pub struct Lookdev {
    /// The mesh file.
    pub mesh: PathBuf,
    /// Normals are computed even where the file has some.
    pub smooth_normals: bool,
    /// How often the mesh is refined before it is displaced.
    pub subdivide: Option<u32>,
    /// The file's axis that points up, as scene files have it.
    pub up: Option<String>,
    /// What one unit of the file is: a number or a word, as scene files have it.
    pub unit: Option<String>,
    /// Texture coordinates instead of the file's.
    pub texcoords: Option<Projection>,
    /// Pictures, all laid on alike.
    pub maps: Maps,
    /// Which channel of the displacement map.
    pub channel: Option<String>,
    /// The maps outside of [0, 1].
    pub wrap: Wrap,
    /// The height of texels without one.
    pub nodata: Option<f32>,
    /// How often the maps repeat across and up for once of the texture coordinates.
    pub uv_scale: Vec2,
    /// World units from height 0 to height 1; guessed if there is none.
    pub scale: Option<f32>,
    /// The height that stays on the mesh.
    pub midlevel: Option<f32>,
    /// The side that is seen.
    pub view: View,
    /// Turns the camera from there: azimuth and elevation, degrees.
    pub orbit: [f32; 2],
    /// What lights it.
    pub light: Light,
    /// Whether it stands on a floor.
    pub floor: bool,
}

/// The pictures of a surface.
#[derive(Clone, Debug, Default)]
pub struct Maps {
    /// Heights.
    pub displacement: Option<PathBuf>,
    /// Colours.
    pub base_color: Option<PathBuf>,
    /// 0 mirror to 1.
    pub roughness: Option<Amount>,
    /// 0 dielectric to 1 metal.
    pub metallic: Option<Amount>,
    /// Tangent-space normals, green up.
    pub normal_map: Option<PathBuf>,
}

/// A parameter of the material.
#[derive(Clone, Debug, PartialEq)]
pub enum Amount {
    /// The same everywhere.
    Number(f32),
    /// By a picture.
    File(PathBuf),
}

/// What lights the mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A sun from the left of the view, and the sky around it.
    Daylight,
    /// An equirectangular picture, EXR or Radiance HDR.
    Environment(PathBuf),
}

impl Maps {
    /// Whether they make a material, in place of the mesh file's.
    fn has_look(&self) -> bool {
        self.base_color.is_some()
            || self.roughness.is_some()
            || self.metallic.is_some()
            || self.normal_map.is_some()
    }

    /// Whether any is laid on by texture coordinates.
    fn has_picture(&self) -> bool {
        let is_file = |amount: &Option<Amount>| matches!(amount, Some(Amount::File(_)));
        let files = [&self.displacement, &self.base_color, &self.normal_map];
        files.iter().any(|file| file.is_some())
            || is_file(&self.roughness)
            || is_file(&self.metallic)
    }
}

/// Where the scene file is, or would be.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// It is going to be saved here: it names other files as seen from there.
    Saved(&'a Path),
    /// It is not kept: files are named as they were given.
    Nowhere,
}

/// A scene that was made, and its file.
#[derive(Debug)]
pub struct Made {
    /// The scene.
    pub loaded: Loaded,
    /// The scene file's text: what it loads as is `loaded`, but for values that were laid over it.
    pub text: String,
    /// What was guessed, one line each.
    pub notes: Vec<String>,
}

/// The scale of a draft's displacement: known again from any that a user would lay over it.
const OPEN_SCALE: f32 = 1.0 + f32::EPSILON;

impl Lookdev {
    /// Loads the mesh and its maps. `overrides` are as in [`Loaded::from_file_with`].
    ///
    /// # Errors
    ///
    /// A file that is refused; a mesh without texture coordinates under a map; a name that no scene file can hold.
    pub fn draft<'a>(
        &'a self,
        place: Place<'a>,
        overrides: &'a [String],
        options: LoadOptions,
    ) -> Result<Draft<'a>, LookdevError> {
        let open = Numbers {
            scale: Scale {
                scale: self.scale.unwrap_or(OPEN_SCALE),
                midlevel: self.midlevel.unwrap_or(0.0),
                why: None,
            },
            framing: None,
            size: 1.0,
            foot: Vec3::ZERO,
            azimuth: 0.0,
            has_materials: true,
            film: Default::default(),
            integrator: Default::default(),
            prisms: PrismOptions::default(),
        };
        let text = text::scene(self, &open, place.folder())?;
        let (loaded, assets) = self.load(&text, place, overrides, options, Assets::default())?;
        let draft = Draft {
            request: self,
            place,
            overrides,
            options,
            loaded,
            assets,
        };
        draft.check_texcoords()?;
        Ok(draft)
    }

    fn load(
        &self,
        text: &str,
        place: Place,
        overrides: &[String],
        options: LoadOptions,
        assets: Assets,
    ) -> Result<(Loaded, Assets), LookdevError> {
        let path = place.path(&self.mesh);
        let load = || {
            let file = SceneFile::parse_with(&path, text, overrides)?;
            Loaded::from_scene_file(&path, file, options, assets)
        };
        let (mut loaded, assets) = load().map_err(|error| self.told(error))?;
        loaded.scene.path = self.mesh.clone();
        Ok((loaded, assets))
    }

    /// An error of a scene that the user did not write, in terms of what was asked for.
    fn told(&self, error: SceneError) -> LookdevError {
        if error.is_override() {
            return error.into();
        }
        let SceneError::Asset { source, .. } = error else {
            return error.into();
        };
        match *source {
            AssetError::Surface {
                part,
                source: SurfaceError::MissingTexcoords,
            } => self.no_texcoords(part),
            AssetError::Image(source @ ImageError::ChannelsDisagree { .. })
                if self.channel.is_none() && self.is_displacement(&source) =>
            {
                LookdevError::Colors { source }
            }
            source => source.into(),
        }
    }

    fn is_displacement(&self, error: &ImageError) -> bool {
        let ImageError::ChannelsDisagree { path, .. } = error else {
            return false;
        };
        let map = self.maps.displacement.as_ref().and_then(|p| p.file_name());
        path.file_name() == map
    }

    /// The displacement map, for messages.
    fn map(&self) -> &Path {
        self.maps.displacement.as_deref().unwrap_or(Path::new(""))
    }

    fn no_texcoords(&self, part: String) -> LookdevError {
        LookdevError::NoTexcoords {
            path: self.mesh.clone(),
            part,
        }
    }
}

impl<'a> Place<'a> {
    fn folder(self) -> Option<&'a Path> {
        match self {
            Self::Saved(path) => Some(path.parent().unwrap_or(Path::new(""))),
            Self::Nowhere => None,
        }
    }

    /// What the scene file is called, for messages and to find the files that it names.
    fn path(self, mesh: &Path) -> PathBuf {
        match self {
            Self::Saved(path) => path.to_owned(),
            Self::Nowhere => {
                let stem = mesh.file_stem().unwrap_or_default();
                Path::new(stem).with_extension("toml")
            }
        }
    }
}
