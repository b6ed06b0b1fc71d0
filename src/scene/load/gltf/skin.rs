//! Skins in the pose that the nodes are in (section 3.7.3.3): the node of the mesh itself moves nothing.

use glam::{Affine3A, Mat4};

use super::accessor::{Accessors, FLOATS};
use super::document::Document;
use super::{LoadMeshErrorKind, malformed};

/// What each joint does to a vertex in its bind pose.
#[derive(Debug)]
pub(super) struct Joints(Vec<Affine3A>);

/// A joint and its weight, both as floats of the file.
pub(super) type Influence = (f32, f32);

impl Joints {
    /// Those of skin number `index`, whose joints stand where `worlds` says.
    pub fn read(
        document: &Document,
        index: usize,
        worlds: &[Affine3A],
        accessors: &Accessors,
    ) -> Result<Self, LoadMeshErrorKind> {
        let skin = &document.skins[index];
        let what = format!("skin {index}");
        if skin.joints.is_empty() {
            return Err(malformed(&what, "it has no joints"));
        }
        let nodes = skin.joints.iter().map(|&joint| worlds[joint]);
        let Some(inverse_binds) = skin.inverse_bind_matrices else {
            return Ok(Self(nodes.collect()));
        };
        let matrices = accessors.open::<16>(
            inverse_binds,
            FLOATS,
            &format!("{what} inverseBindMatrices"),
        )?;
        if matrices.count() < skin.joints.len() {
            let problem = format!(
                "{} inverse bind matrices for {} joints",
                matrices.count(),
                skin.joints.len()
            );
            return Err(malformed(&what, problem));
        }
        let posed = nodes.enumerate().map(|(i, world)| {
            world * Affine3A::from_mat4(Mat4::from_cols_array(&matrices.floats(i)))
        });
        Ok(Self(posed.collect()))
    }

    /// What they do together to one vertex: the mean by weight. Without any weight the first has all.
    pub fn blended(
        &self,
        influences: &[Influence],
        vertex: usize,
        place: &str,
    ) -> Result<Affine3A, LoadMeshErrorKind> {
        let mut sum = Affine3A::ZERO;
        let mut total = 0.0;
        for &(joint, weight) in influences {
            if !(weight.is_finite() && weight >= 0.0) {
                let problem = format!(
                    "vertex {vertex} has the weight {weight}; expected a number of at least 0"
                );
                return Err(malformed(place, problem));
            }
            // Exporters leave anything beside a weight of 0.
            if weight > 0.0 {
                let matrix = self.joint(joint, place)?;
                sum.matrix3 += matrix.matrix3 * weight;
                sum.translation += matrix.translation * weight;
                total += weight;
            }
        }
        if total == 0.0 {
            let first = influences.first().map_or(0.0, |i| i.0);
            return self.joint(first, place).copied();
        }
        sum.matrix3 *= 1.0 / total;
        sum.translation /= total;
        Ok(sum)
    }

    fn joint(&self, index: f32, place: &str) -> Result<&Affine3A, LoadMeshErrorKind> {
        self.0
            .get(index as usize)
            .ok_or_else(|| LoadMeshErrorKind::IndexOutOfRange {
                place: place.to_owned(),
                what: "joint",
                index: index as i64,
                count: self.0.len(),
                counted: " (counted from 0)",
            })
    }
}
