//! A table of rays: CSV with a header, columns in any order, `tnear` and `tfar` optional.
//!
//! Numbers need no quotes, so a row is a line, and its number is the one that an editor shows.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use thiserror::Error;

use crate::files::input;
use crate::ray::{MAX_COORDINATE, Ray};
use crate::trace::RayReach;

/// Columns that a table must have, then those it may have.
const COLUMNS: [&str; 8] = ["ox", "oy", "oz", "dx", "dy", "dz", "tnear", "tfar"];
const REQUIRED: usize = 6;

/// Why a table of rays was refused.
#[derive(Debug, Error)]
pub enum RayError {
    /// The file cannot be opened or read.
    #[error("cannot read rays {file}: {source}")]
    Read {
        /// The file, `-` for standard input.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// The header lacks a column, repeats one or has one that means nothing.
    #[error(
        "{file}:1: found {found}; expected the columns ox,oy,oz,dx,dy,dz and perhaps tnear,tfar"
    )]
    Header {
        /// The file.
        file: String,
        /// What is wrong.
        found: String,
    },
    /// A row with too few or too many fields.
    #[error("{file}:{line}: found {found} fields; expected {expected}, as in the header")]
    Fields {
        /// The file.
        file: String,
        /// From 1; the header is the first.
        line: u64,
        /// Fields in the row.
        found: usize,
        /// Columns of the header.
        expected: usize,
    },
    /// A line too long for a table of numbers.
    #[error(
        "{file}:{line}: found a line of {LONGEST} bytes or more; expected comma-separated numbers"
    )]
    LongLine {
        /// The file.
        file: String,
        /// From 1; the header is the first.
        line: u64,
    },
    /// A value that does not fit.
    #[error("{file}:{line}: {column}: found {found}; expected {expected}")]
    Value {
        /// The file.
        file: String,
        /// From 1; the header is the first.
        line: u64,
        /// The column, or the columns.
        column: &'static str,
        /// What the row has.
        found: String,
        /// What fits.
        expected: String,
    },
}

/// One row of the table. It is split and read as numbers later, on many threads.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// From 1; the header is the first.
    line: u64,
    text: Vec<u8>,
}

/// Longest row, bytes: what is longer is no table of numbers.
const LONGEST: u64 = 1 << 12;

/// Reads rays, many rows at a time.
pub struct RayReader {
    lines: Lines,
    layout: Layout,
}

/// The lines of a file that are not blank.
struct Lines {
    file: String,
    input: BufReader<Box<dyn Read>>,
    /// Lines read so far.
    count: u64,
}

/// Where the columns are.
#[derive(Debug)]
pub struct Layout {
    file: String,
    columns: usize,
    /// Per name in [`COLUMNS`] its index in a row.
    index: [Option<usize>; 8],
}

impl RayReader {
    /// Opens a file, or standard input for `-`, and reads the header.
    pub fn open(path: &Path) -> Result<Self, RayError> {
        let file = path.display().to_string();
        let input: Box<dyn Read> = if path == Path::new("-") {
            Box::new(io::stdin())
        } else {
            let opened = input::open(path).map_err(|source| RayError::Read {
                file: file.clone(),
                source,
            })?;
            Box::new(opened)
        };
        Self::new(file, input)
    }

    fn new(file: String, input: Box<dyn Read>) -> Result<Self, RayError> {
        let mut lines = Lines {
            file,
            input: BufReader::with_capacity(1 << 16, input),
            count: 0,
        };
        let mut header = Row::default();
        if !lines.read(&mut header)? {
            let (file, found) = (lines.file, "an empty file".into());
            return Err(RayError::Header { file, found });
        }
        let layout = Layout::new(lines.file.clone(), &header)?;
        Ok(Self { lines, layout })
    }

    /// Where the columns are.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Fills `rows` from its start with the next rows; the number of rows read is less than its length only
    /// at the end of the table.
    pub fn read(&mut self, rows: &mut [Row]) -> Result<usize, RayError> {
        for (done, row) in rows.iter_mut().enumerate() {
            if !self.lines.read(row)? {
                return Ok(done);
            }
        }
        Ok(rows.len())
    }
}

