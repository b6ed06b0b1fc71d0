//! The maps of one surface in a folder, known by how their names end, as texture libraries and painting programs write them.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::error::LookdevError;
use crate::files::input;

/// What a map is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Displacement,
    BaseColor,
    Roughness,
    Metallic,
    Normal,
    /// A normal map whose green points down.
    NormalDirectX,
    /// Known, and of no use here.
    Unused,
}

/// How names end, in lower case and without separators.
const SUFFIXES: &[(Role, &[&str])] = &[
    (
        Role::Displacement,
        &["displacement", "disp", "height", "heightmap", "h"],
    ),
    (
        Role::BaseColor,
        &[
            "basecolor",
            "basecolour",
            "albedo",
            "diffuse",
            "diff",
            "color",
            "colour",
            "col",
        ],
    ),
    (Role::Roughness, &["roughness", "rough"]),
    (Role::Metallic, &["metallic", "metalness", "metal"]),
    (
        Role::Normal,
        &[
            "normal",
            "nor",
            "nrm",
            "normalgl",
            "norgl",
            "normalopengl",
            "normalogl",
        ],
    ),
    (Role::NormalDirectX, &["normaldx", "nordx", "normaldirectx"]),
    (
        Role::Unused,
        &[
            "ao",
            "ambientocclusion",
            "occlusion",
            "arm",
            "orm",
            "bump",
            "cavity",
            "curvature",
            "emission",
            "emissive",
            "fuzz",
            "gloss",
            "glossiness",
            "mask",
            "opacity",
            "alpha",
            "rma",
            "spec",
            "specular",
            "translucency",
            "translucent",
        ],
    ),
];

/// Endings of pictures, in lower case.
const PICTURES: [&str; 16] = [
    "bmp", "exr", "hdr", "jpeg", "jpg", "pam", "pbm", "pfm", "pgm", "png", "pnm", "ppm", "tga",
    "tif", "tiff", "webp",
];

/// Parts of one surface, as files; and what else there was.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TextureSet {
    /// Heights.
    pub displacement: Option<PathBuf>,
    /// Colours.
    pub base_color: Option<PathBuf>,
    /// Roughness.
    pub roughness: Option<PathBuf>,
    /// Metalness.
    pub metallic: Option<PathBuf>,
    /// Tangent-space normals, green up.
    pub normal_map: Option<PathBuf>,
    /// Normals with green down, where there are none with green up.
    pub normal_directx: Option<PathBuf>,
    /// Pictures that are not taken.
    pub unused: Vec<PathBuf>,
}

impl TextureSet {
    /// The maps in `folder`, but for those that an option names (`named`, like `--color`).
    ///
    /// A name is cut at `_`, `-`, `.` and blanks; what it ends with says what the map is of, in any case, sizes (`4k`, `2048x2048`) and kinds
    /// of file (`png`) passed over. Of several maps for the same, the one of more than 8 bits is taken, of several such ones the EXR file.
    ///
    /// # Errors
    ///
    /// A folder that cannot be read; none of its pictures is a displacement map by its name; several maps for the same.
    pub fn in_folder(folder: &Path, named: &[&str]) -> Result<Self, LookdevError> {
        let pictures = pictures(folder).map_err(|source| LookdevError::Folder {
            folder: folder.to_owned(),
            source,
        })?;
        let of = |role: Role| -> Vec<&PathBuf> {
            let all = pictures.iter();
            all.filter(|path| role_of(path) == Some(role)).collect()
        };
        let one = |role: Role| -> Result<Option<PathBuf>, LookdevError> {
            if named.contains(&role.option()) {
                return Ok(None);
            }
            chosen(&of(role)).map_err(|several| LookdevError::SeveralMaps {
                folder: folder.to_owned(),
                what: role.name(),
                option: role.option(),
                found: names(several),
            })
        };
        let displacement = one(Role::Displacement)?;
        if displacement.is_none() {
            return Err(LookdevError::NoDisplacementMap {
                folder: folder.to_owned(),
                found: match &pictures[..] {
                    [] => "no pictures".into(),
                    some => names(some.iter().collect()),
                },
            });
        }
        let normal_map = one(Role::Normal)?;
        let mut set = Self {
            displacement,
            base_color: one(Role::BaseColor)?,
            roughness: one(Role::Roughness)?,
            metallic: one(Role::Metallic)?,
            normal_directx: match normal_map {
                None if !named.contains(&Role::NormalDirectX.option()) => {
                    of(Role::NormalDirectX).first().copied().cloned()
                }
                _ => None,
            },
            normal_map,
            unused: Vec::new(),
        };
        let unused = pictures.into_iter();
        set.unused = unused
            .filter(|path| !set.taken().any(|(_, taken)| taken == path))
            .collect();
        Ok(set)
    }

