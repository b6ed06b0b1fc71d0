//! `prismarch query`: rays from a table, hits to a table.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;
use rayon::prelude::*;

use super::engine::{Engine, EngineArgs};
use super::error::CliError;
use super::hits;
use super::load::LoadArgs;
use super::march::MarchArgs;
use super::parse;
use super::rays::{Layout, RayError, RayReader, Row};
use super::surface::{TexcoordKind, WrapKind};
use crate::files::{Outputs, output};
use crate::image::Channel;
use crate::prism::PrismOptions;
use crate::ray::Cone;
use crate::scene::{Loaded, MeshAndMap, ObjectShape, Scene};
use crate::surface::{DisplacedSurface, Displacement, Seams, UvTransform};
use crate::trace::{RayReach, World};

/// Trace rays from a CSV table and write their hits
///
/// RAYS.csv has the columns ox,oy,oz,dx,dy,dz and perhaps tnear,tfar (tfar may be inf). HITS.csv gets one row per ray, in
/// order: hit,t,mesh,prim,u,v,px,py,pz,ngx,ngy,ngz,nsx,nsy,nsz,displacement. t is in lengths of the direction as given;
/// p, ng (geometric normal) and ns (smooth normal) are in world space; a ray that hits nothing has zeros. `-` is
/// standard input or output.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  prismarch query --mesh rock.obj --map rock.png --scale 0.1 --rays rays.csv -o hits.csv
  prismarch query --mesh rock.obj --map rock.png --scale 0.1 --dt 0.25 --rays rays.csv -o hits.csv
  zcat rays.csv.gz | prismarch query scene.toml --rays - -o - | gzip > hits.csv.gz")]
