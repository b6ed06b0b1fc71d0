//! The JSON of glTF 2.0, as far as it is read, and every index in it checked in one place (`check`).
//!
//! A [`Document`] that [`Document::parse`] gives out holds no index that leads nowhere, so that the rest of this room may
//! follow them. Offsets and lengths are checked where bytes are taken, since those are not part of the document.

mod check;
mod view;

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use super::super::draco::Compressed;
use super::{LoadMeshErrorKind, malformed};
pub(super) use view::{Camera, Light};
use view::{DocumentExtensions, LightOfNode};

/// A whole document. Materials stay JSON, since many extensions add to them.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    asset: Asset,
    #[serde(default)]
    pub extensions_used: Vec<String>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub skins: Vec<Skin>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub materials: Vec<Value>,
    #[serde(default)]
    pub textures: Vec<Texture>,
    #[serde(default)]
    pub images: Vec<Image>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
    #[serde(default)]
    pub animations: Vec<Animation>,
    #[serde(default)]
    pub cameras: Vec<Camera>,
    extensions: Option<DocumentExtensions>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Node {
    pub name: Option<Box<str>>,
    #[serde(default)]
    pub children: Box<[u32]>,
    pub mesh: Option<u32>,
    pub skin: Option<u32>,
    pub camera: Option<u32>,
    pub weights: Option<Box<[f32]>>,
    pub matrix: Option<Box<[f32; 16]>>,
    pub translation: Option<Box<[f32; 3]>>,
    pub rotation: Option<Box<[f32; 4]>>,
    pub scale: Option<Box<[f32; 3]>>,
    extensions: Option<Box<NodeExtensions>>,
}

#[derive(Debug, Deserialize)]
struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    instancing: Option<Instancing>,
    #[serde(rename = "KHR_node_visibility")]
    visibility: Option<Visibility>,
    #[serde(rename = "KHR_lights_punctual")]
    light: Option<LightOfNode>,
}

/// EXT_mesh_gpu_instancing: accessors by attribute.
#[derive(Debug, Deserialize)]
pub(super) struct Instancing {
    pub attributes: BTreeMap<String, usize>,
}

#[derive(Debug, Deserialize)]
struct Visibility {
    #[serde(default = "yes")]
    visible: bool,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
pub(super) struct Mesh {
    pub name: Option<Box<str>>,
    pub primitives: Vec<Primitive>,
    #[serde(default)]
    pub weights: Box<[f32]>,
}

/// From semantics (`POSITION`) to accessors.
type Attributes = BTreeMap<String, usize>;

#[derive(Debug, Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u32,
    #[serde(default)]
    pub targets: Vec<Attributes>,
    extensions: Option<PrimitiveExtensions>,
}

fn triangles() -> u32 {
    4
}

#[derive(Debug, Deserialize)]
struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    draco: Option<Compressed>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub joints: Vec<usize>,
    pub inverse_bind_matrices: Option<usize>,
    skeleton: Option<usize>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<u32>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: Shape,
    #[serde(default)]
    pub min: Box<[f32]>,
    #[serde(default)]
    pub max: Box<[f32]>,
    pub sparse: Option<Box<Sparse>>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

#[derive(Debug, Deserialize)]
pub(super) struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: u32,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    extensions: Option<Box<ViewExtensions>>,
}

#[derive(Debug, Deserialize)]
struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    meshopt: Option<Meshopt>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr_meshopt: Option<Meshopt>,
}

/// EXT_meshopt_compression of a buffer view, or KHR_meshopt_compression, which has one filter more.
#[derive(Debug, Deserialize, PartialEq, Eq, Hash)]
#[serde(rename_all = "camelCase")]
pub(super) struct Meshopt {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: usize,
    pub count: usize,
    pub mode: MeshoptMode,
    #[serde(default)]
    pub filter: MeshoptFilter,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Hash)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum MeshoptMode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, Hash)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum MeshoptFilter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
    extensions: Option<BufferExtensions>,
}

#[derive(Debug, Deserialize)]
struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    meshopt: Option<Fallback>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr_meshopt: Option<Fallback>,
}