impl Lines {
    /// The next line that is not blank; false at the end.
    fn read(&mut self, row: &mut Row) -> Result<bool, RayError> {
        loop {
            row.text.clear();
            let mut input = self.input.by_ref().take(LONGEST);
            let read = input.read_until(b'\n', &mut row.text);
            let length = read.map_err(|source| RayError::Read {
                file: self.file.clone(),
                source,
            })?;
            self.count += 1;
            row.line = self.count;
            if length as u64 == LONGEST {
                return Err(RayError::LongLine {
                    file: self.file.clone(),
                    line: row.line,
                });
            }
            if length == 0 || !row.text.trim_ascii().is_empty() {
                return Ok(length > 0);
            }
        }
    }
}

impl Row {
    fn fields(&self) -> impl Iterator<Item = &[u8]> {
        let fields = self.text.split(|&byte| byte == b',');
        fields.map(<[u8]>::trim_ascii)
    }
}

impl Layout {
    fn new(file: String, header: &Row) -> Result<Self, RayError> {
        let mut index = [None; 8];
        let text = String::from_utf8_lossy(&header.text);
        let text = text.trim_start_matches('\u{feff}'); // as spreadsheets begin a file
        let names: Vec<_> = text.split(',').map(str::trim).collect();
        for (position, name) in names.iter().enumerate() {
            let slot = COLUMNS.iter().position(|column| column == name);
            let found = match slot {
                Some(slot) if index[slot].is_none() => {
                    index[slot] = Some(position);
                    continue;
                }
                Some(_) => format!("the column {name} twice"),
                None => format!("the column {}", show(name.as_bytes())),
            };
            return Err(RayError::Header { file, found });
        }
        if let Some(missing) = (0..REQUIRED).find(|&slot| index[slot].is_none()) {
            let found = format!("no column {}", COLUMNS[missing]);
            return Err(RayError::Header { file, found });
        }
        Ok(Self {
            file,
            columns: names.len(),
            index,
        })
    }

    /// The ray of one row, for a world of this reach.
    pub fn ray(&self, row: &Row, reach: &RayReach) -> Result<Ray, RayError> {
        let fields = self.fields(row)?;
        let mut origin = [0.0; 3];
        let mut direction = [0.0; 3];
        for axis in 0..3 {
            origin[axis] = self.within(row, &fields, axis, reach.origin())?;
            direction[axis] = self.within(row, &fields, 3 + axis, MAX_COORDINATE)?;
        }
        let [dx, dy, dz] = direction;
        if direction == [0.0; 3] {
            let found = format!("{dx},{dy},{dz}");
            return Err(self.value(row, "dx,dy,dz", found, "a direction that is not zero"));
        }
        let (tnear, tfar) = self.interval(row, &fields)?;
        Ok(Ray {
            tnear,
            tfar,
            ..Ray::new(origin.into(), direction.into())
        })
    }

