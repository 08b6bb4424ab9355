//! The MCAP writer: messages are collected into chunks, which are compressed in parallel and written in order.
//!
//! ```text
//! magic | header | (chunk | message indexes) … | end of data | schemas, channels, statistics, chunk indexes,
//! summary offsets | footer | magic
//! ```
//!
//! Chunk boundaries depend on the sizes of the messages alone, and each chunk is compressed separately: the same
//! messages give the same bytes on any number of threads. The format is <https://mcap.dev/spec>; numbers are little endian.

use crc32fast::Hasher;
use mcap::MAGIC;
use mcap::records::op;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::mem;

/// Size at which a chunk is full, in bytes before compression.
const CHUNK_SIZE: usize = 1 << 20;

/// Bytes passed to the compressor at a time: less than one of its blocks, for output independent of buffer addresses.
const SLICE: usize = 1 << 15;

/// Name of the compression, as stored in files.
const COMPRESSION: &str = "lz4";

/// A file being written. Without [`finish`](Self::finish) it has no end, and readers reject it as incomplete.
pub(super) struct Container<W> {
    writer: W,
    /// Number of bytes written.
    position: u64,
    /// CRC of everything written.
    checksum: Hasher,
    schemas: Vec<Vec<u8>>,
    channels: Vec<Vec<u8>>,
    /// Number of messages on every channel.
    counts: BTreeMap<u16, u64>,
    /// Times of the first and the last message.
    bounds: Option<(u64, u64)>,
    open: Chunk,
    /// Full chunks that are not written yet.
    full: Vec<Chunk>,
    /// Locations of the written chunks.
    indexes: Vec<ChunkIndex>,
}

/// Records that are compressed together.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Times of the first and the last message.
    bounds: Option<(u64, u64)>,
    /// Time and offset of every message, by channel.
    messages: BTreeMap<u16, Vec<(u64, u64)>>,
}

/// A chunk in its written form.
struct Packed {
    /// The record of the chunk itself.
    chunk: Vec<u8>,
    /// Its message indexes.
    messages: Vec<u8>,
    /// Offset in `messages` of each channel's index.
    offsets: Vec<(u16, u64)>,
    bounds: (u64, u64),
    compressed: u64,
    uncompressed: u64,
}

/// Location of a chunk.
struct ChunkIndex {
    bounds: (u64, u64),
    start: u64,
    length: u64,
    offsets: Vec<(u16, u64)>,
    messages_length: u64,
    compressed: u64,
    uncompressed: u64,
}

impl<W: Write> Container<W> {
    /// Begins a file.
    pub(super) fn create(writer: W, profile: &str, library: &str) -> io::Result<Self> {
        let mut container = Self {
            writer,
            position: 0,
            checksum: Hasher::new(),
            schemas: Vec::new(),
            channels: Vec::new(),
            counts: BTreeMap::new(),
            bounds: None,
            open: Chunk::default(),
            full: Vec::new(),
            indexes: Vec::new(),
        };
        let mut start = MAGIC.to_vec();
        record(&mut start, op::HEADER, |body| {
            text(body, profile);
            text(body, library);
        });
        container.write(&start)?;
        Ok(container)
    }

    /// Adds a schema and returns its number; an existing schema keeps its number.
    pub(super) fn add_schema(&mut self, name: &str, encoding: &str, definition: &str) -> u16 {
        let bytes = |id: u16| {
            let mut bytes = Vec::new();
            record(&mut bytes, op::SCHEMA, |body| {
                body.extend(id.to_le_bytes());
                text(body, name);
                text(body, encoding);
                text(body, definition);
            });
            bytes
        };
        let known = (1..)
            .zip(&self.schemas)
            .find(|(id, schema)| **schema == bytes(*id));
        if let Some((id, _)) = known {
            return id;
        }
        let id = next(&self.schemas);
        self.open.records.extend(bytes(id));
        self.schemas.push(bytes(id));
        id
    }

