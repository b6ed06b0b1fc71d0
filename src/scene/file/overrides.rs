//! `KEY=VALUE` laid over a scene file, as if its author had written that.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::reader::Source;
use super::{Place, SceneError};

/// What messages have in place of a file's name.
pub(in crate::scene) const OPTION: &str = "--set";

/// One of them.
pub(super) struct Override {
    /// As TOML.
    text: String,
    /// `text` behind blanks: places inside it count on from the end of the file.
    padded: String,
}

impl Override {
    /// Those of a file of `length` bytes. A value that is no TOML but a plain word is taken for a string.
    pub fn all(length: usize, given: &[String]) -> Vec<Self> {
        let mut start = length;
        let mut all = Vec::new();
        for given in given {
            let text = as_toml(given);
            start += 1;
            let padded = format!("{:start$}{text}", "");
            start += text.len();
            all.push(Self { text, padded });
        }
        all
    }

    /// The place of a span, if it is in this one.
    pub fn place(&self, span: &Range<usize>) -> Option<Place> {
        let start = self.padded.len() - self.text.len();
        let inside = (start..=self.padded.len()).contains(&span.start);
        inside.then(|| {
            Place::new(
                Path::new(OPTION),
                &self.text,
                span.start - start..span.start - start,
            )
        })
    }
}

fn as_toml(given: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./ ".contains(c);
    match given.split_once('=') {
        Some((key, value)) if DeValue::parse(value.trim()).is_err() && value.chars().all(plain) => {
            format!("{key}=\"{}\"", value.trim())
        }
        _ => given.to_owned(),
    }
}

impl<'a> Source<'a> {
    /// `base` with all overrides laid over it.
    pub fn overridden(self, mut base: DeTable<'a>) -> Result<DeTable<'a>, SceneError> {
        for given in self.overrides {
            let over = DeTable::parse(&given.padded).map_err(|e| self.syntax_error(&e))?;
            self.lay(over.into_inner(), &mut base)?;
        }
        Ok(base)
    }

    fn lay(self, over: DeTable<'a>, base: &mut DeTable<'a>) -> Result<(), SceneError> {
        for (key, value) in over {
            match base.get_mut(&**key.get_ref()) {
                Some(slot) => self.lay_value(value, slot)?,
                None => _ = base.insert(key, value),
            }
        }
        Ok(())
    }

    fn lay_value(
        self,
        value: Spanned<DeValue<'a>>,
        slot: &mut Spanned<DeValue<'a>>,
    ) -> Result<(), SceneError> {
        let span = value.span();
        match (value.into_inner(), slot.get_mut()) {
            (DeValue::Table(over), DeValue::Table(base)) => self.lay(over, base),
            (DeValue::Table(over), DeValue::Array(items)) => {
                for (key, value) in over {
                    let name = &**key.get_ref();
                    let index = name
                        .parse()
                        .ok()
                        .or_else(|| items.iter().position(|item| is_named(item, name)));
                    let count = items.len();
                    match index.and_then(|index: usize| items.get_mut(index)) {
                        Some(slot) => self.lay_value(value, slot)?,
                        None => {
                            return Err(SceneError::Value {
                                place: self.place(key.span()),
                                key: name.to_owned(),
                                found: "no such item".into(),
                                expected: format!(
                                    "the name or the number of one of {count} items, from 0"
                                ),
                            });
                        }
                    }
                }
                Ok(())
            }
            (over, _) => {
                *slot = Spanned::new(span, over);
                Ok(())
            }
        }
    }
}

/// Whether `item` is a table of this name.
fn is_named(item: &Spanned<DeValue>, name: &str) -> bool {
    let DeValue::Table(table) = item.get_ref() else {
        return false;
    };
    matches!(table.get("name").map(|n| n.get_ref()), Some(DeValue::String(known)) if known == name)
}

#[cfg(test)]
mod tests {
    use crate::scene::file::SceneFile;

    use super::*;

    const SCENE: &str = "[film]\nspp = 4\n[[mesh]]\nfile = \"a.obj\"\n[[material]]\nname = \"rock\"\nroughness = 0.5\n";

    fn scene(overrides: &[&str]) -> Result<SceneFile, String> {
        let overrides: Vec<String> = overrides.iter().map(|&o| o.to_owned()).collect();
        let scene = SceneFile::parse_with(Path::new("s.toml"), SCENE, &overrides);
        scene.map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_laid_over_tables_items_and_what_is_not_there() {
        let laid = scene(&[
            "film.spp=9",
            "film.tone = agx",
            "mesh.0.mask=3",
            "camera.fov=20",
        ]);
        let laid = laid.unwrap();
        assert_eq!(laid.film.spp, 9);
        assert_eq!(laid.film.tone, crate::scene::ToneCurve::Agx);
        assert_eq!(laid.meshes[0].mask, 3);
        assert_eq!(laid.camera.fov, 20f32.to_radians());
        let last = scene(&["film.spp=9", "film={spp=2, seed=1}"]).unwrap();
        assert_eq!((last.film.spp, last.film.seed), (2, 1));
        let named = format!(
            "{:?}",
            scene(&["material.rock.roughness=0.25"]).unwrap().materials
        );
        assert!(named.contains("0.25"), "{named}");
    }

    #[test]
    fn what_does_not_fit_is_shown_as_it_was_given() {
        for (given, words) in [
            ("film.spp=0", ["--set:1:10", "film.spp"]),
            ("film.sppp=1", ["--set:1:6", "film.sppp"]),
            ("film.spp", ["--set:1:", "film.spp"]),
            ("film.spp=[", ["--set:1:", "film.spp=["]),
            ("mesh.1.mask=3", ["--set:1:6", "one of 1 items"]),
            (
                "material.wood.roughness=1",
                ["--set:1:10", "found no such item"],
            ),
            ("mesh=3", ["--set:1:6", "mesh"]),
            ("", ["mesh", "s.toml"]),
        ] {
            // A good one before: places count from their own start.
            match scene(&["film.seed=1", given]) {
                Err(error) => assert!(words.iter().all(|w| error.contains(w)), "{error}"),
                Ok(_) => assert_eq!(given, ""),
            }
        }
    }
}
