//! What loading gives, and what it starts from: a scene file, or one mesh under one map.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Assets, Builder, Shaping, displaced, frame, stem};
use crate::image::Channel;
use crate::prism::PrismOptions;
use crate::scene::error::{AssetError, SceneError};
use crate::scene::file::{Keyed, LightTable, SceneFile};
use crate::scene::load::{LoadOptions, Part, load_mesh_with};
use crate::scene::{Film, Integrator, Material, ObjectShape, Scene, SceneObject};
use crate::surface::{Displacement, DisplacementMap, Projection, Scheme, Wrap};

/// A displacement map and the file it is from, for reports.
#[derive(Clone, Debug)]
pub struct MapFile {
    /// The picture.
    pub path: PathBuf,
    /// The heights, shared by all that use them.
    pub map: Arc<DisplacementMap>,
}

/// A scene, and what there is to say of its files.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Its displacement maps, each file once.
    pub maps: Vec<MapFile>,
    /// What became of meshes that are subdivided.
    pub subdivided: Vec<Subdivided>,
    /// What was mended on the way, one line each.
    pub warnings: Vec<String>,
    /// What was taken of mesh files without being asked for, one line each.
    pub notes: Vec<String>,
    /// Every file that was read: scene, meshes and what they name, pictures.
    pub files: Vec<PathBuf>,
    /// Where the file says what places the camera, if it does.
    pub(super) eye: Option<Keyed<()>>,
    /// The material of meshes that nothing is said of, if there are such.
    pub(in crate::scene) default_material: Option<usize>,
}

/// An object whose mesh is refined.
#[derive(Clone, Copy, Debug)]
pub struct Subdivided {
    /// Index into `Scene::objects`.
    pub object: usize,
    /// Faces that its file has.
    pub faces: usize,
    /// The scheme.
    pub scheme: Scheme,
    /// How often they were refined.
    pub levels: u32,
}

/// One mesh under one map, as named on a command line.
#[derive(Clone, Debug)]
pub struct MeshAndMap {
    /// The mesh file; all its parts are taken.
    pub mesh: PathBuf,
    /// Texture coordinates instead of the file's.
    pub texcoords: Option<Projection>,
    /// The displacement map.
    pub map: PathBuf,
    /// Which channel of it.
    pub channel: Channel,
    /// Outside [0, 1].
    pub wrap: Wrap,
    /// The height of texels without one.
    pub nodata: Option<f32>,
    /// What heights mean.
    pub displacement: Displacement,
    /// How its prisms are made.
    pub prisms: PrismOptions,
    /// What the mesh file may do.
    pub options: LoadOptions,
}

impl Loaded {
    /// Loads the scene file at `path` and every file it names.
    pub fn from_file(path: &Path) -> Result<Self, SceneError> {
        Self::from_file_with(path, &[], LoadOptions::default())
    }

    /// The same with values laid over those of the file: `KEY=VALUE` in TOML, like `film.spp=64`,
    /// `material.rock.roughness=0.2` or `light.0.strength=2`. Items of lists go by number or name.
    /// `options` say what its mesh files may do.
    pub fn from_file_with(
        path: &Path,
        overrides: &[String],
        options: LoadOptions,
    ) -> Result<Self, SceneError> {
        let file = SceneFile::read(path, overrides)?;
        let (mut loaded, _) = Self::from_scene_file(path, file, options, Assets::default())?;
        loaded.files.push(path.to_owned());
        Ok(loaded)
    }

    /// Loads what the scene `file` at `path` names, but for pictures that are among `assets`: these and what has been loaded come back.
    pub(in crate::scene) fn from_scene_file(
        path: &Path,
        file: SceneFile,
        options: LoadOptions,
        assets: Assets,
    ) -> Result<(Self, Assets), SceneError> {
        let mut builder = Builder {
            assets,
            ..Builder::default()
        };
        for material in &file.materials {
            let material = builder.material(material)?;
            builder.materials.push(material);
        }
        for mesh in &file.meshes {
            builder.mesh(mesh, options)?;
        }
        let shines =
            !builder.file_lights.is_empty() || builder.materials.iter().any(Material::is_emissive);
        let mut lights = match &file.lights[..] {
            [] if shines => Vec::new(),
            [] => builder.lights(&LightTable::daylight())?,
            lights => builder.lights(lights)?,
        };
        lights.append(&mut builder.file_lights);
        let (camera, eye) = builder.camera(&file.camera)?;
        let assets = builder.assets.clone();
        let loaded = builder.finish(path, camera, file.film, lights, file.integrator);
        Ok((Self { eye, ..loaded }, assets))
    }

    /// The error that the camera is inside of this object; `None` where the file does not place the camera, since
    /// what is framed is seen from outside.
    pub fn camera_inside(&self, object: usize) -> Option<SceneError> {
        let name = &self.scene.objects[object].name;
        let found = format!("a camera inside of {name:?}");
        let expected = "one outside of closed surfaces, or allow_inside = true for a room";
        self.eye.as_ref().map(|eye| eye.refuse(found, expected))
    }

    /// The scene of one displaced mesh, seen by the default camera. The parts of the file become one object, but for those that
    /// it places many times.
    pub fn from_mesh_and_map(source: &MeshAndMap) -> Result<Self, AssetError> {
        let mut builder = Builder::default();
        let MeshAndMap { mesh, map, .. } = source;
        let map = builder
            .assets
            .heights(map, &source.channel, source.wrap, source.nodata)?;
        let mut file = load_mesh_with(mesh, source.options)?;
        builder.files.append(&mut file.files);
        builder.warn_all(mesh, std::mem::take(&mut file.warnings));
        builder.unused_of(mesh).kinds = std::mem::take(&mut file.unused);
        if let Some(projection) = source.texcoords {
            file.project(projection);
        }
        let name = stem(mesh);
        let placed = file.take_placed();
        let whole = file.into_single_mesh();
        let whole = (!whole.triangles.is_empty()).then_some((name.clone(), whole, Vec::new()));
        let placed = placed.into_iter().map(|part| {
            let Part {
                name: own,
                mesh,
                instances,
                ..
            } = part;
            (format!("{name}.{own}"), mesh, instances)
        });
        for (name, part, instances) in whole.into_iter().chain(placed) {
            let base = builder.base_mesh(mesh, &name, part, &Shaping::default())?;
            let surface = displaced(&name, base, (&source.map, &map), source.displacement)?;
            let material = builder.default_material();
            builder.objects.push(SceneObject {
                name,
                shape: ObjectShape::Displaced(Arc::new(surface), source.prisms),
                instances,
                mask: u32::MAX,
                material,
            });
        }
        let camera = frame::default_camera(frame::bounds(&builder.objects));
        Ok(builder.finish(
            mesh,
            camera,
            Film::default(),
            Vec::new(),
            Integrator::default(),
        ))
    }
}
