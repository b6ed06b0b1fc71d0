//! MTL material libraries: what prismarch can use of them.
//!
//! Read: colours and highlights (`Kd`, `Ks`, `Ns`, `Ke`, `Tf`, `Ni`, `d`, `Tr`, `illum`), their maps, the PBR statements
//! of later exporters (`Pr`, `Pm`, `Pc`, `Pcr`, `norm`), and for displacement `disp`, `map_disp`, `bump`, `map_bump`, in
//! this order of preference. Everything else is passed over, so a fault in it does no harm.

use std::path::Path;

use glam::{Vec2, Vec3};

use super::{
    FileColor, FileDetail, FileDisplacement, FileMaterial, FileScalar, FileTexture, FileTextureUse,
    beside,
};
use crate::surface::{UvTransform, Wrap};

/// What the argument of a statement is.
#[derive(Clone, Copy, PartialEq)]
enum Argument {
    Text,
    Color,
    Number,
}

/// The statements that are read, with the spelling that tobj knows, if it does; exporters differ in case.
const STATEMENTS: [(&str, &str, Argument); 24] = [
    ("newmtl", "newmtl", Argument::Text),
    ("kd", "Kd", Argument::Color),
    ("ks", "Ks", Argument::Color),
    ("ke", "Ke", Argument::Color),
    ("tf", "Tf", Argument::Color),
    ("ns", "Ns", Argument::Number),
    ("ni", "Ni", Argument::Number),
    ("d", "d", Argument::Number),
    ("tr", "Tr", Argument::Number),
    ("illum", "illumination", Argument::Number),
    ("pr", "Pr", Argument::Number),
    ("pm", "Pm", Argument::Number),
    ("pc", "Pc", Argument::Number),
    ("pcr", "Pcr", Argument::Number),
    ("map_kd", "map_Kd", Argument::Text),
    ("map_ke", "map_Ke", Argument::Text),
    ("map_d", "map_d", Argument::Text),
    ("map_pr", "map_Pr", Argument::Text),
    ("map_pm", "map_Pm", Argument::Text),
    ("norm", "norm", Argument::Text),
    ("disp", "disp", Argument::Text),
    ("map_disp", "map_disp", Argument::Text),
    ("bump", "bump", Argument::Text),
    ("map_bump", "map_bump", Argument::Text),
];

/// The text of a library with only what tobj reads without fault; complaints go to `warnings`.
pub(super) fn clean(text: &str, library: &Path, warnings: &mut Vec<String>) -> String {
    let mut cleaned = String::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let lower = word.to_ascii_lowercase();
        let Some(&(_, statement, kind)) = STATEMENTS.iter().find(|(name, ..)| *name == lower)
        else {
            continue;
        };
        let argument = match kind {
            Argument::Color => color(rest),
            Argument::Number => self::number(rest),
            Argument::Text => Some(rest.trim().to_owned()).filter(|a| !a.is_empty()),
        };
        match argument {
            Some(argument) => cleaned += &format!("{statement} {argument}\n"),
            None => warnings.push(format!(
                "{}: line {}: cannot use {line:?}; the statement is ignored",
                library.display(),
                number + 1
            )),
        }
    }
    cleaned
}

/// One number.
fn number(text: &str) -> Option<String> {
    let value: f32 = text.trim().parse().ok()?;
    value.is_finite().then(|| value.to_string())
}

/// One grey value or three channels; other colour systems (`spectral`, `xyz`) are not read.
fn color(text: &str) -> Option<String> {
    let values: Vec<f32> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|x: &f32| x.is_finite()))
        .collect::<Option<_>>()?;
    match values[..] {
        [grey] => Some(format!("{grey} {grey} {grey}")),
        [r, g, b] => Some(format!("{r} {g} {b}")),
        _ => None,
    }
}

