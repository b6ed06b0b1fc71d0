//! `prismarch info`: triangles, maps, memory.

use std::fmt::{self, Write as _};
use std::io::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use super::engine::EngineArgs;
use super::error::CliError;
use super::load::LoadArgs;
use super::memory::Memory;
use crate::files::Outputs;
use crate::prism::{March, PrismOptions, Step};
use crate::scene::{Loaded, MapFile, ObjectShape};
use crate::surface::Scheme;

/// Tell what a scene is made of and what memory it takes
///
/// Memory is divided into what every method of displacement needs (maps, base meshes, BVH) and the overhead of this one
/// (prisms: 108 bytes per base triangle, 32 per block of up to 32x32 texels, 28 per wall where seams are closed; pyramids: about a twelfth of their maps).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch info scene.toml
  prismarch info scene.toml --json > scene.json")]
pub struct Args {
    /// Scene file (TOML)
    scene: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    load: LoadArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    args.engine.check_backend()?;
    args.engine.start_threads()?;
    let outputs = Outputs::new();
    outputs.spare([&args.scene])?;
    let loaded = Loaded::from_file_with(&args.scene, &[], args.load.options())?;
    outputs.spare(&loaded.files)?;
    super::warn(&loaded.warnings);
    super::note(&loaded.notes);
    let world = loaded.scene.world()?;
    let engine = args.engine.build(&world)?;
    let info = Info {
        scene: args.scene.display().to_string(),
        backend: engine.tracer().name(),
        triangles: sum(&loaded, |_| true),
        displaced_triangles: sum(&loaded, |o| matches!(o, ObjectShape::Displaced(..))),
        objects: objects(&loaded),
        maps: loaded.maps.iter().map(Map::from).collect(),
        memory: Memory::of(&loaded, &world, engine.tracer()),
    };
    let text = if args.json {
        // Plain data with string keys: nothing in it that JSON cannot hold but a NaN, which becomes null.
        serde_json::to_string_pretty(&info).map_err(|e| CliError::stdout(e.into()))?
    } else {
        info.to_string().trim_end().to_owned()
    };
    writeln!(std::io::stdout(), "{text}").map_err(CliError::stdout)
}

#[derive(Serialize)]
struct Info {
    scene: String,
    backend: String,
    /// Of all base meshes; instances are not counted.
    triangles: usize,
    displaced_triangles: usize,
    objects: Vec<Object>,
    maps: Vec<Map>,
    memory: Memory,
}

#[derive(Serialize)]
struct Object {
    name: String,
    triangles: usize,
    displaced: bool,
    /// What the triangles are made of, if the file's faces are subdivided.
    subdivision: Option<Subdivision>,
    /// That close its seams; 0 where they are open.
    walls: usize,
    /// How its prisms are made, if it is displaced.
    march: Option<String>,
    edit_bounds: Option<&'static str>,
    /// 1 for an object that stands where it is.
    instances: usize,
    material: String,
}

#[derive(Serialize)]
struct Subdivision {
    scheme: &'static str,
    levels: u32,
    /// Of the file.
    faces: usize,
}

#[derive(Serialize)]
struct Map {
    file: String,
    width: usize,
    height: usize,
    format: String,
    /// Of the texels.
    bytes: usize,
    pyramid_bytes: usize,
}

impl From<&MapFile> for Map {
    fn from(file: &MapFile) -> Self {
        let (width, height) = file.map.size();
        Self {
            file: file.path.display().to_string(),
            width,
            height,
            format: file.map.kind().to_string(),
            bytes: file.map.texels().bytes(),
            pyramid_bytes: file.map.pyramid().bytes(),
        }
    }
}

fn objects(loaded: &Loaded) -> Vec<Object> {
    let scene = &loaded.scene;
    let subdivision = |index: usize| {
        let subdivided = loaded.subdivided.iter().find(|s| s.object == index)?;
        Some(Subdivision {
            scheme: match subdivided.scheme {
                Scheme::CatmullClark => "Catmull-Clark",
                Scheme::Loop => "Loop",
            },
            levels: subdivided.levels,
            faces: subdivided.faces,
        })
    };
    let object = |(index, object): (usize, &crate::scene::SceneObject)| Object {
        name: object.name.clone(),
        subdivision: subdivision(index),
        triangles: triangles(&object.shape),
        displaced: matches!(object.shape, ObjectShape::Displaced(..)),
        walls: match &object.shape {
            ObjectShape::Displaced(surface, _) => surface.walls().len(),
            ObjectShape::Plain(_) => 0,
        },
        march: options(&object.shape).map(|options| march(options.march)),
        edit_bounds: options(&object.shape).map(|options| options.edit_bounds.name()),
        instances: object.instances.len().max(1),
        material: scene.materials[object.material].name.clone(),
    };
    scene.objects.iter().enumerate().map(object).collect()
}