    /// The maps that are taken, each with what it is of.
    pub fn taken(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let all = [
            (Role::Displacement, &self.displacement),
            (Role::BaseColor, &self.base_color),
            (Role::Roughness, &self.roughness),
            (Role::Metallic, &self.metallic),
            (Role::Normal, &self.normal_map),
        ];
        all.into_iter()
            .filter_map(|(role, path)| Some((role.name(), path.as_ref()?)))
    }
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::BaseColor => "color",
            Self::Roughness => "roughness",
            Self::Metallic => "metallic",
            Self::Normal | Self::NormalDirectX => "normals",
            Self::Unused => "nothing here",
        }
    }

    /// By what one of several is named.
    fn option(self) -> &'static str {
        match self {
            Self::Displacement => "--displacement",
            Self::BaseColor => "--color",
            Self::Roughness => "--roughness",
            Self::Metallic => "--metallic",
            Self::Normal | Self::NormalDirectX | Self::Unused => "--normal-map",
        }
    }
}

/// How names of displacement maps end, for messages.
pub(super) fn displacement_suffixes() -> String {
    let suffixes = SUFFIXES[0].1.iter();
    let suffixes: Vec<String> = suffixes.map(|suffix| format!("_{suffix}")).collect();
    suffixes.join(", ")
}

/// All pictures of a folder, by name.
fn pictures(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut pictures = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let is_picture = PICTURES.contains(&&ending.to_lowercase()[..]);
        let is_hidden = path
            .file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_picture && !is_hidden && path.is_file() {
            pictures.push(path);
        }
    }
    pictures.sort();
    Ok(pictures)
}

/// What the end of a file's name says.
fn role_of(path: &Path) -> Option<Role> {
    let stem = path.file_stem()?.to_string_lossy().to_lowercase();
    let words = stem.split(['_', '-', '.', ' ']);
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let telling = words.iter().rposition(|word| !is_passed_over(word))?;
    let words = &words[..=telling];
    // Two words first: "base_color" is no mere color, "nor_dx" no "dx".
    [2, 1].into_iter().find_map(|count| {
        let end: String = words.get(words.len().checked_sub(count)?..)?.concat();
        let mut known = SUFFIXES.iter();
        let (role, _) = known.find(|(_, suffixes)| suffixes.contains(&&end[..]))?;
        Some(*role)
    })
}

/// Whether a word says how large a map is or how it is stored: `4k`, `2048`, `2048x2048`, `16bit`, `png`.
fn is_passed_over(word: &str) -> bool {
    let is_number = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit());
    let counts = |unit: &str| word.strip_suffix(unit).is_some_and(is_number);
    is_number(word)
        || counts("k")
        || counts("bit")
        || word
            .split_once('x')
            .is_some_and(|(a, b)| is_number(a) && is_number(b))
        || PICTURES.contains(&word)
}

/// The one of several maps of the same that is taken, if there is one.
fn chosen<'a>(paths: &[&'a PathBuf]) -> Result<Option<PathBuf>, Vec<&'a PathBuf>> {
    let deep = || paths.iter().copied().filter(|path| is_deep(path));
    let exr = || deep().filter(|path| has_ending(path, "exr"));
    match paths {
        [] => Ok(None),
        [one] => Ok(Some((*one).clone())),
        _ => match (only(deep()), only(exr())) {
            (Some(one), _) | (None, Some(one)) => Ok(Some(one.clone())),
            (None, None) => Err(paths.to_vec()),
        },
    }
}

fn only<T>(mut items: impl Iterator<Item = T>) -> Option<T> {
    let first = items.next()?;
    items.next().is_none().then_some(first)
}

