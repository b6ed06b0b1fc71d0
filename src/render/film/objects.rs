//! Objects by name, as Cryptomatte has them: Friedman and Jones, "Fully Automatic ID Mattes with Support for Motion
//! Blur and Transparency", SIGGRAPH 2015 posters; Cryptomatte Specification 1.2.0.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::Cursor;

/// The objects of a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Objects {
    /// Hash of each object's name.
    hashes: Vec<u32>,
    /// `{"name":"hash",...}`, every name once, ASCII.
    manifest: String,
}

impl Objects {
    /// The objects of these names, in the scene's order.
    pub fn new<'n>(names: impl IntoIterator<Item = &'n str>) -> Self {
        let names: Vec<&str> = names.into_iter().collect();
        let sorted: BTreeMap<&str, u32> = names.iter().map(|&name| (name, hash(name))).collect();
        let entries: Vec<String> = sorted
            .iter()
            .map(|(name, hash)| format!("{}:\"{hash:08x}\"", json(name)))
            .collect();
        Self {
            hashes: names.iter().map(|name| sorted[name]).collect(),
            manifest: format!("{{{}}}", entries.join(",")),
        }
    }

    /// Those of a file, which tells their names but not their order.
    pub(super) fn of_manifest(manifest: &str) -> Self {
        Self {
            hashes: Vec::new(),
            manifest: manifest.to_owned(),
        }
    }

    /// The hash of object `index`; 0, which is nothing, for one that has no name.
    pub fn hash(&self, index: usize) -> u32 {
        self.hashes.get(index).copied().unwrap_or(0)
    }

    /// Names and hashes as JSON.
    pub fn manifest(&self) -> &str {
        &self.manifest
    }
}

/// MurmurHash3_x86_32 of a name, changed in one bit where it would be no ordinary float (infinity, NaN, denormal).
fn hash(name: &str) -> u32 {
    let hash = murmur(name);
    match hash >> 23 & 0xff {
        0 | 0xff => hash ^ 1 << 23,
        _ => hash,
    }
}

fn murmur(name: &str) -> u32 {
    // Reading from memory does not fail.
    murmur3::murmur3_32(&mut Cursor::new(name), 0).unwrap_or(0)
}

/// The key under which a file tells of the layer `name`: the first seven digits of its hash.
pub fn layer_key(name: &str) -> String {
    let mut key = format!("{:08x}", murmur(name));
    key.truncate(7);
    key
}

/// A JSON string in ASCII: EXR attributes have no stated encoding.
fn json(text: &str) -> String {
    let mut out = String::from("\"");
    for unit in text.encode_utf16() {
        match u8::try_from(unit) {
            Ok(byte @ (b'"' | b'\\')) => out.extend(['\\', char::from(byte)]),
            Ok(byte @ b' '..=b'~') => out.push(byte.into()),
            // Writing to a string does not fail.
            _ => _ = write!(out, "\\u{unit:04x}"),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_specification() {
        // The specification's own examples.
        assert_eq!(murmur("hello"), 0x248b_fa47);
        assert_eq!(murmur(""), 0);
        assert_eq!(layer_key("CryptoObject").len(), 7);
    }

    #[test]
    fn a_hash_is_an_ordinary_float() {
        for i in 0..20_000 {
            assert!(f32::from_bits(hash(&format!("object{i}"))).is_normal());
        }
    }

    #[test]
    fn the_manifest_is_json_in_ascii_with_every_name_once() {
        let names = ["b", "a \"quoted\" \\", "\u{5ca9}\u{1f600}", "b"];
        let objects = Objects::new(names);
        assert!(objects.manifest().is_ascii());
        let read: BTreeMap<String, String> = serde_json::from_str(objects.manifest()).unwrap();
        assert_eq!(read.len(), 3);
        for (index, name) in names.into_iter().enumerate() {
            assert_eq!(read[name], format!("{:08x}", objects.hash(index)));
        }
        assert_eq!(Objects::default().hash(7), 0);
    }
}
