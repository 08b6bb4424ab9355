//! The messages of a recording as bytes: encoders for what we write, decoders for what we need.
//!
//! Fields are in the order of [`definitions`](super::definitions). Times are nanoseconds since 1970, lengths meters.

use super::cdr::{CdrError, CdrReader, CdrWriter};
use catoptric_model::beam;
use catoptric_model::frame::{Pose, PoseData};
use catoptric_model::session::ScannerSheet;
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};

/// Frame of the scanner.
pub const LASER_FRAME: &str = "laser";

/// Frame of motion capture.
pub const ROOM_FRAME: &str = "room";

/// Nanoseconds per second.
pub const NS_PER_S: u64 = 1_000_000_000;

/// A marker identified by name and by index (`USE_BOTH`).
const NAME_AND_INDEX: i8 = 2;

/// Offset of the frame number in a message of markers.
pub(super) const FRAME_NUMBER: std::ops::Range<usize> = 24..28;

/// The data type of a `PointField` of 32-bit numbers (`FLOAT32`).
const FLOAT32: u8 = 7;

/// A message whose bytes do not match its type, or whose values are impossible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MessageError {
    /// The bytes.
    #[error(transparent)]
    Cdr(#[from] CdrError),
    /// A quaternion that is no rotation.
    #[error("a quaternion of length {length} at {seconds:.3} s; a rotation has length 1")]
    NotAPose {
        /// Length of the quaternion.
        length: f64,
        /// Its time, in seconds since 1970.
        seconds: f64,
    },
    /// Angles of a scan that are not finite.
    #[error("angle_min is {first} and angle_increment {increment}")]
    NoAngles {
        /// Azimuth of the first beam.
        first: f64,
        /// Azimuth between beams.
        increment: f64,
    },
    /// A time before 1970.
    #[error("a time stamp of {seconds} s")]
    BadTime {
        /// Seconds since 1970.
        seconds: i32,
    },
}

/// A scan as it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Time at which the scan began, in nanoseconds.
    pub stamp: u64,
    /// Azimuth of the first beam, in radians.
    pub angle_min: f64,
    /// Azimuth between beams, in radians.
    pub angle_increment: f64,
    /// Scan period, in seconds.
    pub scan_time: f64,
    /// Shortest and longest range that the scanner reports, in meters.
    pub limits_m: [f64; 2],
    /// Readings in meters, with the codes of REP-117.
    pub ranges: Vec<f64>,
    /// Intensities of the readings in counts of the receiver; empty if there are none.
    pub intensities: Vec<f64>,
}

/// A marker with its label "subject/marker".
#[derive(Debug, Clone, PartialEq)]
pub struct LabeledMarker {
    /// Label.
    pub name: String,
    /// Index in the template of its body.
    pub index: usize,
    /// Position in the room, in meters.
    pub point: Point3<f64>,
}

/// A frame and its pose in another.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTransform<'a> {
    /// Parent frame.
    pub parent: &'a str,
    /// Child frame.
    pub child: &'a str,
    /// `parent_from_child`.
    pub pose: Pose,
}

/// The nearest 32-bit number, as stored in messages; all NaNs become the same, so that equal readings give equal bytes.
pub(super) fn single(value: f64) -> f32 {
    if value.is_nan() {
        return f32::NAN;
    }
    #[expect(clippy::cast_possible_truncation, reason = "messages hold 32-bit numbers")]
    let nearest = value as f32;
    nearest
}

fn write_stamp(cdr: &mut CdrWriter, stamp: u64) {
    // A time past 2038 does not fit the message type.
    cdr.i32(i32::try_from(stamp / NS_PER_S).unwrap_or(i32::MAX));
    cdr.u32(u32::try_from(stamp % NS_PER_S).unwrap_or(0));
}

fn write_header(cdr: &mut CdrWriter, stamp: u64, frame: &str) {
    write_stamp(cdr, stamp);
    cdr.string(frame);
}

fn write_numbers(cdr: &mut CdrWriter, values: &[f64]) {
    for v in values {
        cdr.f64(*v);
    }
}

/// The beginning of a scan: header, angles, times and limits. The increment of a clockwise scan is negative, as drivers
/// of clockwise scanners set it.
fn write_scan_sheet(cdr: &mut CdrWriter, stamp: u64, scanner: &ScannerSheet, period_s: f64) {
    write_header(cdr, stamp, LASER_FRAME);
    let scan = &scanner.scan;
    for value in [
        scan.azimuth(0),
        scan.azimuth(scan.beams() - 1),
        scan.increment(),
        scan.beam_time_s(),
        period_s,
        scanner.range_min_m,
        scanner.range_max_m,
    ] {
        cdr.f32(single(value));
    }
}

fn write_singles(cdr: &mut CdrWriter, values: &[f64]) {
    cdr.f32_sequence(values.iter().map(|v| single(*v)));
}

/// A `sensor_msgs/msg/LaserScan`; its intensities are empty if there are none.
pub fn encode_scan(
    stamp: u64,
    scanner: &ScannerSheet,
    period_s: f64,
    ranges: &[f64],
    intensities: &[f64],
) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    write_scan_sheet(&mut cdr, stamp, scanner, period_s);
    write_singles(&mut cdr, ranges);
    write_singles(&mut cdr, intensities);
    cdr.into_bytes()
}

