//! MTL materials: what prismarch can use of them.
//!
//! Read: colours and highlights (`Kd`, `Ks`, `Ns`, `Ke`, `Tf`, `Ni`, `d`, `Tr`, `illum`), their maps, the PBR statements
//! of later exporters (`Pr`, `Pm`, `Pc`, `Pcr`), normal maps (`norm`, `map_norm`), bump maps (`map_bump`, `bump`), and for displacement `disp`,
//! `map_disp` and the bump maps, in this order of preference. Everything else is passed over, so a fault in it does no harm, and told.

mod library;
mod map;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::Vec3;

use super::locate::Locator;
use super::{
    FileColor, FileDetail, FileDisplacement, FileMaterial, FileScalar, FileTexture, FileTextureUse,
    text,
};
pub(super) use library::Libraries;
use map::Map;

/// What the argument of a statement is.
#[derive(Clone, Copy)]
enum Kind {
    Color,
    Number,
    Map,
}

/// The statements that are read, in lower case; exporters differ in case.
const STATEMENTS: [(&str, Kind); 24] = [
    ("kd", Kind::Color),
    ("ks", Kind::Color),
    ("ke", Kind::Color),
    ("tf", Kind::Color),
    ("ns", Kind::Number),
    ("ni", Kind::Number),
    ("d", Kind::Number),
    ("tr", Kind::Number),
    ("illum", Kind::Number),
    ("pr", Kind::Number),
    ("pm", Kind::Number),
    ("pc", Kind::Number),
    ("pcr", Kind::Number),
    ("map_kd", Kind::Map),
    ("map_ke", Kind::Map),
    ("map_d", Kind::Map),
    ("map_pr", Kind::Map),
    ("map_pm", Kind::Map),
    ("norm", Kind::Map),
    ("map_norm", Kind::Map),
    ("disp", Kind::Map),
    ("map_disp", Kind::Map),
    ("bump", Kind::Map),
    ("map_bump", Kind::Map),
];

/// Reads materials of one library.
struct Reader<'a> {
    library: &'a Path,
    locator: &'a mut Locator,
    warnings: &'a mut Vec<String>,
    /// In how many materials a statement stands that is not read, by its keyword.
    others: &'a mut BTreeMap<Vec<u8>, usize>,
}

/// Light from everywhere, of renderers that know no light from surface to surface: every exporter writes it.
const AMBIENT: [&[u8]; 2] = [b"ka", b"map_ka"];

/// The last statement of each kind.
#[derive(Default)]
struct Said<'a> {
    colors: HashMap<&'static str, Vec3>,
    numbers: HashMap<&'static str, f32>,
    maps: HashMap<&'static str, Statement<'a>>,
}

/// A map statement.
struct Statement<'a> {
    /// As the file writes it.
    keyword: &'a [u8],
    map: Map<'a>,
}

impl Reader<'_> {
    /// What a material says, whose statements begin on line `first_line`.
    ///
    /// Phong's exponent becomes the roughness whose GGX lobe is about as wide, alpha = sqrt(2 / (Ns + 2)) (Walter et al.,
    /// EGSR 2007, section 5.2), where the PBR statement Pr is missing and the material has highlights (Ks) at all.
    /// Illumination models with refraction (6, 7) are glass, tinted by Tf.
    fn material(&mut self, name: String, statements: &[u8], first_line: usize) -> FileMaterial {
        let said = self.said(statements, first_line);
        let number = |name: &str| said.numbers.get(name).copied();
        let color = |name: &str| said.colors.get(name).copied();
        let unit = |x: f32| x.clamp(0.0, 1.0);
        let constant = |number: Option<f32>| FileScalar::constant(unit(number.unwrap_or(0.0)));
        let highlight = color("ks").map(|ks| unit(ks.element_sum() / 3.0));
        let phong = number("ns").filter(|_| highlight.is_some_and(|h| h > 0.0));
        let from_phong = phong.map(|ns| (2.0 / (ns.max(0.0) + 2.0)).sqrt().sqrt());
        let opacity = number("d").or(number("tr").map(|tr| 1.0 - tr));
        let refracts = number("illum").is_some_and(|i| i == 6.0 || i == 7.0);
        let base_color = color(if refracts { "tf" } else { "kd" }).unwrap_or(Vec3::ONE);
        let mut maps = Maps {
            reader: self,
            name: &name,
            said: &said,
        };
        FileMaterial {
            base_color: maps.color("map_kd", base_color),
            metallic: maps.scalar("map_pm", number("pm"), 0.0),
            roughness: maps.scalar(
                "map_pr",
                number("pr").or(from_phong),
                if refracts { 0.0 } else { 1.0 },
            ),
            specular: FileScalar::constant(highlight.unwrap_or(0.5)),
            ior: number("ni")
                .filter(|n| (1.0..=3.0).contains(n))
                .unwrap_or(1.5),
            transmission: FileScalar::constant(if refracts { 1.0 } else { 0.0 }),
            coat: constant(number("pc")),
            coat_roughness: constant(number("pcr")),
            emission: {
                let default = if maps.has("map_ke") {
                    Vec3::ONE
                } else {
                    Vec3::ZERO
                };
                maps.color("map_ke", color("ke").unwrap_or(default).max(Vec3::ZERO))
            },
            opacity: if refracts {
                FileScalar::constant(1.0)
            } else {
                maps.scalar("map_d", opacity, 1.0)
            },
            detail: maps.detail(),
            displacement: maps.displacement(),
            name,
            ..FileMaterial::default()
        }
    }

    fn said<'t>(&mut self, statements: &'t [u8], first_line: usize) -> Said<'t> {
        let mut said = Said::default();
        let mut others = BTreeSet::new();
        for (number, (_, line)) in text::lines(statements).enumerate() {
            let line = text::uncommented(line);
            let (keyword, rest) = text::split_word(line);
            let lower = keyword.to_ascii_lowercase();
            let known = STATEMENTS.iter().find(|(name, _)| name.as_bytes() == lower);
            let Some(&(name, kind)) = known else {
                if !keyword.is_empty() && !AMBIENT.contains(&&lower[..]) {
                    others.insert(keyword);
                }
                continue;
            };
            let usable = match kind {
                Kind::Color => color(rest).map(|c| {
                    said.colors.insert(name, c);
                }),
                Kind::Number => self::number(rest).map(|x| {
                    said.numbers.insert(name, x);
                }),
                Kind::Map => {
                    let map = Map::parse(rest);
                    let named = !map.file.is_empty();
                    named.then(|| {
                        said.maps.insert(name, Statement { keyword, map });
                    })
                }
            };
            if usable.is_none() {
                self.warnings.push(format!(
                    "{}: line {}: cannot use {:?}; the statement is ignored",
                    self.library.display(),
                    first_line + number,
                    text::shown(line)
                ));
            }
        }
        for keyword in others {
            *self.others.entry(keyword.to_owned()).or_default() += 1;
        }
        said
    }
}

