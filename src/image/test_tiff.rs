//! TIFF files for tests: any tags around any strips or tiles.

/// A file with one page.
#[derive(Clone)]
pub struct Tiff {
    big_endian: bool,
    /// BigTIFF.
    big: bool,
    /// (tag, type, values); LONG8 and smaller types.
    entries: Vec<(u16, u16, Vec<u64>)>,
    chunks: Vec<Vec<u8>>,
    /// Tags of offsets and byte counts.
    places: (u16, u16),
}

/// A type of samples.
pub trait TiffSample {
    /// SampleFormat: 1 unsigned, 2 signed, 3 float.
    const FORMAT: u64;
    fn bytes(self, big_endian: bool) -> Vec<u8>;
}

macro_rules! tiff_sample {
    ($($type:ty: $format:literal),*) => {$(
        impl TiffSample for $type {
            const FORMAT: u64 = $format;
            fn bytes(self, big_endian: bool) -> Vec<u8> {
                match big_endian {
                    true => self.to_be_bytes().to_vec(),
                    false => self.to_le_bytes().to_vec(),
                }
            }
        }
    )*};
}

tiff_sample!(u8: 1, u16: 1, u32: 1, u64: 1, i8: 2, i16: 2, i32: 2, i64: 2, half::f16: 3, f32: 3, f64: 3);

impl Tiff {
    /// Grey, uncompressed, one strip; samples of `bits` bits.
    pub fn packed(width: u64, height: u64, bits: u64, strip: Vec<u8>) -> Self {
        Self {
            big_endian: false,
            big: false,
            entries: Vec::new(),
            chunks: vec![strip],
            places: (273, 279),
        }
        .with(256, 4, [width])
        .with(257, 4, [height])
        .with(258, 3, [bits])
        .with(259, 3, [1])
        .with(262, 3, [1])
        .with(277, 3, [1])
    }

    /// Grey, uncompressed, one strip, little-endian.
    pub fn grey<T: TiffSample + Copy>(width: u64, height: u64, samples: &[T]) -> Self {
        let bits = 8 * size_of::<T>() as u64;
        Self::packed(width, height, bits, bytes(samples, false)).with(339, 3, [T::FORMAT])
    }

    /// RGB, uncompressed, one strip, little-endian.
    pub fn rgb<T: TiffSample + Copy>(width: u64, height: u64, samples: &[T]) -> Self {
        Self::grey(width, height, samples)
            .with(262, 3, [2])
            .with(277, 3, [3])
            .with(258, 3, [8 * size_of::<T>() as u64; 3])
    }

    /// With tags in this byte order, perhaps as BigTIFF; strips and tiles stay as they are.
    pub fn stored(self, big_endian: bool, big: bool) -> Self {
        Self {
            big_endian,
            big,
            ..self
        }
    }

    /// With this tag; one that is there is replaced.
    pub fn with(mut self, tag: u16, kind: u16, values: impl IntoIterator<Item = u64>) -> Self {
        self.entries.retain(|entry| entry.0 != tag);
        self.entries.push((tag, kind, values.into_iter().collect()));
        self.entries.sort();
        self
    }

    /// With this text.
    pub fn with_text(self, tag: u16, text: &str) -> Self {
        self.with(tag, 2, text.bytes().chain([0]).map(u64::from))
    }

    /// With these strips.
    pub fn strips(mut self, rows: u64, strips: Vec<Vec<u8>>) -> Self {
        self.chunks = strips;
        self.with(278, 3, [rows])
    }

    /// With these tiles.
    pub fn tiles(mut self, width: u64, height: u64, tiles: Vec<Vec<u8>>) -> Self {
        self.chunks = tiles;
        self.places = (324, 325);
        self.with(322, 3, [width]).with(323, 3, [height])
    }

    /// Strips or tiles compressed.
    pub fn compressed(mut self, code: u64, compress: impl Fn(&[u8]) -> Vec<u8>) -> Self {
        self.chunks = self.chunks.iter().map(|chunk| compress(chunk)).collect();
        self.with(259, 3, [code])
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        let mut file = self.header();
        let mut offsets = Vec::new();
        for chunk in &self.chunks {
            offsets.push(file.len() as u64);
            file.extend(chunk);
        }
        let counts = self.chunks.iter().map(|chunk| chunk.len() as u64);
        // A test may have said something else.
        let mut page = self.clone();
        for (tag, values) in [(self.places.0, offsets), (self.places.1, counts.collect())] {
            if !self.entries.iter().any(|entry| entry.0 == tag) {
                page = page.with(tag, if self.big { 16 } else { 4 }, values);
            }
        }
        page.append_directory(&mut file);
        file
    }

    fn header(&self) -> Vec<u8> {
        let mut file = if self.big_endian {
            b"MM".to_vec()
        } else {
            b"II".to_vec()
        };
        match self.big {
            true => [(43, 2), (8, 2), (0, 2), (0, 8)]
                .map(|(number, size)| self.put(&mut file, number, size)),
            false => [(42, 2), (0, 4), (0, 0), (0, 0)]
                .map(|(number, size)| self.put(&mut file, number, size)),
        };
        file
    }

    fn append_directory(&self, file: &mut Vec<u8>) {
        let (count_size, word) = if self.big { (8, 8) } else { (2, 4) };
        let mut directory = Vec::new();
        self.put(&mut directory, self.entries.len() as u64, count_size);
        for (tag, kind, values) in &self.entries {
            self.put(&mut directory, (*tag).into(), 2);
            self.put(&mut directory, (*kind).into(), 2);
            self.put(&mut directory, values.len() as u64, word);
            let size = match kind {
                1 | 2 | 7 => 1,
                3 => 2,
                4 => 4,
                _ => 8,
            };
            let mut field = Vec::new();
            for &value in values {
                self.put(&mut field, value, size);
            }
            if field.len() > word {
                let offset = file.len() as u64;
                file.extend(&field);
                field.clear();
                self.put(&mut field, offset, word);
            }
            field.resize(word, 0);
            directory.extend(field);
        }
        self.put(&mut directory, 0, word);
        let mut offset = Vec::new();
        self.put(&mut offset, file.len() as u64, word);
        let place = if self.big { 8 } else { 4 };
        file[place..place + word].copy_from_slice(&offset);
        file.extend(directory);
    }

    fn put(&self, out: &mut Vec<u8>, number: u64, size: usize) {
        match self.big_endian {
            true => out.extend(&number.to_be_bytes()[8 - size..]),
            false => out.extend(&number.to_le_bytes()[..size]),
        }
    }
}

/// Samples as bytes.
pub fn bytes<T: TiffSample + Copy>(samples: &[T], big_endian: bool) -> Vec<u8> {
    samples.iter().flat_map(|s| s.bytes(big_endian)).collect()
}
