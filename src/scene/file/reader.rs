//! Reads typed values out of a TOML document; whatever does not fit becomes a [`SceneError`] with its place.
//!
//! A [`Section`] is one table, opened with the list of keys it may have; an [`Item`] is one value and
//! knows its full name (`mesh[0].displacement.scale`) and where it stands.

use std::ops::Range;
use std::path::Path;

use glam::{Vec2, Vec3};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::overrides::Override;
use super::{Place, SceneError};
use crate::ray::MAX_COORDINATE;

/// What is found where a required key is missing.
const MISSING: &str = "nothing (the key is missing)";

/// The text being read, for places.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub file: &'a Path,
    pub text: &'a str,
    /// What is laid over it.
    pub overrides: &'a [Override],
}

impl<'a> Source<'a> {
    /// The document as its root section.
    pub fn parse(self, keys: &'static [&'static str]) -> Result<Section<'a>, SceneError> {
        let root = DeTable::parse(self.text).map_err(|e| self.syntax_error(&e))?;
        let root = self.overridden(root.into_inner())?;
        Section::open(self, String::new(), 0..0, root, keys)
    }

    pub(super) fn syntax_error(self, error: &toml::de::Error) -> SceneError {
        SceneError::Syntax {
            place: self.place(error.span().unwrap_or(0..0)),
            message: error.message().to_owned(),
        }
    }

    pub(super) fn place(self, span: Range<usize>) -> Box<Place> {
        let mut overrides = self.overrides.iter();
        let place = overrides.find_map(|o| o.place(&span));
        Box::new(place.unwrap_or_else(|| Place::new(self.file, self.text, span)))
    }
}

/// One table with known keys.
pub(super) struct Section<'a> {
    source: Source<'a>,
    /// Full name; empty for the root.
    name: String,
    span: Range<usize>,
    entries: DeTable<'a>,
}

impl<'a> Section<'a> {
    fn open(
        source: Source<'a>,
        name: String,
        span: Range<usize>,
        entries: DeTable<'a>,
        keys: &'static [&'static str],
    ) -> Result<Self, SceneError> {
        let stranger = entries
            .keys()
            .filter(|k| !keys.contains(&&**k.get_ref()))
            .min_by_key(|k| k.span().start);
        if let Some(key) = stranger {
            return Err(SceneError::Value {
                place: source.place(key.span()),
                key: join(&name, key.get_ref()),
                found: "an unknown key".into(),
                expected: one_of(keys.iter().copied()),
            });
        }
        Ok(Self {
            source,
            name,
            span,
            entries,
        })
    }

    /// The value of `key`, if the table has it.
    pub fn get(&mut self, key: &str) -> Option<Item<'a>> {
        let (_, value) = self.entries.remove_entry(key)?;
        Some(Item {
            source: self.source,
            name: join(&self.name, key),
            span: value.span(),
            value: value.into_inner(),
        })
    }

    /// The value of `key`; an error naming the table if it is missing.
    pub fn require(&mut self, key: &str, expected: &str) -> Result<Item<'a>, SceneError> {
        self.get(key).ok_or_else(|| SceneError::Value {
            place: self.place(),
            key: join(&self.name, key),
            found: MISSING.into(),
            expected: expected.into(),
        })
    }

    /// Whether the table still has `key`.
    pub fn has(&self, key: &str) -> bool {
        self.entries.get(key).is_some()
    }

    /// `read` applied to the value of `key`, if the table has it.
    pub fn optional<T>(
        &mut self,
        key: &str,
        read: impl FnOnce(Item<'a>) -> Result<T, SceneError>,
    ) -> Result<Option<T>, SceneError> {
        self.get(key).map(read).transpose()
    }

    /// Where the table begins.
    pub fn place(&self) -> Box<Place> {
        self.source.place(self.span.clone())
    }
}

/// One value.
pub(super) struct Item<'a> {
    source: Source<'a>,
    name: String,
    span: Range<usize>,
    value: DeValue<'a>,
}

impl<'a> Item<'a> {
    /// Where the value stands.
    pub fn place(&self) -> Box<Place> {
        self.source.place(self.span.clone())
    }

