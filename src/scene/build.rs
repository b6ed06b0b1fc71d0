//! From a scene file to a [`Scene`]: loads what it names, each file once, and fills in what it leaves out.

mod assets;
mod cameras;
mod frame;
mod lights;
mod loaded;
mod materials;
mod subdivide;

use std::f32::consts::PI;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Affine3A;

use super::error::{AssetError, SceneError};
use super::file::{DisplacementTable, Keyed, MeshTable, SCALE};
use super::load::{
    FileDisplacement, FileMaterial, LoadMeshError, LoadOptions, Unused, conjugated, load_mesh_with,
};
use super::{Camera, Film, Integrator, Light, Material, ObjectShape, Scene, SceneObject};
use crate::image::Channel;
use crate::prism::March;
use crate::surface::{
    BaseMesh, DisplacedSurface, Displacement, DisplacementMap, Joined, MeshBuilder, NormalMode,
    Seams, SurfaceError,
};
pub(super) use assets::Assets;
pub(super) use frame::reach;
pub use loaded::{Loaded, MapFile, MeshAndMap, Subdivided};

/// How a mesh file's parts are brought into shape.
struct Shaping {
    transform: Affine3A,
    recompute_normals: bool,
    /// Radians.
    crease_angle: f32,
    /// World units; by the mesh's size where nothing is said.
    join: Option<f32>,
}

impl Default for Shaping {
    fn default() -> Self {
        Self {
            transform: Affine3A::IDENTITY,
            recompute_normals: false,
            crease_angle: PI,
            join: None,
        }
    }
}

/// What of a mesh file has no effect.
#[derive(Default)]
struct UnusedOfFile {
    kinds: Unused,
    /// How many cameras are not taken.
    cameras: usize,
}

impl Shaping {
    /// Of a mesh that is where it belongs, with the normals that it is to have.
    fn done() -> Self {
        Self {
            join: Some(0.0),
            ..Self::default()
        }
    }
}

/// Collects a scene.
#[derive(Default)]
struct Builder {
    assets: Assets,
    objects: Vec<SceneObject>,
    materials: Vec<Material>,
    default_material: Option<usize>,
    /// Lights of mesh files.
    file_lights: Vec<Light>,
    /// Cameras of mesh files.
    cameras: Vec<cameras::Offered>,
    /// What has no effect, by mesh file.
    unused: Vec<(PathBuf, UnusedOfFile)>,
    subdivided: Vec<Subdivided>,
    warnings: Vec<String>,
    notes: Vec<String>,
    /// All that was read but pictures, which `assets` knows.
    files: Vec<PathBuf>,
}

impl Builder {
    fn mesh(&mut self, table: &MeshTable, options: LoadOptions) -> Result<(), SceneError> {
        let path = &table.file.value;
        let asset = |source: AssetError| table.file.asset(source);
        let named = self.material_index(table.material.as_ref())?;
        let name = table.name.clone().unwrap_or_else(|| stem(path));
        let mut shaping = Shaping {
            transform: table.transform,
            recompute_normals: table.recompute_normals,
            crease_angle: table.crease_angle,
            join: table.join,
        };
        let options = LoadOptions {
            keep_polygons: subdivide::keeps_polygons(table.subdivision),
            ..options
        };
        let mut loaded = match table.shape {
            Some(shape) => shape.load(),
            None => load_mesh_with(path, options).map_err(|e| asset(e.into()))?,
        };
        let refused = |kind| {
            let path = path.clone();
            asset(LoadMeshError { path, kind }.into())
        };
        loaded.place(&table.stand).map_err(refused)?;
        if let Some(projection) = table.texcoords {
            loaded.project(projection);
        }
        self.lights_and_cameras(table, &loaded)?;
        self.files.append(&mut loaded.files);
        self.warn_all(path, std::mem::take(&mut loaded.warnings));
        self.unused_of(path).kinds = std::mem::take(&mut loaded.unused);
        let refined = match table.subdivision {
            Some(subdivision) => {
                let (parts, sharpness) = (&mut loaded.parts, &loaded.sharpness);
                let refined = self.subdivide(path, parts, sharpness, &shaping, subdivision);
                shaping = Shaping::done();
                refined.map_err(asset)?
            }
            None => Vec::new(),
        };
        let single = loaded.parts.len() == 1;
        // By what they are: several may have one name, or none.
        let mut of_file: Vec<(FileMaterial, usize)> = Vec::new();
        for (number, part) in loaded.parts.into_iter().enumerate() {
            let name = if single {
                name.clone()
            } else {
                format!("{name}.{}", part.name)
            };
            let mesh = self
                .base_mesh(path, &name, part.mesh, &shaping)
                .map_err(asset)?;
            let by_file = part.material.as_ref().and_then(|m| m.displacement.clone());
            let displaces = table.displacement.as_ref().is_some_and(|d| d.map.is_none());
            let of_part = part
                .material
                .map(|m| if displaces { m.displaced() } else { m });
            let material = match (named, of_part) {
                (Some(index), _) => index,
                (None, Some(material)) => match of_file.iter().find(|(m, _)| *m == material) {
                    Some((_, known)) => *known,
                    None => {
                        let index = self.file_material(path, material.clone());
                        of_file.push((material, index));
                        index
                    }
                },
                (None, None) => self.default_material(),
            };
            let shape = match &table.displacement {
                Some(displacement) => {
                    let seams = displacement.seams.unwrap_or_else(|| {
                        default_seams(&self.materials[material], displacement.prisms.march)
                    });
                    let surface =
                        self.displaced(&table.file, displacement, by_file.as_ref(), &name, mesh)?;
                    let surface = Arc::new(surface.with_seams(seams));
                    ObjectShape::Displaced(surface, displacement.prisms)
                }
                None => ObjectShape::Plain(mesh),
            };
            self.subdivided
                .extend(
                    refined
                        .get(number)
                        .map(|&(faces, scheme, levels)| Subdivided {
                            object: self.objects.len(),
                            faces,
                            scheme,
                            levels,
                        }),
                );
            self.objects.push(SceneObject {
                name,
                shape,
                instances: placements(&table.instances, &part.instances, &table.transform),
                mask: table.mask,
                material,
            });
        }
        Ok(())
    }

