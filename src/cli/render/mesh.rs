//! A mesh and its maps on the command line, in place of a scene file.

use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use glam::Vec2;

use super::Args;
use crate::cli::error::CliError;
use crate::cli::heading::{MESH, PICTURE, STAGE};
use crate::cli::parse;
use crate::cli::surface::{TexcoordKind, WrapKind};
use crate::files::{Outputs, input, output};
use crate::scene::Loaded;
use crate::scene::load::MESH_EXTENSIONS;
use crate::scene::lookdev::{Amount, Light, Lookdev, Made, Maps, Place, TextureSet, View};

/// Options of a mesh that is rendered without a scene file.
#[derive(Clone, Debug, clap::Args)]
pub struct MeshArgs {
    /// Displacement map, or a folder with maps of one surface, known by how their names end: _disp, _height, _color, _rough,
    /// _metal, _normal and the like
    #[arg(long, value_name = "FILE|FOLDER", help_heading = MESH)]
    displacement: Option<PathBuf>,
    /// World units from height 0 to height 1 [default: guessed from the mesh's size and the map's heights, and said]
    #[arg(long, value_name = "S", value_parser = parse::scale, allow_hyphen_values = true, help_heading = MESH)]
    scale: Option<f32>,
    /// Height that stays on the mesh [default: 0]
    #[arg(long, value_name = "H", value_parser = parse::finite, allow_hyphen_values = true, help_heading = MESH)]
    midlevel: Option<f32>,
    /// Channel of the displacement map: r, g, b, a, the name of an EXR channel or the number of a band [default: luminance]
    #[arg(long, value_name = "C", help_heading = MESH)]
    channel: Option<String>,
    /// Height of texels without one (no data, NaN)
    #[arg(long, value_name = "H", value_parser = parse::finite, allow_hyphen_values = true, help_heading = MESH)]
    nodata: Option<f32>,
    /// Picture of the surface's colours, or "none"
    #[arg(long, value_name = "FILE", value_parser = parse::file_or_none(), help_heading = MESH)]
    color: Option<Given>,
    /// Roughness: a picture, a number from 0 (mirror) to 1, or "none"
    #[arg(long, value_name = "FILE|X", value_parser = parse::amount(), help_heading = MESH)]
    roughness: Option<Given>,
    /// Metalness: a picture, a number from 0 to 1 (metal), or "none"
    #[arg(long, value_name = "FILE|X", value_parser = parse::amount(), help_heading = MESH)]
    metallic: Option<Given>,
    /// Normal map (tangent space, green up), or "none"
    #[arg(long, value_name = "FILE", value_parser = parse::file_or_none(), help_heading = MESH)]
    normal_map: Option<Given>,
    /// How often the maps repeat, across and up
    #[arg(long, value_name = "X[,Y]", value_parser = parse::repeats, help_heading = MESH)]
    uv_scale: Option<Vec2>,
    /// The maps outside of [0, 1] [default: repeat]
    #[arg(long, value_enum, help_heading = MESH)]
    wrap: Option<WrapKind>,
    /// Where the mesh's texture coordinates come from [default: file]
    #[arg(long, value_enum, value_name = "KIND", help_heading = MESH)]
    texcoords: Option<TexcoordKind>,
    /// Where the mesh's normals come from [default: file]
    #[arg(long, value_enum, value_name = "KIND", help_heading = MESH)]
    normals: Option<NormalKind>,
    /// Refine the mesh N times to a smooth one before it is displaced
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=12), help_heading = MESH)]
    subdivide: Option<u32>,
    /// Which axis of the mesh file points up [default: y]
    #[arg(long, value_name = "AXIS", value_parser = ["y", "z"], help_heading = MESH)]
    up: Option<String>,
    /// World units in one unit of the mesh file: a number, or mm, cm, m, in, ft where world units are metres [default: 1]
    #[arg(long, value_name = "U", help_heading = MESH)]
    unit: Option<String>,
    /// Side that the camera looks at [default: three-quarter]
    #[arg(long, value_name = "SIDE", value_parser = parse::word(View::NAMES), help_heading = STAGE)]
    view: Option<View>,
    /// Degrees to turn the camera around the mesh from there: to the right, and up
    #[arg(long, value_name = "DEG[,DEG]", value_parser = parse::orbit, allow_hyphen_values = true, help_heading = STAGE)]
    orbit: Option<[f32; 2]>,
    /// Picture of light from all around (EXR, Radiance HDR), instead of sun and sky
    #[arg(long, value_name = "FILE", help_heading = STAGE)]
    light: Option<PathBuf>,
    /// Put a floor under the mesh
    #[arg(long, help_heading = STAGE)]
    floor: bool,
    /// Write the scene file that the mesh and the options stand for; without -o nothing is rendered
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["set", "spread"], help_heading = PICTURE)]
    pub save: Option<PathBuf>,
}