fn options(shape: &ObjectShape) -> Option<PrismOptions> {
    match shape {
        ObjectShape::Displaced(_, options) => Some(*options),
        ObjectShape::Plain(_) => None,
    }
}

/// `exact`, `uniform, dt 1 texels` or `uniform, dt 0.01 world units, jitter`.
fn march(march: March) -> String {
    let March::Uniform { step, jitter } = march else {
        return "exact".to_owned();
    };
    let (size, unit) = match step {
        Step::Texels(size) => (size, "texels"),
        Step::World(size) => (size, "world units"),
    };
    let jitter = if jitter { ", jitter" } else { "" };
    format!("uniform, dt {size} {unit}{jitter}")
}

fn triangles(shape: &ObjectShape) -> usize {
    match shape {
        ObjectShape::Displaced(surface, _) => surface.mesh().triangles().len(),
        ObjectShape::Plain(mesh) => mesh.triangles().len(),
    }
}

fn sum(loaded: &Loaded, which: impl Fn(&ObjectShape) -> bool) -> usize {
    let shapes = loaded.scene.objects.iter().map(|o| &o.shape);
    shapes.filter(|s| which(s)).map(triangles).sum()
}

/// The report for people.
impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} ({})", self.scene, self.backend)?;
        writeln!(
            f,
            "\n{:34} {:>11} {:>9}",
            "objects", "triangles", "instances"
        )?;
        for object in &self.objects {
            let Object {
                name,
                triangles,
                instances,
                ..
            } = object;
            write!(f, "  {name:32} {triangles:>11} {instances:>9}")?;
            if let (Some(march), Some(bounds)) = (&object.march, object.edit_bounds) {
                write!(f, "  displaced: march {march}; edit bounds {bounds}")?;
            }
            if let Some(Subdivision {
                scheme,
                levels,
                faces,
            }) = &object.subdivision
            {
                let comma = if object.displaced { ";" } else { " " };
                let levels = format!("{levels} {}", if *levels == 1 { "level" } else { "levels" });
                write!(f, "{comma} {scheme}, {levels} of {faces} faces")?;
            }
            if object.walls > 0 {
                write!(f, "; seams closed by {} walls", object.walls)?;
            }
            writeln!(f)?;
        }
        if !self.maps.is_empty() {
            writeln!(f, "\nmaps")?;
        }
        for map in &self.maps {
            let size = format!("{}x{}", map.width, map.height);
            let (format, bytes) = (&map.format, Bytes(map.bytes));
            writeln!(f, "  {size:>11} {format:6} {bytes:>10}  {}", map.file)?;
        }
        f.write_char('\n')?;
        self.memory.fmt_table(f)
    }
}

impl Memory {
    fn fmt_table(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |bytes: usize| 100.0 * bytes as f64 / self.total as f64;
        let mut row = |name: &str, bytes: usize| {
            let (percent, bytes) = (percent(bytes), Bytes(bytes));
            writeln!(f, "  {name:32} {bytes:>11} {percent:>8.3} %")
        };
        row("displacement maps", self.common.maps)?;
        row("base meshes", self.common.meshes)?;
        row("BVH", self.common.bvh)?;
        row("overhead: prisms", self.overhead.prisms)?;
        row("overhead: pyramids of maps", self.overhead.pyramids)?;
        if self.overhead.means > 0 {
            row("overhead: means of maps (lod)", self.overhead.means)?;
        }
        row("total", self.total)?;
        let pictures = Bytes(self.pictures);
        writeln!(
            f,
            "  {:32} {pictures:>11}",
            "besides: textures, environments"
        )
    }
}

/// A number of bytes with a unit that keeps it short.
struct Bytes(usize);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = self.0 as f64;
        let text = match self.0 {
            0..10_000 => format!("{} B", self.0),
            10_000..10_000_000 => format!("{:.1} kB", bytes / 1e3),
            _ => format!("{:.1} MB", bytes / 1e6),
        };
        f.pad(&text)
    }
}
