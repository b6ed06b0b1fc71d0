//! Materials of glTF 2.0, with the extensions that a principled material can follow: emissive_strength, ior,
//! transmission, volume, specular, clearcoat, sheen (KHR_materials_*) and KHR_texture_transform.
//!
//! Read from the plain JSON, since extensions add to it. What is missing or of another type than it should be is as if it were not
//! there; numbers out of range are clamped.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use serde_json::Value;

use super::buffers::Buffers;
use super::document::{Document, Image, Texture};
use super::uri::{Resource, Uris};
use super::{LoadMeshErrorKind, malformed};
use crate::scene::load::{
    FileColor, FileDetail, FileMaterial, FileScalar, FileTexture, FileTextureUse,
};
use crate::surface::{UvTransform, Wrap};

/// glTF's codes for wrap modes.
const CLAMP_TO_EDGE: u32 = 33_071;
const MIRRORED_REPEAT: u32 = 33_648;

/// The extension that names a picture of a format that is read.
const WEBP: &str = "EXT_texture_webp";

/// Reads the materials of a document.
pub(super) struct Reader<'a> {
    document: &'a Document,
    /// Per texture, its picture, if there is one that is read.
    textures: Vec<Option<FileTextureUse>>,
}

impl<'a> Reader<'a> {
    /// With all pictures looked up.
    ///
    /// # Errors
    ///
    /// What buffers and URIs can have wrong with them.
    pub fn new(
        document: &'a Document,
        buffers: &Buffers,
        uris: Uris,
    ) -> Result<Self, LoadMeshErrorKind> {
        let mut pictures = Pictures::new(document, buffers, uris);
        let images = (0..document.images.len()).map(|index| pictures.get(index));
        let images = images.collect::<Result<Vec<_>, _>>()?;
        let mut textures = Vec::with_capacity(document.textures.len());
        for texture in &document.textures {
            let source = texture.source.or_else(|| texture.source_of(WEBP));
            let picture = source.and_then(|source| images[source].clone());
            textures.push(picture.map(|source| FileTextureUse {
                source,
                wrap: wrap(document, texture),
                uv: UvTransform::default(),
                from: String::new(), // the material tells
            }));
        }
        Ok(Self { document, textures })
    }
}

/// Copies the pictures that buffers hold, each once: they outlive the buffers.
struct Pictures<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    uris: Uris<'a>,
    /// By where they lie.
    copied: HashMap<*const [u8], Arc<[u8]>>,
    /// Bytes that may still be copied: pictures do not overlap.
    left: usize,
}

impl<'a> Pictures<'a> {
    fn new(document: &'a Document, buffers: &'a Buffers<'a>, uris: Uris<'a>) -> Self {
        Self {
            document,
            buffers,
            uris,
            copied: HashMap::new(),
            left: buffers.len(),
        }
    }

    /// Picture number `index`, if the document says where it is.
    fn get(&mut self, index: usize) -> Result<Option<FileTexture>, LoadMeshErrorKind> {
        let image = &self.document.images[index];
        let what = format!("image {index}");
        Ok(match (&image.uri, image.buffer_view) {
            (Some(uri), _) => Some(match self.uris.resolve(uri, &what)? {
                Resource::Bytes(bytes) => FileTexture::Embedded {
                    name: called(index, image),
                    bytes: bytes.into(),
                },
                Resource::File(file) => FileTexture::Path(file),
            }),
            (None, Some(view)) => {
                let bytes = self.buffers.view(view as usize)?;
                Some(FileTexture::Embedded {
                    name: called(index, image),
                    bytes: self.copy(bytes, &what)?,
                })
            }
            (None, None) => None,
        })
    }

    fn copy(&mut self, bytes: &[u8], what: &str) -> Result<Arc<[u8]>, LoadMeshErrorKind> {
        if let Some(copy) = self.copied.get(&(&raw const *bytes)) {
            return Ok(copy.clone());
        }
        let left = self.left.checked_sub(bytes.len());
        self.left = left.ok_or_else(|| malformed(what, "it overlaps with other pictures"))?;
        let copy: Arc<[u8]> = bytes.into();
        self.copied.insert(bytes, copy.clone());
        Ok(copy)
    }
}

/// What messages call a picture inside the file.
fn called(index: usize, image: &Image) -> String {
    match &image.name {
        Some(name) => format!("image {index} {name:?}"),
        None => format!("image {index}"),
    }
}

/// What a texture has for a picture that is not read.
fn what_it_lacks(texture: &Texture) -> String {
    match (texture.source, texture.extensions.keys().next()) {
        (None, Some(extension)) => extension.clone(),
        _ => "no picture".to_owned(),
    }
}

/// The wrap modes along s and t.
fn wrap(document: &Document, texture: &Texture) -> [Wrap; 2] {
    let sampler = texture.sampler.map(|index| &document.samplers[index]);
    let codes = sampler.map_or([None; 2], |sampler| [sampler.wrap_s, sampler.wrap_t]);
    codes.map(|code| match code {
        Some(CLAMP_TO_EDGE) => Wrap::Clamp,
        Some(MIRRORED_REPEAT) => Wrap::Mirror,
        _ => Wrap::Repeat,
    })
}