    /// The fields in the order of [`COLUMNS`]; empty where the table has no such column.
    fn fields<'r>(&self, row: &'r Row) -> Result<[&'r [u8]; 8], RayError> {
        let mut found = 0;
        let mut all: [&[u8]; 8] = [b""; 8];
        for field in row.fields() {
            if let Some(slot) = all.get_mut(found) {
                *slot = field;
            }
            found += 1;
        }
        if found != self.columns {
            return Err(RayError::Fields {
                file: self.file.clone(),
                line: row.line,
                found,
                expected: self.columns,
            });
        }
        // A header has at most 8 columns: none is unknown, none comes twice.
        Ok(self.index.map(|index| index.map_or(&b""[..], |i| all[i])))
    }

    /// `tnear` and `tfar`; 0 and infinity where the column is missing or its field empty.
    fn interval(&self, row: &Row, fields: &[&[u8]; 8]) -> Result<(f32, f32), RayError> {
        let [near, far] = [6, 7];
        let tnear = match fields[near] {
            b"" => 0.0,
            _ => self.within(row, fields, near, f32::MAX)?,
        };
        if tnear < 0.0 {
            let found = tnear.to_string();
            return Err(self.value(row, COLUMNS[near], found, "a number of at least 0"));
        }
        let tfar = match fields[far] {
            b"" => Some(f32::INFINITY),
            text => number(text),
        };
        match tfar.filter(|&t| t >= tnear) {
            Some(tfar) => Ok((tnear, tfar)),
            None => {
                let expected = "a number of at least tnear, or inf";
                Err(self.value(row, COLUMNS[far], show(fields[far]), expected))
            }
        }
    }

    /// A number of at most this size.
    fn within(
        &self,
        row: &Row,
        fields: &[&[u8]; 8],
        column: usize,
        largest: f32,
    ) -> Result<f32, RayError> {
        let text = fields[column];
        let found = number(text);
        if let Some(x) = found.filter(|x| x.abs() <= largest) {
            return Ok(x);
        }
        let expected = match found {
            Some(x) if x.is_finite() => format!("a number within +-{largest:e}"),
            _ => "a finite number".into(),
        };
        Err(self.value(row, COLUMNS[column], show(text), expected))
    }

    fn value(
        &self,
        row: &Row,
        column: &'static str,
        found: String,
        expected: impl Into<String>,
    ) -> RayError {
        RayError::Value {
            file: self.file.clone(),
            line: row.line,
            column,
            found,
            expected: expected.into(),
        }
    }
}

fn number(text: &[u8]) -> Option<f32> {
    std::str::from_utf8(text).ok()?.parse().ok()
}

fn show(text: &[u8]) -> String {
    match text {
        b"" => "nothing".into(),
        _ => String::from_utf8_lossy(&text[..text.len().min(60)]).into_owned(),
    }
}

