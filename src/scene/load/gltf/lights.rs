//! KHR_lights_punctual: lights at nodes, which shine along the node's -Z. What a node scales does not matter to them.

use std::f32::consts::FRAC_PI_2;

use glam::{Affine3A, Vec3};

use super::document::{Document, Light};
use super::{LoadMeshErrorKind, malformed};
use crate::scene::load::{FileLight, FileLightKind, misplaced, placing};

/// The lights of the nodes `visible`.
///
/// # Errors
///
/// Numbers that no light has, and nodes where none can stand.
pub(super) fn read(
    document: &Document,
    visible: &[usize],
    worlds: &[Affine3A],
) -> Result<Vec<FileLight>, LoadMeshErrorKind> {
    let mut lights = Vec::new();
    for &node in visible {
        let Some(index) = document.nodes[node].light() else {
            continue;
        };
        let light = &document.lights()[index];
        let names = [&document.nodes[node].name, &light.name];
        let name = names.into_iter().flatten().find(|name| !name.is_empty());
        let name = name.map_or_else(|| format!("node {node}"), |name| name.to_string());
        let broken = |e| misplaced("light", &name, e);
        let world = &worlds[node];
        let position = || placing::point(world, Vec3::ZERO).map_err(broken);
        let direction = || placing::direction(world, Vec3::NEG_Z).map_err(broken);
        let place = format!("light {index}");
        let kind = match &*light.kind {
            "directional" => FileLightKind::Directional {
                direction: direction()?,
            },
            "point" => FileLightKind::Point {
                position: position()?,
                range: range(light, &place)?,
            },
            "spot" => {
                let [outer, inner] = cone(light, &place)?;
                FileLightKind::Spot {
                    position: position()?,
                    direction: direction()?,
                    range: range(light, &place)?,
                    outer,
                    inner,
                }
            }
            other => {
                let problem = format!(
                    "its type is {other:?}; expected \"directional\", \"point\" or \"spot\""
                );
                return Err(malformed(&place, problem));
            }
        };
        lights.push(FileLight {
            kind,
            intensity: intensity(light, &place)?,
            name,
        });
    }
    Ok(lights)
}

/// Colour times intensity: lux or candela.
fn intensity(light: &Light, place: &str) -> Result<Vec3, LoadMeshErrorKind> {
    let color = Vec3::from_array(light.color);
    let found = color * light.intensity;
    if light.intensity >= 0.0 && color.cmpge(Vec3::ZERO).all() && found.is_finite() {
        return Ok(found);
    }
    let problem = format!(
        "its color is {color} and its intensity {}; expected finite numbers of at least 0",
        light.intensity
    );
    Err(malformed(place, problem))
}

fn range(light: &Light, place: &str) -> Result<f32, LoadMeshErrorKind> {
    match light.range {
        None => Ok(f32::INFINITY),
        Some(range) if range > 0.0 => Ok(range),
        Some(range) => {
            let problem = format!("its range is {range}; expected a length above 0");
            Err(malformed(place, problem))
        }
    }
}

/// Outer and inner half angle.
fn cone(light: &Light, place: &str) -> Result<[f32; 2], LoadMeshErrorKind> {
    /// Exporters round the right angle.
    const SLACK: f32 = 1e-4;
    let spot = light.spot.unwrap_or_default();
    let (outer, inner) = (spot.outer_cone_angle, spot.inner_cone_angle);
    if 0.0 <= inner && inner < outer && outer <= FRAC_PI_2 + SLACK {
        return Ok([outer.min(FRAC_PI_2), inner]);
    }
    let problem = format!(
        "its cone has the angles {inner} and {outer}; expected 0 <= innerConeAngle < outerConeAngle <= pi / 2"
    );
    Err(malformed(place, problem))
}
