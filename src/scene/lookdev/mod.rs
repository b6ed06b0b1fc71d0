//! One mesh and its maps as a scene, for a first look: framed by a camera, under sun and sky, perhaps on a floor.
//!
//! The scene is made as the text of a scene file and loaded like one, so that what is saved is what is rendered. First a draft of it is
//! loaded, with whatever the command line says; from its mesh and map come the scale, the camera and the floor's place.

mod error;
mod scale;
mod text;
mod textures;
mod view;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::build::{Assets, displaced, reach};
use super::file::SceneFile;
use super::load::LoadOptions;
use super::{AssetError, Loaded, ObjectShape, Scene, SceneError, SceneObject};
use crate::image::ImageError;
use crate::prism::{PrismOptions, Prisms};
use crate::ray::Aabb;
use crate::surface::{Displacement, Projection, SurfaceError, Wrap};
pub use error::LookdevError;
use scale::{Scale, guess};
use text::Numbers;
pub use textures::TextureSet;
pub use view::View;
use view::{facing, fit};

/// A mesh, its maps, and how they are to be looked at.
#[derive(Clone, Debug)]
pub struct Lookdev {
    /// The mesh file.
    pub mesh: PathBuf,
    /// Normals are computed even where the file has some.
    pub smooth_normals: bool,
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

/// A scene whose scale, camera and floor are still missing. What is changed of its film, its integrator and how its surface is traced
/// goes into the finished scene.
pub struct Draft<'a> {
    request: &'a Lookdev,
    place: Place<'a>,
    overrides: &'a [String],
    options: LoadOptions,
    loaded: Loaded,
    assets: Assets,
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

impl Draft<'_> {
    /// The scene so far.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.loaded.scene
    }

    /// Guesses, frames, and loads the scene as it is then; maps are not read again.
    ///
    /// # Errors
    ///
    /// A file that has changed meanwhile; a surface that cannot be displaced so far; a camera below the floor.
    pub fn finish(self) -> Result<Made, LookdevError> {
        let request = self.request;
        let scale = self.scale();
        let boxes = self.boxes(&scale)?;
        let whole = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let front = request.view.bearing(facing(self.subject()));
        let Scene { film, camera, .. } = &self.loaded.scene;
        let aspect = film.width as f32 / film.height as f32;
        let bearing = front.turned(request.orbit);
        let framing = fit(&boxes, bearing, (0.5 * camera.fov).tan(), aspect);
        if request.floor && framing.position.y <= whole.min.y {
            return Err(LookdevError::BelowFloor);
        }
        let middle = 0.5 * (whole.min + whole.max);
        let numbers = Numbers {
            framing: Some(framing),
            size: whole.diagonal(),
            foot: middle.with_y(whole.min.y),
            azimuth: front.azimuth,
            has_materials: self.loaded.default_material.is_none(),
            film: *film,
            integrator: self.loaded.scene.integrator,
            prisms: self.prisms(),
            scale,
        };
        let text = text::scene(request, &numbers, self.place.folder())?;
        let (loaded, _) =
            request.load(&text, self.place, self.overrides, self.options, self.assets)?;
        Ok(Made {
            loaded,
            text,
            notes: notes(request, &numbers.scale),
        })
    }

    /// The mesh's objects; the floor is the last of the scene's.
    fn subject(&self) -> &[SceneObject] {
        let objects = &self.loaded.scene.objects;
        &objects[..objects.len() - usize::from(self.request.floor)]
    }

    fn check_texcoords(&self) -> Result<(), LookdevError> {
        if !self.request.maps.has_picture() {
            return Ok(());
        }
        let mut objects = self.subject().iter();
        let bare = objects.find(|object| match &object.shape {
            ObjectShape::Displaced(..) => false, // or there would be none
            ObjectShape::Plain(mesh) => mesh.texcoords().is_empty(),
        });
        bare.map_or(Ok(()), |object| {
            Err(self.request.no_texcoords(object.name.clone()))
        })
    }

    /// As given, with the options or laid over the scene, else guessed.
    fn scale(&self) -> Scale {
        let request = self.request;
        let surfaces = self
            .subject()
            .iter()
            .filter_map(|object| match &object.shape {
                ObjectShape::Displaced(surface, _) => Some(surface),
                ObjectShape::Plain(_) => None,
            });
        let size = self.subject().iter().map(|object| match &object.shape {
            ObjectShape::Displaced(surface, _) => surface.mesh().bounds(),
            ObjectShape::Plain(mesh) => mesh.bounds(),
        });
        let size = size.fold(Aabb::EMPTY, Aabb::union).diagonal();
        let Some(surface) = surfaces.into_iter().next() else {
            return Scale {
                scale: 1.0,
                midlevel: 0.0,
                why: None,
            };
        };
        let Displacement {
            scale, midlevel, ..
        } = *surface.displacement();
        let laid = Some(midlevel).filter(|&midlevel| midlevel != 0.0);
        guess(
            surface.map(),
            size,
            (
                Some(scale).filter(|&scale| scale != OPEN_SCALE),
                request.midlevel.or(laid),
            ),
        )
    }

    /// How the surface is traced, as it has been changed.
    fn prisms(&self) -> PrismOptions {
        let mut objects = self.subject().iter();
        let options = objects.find_map(|object| match object.shape {
            ObjectShape::Displaced(_, options) => Some(options),
            ObjectShape::Plain(_) => None,
        });
        options.unwrap_or_default()
    }

    /// Boxes around everything where it stands: blocks of displaced surfaces, vertices of others.
    fn boxes(&self, scale: &Scale) -> Result<Vec<Aabb>, LookdevError> {
        /// Of more of them each object's whole box is taken, wherever it stands.
        const MOST: usize = 1 << 20;
        let mut boxes = Vec::new();
        for object in self.subject() {
            let own: Vec<Aabb> = match &object.shape {
                ObjectShape::Displaced(surface, _) => {
                    let displacement = Displacement {
                        scale: scale.scale,
                        midlevel: scale.midlevel,
                        ..*surface.displacement()
                    };
                    let map = (self.request.map(), surface.map());
                    let mesh = surface.mesh().clone();
                    let surface = displaced(&object.name, mesh, map, displacement)?;
                    let prisms = Prisms::new(Arc::new(surface), PrismOptions::default())?;
                    // A block's own box is wide where normals all but cancel each other.
                    let farthest = reach(prisms.surface());
                    let blocks = (0..prisms.len() as u32).map(|p| prisms.bounds(p));
                    blocks.map(|block| block.intersection(farthest)).collect()
                }
                ObjectShape::Plain(mesh) => {
                    let points = mesh.positions().iter();
                    points.map(|&p| Aabb { min: p, max: p }).collect()
                }
            };
            if object.instances.is_empty() {
                boxes.extend(own);
                continue;
            }
            let own = if own.len().saturating_mul(object.instances.len()) > MOST {
                vec![own.into_iter().fold(Aabb::EMPTY, Aabb::union)]
            } else {
                own
            };
            for transform in &object.instances {
                boxes.extend(own.iter().map(|b| {
                    let corners = b.corners().map(|p| transform.transform_point3(p));
                    corners.into_iter().fold(Aabb::EMPTY, Aabb::including)
                }));
            }
        }
        Ok(boxes)
    }
}

impl Lookdev {
    /// The displacement map, for messages.
    fn map(&self) -> &Path {
        self.maps.displacement.as_deref().unwrap_or(Path::new(""))
    }
}

/// What was guessed, and what stands beside it.
fn notes(request: &Lookdev, scale: &Scale) -> Vec<String> {
    let mut notes = Vec::new();
    if request.maps.displacement.is_none() {
        return notes;
    }
    if let Scale {
        scale,
        midlevel,
        why: Some(why),
    } = scale
    {
        let from = match request.midlevel {
            None if *midlevel != 0.0 => format!(", midlevel {midlevel}"),
            _ => String::new(),
        };
        notes.push(format!(
            "displacement scale {scale}{from} ({why}; --scale sets it)"
        ));
    }
    if request.maps.normal_map.is_some() {
        notes.push(
            "the normal map bends normals on top of the displacement; where both have the same relief it counts twice \
             (--normal-map none leaves it out)"
                .into(),
        );
    }
    notes
}