    /// Transforms and validates a mesh; what was mended becomes a warning.
    fn base_mesh(
        &mut self,
        path: &Path,
        name: &str,
        mesh: MeshBuilder,
        shaping: &Shaping,
    ) -> Result<Arc<BaseMesh>, AssetError> {
        let keep = !shaping.recompute_normals && !mesh.normals.is_empty();
        let normals = if keep {
            NormalMode::File
        } else {
            NormalMode::Smooth {
                crease_angle: shaping.crease_angle,
            }
        };
        let mut mesh = mesh.transformed(&shaping.transform);
        let tolerance = shaping.join.unwrap_or_else(|| mesh.rounding());
        let built = mesh
            .join(tolerance)
            .and_then(|joined| Ok((joined, mesh.build(normals)?)));
        let (joined, (mesh, report)) = built.map_err(|source| AssetError::Geometry {
            path: path.to_owned(),
            part: name.to_owned(),
            source,
        })?;
        if let Some(what) = told(&joined) {
            self.warn(path, format!("{name}: {what}"));
        }
        if report.degenerate_dropped > 0 {
            let dropped = report.degenerate_dropped;
            self.warn(
                path,
                format!("{name}: {dropped} faces without area were left out"),
            );
        }
        Ok(Arc::new(mesh))
    }

    /// What the scene does not say of a displacement is taken from the mesh file, if that names the map.
    fn displaced(
        &mut self,
        file: &Keyed<PathBuf>,
        table: &DisplacementTable,
        by_file: Option<&FileDisplacement>,
        name: &str,
        mesh: Arc<BaseMesh>,
    ) -> Result<DisplacedSurface, SceneError> {
        let by_file = by_file.filter(|_| table.map.is_none());
        let (path, at) = match (&table.map, by_file) {
            (Some(map), _) => (&map.value, map),
            (None, Some(map)) => (&map.path, file),
            (None, None) => {
                let found = format!("no map, and the file of {name} names none");
                return Err(table.this.refuse(found, "map = \"FILE\""));
            }
        };
        let Some(scale) = table.scale.or(by_file.and_then(|f| f.scale)) else {
            return Err(table.this.refuse("no scale", format!("scale = {SCALE}")));
        };
        let channel = match (&table.channel, by_file.and_then(|f| f.channel)) {
            (Some(channel), _) => channel.clone(),
            (None, Some(letter)) => {
                let Ok(channel) = letter.parse();
                channel
            }
            (None, None) => Channel::default(),
        };
        let wrap = table.wrap.or(by_file.and_then(|f| f.wrap));
        let displacement = Displacement {
            scale,
            midlevel: table
                .midlevel
                .or(by_file.and_then(|f| f.midlevel))
                .unwrap_or(0.0),
            uv: table.uv.or(by_file.map(|f| f.uv)).unwrap_or_default(),
        };
        let map = self
            .assets
            .heights(path, &channel, wrap.unwrap_or_default(), table.nodata)
            .map_err(|e| match by_file {
                Some(map) => at.asset(e.named_by(&map.from)),
                None => at.asset(e),
            })?;
        let surface = displaced(name, mesh, (path, &map), displacement).map_err(|e| match e {
            AssetError::Heights { .. } => at.asset(e),
            _ => file.asset(e),
        })?;
        Ok(surface.with_shading_normals(table.normals))
    }

