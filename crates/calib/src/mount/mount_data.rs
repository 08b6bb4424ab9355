//! Selects the readings of boards that place the sensor in the rig, and linearizes them.

use crate::judge::common::CommonErrors;
use crate::judge::covariance::PlaneFit;
use crate::readings::jacobian;
use crate::readings::observations::{BoardInSensor, azimuth, cone_half_angle};
use crate::readings::spread;
use catoptric_model::session::MountTolerance;
use catoptric_model::{
    CorrectedRange, Dataset, Pose, PoseKind, PoseRecord, RangeBias, RawRange, Summary, beam,
};
use nalgebra::{DMatrix, DVector, Matrix4, Point3};

/// Beams this close to a served range may meet a mirror as built, in degrees: half a spot and some facet tilt.
const CLEAR_OF_FACETS_DEG: f64 = 3.0;

/// Noise of a mean below which its weight does not grow, in meters: whole millimeters, 1/√12 mm.
const MIN_NOISE: f64 = 2.9e-4;

/// Step of the reported ranges, in meters.
const ROUNDING_STEP: f64 = 1e-3;

/// Minimum number of beams on a board; with fewer, its plane cannot be distinguished from another one.
const MIN_RAYS: usize = 3;

/// Gate on residuals that count as the board's own, in standard deviations.
const GATE_SIGMAS: f64 = 6.0;

/// Residual that always counts as the board's own, in meters: beam size and incidence, neither of them modeled.
const GATE_FLOOR: f64 = 0.02;

/// The mean of one beam's readings of a board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray {
    pub(crate) beam: usize,
    pub(crate) azimuth: f64,
    pub(crate) mean: f64,
    /// Variance of the mean by noise, in square meters.
    pub(crate) variance: f64,
}

/// A pose of a board and the beams that read it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DirectBoard {
    pub(crate) pose: usize,
    pub(crate) rays: Vec<Ray>,
}

impl DirectBoard {
    /// Weights all means by the pooled spread of the board's readings instead of the believed noise.
    ///
    /// Readings that scatter over a rounding step or more average it out; others keep its floor.
    pub(crate) fn pool_noise(&mut self, summaries: &[Summary]) {
        let of = |ray: &Ray| {
            (
                summaries[ray.beam].sd,
                summaries[ray.beam].count.saturating_sub(1),
            )
        };
        let (squares, freedom) = self
            .rays
            .iter()
            .map(of)
            .fold((0.0, 0), |(squares, freedom), (sd, n)| {
                (squares + sd * sd * n as f64, freedom + n)
            });
        let variance = squares / freedom.max(1) as f64;
        let rounded = variance < ROUNDING_STEP * ROUNDING_STEP;
        for ray in &mut self.rays {
            let of_mean = variance / summaries[ray.beam].count as f64;
            ray.variance = if rounded {
                of_mean.max(MIN_NOISE * MIN_NOISE)
            } else {
                of_mean
            };
        }
    }
}

/// How strictly beams are selected: the motions of the sensor that must be allowed for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Selection {
    shift: f64,
    turn: f64,
}

/// A board's readings linearized at a mounting.
pub(crate) struct Block {
    /// ∂r/∂(motion of the sensor), one row per ray.
    pub(crate) jacobian: DMatrix<f64>,
    /// Where each ray hits the board, and its reading there.
    pub(crate) sightings: Vec<Sighting>,
    /// Color of the board.
    pub(crate) color: String,
    /// 1σ of drift and of the plane's offset and two tilts, as changes of the readings.
    board_errors: DMatrix<f64>,
    /// Noise of each mean.
    variance: DVector<f64>,
}

/// The mean of a beam's readings of a board, and its prediction from the board's pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sighting {
    pub(crate) mean: RawRange,
    pub(crate) distance: f64,
    pub(crate) cos_incidence: f64,
}

