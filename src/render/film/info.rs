//! What a file tells of the picture in it, so that parts can be put together and interrupted ones go on.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::UVec2;

use super::error::FrameError;
use crate::scene::{Film, Filter, MAX_SPP, Window};

/// A block of samples: every pixel of a window gets those of these numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The pixels.
    pub window: Window,
    /// The numbers of their samples.
    pub samples: Range<u32>,
}

impl Part {
    /// What both hold.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let both = Self {
            window: self.window.intersection(&other.window),
            samples: self.samples.start.max(other.samples.start)
                ..self.samples.end.min(other.samples.end),
        };
        (both.volume() > 0).then_some(both)
    }

    /// Number of samples, over all pixels.
    fn volume(&self) -> u64 {
        self.window.pixels() as u64 * self.samples.len() as u64
    }

    fn parse(text: &str) -> Option<Self> {
        let (window, samples) = text.split_once(' ')?;
        let corners: Vec<u32> = window
            .split(',')
            .map(|x| x.parse().ok())
            .collect::<Option<_>>()?;
        let &[x0, y0, x1, y1] = &corners[..] else {
            return None;
        };
        let (start, end) = samples.split_once("..")?;
        let part = Self {
            window: Window {
                start: UVec2::new(x0, y0),
                end: UVec2::new(x1, y1),
            },
            samples: start.parse().ok()?..end.parse().ok()?,
        };
        (part.volume() > 0).then_some(part)
    }
}

/// `x0,y0,x1,y1 A..B`.
impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { window, samples } = self;
        write!(f, "{window} {}..{}", samples.start, samples.end)
    }
}

/// What a picture was made of and from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameInfo {
    /// Pixels across and down of the whole picture.
    pub size: UVec2,
    /// The scene's file, for the reader.
    pub scene: String,
    /// Backend and its version, `; ` between several.
    pub backend: String,
    /// Samples that a pixel gets in the end.
    pub spp: u32,
    /// Name and value of all that decides what a sample is: parts of one picture have the same.
    pub identity: Vec<(String, String)>,
    /// What is in the picture; no two share a sample.
    pub parts: Vec<Part>,
    /// Whether samples of the parts are still missing.
    pub partial: bool,
}

/// What all attributes start with.
const PREFIX: &str = "prismarch/";
/// The names of the identity's entries, in order.
const IDENTITY: [&str; 7] = [
    "version",
    "scene_hash",
    "seed",
    "integrator",
    "filter",
    "clamp",
    "adaptive",
];

impl FrameInfo {
    /// What is told of a picture of `film`, of the scene with this fingerprint, of its samples of numbers `samples`.
    pub fn new(film: &Film, samples: Range<u32>, scene: &Source) -> Self {
        let Filter { shape, radius } = film.filter;
        let shape = crate::scene::FilterShape::NAMES
            .iter()
            .find(|(_, known)| *known == shape);
        let values = [
            env!("CARGO_PKG_VERSION").to_owned(),
            scene.hash.clone(),
            film.seed.to_string(),
            scene.integrator.clone(),
            format!("{} {radius}", shape.map_or("", |(name, _)| name)),
            film.clamp
                .map_or_else(|| "off".into(), |most| most.to_string()),
            // Where a pixel ends depends on how many samples it may get.
            film.adaptive.map_or_else(
                || "off".into(),
                |a| format!("{} {} of {}", a.threshold, a.min_spp, film.spp),
            ),
        ];
        Self {
            size: UVec2::new(film.width, film.height),
            scene: scene.name.clone(),
            backend: scene.backend.clone(),
            spp: film.spp,
            identity: IDENTITY
                .iter()
                .map(|&name| name.to_owned())
                .zip(values)
                .collect(),
            parts: vec![Part {
                window: film.window(),
                samples,
            }],
            partial: true,
        }
    }

    /// Whether every pixel there is has all its samples, so that nothing more is to come but other pixels.
    pub fn is_final(&self) -> bool {
        !self.partial && self.parts.iter().all(|part| part.samples == (0..self.spp))
    }

