//! Index of the messages of a recording: its chunks and the stretches in them, built on the first pass over it.
//!
//! Blocks are read again later and must not have changed by then: every block has a checksum of its messages.

use super::error::IoError;
use super::records;
use super::waiting;
use catoptric_model::Stop;
use crc32fast::Hasher;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum plausible length of a record or chunk, in bytes; a longer one is corrupt, not a reason to allocate.
const LONGEST_RECORD: usize = 1 << 28;

/// Messages outside of chunks are grouped up to this many bytes.
const LONGEST_RUN: usize = 1 << 20;

/// Maximum size of one read, in bytes: room is made as the bytes of a record arrive, not as it claims.
const MOST_AT_ONCE: usize = 1 << 20;

/// Opcode and length precede every record.
const RECORD_HEAD: usize = 1 + 8;

/// Where the bytes of a recording are stored.
#[derive(Debug, Clone)]
pub(super) enum Place {
    /// In a file.
    File(PathBuf),
    /// In memory; the path names them in errors.
    Memory(PathBuf, Arc<[u8]>),
}

/// A part of a recording that is read in one piece.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Offset and length, in bytes.
    at: u64,
    length: usize,
    /// Whether it is the body of a chunk record; otherwise it is a run of records.
    is_chunk: bool,
    checksum: u32,
}

/// What a visit of a recording comes to.
pub(super) enum Visit<'a> {
    /// A record of use.
    Record {
        opcode: u8,
        data: &'a [u8],
        /// Index of its block, and its index there.
        at: (usize, usize),
    },
    /// Something that cannot be read.
    Damage(&'a str),
}

/// The relevant records of a block.
#[derive(Debug, Default)]
pub(super) struct Records {
    bytes: Vec<u8>,
    /// Opcode and byte range of each.
    all: Vec<(u8, Range<usize>)>,
}

impl Place {
    /// The path that names the recording in errors.
    pub(super) fn path(&self) -> &Path {
        match self {
            Self::File(path) | Self::Memory(path, _) => path,
        }
    }

