//! Common Data Representation, the encoding of ROS 2 messages: plain CDR, little endian.
//!
//! A message is four bytes of encapsulation header (00 01 00 00) and a body in which every number is aligned to its
//! own size, counted from the end of the header. A string is its length including the terminating zero, the bytes and
//! the zero; a sequence is its length and its elements.

mod read;
mod write;

pub use read::CdrReader;
pub use write::CdrWriter;

/// Header of a little-endian CDR body.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// Errors in decoding a body.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// The body ends inside a value.
    #[error("the message ends at byte {length}, {wanted} more were expected at byte {at}")]
    Truncated {
        /// Offset of the value in the body, in bytes.
        at: usize,
        /// Size of the value, in bytes.
        wanted: usize,
        /// Size of the body, in bytes.
        length: usize,
    },
    /// An encapsulation other than plain little-endian CDR.
    #[error("encapsulation header {0:02x?} is not little-endian CDR (00 01)")]
    Encapsulation(Vec<u8>),
    /// A string that is not UTF-8 or lacks its terminating zero.
    #[error("the string at byte {at} is not text that ends in zero")]
    BadString {
        /// Offset of the string in the body, in bytes.
        at: usize,
    },
}

#[cfg(test)]
mod tests;