    /// The window and the samples around all parts.
    pub fn bounds(&self) -> Part {
        let mut parts = self.parts.iter().cloned();
        let first = parts.next().unwrap_or(Part {
            window: Window::whole(0, 0),
            samples: 0..0,
        });
        parts.fold(first, |all, part| Part {
            window: all.window.union(&part.window),
            samples: all.samples.start.min(part.samples.start)
                ..all.samples.end.max(part.samples.end),
        })
    }

    /// Puts the parts into order, and makes them one where they fill the block around them: as no two share a
    /// sample, that is when their volumes sum up to its.
    pub(super) fn tidy(&mut self) {
        let bounds = self.bounds();
        if self.parts.iter().map(Part::volume).sum::<u64>() == bounds.volume() {
            self.parts = vec![bounds];
        }
        self.parts.sort_by_key(|part| {
            let Window { start, .. } = part.window;
            (part.samples.start, start.y, start.x)
        });
    }

    /// Fails unless `other`, of the file `other_path`, belongs to the same picture as this one, of `path`.
    pub fn check_same(
        &self,
        path: &Path,
        other: &Self,
        other_path: &Path,
    ) -> Result<(), FrameError> {
        let differ = |what: &str, found: &dyn fmt::Display, expected: &dyn fmt::Display| {
            Err(FrameError::Differs {
                path: other_path.to_owned(),
                other: path.to_owned(),
                what: what.to_owned(),
                found: found.to_string(),
                expected: expected.to_string(),
            })
        };
        if self.size != other.size {
            let text = |size: UVec2| format!("{}x{}", size.x, size.y);
            return differ("size", &text(other.size), &text(self.size));
        }
        for ((name, expected), (_, found)) in self.identity.iter().zip(&other.identity) {
            if found != expected {
                return differ(name, found, expected);
            }
        }
        Ok(())
    }

    /// As attributes of a file, all ASCII.
    pub fn attributes(&self) -> Vec<(String, String)> {
        let parts: Vec<String> = self.parts.iter().map(Part::to_string).collect();
        let rest = [
            ("scene", ascii(&self.scene)),
            ("backend", self.backend.clone()),
            ("spp", self.spp.to_string()),
            ("parts", parts.join("; ")),
            ("partial", self.partial.to_string()),
        ];
        let named = |(name, value): (&str, String)| (format!("{PREFIX}{name}"), value);
        let identity = self
            .identity
            .iter()
            .map(|(name, value)| (&name[..], value.clone()));
        identity.chain(rest).map(named).collect()
    }

    /// From the attributes of the file at `path`, of a picture of this size.
    pub(super) fn read(
        path: &Path,
        size: UVec2,
        attributes: &[(String, String)],
    ) -> Result<Self, FrameError> {
        let text = |name: &str| attribute(path, attributes, &format!("{PREFIX}{name}"));
        let expect = |name: &str, expected: &str, found: &str| FrameError::Attribute {
            path: path.to_owned(),
            name: format!("{PREFIX}{name}"),
            found: format!("{found:?}"),
            expected: expected.to_owned(),
        };
        let identity = IDENTITY
            .iter()
            .map(|&name| Ok((name.to_owned(), text(name)?.to_owned())));
        let parts = text("parts")?;
        let partial = text("partial")?;
        let whole = Window::whole(size.x, size.y);
        let spp_text = text("spp")?;
        let spp = spp_text
            .parse()
            .ok()
            .filter(|spp| (1..=MAX_SPP).contains(spp));
        let spp = spp.ok_or_else(|| expect("spp", "a number of samples", spp_text))?;
        let inside = |part: &Part| {
            whole.intersection(&part.window) == part.window && part.samples.end <= spp
        };
        let of_list = |text: &str| Part::parse(text).filter(inside);
        Ok(Self {
            size,
            scene: text("scene")?.to_owned(),
            backend: text("backend")?.to_owned(),
            spp,
            identity: identity.collect::<Result<_, FrameError>>()?,
            parts: parts
                .split("; ")
                .map(of_list)
                .collect::<Option<_>>()
                .ok_or_else(|| {
                    expect(
                        "parts",
                        "x0,y0,x1,y1 A..B; ... inside of the picture",
                        parts,
                    )
                })?,
            partial: partial
                .parse()
                .map_err(|_| expect("partial", "true or false", partial))?,
        })
    }
}

