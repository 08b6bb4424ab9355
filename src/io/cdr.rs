//! Common Data Representation, the encoding of ROS 2 messages: plain CDR, little endian.
//!
//! A message is four bytes of encapsulation header (00 01 00 00) and a body in which every number is aligned to its
//! own size, counted from the end of the header. A string is its length with the terminating zero, the bytes and the
//! zero; a sequence is its length and its elements.

/// Header of a little-endian CDR body.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// A message being written.
#[derive(Debug, Clone)]
pub struct CdrWriter {
    bytes: Vec<u8>,
}

/// A message being read.
#[derive(Debug, Clone)]
pub struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
}

/// A body that is not the message it should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The body ends inside a value.
    #[error("the message ends at byte {length}, {wanted} more were expected at byte {at}")]
    Truncated {
        /// Where the value begins in the body, in bytes.
        at: usize,
        /// Bytes of the value.
        wanted: usize,
        /// Bytes of the body.
        length: usize,
    },
    /// An encapsulation other than plain little-endian CDR.
    #[error("encapsulation header {0:02x?} is not little-endian CDR (00 01)")]
    Encapsulation(Vec<u8>),
    /// A string that is not UTF-8 or lacks its terminating zero.
    #[error("the string at byte {at} is not text that ends in zero")]
    BadString {
        /// Where the string begins in the body, in bytes.
        at: usize,
    },
}

impl Default for CdrWriter {
    fn default() -> Self {
        Self::new()
    }
}

impl CdrWriter {
    /// An empty message.
    pub fn new() -> Self {
        Self {
            bytes: LITTLE_ENDIAN.to_vec(),
        }
    }

    /// The message with its encapsulation header.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Appends bytes after padding to a multiple of their number.
    fn aligned<const N: usize>(&mut self, value: [u8; N]) {
        let body = self.bytes.len() - LITTLE_ENDIAN.len();
        let padding = body.next_multiple_of(N) - body;
        self.bytes.resize(self.bytes.len() + padding, 0);
        self.bytes.extend_from_slice(&value);
    }

    /// Appends a byte.
    pub fn u8(&mut self, value: u8) {
        self.bytes.push(value);
    }

    /// Appends a signed byte.
    pub fn i8(&mut self, value: i8) {
        self.aligned(value.to_le_bytes());
    }

    /// Appends a boolean.
    pub fn bool(&mut self, value: bool) {
        self.u8(u8::from(value));
    }

    /// Appends an unsigned 32-bit integer.
    pub fn u32(&mut self, value: u32) {
        self.aligned(value.to_le_bytes());
    }

    /// Appends a signed 32-bit integer.
    pub fn i32(&mut self, value: i32) {
        self.aligned(value.to_le_bytes());
    }

    /// Appends a 32-bit number.
    pub fn f32(&mut self, value: f32) {
        self.aligned(value.to_le_bytes());
    }

    /// Appends a 64-bit number.
    pub fn f64(&mut self, value: f64) {
        self.aligned(value.to_le_bytes());
    }

    /// Appends the length of a sequence.
    ///
    /// # Panics
    /// If it does not fit into 32 bits: no message holds four thousand million elements.
    pub fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("a sequence has fewer than 2³² elements"));
    }

    /// Appends a string.
    pub fn string(&mut self, value: &str) {
        self.length(value.len() + 1);
        self.bytes.extend_from_slice(value.as_bytes());
        self.bytes.push(0);
    }

    /// Appends a sequence of bytes.
    pub fn byte_sequence(&mut self, values: &[u8]) {
        self.length(values.len());
        self.bytes.extend_from_slice(values);
    }
}