/// Whether a picture has more than 8 bits, as far as its ending and a PNG file's header tell.
fn is_deep(path: &Path) -> bool {
    /// Where a PNG file has its bits per sample.
    const DEPTH: usize = 24;
    if !has_ending(path, "png") {
        return ["exr", "hdr", "pfm", "tif", "tiff"]
            .iter()
            .any(|ending| has_ending(path, ending));
    }
    let mut start = [0; DEPTH + 1];
    let read = input::open(path).and_then(|mut file| file.read_exact(&mut start));
    read.is_ok() && start[DEPTH] == 16
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension()
        .is_some_and(|found| found.to_string_lossy().eq_ignore_ascii_case(ending))
}

/// Names of files, for messages; no more than a screen's.
fn names(paths: Vec<&PathBuf>) -> String {
    const SHOWN: usize = 12;
    let name = |path: &&PathBuf| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let mut shown: Vec<String> = paths.iter().take(SHOWN).map(name).collect();
    if let Some(more) = paths.len().checked_sub(SHOWN).filter(|&n| n > 0) {
        shown.push(format!("and {more} more"));
    }
    shown.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{write_png_gray16, write_png_rgb8};

    #[test]
    fn names_of_texture_libraries_are_known() {
        for (name, role) in [
            ("rock_wall_disp_4k.png", Role::Displacement),
            ("Rock035_2K-PNG_Displacement.png", Role::Displacement),
            ("xyzabc_4K_Displacement.exr", Role::Displacement),
            ("leather.height.tif", Role::Displacement),
            ("Leather Height.tif", Role::Displacement),
            ("heightmap.png", Role::Displacement),
            ("bark-H.png", Role::Displacement),
            ("rock_wall_diff_4k.jpg", Role::BaseColor),
            ("Rock035_2K-PNG_Color.png", Role::BaseColor),
            ("rock_Base_Color.png", Role::BaseColor),
            ("rock_BaseColor_2048x2048.png", Role::BaseColor),
            ("rock_wall_rough_4k.exr", Role::Roughness),
            ("rock_wall_nor_gl_4k.exr", Role::Normal),
            ("Rock035_2K-PNG_NormalGL.png", Role::Normal),
            ("Rock035_2K-PNG_NormalDX.png", Role::NormalDirectX),
            ("rock_Normal_DirectX.png", Role::NormalDirectX),
            ("rock_metalness_16bit.png", Role::Metallic),
            ("rock_wall_ao_4k.jpg", Role::Unused),
            ("rock_bump.png", Role::Unused),
        ] {
            assert_eq!(role_of(Path::new(name)), Some(role), "{name}");
        }
        for name in [
            "rock.png",
            "4k.png",
            "height_rock.png",
            "",
            "_.png",
            "Rock035.png",
        ] {
            assert_eq!(role_of(Path::new(name)), None, "{name}");
        }
    }

    fn refused(folder: &Path) -> String {
        TextureSet::in_folder(folder, &[]).unwrap_err().to_string()
    }

    #[test]
    fn deeper_maps_are_preferred_and_doubt_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let gray = |name: &str| write_png_gray16(&path(name), 1, 1, &[7]).unwrap();
        let colors = |name: &str| write_png_rgb8(&path(name), 1, 1, &[[7; 3]], &[]).unwrap();
        let error = refused(folder.path());
        assert!(error.contains("no pictures"), "{error}");
        colors("rock_col.png");
        let error = refused(folder.path());
        assert!(
            error.contains("rock_col.png") && error.contains("_disp"),
            "{error}"
        );
        colors("rock_disp.png");
        gray("rock_height.png");
        colors("rock_nor_dx.png");
        colors("rock_ao.png");
        std::fs::write(path("notes_disp.txt"), "").unwrap();
        let set = TextureSet::in_folder(folder.path(), &[]).unwrap();
        assert_eq!(set.displacement, Some(path("rock_height.png")));
        assert_eq!(set.base_color, Some(path("rock_col.png")));
        assert_eq!(set.normal_map, None);
        assert_eq!(set.normal_directx, Some(path("rock_nor_dx.png")));
        assert!(set.unused.contains(&path("rock_ao.png")));
        colors("moss_col.png");
        let named = TextureSet::in_folder(folder.path(), &["--color"]).unwrap();
        assert_eq!(named.base_color, None);
        gray("moss_height.png");
        let error = refused(folder.path());
        for word in ["moss_height.png", "rock_height.png", "--displacement"] {
            assert!(error.contains(word), "{error}");
        }
    }
}