    /// Full name of the key.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The error "found this value, expected that".
    pub fn refuse(&self, expected: impl Into<String>) -> SceneError {
        self.error(describe(&self.value), expected)
    }

    /// The error "found something, expected that" at this value.
    pub fn error(&self, found: impl Into<String>, expected: impl Into<String>) -> SceneError {
        SceneError::Value {
            place: self.place(),
            key: self.name.clone(),
            found: found.into(),
            expected: expected.into(),
        }
    }

    /// A finite number for which `fits` holds.
    pub fn number(&self, expected: &str, fits: impl Fn(f32) -> bool) -> Result<f32, SceneError> {
        as_f32(&self.value)
            .filter(|&x| fits(x))
            .ok_or_else(|| self.refuse(expected))
    }

    /// A whole number in `range`.
    pub fn integer(&self, range: std::ops::RangeInclusive<u32>) -> Result<u32, SceneError> {
        as_u32(&self.value)
            .filter(|i| range.contains(i))
            .ok_or_else(|| {
                let (low, high) = (range.start(), range.end());
                self.refuse(format!("a whole number from {low} to {high}"))
            })
    }

    /// True or false.
    pub fn boolean(&self) -> Result<bool, SceneError> {
        match self.value {
            DeValue::Boolean(b) => Ok(b),
            _ => Err(self.refuse("true or false")),
        }
    }

    /// A string that is not empty.
    pub fn text(&self, expected: &str) -> Result<&str, SceneError> {
        match &self.value {
            DeValue::String(s) if !s.is_empty() => Ok(s),
            _ => Err(self.refuse(expected)),
        }
    }

    /// One of a few words, each with its meaning.
    pub fn word<T: Copy>(&self, words: &[(&str, T)]) -> Result<T, SceneError> {
        let found = match &self.value {
            DeValue::String(s) => words.iter().find(|(word, _)| word == s),
            _ => None,
        };
        found
            .map(|&(_, meaning)| meaning)
            .ok_or_else(|| self.refuse(one_of(words.iter().map(|(word, _)| *word))))
    }

    /// `[x, y, z]`, each number finite and `fits`.
    pub fn vec3(&self, expected: &str, fits: impl Fn(Vec3) -> bool) -> Result<Vec3, SceneError> {
        self.numbers()
            .map(Vec3::from_array)
            .filter(|&v| fits(v))
            .ok_or_else(|| self.refuse(expected))
    }

    /// A point, `[x, y, z]`, that rays can come from.
    pub fn point(&self) -> Result<Vec3, SceneError> {
        let expected = format!("a point, [x, y, z], within +-{MAX_COORDINATE:e}");
        self.vec3(&expected, |p| p.abs().max_element() <= MAX_COORDINATE)
    }

    /// A length above 0, or of at least 0.
    pub fn length(&self, may_be_zero: bool) -> Result<f32, SceneError> {
        let least = if may_be_zero {
            "of at least 0"
        } else {
            "above 0"
        };
        let expected = format!("world units {least}, up to {MAX_COORDINATE:e}");
        self.number(&expected, |x| {
            (x > 0.0 || may_be_zero && x == 0.0) && x <= MAX_COORDINATE
        })
    }

    /// `[x, y]`, each number finite.
    pub fn vec2(&self, expected: &str) -> Result<Vec2, SceneError> {
        self.numbers()
            .map(Vec2::from_array)
            .ok_or_else(|| self.refuse(expected))
    }