impl Block {
    /// Σ⁻¹·m with Σ = D + UUᵀ, U the board's own errors (Woodbury): D⁻¹ − D⁻¹U(I + UᵀD⁻¹U)⁻¹UᵀD⁻¹.
    pub(crate) fn weighted(&self, m: &DMatrix<f64>) -> DMatrix<f64> {
        let by_noise = |m: &DMatrix<f64>| {
            let mut m = m.clone();
            for (mut row, variance) in m.row_iter_mut().zip(self.variance.iter()) {
                row /= *variance;
            }
            m
        };
        let u = &self.board_errors;
        let weighted_u = by_noise(u);
        let inner = Matrix4::identity() + (u.transpose() * &weighted_u).fixed_view::<4, 4>(0, 0);
        let plain = by_noise(m);
        let Some(inverse) = inner.try_inverse() else {
            return plain;
        };
        plain - &weighted_u * (inverse * (weighted_u.transpose() * m))
    }
}

/// The poses recorded for the mounting, and the conditions for selecting from them.
pub(crate) struct Selector<'a> {
    dataset: &'a Dataset,
    summaries: &'a [Vec<Summary>],
    pub(crate) common: CommonErrors<'a>,
    /// The bias subtracted before a reading is compared with the board.
    bias: &'a RangeBias,
    /// Residual that always counts as the board's own, in meters.
    gate_floor: f64,
    /// Whether each beam is far from every facet.
    clear: Vec<bool>,
}

impl Selection {
    /// Three times the tolerances of the drawing.
    pub(crate) fn initial(tolerance: &MountTolerance) -> Self {
        let largest = |sd: &[f64; 3]| sd.iter().fold(0.0, |a: f64, b| a.max(*b));
        Self {
            shift: 3e-3 * largest(&tolerance.translation_sd_mm),
            turn: 3.0 * largest(&tolerance.rotation_sd_deg).to_radians(),
        }
    }

    pub(crate) fn narrower(&self) -> Self {
        let halved = |x: f64| if x < 1e-4 { 0.0 } else { 0.3 * x };
        Self {
            shift: halved(self.shift),
            turn: halved(self.turn),
        }
    }

    pub(crate) fn is_narrowest(&self) -> bool {
        self.shift == 0.0 && self.turn == 0.0
    }
}

impl<'a> Selector<'a> {
    pub(crate) fn new(dataset: &'a Dataset, summaries: &'a [Vec<Summary>]) -> Self {
        let scan = &dataset.session.scanner.scan;
        let near = scan.steps_in(CLEAR_OF_FACETS_DEG);
        let is_clear = |b| {
            dataset
                .session
                .facets
                .iter()
                .all(|f| scan.beside(f.beams, b) > near)
        };
        let clear = (0..scan.beams()).map(is_clear).collect();
        Self {
            dataset,
            summaries,
            common: CommonErrors::of(&dataset.session),
            bias: &dataset.session.believed.bias,
            gate_floor: GATE_FLOOR,
            clear,
        }
    }

    /// The same with another bias, and with residuals up to `gate_floor` counted as the board's own.
    pub(crate) fn with_bias(self, bias: &'a RangeBias, gate_floor: f64) -> Self {
        Self {
            bias,
            gate_floor,
            ..self
        }
    }

    /// The beams that read the boards, for a mounting known to within `stage`.
    pub(crate) fn select(&self, rig_from_sensor: &Pose, stage: &Selection) -> Vec<DirectBoard> {
        self.dataset
            .poses
            .iter()
            .enumerate()
            .filter(|(_, record)| record.label.kind == PoseKind::Direct)
            .filter_map(|(pose, record)| {
                let board = BoardInSensor::of(record, &self.dataset.session, rig_from_sensor)?;
                let rays: Vec<Ray> = (0..record.beams())
                    .filter(|b| self.clear[*b] && self.is_within(record, *b))
                    .filter_map(|b| self.ray(&board, b, &self.summaries[pose][b], stage))
                    .collect();
                (rays.len() >= MIN_RAYS).then_some(DirectBoard { pose, rays })
            })
            .collect()
    }

    /// Whether the experimenter set the board up for this beam, as far as the label says.
    fn is_within(&self, record: &PoseRecord, beam: usize) -> bool {
        let scan = &self.dataset.session.scanner.scan;
        record.label.beams.is_none_or(|run| scan.holds(run, beam))
    }