/// A `sensor_msgs/msg/MultiEchoLaserScan`: the echoes of every beam, empty if there is no return, and their intensities,
/// which are empty for all if there are none.
pub fn encode_echoes(
    stamp: u64,
    scanner: &ScannerSheet,
    period_s: f64,
    echoes: &[Vec<f64>],
    intensities: &[Vec<f64>],
) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    write_scan_sheet(&mut cdr, stamp, scanner, period_s);
    for of_beams in [echoes, intensities] {
        cdr.length(of_beams.len());
        for beam in of_beams {
            write_singles(&mut cdr, beam);
        }
    }
    cdr.into_bytes()
}

/// A `sensor_msgs/msg/PointCloud2` of the scan plane: x, y, z of the readings that are ranges.
pub fn encode_points(stamp: u64, scanner: &ScannerSheet, ranges: &[f64]) -> Vec<u8> {
    const STEP: u32 = 12;
    let mut data = Vec::new();
    let mut count = 0;
    for (i, r) in ranges.iter().enumerate().filter(|(_, r)| r.is_finite()) {
        let point = beam::direction(scanner.scan.azimuth(i)).into_inner() * *r;
        for coordinate in &point {
            data.extend_from_slice(&single(*coordinate).to_le_bytes());
        }
        count += 1;
    }
    let mut cdr = CdrWriter::new();
    write_header(&mut cdr, stamp, LASER_FRAME);
    cdr.u32(1); // height: unordered
    cdr.u32(count);
    cdr.length(3);
    for (name, offset) in [("x", 0), ("y", 4), ("z", 8)] {
        cdr.string(name);
        cdr.u32(offset);
        cdr.u8(FLOAT32);
        cdr.u32(1);
    }
    cdr.bool(false); // little endian
    cdr.u32(STEP);
    cdr.u32(STEP * count);
    cdr.byte_sequence(&data);
    cdr.bool(true); // every point is finite
    cdr.into_bytes()
}

/// A `geometry_msgs/msg/PoseStamped` in the room frame.
pub fn encode_pose(stamp: u64, room_from_body: &Pose) -> Vec<u8> {
    let pose = PoseData::from(room_from_body);
    let mut cdr = CdrWriter::new();
    write_header(&mut cdr, stamp, ROOM_FRAME);
    write_numbers(&mut cdr, &pose.translation_m);
    write_numbers(&mut cdr, &pose.rotation_xyzw);
    cdr.into_bytes()
}

/// A `mocap4r2_msgs/msg/Markers` in the room frame.
pub fn encode_markers(stamp: u64, frame_number: u32, markers: &[LabeledMarker]) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    write_header(&mut cdr, stamp, ROOM_FRAME);
    cdr.u32(frame_number);
    cdr.length(markers.len());
    for marker in markers {
        cdr.i8(NAME_AND_INDEX);
        cdr.i32(i32::try_from(marker.index).unwrap_or(i32::MAX));
        cdr.string(&marker.name);
        write_numbers(&mut cdr, marker.point.coords.as_slice());
    }
    cdr.into_bytes()
}

/// A `std_msgs/msg/String`.
pub fn encode_text(text: &str) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    cdr.string(text);
    cdr.into_bytes()
}

