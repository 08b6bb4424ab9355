//! Encoding CDR messages.

use super::LITTLE_ENDIAN;

/// A message being written.
#[derive(Debug, Clone)]
pub struct CdrWriter {
    bytes: Vec<u8>,
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
    /// If it does not fit into 32 bits: no message has four billion elements.
    pub fn length(&mut self, length: usize) {
        self.u32(u32::try_from(length).expect("a sequence has fewer than 2³² elements"));
    }

    /// Appends a sequence of 32-bit numbers.
    pub fn f32_sequence(&mut self, values: impl ExactSizeIterator<Item = f32>) {
        // The length has the same alignment as the elements.
        self.length(values.len());
        let begin = self.bytes.len();
        self.bytes.resize(begin + values.len() * size_of::<f32>(), 0);
        let places = self.bytes[begin..].chunks_exact_mut(size_of::<f32>());
        for (place, value) in places.zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
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