/// What a material of the library at `library` says.
///
/// Phong's exponent becomes the roughness whose GGX lobe is about as wide, alpha = sqrt(2 / (Ns + 2)) (Walter et al.,
/// EGSR 2007, section 5.2), where the PBR statement Pr is missing and the material has highlights (Ks) at all.
/// Illumination models with refraction (6, 7) are glass, tinted by Tf.
pub(super) fn material(material: &tobj::Material, library: &Path) -> FileMaterial {
    let unknown = |name: &str| material.unknown_param.get(name);
    let number = |name: &str| unknown(name).and_then(|x| x.parse::<f32>().ok());
    let color = |name: &str| unknown(name).and_then(|x| <[f32; 3]>::try_from(numbers(x, 3).0).ok());
    let map = |statement: &str| Map::parse(statement).texture(library);
    let displacement = unknown("disp")
        .or_else(|| unknown("map_disp"))
        .or(material.normal_texture.as_ref());
    let unit = |x: f32| x.clamp(0.0, 1.0);
    let scalar = |factor: Option<f32>, texture: Option<&String>, default: f32| FileScalar {
        // A map without a number is taken as it is.
        factor: unit(factor.unwrap_or(if texture.is_some() { 1.0 } else { default })),
        texture: texture.map(|t| (map(t), Map::parse(t).channel.unwrap_or("r"))),
    };
    let highlight = material
        .specular
        .map(|ks| unit(Vec3::from(ks).element_sum() / 3.0));
    let phong = material
        .shininess
        .filter(|_| highlight.is_some_and(|h| h > 0.0));
    let from_phong = phong.map(|ns| (2.0 / (ns.max(0.0) + 2.0)).sqrt().sqrt());
    let opacity = material.dissolve.or(number("Tr").map(|tr| 1.0 - tr));
    let refracts = number("illumination").is_some_and(|i| i == 6.0 || i == 7.0);
    let diffuse = material.diffuse.map_or(Vec3::ONE, Vec3::from);
    let default = FileMaterial::default();
    FileMaterial {
        name: material.name.clone(),
        base_color: FileColor {
            factor: if refracts {
                color("Tf").map_or(Vec3::ONE, Vec3::from)
            } else {
                diffuse
            },
            texture: material.diffuse_texture.as_deref().map(map),
        },
        metallic: scalar(number("Pm"), unknown("map_Pm"), 0.0),
        roughness: scalar(
            number("Pr").or(from_phong),
            unknown("map_Pr"),
            if refracts { 0.0 } else { 1.0 },
        ),
        specular: FileScalar::constant(highlight.unwrap_or(0.5)),
        ior: material
            .optical_density
            .filter(|n| (1.0..=3.0).contains(n))
            .unwrap_or(default.ior),
        transmission: FileScalar::constant(if refracts { 1.0 } else { 0.0 }),
        coat: scalar(number("Pc"), None, 0.0),
        coat_roughness: scalar(number("Pcr"), None, 0.0),
        emission: FileColor {
            factor: material
                .emissive
                .map_or(Vec3::ZERO, Vec3::from)
                .max(Vec3::ZERO),
            texture: unknown("map_Ke").map(|t| map(t)),
        },
        opacity: if refracts {
            FileScalar::constant(1.0)
        } else {
            scalar(opacity, material.dissolve_texture.as_ref(), 1.0)
        },
        detail: unknown("norm").map(|t| FileDetail::NormalMap {
            texture: map(t),
            strength: 1.0,
        }),
        displacement: displacement.map(|s| Map::parse(s).displacement(library)),
        ..default
    }
}

/// A texture map statement: options, then the file's name, which may hold spaces.
struct Map<'a> {
    file: &'a str,
    /// `-mm`: the value is base + gain * texel.
    range: Option<[f32; 2]>,
    /// `-bm`: multiplies the value.
    multiplier: Option<f32>,
    uv: UvTransform,
    wrap: Option<Wrap>,
    channel: Option<&'static str>,
}

impl<'a> Map<'a> {
    /// An option that is not understood is taken for the start of the file's name.
    fn parse(statement: &'a str) -> Self {
        let mut map = Self {
            file: statement.trim(),
            range: None,
            multiplier: None,
            uv: UvTransform::default(),
            wrap: None,
            channel: None,
        };
        while let Some(rest) = map.option() {
            map.file = rest.trim_start();
        }
        map
    }