/// A `tf2_msgs/msg/TFMessage`.
pub fn encode_transforms(stamp: u64, transforms: &[FrameTransform<'_>]) -> Vec<u8> {
    let mut cdr = CdrWriter::new();
    cdr.length(transforms.len());
    for transform in transforms {
        let pose = PoseData::from(&transform.pose);
        write_header(&mut cdr, stamp, transform.parent);
        cdr.string(transform.child);
        write_numbers(&mut cdr, &pose.translation_m);
        write_numbers(&mut cdr, &pose.rotation_xyzw);
    }
    cdr.into_bytes()
}

fn read_stamp(cdr: &mut CdrReader<'_>) -> Result<u64, MessageError> {
    let (seconds, nanoseconds) = (cdr.i32()?, cdr.u32()?);
    let whole = u64::try_from(seconds).map_err(|_| MessageError::BadTime { seconds })?;
    Ok(whole * NS_PER_S + u64::from(nanoseconds))
}

/// Opens a message that begins with a header and returns the header's time.
fn open(message: &[u8]) -> Result<(u64, CdrReader<'_>), MessageError> {
    let mut cdr = CdrReader::new(message)?;
    let stamp = read_stamp(&mut cdr)?;
    cdr.string()?; // the frame: each topic has one
    Ok((stamp, cdr))
}

/// Reads the time of a message that begins with a header.
///
/// # Errors
/// [`MessageError`] if the bytes do not begin with one.
pub fn decode_stamp(message: &[u8]) -> Result<u64, MessageError> {
    read_stamp(&mut CdrReader::new(message)?)
}

fn read_point(cdr: &mut CdrReader<'_>) -> Result<Point3<f64>, MessageError> {
    Ok(Point3::new(cdr.f64()?, cdr.f64()?, cdr.f64()?))
}

fn read_singles(cdr: &mut CdrReader<'_>) -> Result<Vec<f64>, CdrError> {
    Ok(cdr.f32_sequence()?.map(f64::from).collect())
}

/// What every beam of a scan returned, echo by echo.
#[derive(Debug, Clone, PartialEq)]
pub struct Echoes {
    /// Time at which the scan began, in nanoseconds.
    pub stamp: u64,
    /// Ranges in meters, beam by beam.
    pub ranges: Vec<Vec<f64>>,
    /// Their intensities in counts of the receiver; empty if there are none.
    pub intensities: Vec<Vec<f64>>,
}

/// Reads a `MultiEchoLaserScan`.
///
/// # Errors
/// [`MessageError`] if the bytes are not one.
pub fn decode_echoes(message: &[u8]) -> Result<Echoes, MessageError> {
    let (stamp, mut cdr) = open(message)?;
    for _ in 0..7 {
        cdr.f32()?; // angles, times and limits are those of the accompanying LaserScan
    }
    let mut of_beams = || -> Result<Vec<Vec<f64>>, CdrError> {
        // A beam takes at least the four bytes of its number of echoes.
        let beams = cdr.length(size_of::<u32>())?;
        (0..beams).map(|_| read_singles(&mut cdr)).collect()
    };
    Ok(Echoes {
        stamp,
        ranges: of_beams()?,
        intensities: of_beams()?,
    })
}

/// Reads a `LaserScan`.
///
/// # Errors
/// [`MessageError`] if the bytes are not one.
pub fn decode_scan(message: &[u8]) -> Result<Scan, MessageError> {
    let (stamp, mut cdr) = open(message)?;
    let mut numbers = [0.0; 7];
    for n in &mut numbers {
        *n = f64::from(cdr.f32()?);
    }
    let [angle_min, _, angle_increment, _, scan_time, range_min, range_max] = numbers;
    if !angle_min.is_finite() || !angle_increment.is_finite() {
        return Err(MessageError::NoAngles {
            first: angle_min,
            increment: angle_increment,
        });
    }
    let ranges = read_singles(&mut cdr)?;
    let intensities = read_singles(&mut cdr)?;
    Ok(Scan {
        stamp,
        angle_min,
        angle_increment,
        scan_time,
        limits_m: [range_min, range_max],
        ranges,
        intensities,
    })
}

/// Reads the text of a `String`.
///
/// # Errors
/// [`MessageError`] if the bytes are not one.
pub fn decode_text(message: &[u8]) -> Result<&str, MessageError> {
    Ok(CdrReader::new(message)?.string()?)
}

/// Reads the time and the pose of a `PoseStamped`, bit for bit if its quaternion has unit length.
///
/// There is no pose if its numbers are not finite or its quaternion is zero: trackers report so that they have lost the
/// body.
///
/// # Errors
/// [`MessageError`] if the bytes are not one or the quaternion is no rotation.
pub fn decode_pose(message: &[u8]) -> Result<(u64, Option<Pose>), MessageError> {
    // Third-party files may hold rounded quaternions; ours have unit length to machine precision.
    const ROUNDED: f64 = 1e-3;
    const EXACT: f64 = 1e-12;
    let (stamp, mut cdr) = open(message)?;
    let position = read_point(&mut cdr)?;
    let [x, y, z, w] = [cdr.f64()?, cdr.f64()?, cdr.f64()?, cdr.f64()?];
    let q = Quaternion::new(w, x, y, z);
    let length = q.norm();
    let finite = position.iter().all(|c| c.is_finite()) && length.is_finite();
    if !finite || length == 0.0 {
        return Ok((stamp, None));
    }
    if (length - 1.0).abs() > ROUNDED {
        return Err(MessageError::NotAPose {
            length,
            seconds: stamp as f64 / NS_PER_S as f64,
        });
    }
    let rotation = if (length - 1.0).abs() > EXACT {
        UnitQuaternion::new_normalize(q)
    } else {
        UnitQuaternion::new_unchecked(q)
    };
    let pose = Pose::from_parts(Translation3::from(position.coords), rotation);
    Ok((stamp, Some(pose)))
}

/// Reads the time and the markers of a `Markers`.
///
/// # Errors
/// [`MessageError`] if the bytes are not one.
pub fn decode_markers(message: &[u8]) -> Result<(u64, Vec<LabeledMarker>), MessageError> {
    /// Kind, index, length of the label and three coordinates, without padding.
    const SMALLEST: usize = 1 + 4 + 4 + 24;
    let (stamp, mut cdr) = open(message)?;
    cdr.u32()?; // frame number
    let length = cdr.length(SMALLEST)?;
    let markers = (0..length)
        .map(|_| {
            cdr.i8()?;
            let index = usize::try_from(cdr.i32()?).unwrap_or(0);
            let name = cdr.string()?.to_owned();
            let point = read_point(&mut cdr)?;
            Ok(LabeledMarker { name, index, point })
        })
        .collect::<Result<_, MessageError>>()?;
    Ok((stamp, markers))
}
