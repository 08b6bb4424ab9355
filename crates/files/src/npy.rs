//! NumPy array files, as far as rays need them: two-dimensional, little-endian f64 or f32, C order.
//!
//! A file is the magic `\x93NUMPY`, a version, the header's length (two bytes in version 1, four in version 2), the
//! header, a Python dictionary in ASCII, and the numbers.

use std::io::{self, Read};

/// Type of an array's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Float {
    /// 32 bits.
    F32,
    /// 64 bits.
    F64,
}

/// The contents of a header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Type of the numbers.
    pub float: Float,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Size of the whole header, in bytes.
    pub length: usize,
}

/// Size of a header written by [`header`]: fixed, so that it can be rewritten when the number of rows is known.
pub const HEADER_LENGTH: usize = START + TEXT_LENGTH as usize;

/// Bytes before a header's text in version 1.
const START: usize = 10;

/// Size of the text: the whole header is a multiple of 64, as the format requires.
const TEXT_LENGTH: u16 = 118;

/// Maximum length of a header to read: NumPy's own are a hundredth of it.
const LONGEST_HEADER: usize = 1 << 16;

const MAGIC: &[u8; 6] = b"\x93NUMPY";

impl Float {
    /// Size of one number, in bytes.
    pub fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// A number from its bytes; `None` if there are too few.
    pub fn decode(self, bytes: &[u8]) -> Option<f64> {
        match self {
            Self::F32 => Some(f64::from(f32::from_le_bytes(bytes.try_into().ok()?))),
            Self::F64 => Some(f64::from_le_bytes(bytes.try_into().ok()?)),
        }
    }
}

/// The header of an array of f64 in version 1.
pub fn header(rows: usize, columns: usize) -> Vec<u8> {
    let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    // Two numbers of at most 20 digits fit easily; the header ends with a newline.
    let padded = format!("{text:<width$}\n", width = usize::from(TEXT_LENGTH) - 1);
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend(TEXT_LENGTH.to_le_bytes());
    bytes.extend(padded.as_bytes());
    bytes
}

/// Reads a header and leaves the reader at the first number.
///
/// # Errors
/// The error of the operating system, or [`io::ErrorKind::InvalidData`] with what is wrong with the header.
pub fn read_header(reader: &mut impl Read) -> io::Result<Header> {
    let mut start = [0; 8];
    exact(reader, &mut start)?;
    if start[..6] != *MAGIC {
        return Err(damaged("it does not begin as a NumPy array does"));
    }
    let (size, length) = match start[6] {
        1 => {
            let mut length = [0; 2];
            exact(reader, &mut length)?;
            (START, usize::from(u16::from_le_bytes(length)))
        }
        2 => {
            let mut length = [0; 4];
            exact(reader, &mut length)?;
            (START + 2, u32::from_le_bytes(length) as usize)
        }
        other => return Err(damaged(format!("its version is {other}; 1 and 2 can be read"))),
    };
    if length > LONGEST_HEADER {
        return Err(damaged(format!("its header claims {length} bytes")));
    }
    let mut text = vec![0; length];
    exact(reader, &mut text)?;
    let text = std::str::from_utf8(&text).map_err(|_| damaged("its header is no text"))?;
    let parsed = parse(text).map_err(damaged)?;
    Ok(Header {
        length: size + length,
        ..parsed
    })
}

fn parse(text: &str) -> Result<Header, String> {
    let value = |key: &str| {
        let quoted = [format!("'{key}':"), format!("\"{key}\":")];
        let found = quoted.iter().find_map(|k| text.split_once(k.as_str()));
        found
            .map(|(_, rest)| rest.trim_start())
            .ok_or_else(|| format!("its header has no {key}"))
    };
    let descr = value("descr")?;
    let word = descr.trim_start_matches(['\'', '"']);
    let word = &word[..word.find(['\'', '"', ',', '}']).unwrap_or(word.len())];
    let float = match word {
        "<f8" => Float::F64,
        "<f4" => Float::F32,
        other => {
            return Err(format!(
                "its numbers are of type {other:?}; '<f8' and '<f4' can be read: save it with astype('<f8')"
            ));
        }
    };
    if !value("fortran_order")?.starts_with("False") {
        return Err("its numbers are in Fortran order; save it with numpy.ascontiguousarray".to_owned());
    }
    let shape = value("shape")?.strip_prefix('(').and_then(|s| s.split_once(')'));
    let (shape, _) = shape.ok_or("its shape is no list")?;
    let sizes: Option<Vec<usize>> = shape
        .split(',')
        .map(str::trim)
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().ok())
        .collect();
    match sizes.as_deref() {
        Some(&[rows, columns]) => Ok(Header {
            float,
            rows,
            columns,
            length: 0,
        }),
        _ => Err(format!("its shape is ({shape}); two dimensions are needed")),
    }
}

fn exact(reader: &mut impl Read, bytes: &mut [u8]) -> io::Result<()> {
    reader.read_exact(bytes).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => damaged("it ends within its header"),
        _ => e,
    })
}

fn damaged(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Header, String> {
        read_header(&mut &bytes[..]).map_err(|e| e.to_string())
    }

    fn version_2(text: &str) -> Vec<u8> {
        let length = u32::try_from(text.len()).expect("short").to_le_bytes();
        [MAGIC, &[2, 0][..], &length, text.as_bytes()].concat()
    }

    #[test]
    fn headers_are_read_as_they_were_written() {
        for rows in [0, 7, usize::MAX] {
            let bytes = header(rows, 3);
            assert_eq!(bytes.len(), HEADER_LENGTH);
            let float = Float::F64;
            assert_eq!(
                read(&bytes),
                Ok(Header {
                    float,
                    rows,
                    columns: 3,
                    length: HEADER_LENGTH,
                })
            );
        }
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 6), }\n";
        let float = Float::F32;
        assert_eq!(
            read(&version_2(text)),
            Ok(Header {
                float,
                rows: 2,
                columns: 6,
                length: 12 + text.len(),
            })
        );
    }

    #[test]
    fn damaged_headers_give_specific_errors() {
        let of = |text: &str| read(&version_2(text)).expect_err("damaged");
        assert!(read(b"PK").expect_err("short").contains("ends within its header"));
        assert!(
            read(b"PK345678910")
                .expect_err("other")
                .contains("does not begin")
        );
        assert!(
            read(b"\x93NUMPY\x03\x00aaaa")
                .expect_err("new")
                .contains("version is 3")
        );
        assert!(
            read(b"\x93NUMPY\x02\x00\xff\xff\xff\xff")
                .expect_err("long")
                .contains("claims")
        );
        assert!(of("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 6)}").contains("'<f8'"));
        assert!(of("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 6)}").contains("Fortran"));
        assert!(of("{'descr': '<f8', 'fortran_order': False, 'shape': (12,)}").contains("two dimensions"));
        assert!(of("{'descr': '<f8', 'fortran_order': False}").contains("no shape"));
        let whole = header(5, 6);
        for at in 0..whole.len() {
            for value in [0, b'\'', b'(', 0xff] {
                let mut bytes = whole.clone();
                bytes[at] = value;
                let _ = read(&bytes);
            }
            let _ = read(&whole[..at]);
        }
    }
}
