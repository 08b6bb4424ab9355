//! Rays from CSV (`x_m,y_m,z_m,dx,dy,dz`) or NumPy (N × 6), read in batches; and their paths, written the same way.

use super::content::Content;
use super::error::IoError;
use super::extension::{by_extension, listed};
use super::file::StagedOutput;
use super::names::defused;
use super::npy::{self, Float};
use super::output::Output;
use super::paths::unread;
use super::waiting;
use catoptric_cast::Ray;
use catoptric_model::limits::FAR_M;
use catoptric_model::place::nearest;
use catoptric_sim::trace::{Fate, Vertex};
use nalgebra::{Point3, Unit, Vector3};
use std::io::{BufReader, Cursor, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Columns of rays, in the order of an array.
const COLUMNS: [&str; 6] = ["x_m", "y_m", "z_m", "dx", "dy", "dz"];

/// Header line of paths as CSV.
const PATH_HEADER: &str = "ray,vertex,surface,x_m,y_m,z_m,dx,dy,dz,path_m\n";

/// Columns of paths as an array: distance to the first vertex or ∞, the surface on which the path ends or −1, length of
/// the whole path or ∞.
const PATH_COLUMNS: usize = 3;

catoptric_model::closed_set! {
    /// The format of a file, given by its extension.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Format {
        /// Text.
        Csv,
        /// NumPy array.
        Npy,
    }
}

impl Format {
    /// The format of a file by its name.
    ///
    /// # Errors
    /// [`IoError::Content`] if the name has the extension of none.
    pub fn of(path: &Path) -> Result<Self, IoError> {
        by_extension(path, &Self::ALL, Self::extension).ok_or_else(|| {
            let known = listed(&Self::ALL, Self::extension, "nor");
            let message = format!("is neither {known}; the extension determines the format");
            IoError::content(path, message)
        })
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Npy => "npy",
        }
    }
}

/// The rays of a file, in order.
pub struct RayReader {
    path: PathBuf,
    source: Source,
    read: usize,
}

enum Source {
    Csv {
        reader: Box<csv::Reader<Box<dyn Read>>>,
        /// Position in a row of each of the six columns.
        order: [usize; 6],
    },
    Npy {
        reader: BufReader<Box<dyn Read>>,
        float: Float,
        left: usize,
        /// Offset of the next ray, in bytes.
        at: u64,
    },
}