/// The damage that files of all kinds are held to.
#[cfg(test)]
#[path = "../../fuzz/loaders/mutate.rs"]
mod mutate;

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn read(table: &'static str) -> Result<Vec<Ray>, RayError> {
        read_bytes(table.into())
    }

    fn read_bytes(table: Vec<u8>) -> Result<Vec<Ray>, RayError> {
        let mut reader = RayReader::new("rays.csv".into(), Box::new(io::Cursor::new(table)))?;
        let mut rows = vec![Row::default(); 3];
        let mut rays = Vec::new();
        loop {
            let count = reader.read(&mut rows)?;
            for row in &rows[..count] {
                rays.push(reader.layout().ray(row, &RayReach::default())?);
            }
            if count < rows.len() {
                return Ok(rays);
            }
        }
    }

    fn refusal(table: &'static str) -> String {
        read(table).unwrap_err().to_string()
    }

    #[test]
    fn columns_come_in_any_order_and_the_interval_is_optional() {
        let rays =
            read("\u{feff}dx,dy,dz,ox,oy,oz\n0,0,-2, 1,2,3\r\n\n1e-3,0,0,-1,0,0.5\n").unwrap();
        assert_eq!(
            rays[0],
            Ray::new(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 0.0, -2.0))
        );
        assert_eq!(rays[1].direction.x, 1e-3);
        assert_eq!(rays.len(), 2);
        let rays =
            read("tfar,ox,oy,oz,dx,dy,dz,tnear\n,0,0,0,1,0,0,\ninf,0,0,0,1,0,0,2\n7,0,0,0,1,0,0,7")
                .unwrap();
        let intervals: Vec<_> = rays.iter().map(|r| (r.tnear, r.tfar)).collect();
        assert_eq!(
            intervals,
            [(0.0, f32::INFINITY), (2.0, f32::INFINITY), (7.0, 7.0)]
        );
    }

    #[test]
    fn damaged_tables_are_read_or_refused() {
        let tables: [&[u8]; 2] = [
            b"ox,oy,oz,dx,dy,dz\n0,0,5,0,0,-1\n1.5,-2e-3,4,0.1,0.2,-1\n",
            b"\xef\xbb\xbftnear,tfar,dx,dy,dz,ox,oy,oz\r\n0,inf,0,0,-2,1,2,3\r\n,,1,0,0,0,0,0\r\n",
        ];
        let mut random = mutate::Random::new(1);
        let mut taken = 0;
        for round in 0..5000 {
            let table = mutate::damaged(
                &mut random,
                tables[round % 2],
                tables[(round + 1) % 2],
                true,
            );
            match read_bytes(table) {
                Ok(rays) => {
                    taken += 1;
                    assert!(rays.iter().all(Ray::is_valid));
                }
                Err(error) => assert!(error.to_string().contains("rays.csv")),
            }
        }
        assert!((100..4900).contains(&taken), "{taken}");
    }

    #[test]
    fn a_table_without_rows_is_no_error() {
        assert_eq!(read("ox,oy,oz,dx,dy,dz").unwrap(), []);
    }

    #[test]
    fn a_file_without_lines_is_refused() {
        let zeros = Box::new(io::repeat(0));
        let refused = RayReader::new("zeros".into(), zeros).err().unwrap();
        assert!(matches!(refused, RayError::LongLine { line: 1, .. }));
    }

    #[test]
    fn headers_must_fit() {
        assert!(refusal("ox,oy,oz,dx,dy\n").contains("no column dz"));
        assert!(refusal("").contains("rays.csv:1: found an empty file"));
        assert!(refusal("\n\n").contains("found an empty file"));
        assert!(refusal("ox,oy,oz,dx,dy,dz,time\n").contains("the column time"));
        assert!(refusal("ox,ox,oy,oz,dx,dy,dz\n").contains("ox twice"));
    }

    #[test]
    fn bad_values_are_named_with_line_and_column() {
        let cases = [
            (
                "ox,oy,oz,dx,dy,dz\n0,0,0,1,0,0\n0,0,0,0,-0,0\n",
                ":3: dx,dy,dz: found 0,-0,0",
            ),
            ("ox,oy,oz,dx,dy,dz\n0,0,0,nan,0,0\n", ":2: dx: found nan"),
            ("ox,oy,oz,dx,dy,dz\n0,0,0,1,-inf,0\n", ":2: dy: found -inf"),
            ("ox,oy,oz,dx,dy,dz\n0,0,0,1,1e99,0\n", ":2: dy: found 1e99"),
            (
                "ox,oy,oz,dx,dy,dz\n0,-1.9e18,0,1,0,0\n",
                ":2: oy: found -1.9e18; expected a number within +-1.8e18",
            ),
            (
                "ox,oy,oz,dx,dy,dz\n0,0,0,1,0,1e30\n",
                ":2: dz: found 1e30; expected a number within +-1.8e18",
            ),
            (
                "ox,oy,oz,dx,dy,dz\r\n\r\n0,zero,0,1,0,0",
                ":3: oy: found zero",
            ),
            ("ox,oy,oz,dx,dy,dz\n0,,0,1,0,0\n", ":2: oy: found nothing"),
            (
                "ox,oy,oz,dx,dy,dz\n0,0,1,0,0\n",
                ":2: found 5 fields; expected 6",
            ),
            (
                "ox,oy,oz,dx,dy,dz,tnear\n0,0,0,1,0,0,-1\n",
                ":2: tnear: found -1",
            ),
            (
                "ox,oy,oz,dx,dy,dz,tfar\n0,0,0,1,0,0,nan\n",
                ":2: tfar: found nan",
            ),
            (
                "ox,oy,oz,dx,dy,dz,tnear,tfar\n0,0,0,1,0,0,2,1\n",
                ":2: tfar: found 1",
            ),
        ];
        for (table, expected) in cases {
            let message = refusal(table);
            assert!(message.contains(expected), "{message}");
        }
    }
}
