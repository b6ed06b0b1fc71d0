//! `[[mesh]]` and `[mesh.displacement]`.

use std::path::{Path, PathBuf};

use glam::{Affine3A, EulerRot, Mat3, Quat, Vec3};

use super::{
    Item, Keyed, STEP_TEXELS, SceneError, Section, channel, factor, file_path, keyed, uv_transform,
    wrap,
};
use crate::image::Channel;
use crate::prism::{EditBounds, Lod, March, PrismOptions, Step};
use crate::scene::load::Shape;
use crate::surface::{Projection, Scheme, Seams, ShadingNormals, UvTransform, Wrap};

/// What `scale` of a displacement is.
pub(in crate::scene) const SCALE: &str =
    "world units from height 0 to height 1: a number other than 0";

/// The words for where texture coordinates come from.
pub(in crate::scene) const TEXCOORDS: [(&str, Option<Projection>); 5] = [
    ("file", None),
    ("box", Some(Projection::Box)),
    ("spherical", Some(Projection::Spherical)),
    ("cylindrical", Some(Projection::Cylindrical)),
    ("planar", Some(Projection::Planar)),
];

/// Factors that a length may be multiplied by: beyond these, squares and products of f32 lengths vanish or overflow.
const LENGTHS: std::ops::RangeInclusive<f32> = 1e-9..=1e9;

/// The words for what one unit of a file is, where world units are metres.
const UNITS: [(&str, f32); 5] = [
    ("mm", 0.001),
    ("cm", 0.01),
    ("m", 1.0),
    ("in", 0.0254),
    ("ft", 0.3048),
];

/// One mesh as written.
#[derive(Debug)]
pub(in crate::scene) struct MeshTable {
    /// Default: the file's stem.
    pub name: Option<String>,
    /// Of a built-in shape its word, which names it in messages as a path does a file.
    pub file: Keyed<PathBuf>,
    /// Instead of a file.
    pub shape: Option<Shape>,
    /// From the file's space, which has its own up and unit, to one with +Y up and world units.
    pub stand: Affine3A,
    /// Whether the file's lights shine.
    pub lights: bool,
    /// What the file's candela and lux are multiplied by; default: by what they come to.
    pub light_scale: Option<f32>,
    /// Compute normals even where the file has some.
    pub recompute_normals: bool,
    /// Radians, for computed normals.
    pub crease_angle: f32,
    /// Vertices no farther apart are joined, world units; default: what rounding explains.
    pub join: Option<f32>,
    pub subdivision: Option<Subdivision>,
    /// Texture coordinates instead of the file's.
    pub texcoords: Option<Projection>,
    pub material: Option<Keyed<String>>,
    pub mask: u32,
    pub transform: Affine3A,
    pub instances: Vec<Affine3A>,
    pub displacement: Option<DisplacementTable>,
}

/// How a mesh is subdivided before it is displaced.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene) struct Subdivision {
    /// At least 1.
    pub levels: u32,
    /// Default: what the file's faces are for.
    pub scheme: Option<Scheme>,
}

/// A displacement as written.
#[derive(Debug)]
pub(in crate::scene) struct DisplacementTable {
    /// The table itself, for messages.
    pub this: Keyed<()>,
    /// Default: the map that the mesh file names; then what follows may be the file's, too.
    pub map: Option<Keyed<PathBuf>>,
    pub channel: Option<Channel>,
    pub scale: Option<f32>,
    pub midlevel: Option<f32>,
    pub wrap: Option<Wrap>,
    /// The height of texels without one.
    pub nodata: Option<f32>,
    pub uv: Option<UvTransform>,
    pub prisms: PrismOptions,
    pub normals: ShadingNormals,
    /// Default: what the material needs.
    pub seams: Option<Seams>,
}

impl MeshTable {
    pub(super) fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let mut section = item.section(&[
            "name",
            "file",
            "shape",
            "up",
            "unit",
            "lights",
            "light_scale",
            "normals",
            "crease_angle",
            "join",
            "subdivide",
            "subdivision",
            "texcoords",
            "material",
            "mask",
            "transform",
            "instances",
            "displacement",
        ])?;
        let (file, shape) = source(&mut section, folder)?;
        let modes = [("file", false), ("smooth", true)];
        Ok(Self {
            name: section.optional("name", |i| Ok(i.text("a name, in quotes")?.to_owned()))?,
            file,
            shape,
            stand: stand(&mut section)?,
            lights: section
                .optional("lights", |i| i.word(&[("file", true), ("ignore", false)]))?
                .unwrap_or(true),
            light_scale: section.optional("light_scale", factor)?,
            recompute_normals: section
                .optional("normals", |i| i.word(&modes))?
                .unwrap_or(false),
            crease_angle: section
                .optional("crease_angle", |i| {
                    i.number("degrees from 0 to 180", |x| (0.0..=180.0).contains(&x))
                })?
                .map_or(std::f32::consts::PI, f32::to_radians),
            join: section.optional("join", |i| {
                i.number("world units, at least 0", |x| x >= 0.0)
            })?,
            subdivision: subdivision(&mut section)?,
            texcoords: section
                .optional("texcoords", |i| i.word(&TEXCOORDS))?
                .flatten(),
            material: section.optional("material", |i| {
                Ok(keyed(&i, i.text("the name of a [[material]]")?.to_owned()))
            })?,
            mask: section
                .optional("mask", |i| i.integer(0..=u32::MAX))?
                .unwrap_or(u32::MAX),
            transform: section
                .optional("transform", transform)?
                .unwrap_or_default(),
            instances: section
                .optional("instances", instances)?
                .unwrap_or_default(),
            displacement: section
                .optional("displacement", |i| DisplacementTable::read(i, folder))?,
        })
    }
}

