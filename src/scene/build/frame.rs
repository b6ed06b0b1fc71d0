//! The camera that nobody placed: it frames the whole scene from a three-quarter view.

use glam::{Vec3, Vec3A};

use crate::ray::Aabb;
use crate::scene::error::SceneError;
use crate::scene::file::{CameraTable, LensTable, ProjectionTable};
use crate::scene::load::{FileCamera, FileProjection};
use crate::scene::{Camera, Lens, ObjectShape, Projection, SceneObject};
use crate::surface::DisplacedSurface;

/// From the middle of the scene to the eye: half from the right, a little from above.
const THREE_QUARTER: Vec3 = Vec3::new(0.55, 0.45, 1.0);

/// The box over all objects where they stand, grown by how far they are displaced.
pub(super) fn bounds(objects: &[SceneObject]) -> Aabb {
    let object = |object: &SceneObject| {
        let own = match &object.shape {
            ObjectShape::Displaced(surface, _) => reach(surface),
            ObjectShape::Plain(mesh) => mesh.bounds(),
        };
        if object.instances.is_empty() {
            return own;
        }
        let placed = object.instances.iter().flat_map(|transform| {
            own.corners()
                .map(|p| Vec3::from(transform.transform_point3a(Vec3A::from(p))))
        });
        placed.fold(Aabb::EMPTY, Aabb::including)
    };
    objects.iter().map(object).fold(Aabb::EMPTY, Aabb::union)
}

/// The box around a mesh, as far as it could be displaced in any direction.
pub(in crate::scene) fn reach(surface: &DisplacedSurface) -> Aabb {
    let (low, high) = surface.range();
    let reach = low.abs().max(high.abs());
    let Aabb { min, max } = surface.mesh().bounds();
    Aabb {
        min: min - reach,
        max: max + reach,
    }
}

/// The camera of a file, framed where it says nothing.
pub(super) fn camera(table: &CameraTable, bounds: Aabb) -> Result<Camera, SceneError> {
    let middle = 0.5 * (bounds.min + bounds.max);
    let target = table.target.as_ref().map_or(middle, |t| t.value);
    let position = table
        .position
        .as_ref()
        .map_or_else(|| framing_eye(target, bounds, table.fov), |p| p.value);
    let up = table.up.as_ref().map_or(Vec3::Y, |u| u.value);
    let view = target - position;
    // Of the scene's size first: the square of a far view is no f32.
    let towards = (view / view.abs().max_element()).try_normalize();
    let stated = [&table.target, &table.position, &table.up];
    let culprit = stated.into_iter().flatten().next();
    match (towards, culprit) {
        (None, Some(at)) if view.is_finite() => {
            let found = format!("the eye and the target both at {position}");
            Err(at.refuse(found, "two different points"))
        }
        (Some(view), Some(at)) if view.cross(up.normalize()).length() < 1e-4 => {
            let found = format!("a view along {view}, parallel to up = {up}");
            let at = table.up.as_ref().unwrap_or(at);
            Err(at.refuse(found, "camera.up in another direction than the view"))
        }
        _ => Ok(Camera {
            position,
            target,
            up,
            fov: table.fov,
            aspect: None,
            projection: match table.projection {
                // Where nothing is said, as high as a perspective shows at the target.
                ProjectionTable::Orthographic { height } => Projection::Orthographic {
                    height: height.unwrap_or(2.0 * view.length() * (0.5 * table.fov).tan()),
                },
                ProjectionTable::Perspective => Projection::Perspective,
                ProjectionTable::Panorama => Projection::Panorama,
            },
            shift: table.shift,
            lens: table.lens.map(|l| lens(l, view.length())),
            allow_inside: table.allow_inside,
        }),
    }
}

/// The camera of a mesh file, with what the scene adds to it.
pub(super) fn through(camera: &FileCamera, table: &CameraTable, bounds: Aabb) -> Camera {
    let position = camera.position;
    let to_middle = 0.5 * (bounds.min + bounds.max) - position;
    // The target is beside the middle of the scene, if that is ahead; far enough for its digits to tell the direction.
    let least = 1e-3 * position.abs().max_element();
    let ahead = to_middle.dot(camera.forward);
    let distance = if ahead > least {
        ahead
    } else {
        to_middle.length().max(least)
    };
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let (projection, fov, aspect) = match camera.projection {
        FileProjection::Perspective { fov, aspect } => (Projection::Perspective, fov, aspect),
        FileProjection::Orthographic { width, height } => {
            let projection = Projection::Orthographic { height };
            (projection, table.fov, Some(width / height))
        }
    };
    Camera {
        position,
        target: position + distance * camera.forward,
        up: camera.up,
        fov,
        aspect,
        projection,
        shift: table.shift,
        lens: table.lens.map(|l| lens(l, distance)),
        allow_inside: table.allow_inside,
    }
}

fn lens(table: LensTable, focus: f32) -> Lens {
    Lens {
        radius: 0.5 * table.aperture,
        focus: table.focus_distance.unwrap_or(focus),
        blades: table.blades,
        rotation: table.blade_rotation,
    }
}

/// The camera of a scene without a file.
pub(super) fn default_camera(bounds: Aabb) -> Camera {
    let fov = Camera::default().fov;
    let target = 0.5 * (bounds.min + bounds.max);
    Camera {
        position: framing_eye(target, bounds, fov),
        target,
        fov,
        ..Camera::default()
    }
}

/// The eye from which a field of view of `fov` radians around `target` just holds the sphere around the box.
fn framing_eye(target: Vec3, bounds: Aabb, fov: f32) -> Vec3 {
    let middle = 0.5 * (bounds.min + bounds.max);
    let radius = 0.5 * bounds.diagonal() + middle.distance(target);
    // A scene of one point has no size: any distance frames it.
    let radius = if radius > 0.0 { radius } else { 1.0 };
    target + THREE_QUARTER.normalize() * (radius / (0.5 * fov).sin())
}
