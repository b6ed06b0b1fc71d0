//! The bytes of a document: every buffer read once, every compressed view unpacked once, when it is first asked for.

use std::cell::{Cell, OnceCell};
use std::collections::HashMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::container::Container;
use super::document::{Document, Meshopt};
use super::uri::{Resource, Uris};
use super::{LoadMeshErrorKind, malformed, meshopt};
use crate::files::input;

/// All buffers and buffer views.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    buffers: Vec<Bytes<'a>>,
    /// Per view, what its stream unpacks to. Views of the same stream share the place of the first of them.
    unpacked: Vec<(usize, OnceCell<Vec<u8>>)>,
    /// Bytes that streams may still unpack to.
    left: Cell<usize>,
    /// The files that were read.
    pub files: Vec<PathBuf>,
}

/// What streams may unpack to: so many bytes in any file, and so many for each byte of its buffers. Constant data shrinks by a
/// factor of a thousand, but not all of a mesh is constant.
const UNPACKED_FREE: usize = 64 << 20;
const UNPACKED_PER_BYTE: usize = 64;

/// A buffer.
enum Bytes<'a> {
    Chunk(&'a [u8]),
    Own(Rc<Vec<u8>>),
    /// Of a compressed file, for readers that cannot unpack it.
    Fallback,
}

/// What a buffer is made of.
enum Source {
    Chunk,
    Fallback,
    Bytes(Rc<Vec<u8>>),
    File(PathBuf),
}

impl<'a> Buffers<'a> {
    /// Reads every buffer; a file that several name is read once.
    pub fn read(
        document: &'a Document,
        container: &Container<'a>,
        uris: Uris,
    ) -> Result<Self, LoadMeshErrorKind> {
        let sources = document.buffers.iter().enumerate();
        let sources = sources.map(|(index, buffer)| {
            let what = name(index);
            Ok(match &buffer.uri {
                _ if buffer.is_fallback() => Source::Fallback,
                None if index == 0 && container.binary.is_some() => Source::Chunk,
                None => {
                    return Err(malformed(
                        &what,
                        "it has no URI, and there is no binary chunk for it",
                    ));
                }
                Some(uri) => match uris.resolve(uri, &what)? {
                    Resource::Bytes(bytes) => Source::Bytes(Rc::new(bytes)),
                    Resource::File(file) => Source::File(file),
                },
            })
        });
        let sources = sources.collect::<Result<Vec<_>, _>>()?;
        let mut files = Files::default();
        for (index, source) in sources.iter().enumerate() {
            if let Source::File(file) = source {
                files.want(file, document.buffers[index].byte_length, &name(index))?;
            }
        }
        let mut buffers = Vec::with_capacity(sources.len());
        for (index, source) in sources.into_iter().enumerate() {
            let bytes = match source {
                Source::Chunk => Bytes::Chunk(container.binary.unwrap_or_default()),
                Source::Fallback => Bytes::Fallback,
                Source::Bytes(bytes) => Bytes::Own(bytes),
                Source::File(file) => Bytes::Own(files.read(&file, &name(index))?),
            };
            let wanted = document.buffers[index].byte_length;
            if let Some(found) = bytes.get() {
                check_length(found.len() as u64, wanted, &name(index))?;
            }
            buffers.push(bytes);
        }
        let read: usize = buffers.iter().filter_map(Bytes::get).map(<[u8]>::len).sum();
        Ok(Self {
            document,
            left: Cell::new(
                read.saturating_mul(UNPACKED_PER_BYTE)
                    .saturating_add(UNPACKED_FREE),
            ),
            buffers,
            unpacked: shared_streams(document),
            files: files.named,
        })
    }

    /// The bytes of buffer view `index`, unpacked if they are compressed.
    pub fn view(&self, index: usize) -> Result<&[u8], LoadMeshErrorKind> {
        let view = &self.document.buffer_views[index];
        let Some(stream) = view.meshopt() else {
            return self.slice(view.buffer, view.byte_offset, view.byte_length, index);
        };
        let unpacked = &self.unpacked[self.unpacked[index].0].1;
        if let Some(bytes) = unpacked.get() {
            return Ok(bytes);
        }
        let packed = self.slice(stream.buffer, stream.byte_offset, stream.byte_length, index)?;
        let what = format!("buffer view {index}, meshopt stream");
        let length = stream.count.saturating_mul(stream.byte_stride);
        let Some(left) = self.left.get().checked_sub(length) else {
            let problem =
                format!("it unpacks to {length} bytes, out of all proportion to the file");
            return Err(malformed(&what, problem));
        };
        self.left.set(left);
        let bytes = meshopt::decode(stream, packed).map_err(|problem| malformed(&what, problem))?;
        Ok(unpacked.get_or_init(|| bytes))
    }

