//! Point clouds as files: PLY (binary little-endian) and PCD (version 0.7, binary).
//!
//! Both hold x, y, z in meters as 32-bit floats, the beam as an unsigned 16-bit and the scan as an unsigned 32-bit
//! integer. The frame is given in a comment of the header.

use super::extension::{by_extension, listed};
use catoptric_model::cloud::{CloudFrame, CloudPoint, PointCloud};
use nalgebra::Point3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

catoptric_model::closed_set! {
    /// File format of a cloud.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum CloudFormat {
        /// Stanford's polygon file format.
        Ply,
        /// The Point Cloud Library's format.
        Pcd,
    }
}

/// One format: a header as text, and the points in the same layout for all.
struct Row {
    /// The extension of its files, in lower case.
    extension: &'static str,
    /// The last line of the header.
    last_line: &'static [u8],
    /// The header for the name of a frame and a number of points.
    header: fn(&str, usize) -> String,
}

/// An invalid file name or content of a cloud.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CloudError {
    /// The extension is not that of a supported format.
    #[error(
        "{}: a cloud is written as {}",
        path.display(),
        listed(&CloudFormat::ALL, CloudFormat::extension, "or")
    )]
    UnknownExtension {
        /// The name.
        path: PathBuf,
    },
    /// The bytes are not a cloud written by this program.
    #[error("not a cloud written by this program: {0}")]
    Malformed(String),
}

/// Unit of the coordinates in a header. Its spelling is part of the format: other headers are rejected.
const UNIT: &str = "metres";

/// Bytes per point: three floats, a beam, a scan.
pub const POINT_BYTES: usize = 3 * 4 + 2 + 4;

impl CloudFormat {
    const fn row(self) -> &'static Row {
        match self {
            Self::Ply => &Row {
                extension: "ply",
                last_line: b"end_header\n",
                header: ply_header,
            },
            Self::Pcd => &Row {
                extension: "pcd",
                last_line: b"DATA binary\n",
                header: pcd_header,
            },
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        self.row().extension
    }

    /// The format selected by a file's extension, in upper or lower case.
    ///
    /// ```
    /// use catoptric_files::cloud::CloudFormat;
    /// assert_eq!(CloudFormat::of_path("cloud.PLY".as_ref()), Ok(CloudFormat::Ply));
    /// assert!(CloudFormat::of_path("cloud.las".as_ref()).is_err());
    /// ```
    ///
    /// # Errors
    /// [`CloudError::UnknownExtension`] for any other.
    pub fn of_path(path: &Path) -> Result<Self, CloudError> {
        by_extension(path, &Self::ALL, Self::extension).ok_or_else(|| CloudError::UnknownExtension {
            path: path.to_owned(),
        })
    }
}

/// Writes a cloud.
///
/// # Errors
/// Any error of the writer; [`io::ErrorKind::InvalidData`] for a beam above 65,535 or a scan above 2³² − 1.
pub fn write_cloud(format: CloudFormat, cloud: &PointCloud, to: &mut impl Write) -> io::Result<()> {
    to.write_all(cloud_header(format, cloud.frame, cloud.points.len()).as_bytes())?;
    for point in &cloud.points {
        to.write_all(&point_bytes(point)?)?;
    }
    Ok(())
}

/// A cloud as the bytes of its file.
///
/// # Errors
/// As for [`write_cloud`]; the writer here never fails.
pub fn cloud_bytes(format: CloudFormat, cloud: &PointCloud) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(512 + POINT_BYTES * cloud.points.len());
    write_cloud(format, cloud, &mut bytes)?;
    Ok(bytes)
}

/// Reads the frame and the points of a cloud written by [`write_cloud`]; other headers are rejected.
///
/// # Errors
/// [`CloudError::Malformed`] for anything else, including a truncated file.
pub fn read_cloud(format: CloudFormat, bytes: &[u8]) -> Result<(CloudFrame, Vec<CloudPoint>), CloudError> {
    let malformed = |what: &str| CloudError::Malformed(what.to_owned());
    let last_line = format.row().last_line;
    let end = bytes
        .windows(last_line.len())
        .position(|w| w == last_line)
        .ok_or_else(|| malformed("its header does not end"))?
        + last_line.len();
    let (given, body) = bytes.split_at(end);
    let count = body.len() / POINT_BYTES;
    let frame = CloudFrame::ALL
        .into_iter()
        .find(|&frame| cloud_header(format, frame, count).as_bytes() == given)
        .ok_or_else(|| malformed("header and length do not fit"))?;
    if count * POINT_BYTES != body.len() {
        return Err(malformed("the last point is cut short"));
    }
    Ok((frame, body.chunks_exact(POINT_BYTES).map(decode).collect()))
}

/// The header of a cloud.
pub fn cloud_header(format: CloudFormat, frame: CloudFrame, count: usize) -> String {
    (format.row().header)(frame.word(), count)
}

fn ply_header(frame: &str, count: usize) -> String {
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment catoptric, frame {frame}, {UNIT}\n\
         element vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         property ushort beam\nproperty uint scan\nend_header\n"
    )
}