    /// Adds a channel and returns its number; schema 0 means no schema.
    pub(super) fn add_channel(&mut self, schema: u16, topic: &str, encoding: &str) -> u16 {
        let id = next(&self.channels);
        let mut bytes = Vec::new();
        record(&mut bytes, op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(schema.to_le_bytes());
            text(body, topic);
            text(body, encoding);
            sized(body, |_| {}); // no metadata
        });
        self.open.records.extend(&bytes);
        self.channels.push(bytes);
        id
    }

    /// Adds a message to the chunk; nothing is written until [`write_full`](Self::write_full).
    pub(super) fn put(&mut self, channel: u16, sequence: u32, time: u64, message: &[u8]) {
        if self.open.records.len() > CHUNK_SIZE {
            self.full.push(mem::take(&mut self.open));
        }
        let chunk = &mut self.open;
        widen(&mut self.bounds, time);
        widen(&mut chunk.bounds, time);
        *self.counts.entry(channel).or_default() += 1;
        let place = chunk.records.len() as u64;
        chunk.messages.entry(channel).or_default().push((time, place));
        record(&mut chunk.records, op::MESSAGE, |body| {
            body.extend(channel.to_le_bytes());
            body.extend(sequence.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend(time.to_le_bytes());
            body.extend_from_slice(message);
        });
    }

    /// Compresses the full chunks in parallel and writes them in order.
    pub(super) fn write_full(&mut self) -> io::Result<()> {
        let full = mem::take(&mut self.full);
        let packed: Vec<Packed> = full.into_par_iter().map(Chunk::pack).collect::<io::Result<_>>()?;
        packed.into_iter().try_for_each(|chunk| self.write_chunk(chunk))
    }

    /// Writes the rest and the summary, and returns the writer.
    pub(super) fn finish(mut self) -> io::Result<W> {
        let last = mem::take(&mut self.open);
        if !last.records.is_empty() {
            self.full.push(last);
        }
        self.write_full()?;
        let data = self.checksum.clone().finalize();
        let mut end = Vec::new();
        record(&mut end, op::DATA_END, |body| body.extend(data.to_le_bytes()));
        self.write(&end)?;
        let summary = self.summary();
        self.write(&summary)?;
        self.writer.flush()?;
        Ok(self.writer)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.writer.write_all(bytes)?;
        self.checksum.update(bytes);
        self.position += bytes.len() as u64;
        Ok(())
    }

    fn write_chunk(&mut self, packed: Packed) -> io::Result<()> {
        let start = self.position;
        self.write(&packed.chunk)?;
        let messages = self.position;
        self.write(&packed.messages)?;
        let offsets = packed.offsets.into_iter();
        self.indexes.push(ChunkIndex {
            bounds: packed.bounds,
            start,
            length: messages - start,
            offsets: offsets.map(|(channel, at)| (channel, messages + at)).collect(),
            messages_length: self.position - messages,
            compressed: packed.compressed,
            uncompressed: packed.uncompressed,
        });
        Ok(())
    }

    /// Everything after the end of the data.
    fn summary(&self) -> Vec<u8> {
        let start = self.position;
        let mut bytes = Vec::new();
        let mut groups = Vec::new();
        let mut group = |opcode: u8, bytes: &mut Vec<u8>, write: &dyn Fn(&mut Vec<u8>)| {
            let begin = bytes.len();
            write(bytes);
            if bytes.len() > begin {
                groups.push((opcode, start + begin as u64, (bytes.len() - begin) as u64));
            }
        };
        group(op::SCHEMA, &mut bytes, &|bytes| {
            bytes.extend(self.schemas.concat())
        });
        group(op::CHANNEL, &mut bytes, &|bytes| {
            bytes.extend(self.channels.concat());
        });
        group(op::STATISTICS, &mut bytes, &|bytes| self.statistics(bytes));
        group(op::CHUNK_INDEX, &mut bytes, &|bytes| {
            self.indexes.iter().for_each(|index| index.write(bytes));
        });
        let offsets = start + bytes.len() as u64;
        for (opcode, begin, length) in groups {
            record(&mut bytes, op::SUMMARY_OFFSET, |body| {
                body.push(opcode);
                body.extend(begin.to_le_bytes());
                body.extend(length.to_le_bytes());
            });
        }
        record(&mut bytes, op::FOOTER, |body| {
            body.extend(start.to_le_bytes());
            body.extend(offsets.to_le_bytes());
            body.extend([0; 4]); // the checksum, of everything before it
        });
        let place = bytes.len() - 4;
        let checksum = crc32fast::hash(&bytes[..place]);
        bytes[place..].copy_from_slice(&checksum.to_le_bytes());
        bytes.extend(MAGIC);
        bytes
    }

    fn statistics(&self, bytes: &mut Vec<u8>) {
        let (first, last) = self.bounds.unwrap_or_default();
        record(bytes, op::STATISTICS, |body| {
            body.extend(self.counts.values().sum::<u64>().to_le_bytes());
            body.extend(count::<u16>(self.schemas.len()).to_le_bytes());
            body.extend(count::<u32>(self.channels.len()).to_le_bytes());
            body.extend([0; 8]); // no attachments, no metadata
            body.extend(count::<u32>(self.indexes.len()).to_le_bytes());
            body.extend(first.to_le_bytes());
            body.extend(last.to_le_bytes());
            sized(body, |map| {
                for (channel, messages) in &self.counts {
                    map.extend(channel.to_le_bytes());
                    map.extend(messages.to_le_bytes());
                }
            });
        });
    }
}