    /// From one element of a view to the next, if the view says.
    pub fn stride(&self, index: usize) -> Option<usize> {
        let view = &self.document.buffer_views[index];
        view.meshopt().map(|s| s.byte_stride).or(view.byte_stride)
    }

    /// All bytes there are.
    pub fn len(&self) -> usize {
        let buffers = self.buffers.iter().filter_map(Bytes::get);
        buffers.map(<[u8]>::len).sum()
    }

    fn slice(
        &self,
        buffer: usize,
        offset: usize,
        length: usize,
        view: usize,
    ) -> Result<&[u8], LoadMeshErrorKind> {
        let what = format!("buffer view {view}");
        let Some(bytes) = self.buffers[buffer].get() else {
            return Err(malformed(
                &what,
                format!("it lies in buffer {buffer}, a fallback without bytes"),
            ));
        };
        let range = offset..offset.saturating_add(length);
        bytes.get(range).ok_or_else(|| {
            let found = bytes.len();
            let problem = format!("its {length} bytes from {offset} on do not lie inside buffer {buffer} of {found} bytes");
            malformed(&what, problem)
        })
    }
}

impl Bytes<'_> {
    fn get(&self) -> Option<&[u8]> {
        match self {
            Self::Chunk(bytes) => Some(bytes),
            Self::Own(bytes) => Some(bytes),
            Self::Fallback => None,
        }
    }
}

fn name(buffer: usize) -> String {
    format!("buffer {buffer}")
}

/// Per view, the first view that unpacks the same stream.
fn shared_streams(document: &Document) -> Vec<(usize, OnceCell<Vec<u8>>)> {
    let mut first: HashMap<&Meshopt, usize> = HashMap::new();
    let views = document.buffer_views.iter().enumerate();
    views
        .map(|(index, view)| {
            let place = view
                .meshopt()
                .map_or(index, |stream| *first.entry(stream).or_insert(index));
            (place, OnceCell::new())
        })
        .collect()
}

/// What is known of a file: how many bytes of it are wanted, and those bytes.
#[derive(Default)]
struct Known {
    wanted: usize,
    bytes: Option<Rc<Vec<u8>>>,
}

/// The files that buffers are read from.
#[derive(Default)]
struct Files {
    /// By the one path that all names of a file lead to.
    known: HashMap<PathBuf, Known>,
    named: Vec<PathBuf>,
}

impl Files {
    /// As many bytes of the file will be needed, or more. A file that is too short for that is not read in vain.
    fn want(&mut self, file: &Path, bytes: usize, what: &str) -> Result<(), LoadMeshErrorKind> {
        // What else may be wrong with the file is told when it is opened.
        if let Ok(found) = file.metadata()
            && found.is_file()
        {
            check_length(found.len(), bytes, what)?;
        }
        let known = self.known.entry(identity(file)).or_default();
        known.wanted = bytes.max(known.wanted);
        Ok(())
    }

    /// The first bytes of the file, as many as are wanted or there are.
    fn read(&mut self, file: &Path, what: &str) -> Result<Rc<Vec<u8>>, LoadMeshErrorKind> {
        let known = self.known.entry(identity(file)).or_default();
        if let Some(bytes) = &known.bytes {
            return Ok(bytes.clone());
        }
        let bytes = read_start(file, known.wanted).map_err(|source| LoadMeshErrorKind::Read {
            what: format!("{what}, {}", file.display()),
            source,
        })?;
        self.named.push(file.to_owned());
        Ok(known.bytes.insert(Rc::new(bytes)).clone())
    }
}

fn check_length(found: u64, wanted: usize, what: &str) -> Result<(), LoadMeshErrorKind> {
    if found >= u64::try_from(wanted).unwrap_or(u64::MAX) {
        return Ok(());
    }
    let problem = format!("{found} bytes found, {wanted} expected");
    Err(malformed(what, problem))
}

fn read_start(file: &Path, wanted: usize) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let wanted = u64::try_from(wanted).unwrap_or(u64::MAX);
    input::open(file)?.take(wanted).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn identity(file: &Path) -> PathBuf {
    file.canonicalize().unwrap_or_else(|_| file.to_owned())
}