    /// A reader at the beginning of its bytes.
    pub(super) fn open(&self) -> io::Result<Box<dyn Read + '_>> {
        Ok(match self {
            Self::File(path) => Box::new(BufReader::with_capacity(1 << 16, waiting::open(path)?)),
            Self::Memory(_, bytes) => Box::new(&bytes[..]),
        })
    }

    /// A range of its bytes.
    fn bytes(&self, at: u64, length: usize) -> io::Result<Cow<'_, [u8]>> {
        match self {
            Self::File(path) => {
                let mut file = File::open(path)?;
                file.seek(SeekFrom::Start(at))?;
                let mut bytes = Vec::new();
                file.take(length as u64).read_to_end(&mut bytes)?;
                Ok(Cow::Owned(bytes))
            }
            Self::Memory(_, bytes) => {
                let at = usize::try_from(at).unwrap_or(usize::MAX).min(bytes.len());
                Ok(Cow::Borrowed(&bytes[at..bytes.len().min(at + length)]))
            }
        }
    }

    /// Visits all records in order. Returns the blocks and the length of the recording in bytes.
    ///
    /// If it is `partial`, what cannot be read is visited as damage: a chunk is passed over, and where no next record can be
    /// found, the recording ends.
    ///
    /// # Errors
    /// [`IoError`] with the offset if the recording cannot be read, is cut off or corrupt, or if `visit` fails.
    pub(super) fn visit(
        &self,
        stop: &Stop,
        partial: bool,
        mut visit: impl FnMut(Visit<'_>) -> Result<(), String>,
    ) -> Result<(Vec<Block>, u64), IoError> {
        // All checksums are checked: damaged readings must not look like readings. Of a partial recording, those of whole
        // sections say nothing that those of its chunks do not.
        let options = checked()
            .with_emit_chunks(true)
            .with_validate_data_section_crc(!partial)
            .with_validate_summary_section_crc(!partial)
            .with_check_finishes_after_end_magic(!partial);
        let mut file = self.open().map_err(|e| IoError::read(self.path(), e))?;
        let mut reader = LinearReader::new_with_options(options);
        let mut offset = 0;
        let mut blocks: Vec<Block> = Vec::new();
        let mut run = (Hasher::new(), 0);
        while let Some(event) = reader.next_event() {
            stop.check()?;
            let at = |what: String| self.corrupt(what, offset);
            let event = match event {
                Err(e) if partial => {
                    visit(Visit::Damage(&words(&e))).map_err(at)?;
                    break;
                }
                event => event.map_err(|e| at(words(&e)))?,
            };
            match event {
                LinearReadEvent::ReadRequest(need) => {
                    let read = file.read(reader.insert(need.min(MOST_AT_ONCE)));
                    let read = read.map_err(|e| IoError::read(self.path(), e))?;
                    reader.notify_read(read);
                    offset += read as u64;
                }
                LinearReadEvent::Record { data, opcode } if opcode == op::CHUNK => {
                    let records = match Records::of_chunk(data) {
                        Err(e) if partial => {
                            let what = format!("{} (by byte {offset})", words(&e));
                            visit(Visit::Damage(&what)).map_err(at)?;
                            continue;
                        }
                        records => records.map_err(|e| at(words(&e)))?,
                    };
                    blocks.push(Block {
                        at: offset - data.len() as u64,
                        length: data.len(),
                        is_chunk: true,
                        checksum: records.checksum(),
                    });
                    let block = blocks.len() - 1;
                    for (number, (opcode, data)) in records.iter().enumerate() {
                        let at_record = (block, number);
                        visit(Visit::Record {
                            opcode,
                            data,
                            at: at_record,
                        })
                        .map_err(at)?;
                    }
                }
                LinearReadEvent::Record { data, opcode } if is_of_use(opcode) => {
                    let length = RECORD_HEAD + data.len();
                    let begin = offset - length as u64;
                    match blocks.last_mut().filter(|b| b.takes(begin)) {
                        Some(block) => block.length += length,
                        None => {
                            run = (Hasher::new(), 0);
                            blocks.push(Block {
                                at: begin,
                                length,
                                is_chunk: false,
                                checksum: 0,
                            });
                        }
                    }
                    let (hasher, number) = &mut run;
                    hasher.update(data);
                    let block = blocks.len() - 1;
                    blocks[block].checksum = hasher.clone().finalize();
                    visit(Visit::Record {
                        opcode,
                        data,
                        at: (block, *number),
                    })
                    .map_err(at)?;
                    *number += 1;
                }
                LinearReadEvent::Record { .. } => {}
            }
        }
        Ok((blocks, offset))
    }

    /// The records of a block, which must be unchanged since the first pass.
    pub(super) fn records(&self, block: &Block) -> Result<Records, IoError> {
        let bytes = self.bytes(block.at, block.length);
        let bytes = bytes.map_err(|e| IoError::read(self.path(), e))?;
        let records = match block.is_chunk {
            true => Records::of_chunk(&bytes),
            false => Records::of_run(&bytes),
        };
        match records {
            Ok(records) if records.checksum() == block.checksum => Ok(records),
            Ok(_) | Err(_) => Err(self.changed(block.at)),
        }
    }

    /// The error for a recording that has changed.
    pub(super) fn changed(&self, offset: u64) -> IoError {
        self.corrupt("changed while it was being read".to_owned(), offset)
    }

    /// The error for an invalid recording, detected at a given byte offset.
    pub(super) fn corrupt(&self, what: String, offset: u64) -> IoError {
        IoError::Recording {
            path: self.path().to_owned(),
            what,
            offset,
        }
    }
}

impl Block {
    /// Offset of its beginning.
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// Whether a record that begins at a given byte continues the run.
    fn takes(&self, begin: u64) -> bool {
        !self.is_chunk && self.at + self.length as u64 == begin && self.length < LONGEST_RUN
    }
}