/// `file`, or `shape` in its place.
fn source(
    section: &mut Section,
    folder: &Path,
) -> Result<(Keyed<PathBuf>, Option<Shape>), SceneError> {
    let Some(item) = section.get("shape") else {
        let file = section.require("file", "the path of a mesh file, or shape = \"plane\"")?;
        return Ok((file_path(&file, folder)?, None));
    };
    if section.get("file").is_some() {
        return Err(item.error("a file and a shape", "only one of them"));
    }
    let word = item.text("the name of a shape, like \"plane\"")?;
    let named = keyed(&item, PathBuf::from(word));
    Ok((named, Some(item.word(&Shape::NAMES)?)))
}

impl DisplacementTable {
    fn read(item: Item, folder: &Path) -> Result<Self, SceneError> {
        let this = keyed(&item, ());
        let mut section = item.section(&[
            "map",
            "channel",
            "scale",
            "midlevel",
            "wrap",
            "nodata",
            "uv",
            "march",
            "dt",
            "dt_world",
            "jitter",
            "edit_bounds",
            "lod",
            "normals",
            "seams",
        ])?;
        let march = march(&mut section)?;
        let words = [EditBounds::Tight, EditBounds::Range].map(|b| (b.name(), b));
        let edit_bounds = section.optional("edit_bounds", |i| i.word(&words))?;
        let normals = ShadingNormals::ALL.map(|n| (n.name(), n));
        Ok(Self {
            this,
            map: section.optional("map", |i| file_path(&i, folder))?,
            channel: section.optional("channel", channel)?,
            scale: section.optional("scale", |i| i.number(SCALE, |x| x != 0.0))?,
            midlevel: section.optional("midlevel", |i| i.number("a height", |_| true))?,
            wrap: section.optional("wrap", one_wrap)?,
            nodata: section.optional("nodata", |i| i.number("a height", |_| true))?,
            uv: section.optional("uv", uv_transform)?,
            prisms: PrismOptions {
                march,
                edit_bounds: edit_bounds.unwrap_or_default(),
                lod: lod(&mut section, march)?,
            },
            normals: section
                .optional("normals", |i| i.word(&normals))?
                .unwrap_or_default(),
            seams: seams(&mut section, march)?,
        })
    }
}

fn subdivision(section: &mut super::Section) -> Result<Option<Subdivision>, SceneError> {
    /// More are beyond any memory.
    const MOST: u32 = 12;
    let levels = section.optional("subdivide", |i| i.integer(0..=MOST))?;
    let Some(item) = section.get("subdivision") else {
        let levels = levels.filter(|&levels| levels > 0);
        return Ok(levels.map(|levels| Subdivision {
            levels,
            scheme: None,
        }));
    };
    let Some(levels) = levels else {
        return Err(item.error("no subdivide", "subdivide = N beside it"));
    };
    let words = [
        ("catmull-clark", Scheme::CatmullClark),
        ("loop", Scheme::Loop),
    ];
    let scheme = Some(item.word(&words)?);
    Ok((levels > 0).then_some(Subdivision { levels, scheme }))
}

/// A map is displaced by one mode in both directions.
fn one_wrap(item: Item) -> Result<Wrap, SceneError> {
    if item.is_array() {
        let expected = "one word for both directions; only textures that shade have two";
        return Err(item.refuse(expected));
    }
    wrap(item)
}

fn seams(section: &mut Section, march: March) -> Result<Option<Seams>, SceneError> {
    let Some(item) = section.get("seams") else {
        return Ok(None);
    };
    let no_walls = item.error(
        "\"closed\" with the uniform march, which sees no walls",
        "\"open\", or march = \"exact\"",
    );
    let seams = item.word(&[("open", Seams::Open), ("closed", Seams::Closed)])?;
    if seams == Seams::Closed && march != March::Exact {
        return Err(no_walls);
    }
    Ok(Some(seams))
}