/// What an option says of a map.
#[derive(Clone, Debug, PartialEq)]
pub enum Given {
    /// That there is none.
    Nothing,
    /// A number instead of a picture.
    Number(f32),
    /// Which picture.
    File(PathBuf),
}

/// Where normals come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NormalKind {
    /// The mesh file; computed where it has none
    File,
    /// Always computed
    Smooth,
}

/// Endings of meshes that are not read; a scene may have any other.
const FOREIGN: [&str; 17] = [
    "3ds", "abc", "blend", "c4d", "dae", "fbx", "ma", "max", "mb", "off", "stl", "usd", "usda",
    "usdc", "usdz", "x3d", "ztl",
];

impl MeshArgs {
    /// What is to be made of the file `named`, if that is a mesh.
    pub fn lookdev(&self, named: &Path, quiet: bool) -> Result<Option<Lookdev>, CliError> {
        let meshes = MESH_EXTENSIONS
            .map(|ending| format!(".{ending}"))
            .join(", ");
        let expected = format!("expected a scene file (.toml) or a mesh ({meshes})");
        let ending = named.extension().map(OsStr::to_string_lossy);
        let ending = ending.unwrap_or_default().to_lowercase();
        if MESH_EXTENSIONS.contains(&&ending[..]) {
            return self.of_mesh(named, quiet).map(Some);
        }
        let path = named.display();
        if named.is_dir() {
            let hint = "a folder of maps is given with --displacement, beside a mesh";
            return Err(CliError::Input(format!(
                "{path}: it is a folder; {expected}; {hint}"
            )));
        }
        let given = self.given();
        let is_scene = ending.is_empty() || ending == "toml";
        let is_foreign = FOREIGN.contains(&&ending[..]) || is_binary(named);
        if is_foreign || (given.is_some() && !is_scene) {
            let found = if is_scene {
                "no text".into()
            } else {
                format!(".{ending}")
            };
            let hint = "export a mesh as one of these; a map is given with --displacement";
            return Err(CliError::Input(format!(
                "{path}: found {found}; {expected}; {hint}"
            )));
        }
        given.map_or(Ok(None), |option| {
            Err(CliError::Usage(format!(
                "{option} is for a mesh ({meshes}), and {path} is a scene file: say it there (docs/scene.md), or lay it over with \
                 --set KEY=VALUE"
            )))
        })
    }