fn pcd_header(frame: &str, count: usize) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\n# catoptric, frame {frame}, {UNIT}\nVERSION 0.7\n\
         FIELDS x y z beam scan\nSIZE 4 4 4 2 4\nTYPE F F F U U\nCOUNT 1 1 1 1 1\nWIDTH {count}\nHEIGHT 1\n\
         VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
}

/// A point in the layout of both formats.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] for a beam above 65,535 or a scan above 2³² − 1.
pub fn point_bytes(point: &CloudPoint) -> io::Result<[u8; POINT_BYTES]> {
    let too_large = |what: &str, value: usize| {
        io::Error::new(
            io::ErrorKind::InvalidData,
            format!("{what} {value} does not fit the file's integer"),
        )
    };
    let beam = u16::try_from(point.beam).map_err(|_| too_large("beam", point.beam))?;
    let scan = u32::try_from(point.scan).map_err(|_| too_large("scan", point.scan))?;
    let mut bytes = [0; POINT_BYTES];
    for (axis, place) in point.position.iter().zip(bytes.chunks_exact_mut(4)) {
        // The file holds 32-bit floats: at 30 m they are accurate to two micrometers.
        #[allow(clippy::cast_possible_truncation)]
        place.copy_from_slice(&(*axis as f32).to_le_bytes());
    }
    bytes[12..14].copy_from_slice(&beam.to_le_bytes());
    bytes[14..18].copy_from_slice(&scan.to_le_bytes());
    Ok(bytes)
}

fn decode(bytes: &[u8]) -> CloudPoint {
    let axis = |i: usize| {
        f64::from(f32::from_le_bytes([
            bytes[i],
            bytes[i + 1],
            bytes[i + 2],
            bytes[i + 3],
        ]))
    };
    CloudPoint {
        position: Point3::new(axis(0), axis(4), axis(8)),
        beam: usize::from(u16::from_le_bytes([bytes[12], bytes[13]])),
        scan: u32::from_le_bytes([bytes[14], bytes[15], bytes[16], bytes[17]]) as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> PointCloud {
        let point = |x: f64, beam, scan| CloudPoint {
            position: Point3::new(x, -2.25, 0.5),
            beam,
            scan,
        };
        PointCloud {
            frame: CloudFrame::Room,
            pose: 1,
            mount_is_nominal: false,
            points: vec![point(1.5, 0, 0), point(-3.125, 1080, 0), point(0.1, 540, 70_000)],
            without_range: 0,
            without_direction: 0,
            without_pose: 0,
            unsolved_elements: 0,
        }
    }

    #[test]
    fn both_formats_survive_the_round_trip() {
        for format in CloudFormat::ALL {
            let given = cloud();
            let bytes = cloud_bytes(format, &given).expect("it fits");
            let (frame, points) = read_cloud(format, &bytes).expect("it is our own");
            assert_eq!((frame, points.len()), (CloudFrame::Room, 3));
            for (a, b) in given.points.iter().zip(&points) {
                assert_eq!((a.beam, a.scan), (b.beam, b.scan));
                assert!((a.position - b.position).norm() < 1e-7);
            }
            assert_eq!(points[1].position.x, -3.125);
        }
    }

    #[test]
    fn the_headers_conform_to_the_formats() {
        let ply = cloud_bytes(CloudFormat::Ply, &cloud()).expect("it fits");
        assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
        let header = String::from_utf8_lossy(&ply);
        assert!(header.contains("\nelement vertex 3\n") && header.contains("\nproperty ushort beam\n"));
        // The first point follows the header directly: x = 1.5 is 0x3FC00000.
        let body = ply.len() - 3 * POINT_BYTES;
        assert_eq!(ply[body..body + 4], [0x00, 0x00, 0xC0, 0x3F]);

        let pcd = cloud_bytes(CloudFormat::Pcd, &cloud()).expect("it fits");
        let header = String::from_utf8_lossy(&pcd);
        assert!(header.contains("\nFIELDS x y z beam scan\nSIZE 4 4 4 2 4\nTYPE F F F U U\n"));
        assert!(header.contains("\nPOINTS 3\nDATA binary\n"));
    }

    #[test]
    fn a_truncated_file_is_rejected() {
        for format in CloudFormat::ALL {
            let bytes = cloud_bytes(format, &cloud()).expect("it fits");
            for length in [0, 10, bytes.len() - POINT_BYTES, bytes.len() - 1] {
                assert!(read_cloud(format, &bytes[..length]).is_err(), "{length} bytes");
            }
        }
    }

    #[test]
    fn a_beam_too_large_for_the_file_is_an_error() {
        let mut large = cloud();
        large.points[0].beam = 70_000;
        let error = cloud_bytes(CloudFormat::Ply, &large).expect_err("it does not fit");
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
    }

    #[test]
    fn the_extension_decides() {
        assert_eq!(CloudFormat::of_path(Path::new("a/b.pcd")), Ok(CloudFormat::Pcd));
        let error = CloudFormat::of_path(Path::new("cloud.txt")).expect_err("no such format");
        assert_eq!(error.to_string(), "cloud.txt: a cloud is written as .ply or .pcd");
        assert!(CloudFormat::of_path(Path::new("cloud")).is_err());
    }
}
