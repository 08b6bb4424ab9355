//! Decoding CDR messages; the bytes may be arbitrary.

use super::{CdrError, LITTLE_ENDIAN};

/// A message being read.
#[derive(Debug, Clone)]
pub struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    /// Opens a message.
    ///
    /// # Errors
    /// [`CdrError`] if it does not begin with the header of little-endian CDR.
    pub fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        match message.split_at_checked(LITTLE_ENDIAN.len()) {
            // The last two bytes are options, which are not used here.
            Some((header, body)) if header[..2] == LITTLE_ENDIAN[..2] => Ok(Self { body, at: 0 }),
            Some((header, _)) => Err(CdrError::Encapsulation(header.to_vec())),
            None => Err(CdrError::Encapsulation(message.to_vec())),
        }
    }

    /// The next bytes, without alignment.
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

    /// The next bytes, aligned to their number.
    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.at = self.at.next_multiple_of(N);
        let mut value = [0; N];
        value.copy_from_slice(self.take(N)?);
        Ok(value)
    }

    /// Reads a byte.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end, as for all numbers.
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
    /// [`CdrError::Truncated`] if the body is too short for them: a corrupt length must not cause a large allocation.
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

    /// Reads a sequence of 32-bit numbers.
    ///
    /// # Errors
    /// [`CdrError::Truncated`] past the end.
    pub fn f32_sequence(&mut self) -> Result<impl ExactSizeIterator<Item = f32> + 'a, CdrError> {
        // The length has the same alignment as the elements.
        let length = self.length(size_of::<f32>())?;
        let (numbers, _) = self.take(length * size_of::<f32>())?.as_chunks();
        Ok(numbers.iter().map(|bytes| f32::from_le_bytes(*bytes)))
    }

    /// Reads a string.
    ///
    /// # Errors
    /// [`CdrError`] if it is cut off, not UTF-8 or lacks its terminating zero.
    pub fn string(&mut self) -> Result<&'a str, CdrError> {
        let length = self.length(1)?;
        let at = self.at;
        match self.take(length)? {
            // Some writers omit the zero of an empty string.
            [] => Ok(""),
            [text @ .., 0] => std::str::from_utf8(text).map_err(|_| CdrError::BadString { at }),
            _ => Err(CdrError::BadString { at }),
        }
    }
}
