//! Which camera a scene is seen by: its own, one of a mesh file, or one that frames it.

use std::path::PathBuf;

use super::{Builder, Keyed, frame};
use crate::scene::Camera;
use crate::scene::error::SceneError;
use crate::scene::file::{CameraChoice, CameraTable};
use crate::scene::load::FileCamera;

/// A camera that a mesh file brings, in the world.
pub(super) struct Offered {
    pub file: Keyed<PathBuf>,
    pub camera: FileCamera,
}

impl Builder {
    /// The camera, and where the scene names what places it. Cameras that are not taken have no effect.
    pub(super) fn camera(
        &mut self,
        table: &CameraTable,
    ) -> Result<(Camera, Option<Keyed<()>>), SceneError> {
        let offered = std::mem::take(&mut self.cameras);
        let chosen = match &table.from {
            Some(from) => Some(choose(from, &offered)?),
            None if table.own || offered.is_empty() => None,
            None => Some(0),
        };
        for (index, Offered { file, .. }) in offered.iter().enumerate() {
            if chosen != Some(index) {
                self.unused_of(&file.value).cameras += 1;
            }
        }
        let bounds = frame::bounds(&self.objects);
        let Some(index) = chosen else {
            let eye = table.position.as_ref().map(|at| at.with(()));
            return Ok((frame::camera(table, bounds)?, eye));
        };
        let Offered { file, camera } = &offered[index];
        if table.from.is_none() {
            let others = match &offered[..] {
                [_] => String::new(),
                all => format!("; camera.from takes another of {}", named(all)),
            };
            let path = file.value.display();
            let name = camera.name();
            self.notes
                .push(format!("{path}: seen by its camera {name:?}{others}"));
        }
        let eye = table.from.as_ref().map(|from| from.with(()));
        let eye = eye.unwrap_or_else(|| file.with(()));
        Ok((frame::through(camera, table, bounds), Some(eye)))
    }
}

fn choose(from: &Keyed<CameraChoice>, offered: &[Offered]) -> Result<usize, SceneError> {
    let (found, index) = match &from.value {
        CameraChoice::Name(name) => {
            let is = |o: &Offered| o.camera.names.contains(name);
            (format!("{name:?}"), offered.iter().position(is))
        }
        &CameraChoice::Number(number) => {
            let there = number < offered.len();
            (number.to_string(), there.then_some(number))
        }
    };
    index.ok_or_else(|| {
        let expected = match offered {
            [] => "a camera of a mesh file; they have none".into(),
            all => format!(
                "the name or the number, from 0, of a camera: {}",
                named(all)
            ),
        };
        from.refuse(found, expected)
    })
}

/// Their names, the first few.
fn named(offered: &[Offered]) -> String {
    const MOST: usize = 12;
    let names = offered.iter().map(|o| format!("{:?}", o.camera.name()));
    let shown: Vec<String> = names.take(MOST).collect();
    match offered.len() - shown.len() {
        0 => shown.join(", "),
        more => format!("{}, and {more} more", shown.join(", ")),
    }
}