impl Reader<'_> {
    /// The textures without a picture that is read, in whose place materials have their factors alone, counted by the extension that has one.
    pub fn missing(&self) -> BTreeMap<String, usize> {
        let mut missing = BTreeMap::new();
        let textures = self.document.textures.iter().zip(&self.textures);
        for (texture, _) in textures.filter(|(_, picture)| picture.is_none()) {
            *missing.entry(what_it_lacks(texture)).or_default() += 1;
        }
        missing
    }

    /// Material number `index`.
    pub fn material(&self, index: usize) -> Option<FileMaterial> {
        let m = self.document.materials.get(index)?;
        let extension = |name: &str| format!("/extensions/KHR_materials_{name}");
        let number = |at: String, default: f32| number(m, &at, default);
        let pbr = "/pbrMetallicRoughness";
        let strength = number(extension("emissive_strength") + "/emissiveStrength", 1.0).max(0.0);
        let mut emission = self.color(m, "/emissiveFactor", "/emissiveTexture", Vec3::ZERO);
        emission.factor *= strength;
        let rough_metal = self.texture(m, &format!("{pbr}/metallicRoughnessTexture"));
        let of_rough_metal = |factor: &str, channel| FileScalar {
            factor: number(format!("{pbr}/{factor}"), 1.0).clamp(0.0, 1.0),
            texture: rough_metal.clone().map(|t| (t, channel)),
        };
        let scalar = |name: &str, factor: &str, texture: &str, channel, default: f32| {
            let at = extension(name);
            FileScalar {
                factor: number(format!("{at}/{factor}"), default).clamp(0.0, 1.0),
                texture: self
                    .texture(m, &format!("{at}/{texture}"))
                    .map(|t| (t, channel)),
            }
        };
        let (volume, sheen) = (extension("volume"), extension("sheen"));
        let mut specular = scalar("specular", "specularFactor", "specularTexture", "a", 1.0);
        // glTF's 1 is the reflectance that follows from the index; ours is 0.5.
        specular.factor *= 0.5;
        let distance = number(volume.clone() + "/attenuationDistance", f32::INFINITY);
        Some(FileMaterial {
            name: m["name"].as_str().unwrap_or("").to_owned(),
            base_color: self.color(
                m,
                &format!("{pbr}/baseColorFactor"),
                &format!("{pbr}/baseColorTexture"),
                Vec3::ONE,
            ),
            metallic: of_rough_metal("metallicFactor", "b"),
            roughness: of_rough_metal("roughnessFactor", "g"),
            specular,
            ior: number(extension("ior") + "/ior", 1.5).clamp(1.0, 3.0),
            transmission: scalar(
                "transmission",
                "transmissionFactor",
                "transmissionTexture",
                "r",
                0.0,
            ),
            attenuation_color: vector(m, &(volume + "/attenuationColor"), Vec3::ONE)
                .clamp(Vec3::ZERO, Vec3::ONE),
            attenuation_distance: if distance > 0.0 {
                distance
            } else {
                f32::INFINITY
            },
            coat: scalar("clearcoat", "clearcoatFactor", "clearcoatTexture", "r", 0.0),
            coat_roughness: scalar(
                "clearcoat",
                "clearcoatRoughnessFactor",
                "clearcoatRoughnessTexture",
                "g",
                0.0,
            ),
            sheen_color: self.color(
                m,
                &format!("{sheen}/sheenColorFactor"),
                &format!("{sheen}/sheenColorTexture"),
                Vec3::ZERO,
            ),
            sheen_roughness: scalar(
                "sheen",
                "sheenRoughnessFactor",
                "sheenRoughnessTexture",
                "a",
                0.0,
            ),
            emission,
            opacity: self.opacity(m),
            opacity_cutoff: (m["alphaMode"] == "MASK")
                .then(|| number("/alphaCutoff".into(), 0.5).max(0.0)),
            detail: self
                .texture(m, "/normalTexture")
                .map(|texture| FileDetail::NormalMap {
                    texture,
                    strength: number("/normalTexture/scale".into(), 1.0),
                }),
            displacement: None,
        })
    }

    /// The alpha of the base colour, unless the mode is OPAQUE.
    fn opacity(&self, m: &Value) -> FileScalar {
        if !matches!(m["alphaMode"].as_str(), Some("MASK" | "BLEND")) {
            return FileScalar::constant(1.0);
        }
        FileScalar {
            factor: number(m, "/pbrMetallicRoughness/baseColorFactor/3", 1.0).clamp(0.0, 1.0),
            texture: self
                .texture(m, "/pbrMetallicRoughness/baseColorTexture")
                .map(|t| (t, "a")),
        }
    }

    /// The name of material number `index`, perhaps empty.
    pub fn name(&self, index: usize) -> &str {
        let material = self.document.materials.get(index);
        material.and_then(|m| m["name"].as_str()).unwrap_or("")
    }

    /// The transform that undoes the quantisation of a mesh's texture coordinates (KHR_mesh_quantization): the one that all textures of
    /// material number `index` share. The mesh's coordinates take it in, so that a displacement map lies right, and the
    /// material's textures do without.
    pub fn dequantization(&self, index: usize) -> Option<UvTransform> {
        self.document
            .materials
            .get(index)
            .and_then(|m| self.shared_transform(m))
    }

    fn shared_transform(&self, m: &Value) -> Option<UvTransform> {
        if !self.document.uses("KHR_mesh_quantization") {
            return None;
        }
        let mut transforms = Vec::new();
        each_texture(m, &mut |info| {
            transforms.push(uv_transform(transform_of(info)))
        });
        let (first, others) = transforms.split_first()?;
        others.iter().all(|other| other == first).then_some(*first)
    }

    /// The sets of texture coordinates that the textures of material number `index` are read by, but for occlusion, which we do not read.
    pub fn texcoord_sets(&self, index: usize) -> BTreeSet<u32> {
        let mut sets = BTreeSet::new();
        if let Some(m) = self.document.materials.get(index) {
            each_texture(m, &mut |info| {
                let set = transform_of(info)["texCoord"].as_u64();
                let set = set.or(info["texCoord"].as_u64());
                sets.insert(set.unwrap_or(0).try_into().unwrap_or(u32::MAX));
            });
        }
        sets
    }

    fn color(&self, m: &Value, factor: &str, texture: &str, default: Vec3) -> FileColor {
        FileColor {
            factor: vector(m, factor, default).max(Vec3::ZERO),
            texture: self.texture(m, texture),
        }
    }

    /// The texture that the object at `pointer` refers to.
    fn texture(&self, m: &Value, pointer: &str) -> Option<FileTextureUse> {
        let info = m.pointer(pointer)?;
        let index = usize::try_from(info["index"].as_u64()?).ok()?;
        let texture = self.textures.get(index)?.clone()?;
        Some(FileTextureUse {
            uv: match self.shared_transform(m) {
                Some(_) => UvTransform::default(),
                None => uv_transform(transform_of(info)),
            },
            from: format!(
                "{} of material {:?}",
                pointer.rsplit('/').next().unwrap_or(pointer),
                m["name"].as_str().unwrap_or("")
            ),
            ..texture
        })
    }
}