/// The pictures of one material.
struct Maps<'m, 'a, 't> {
    reader: &'m mut Reader<'a>,
    name: &'m str,
    said: &'m Said<'t>,
}

impl Maps<'_, '_, '_> {
    fn has(&self, statement: &str) -> bool {
        self.said.maps.contains_key(statement)
    }

    fn color(&mut self, statement: &str, factor: Vec3) -> FileColor {
        FileColor {
            factor,
            texture: self.texture(statement),
        }
    }

    /// A map without a number is taken as it is.
    fn scalar(&mut self, statement: &str, number: Option<f32>, default: f32) -> FileScalar {
        let default = if self.has(statement) { 1.0 } else { default };
        FileScalar {
            factor: number.unwrap_or(default).clamp(0.0, 1.0),
            texture: self.channel(statement),
        }
    }

    fn channel(&mut self, statement: &str) -> Option<(FileTextureUse, &'static str)> {
        let channel = self.said.maps.get(statement)?.map.channel;
        Some((self.texture(statement)?, channel.unwrap_or("r")))
    }

    fn texture(&mut self, statement: &str) -> Option<FileTextureUse> {
        let (path, from) = self.file(statement)?;
        let map = &self.said.maps.get(statement)?.map;
        Some(FileTextureUse {
            source: FileTexture::Path(path),
            wrap: [map.wrap.unwrap_or_default(); 2],
            uv: map.uv,
            from,
        })
    }

    /// A normal map; else a bump map, whose `-bm` is in world units.
    fn detail(&mut self) -> Option<FileDetail> {
        let normals = self.first_of(["norm", "map_norm"]);
        if let Some(texture) = normals.and_then(|statement| self.texture(statement)) {
            return Some(FileDetail::NormalMap {
                texture,
                strength: 1.0,
            });
        }
        let statement = self.first_of(["map_bump", "bump"])?;
        let (scale, _) = self.said.maps.get(statement)?.map.heights();
        Some(FileDetail::Bump(FileScalar {
            factor: scale.unwrap_or(1.0),
            texture: self.channel(statement),
        }))
    }

    fn displacement(&mut self) -> Option<FileDisplacement> {
        let statement = self.first_of(["disp", "map_disp", "map_bump", "bump"])?;
        let (path, from) = self.file(statement)?;
        let map = &self.said.maps.get(statement)?.map;
        let (scale, midlevel) = map.heights();
        Some(FileDisplacement {
            path,
            scale,
            midlevel,
            uv: map.uv,
            wrap: map.wrap,
            channel: map.channel,
            from,
        })
    }

    fn first_of<const N: usize>(&self, statements: [&'static str; N]) -> Option<&'static str> {
        statements.into_iter().find(|statement| self.has(statement))
    }

    /// The picture, and the statement that names it.
    fn file(&mut self, statement: &str) -> Option<(PathBuf, String)> {
        let Statement { keyword, map } = self.said.maps.get(statement)?;
        let library = self.reader.library;
        let located = self.reader.locator.locate(library, map.file);
        let from = format!(
            "{} of material {:?} in {}",
            text::decoded(keyword),
            self.name,
            library.file_name().unwrap_or_default().to_string_lossy()
        );
        if let Some(note) = located.note {
            let told = format!("{from}: {note}");
            // A bump map may be asked for as detail and as displacement.
            if self.reader.warnings.last() != Some(&told) {
                self.reader.warnings.push(told);
            }
        }
        Some((located.path, from))
    }
}

/// The last word: `d -halo 0.5` has an option before its number.
fn number(text: &[u8]) -> Option<f32> {
    let last = text::words(text).last()?;
    text::parse(last).filter(|x: &f32| x.is_finite())
}

/// One grey value or three channels; other colour systems (`spectral`, `xyz`) are not read.
fn color(text: &[u8]) -> Option<Vec3> {
    let values: Option<Vec<f32>> = text::words(text)
        .take(4)
        .map(|word| text::parse(word).filter(|x: &f32| x.is_finite()))
        .collect();
    match values?[..] {
        [grey] => Some(Vec3::splat(grey)),
        [r, g, b, ..] => Some(Vec3::new(r, g, b)),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