    /// The value of a required `key` of this table, which stays in it: the other keys depend on this one.
    pub fn peek(&self, key: &str, expected: &str) -> Result<Item<'a>, SceneError> {
        let DeValue::Table(table) = &self.value else {
            return Err(self.refuse("a table"));
        };
        let name = join(&self.name, key);
        match table.get(key) {
            Some(value) => Ok(Item {
                source: self.source,
                name,
                span: value.span(),
                value: value.get_ref().clone(),
            }),
            None => Err(SceneError::Value {
                place: self.place(),
                key: name,
                found: MISSING.into(),
                expected: expected.into(),
            }),
        }
    }

    /// A table with these keys.
    pub fn section(self, keys: &'static [&'static str]) -> Result<Section<'a>, SceneError> {
        match self.value {
            DeValue::Table(t) => Section::open(self.source, self.name, self.span, t, keys),
            _ => Err(self.refuse("a table")),
        }
    }

    /// An array, item by item.
    pub fn items(self, expected: &str) -> Result<Vec<Item<'a>>, SceneError> {
        let DeValue::Array(array) = self.value else {
            return Err(self.refuse(expected));
        };
        let (source, name) = (self.source, self.name);
        let item = |(index, value): (usize, Spanned<DeValue<'a>>)| Item {
            source,
            name: format!("{name}[{index}]"),
            span: value.span(),
            value: value.into_inner(),
        };
        Ok(array.into_iter().enumerate().map(item).collect())
    }

    /// True for a table: `base_color` is either a table or numbers.
    pub fn is_table(&self) -> bool {
        matches!(self.value, DeValue::Table(_))
    }

    /// True for a whole number: `from` is either one or a name.
    pub fn is_integer(&self) -> bool {
        matches!(self.value, DeValue::Integer(_))
    }

    /// True for a string: `unit` is either a word or a number.
    pub fn is_text(&self) -> bool {
        matches!(self.value, DeValue::String(_))
    }

    /// True for an array: `scale` is either one number or three.
    pub fn is_array(&self) -> bool {
        matches!(self.value, DeValue::Array(_))
    }

    /// An array of `N` whole numbers that u32 can hold.
    pub fn integers<const N: usize>(&self) -> Option<[u32; N]> {
        self.array(as_u32)
    }

    fn numbers<const N: usize>(&self) -> Option<[f32; N]> {
        self.array(as_f32)
    }

    fn array<T, const N: usize>(&self, read: fn(&DeValue) -> Option<T>) -> Option<[T; N]> {
        let DeValue::Array(array) = &self.value else {
            return None;
        };
        let items = array.iter().map(|v| read(v.get_ref()));
        let items: Vec<T> = items.collect::<Option<_>>()?;
        items.try_into().ok()
    }
}

/// A whole number that u32 can hold, else `None`.
fn as_u32(value: &DeValue) -> Option<u32> {
    match value {
        DeValue::Integer(i) => u32::from_str_radix(i.as_str(), i.radix()).ok(),
        _ => None,
    }
}

/// A finite number that f32 can hold, else `None`.
fn as_f32(value: &DeValue) -> Option<f32> {
    let x = match value {
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok()? as f32,
        DeValue::Float(f) => f.as_str().parse::<f32>().ok()?,
        _ => return None,
    };
    x.is_finite().then_some(x)
}

/// A value as a message shows it.
fn describe(value: &DeValue) -> String {
    /// Longest string that is shown whole.
    const LONG: usize = 40;
    match value {
        DeValue::String(s) if s.is_empty() => "an empty string".into(),
        DeValue::String(s) if s.chars().count() > LONG => {
            format!("{:?}...", s.chars().take(LONG).collect::<String>())
        }
        DeValue::String(s) => format!("{:?}", s.as_ref()),
        DeValue::Integer(i) => i.to_string(),
        DeValue::Float(f) => f.to_string(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(d) => format!("the date {d}"),
        DeValue::Array(a) if a.len() <= 4 => {
            let items: Vec<_> = a.iter().map(|v| describe(v.get_ref())).collect();
            format!("[{}]", items.join(", "))
        }
        DeValue::Array(a) => format!("an array of {}", a.len()),
        DeValue::Table(_) => "a table".into(),
    }
}

fn join(table: &str, key: &str) -> String {
    if table.is_empty() {
        key.to_owned()
    } else {
        format!("{table}.{key}")
    }
}

/// `"a", "b" or "c"`.
fn one_of<'w>(words: impl Iterator<Item = &'w str>) -> String {
    let words: Vec<_> = words.map(|w| format!("{w:?}")).collect();
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => "nothing".into(),
    }
}
