//! `[integrator]`.

use super::{Item, SceneError, Section};
use crate::scene::{Integrator, PathLimits, View};

/// What an `[integrator]` can be.
#[derive(Clone, Copy)]
enum Kind {
    Path,
    Beauty,
    Ao,
    View(View),
}

const KINDS: [(&str, Kind); 11] = [
    ("path", Kind::Path),
    ("beauty", Kind::Beauty),
    ("ao", Kind::Ao),
    ("normal", Kind::View(View::Normal)),
    ("geometric", Kind::View(View::Geometric)),
    ("uv", Kind::View(View::Uv)),
    ("depth", Kind::View(View::Depth)),
    ("albedo", Kind::View(View::Albedo)),
    ("displacement", Kind::View(View::Displacement)),
    ("prim", Kind::View(View::Prim)),
    ("cost", Kind::View(View::Cost)),
];

/// Most bounces that a limit may allow.
const MOST: u32 = 1000;

/// Reads `[integrator]`.
pub(super) fn read(item: Item) -> Result<Integrator, SceneError> {
    let kind = item
        .peek("type", "an integrator, like \"path\"")?
        .word(&KINDS)?;
    match kind {
        Kind::Path => {
            let mut section =
                item.section(&["type", "diffuse", "glossy", "transmission", "roulette"])?;
            let default = PathLimits::default();
            Ok(Integrator::Path(PathLimits {
                diffuse: bounces(&mut section, "diffuse", default.diffuse)?,
                glossy: bounces(&mut section, "glossy", default.glossy)?,
                transmission: bounces(&mut section, "transmission", default.transmission)?,
                roulette: bounces(&mut section, "roulette", default.roulette)?,
            }))
        }
        Kind::Ao => {
            let mut section = item.section(&["type", "distance"])?;
            let distance =
                section.optional("distance", |i| i.number("world units above 0", |x| x > 0.0))?;
            Ok(Integrator::Ao {
                distance: distance.unwrap_or(f32::INFINITY),
            })
        }
        Kind::Beauty => item.section(&["type"]).map(|_| Integrator::Beauty),
        Kind::View(view) => item.section(&["type"]).map(|_| Integrator::View(view)),
    }
}

fn bounces(section: &mut Section, key: &str, default: u32) -> Result<u32, SceneError> {
    let found = section.optional(key, |i| i.integer(0..=MOST))?;
    Ok(found.unwrap_or(default))
}

impl Integrator {
    /// The integrator of this name, with defaults; `None` for an unknown one.
    pub(crate) fn named(name: &str) -> Option<Self> {
        let kind = KINDS.iter().find(|(word, _)| *word == name)?.1;
        Some(match kind {
            Kind::Path => Self::Path(PathLimits::default()),
            Kind::Beauty => Self::Beauty,
            Kind::Ao => Self::Ao {
                distance: f32::INFINITY,
            },
            Kind::View(view) => Self::View(view),
        })
    }

    /// Its name in scene files.
    pub fn name(&self) -> &'static str {
        let is = |kind: Kind| match (self, kind) {
            (Self::Path(_), Kind::Path)
            | (Self::Beauty, Kind::Beauty)
            | (Self::Ao { .. }, Kind::Ao) => true,
            (Self::View(own), Kind::View(view)) => *own == view,
            _ => false,
        };
        // Every integrator has a word there.
        KINDS
            .iter()
            .find(|(_, kind)| is(*kind))
            .map_or("", |(word, _)| word)
    }

    /// The names of all integrators.
    pub(crate) fn names() -> impl Iterator<Item = &'static str> {
        KINDS.iter().map(|(word, _)| *word)
    }
}