impl RayReader {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`IoError`] if it cannot be read or does not have the header of rays.
    pub fn open(path: &Path) -> Result<Self, IoError> {
        Format::of(path)?;
        let file = waiting::open(path).map_err(|e| IoError::read(path, unread(path, e)))?;
        Self::of(Box::new(file), path)
    }

    /// Reads the header of a file from its bytes; `path` determines the format and names the file in errors.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, IoError> {
        Self::of(Box::new(Cursor::new(bytes.to_vec())), path)
    }

    fn of(file: Box<dyn Read>, path: &Path) -> Result<Self, IoError> {
        let source = match Format::of(path)? {
            Format::Csv => {
                let mut reader = csv::Reader::from_reader(file);
                let header = reader.headers().map_err(|e| csv_error(path, e))?;
                let order = columns(header).map_err(|message| IoError::Text {
                    path: path.to_owned(),
                    line: 1,
                    column: 1,
                    message,
                })?;
                let reader = Box::new(reader);
                Source::Csv { reader, order }
            }
            Format::Npy => {
                let mut reader = BufReader::new(file);
                let header = npy::read_header(&mut reader).map_err(|e| match e.kind() {
                    ErrorKind::InvalidData => IoError::content(path, e.to_string()),
                    _ => IoError::read(path, e),
                })?;
                if header.columns != COLUMNS.len() {
                    let (rows, columns) = (header.rows, header.columns);
                    let message = format!(
                        "its shape is ({rows}, {columns}); rays are N × 6: {}",
                        COLUMNS.join(", ")
                    );
                    return Err(IoError::content(path, message));
                }
                Source::Npy {
                    reader,
                    float: header.float,
                    left: header.rows,
                    at: header.length as u64,
                }
            }
        };
        Ok(Self {
            path: path.to_owned(),
            source,
            read: 0,
        })
    }

    /// The next N rays at most; empty at the end. Directions are normalized to unit length.
    ///
    /// # Errors
    /// [`IoError`] if the file ends early, or for a ray with a number that is not finite, a coordinate beyond 10 km or a zero direction.
    pub fn next_rays(&mut self, most: usize) -> Result<Vec<Ray>, IoError> {
        let mut rays = Vec::new();
        match &mut self.source {
            Source::Csv { reader, order } => {
                let mut record = csv::StringRecord::new();
                while rays.len() < most
                    && reader
                        .read_record(&mut record)
                        .map_err(|e| csv_error(&self.path, e))?
                {
                    let line = record.position().map_or(0, csv::Position::line);
                    let fail = |field: usize, message: String| IoError::Text {
                        path: self.path.clone(),
                        line: usize::try_from(line).unwrap_or(usize::MAX),
                        column: column(&record, field),
                        message,
                    };
                    let mut numbers = [0.0; 6];
                    for ((number, &at), name) in numbers.iter_mut().zip(order.iter()).zip(COLUMNS) {
                        let word = record.get(at).unwrap_or_default().trim();
                        *number = word
                            .parse()
                            .map_err(|_| fail(at, format!("{name} is {word:?}; a number is needed")))?;
                    }
                    rays.push(ray(&numbers).map_err(|(which, message)| fail(order[which], message))?);
                }
            }
            Source::Npy {
                reader,
                float,
                left,
                at,
            } => {
                let count = most.min(*left);
                let row = COLUMNS.len() * float.size();
                let mut bytes = Vec::new();
                let wanted = (count * row) as u64;
                reader
                    .take(wanted)
                    .read_to_end(&mut bytes)
                    .map_err(|e| IoError::read(&self.path, e))?;
                if bytes.len() as u64 != wanted {
                    let message = format!(
                        "it ends after ray {}; its header promises more",
                        self.read + bytes.len() / row
                    );
                    return Err(IoError::content(&self.path, message));
                }
                for (i, bytes) in bytes.chunks_exact(row).enumerate() {
                    let mut numbers = [f64::NAN; 6];
                    for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(float.size())) {
                        *number = float.decode(bytes).unwrap_or(f64::NAN);
                    }
                    let fail = |(which, message): (usize, String)| IoError::Recording {
                        path: self.path.clone(),
                        what: format!("ray {}: {message}", self.read + i),
                        offset: *at + (i * row + which * float.size()) as u64,
                    };
                    rays.push(ray(&numbers).map_err(fail)?);
                }
                *left -= count;
                *at += wanted;
            }
        }
        self.read += rays.len();
        Ok(rays)
    }
}

/// Position of each column; all must exist, and no others.
fn columns(header: &csv::StringRecord) -> Result<[usize; 6], String> {
    let header: Vec<&str> = header.iter().map(str::trim).collect();
    if let Some(unknown) = header.iter().find(|h| !COLUMNS.contains(h)) {
        let near = nearest(unknown, COLUMNS).map_or_else(String::new, |n| format!("; did you mean {n}?"));
        return Err(format!(
            "there is no column {unknown:?} in rays; the columns are {}{near}",
            COLUMNS.join(",")
        ));
    }
    let mut order = [0; 6];
    for (at, name) in order.iter_mut().zip(COLUMNS) {
        let mut places = header.iter().enumerate().filter(|(_, h)| **h == name);
        *at = places
            .next()
            .ok_or_else(|| format!("column {name} is missing"))?
            .0;
        if places.next().is_some() {
            return Err(format!("column {name} is there twice"));
        }
    }
    Ok(order)
}

/// Column, from 1 and in characters, at which a field begins in a line without quotes.
fn column(record: &csv::StringRecord, field: usize) -> usize {
    let before: usize = record.iter().take(field).map(|f| f.chars().count() + 1).sum();
    let blanks = record
        .get(field)
        .map_or(0, |f| f.chars().take_while(|c| c.is_whitespace()).count());
    before + blanks + 1
}

/// A ray from its columns, or the column that is wrong and why.
fn ray(numbers: &[f64; 6]) -> Result<Ray, (usize, String)> {
    for (which, (name, value)) in COLUMNS.iter().zip(numbers).enumerate() {
        if !value.is_finite() {
            return Err((which, format!("{name} is {value}; a finite number is needed")));
        }
        if which < 3 && value.abs() > FAR_M {
            let message = format!("{name} is {value} m; -{FAR_M} m to {FAR_M} m is allowed");
            return Err((which, message));
        }
    }
    let [x, y, z, dx, dy, dz] = *numbers;
    // Scaled first, so that squaring neither underflows nor overflows.
    let longest = dx.abs().max(dy.abs()).max(dz.abs());
    if longest == 0.0 {
        return Err((3, "its direction is (0, 0, 0)".to_owned()));
    }
    Ok(Ray {
        origin: Point3::new(x, y, z),
        direction: Unit::new_normalize(Vector3::new(dx / longest, dy / longest, dz / longest)),
    })
}

