//! Every index of a document leads somewhere, or the document is refused.

use std::collections::BTreeMap;
use std::fmt::Display;

use serde_json::Value;

use super::super::{LoadMeshErrorKind, malformed};
use super::Document;

impl Document {
    /// # Errors
    ///
    /// The first index that leads nowhere, and where it stands.
    pub(super) fn check(&self) -> Result<(), LoadMeshErrorKind> {
        self.check_scenes()?;
        self.check_meshes()?;
        self.check_data()?;
        self.check_pictures()?;
        self.check_animations()
    }

    fn check_scenes(&self) -> Result<(), LoadMeshErrorKind> {
        if let Some(scene) = self.scene {
            leads("glTF document", "scene", scene, self.scenes.len())?;
        }
        for (index, node) in self.all_roots() {
            leads(
                format_args!("scene {index}"),
                "node",
                node,
                self.nodes.len(),
            )?;
        }
        for (index, node) in self.nodes.iter().enumerate() {
            let place = format_args!("node {index}").to_string();
            for &child in &node.children {
                leads(&place, "node", child as usize, self.nodes.len())?;
            }
            for (what, found, count) in [
                ("mesh", node.mesh, self.meshes.len()),
                ("skin", node.skin, self.skins.len()),
                ("camera", node.camera, self.cameras.len()),
            ] {
                maybe_leads(&place, what, found.map(|i| i as usize), count)?;
            }
            maybe_leads(&place, "light", node.light(), self.lights().len())?;
            for accessor in node.instancing().iter().flat_map(|i| i.attributes.values()) {
                leads(&place, "accessor", *accessor, self.accessors.len())?;
            }
        }
        for (index, skin) in self.skins.iter().enumerate() {
            let place = format!("skin {index}");
            for &joint in skin.joints.iter().chain(&skin.skeleton) {
                leads(&place, "node", joint, self.nodes.len())?;
            }
            let matrices = skin.inverse_bind_matrices;
            maybe_leads(&place, "accessor", matrices, self.accessors.len())?;
        }
        Ok(())
    }

    fn check_meshes(&self) -> Result<(), LoadMeshErrorKind> {
        for (m, mesh) in self.meshes.iter().enumerate() {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let place = format!("mesh {m} primitive {p}");
                let maps = primitive.targets.iter().chain([&primitive.attributes]);
                for &accessor in maps.flat_map(BTreeMap::values).chain(&primitive.indices) {
                    leads(&place, "accessor", accessor, self.accessors.len())?;
                }
                maybe_leads(&place, "material", primitive.material, self.materials.len())?;
                if let Some(draco) = primitive.draco() {
                    leads(
                        &place,
                        "buffer view",
                        draco.buffer_view,
                        self.buffer_views.len(),
                    )?;
                }
            }
        }
        Ok(())
    }

    fn check_data(&self) -> Result<(), LoadMeshErrorKind> {
        let views = self.buffer_views.len();
        for (index, accessor) in self.accessors.iter().enumerate() {
            let sparse = accessor.sparse.iter();
            let sparse = sparse.flat_map(|s| [s.indices.buffer_view, s.values.buffer_view]);
            for view in accessor.buffer_view.into_iter().chain(sparse) {
                leads(
                    format_args!("accessor {index}"),
                    "buffer view",
                    view as usize,
                    views,
                )?;
            }
        }
        for (index, view) in self.buffer_views.iter().enumerate() {
            let stream = view.meshopt().map(|stream| stream.buffer);
            for buffer in [view.buffer].into_iter().chain(stream) {
                leads(
                    format_args!("buffer view {index}"),
                    "buffer",
                    buffer,
                    self.buffers.len(),
                )?;
            }
        }
        Ok(())
    }

    fn check_pictures(&self) -> Result<(), LoadMeshErrorKind> {
        for (index, image) in self.images.iter().enumerate() {
            let view = image.buffer_view.map(|view| view as usize);
            maybe_leads(
                format_args!("image {index}"),
                "buffer view",
                view,
                self.buffer_views.len(),
            )?;
        }
        for (index, texture) in self.textures.iter().enumerate() {
            let place = format!("texture {index}");
            maybe_leads(&place, "sampler", texture.sampler, self.samplers.len())?;
            maybe_leads(&place, "image", texture.source, self.images.len())?;
            for source in texture.extensions.values().map(|e| &e["source"]) {
                Self::check_index(source, &place, "image", self.images.len())?;
            }
        }
        for (index, material) in self.materials.iter().enumerate() {
            self.check_textures(material, &format!("material {index}"))?;
        }
        Ok(())
    }

    /// Whatever is called a texture in a material, in extensions that we do not know too. Not deep: the parser ends at 128 levels.
    fn check_textures(&self, value: &Value, place: &str) -> Result<(), LoadMeshErrorKind> {
        for (key, value) in value.as_object().into_iter().flatten() {
            let index = &value["index"];
            if !key.to_lowercase().ends_with("texture") || index.is_null() {
                self.check_textures(value, place)?;
                continue;
            }
            Self::check_index(index, place, "texture", self.textures.len())?;
        }
        Ok(())
    }

    /// An index inside of what is not typed; none leads nowhere.
    fn check_index(
        index: &Value,
        place: &str,
        what: &'static str,
        count: usize,
    ) -> Result<(), LoadMeshErrorKind> {
        if index.is_null() {
            return Ok(());
        }
        let Some(index) = index.as_u64() else {
            let problem = format!("its {what} is number {index}; expected a whole number from 0");
            return Err(malformed(place, problem));
        };
        leads(
            place,
            what,
            usize::try_from(index).unwrap_or(usize::MAX),
            count,
        )
    }

    fn check_animations(&self) -> Result<(), LoadMeshErrorKind> {
        for (index, animation) in self.animations.iter().enumerate() {
            let place = format!("animation {index}");
            for channel in &animation.channels {
                maybe_leads(&place, "sampler", channel.sampler, animation.samplers.len())?;
                let node = channel.target.as_ref().and_then(|target| target.node);
                maybe_leads(&place, "node", node, self.nodes.len())?;
            }
            for accessor in animation.samplers.iter().flat_map(|s| [s.input, s.output]) {
                maybe_leads(&place, "accessor", accessor, self.accessors.len())?;
            }
        }
        Ok(())
    }
}

/// Refuses an index that is not below the number of what it counts.
fn leads(
    place: impl Display,
    what: &'static str,
    index: usize,
    count: usize,
) -> Result<(), LoadMeshErrorKind> {
    if index < count {
        return Ok(());
    }
    Err(LoadMeshErrorKind::IndexOutOfRange {
        place: place.to_string(),
        what,
        index: i64::try_from(index).unwrap_or(i64::MAX),
        count,
        counted: " (counted from 0)",
    })
}

fn maybe_leads(
    place: impl Display,
    what: &'static str,
    index: Option<usize>,
    count: usize,
) -> Result<(), LoadMeshErrorKind> {
    index.map_or(Ok(()), |index| leads(place, what, index, count))
}