    /// Takes one option off the front of `file`; the rest, or `None` where no option stands there.
    fn option(&mut self) -> Option<&'a str> {
        let (name, rest) = word(self.file)?;
        match name {
            "-mm" => {
                let (values, rest) = numbers(rest, 2);
                self.range = Some(*values.first_chunk()?);
                Some(rest)
            }
            "-bm" => {
                let (values, rest) = numbers(rest, 1);
                self.multiplier = Some(*values.first()?);
                Some(rest)
            }
            "-s" | "-o" => {
                let (values, rest) = numbers(rest, 3);
                let u = *values.first()?;
                let default = if name == "-s" { 1.0 } else { 0.0 };
                let uv = Vec2::new(u, values.get(1).copied().unwrap_or(default));
                if name == "-s" {
                    self.uv.scale = uv;
                } else {
                    self.uv.offset = uv;
                }
                Some(rest)
            }
            "-t" => Some(numbers(rest, 3).1),
            "-clamp" => {
                let (value, rest) = word(rest)?;
                self.wrap = (value == "on").then_some(Wrap::Clamp);
                Some(rest)
            }
            "-imfchan" => {
                let (value, rest) = word(rest)?;
                self.channel = match value {
                    "r" => Some("r"),
                    "g" => Some("g"),
                    "b" => Some("b"),
                    "m" => Some("a"),
                    "l" => Some("luminance"),
                    _ => None,
                };
                Some(rest)
            }
            "-blendu" | "-blendv" | "-boost" | "-texres" | "-type" | "-cc" => {
                word(rest).map(|(_, rest)| rest)
            }
            _ => None,
        }
    }

    /// As a texture of a material.
    fn texture(&self, library: &Path) -> FileTextureUse {
        FileTextureUse {
            source: FileTexture::Path(beside(library, self.file)),
            wrap: [self.wrap.unwrap_or_default(); 2],
            uv: self.uv,
        }
    }

    /// multiplier * (base + gain * h) written as scale * (h - midlevel).
    fn displacement(&self, library: &Path) -> FileDisplacement {
        let (scale, midlevel) = match (self.range, self.multiplier) {
            (Some([base, gain]), m) if gain != 0.0 => {
                (Some(m.unwrap_or(1.0) * gain), Some(-base / gain))
            }
            (_, m) => (m, None),
        };
        FileDisplacement {
            path: beside(library, self.file),
            scale,
            midlevel,
            uv: self.uv,
            wrap: self.wrap,
            channel: self.channel,
        }
    }
}

/// The first word and what follows it.
fn word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (end > 0).then(|| text.split_at(end))
}

/// Up to `most` numbers, and what follows them.
fn numbers(mut text: &str, most: usize) -> (Vec<f32>, &str) {
    let mut values = Vec::new();
    while values.len() < most
        && let Some((number, rest)) = word(text)
        && let Ok(value) = number.parse::<f32>()
        && value.is_finite()
    {
        values.push(value);
        text = rest;
    }
    (values, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn displacement(statement: &str) -> FileDisplacement {
        Map::parse(statement).displacement(Path::new("lib/rock.mtl"))
    }

    #[test]
    fn a_name_with_spaces_follows_the_options() {
        let map =
            displacement("-mm -0.5 2 -s 3 4 1 -o 0.25 -clamp on -imfchan r my height map.png");
        assert_eq!(map.path, Path::new("lib/my height map.png"));
        assert_eq!(map.scale, Some(2.0));
        assert_eq!(map.midlevel, Some(0.25));
        assert_eq!(map.uv.scale, Vec2::new(3.0, 4.0));
        assert_eq!(map.uv.offset, Vec2::new(0.25, 0.0));
        assert_eq!(map.wrap, Some(Wrap::Clamp));
        assert_eq!(map.channel, Some("r"));
    }

    #[test]
    fn a_plain_name_says_nothing_else() {
        let map = displacement("textures\\h.png");
        assert_eq!(map.path, Path::new("lib/textures/h.png"));
        assert_eq!((map.scale, map.midlevel, map.wrap), (None, None, None));
    }

    #[test]
    fn bump_multiplier_is_the_scale() {
        assert_eq!(displacement("-bm 0.3 h.png").scale, Some(0.3));
        let both = displacement("-bm 0.5 -mm 0.1 0.4 h.png");
        assert_eq!((both.scale, both.midlevel), (Some(0.2), Some(-0.25)));
    }

    #[test]
    fn options_without_their_numbers_do_no_harm() {
        for statement in [
            "-mm",
            "-mm 1",
            "-bm x.png",
            "-s",
            "-clamp",
            "-",
            "-mm 1 0 h.png",
        ] {
            displacement(statement);
        }
        assert_eq!(displacement("-bm").path, Path::new("lib/-bm"));
    }

    #[test]
    fn unusable_statements_are_reported_and_left_out() {
        let mut warnings = Vec::new();
        let text = "newmtl a\nKd 0.5\nKd 1 2\nkd nan 0 0\nKa oops\nmap_Kd\nMAP_DISP h.png\n";
        let cleaned = clean(text, Path::new("m.mtl"), &mut warnings);
        assert_eq!(cleaned, "newmtl a\nKd 0.5 0.5 0.5\nmap_disp h.png\n");
        assert_eq!(warnings.len(), 3, "{warnings:?}");
        assert!(warnings[0].contains("m.mtl: line 3"));
    }
}