impl<'a> CdrReader<'a> {
    /// Opens a message.
    ///
    /// # Errors
    /// [`CdrError`] if it does not begin with the header of little-endian CDR.
    pub fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        match message.split_at_checked(LITTLE_ENDIAN.len()) {
            // The last two bytes are options that say nothing here.
            Some((header, body)) if header[..2] == LITTLE_ENDIAN[..2] => Ok(Self { body, at: 0 }),
            Some((header, _)) => Err(CdrError::Encapsulation(header.to_vec())),
            None => Err(CdrError::Encapsulation(message.to_vec())),
        }
    }

    /// The next bytes, whatever their alignment.
    fn take(&mut self, wanted: usize) -> Result<&'a [u8], CdrError> {
        let truncated = CdrError::Truncated {
            at: self.at,
            wanted,
            length: self.body.len(),
        };
        let end = self.at.checked_add(wanted).ok_or_else(|| truncated.clone())?;
        let bytes = self.body.get(self.at..end).ok_or(truncated)?;
        self.at = end;
        Ok(bytes)
    }

    /// The next bytes at a multiple of their number.
    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.at = self.at.next_multiple_of(N);
        let mut value = [0; N];
        value.copy_from_slice(self.take(N)?);
        Ok(value)
    }

    /// Reads a byte.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end, as for every number.
    pub fn u8(&mut self) -> Result<u8, CdrError> {
        self.aligned().map(u8::from_le_bytes)
    }

    /// Reads a signed byte.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn i8(&mut self) -> Result<i8, CdrError> {
        self.aligned().map(i8::from_le_bytes)
    }

    /// Reads an unsigned 32-bit integer.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn u32(&mut self) -> Result<u32, CdrError> {
        self.aligned().map(u32::from_le_bytes)
    }

    /// Reads a signed 32-bit integer.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn i32(&mut self) -> Result<i32, CdrError> {
        self.aligned().map(i32::from_le_bytes)
    }

    /// Reads a 32-bit number.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn f32(&mut self) -> Result<f32, CdrError> {
        self.aligned().map(f32::from_le_bytes)
    }

    /// Reads a 64-bit number.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn f64(&mut self) -> Result<f64, CdrError> {
        self.aligned().map(f64::from_le_bytes)
    }

    /// Reads the length of a sequence whose elements take at least `smallest` bytes each.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] if so many cannot follow: a corrupt length must not make the reader allocate for it.
    pub fn length(&mut self, smallest: usize) -> Result<usize, CdrError> {
        let length = self.u32()? as usize;
        let wanted = length.saturating_mul(smallest);
        if wanted > self.body.len() - self.at {
            return Err(CdrError::Truncated {
                at: self.at,
                wanted,
                length: self.body.len(),
            });
        }
        Ok(length)
    }

    /// Reads a string.
    ///
    /// # Errors
    /// [`CdrError`] if it is cut off, not UTF-8 or lacks its terminating zero.
    pub fn string(&mut self) -> Result<&'a str, CdrError> {
        let length = self.length(1)?;
        let at = self.at;
        match self.take(length)? {
            // Some writers leave the zero of an empty string out.
            [] => Ok(""),
            [text @ .., 0] => std::str::from_utf8(text).map_err(|_| CdrError::BadString { at }),
            _ => Err(CdrError::BadString { at }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_counted_by_hand() {
        let mut cdr = CdrWriter::new();
        cdr.u8(7);
        cdr.u32(0x0102_0304); // three bytes of padding
        cdr.string("ab"); // no padding: the length stands at 8
        cdr.f64(1.0); // the string ends at 15: one byte of padding
        cdr.i8(-1);
        cdr.f32(-2.0); // three bytes of padding
        cdr.length(0); // an empty sequence of doubles is its length alone
        let expected: &[u8] = &[
            0, 1, 0, 0, // encapsulation, not counted in alignment
            7, 0, 0, 0, 4, 3, 2, 1, // 0…7
            3, 0, 0, 0, b'a', b'b', 0, 0, // 8…15
            0, 0, 0, 0, 0, 0, 0xf0, 0x3f, // 16…23
            0xff, 0, 0, 0, 0, 0, 0, 0xc0, // 24…31
            0, 0, 0, 0,
        ];
        assert_eq!(cdr.into_bytes(), expected);
    }

    #[test]
    fn what_was_written_is_read() {
        let mut cdr = CdrWriter::new();
        cdr.bool(true);
        cdr.f64(-0.1);
        cdr.string("pose");
        cdr.i32(-5);
        cdr.i8(2);
        cdr.f32(f32::INFINITY);
        cdr.byte_sequence(&[1, 2, 3]);
        let bytes = cdr.into_bytes();
        let mut read = CdrReader::new(&bytes).expect("header");
        assert_eq!(read.u8(), Ok(1));
        assert_eq!(read.f64(), Ok(-0.1));
        assert_eq!(read.string(), Ok("pose"));
        assert_eq!(read.i32(), Ok(-5));
        assert_eq!(read.i8(), Ok(2));
        assert_eq!(read.f32(), Ok(f32::INFINITY));
        assert_eq!(read.length(1), Ok(3));
    }

    #[test]
    fn corrupt_messages_are_errors() {
        assert!(matches!(CdrReader::new(&[0, 1]), Err(CdrError::Encapsulation(_))));
        assert!(matches!(
            CdrReader::new(&[0, 0, 0, 0, 1]),
            Err(CdrError::Encapsulation(_))
        ));
        // A length of 2³² − 1 in a body of four bytes: an error at once, not an allocation.
        let huge = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
        let open = || CdrReader::new(&huge).expect("header");
        assert!(matches!(open().length(8), Err(CdrError::Truncated { .. })));
        assert!(matches!(open().string(), Err(CdrError::Truncated { .. })));
        assert!(matches!(open().f64(), Err(CdrError::Truncated { .. })));
        let unterminated = [0, 1, 0, 0, 1, 0, 0, 0, b'x'];
        assert_eq!(
            CdrReader::new(&unterminated).expect("header").string(),
            Err(CdrError::BadString { at: 4 })
        );
    }
}