/// Where a picture is from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The scene's file.
    pub name: String,
    /// [`crate::scene::Scene::fingerprint`].
    pub hash: String,
    /// What brings radiance, with its options.
    pub integrator: String,
    /// Backend and its version.
    pub backend: String,
}

/// The attribute `name` of the file at `path`.
pub(super) fn attribute<'a>(
    path: &Path,
    attributes: &'a [(String, String)],
    name: &str,
) -> Result<&'a str, FrameError> {
    let found = attributes.iter().find(|(known, _)| known == name);
    found
        .map(|(_, value)| &value[..])
        .ok_or_else(|| FrameError::NotAFrame {
            path: PathBuf::from(path),
            missing: format!("attribute {name}"),
        })
}

/// EXR attributes have no stated encoding.
fn ascii(text: &str) -> String {
    let escape = |c: char| match c {
        ' '..='~' => c.to_string(),
        _ => c.escape_unicode().to_string(),
    };
    text.chars().map(escape).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(parts: &[&str]) -> FrameInfo {
        let source = Source {
            name: "r\u{f6}ck.toml".into(),
            hash: "00ff".into(),
            integrator: "beauty".into(),
            backend: "none".into(),
        };
        let film = Film {
            clamp: Some(4.0),
            ..Film::default()
        };
        FrameInfo {
            parts: parts
                .iter()
                .map(|text| Part::parse(text).unwrap())
                .collect(),
            ..FrameInfo::new(&film, 0..16, &source)
        }
    }

    fn tidied(parts: &[&str]) -> Vec<String> {
        let mut info = info(parts);
        info.tidy();
        info.parts.iter().map(Part::to_string).collect()
    }

    #[test]
    fn parts_that_fill_a_block_become_one() {
        let tiles = [
            "0,0,2,9 0..8",
            "2,0,9,9 8..16",
            "0,0,2,9 8..16",
            "2,0,9,9 0..8",
        ];
        assert_eq!(tidied(&tiles), ["0,0,9,9 0..16"]);
        assert_eq!(
            tidied(&tiles[..3]),
            ["0,0,2,9 0..8", "0,0,2,9 8..16", "2,0,9,9 8..16"]
        );
    }

    #[test]
    fn attributes_come_back() {
        let info = info(&["0,0,2,9 0..8", "2,0,9,9 0..16"]);
        let attributes = info.attributes();
        assert!(
            attributes
                .iter()
                .all(|(name, value)| name.is_ascii() && value.is_ascii())
        );
        let read = FrameInfo::read(Path::new("a.exr"), info.size, &attributes).unwrap();
        assert_eq!(read.scene, "r\\u{f6}ck.toml");
        assert_eq!(
            FrameInfo {
                scene: info.scene.clone(),
                ..read
            },
            info
        );
    }

    #[test]
    fn odd_attributes_are_refused_by_name() {
        let good = info(&["0,0,2,9 0..8"]).attributes();
        for (name, value) in [
            ("spp", "0"),
            ("spp", "many"),
            ("partial", "perhaps"),
            ("parts", ""),
            ("parts", "0,0,2,9 8..8"),
            ("parts", "0,0,2,9"),
            ("parts", "0,0,641,9 0..8"),
            ("parts", "0,0,2 0..8"),
        ] {
            let mut odd = good.clone();
            let name = format!("{PREFIX}{name}");
            odd.iter_mut().find(|(known, _)| *known == name).unwrap().1 = value.to_owned();
            let error = FrameInfo::read(Path::new("a.exr"), UVec2::new(640, 480), &odd);
            let error = error.unwrap_err().to_string();
            assert!(error.contains("a.exr") && error.contains(&name), "{error}");
        }
        let error = FrameInfo::read(Path::new("a.exr"), UVec2::ONE, &[]).unwrap_err();
        assert!(matches!(error, FrameError::NotAFrame { .. }));
    }
}