    /// An option that is given, if any is.
    fn given(&self) -> Option<&'static str> {
        // Named one by one: who adds an option decides here what it is for.
        let Self {
            displacement,
            scale,
            midlevel,
            channel,
            nodata,
            color,
            roughness,
            metallic,
            normal_map,
            uv_scale,
            wrap,
            texcoords,
            normals,
            subdivide,
            up,
            unit,
            view,
            orbit,
            light,
            floor,
            save,
        } = self;
        let options = [
            ("--displacement", displacement.is_some()),
            ("--scale", scale.is_some()),
            ("--midlevel", midlevel.is_some()),
            ("--channel", channel.is_some()),
            ("--nodata", nodata.is_some()),
            ("--color", color.is_some()),
            ("--roughness", roughness.is_some()),
            ("--metallic", metallic.is_some()),
            ("--normal-map", normal_map.is_some()),
            ("--uv-scale", uv_scale.is_some()),
            ("--wrap", wrap.is_some()),
            ("--texcoords", texcoords.is_some()),
            ("--normals", normals.is_some()),
            ("--subdivide", subdivide.is_some()),
            ("--up", up.is_some()),
            ("--unit", unit.is_some()),
            ("--view", view.is_some()),
            ("--orbit", orbit.is_some()),
            ("--light", light.is_some()),
            ("--floor", *floor),
            ("--save", save.is_some()),
        ];
        options
            .iter()
            .find(|(_, given)| *given)
            .map(|(name, _)| *name)
    }

    fn of_mesh(&self, mesh: &Path, quiet: bool) -> Result<Lookdev, CliError> {
        Ok(Lookdev {
            mesh: mesh.to_owned(),
            smooth_normals: self.normals == Some(NormalKind::Smooth),
            subdivide: self.subdivide,
            up: self.up.clone(),
            unit: self.unit.clone(),
            texcoords: self.texcoords.and_then(TexcoordKind::projection),
            maps: self.maps(quiet)?,
            channel: self.channel.clone(),
            wrap: self.wrap.map(Into::into).unwrap_or_default(),
            nodata: self.nodata,
            uv_scale: self.uv_scale.unwrap_or(Vec2::ONE),
            scale: self.scale,
            midlevel: self.midlevel,
            view: self.view.unwrap_or_default(),
            orbit: self.orbit.unwrap_or_default(),
            light: match &self.light {
                Some(file) => Light::Environment(file.clone()),
                None => Light::Daylight,
            },
            floor: self.floor,
        })
    }

    /// The maps that are named, and those that are found in a folder.
    fn maps(&self, quiet: bool) -> Result<Maps, CliError> {
        let found = match &self.displacement {
            Some(folder) if folder.is_dir() => {
                let named = [
                    ("--color", &self.color),
                    ("--roughness", &self.roughness),
                    ("--metallic", &self.metallic),
                    ("--normal-map", &self.normal_map),
                ];
                let named = named.into_iter().filter(|(_, given)| given.is_some());
                let named: Vec<&str> = named.map(|(option, _)| option).collect();
                let found = TextureSet::in_folder(folder, &named)?;
                tell(folder, &found, quiet);
                found
            }
            file => TextureSet {
                displacement: file.clone(),
                ..TextureSet::default()
            },
        };
        let file = |given: &Option<Given>, found: Option<PathBuf>| match given {
            None => found,
            Some(Given::File(file)) => Some(file.clone()),
            Some(Given::Nothing | Given::Number(_)) => None,
        };
        let amount = |given: &Option<Given>, found: Option<PathBuf>| match given {
            Some(Given::Number(number)) => Some(Amount::Number(*number)),
            _ => file(given, found).map(Amount::File),
        };
        Ok(Maps {
            displacement: found.displacement,
            base_color: file(&self.color, found.base_color),
            roughness: amount(&self.roughness, found.roughness),
            metallic: amount(&self.metallic, found.metallic),
            normal_map: file(&self.normal_map, found.normal_map),
        })
    }
}

/// Whether a file begins as no text does; one that cannot be read is left to who reads it.
fn is_binary(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = input::open(path).and_then(|file| file.take(512).read_to_end(&mut start));
    read.is_ok() && start.contains(&0)
}

/// Says which maps are taken.
fn tell(folder: &Path, set: &TextureSet, quiet: bool) {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    if let Some(normals) = &set.normal_directx {
        crate::cli::warn(&[format!(
            "{}: a normal map with green down (DirectX) is left out; one with green up (OpenGL) is given with --normal-map",
            normals.display()
        )]);
    }
    let taken = set
        .taken()
        .map(|(what, path)| format!("{what} {}", name(path)));
    let taken: Vec<String> = taken.collect();
    let mut line = format!("maps in {}: {}", folder.display(), taken.join(", "));
    if !set.unused.is_empty() {
        let unused: Vec<String> = set.unused.iter().map(|path| name(path)).collect();
        line += &format!("; unused: {}", unused.join(", "));
    }
    note(&line, quiet);
}

fn note(line: &str, quiet: bool) {
    if !quiet {
        eprintln!("prismarch: {line}");
    }
}

impl Args {
    /// Makes the scene of a mesh, says what was guessed, and saves it where it is asked for.
    pub(super) fn make(&self, mesh: &Lookdev, outputs: &Outputs) -> Result<Loaded, CliError> {
        let save = self.mesh.save.as_deref();
        let place = save.map_or(Place::Nowhere, Place::Saved);
        let mut draft = mesh.draft(place, &self.set, self.load.options())?;
        super::settle(
            draft.scene_mut(),
            &self.film,
            self.integrator.as_deref(),
            &self.march,
        )?;
        let Made {
            loaded,
            text,
            notes,
        } = draft.finish()?;
        for line in &notes {
            note(line, self.quiet);
        }
        if let Some(path) = save {
            outputs.spare(&loaded.files)?;
            output::write(path, |out| out.write_all(text.as_bytes()))?;
            if self.output.is_some() {
                note(&format!("the scene is in {}", path.display()), self.quiet);
            }
        }
        Ok(loaded)
    }
}
