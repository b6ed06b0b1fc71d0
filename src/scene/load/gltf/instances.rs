//! EXT_mesh_gpu_instancing: one mesh, placed many times.

use glam::{Affine3A, Quat, Vec3};

use super::accessor::{Accessor, Accessors, FLOATS, SIGNED};
use super::document::Instancing;
use super::{LoadMeshErrorKind, malformed, nodes};
use crate::scene::load::conjugated;

/// The placements of what a node at `world` instances, as object-to-world transforms of its mesh as it stands in the world.
///
/// An instance that is scaled to nothing cannot be seen and is left out.
///
/// # Errors
///
/// Attributes that the extension does not know in this form, or that differ in number; a node that flattens its mesh.
pub(super) fn read(
    instancing: &Instancing,
    world: &Affine3A,
    accessors: &Accessors,
    place: &str,
) -> Result<Vec<Affine3A>, LoadMeshErrorKind> {
    /// Beyond these, squares and products of f32 lengths vanish or overflow.
    const SCALES: std::ops::RangeInclusive<f32> = 1e-9..=1e9;
    let open = |name: &str| instancing.attributes.get(name).copied();
    let what = |name: &str| format!("{place} instances' {name}");
    let vec3 = |name: &str| {
        open(name)
            .map(|a| accessors.open::<3>(a, FLOATS, &what(name)))
            .transpose()
    };
    let translations = vec3("TRANSLATION")?;
    let scales = vec3("SCALE")?;
    let rotations = open("ROTATION")
        .map(|a| accessors.open::<4>(a, SIGNED, &what("ROTATION")))
        .transpose()?;
    let counts = [&translations, &scales, &rotations];
    let counts: Vec<usize> = counts.into_iter().flatten().map(Accessor::count).collect();
    let &[count, ..] = &counts[..] else {
        return Err(malformed(
            place,
            "its instances have neither TRANSLATION, ROTATION nor SCALE",
        ));
    };
    if counts.iter().any(|&other| other != count) {
        let problem = format!("its instances have attributes of different counts: {counts:?}");
        return Err(malformed(place, problem));
    }
    let mut instances = Vec::new();
    for i in 0..count {
        let vec3 =
            |a: &Option<Accessor>, default| a.map_or(default, |a| Vec3::from_array(a.floats(i)));
        let (translation, scale) = (vec3(&translations, Vec3::ZERO), vec3(&scales, Vec3::ONE));
        let rotation = rotations.map_or(Quat::IDENTITY, |r| nodes::unit(r.floats(i)));
        if !(translation.is_finite() && scale.abs().max_element() <= *SCALES.end()) {
            let problem = format!(
                "instance {i} is moved by {translation} and scaled by {scale}; expected finite numbers, and scales up to 1e9"
            );
            return Err(malformed(place, problem));
        }
        if scale.abs().min_element() < *SCALES.start() {
            continue;
        }
        let local = Affine3A::from_scale_rotation_translation(scale, rotation, translation);
        instances.push(local);
    }
    conjugated(instances, world)
        .ok_or_else(|| malformed(place, "it scales its instances to nothing"))
}