/// The extension's transform, which is of coordinates with v down and turns the other way, for v up:
/// with t = 1 - v, the offset takes up what the flip moves.
fn uv_transform(t: &Value) -> UvTransform {
    let pair = |key: &str, default: Vec2| {
        let component = |i: usize, default: f32| number(&t[key], &format!("/{i}"), default);
        Vec2::new(component(0, default.x), component(1, default.y))
    };
    if !t.is_object() {
        return UvTransform::default();
    }
    let (offset, scale) = (pair("offset", Vec2::ZERO), pair("scale", Vec2::ONE));
    let rotation = number(t, "/rotation", 0.0);
    let (sin, cos) = rotation.sin_cos();
    UvTransform {
        scale,
        rotation,
        offset: Vec2::new(offset.x + sin * scale.y, 1.0 - offset.y - cos * scale.y),
    }
}

/// Shows `visit` every reference of a material to a texture, but for occlusion, which is not read.
fn each_texture(m: &Value, visit: &mut impl FnMut(&Value)) {
    for (key, value) in m.as_object().into_iter().flatten() {
        if key == "occlusionTexture" {
            continue;
        }
        if value["index"].is_u64() {
            visit(value);
        } else {
            each_texture(value, visit);
        }
    }
}

/// The extension's object, if it is there.
fn transform_of(info: &Value) -> &Value {
    &info["extensions"]["KHR_texture_transform"]
}

fn number(m: &Value, pointer: &str, default: f32) -> f32 {
    let found = m.pointer(pointer).and_then(Value::as_f64);
    found
        .map(|x| x as f32)
        .filter(|x| x.is_finite())
        .unwrap_or(default)
}

fn vector(m: &Value, pointer: &str, default: Vec3) -> Vec3 {
    let component = |i: usize| number(m, &format!("{pointer}/{i}"), default[i]);
    Vec3::new(component(0), component(1), component(2))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn texture_transforms_are_turned_upside_down() {
        let t = json!({ "offset": [0.25, 0.5], "rotation": 0.5, "scale": [2.0, 3.0] });
        let uv = uv_transform(&t);
        let (sin, cos) = 0.5_f32.sin_cos();
        for (u, v) in [(0.0, 0.0), (0.3, 0.9), (1.0, 0.2)] {
            // KHR_texture_transform: translation * rotation * scale, counter-clockwise as seen with v down.
            let (x, y) = (2.0 * u, 3.0 * v);
            let expected = Vec2::new(0.25 + cos * x + sin * y, 0.5 - sin * x + cos * y);
            let found = uv.apply(Vec2::new(u, 1.0 - v));
            let found = Vec2::new(found.x, 1.0 - found.y);
            assert!(found.abs_diff_eq(expected, 1e-6), "{found} {expected}");
        }
        assert_eq!(uv_transform(&Value::Null), UvTransform::default());
    }
}