fn lod(section: &mut Section, march: March) -> Result<Lod, SceneError> {
    let Some(item) = section.get("lod") else {
        return Ok(Lod::Off);
    };
    let no_cone = item.error(
        "\"cone\" with the uniform march, which has no level of detail",
        "\"off\", or march = \"exact\"",
    );
    let lod = item.word(&[Lod::Off, Lod::Cone].map(|lod| (lod.name(), lod)))?;
    if lod == Lod::Cone && march != March::Exact {
        return Err(no_cone);
    }
    Ok(lod)
}

/// `march`, and what belongs to the uniform one: a step or its jitter choose it where no march is named.
fn march(section: &mut Section) -> Result<March, SceneError> {
    let words = [("exact", false), ("uniform", true)];
    let uniform = section.optional("march", |i| i.word(&words))?;
    if uniform == Some(false) {
        for key in ["dt", "dt_world", "jitter"] {
            if let Some(item) = section.get(key) {
                let found = format!("{key} beside march = \"exact\"");
                return Err(item.error(found, "march = \"uniform\"; the exact march has no step"));
            }
        }
    }
    let step = step(section)?;
    let jitter = section.optional("jitter", |i| i.boolean())?;
    if uniform != Some(true) && step.is_none() && jitter.is_none() {
        return Ok(March::Exact);
    }
    Ok(March::Uniform {
        step: step.unwrap_or(Step::Texels(1.0)),
        jitter: jitter.unwrap_or(false),
    })
}

/// `dt` or `dt_world`.
fn step(section: &mut Section) -> Result<Option<Step>, SceneError> {
    let texels = section.optional("dt", |i| {
        let (low, high) = (STEP_TEXELS.start(), STEP_TEXELS.end());
        let expected = format!("texels per step, from {low} to {high}");
        i.number(&expected, |x| STEP_TEXELS.contains(&x))
    })?;
    let Some(item) = section.get("dt_world") else {
        return Ok(texels.map(Step::Texels));
    };
    if texels.is_some() {
        return Err(item.error("dt and dt_world", "only one of them"));
    }
    let length = item.number("world units per step, above 0", |x| x > 0.0)?;
    Ok(Some(Step::World(length)))
}

fn instances(item: Item) -> Result<Vec<Affine3A>, SceneError> {
    let expected = "at least one transform, like { translate = [1, 0, 0] }";
    let none = item.error("an empty array", expected);
    let items = item.items(expected)?;
    if items.is_empty() {
        return Err(none);
    }
    items.into_iter().map(transform).collect()
}

/// `up` and `unit`. The numbers of the turn are whole, so that it rounds nothing.
fn stand(section: &mut super::Section) -> Result<Affine3A, SceneError> {
    let upright = Mat3::IDENTITY;
    let lying = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
    let turn = section.optional("up", |i| i.word(&[("y", upright), ("z", lying)]))?;
    let unit = section.optional("unit", |i| {
        if i.is_text() {
            return i.word(&UNITS);
        }
        let expected = "world units in one unit of the file, 1e-9 to 1e9; or where those are metres one of mm, cm, m, in, ft";
        i.number(expected, |x| LENGTHS.contains(&x))
    })?;
    let turn = turn.unwrap_or(upright);
    Ok(Affine3A::from_mat3(turn * unit.unwrap_or(1.0)))
}

/// Scaled, then turned about x, y and z in this order, then moved.
fn transform(item: Item) -> Result<Affine3A, SceneError> {
    let mut section = item.section(&["translate", "rotate", "scale"])?;
    let translate = section.optional("translate", |i| i.point())?;
    let rotate = section.optional("rotate", |i| {
        i.vec3("degrees about x, y and z, [x, y, z]", |_| true)
    })?;
    let scale = section.optional("scale", scale)?;
    let degrees = rotate.unwrap_or(Vec3::ZERO);
    let [x, y, z] = degrees.to_array().map(f32::to_radians);
    Ok(Affine3A::from_scale_rotation_translation(
        scale.unwrap_or(Vec3::ONE),
        Quat::from_euler(EulerRot::ZYX, z, y, x),
        translate.unwrap_or(Vec3::ZERO),
    ))
}

/// One factor, or one per axis; none is zero, or nothing would be left to hit.
fn scale(item: Item) -> Result<Vec3, SceneError> {
    let expected = "a factor or [x, y, z], none of them 0 (1e-9 to 1e9 in size)";
    if item.is_array() {
        item.vec3(expected, |v| {
            v.abs().to_array().iter().all(|x| LENGTHS.contains(x))
        })
    } else {
        let factor = item.number(expected, |x| LENGTHS.contains(&x.abs()))?;
        Ok(Vec3::splat(factor))
    }
}
