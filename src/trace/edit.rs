//! Edits of a map that a traced world uses.

use std::sync::Arc;

use super::{Shape, World};
use crate::surface::{DisplacementMap, TexelRect};

/// What it took to bring a tracer up to date after an edit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edited {
    /// Prisms that have edited texels under them, over all objects; see
    /// [`BoundsChange::touched`](crate::prism::BoundsChange::touched).
    pub prims_touched: usize,
    /// Whether trees had to be refitted or built anew, because bounds had grown.
    pub committed: bool,
}

impl World {
    /// Brings the prisms of all objects over `map` up to date after an edit of it; the number of prisms touched.
    pub fn map_edited(&self, map: &Arc<DisplacementMap>, rect: TexelRect) -> usize {
        let prisms = self.objects().iter().filter_map(|o| match &o.shape {
            Shape::Displaced(prisms) if Arc::ptr_eq(prisms.surface().map(), map) => Some(prisms),
            _ => None,
        });
        prisms.map(|prisms| prisms.map_edited(rect).touched).sum()
    }

    /// Takes the bounds of all that edits have touched [anew](crate::prism::Prisms::tighten), before a new tree is made.
    pub fn tighten(&self) {
        for object in self.objects() {
            if let Shape::Displaced(prisms) = &object.shape {
                prisms.tighten();
            }
        }
    }

    /// By object, how often its bounds have [grown](crate::prism::Prisms::growths). What two objects or two tracers share
    /// grows once: so each tracer compares for itself.
    pub fn growths(&self) -> Vec<u64> {
        let growths = |shape: &Shape| match shape {
            Shape::Displaced(prisms) => prisms.growths(),
            Shape::Triangles(_) => 0,
        };
        self.objects().iter().map(|o| growths(&o.shape)).collect()
    }
}

/// The objects whose bounds have grown between two times.
pub(crate) fn grown(before: &[u64], now: &[u64]) -> Vec<usize> {
    let pairs = before.iter().zip(now).enumerate();
    pairs.filter(|(_, (a, b))| a != b).map(|(i, _)| i).collect()
}
