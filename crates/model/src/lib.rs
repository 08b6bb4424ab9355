//! The vocabulary of a 2D LiDAR that sees in 3D through mirrors.
//!
//! A beam leaves the scanner at azimuth θ_b in the plane z = 0, meets a mirror at distance d and continues in
//! direction v; its reading of a board with plane (c, n) is (Cooper, Raquet, Patton 2018, Eq. (6))
//!
//! ```text
//! r = d + s,   s = n·(c − P_L1) / (n·v),   P_L1 = d·(cos θ_b, sin θ_b, 0)
//! v = (cos φ·cos(θ_b + θ_a), cos φ·sin(θ_b + θ_a), sin φ)
//! ```
//!
//! This crate holds what both the simulator and the estimator may know: it has no randomness and reads no files. The
//! modules are listed in the order in which light travels.
//!
//! Units are meters and radians, numbers are `f64`. Frames are right-handed with z up: `room` (motion capture),
//! `rig` (marker body on the superstructure), `sensor` (laser base frame, scan plane z = 0), `board` (target,
//! plane z = 0) and `facet` (mirror, plane z = 0, reflecting side +z). A pose is named `a_from_b`.
//!
//! ```
//! use catoptric_model::{beam, BoardPlane, MirrorPlane, range};
//! use nalgebra::{Point3, Unit, Vector3};
//!
//! // A mirror at 70 mm that folds the forward beam straight up, and a ceiling 2 m above the scan plane.
//! let mirror = MirrorPlane::through(Point3::new(0.07, 0.0, 0.0), Unit::new_normalize(Vector3::new(-1.0, 0.0, 1.0)));
//! let deflection = mirror.deflect(beam::direction(0.0)).expect("the beam meets the mirror's face");
//! let ceiling = BoardPlane::new(Point3::new(0.0, 0.0, 2.0), Unit::new_normalize(Vector3::new(0.0, 0.0, -1.0)));
//! let r = range::predict(&deflection, 0.0, &ceiling).expect("the beam meets the ceiling");
//! assert!((r - 2.07).abs() < 1e-12);
//! ```

pub mod assessment;
pub mod beam;
pub mod bias;
pub mod board;
pub mod calibration;
pub mod characterization;
mod closed_set;
pub mod cloud;
pub mod covariance;
pub mod curve;
pub mod dataset;
pub mod error;
pub mod frame;
pub mod glass;
pub mod label;
pub mod limits;
pub mod mirror;
pub mod motion;
pub mod mount;
pub mod noise;
pub mod paper;
pub mod place;
pub mod range;
pub mod readings;
pub mod scan;
pub mod selection;
pub mod session;
pub mod stop;
pub mod summary;
pub mod tracking;

pub use assessment::Assessment;
pub use beam::Deflection;
pub use bias::{AngleBias, AngleTable, BiasTerms, ColorBias, DistanceBias, RangeBias};
pub use board::{BoardPlane, Rectangle};
pub use calibration::{BeamEstimate, Calibration, Status};
pub use characterization::Characterization;
pub use cloud::{CloudFrame, CloudPoint, PointCloud};
pub use curve::{Curve, CurvedSurface};
pub use dataset::{Dataset, Excerpt, PoseRecord, Stretch};
pub use error::ModelError;
pub use frame::{Pose, PoseData};
pub use label::{PoseKind, PoseLabel, SpotNote, TestKind, TestNote};
pub use mirror::MirrorPlane;
pub use motion::Motion;
pub use range::{CorrectedRange, RawRange};
pub use readings::{BeamStatistics, Gathered, Intensities, Readings, ScanSource, Scans, Unreadable};
pub use scan::{ScanAngles, ScanDirection, ScanError, ScanGeometry};
pub use session::Session;
pub use stop::{Stop, Stopped};
pub use summary::{Moments, Summary, Window};
pub use tracking::{Track, TrackedFrame, Watched};