fn csv_error(path: &Path, error: csv::Error) -> IoError {
    let line = error.position().map_or(1, csv::Position::line);
    let message = match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => {
            format!("the row has {len} fields, the header {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "the row is not UTF-8 text".to_owned(),
        _ => error.to_string(),
    };
    match error.into_kind() {
        csv::ErrorKind::Io(source) => IoError::read(path, source),
        _ => IoError::Text {
            path: path.to_owned(),
            line: usize::try_from(line).unwrap_or(usize::MAX),
            column: 1,
            message,
        },
    }
}

/// Writer of ray paths.
pub struct PathWriter {
    output: StagedOutput,
    format: Format,
    rays: usize,
    /// Buffers an array for a pipe, because its header states its length.
    waiting: Vec<u8>,
}

impl PathWriter {
    /// Begins a file.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses or the extension is unknown.
    pub fn create(out: impl Into<Output>) -> Result<Self, IoError> {
        let out = out.into();
        let format = Format::of(out.path())?;
        let content = match format {
            Format::Csv => Content::of(PATH_HEADER.as_bytes()),
            Format::Npy => Content::Array(PATH_COLUMNS),
        };
        let mut output = StagedOutput::create(out, &content)?;
        match format {
            Format::Csv => output.write(PATH_HEADER.as_bytes())?,
            Format::Npy if !output.is_direct() => output.write(&npy::header(0, PATH_COLUMNS))?,
            Format::Npy => {}
        }
        Ok(Self {
            output,
            format,
            rays: 0,
            waiting: Vec::new(),
        })
    }

    /// The format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Appends the output of [`rows`] for a given number of rays.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn write(&mut self, rays: usize, rows: &[u8]) -> Result<(), IoError> {
        self.rays += rays;
        if self.format == Format::Npy && self.output.is_direct() {
            self.waiting.extend_from_slice(rows);
            return Ok(());
        }
        self.output.write(rows)
    }

    /// Ends the file and moves it to its destination.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses; then no part of it is left.
    pub fn finish(mut self) -> Result<(), IoError> {
        if self.format == Format::Npy {
            let header = npy::header(self.rays, PATH_COLUMNS);
            if self.output.is_direct() {
                self.output.write(&header)?;
                self.output.write(&self.waiting)?;
            } else {
                self.output.rewrite_start(&header)?;
            }
        }
        self.output.finish()
    }
}

/// Appends the path of a ray in a format: a line for each vertex, or a row of the array.
pub fn rows(
    format: Format,
    ray: usize,
    vertices: &[Vertex],
    fate: Fate,
    surfaces: &[String],
    out: &mut Vec<u8>,
) {
    match format {
        Format::Csv => {
            for (number, vertex) in vertices.iter().enumerate() {
                let [x, y, z]: [f64; 3] = vertex.point.coords.into();
                let name = &surfaces[vertex.surface];
                out.extend_from_slice(format!("{ray},{number},{name},{x},{y},{z},").as_bytes());
                match vertex.direction {
                    Some(d) => out.extend_from_slice(format!("{},{},{},", d.x, d.y, d.z).as_bytes()),
                    None => out.extend_from_slice(b",,,"),
                }
                out.extend_from_slice(format!("{}\n", vertex.path).as_bytes());
            }
        }
        Format::Npy => {
            let first = vertices.first().map_or(f64::INFINITY, |v| v.path);
            let end = vertices.last().filter(|_| fate == Fate::Hit);
            let surface = end.map_or(-1.0, |v| v.surface as f64);
            let whole = end.map_or(f64::INFINITY, |v| v.path);
            out.extend([first, surface, whole].iter().flat_map(|n| n.to_le_bytes()));
        }
    }
}

/// A name as a CSV field: no formula, and quoted if necessary.
pub fn field(name: &str) -> String {
    let name = defused(name);
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.into_owned()
    }
}
