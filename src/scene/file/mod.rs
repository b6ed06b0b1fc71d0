//! A scene file as written: every key read, every value checked that can be checked without another file.
//!
//! The format is described in docs/scene.md. What is loaded from other files follows in `build`.

mod camera;
mod film;
mod integrator;
mod light;
mod material;
mod mesh;
mod overrides;
mod reader;

use std::path::{Path, PathBuf};

use super::error::{AssetError, Place, SceneError};
use super::{Film, Integrator};
use crate::files::input;
pub(super) use camera::{CameraChoice, CameraTable, LensTable, ProjectionTable};
pub(crate) use film::{MAX_SIDE, MAX_SPP, MAX_STOPS, fits, too_many_pixels};
pub(super) use light::{LightTable, default_sun};
pub(super) use material::{
    ColorTable, DetailTable, MaterialTable, ScalarTable, ScalarTextureTable, TextureTable,
};
pub(super) use mesh::{DisplacementTable, MeshTable, SCALE, Subdivision, TEXCOORDS};
pub(super) use overrides::OPTION;
use overrides::Override;
use reader::{Item, Section, Source};

/// The least step of a march in texels, and the largest: beyond, a ray would take minutes or see nothing.
pub(crate) const STEP_TEXELS: std::ops::RangeInclusive<f32> = 1e-3..=1e6;

/// A whole scene file.
#[derive(Debug)]
pub(super) struct SceneFile {
    pub camera: CameraTable,
    pub film: Film,
    pub meshes: Vec<MeshTable>,
    pub materials: Vec<MaterialTable>,
    pub lights: Vec<LightTable>,
    pub integrator: Integrator,
}

/// A value that a later step may still refuse: it remembers its key and place.
#[derive(Clone, Debug)]
pub(super) struct Keyed<T> {
    pub value: T,
    key: String,
    place: Box<Place>,
}

impl<T> Keyed<T> {
    /// The error "found this, expected that" at this value.
    pub fn refuse(&self, found: impl Into<String>, expected: impl Into<String>) -> SceneError {
        SceneError::Value {
            place: self.place.clone(),
            key: self.key.clone(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// Another value at the same place.
    pub fn with<U>(&self, value: U) -> Keyed<U> {
        Keyed {
            value,
            key: self.key.clone(),
            place: self.place.clone(),
        }
    }

    /// The error that the file named here was refused.
    pub fn asset(&self, source: impl Into<AssetError>) -> SceneError {
        SceneError::Asset {
            place: self.place.clone(),
            key: self.key.clone(),
            source: Box::new(source.into()),
        }
    }
}

impl SceneFile {
    /// Reads the file at `path`, with `overrides` (`key=value`) laid over it.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let text = input::read_text(path).map_err(|source| SceneError::Read {
            path: path.to_owned(),
            source,
        })?;
        Self::parse_with(path, &text, overrides)
    }

    /// Reads the text of a scene file; `path` is for messages and to find the files it names.
    pub fn parse_with(path: &Path, text: &str, overrides: &[String]) -> Result<Self, SceneError> {
        let overrides = Override::all(text.len(), overrides);
        let source = Source {
            file: path,
            text,
            overrides: &overrides,
        };
        let mut root =
            source.parse(&["camera", "film", "mesh", "material", "light", "integrator"])?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Ok(Self {
            camera: root
                .optional("camera", CameraTable::read)?
                .unwrap_or_default(),
            film: root.optional("film", film::film)?.unwrap_or_default(),
            meshes: tables(&mut root, "mesh", |item| MeshTable::read(item, folder))?,
            materials: tables(&mut root, "material", |item| {
                MaterialTable::read(item, folder)
            })?,
            lights: tables(&mut root, "light", |item| LightTable::read(item, folder))?,
            integrator: root
                .optional("integrator", integrator::read)?
                .unwrap_or_default(),
        })
        .and_then(|scene| scene.checked(&root))
    }

    fn checked(self, root: &Section) -> Result<Self, SceneError> {
        if self.meshes.is_empty() {
            return Err(SceneError::Value {
                place: root.place(),
                key: "mesh".into(),
                found: "nothing".into(),
                expected: "at least one [[mesh]]".into(),
            });
        }
        for (index, material) in self.materials.iter().enumerate() {
            let name = &material.name;
            if self.materials[..index]
                .iter()
                .any(|m| m.name.value == name.value)
            {
                let found = format!("{:?} for a second time", name.value);
                return Err(name.refuse(found, "a name of its own for every [[material]]"));
            }
        }
        Ok(self)
    }
}

/// Reads `[[key]]`, none if there is none.
fn tables<'a, T>(
    root: &mut Section<'a>,
    key: &str,
    read: impl Fn(Item<'a>) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    let Some(item) = root.get(key) else {
        return Ok(Vec::new());
    };
    let expected = format!("tables, each begun by [[{key}]]");
    item.items(&expected)?.into_iter().map(read).collect()
}

/// A path relative to the scene file.
fn file_path(item: &Item, folder: &Path) -> Result<Keyed<PathBuf>, SceneError> {
    let path = item.text("the path of a file, in quotes")?;
    Ok(keyed(item, folder.join(path)))
}

fn keyed<T>(item: &Item, value: T) -> Keyed<T> {
    Keyed {
        value,
        key: item.name().to_owned(),
        place: item.place(),
    }
}

/// A word that [`crate::surface::Wrap`] knows.
fn wrap(item: Item) -> Result<crate::surface::Wrap, SceneError> {
    use crate::surface::Wrap;
    item.word(&[
        ("repeat", Wrap::Repeat),
        ("clamp", Wrap::Clamp),
        ("mirror", Wrap::Mirror),
    ])
}

/// The same word for both axes, or one across and one up.
fn wraps(item: Item) -> Result<[crate::surface::Wrap; 2], SceneError> {
    if !item.is_array() {
        return Ok([wrap(item)?; 2]);
    }
    let expected = "a word, or two for across and up, like [\"repeat\", \"clamp\"]";
    let wrong = item.refuse(expected);
    let words: Vec<_> = item.items(expected)?;
    let words = words.into_iter().map(wrap).collect::<Result<Vec<_>, _>>()?;
    words.try_into().map_err(|_| wrong)
}

/// `{ scale, rotate, offset }`, all optional.
fn uv_transform(item: Item) -> Result<crate::surface::UvTransform, SceneError> {
    let mut section = item.section(&["scale", "rotate", "offset"])?;
    let mut uv = crate::surface::UvTransform::default();
    if let Some(scale) = section.optional("scale", |i| i.vec2("[across, up], two numbers"))? {
        uv.scale = scale;
    }
    if let Some(degrees) = section.optional("rotate", |i| i.number("degrees", |_| true))? {
        uv.rotation = degrees.to_radians();
    }
    if let Some(offset) = section.optional("offset", |i| i.vec2("[across, up], two numbers"))? {
        uv.offset = offset;
    }
    Ok(uv)
}

/// A channel of a picture.
fn channel(item: Item) -> Result<crate::image::Channel, SceneError> {
    let expected = "\"luminance\", \"r\", \"g\", \"b\", \"a\" or the name of an EXR channel";
    let Ok(channel) = item.text(expected)?.parse();
    Ok(channel)
}

/// A factor of at least 0.
fn factor(item: Item) -> Result<f32, SceneError> {
    item.number("a factor of at least 0", |x| x >= 0.0)
}

/// A number from 0 to 1.
fn fraction(item: Item) -> Result<f32, SceneError> {
    item.number("a number from 0 to 1", |x| (0.0..=1.0).contains(&x))
}

#[cfg(test)]
mod tests;