    /// The index of the material that the scene names.
    fn material_index(&self, name: Option<&Keyed<String>>) -> Result<Option<usize>, SceneError> {
        let Some(name) = name else { return Ok(None) };
        let index = self.materials.iter().position(|m| m.name == name.value);
        index.map(Some).ok_or_else(|| {
            let known: Vec<_> = self.materials.iter().map(|m| &m.name[..]).collect();
            let expected = match known[..] {
                [] => "the name of a [[material]]; the scene has none".into(),
                _ => format!("the name of a [[material]]: {}", known.join(", ")),
            };
            name.refuse(format!("{:?}", name.value), expected)
        })
    }

    /// Grey, for meshes that nothing else is said of.
    fn default_material(&mut self) -> usize {
        *self.default_material.get_or_insert_with(|| {
            self.materials.push(Material {
                name: "default".into(),
                ..Material::default()
            });
            self.materials.len() - 1
        })
    }

    /// Warns, unless the same has been said: one file may make several meshes.
    fn warn(&mut self, path: &Path, what: impl Display) {
        let line = format!("{}: {what}", path.display());
        if !self.warnings.contains(&line) {
            self.warnings.push(line);
        }
    }

    fn warn_all(&mut self, path: &Path, what: Vec<String>) {
        for line in what {
            self.warn(path, line);
        }
    }

    /// What of the mesh file at `path` has no effect.
    fn unused_of(&mut self, path: &Path) -> &mut UnusedOfFile {
        let known = self.unused.iter().position(|(known, _)| known == path);
        let index = known.unwrap_or_else(|| {
            self.unused.push((path.to_owned(), UnusedOfFile::default()));
            self.unused.len() - 1
        });
        &mut self.unused[index].1
    }

    fn finish(
        mut self,
        path: &Path,
        camera: Camera,
        film: Film,
        lights: Vec<Light>,
        integrator: Integrator,
    ) -> Loaded {
        self.files.extend(self.assets.files().map(Path::to_owned));
        for (path, UnusedOfFile { mut kinds, cameras }) in std::mem::take(&mut self.unused) {
            kinds.add(cameras, "camera");
            if !kinds.is_empty() {
                self.warn(&path, kinds);
            }
        }
        Loaded {
            files: self.files,
            maps: self.assets.into_maps(),
            subdivided: self.subdivided,
            warnings: self.warnings,
            notes: self.notes,
            eye: None,
            default_material: self.default_material,
            scene: Scene {
                path: path.to_owned(),
                camera,
                film,
                objects: self.objects,
                materials: self.materials,
                lights,
                integrator,
            },
        }
    }
}

/// What was joined, if anything.
fn told(joined: &Joined) -> Option<String> {
    let Joined {
        positions,
        farthest,
        normals,
        texcoords,
    } = *joined;
    let counted = |count: usize, one: &str, many: &str| {
        let what = if count == 1 { one } else { many };
        format!("{count} {what}")
    };
    let vertices = counted(positions, "vertex", "vertices");
    let parts = [
        (
            positions,
            format!("{vertices} up to {farthest:.1e} away from others"),
        ),
        (normals, counted(normals, "normal", "normals")),
        (
            texcoords,
            counted(texcoords, "texture coordinate", "texture coordinates"),
        ),
    ];
    let parts: Vec<_> = parts
        .into_iter()
        .filter_map(|(count, part)| (count > 0).then_some(part))
        .collect();
    (!parts.is_empty()).then(|| {
        let parts = parts.join(", ");
        format!("joined what differs by rounding: {parts} (join = 0 keeps them apart)")
    })
}

/// Where an object stands: the scene's instances, of what the file places itself. `transform` has moved the mesh.
fn placements(scene: &[Affine3A], file: &[Affine3A], transform: &Affine3A) -> Vec<Affine3A> {
    if file.is_empty() {
        return scene.to_vec();
    }
    // A scene's transform has an inverse: it scales nothing to nothing.
    let own = conjugated(file.iter().copied(), transform).unwrap_or_default();
    if scene.is_empty() {
        return own;
    }
    let placed = |outer: &Affine3A| own.iter().map(|inner| *outer * *inner).collect::<Vec<_>>();
    scene.iter().flat_map(placed).collect()
}

pub(super) fn displaced(
    part: &str,
    mesh: Arc<BaseMesh>,
    (path, map): (&Path, &Arc<DisplacementMap>),
    displacement: Displacement,
) -> Result<DisplacedSurface, AssetError> {
    DisplacedSurface::new(mesh, map.clone(), displacement).map_err(|source| {
        let part = part.to_owned();
        match source {
            SurfaceError::TooHigh { .. } => AssetError::Heights {
                path: path.to_owned(),
                part,
                source,
            },
            _ => AssetError::Surface { part, source },
        }
    })
}

/// Closed where rays go through the material, so that solids stay solid, if the march sees walls; else open.
fn default_seams(material: &Material, march: March) -> Seams {
    if material.is_transmissive() && march == March::Exact {
        Seams::Closed
    } else {
        Seams::Open
    }
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem()
        .map_or_else(|| "mesh".into(), |s| s.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests;