pub struct Args {
    /// Scene file (TOML), instead of --mesh and --map
    #[arg(required_unless_present = "mesh", conflicts_with = "mesh")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    march: MarchArgs,
    /// Shift the steps of each ray at random (thin-feature sampling)
    #[arg(long, value_name = "SEED")]
    jitter: Option<u32>,
    /// UV seams, hard edges and borders: left open, or closed by walls (exact march only) [default: the scene's, or open]
    #[arg(long, value_enum)]
    seams: Option<SeamKind>,
    /// Table of rays, - for standard input
    #[arg(long, value_name = "RAYS.csv")]
    rays: PathBuf,
    /// Table of hits, - for standard output
    #[arg(short, long, value_name = "HITS.csv", default_value = "-")]
    output: PathBuf,
    #[command(flatten)]
    load: LoadArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// One displaced mesh without a scene file.
#[derive(Debug, clap::Args)]
struct SurfaceArgs {
    /// Mesh file: .obj, .gltf, .glb or .ply
    #[arg(long, value_name = "FILE", requires_all = ["map", "scale"])]
    mesh: Option<PathBuf>,
    /// Where the mesh's texture coordinates come from
    #[arg(long, value_enum, value_name = "KIND", default_value_t = TexcoordKind::File, requires = "mesh")]
    texcoords: TexcoordKind,
    /// Displacement map: PNG, TIFF, EXR, JPEG or another picture (docs/scene.md, Pictures)
    #[arg(long, value_name = "FILE", requires = "mesh")]
    map: Option<PathBuf>,
    /// World units from height 0 to height 1 of the map
    #[arg(long, value_name = "S", value_parser = parse::scale, allow_hyphen_values = true, requires = "mesh")]
    scale: Option<f32>,
    /// Height that stays on the mesh
    #[arg(long, value_name = "X", value_parser = parse::finite, allow_hyphen_values = true, default_value_t = 0.0, requires = "mesh")]
    midlevel: f32,
    /// Channel of the map: luminance, r, g, b, a, the name of an EXR channel or the number of a band, from 1
    #[arg(long, value_name = "C", default_value = "luminance", requires = "mesh")]
    channel: String,
    /// The map outside of [0, 1]
    #[arg(long, value_enum, default_value_t = WrapKind::Repeat, requires = "mesh")]
    wrap: WrapKind,
    /// Height of texels without one: those with the value that the map declares to mean no data, NaN, infinite ones
    #[arg(long, value_name = "H", value_parser = parse::finite, allow_hyphen_values = true, requires = "mesh")]
    nodata: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum SeamKind {
    /// Displaced sheets part
    Open,
    /// Walls join them
    Closed,
}

impl From<SeamKind> for Seams {
    fn from(kind: SeamKind) -> Self {
        match kind {
            SeamKind::Open => Self::Open,
            SeamKind::Closed => Self::Closed,
        }
    }
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<(), CliError> {
    args.engine.check_backend()?;
    let to_stdout = is_standard(&args.output);
    let mut outputs = Outputs::new();
    if !to_stdout {
        outputs.add(&args.output)?;
    }
    if is_standard(&args.rays) {
        outputs.spare_stdin()?;
    }
    outputs.spare(args.files())?;
    args.engine.start_threads()?;
    let mut rays = RayReader::open(&args.rays)?;
    let mut loaded = args.load()?;
    outputs.spare(&loaded.files)?;
    super::warn(&loaded.warnings);
    args.march.apply(&mut loaded.scene, args.jitter.is_some())?;
    args.override_seams(&mut loaded.scene);
    let world = loaded.scene.world()?;
    let spread = args.march.spread(&loaded.scene);
    world.set_spread(spread);
    let engine = args.engine.build(&world)?;
    let query = Query {
        // Checked when the world was made.
        reach: world.ray_reach().unwrap_or_default(),
        world: &world,
        engine: &*engine,
        seed: args.jitter.unwrap_or(0),
        cone: Cone::from_eye(spread),
    };
    if to_stdout {
        let mut out = BufWriter::new(io::stdout().lock());
        return query.run(&mut rays, &mut out).map_err(|stop| match stop {
            Stop::Because(error) => error,
            Stop::Write(error) => CliError::stdout(error),
        });
    }
    let mut because = None;
    let written = output::write(&args.output, |out| {
        query.run(&mut rays, out).map_err(|stop| match stop {
            Stop::Write(error) => error,
            Stop::Because(error) => {
                because = Some(error);
                io::Error::other("stopped")
            }
        })
    });
    match because {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

impl Args {
    /// What is read, as far as the command line tells.
    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let rays = Some(&self.rays).filter(|rays| !is_standard(rays));
        let SurfaceArgs { mesh, map, .. } = &self.surface;
        [rays, self.scene.as_ref(), mesh.as_ref(), map.as_ref()]
            .into_iter()
            .flatten()
    }

    fn load(&self) -> Result<Loaded, CliError> {
        let SurfaceArgs {
            mesh, map, scale, ..
        } = &self.surface;
        let options = self.load.options();
        match (&self.scene, mesh, map, scale) {
            (Some(scene), ..) => Ok(Loaded::from_file_with(scene, &[], options)?),
            (None, Some(mesh), Some(map), &Some(scale)) => {
                let Ok(channel): Result<Channel, _> = self.surface.channel.parse();
                Ok(Loaded::from_mesh_and_map(&MeshAndMap {
                    mesh: mesh.clone(),
                    texcoords: self.surface.texcoords.projection(),
                    map: map.clone(),
                    channel,
                    wrap: self.surface.wrap.into(),
                    nodata: self.surface.nodata,
                    displacement: Displacement {
                        scale,
                        midlevel: self.surface.midlevel,
                        uv: UvTransform::default(),
                    },
                    prisms: PrismOptions::default(),
                    options,
                })?)
            }
            _ => Err(CliError::Usage(
                "either SCENE or --mesh, --map and --scale are needed".into(),
            )),
        }
    }

    /// What the command line says of seams wins over the scene.
    fn override_seams(&self, scene: &mut Scene) {
        let Some(seams) = self.seams else { return };
        for object in &mut scene.objects {
            if let ObjectShape::Displaced(surface, _) = &mut object.shape {
                let other = DisplacedSurface::clone(surface).with_seams(seams.into());
                *surface = Arc::new(other);
            }
        }
    }
}

/// Whether standard input or output is meant.
fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// Rays traced at once: enough for all threads, little memory.
const CHUNK: usize = 1 << 16;

struct Query<'a> {
    world: &'a World,
    reach: RayReach,
    engine: &'a dyn Engine,
    seed: u32,
    cone: Cone,
}

/// Why a table of hits ends early.
enum Stop {
    Write(io::Error),
    Because(CliError),
}

impl Query<'_> {
    /// Traces all rays, chunk by chunk.
    fn run(&self, rays: &mut RayReader, out: &mut impl Write) -> Result<(), Stop> {
        let mut rows = vec![Row::default(); CHUNK];
        let mut first = 0;
        out.write_all(hits::HEADER.as_bytes())
            .map_err(Stop::Write)?;
        loop {
            let count = rays.read(&mut rows).map_err(|e| Stop::Because(e.into()))?;
            let tables = self
                .trace(&rows[..count], first, rays.layout())
                .map_err(|e| Stop::Because(e.into()))?;
            self.engine.check().map_err(Stop::Because)?;
            for table in tables {
                out.write_all(&table).map_err(Stop::Write)?;
            }
            first += count as u64;
            if count < rows.len() {
                return out.flush().map_err(Stop::Write);
            }
        }
    }

    /// The hits of these rows, in order and in pieces; the first bad row is the error.
    fn trace(&self, rows: &[Row], first: u64, layout: &Layout) -> Result<Vec<Vec<u8>>, RayError> {
        const PIECE: usize = 1 << 10;
        let pieces = rows.par_chunks(PIECE).enumerate();
        let traced: Vec<Result<Vec<u8>, RayError>> = pieces
            .map(|(index, piece)| {
                let first = first + (index * PIECE) as u64;
                self.trace_piece(piece, first, layout)
            })
            .collect();
        traced.into_iter().collect()
    }

    fn trace_piece(&self, rows: &[Row], first: u64, layout: &Layout) -> Result<Vec<u8>, RayError> {
        let tracer = self.engine.tracer();
        let mut table = Vec::new();
        for (row, number) in rows.iter().zip(first..) {
            let mut ray = layout.ray(row, &self.reach)?;
            ray.key = key(self.seed, number);
            match tracer.intersect(&ray) {
                Some(hit) => hits::append(&mut table, self.world, &hit, &ray, &self.cone),
                None => hits::append_miss(&mut table),
            }
        }
        Ok(table)
    }
}

/// A ray's random key: Murmur3's finaliser over seed and row, so that neighbouring rows share nothing.
fn key(seed: u32, row: u64) -> u32 {
    let mut x = seed ^ (row as u32).wrapping_mul(0x9e37_79b9) ^ (row >> 32) as u32;
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}
