//! What a URI of a glTF file stands for: bytes of its own, or a file. Nothing is fetched, and what lies outside of the
//! file's own folder is read only where the user says so: a downloaded model must not pick files of the reader's.

use std::path::{Component, Path, PathBuf};

use super::{LoadMeshErrorKind, malformed};
use crate::scene::load::beside;

/// Turns the URIs of one file into what they stand for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Uris<'a> {
    /// The file that they stand in.
    pub path: &'a Path,
    /// Whether files outside of its folder may be named.
    pub allow_external: bool,
}

/// What a URI stands for.
#[derive(Debug, PartialEq)]
pub(super) enum Resource {
    /// The bytes that it holds.
    Bytes(Vec<u8>),
    /// A file, not checked to exist.
    File(PathBuf),
}

impl Uris<'_> {
    /// What `uri` stands for, which `what` names.
    ///
    /// # Errors
    ///
    /// A data URI that is none, an address in a network, or a file outside of the folder.
    pub fn resolve(&self, uri: &str, what: &str) -> Result<Resource, LoadMeshErrorKind> {
        if let Some(data) = strip_scheme(uri, "data") {
            let bytes = data_bytes(data)
                .ok_or_else(|| malformed(what, "its data URI is not valid base64"))?;
            return Ok(Resource::Bytes(bytes));
        }
        let name = decoded_text(uri);
        let (name, is_url) = match strip_scheme(&name, "file") {
            // The host, if any, is this machine.
            Some(rest) => match rest.strip_prefix("//") {
                Some(rest) => (&rest[rest.find('/').unwrap_or(rest.len())..], true),
                None => (rest, true),
            },
            None => (&name[..], false),
        };
        if !is_url && let Some((scheme, _)) = name.split_once("://") {
            let problem = format!(
                "it is at the address {:?}; nothing is fetched by {scheme}, save it beside the file",
                shortened(uri)
            );
            return Err(malformed(what, problem));
        }
        let file = beside(self.path, name);
        if !self.allow_external && (is_url || leaves_folder(name)) {
            return Err(LoadMeshErrorKind::External {
                what: what.to_owned(),
                uri: shortened(uri),
            });
        }
        Ok(Resource::File(file))
    }
}

/// What follows `scheme:`, in any case of its letters.
fn strip_scheme<'a>(uri: &'a str, scheme: &str) -> Option<&'a str> {
    let (found, rest) = uri.split_once(':')?;
    found.eq_ignore_ascii_case(scheme).then_some(rest)
}

/// Whether a path, in the habit of any system, may lead out of the folder that it is relative to.
fn leaves_folder(name: &str) -> bool {
    let name = name.replace('\\', "/");
    // C:/, which is relative on systems that have no drives.
    if name.as_bytes().get(1) == Some(&b':') && name.as_bytes()[0].is_ascii_alphabetic() {
        return true;
    }
    let mut depth = 0_usize;
    for component in Path::new(&name).components() {
        match component {
            Component::Normal(_) => depth += 1,
            Component::CurDir => {}
            Component::ParentDir => match depth.checked_sub(1) {
                Some(above) => depth = above,
                None => return true,
            },
            Component::RootDir | Component::Prefix(_) => return true,
        }
    }
    false
}

/// At most as much of a URI as a message can bear.
fn shortened(uri: &str) -> String {
    const SHOWN: usize = 80;
    match uri.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}...", &uri[..end]),
        None => uri.to_owned(),
    }
}

/// The bytes of a data URI (RFC 2397), after `data:`.
fn data_bytes(data: &str) -> Option<Vec<u8>> {
    let (kind, text) = data.split_once(',')?;
    if kind.to_ascii_lowercase().ends_with(";base64") {
        base64(text)
    } else {
        Some(percent_decoded(text))
    }
}

/// RFC 4648, with or without padding.
fn base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0);
    for c in text.bytes() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    // One letter alone is less than a byte.
    (held < 6).then_some(bytes)
}

fn decoded_text(uri: &str) -> String {
    String::from_utf8_lossy(&percent_decoded(uri)).into_owned()
}

fn percent_decoded(uri: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let hex = (*first == b'%')
            .then(|| tail.first_chunk::<2>())
            .flatten()
            .and_then(|pair| std::str::from_utf8(pair).ok())
            .filter(|pair| pair.bytes().all(|c| c.is_ascii_hexdigit()))
            .and_then(|pair| u8::from_str_radix(pair, 16).ok());
        bytes.push(hex.unwrap_or(*first));
        rest = &tail[if hex.is_some() { 2 } else { 0 }..];
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(uri: &str, allow_external: bool) -> Result<Resource, LoadMeshErrorKind> {
        let path = Path::new("models/m.gltf");
        let uris = Uris {
            path,
            allow_external,
        };
        uris.resolve(uri, "buffer 0")
    }

    #[test]
    fn files_in_the_folder_are_found_by_their_decoded_names() {
        for (uri, file) in [
            ("a.bin", "models/a.bin"),
            ("./deep/a.bin", "models/./deep/a.bin"),
            ("deep\\a.bin", "models/deep/a.bin"),
            ("my%20data.bin", "models/my data.bin"),
            ("100%.bin", "models/100%.bin"),
            ("%+1.bin", "models/%+1.bin"),
            ("deep/../a.bin", "models/deep/../a.bin"),
            ("..a/b..", "models/..a/b.."),
            ("scan:1.bin", "models/scan:1.bin"),
        ] {
            let found = resolve(uri, false).unwrap();
            assert_eq!(found, Resource::File(file.into()), "{uri}");
        }
    }

    #[test]
    fn files_elsewhere_need_leave() {
        for uri in [
            "../a.bin",
            "deep/../../a.bin",
            "..\\a.bin",
            "%2e%2e/a.bin",
            "%2E%2e%2Fa.bin",
            "/etc/hostname",
            "%2Fetc/hostname",
            "\\\\server\\a.bin",
            "C:\\a.bin",
            "c:/a.bin",
            "file:///etc/hostname",
            "FILE:/etc/hostname",
            "file:a.bin",
            "file%3A///etc/hostname",
            "..",
        ] {
            let error = resolve(uri, false).unwrap_err();
            assert!(
                matches!(error, LoadMeshErrorKind::External { .. }),
                "{uri}: {error}"
            );
            assert!(error.to_string().contains("--allow-external"), "{error}");
            assert!(matches!(resolve(uri, true), Ok(Resource::File(_))), "{uri}");
        }
        let found = resolve("file://localhost/etc/my%20host", true).unwrap();
        assert_eq!(found, Resource::File("/etc/my host".into()));
    }

    #[test]
    fn nothing_is_fetched() {
        for allow in [false, true] {
            for uri in ["http://a.b/c.bin", "https%3A//a.b/c", "ftp://x/y"] {
                let error = resolve(uri, allow).unwrap_err().to_string();
                assert!(error.contains("fetched"), "{error}");
            }
        }
    }

    #[test]
    fn data_uris_hold_their_bytes() {
        for (uri, bytes) in [
            (
                "data:application/octet-stream;base64,aGVsbG8=",
                &b"hello"[..],
            ),
            ("DATA:;BASE64,+/8", &[0xfb, 0xff]),
            ("data:,a%00b", b"a\0b"),
            ("data:;base64,", b""),
        ] {
            assert_eq!(resolve(uri, false).unwrap(), Resource::Bytes(bytes.into()));
        }
        for uri in [
            "data:;base64,a b",
            "data:nothing",
            "data:;base64,aGVsb",
            "data:;base64,a=b=",
        ] {
            assert!(resolve(uri, true).is_err(), "{uri}");
        }
    }
}
