//! The scene before it is framed: mesh and maps are loaded, and tell the sizes that the rest is made from.

use std::sync::Arc;

use super::scale::{Scale, guess};
use super::text::{self, Numbers};
use super::view::{facing, fit};
use super::{Lookdev, LookdevError, Made, OPEN_SCALE, Place};
use crate::prism::{PrismOptions, Prisms};
use crate::ray::Aabb;
use crate::scene::build::{Assets, displaced, reach};
use crate::scene::load::LoadOptions;
use crate::scene::{Loaded, ObjectShape, Scene, SceneObject};
use crate::surface::Displacement;

/// A scene whose scale, camera and floor are still missing. What is changed of its film, its integrator and how its surface is traced
/// goes into the finished scene.
pub struct Draft<'a> {
    pub(super) request: &'a Lookdev,
    pub(super) place: Place<'a>,
    pub(super) overrides: &'a [String],
    pub(super) options: LoadOptions,
    pub(super) loaded: Loaded,
    pub(super) assets: Assets,
}

impl Draft<'_> {
    /// The scene so far.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.loaded.scene
    }

    /// Guesses, frames, and loads the scene as it is then; maps are not read again.
    ///
    /// # Errors
    ///
    /// A file that has changed meanwhile; a surface that cannot be displaced so far; a camera below the floor.
    pub fn finish(self) -> Result<Made, LookdevError> {
        let request = self.request;
        let scale = self.scale();
        let boxes = self.boxes(&scale)?;
        let whole = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        let front = request.view.bearing(facing(self.subject()));
        let Scene { film, camera, .. } = &self.loaded.scene;
        let aspect = film.width as f32 / film.height as f32;
        let bearing = front.turned(request.orbit);
        let framing = fit(&boxes, bearing, (0.5 * camera.fov).tan(), aspect);
        if request.floor && framing.position.y <= whole.min.y {
            return Err(LookdevError::BelowFloor);
        }
        let middle = 0.5 * (whole.min + whole.max);
        let numbers = Numbers {
            framing: Some(framing),
            size: whole.diagonal(),
            foot: middle.with_y(whole.min.y),
            azimuth: front.azimuth,
            has_materials: self.loaded.default_material.is_none(),
            film: *film,
            integrator: self.loaded.scene.integrator,
            prisms: self.prisms(),
            scale,
        };
        let text = text::scene(request, &numbers, self.place.folder())?;
        let (loaded, _) =
            request.load(&text, self.place, self.overrides, self.options, self.assets)?;
        Ok(Made {
            loaded,
            text,
            notes: notes(request, &numbers.scale),
        })
    }

    /// The mesh's objects; the floor is the last of the scene's.
    fn subject(&self) -> &[SceneObject] {
        let objects = &self.loaded.scene.objects;
        &objects[..objects.len() - usize::from(self.request.floor)]
    }

    pub(super) fn check_texcoords(&self) -> Result<(), LookdevError> {
        if !self.request.maps.has_picture() {
            return Ok(());
        }
        let mut objects = self.subject().iter();
        let bare = objects.find(|object| match &object.shape {
            ObjectShape::Displaced(..) => false, // or there would be none
            ObjectShape::Plain(mesh) => mesh.texcoords().is_empty(),
        });
        bare.map_or(Ok(()), |object| {
            Err(self.request.no_texcoords(object.name.clone()))
        })
    }

    /// As given, with the options or laid over the scene, else guessed.
    fn scale(&self) -> Scale {
        let request = self.request;
        let surfaces = self
            .subject()
            .iter()
            .filter_map(|object| match &object.shape {
                ObjectShape::Displaced(surface, _) => Some(surface),
                ObjectShape::Plain(_) => None,
            });
        let size = self.subject().iter().map(|object| match &object.shape {
            ObjectShape::Displaced(surface, _) => surface.mesh().bounds(),
            ObjectShape::Plain(mesh) => mesh.bounds(),
        });
        let size = size.fold(Aabb::EMPTY, Aabb::union).diagonal();
        let Some(surface) = surfaces.into_iter().next() else {
            return Scale {
                scale: 1.0,
                midlevel: 0.0,
                why: None,
            };
        };
        let Displacement {
            scale, midlevel, ..
        } = *surface.displacement();
        let laid = Some(midlevel).filter(|&midlevel| midlevel != 0.0);
        guess(
            surface.map(),
            size,
            request.uv_scale.abs().max_element(),
            (
                Some(scale).filter(|&scale| scale != OPEN_SCALE),
                request.midlevel.or(laid),
            ),
        )
    }

    /// How the surface is traced, as it has been changed.
    fn prisms(&self) -> PrismOptions {
        let mut objects = self.subject().iter();
        let options = objects.find_map(|object| match object.shape {
            ObjectShape::Displaced(_, options) => Some(options),
            ObjectShape::Plain(_) => None,
        });
        options.unwrap_or_default()
    }

    /// Boxes around everything where it stands: blocks of displaced surfaces, vertices of others.
    fn boxes(&self, scale: &Scale) -> Result<Vec<Aabb>, LookdevError> {
        /// Of more of them each object's whole box is taken, wherever it stands.
        const MOST: usize = 1 << 20;
        let mut boxes = Vec::new();
        for object in self.subject() {
            let own: Vec<Aabb> = match &object.shape {
                ObjectShape::Displaced(surface, _) => {
                    let displacement = Displacement {
                        scale: scale.scale,
                        midlevel: scale.midlevel,
                        ..*surface.displacement()
                    };
                    let map = (self.request.map(), surface.map());
                    let mesh = surface.mesh().clone();
                    let surface = displaced(&object.name, mesh, map, displacement)?;
                    let prisms = Prisms::new(Arc::new(surface), PrismOptions::default())?;
                    // A block's own box is wide where normals all but cancel each other.
                    let farthest = reach(prisms.surface());
                    let blocks = (0..prisms.len() as u32).map(|p| prisms.bounds(p));
                    blocks.map(|block| block.intersection(farthest)).collect()
                }
                ObjectShape::Plain(mesh) => {
                    let points = mesh.positions().iter();
                    points.map(|&p| Aabb { min: p, max: p }).collect()
                }
            };
            if object.instances.is_empty() {
                boxes.extend(own);
                continue;
            }
            let own = if own.len().saturating_mul(object.instances.len()) > MOST {
                vec![own.into_iter().fold(Aabb::EMPTY, Aabb::union)]
            } else {
                own
            };
            for transform in &object.instances {
                boxes.extend(own.iter().map(|b| {
                    let corners = b.corners().map(|p| transform.transform_point3(p));
                    corners.into_iter().fold(Aabb::EMPTY, Aabb::including)
                }));
            }
        }
        Ok(boxes)
    }
}

/// What was guessed, and what stands beside it.
fn notes(request: &Lookdev, scale: &Scale) -> Vec<String> {
    let mut notes = Vec::new();
    if request.maps.displacement.is_none() {
        return notes;
    }
    if let Scale {
        scale,
        midlevel,
        why: Some(why),
    } = scale
    {
        let from = match request.midlevel {
            None if *midlevel != 0.0 => format!(", midlevel {midlevel}"),
            _ => String::new(),
        };
        notes.push(format!(
            "displacement scale {scale}{from} ({why}; --scale sets it)"
        ));
    }
    if request.maps.normal_map.is_some() {
        notes.push(
            "the normal map bends normals on top of the displacement; where both have the same relief it counts twice \
             (--normal-map none leaves it out)"
                .into(),
        );
    }
    notes
}