    fn ray(&self, board: &BoardInSensor, beam: usize, summary: &Summary, stage: &Selection) -> Option<Ray> {
        let (session, believed) = (&self.dataset.session, &self.dataset.session.believed);
        let noise = believed.range_noise_sd_mm * 1e-3;
        if summary.count == 0 || summary.missing > summary.count || spread::is_abnormal(summary, noise) {
            return None;
        }
        let azimuth = azimuth(session, beam);
        let u = beam::direction(azimuth);
        let hit = board.hit(&Point3::origin(), &u)?;
        let radius = cone_half_angle(session) * hit.distance;
        if !board.holds(&hit, radius, stage.shift + stage.turn * hit.distance) {
            return None;
        }
        let cos_incidence = board.plane.cos_incidence(&u);
        let z = self
            .bias
            .correct(RawRange(summary.mean), hit.distance, cos_incidence, &board.color);
        let tan = (1.0 / (cos_incidence * cos_incidence) - 1.0).max(0.0).sqrt();
        let noise = believed.noise_sd(summary.mean, &board.color);
        let variance = (spread::noise_sd(summary, noise).powi(2) / summary.count as f64
            + (1e-3 * believed.element_sd_mm).powi(2))
        .max(MIN_NOISE * MIN_NOISE);
        let marker = 1e-3 * believed.marker_sd_mm / cos_incidence;
        let common = self.common.row(hit.distance, cos_incidence, &board.color);
        let sd = (variance + (1e-3 * believed.drift_sd_mm).powi(2) + marker * marker + common.norm_squared())
            .sqrt();
        let unplaced = stage.shift / cos_incidence + stage.turn * hit.distance * tan;
        let gate = self.gate_floor.max(GATE_SIGMAS * sd) + unplaced;
        ((z.0 - hit.distance).abs() <= gate).then_some(Ray {
            beam,
            azimuth,
            mean: summary.mean,
            variance,
        })
    }

    /// The range of a sighting without its bias.
    pub(crate) fn corrected(&self, seen: &Sighting, color: &str) -> CorrectedRange {
        self.bias
            .correct(seen.mean, seen.distance, seen.cos_incidence, color)
    }

    /// The readings of a board linearized at a mounting; `None` if a ray no longer hits it.
    pub(crate) fn linearize(&self, board: &DirectBoard, rig_from_sensor: &Pose) -> Option<Block> {
        let session = &self.dataset.session;
        let seen = BoardInSensor::of(&self.dataset.poses[board.pose], session, rig_from_sensor)?;
        let rows = board.rays.len();
        let drift = session.believed.drift_sd_mm * 1e-3;
        let marker = session.believed.marker_sd_mm * 1e-3;
        let mut jacobian = DMatrix::zeros(rows, 6);
        let mut sightings = Vec::with_capacity(rows);
        let fit = PlaneFit::new(&seen.markers, &seen.plane.normal);
        let errors = fit.errors();
        let mut board_errors = DMatrix::zeros(rows, 4);
        for (row, ray) in board.rays.iter().enumerate() {
            let u = beam::direction(ray.azimuth);
            let hit = seen.hit(&Point3::origin(), &u)?;
            jacobian.set_row(row, &jacobian::of_mount(&hit.point, &seen.plane.normal, &u));
            sightings.push(Sighting {
                mean: RawRange(ray.mean),
                distance: hit.distance,
                cos_incidence: seen.plane.cos_incidence(&u),
            });
            board_errors[(row, 0)] = drift;
            let a = fit.coordinates(&hit.point);
            let closing = seen.plane.normal.dot(&u);
            for column in 0..3 {
                board_errors[(row, 1 + column)] = marker * a.dot(&errors.column(column)) / closing;
            }
        }
        let variance = DVector::from_iterator(rows, board.rays.iter().map(|r| r.variance));
        Some(Block {
            jacobian,
            sightings,
            color: seen.color,
            board_errors,
            variance,
        })
    }
}
