//! The records of an MCAP file that a reader of ours needs, decoded without trusting a length that a file claims.
//!
//! `mcap` allocates what the length of a string claims, up to 4 GiB, before it sees that the file is shorter. The layouts
//! are those of <https://mcap.dev/spec>; numbers are little endian.

/// The name of a message type.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Schema<'a> {
    pub(super) id: u16,
    pub(super) name: &'a str,
}

/// A topic with the type and the encoding of its messages.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Channel<'a> {
    pub(super) id: u16,
    /// 0 for none.
    pub(super) schema: u16,
    pub(super) topic: &'a str,
    pub(super) encoding: &'a str,
}

/// A message; its time is the one at which it was logged, in nanoseconds.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Message<'a> {
    pub(super) channel: u16,
    pub(super) time: u64,
    pub(super) data: &'a [u8],
}

/// A chunk, before it is decompressed.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Chunk<'a> {
    /// Claimed size of its records, in bytes.
    pub(super) size: u64,
    /// CRC of its records; 0 if there is none.
    pub(super) checksum: u32,
    /// Name of the compression; empty for none.
    pub(super) compression: &'a str,
    pub(super) records: &'a [u8],
}

/// Bytes that are read from the front.
struct Front<'a>(&'a [u8]);

impl<'a> Front<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (front, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(front)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (front, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*front)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.u32()?).ok()?;
        std::str::from_utf8(self.take(length)?).ok()
    }
}

/// Decodes the body of a schema record; `None` if it is too short for what it claims.
pub(super) fn schema(body: &[u8]) -> Option<Schema<'_>> {
    let mut front = Front(body);
    let (id, name) = (front.u16()?, front.string()?);
    front.string()?; // the encoding
    let length = usize::try_from(front.u32()?).ok()?;
    front.take(length)?;
    Some(Schema { id, name })
}

/// Decodes the body of a channel record; `None` if it is too short for what it claims.
pub(super) fn channel(body: &[u8]) -> Option<Channel<'_>> {
    let mut front = Front(body);
    let (id, schema) = (front.u16()?, front.u16()?);
    let (topic, encoding) = (front.string()?, front.string()?);
    let length = usize::try_from(front.u32()?).ok()?;
    front.take(length)?; // metadata
    Some(Channel {
        id,
        schema,
        topic,
        encoding,
    })
}

/// Decodes the body of a message record; `None` if it is too short.
pub(super) fn message(body: &[u8]) -> Option<Message<'_>> {
    let mut front = Front(body);
    let channel = front.u16()?;
    front.u32()?; // the number in its channel
    let time = front.u64()?;
    front.u64()?; // when it was published
    Some(Message {
        channel,
        time,
        data: front.0,
    })
}

/// Decodes the body of a chunk record; `None` if it is too short for what it claims.
pub(super) fn chunk(body: &[u8]) -> Option<Chunk<'_>> {
    let mut front = Front(body);
    front.u64()?; // times of its first and its last message
    front.u64()?;
    let (size, checksum) = (front.u64()?, front.u32()?);
    let compression = front.string()?;
    let length = usize::try_from(front.u64()?).ok()?;
    Some(Chunk {
        size,
        checksum,
        compression,
        records: front.take(length)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_string_longer_than_its_record_is_refused() {
        let mut body = vec![7, 0];
        body.extend(u32::MAX.to_le_bytes());
        body.extend(b"sensor_msgs");
        assert_eq!(schema(&body), None);
        assert_eq!(channel(&[1, 0, 0, 0, 255, 255, 255, 255, b'/']), None);
    }

    #[test]
    fn truncated_records_are_refused_at_every_length() {
        let mut body = vec![7, 0];
        for text in ["std_msgs/msg/String", "ros2msg", "string data"] {
            body.extend(u32::try_from(text.len()).expect("short").to_le_bytes());
            body.extend(text.as_bytes());
        }
        assert_eq!(
            schema(&body),
            Some(Schema {
                id: 7,
                name: "std_msgs/msg/String"
            })
        );
        assert!((0..body.len()).all(|length| schema(&body[..length]).is_none()));
    }
}
