//! Cameras at nodes, which look along the node's -Z. `znear` and `zfar` clip nothing here.

use glam::{Affine3A, Vec3};

use super::document::{Camera, Document};
use super::{LoadMeshErrorKind, malformed};
use crate::scene::camera::FIELD_OF_VIEW;
use crate::scene::load::camera::ASPECTS;
use crate::scene::load::{FileCamera, FileProjection, misplaced};

/// The cameras of the nodes `visible`.
///
/// # Errors
///
/// Numbers that no camera has, and nodes where none can stand.
pub(super) fn read(
    document: &Document,
    visible: &[usize],
    worlds: &[Affine3A],
) -> Result<Vec<FileCamera>, LoadMeshErrorKind> {
    let mut cameras = Vec::new();
    for &node in visible {
        let Some(index) = document.nodes[node].camera else {
            continue;
        };
        let camera = &document.cameras[index as usize];
        let own = [&document.nodes[node].name, &camera.name];
        let local = FileCamera {
            names: own.map(|name| name.as_deref().unwrap_or("").to_owned()),
            position: Vec3::ZERO,
            forward: Vec3::NEG_Z,
            up: Vec3::Y,
            projection: projection(camera, &format!("camera {index}"))?,
        };
        let placed = local.placed(&worlds[node]);
        let named = || format!("node {node}");
        cameras.push(placed.map_err(|e| {
            let name = local.name();
            let name = if name.is_empty() {
                named()
            } else {
                name.to_owned()
            };
            misplaced("camera", &name, e)
        })?);
    }
    Ok(cameras)
}

fn projection(camera: &Camera, place: &str) -> Result<FileProjection, LoadMeshErrorKind> {
    match (&*camera.kind, &camera.perspective, &camera.orthographic) {
        ("perspective", Some(perspective), _) => {
            let fov = perspective.yfov;
            if !FIELD_OF_VIEW.contains(&fov.to_degrees()) {
                let (low, high) = (FIELD_OF_VIEW.start(), FIELD_OF_VIEW.end());
                let problem = format!(
                    "its yfov is {fov}; expected an angle above 0 and below pi ({low} to {high} degrees)"
                );
                return Err(malformed(place, problem));
            }
            let aspect = perspective.aspect_ratio;
            match aspect {
                Some(found) if !ASPECTS.contains(&found) => {
                    let (low, high) = (ASPECTS.start(), ASPECTS.end());
                    let problem = format!(
                        "its aspectRatio is {found}; expected a number from {low} to {high}"
                    );
                    Err(malformed(place, problem))
                }
                _ => Ok(FileProjection::Perspective { fov, aspect }),
            }
        }
        ("orthographic", _, Some(orthographic)) => {
            // The specification allows a negative magnification, and advises against it.
            let [x, y] = [orthographic.xmag, orthographic.ymag].map(|mag| 2.0 * mag.abs());
            if [x, y]
                .into_iter()
                .all(|size| size > 0.0 && size.is_finite())
            {
                return Ok(FileProjection::Orthographic {
                    width: x,
                    height: y,
                });
            }
            let problem = format!(
                "its xmag is {} and its ymag {}; expected numbers other than 0",
                orthographic.xmag, orthographic.ymag
            );
            Err(malformed(place, problem))
        }
        (kind @ ("perspective" | "orthographic"), ..) => Err(malformed(
            place,
            format!("its type is {kind:?}, and it has no member of that name"),
        )),
        (other, ..) => Err(malformed(
            place,
            format!("its type is {other:?}; expected \"perspective\" or \"orthographic\""),
        )),
    }
}
