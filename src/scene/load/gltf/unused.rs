//! What a document holds that has no effect.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::document::{Document, Primitive};
use super::extensions::READ;
use super::primitive::LINE_STRIP;
use crate::scene::load::Unused;

/// The only filter of a sampler that asks for another look than ours.
const NEAREST: u32 = 9728;

/// Members of extensions that are read, which are not.
const NOT_READ: [(&str, &[&str]); 3] = [
    (
        "KHR_materials_specular",
        &["specularColorFactor", "specularColorTexture"],
    ),
    ("KHR_materials_clearcoat", &["clearcoatNormalTexture"]),
    (
        "KHR_materials_volume",
        &["thicknessFactor", "thicknessTexture"],
    ),
];

/// Of what the nodes `visible` show; `set` tells which texture coordinates a material takes, and `missing` says of textures why they have no
/// picture.
pub(super) fn of(
    document: &Document,
    visible: &[usize],
    set: impl Fn(Option<usize>) -> u32,
    missing: BTreeMap<String, usize>,
) -> Unused {
    let mut unused = Unused::default();
    unused.add(
        document.scenes.len().saturating_sub(1),
        "scene besides the one shown",
    );
    unused.add(document.animations.len(), "animation");
    let shown = Shown::of(document, visible);
    shown.attributes(document, set, &mut unused);
    unused.add(shown.still(document), "mesh with morph targets of weight 0");
    let primitives = || shown.primitives(document);
    let flat = primitives().filter(|(_, p)| p.mode <= LINE_STRIP).count();
    unused.add(flat, "primitive of points or lines");
    let used: BTreeSet<usize> = primitives().filter_map(|(_, p)| p.material).collect();
    let materials = used.iter().filter_map(|&m| document.materials.get(m));
    let mut of_materials: BTreeMap<&str, usize> = BTreeMap::new();
    for name in materials.flat_map(not_read) {
        *of_materials.entry(name).or_default() += 1;
    }
    for (name, &count) in &of_materials {
        unused.add_of(name, count, "material");
    }
    for (name, &count) in &missing {
        unused.add_of(name, count, "texture");
    }
    let nearest = document.samplers.iter();
    let nearest = nearest.filter(|s| s.mag_filter == Some(NEAREST)).count();
    if nearest > 0 {
        unused.add_of("NEAREST", nearest, "sampler");
    }
    let names = document.extensions_used.iter();
    let names: BTreeSet<&str> = names
        .chain(&document.extensions_required)
        .map(String::as_str)
        .collect();
    for name in names {
        let told = of_materials.contains_key(name) || missing.contains_key(name);
        if !told && !READ.contains(&name) {
            unused.name(name);
        }
    }
    unused
}

/// What of a material is not read, by name.
fn not_read(material: &Value) -> Vec<&str> {
    let mut names = Vec::new();
    if material["occlusionTexture"].is_object() {
        names.push("occlusionTexture");
    }
    let extensions = material["extensions"].as_object();
    for (name, extension) in extensions.into_iter().flatten() {
        match NOT_READ.iter().find(|(known, _)| known == name) {
            _ if !READ.contains(&name.as_str()) => names.push(name),
            Some((_, members)) => {
                let there = members
                    .iter()
                    .filter(|member| !extension[**member].is_null());
                names.extend(there.copied());
            }
            None => {}
        }
    }
    names
}

/// Meshes that are shown, each with whether a skin poses it and whether its morph targets move it.
struct Shown(BTreeMap<usize, Pose>);

#[derive(Default)]
struct Pose {
    skinned: bool,
    morphed: bool,
}

impl Shown {
    fn of(document: &Document, visible: &[usize]) -> Self {
        let mut meshes: BTreeMap<usize, Pose> = BTreeMap::new();
        for node in visible.iter().map(|&node| &document.nodes[node]) {
            let Some(mesh) = node.mesh.map(|mesh| mesh as usize) else {
                continue;
            };
            let weights = node
                .weights
                .as_ref()
                .unwrap_or(&document.meshes[mesh].weights);
            let pose = meshes.entry(mesh).or_default();
            pose.skinned |= node.skin.is_some();
            pose.morphed |= weights.iter().any(|&weight| weight != 0.0);
        }
        Self(meshes)
    }

    /// All primitives, each with its mesh.
    fn primitives<'d>(
        &self,
        document: &'d Document,
    ) -> impl Iterator<Item = (usize, &'d Primitive)> {
        self.0.keys().flat_map(|&mesh| {
            let primitives = document.meshes[mesh].primitives.iter();
            primitives.map(move |primitive| (mesh, primitive))
        })
    }

    /// Attributes of vertices, by the number of meshes that have them.
    fn attributes(
        &self,
        document: &Document,
        set: impl Fn(Option<usize>) -> u32,
        unused: &mut Unused,
    ) {
        let mut by_name: BTreeMap<&str, BTreeSet<usize>> = BTreeMap::new();
        for (mesh, primitive) in self.primitives(document) {
            let texcoord = format!("TEXCOORD_{}", set(primitive.material));
            let skinned = self.0[&mesh].skinned;
            for name in primitive.attributes.keys() {
                let joints = name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_");
                let read = matches!(&name[..], "POSITION" | "NORMAL")
                    || *name == texcoord
                    || joints && skinned;
                if !read {
                    by_name.entry(name).or_default().insert(mesh);
                }
            }
        }
        for (name, meshes) in by_name {
            unused.add_of(name, meshes.len(), "mesh");
        }
    }

    /// Meshes whose morph targets all have no weight.
    fn still(&self, document: &Document) -> usize {
        let has_targets = |mesh: usize| {
            let mut primitives = document.meshes[mesh].primitives.iter();
            primitives.any(|primitive| !primitive.targets.is_empty())
        };
        let still = self.0.iter().filter(|(_, pose)| !pose.morphed);
        still.filter(|(mesh, _)| has_targets(**mesh)).count()
    }
}