impl Records {
    /// The records of a chunk, from the body of its record.
    fn of_chunk(body: &[u8]) -> McapResult<Self> {
        let chunk = records::chunk(body).ok_or(McapError::UnexpectedEof)?;
        if chunk.size > LONGEST_RECORD as u64 {
            return Err(McapError::ChunkTooLarge(chunk.size));
        }
        if chunk.compression == "zstd" {
            return Self::of_run(&zstd(&chunk)?);
        }
        let options = checked().with_skip_start_magic(true).with_skip_end_magic(true);
        let mut reader = LinearReader::new_with_options(options);
        let mut head = vec![op::CHUNK];
        head.extend((body.len() as u64).to_le_bytes());
        let mut rest = Read::chain(&head[..], body);
        let mut records = Self::default();
        while let Some(event) = reader.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(need) => {
                    let read = rest.read(reader.insert(need.min(MOST_AT_ONCE)))?;
                    reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    records.push(opcode, data);
                }
            }
        }
        Ok(records)
    }

    /// The records of a run outside of chunks.
    fn of_run(mut bytes: &[u8]) -> McapResult<Self> {
        let mut records = Self::default();
        while let Some((head, rest)) = bytes.split_first_chunk::<RECORD_HEAD>() {
            let [opcode, length @ ..] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
            let (data, rest) = rest.split_at_checked(length).ok_or(McapError::UnexpectedEof)?;
            records.push(opcode, data);
            bytes = rest;
        }
        Ok(records)
    }

    fn push(&mut self, opcode: u8, data: &[u8]) {
        if !is_of_use(opcode) {
            return;
        }
        let begin = self.bytes.len();
        self.bytes.extend_from_slice(data);
        self.all.push((opcode, begin..self.bytes.len()));
    }

    fn checksum(&self) -> u32 {
        crc32fast::hash(&self.bytes)
    }

    /// Their size in bytes.
    pub(super) fn size(&self) -> usize {
        self.bytes.len()
    }

    /// A record by its index.
    pub(super) fn get(&self, number: usize) -> Option<(u8, &[u8])> {
        let (opcode, range) = self.all.get(number)?;
        Some((*opcode, &self.bytes[range.clone()]))
    }

    fn iter(&self) -> impl Iterator<Item = (u8, &[u8])> {
        self.all
            .iter()
            .map(|(opcode, range)| (*opcode, &self.bytes[range.clone()]))
    }
}

/// Decompresses the records of a chunk; they are of the size that it claims, and of its checksum if it has one.
fn zstd(chunk: &records::Chunk<'_>) -> McapResult<Vec<u8>> {
    use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
    let failed = |e: &dyn std::fmt::Display| McapError::DecompressionError(e.to_string());
    let (mut rest, mut bytes) = (chunk.records, Vec::new());
    while !rest.is_empty() {
        match ruzstd::decoding::StreamingDecoder::new(&mut rest) {
            Ok(decoder) => {
                let room = chunk.size - bytes.len() as u64;
                let read = decoder.take(room + 1).read_to_end(&mut bytes);
                read.map_err(|e| failed(&e))?;
                if bytes.len() as u64 > chunk.size {
                    return Err(failed(&"there is more in a chunk than it says"));
                }
            }
            // A frame of other people's data.
            Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                length, ..
            })) => {
                let length = usize::try_from(length).unwrap_or(usize::MAX);
                rest = rest.get(length..).ok_or(McapError::UnexpectedEof)?;
            }
            Err(e) => return Err(failed(&e)),
        }
    }
    if bytes.len() as u64 != chunk.size {
        return Err(failed(&"there is less in a chunk than it says"));
    }
    let found = crc32fast::hash(&bytes);
    if chunk.checksum != 0 && found != chunk.checksum {
        return Err(McapError::BadChunkCrc {
            saved: chunk.checksum,
            calculated: found,
        });
    }
    Ok(bytes)
}

/// Options shared by all readers.
fn checked() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_record_length_limit(LONGEST_RECORD)
        .with_prevalidate_chunk_crcs(true)
}

fn is_of_use(opcode: u8) -> bool {
    matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE)
}

/// The reader's error in one line, with its cause.
pub(super) fn words(error: &McapError) -> String {
    match error {
        McapError::Parse(e) => format!("not a whole recording: {error}: {e}"),
        McapError::Io(e) => format!("not a whole recording: {e}"),
        _ => format!("not a whole recording: {error}"),
    }
}
