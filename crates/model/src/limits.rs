//! Limits of numbers in files: what no scanner, board or laboratory exceeds, and what the arithmetic can take.
//!
//! The types of the files name them in their schemas, which readers check every number against before it is used.

/// Maximum number of beams of a scan: far more than any scanner has, and few enough to fit in memory.
pub const MOST_BEAMS: usize = 1 << 16;

/// Largest distance and largest coordinate, in meters: 10 km, as far as rays are cast.
pub const FAR_M: f64 = 1e4;

/// The same in millimeters.
pub const FAR_MM: f64 = 1e7;

/// Largest error of a range and largest standard deviation of one, in millimeters.
pub const ERROR_MM: f64 = 1e5;

/// Largest thickness of a mirror, in millimeters.
pub const THICKNESS_MM: f64 = 1e3;

/// Largest number whose unit has no limit of its own, such as a variance: its square is still far from infinity.
pub const ANY: f64 = 1e15;

/// A turn, in degrees.
pub const TURN_DEG: f64 = 360.0;

/// Somewhat more than a turn, in radians: files round it.
pub const TURN_RAD: f64 = 6.29;

/// Smallest angle between neighboring beams, in degrees.
pub const STEP_DEG: f64 = 1e-4;

/// Largest component of a unit vector or quaternion, which files round.
pub const UNIT: f64 = 1.01;

/// Largest share, probability or correlation, which arithmetic rounds.
pub const WHOLE: f64 = 1.000_001;

/// Largest refractive index of a glass in front of a mirror.
pub const INDEX: f64 = 4.0;

/// Largest divergence of a beam, in milliradians.
pub const DIVERGENCE_MRAD: f64 = 1e3;

/// Minimum number of scans in a second.
pub const SLOWEST_HZ: f64 = 1e-3;

/// Maximum number of scans in a second.
pub const FASTEST_HZ: f64 = 1e5;

/// Shortest and longest time from beam to beam, in microseconds.
pub const BEAM_TIME_US: [f64; 2] = [1e-3, 1e9];

/// Largest index of a beam.
pub const LAST_BEAM: usize = MOST_BEAMS - 1;

/// Largest number of anything that is counted.
pub const COUNT: usize = 1_000_000_000_000;
