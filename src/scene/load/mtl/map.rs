//! A texture map statement of MTL: a file's name among options.

use glam::Vec2;

use super::super::text::{parse, split_word, unquoted};
use crate::surface::{UvTransform, Wrap};

/// What a statement says of its picture.
pub(super) struct Map<'a> {
    /// The file's name, which may hold spaces.
    pub(super) file: &'a [u8],
    /// `-mm`: the value is base + gain * texel.
    range: Option<[f32; 2]>,
    /// `-bm`: multiplies the value.
    multiplier: Option<f32>,
    pub(super) uv: UvTransform,
    pub(super) wrap: Option<Wrap>,
    /// `r`, `g`, `b`, `a` or `luminance`.
    pub(super) channel: Option<&'static str>,
}

impl<'a> Map<'a> {
    /// Options stand before the name or behind it. What is not understood as an option is part of the name.
    pub(super) fn parse(statement: &'a [u8]) -> Self {
        let mut map = Self {
            file: b"",
            range: None,
            multiplier: None,
            uv: UvTransform::default(),
            wrap: None,
            channel: None,
        };
        let mut rest = map.options(statement.trim_ascii());
        let start = rest;
        let mut length = 0;
        if rest.starts_with(b"\"")
            && let Some(end) = rest[1..].iter().position(|&b| b == b'"')
        {
            length = end + 2;
            rest = rest[length..].trim_ascii_start();
        }
        while !rest.is_empty() {
            let behind = map.options(rest);
            if behind.len() < rest.len() {
                rest = behind;
                continue;
            }
            let (word, after) = split_word(rest);
            length = start.len() - rest.len() + word.len();
            rest = after;
        }
        map.file = unquoted(&start[..length]);
        map
    }

    /// Takes all options off the front.
    fn options(&mut self, mut text: &'a [u8]) -> &'a [u8] {
        while let Some(rest) = self.option(text) {
            text = rest;
        }
        text
    }

    /// Takes one option off the front; `None` where none stands there.
    fn option(&mut self, text: &'a [u8]) -> Option<&'a [u8]> {
        let (name, rest) = split_word(text);
        match name.to_ascii_lowercase().as_slice() {
            b"-mm" => {
                let (values, rest) = numbers(rest, 2);
                self.range = Some(*values.first_chunk()?);
                Some(rest)
            }
            b"-bm" => {
                let (values, rest) = numbers(rest, 1);
                self.multiplier = Some(*values.first()?);
                Some(rest)
            }
            b"-s" => {
                let (scale, rest) = uv(rest, 1.0)?;
                self.uv.scale = scale;
                Some(rest)
            }
            b"-o" => {
                let (offset, rest) = uv(rest, 0.0)?;
                self.uv.offset = offset;
                Some(rest)
            }
            b"-t" => uv(rest, 0.0).map(|(_, rest)| rest),
            b"-clamp" => {
                let (on, rest) = switch(rest)?;
                self.wrap = on.then_some(Wrap::Clamp);
                Some(rest)
            }
            b"-imfchan" => {
                let (value, rest) = split_word(rest);
                self.channel = match value {
                    b"r" => Some("r"),
                    b"g" => Some("g"),
                    b"b" => Some("b"),
                    b"m" => Some("a"),
                    b"l" => Some("luminance"),
                    b"z" => None,
                    _ => return None,
                };
                Some(rest)
            }
            b"-blendu" | b"-blendv" | b"-cc" => switch(rest).map(|(_, rest)| rest),
            b"-boost" | b"-texres" => {
                let (values, rest) = numbers(rest, 1);
                values.first().map(|_| rest)
            }
            b"-type" | b"-colorspace" => {
                let (value, rest) = split_word(rest);
                (!value.is_empty()).then_some(rest)
            }
            _ => None,
        }
    }

    /// multiplier * (base + gain * h) as scale * (h - midlevel), as far as it is said.
    pub(super) fn heights(&self) -> (Option<f32>, Option<f32>) {
        match (self.range, self.multiplier) {
            (Some([base, gain]), m) if gain != 0.0 => {
                (Some(m.unwrap_or(1.0) * gain), Some(-base / gain))
            }
            (_, m) => (m, None),
        }
    }
}

/// `on` or `off`.
fn switch(text: &[u8]) -> Option<(bool, &[u8])> {
    let (value, rest) = split_word(text);
    match value.to_ascii_lowercase().as_slice() {
        b"on" => Some((true, rest)),
        b"off" => Some((false, rest)),
        _ => None,
    }
}

/// One to three numbers, of which two are read.
fn uv(text: &[u8], default: f32) -> Option<(Vec2, &[u8])> {
    let (values, rest) = numbers(text, 3);
    let u = *values.first()?;
    Some((
        Vec2::new(u, values.get(1).copied().unwrap_or(default)),
        rest,
    ))
}

/// Up to `most` numbers, and what follows them.
fn numbers(mut text: &[u8], most: usize) -> (Vec<f32>, &[u8]) {
    let mut values = Vec::new();
    while values.len() < most {
        let (word, rest) = split_word(text);
        let Some(value) = parse(word).filter(|x: &f32| x.is_finite()) else {
            break;
        };
        values.push(value);
        text = rest;
    }
    (values, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(statement: &str) -> String {
        String::from_utf8(Map::parse(statement.as_bytes()).file.to_vec()).unwrap()
    }

    #[test]
    fn options_may_stand_anywhere() {
        let name = "my height  map.png";
        for statement in [
            format!("-mm -0.5 2 -s 3 4 1 -o 0.25 -clamp on -imfchan r {name}"),
            format!("{name} -mm -0.5 2 -s 3 4 1 -o 0.25 -clamp on -imfchan r"),
            format!(" -s 3 4 -clamp ON \"{name}\" -o 0.25 0 0 -MM -0.5 2 -imfchan r "),
            format!(
                "\"{name}\" -s 3 4 -texres 512 -o 0.25 -mm -0.5 2 -type sphere -imfchan r -clamp on"
            ),
        ] {
            let map = Map::parse(statement.as_bytes());
            assert_eq!(map.file, name.as_bytes(), "{statement}");
            assert_eq!(map.heights(), (Some(2.0), Some(0.25)));
            assert_eq!(map.uv.scale, Vec2::new(3.0, 4.0));
            assert_eq!(map.uv.offset, Vec2::new(0.25, 0.0));
            assert_eq!(map.wrap, Some(Wrap::Clamp));
            assert_eq!(map.channel, Some("r"));
        }
    }

    #[test]
    fn a_plain_name_says_nothing_else() {
        let map = Map::parse(b"textures\\h.png");
        assert_eq!(map.file, b"textures\\h.png");
        assert_eq!((map.heights(), map.wrap), ((None, None), None));
    }

    #[test]
    fn bump_multiplier_is_the_scale() {
        assert_eq!(Map::parse(b"h.png -bm 0.3").heights(), (Some(0.3), None));
        let both = Map::parse(b"-bm 0.5 -mm 0.1 0.4 h.png");
        assert_eq!(both.heights(), (Some(0.2), Some(-0.25)));
    }

    #[test]
    fn what_only_looks_like_an_option_is_part_of_the_name() {
        for name in [
            "-bm",
            "-mm 1",
            "-bm x.png",
            "a -s b.png",
            "-clamp.png",
            "-",
            "\"a",
            "x -type",
        ] {
            assert_eq!(file(name), name);
        }
        assert_eq!(file(""), "");
        assert_eq!(file("-mm 1 0 h.png"), "h.png");
        assert_eq!(file("\"\""), "");
    }
}
