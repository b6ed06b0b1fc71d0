//! The lights of a scene: its own, and those of its mesh files.

use glam::Affine3A;

use super::Builder;
use crate::scene::Light;
use crate::scene::error::SceneError;
use crate::scene::file::{LightTable, MeshTable, default_sun};
use crate::scene::load::{
    FileLight, LoadMeshError, LoadMeshErrorKind, LoadedFile, counted, misplaced,
};

/// Lumens of a watt where the eye sees best: what exporters multiply by that have lights in watts.
const LUMENS_PER_WATT: f32 = 683.0;

/// Lux on what a file shows from which on its lights are photometric: those of renderers without an exposure come to a few.
const PHOTOMETRIC: f64 = 50.0;

impl Builder {
    /// The lights of a scene file.
    pub(super) fn lights(&mut self, tables: &[LightTable]) -> Result<Vec<Light>, SceneError> {
        let sun = tables.iter().find_map(|light| match light {
            LightTable::Sun { direction, .. } => Some(*direction),
            _ => None,
        });
        let light = |table: &LightTable| {
            Ok(match *table {
                LightTable::Sun {
                    direction,
                    strength,
                } => Light::Sun {
                    direction,
                    strength,
                },
                LightTable::Sky {
                    turbidity,
                    strength,
                } => Light::Sky {
                    sun_direction: sun.unwrap_or_else(default_sun),
                    turbidity,
                    strength,
                },
                LightTable::Environment {
                    ref file,
                    rotation,
                    strength,
                } => Light::Environment {
                    image: self
                        .assets
                        .environment(&file.value)
                        .map_err(|e| file.asset(e))?,
                    rotation,
                    strength,
                },
                LightTable::Ready(ref light) => light.clone(),
            })
        };
        tables.iter().map(light).collect()
    }

    /// Takes the lights of the mesh file of `table`, and its cameras where it is named first: where the table places the mesh, or places it
    /// first.
    pub(super) fn lights_and_cameras(
        &mut self,
        table: &MeshTable,
        file: &LoadedFile,
    ) -> Result<(), SceneError> {
        let refused = |kind: LoadMeshErrorKind| {
            let path = table.file.value.clone();
            table.file.asset(LoadMeshError { path, kind })
        };
        let placed = |outer: &Affine3A| *outer * table.transform;
        let mut placements: Vec<Affine3A> = table.instances.iter().map(placed).collect();
        if placements.is_empty() {
            placements.push(table.transform);
        }
        if table.lights && !file.lights.is_empty() {
            let scale = table.light_scale.unwrap_or_else(|| scale(file));
            let path = table.file.value.display();
            let lights = counted(file.lights.len(), "light");
            self.notes.push(format!(
                "{path}: {lights}; a candela and a lux count as {scale} (light_scale)"
            ));
            for light in &file.lights {
                for transform in &placements {
                    let light = shining(light, transform, scale).map_err(refused)?;
                    self.file_lights.push(light);
                }
            }
        }
        let path = &table.file.value;
        if self
            .cameras
            .iter()
            .all(|offered| offered.file.value != *path)
        {
            for camera in &file.cameras {
                let placed = camera.placed(&placements[0]);
                let camera = placed.map_err(|e| refused(misplaced("camera", camera.name(), e)))?;
                self.cameras.push(super::cameras::Offered {
                    file: table.file.clone(),
                    camera,
                });
            }
        }
        Ok(())
    }
}

/// The light where `transform` moves it.
fn shining(
    light: &FileLight,
    transform: &Affine3A,
    scale: f32,
) -> Result<Light, LoadMeshErrorKind> {
    let placed = light.placed(transform);
    let placed = placed.map_err(|e| misplaced("light", &light.name, e))?;
    if (placed.intensity * scale).is_finite() {
        return Ok(placed.light(scale));
    }
    Err(LoadMeshErrorKind::Malformed {
        what: format!("light {:?}", light.name),
        problem: format!(
            "its intensity {} times {scale} is no number",
            placed.intensity
        ),
    })
}

/// What a candela and a lux are in the scene's units, by what the lights of the file come to: as they are, or as watts where they are so
/// bright that the file must mean photometric units.
fn scale(file: &LoadedFile) -> f32 {
    let bounds = file.bounds();
    let middle = 0.5 * (bounds.min + bounds.max);
    // The mean square distance of the points of a box from its middle.
    let spread = f64::from(bounds.diagonal()).powi(2) / 12.0;
    let lux = file.lights.iter().map(|l| l.illuminance(middle, spread));
    if lux.sum::<f64>() > PHOTOMETRIC {
        1.0 / LUMENS_PER_WATT
    } else {
        1.0
    }
}