#[derive(Debug, Deserialize)]
struct Fallback {
    #[serde(default)]
    fallback: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct Texture {
    pub sampler: Option<usize>,
    pub source: Option<usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, Value>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    pub name: Option<String>,
    pub uri: Option<String>,
    pub buffer_view: Option<u32>,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Sampler {
    pub wrap_s: Option<u32>,
    pub wrap_t: Option<u32>,
    pub mag_filter: Option<u32>,
}

/// Not played, but its indices must lead somewhere as all others.
#[derive(Debug, Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    channels: Vec<Channel>,
    #[serde(default)]
    samplers: Vec<AnimationSampler>,
}

#[derive(Debug, Deserialize)]
struct Channel {
    sampler: Option<usize>,
    target: Option<Target>,
}

#[derive(Debug, Deserialize)]
struct Target {
    node: Option<usize>,
}

#[derive(Debug, Deserialize)]
struct AnimationSampler {
    input: Option<usize>,
    output: Option<usize>,
}

impl Document {
    /// Reads the text and checks all its indices.
    ///
    /// # Errors
    ///
    /// JSON that does not follow the specification, with line and column; another version than 2; an index that leads nowhere.
    pub fn parse(json: &[u8]) -> Result<Self, LoadMeshErrorKind> {
        let document: Self =
            serde_json::from_slice(json).map_err(|e| malformed("glTF document", e.to_string()))?;
        let Asset {
            version,
            min_version,
        } = &document.asset;
        let needed = min_version.as_ref().unwrap_or(version);
        if needed.split('.').next() != Some("2") {
            return Err(LoadMeshErrorKind::Unsupported {
                what: format!("version {needed:?} of glTF; only version 2.0"),
            });
        }
        document.check()?;
        Ok(document)
    }

    /// The roots of the default scene, or of the first one.
    pub fn roots(&self) -> Option<&[usize]> {
        let scene = self.scenes.get(self.scene.unwrap_or(0))?;
        Some(&scene.nodes)
    }

    /// The roots of every scene, by the scene's index.
    pub fn all_roots(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let scenes = self.scenes.iter().enumerate();
        scenes.flat_map(|(index, scene)| scene.nodes.iter().map(move |&node| (index, node)))
    }

    /// Those of KHR_lights_punctual.
    pub fn lights(&self) -> &[Light] {
        let extension = self.extensions.as_ref().and_then(|e| e.lights.as_ref());
        extension.map_or(&[], |lights| &lights.lights)
    }

    /// Whether the file says that it uses an extension.
    pub fn uses(&self, extension: &str) -> bool {
        self.extensions_used.iter().any(|name| name == extension)
    }
}

impl Node {
    pub fn instancing(&self) -> Option<&Instancing> {
        self.extensions.as_ref()?.instancing.as_ref()
    }

    /// The light that it places.
    pub fn light(&self) -> Option<usize> {
        Some(self.extensions.as_ref()?.light.as_ref()?.light)
    }

    /// KHR_node_visibility: an invisible node hides all below it, too.
    pub fn is_visible(&self) -> bool {
        let visibility = self.extensions.as_ref().and_then(|e| e.visibility.as_ref());
        visibility.is_none_or(|v| v.visible)
    }
}

impl Primitive {
    pub fn draco(&self) -> Option<&Compressed> {
        self.extensions.as_ref()?.draco.as_ref()
    }
}

impl Accessor {
    /// Whether it has no bytes of its own: all zeros, or the announcement of what a stream holds.
    pub fn is_nothing(&self) -> bool {
        self.buffer_view.is_none() && self.sparse.is_none()
    }

    pub fn is_float(&self) -> bool {
        self.component_type == 5126
    }
}

impl BufferView {
    pub fn meshopt(&self) -> Option<&Meshopt> {
        let extensions = self.extensions.as_ref()?;
        extensions
            .khr_meshopt
            .as_ref()
            .or(extensions.meshopt.as_ref())
    }
}

impl Buffer {
    /// Whether it is only there for readers that do not know meshopt's streams, and may have no bytes.
    pub fn is_fallback(&self) -> bool {
        let extensions = self.extensions.iter();
        let mut fallbacks = extensions.flat_map(|e| e.meshopt.iter().chain(&e.khr_meshopt));
        fallbacks.any(|f| f.fallback)
    }
}

impl Texture {
    /// The image that an extension names.
    pub fn source_of(&self, extension: &str) -> Option<usize> {
        let source = self.extensions.get(extension)?["source"].as_u64()?;
        Some(usize::try_from(source).unwrap_or(usize::MAX))
    }
}