impl Chunk {
    /// The chunk's record and its message indexes.
    fn pack(self) -> io::Result<Packed> {
        let compressed = compress(&self.records)?;
        let bounds = self.bounds.unwrap_or_default();
        let uncompressed = self.records.len() as u64;
        let mut chunk = Vec::with_capacity(compressed.len() + 64);
        record(&mut chunk, op::CHUNK, |body| {
            body.extend(bounds.0.to_le_bytes());
            body.extend(bounds.1.to_le_bytes());
            body.extend(uncompressed.to_le_bytes());
            body.extend(crc32fast::hash(&self.records).to_le_bytes());
            text(body, COMPRESSION);
            body.extend((compressed.len() as u64).to_le_bytes());
            body.extend_from_slice(&compressed);
        });
        let (mut messages, mut offsets) = (Vec::new(), Vec::new());
        for (channel, entries) in &self.messages {
            offsets.push((*channel, messages.len() as u64));
            record(&mut messages, op::MESSAGE_INDEX, |body| {
                body.extend(channel.to_le_bytes());
                sized(body, |list| {
                    for (time, place) in entries {
                        list.extend(time.to_le_bytes());
                        list.extend(place.to_le_bytes());
                    }
                });
            });
        }
        Ok(Packed {
            chunk,
            messages,
            offsets,
            bounds,
            compressed: compressed.len() as u64,
            uncompressed,
        })
    }
}

impl ChunkIndex {
    fn write(&self, bytes: &mut Vec<u8>) {
        record(bytes, op::CHUNK_INDEX, |body| {
            for number in [self.bounds.0, self.bounds.1, self.start, self.length] {
                body.extend(number.to_le_bytes());
            }
            sized(body, |map| {
                for (channel, offset) in &self.offsets {
                    map.extend(channel.to_le_bytes());
                    map.extend(offset.to_le_bytes());
                }
            });
            body.extend(self.messages_length.to_le_bytes());
            text(body, COMPRESSION);
            body.extend(self.compressed.to_le_bytes());
            body.extend(self.uncompressed.to_le_bytes());
        });
    }
}

/// An LZ4 frame. MCAP has its own checksum, so the frame's blocks have none.
fn compress(records: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = lz4::EncoderBuilder::new()
        .block_checksum(lz4::liblz4::BlockChecksum::NoBlockChecksum)
        .build(Vec::with_capacity(records.len()))?;
    for slice in records.chunks(SLICE) {
        encoder.write_all(slice)?;
    }
    let (compressed, result) = encoder.finish();
    result?;
    Ok(compressed)
}

/// The next number in a list that counts from 1.
fn next(list: &[Vec<u8>]) -> u16 {
    count(list.len() + 1)
}

/// A count that never overflows in a real recording.
fn count<T: TryFrom<usize, Error: std::fmt::Debug>>(number: usize) -> T {
    T::try_from(number).expect("schemas, channels and chunks are few")
}

fn widen(bounds: &mut Option<(u64, u64)>, time: u64) {
    let (first, last) = bounds.unwrap_or((time, time));
    *bounds = Some((first.min(time), last.max(time)));
}

/// Appends a record.
fn record(bytes: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    bytes.push(opcode);
    let place = bytes.len();
    bytes.extend([0; 8]);
    body(bytes);
    let length = (bytes.len() - place - 8) as u64;
    bytes[place..place + 8].copy_from_slice(&length.to_le_bytes());
}

/// Appends a list or map, preceded by its length in bytes.
fn sized(bytes: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let place = bytes.len();
    bytes.extend([0; 4]);
    body(bytes);
    let length: u32 = count(bytes.len() - place - 4);
    bytes[place..place + 4].copy_from_slice(&length.to_le_bytes());
}

fn text(bytes: &mut Vec<u8>, text: &str) {
    sized(bytes, |body| body.extend_from_slice(text.as_bytes()));
}
