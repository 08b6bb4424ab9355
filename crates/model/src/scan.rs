//! Scan geometry: the azimuths of the beams, the direction of rotation, and the time at which each beam is read.
//!
//! ```text
//! θ_b(i) = first + direction·i·step       direction +1 counter-clockwise, −1 clockwise, seen from above
//! t(i)   = i·beam time                    seconds after the scan begins; beam time is step/(360°·rate) unless given
//! ```
//!
//! If the beams cover the full circle, beams·step = 360° to within half a step, the scan closes: its first and last
//! beams are neighbors, and a run of beams may cross the seam, `[first, last]` with first > last.

use crate::limits;
pub use crate::limits::MOST_BEAMS;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Tolerance for equal azimuths, as a fraction of a step: the rounding of decimals in files.
const SAME_PART_OF_STEP: f64 = 1e-3;

/// The direction of rotation of a scan, seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ScanDirection {
    /// Counter-clockwise: azimuths increase from beam to beam.
    #[default]
    Ccw,
    /// Clockwise: azimuths decrease from beam to beam.
    Cw,
}

/// The azimuths of a scan's beams, to which a calibration is bound.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanAngles {
    /// Azimuth of beam 0, counter-clockwise from the x axis of the sensor frame, in degrees.
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    pub first_deg: f64,
    /// Angle between neighboring beams, in degrees.
    #[schemars(range(min = limits::STEP_DEG, max = limits::TURN_DEG))]
    pub step_deg: f64,
    /// Number of beams in a scan.
    #[schemars(range(min = 1, max = MOST_BEAMS))]
    pub beams: usize,
    /// The direction of rotation.
    #[serde(default)]
    pub direction: ScanDirection,
}

/// Angles and timing of a scan; every value is physically possible. The default is the UST-20LX's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScanGeometry {
    angles: ScanAngles,
    scan_rate_hz: f64,
    beam_time_s: f64,
}

/// A value that is impossible for a scan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{key}` {problem}")]
pub struct ScanError {
    /// The key as written in files.
    pub key: &'static str,
    /// What is wrong with it.
    pub problem: String,
}

impl ScanDirection {
    /// +1 counter-clockwise, −1 clockwise.
    pub fn sign(self) -> f64 {
        match self {
            Self::Ccw => 1.0,
            Self::Cw => -1.0,
        }
    }
}

impl ScanAngles {
    /// Beams placed symmetrically about the x axis, counter-clockwise.
    pub fn centered(step_deg: f64, beams: usize) -> Self {
        Self {
            first_deg: -0.5 * (beams as f64 - 1.0) * step_deg,
            step_deg,
            beams,
            direction: ScanDirection::Ccw,
        }
    }

    /// Checks that a scan can have these angles.
    ///
    /// # Errors
    /// [`ScanError`] names the first impossible value.
    pub fn check(&self) -> Result<(), ScanError> {
        let fail = |key, problem: String| Err(ScanError { key, problem });
        if !(1..=MOST_BEAMS).contains(&self.beams) {
            return fail(
                "beams",
                format!("is {}; 1 to {MOST_BEAMS} is allowed", self.beams),
            );
        }
        if !(self.step_deg.is_finite() && self.step_deg > 0.0) {
            return fail(
                "step_deg",
                format!("is {}; a positive number is needed", self.step_deg),
            );
        }
        if !(-360.0..=360.0).contains(&self.first_deg) {
            return fail(
                "first_deg",
                format!("is {}; -360 to 360 is allowed", self.first_deg),
            );
        }
        let around = self.step_deg * self.beams as f64;
        if around > 360.0 + 0.5 * self.step_deg {
            return fail(
                "step_deg",
                format!(
                    "is {}; {} such steps are more than one turn",
                    self.step_deg, self.beams
                ),
            );
        }
        Ok(())
    }

    /// Whether both belong to the same scanner: as many beams, in the same directions to within the rounding of
    /// decimals.
    pub fn same_as(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= SAME_PART_OF_STEP * self.step_deg;
        let steps = self.beams.saturating_sub(1) as f64;
        self.beams == other.beams
            && self.direction == other.direction
            && near(self.first_deg, other.first_deg)
            && near(self.step_deg * steps, other.step_deg * steps)
    }
}

impl fmt::Display for ScanAngles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let direction = match self.direction {
            ScanDirection::Ccw => "counter-clockwise",
            ScanDirection::Cw => "clockwise",
        };
        let Self {
            first_deg,
            step_deg,
            beams,
            ..
        } = self;
        write!(f, "{beams} beams of {step_deg}° from {first_deg}° {direction}")
    }
}

impl ScanGeometry {
    /// A scan; without a beam time, its beams are spread evenly over the scan period.
    ///
    /// ```
    /// use catoptric_model::{ScanAngles, ScanDirection, ScanGeometry};
    ///
    /// let angles = ScanAngles { first_deg: 120.0, step_deg: 0.352, beams: 682, direction: ScanDirection::Cw };
    /// let scan = ScanGeometry::new(angles, 10.0, None)?;
    /// assert!((scan.azimuth(681).to_degrees() + 119.712).abs() < 1e-9);
    /// assert_eq!(scan.nearest(0.0), Some(341));
    /// # Ok::<(), catoptric_model::ScanError>(())
    /// ```
    ///
    /// # Errors
    /// [`ScanError`] names the first impossible value.
    pub fn new(angles: ScanAngles, scan_rate_hz: f64, beam_time_us: Option<f64>) -> Result<Self, ScanError> {
        angles.check()?;
        let fail = |key, problem: String| Err(ScanError { key, problem });
        if !(scan_rate_hz.is_finite() && scan_rate_hz > 0.0) {
            return fail(
                "scan_rate_hz",
                format!("is {scan_rate_hz}; a positive number is needed"),
            );
        }
        let beam_time_s = match beam_time_us {
            None => angles.step_deg / 360.0 / scan_rate_hz,
            Some(us) if us.is_finite() && us > 0.0 => us / 1e6,
            Some(us) => return fail("beam_time_us", format!("is {us}; a positive number is needed")),
        };
        // The last beam is read before the next scan begins.
        if beam_time_s * (angles.beams as f64 - 1.0) >= 1.0 / scan_rate_hz {
            return fail(
                "beam_time_us",
                format!(
                    "is {}; {} beams take longer than a scan of {} ms",
                    beam_time_s * 1e6,
                    angles.beams,
                    1e3 / scan_rate_hz
                ),
            );
        }
        Ok(Self {
            angles,
            scan_rate_hz,
            beam_time_s,
        })
    }

    /// The azimuths of its beams.
    pub fn angles(&self) -> &ScanAngles {
        &self.angles
    }

    /// Number of beams in a scan.
    pub fn beams(&self) -> usize {
        self.angles.beams
    }

    /// Angle between neighboring beams, in radians.
    pub fn step(&self) -> f64 {
        self.angles.step_deg.to_radians()
    }

    /// Angle from a beam to the next one, in radians, negative in a clockwise scan.
    pub fn increment(&self) -> f64 {
        self.angles.direction.sign() * self.step()
    }

    /// Base azimuth θ_b of a beam, counter-clockwise from the x axis of the sensor frame, in radians.
    #[doc(alias = "theta_b")]
    pub fn azimuth(&self, beam: usize) -> f64 {
        self.azimuth_deg(beam).to_radians()
    }

    /// The same in degrees.
    pub fn azimuth_deg(&self, beam: usize) -> f64 {
        let ScanAngles {
            first_deg,
            step_deg,
            direction,
            ..
        } = self.angles;
        first_deg + direction.sign() * (beam as f64 * step_deg)
    }

    /// Smallest and largest azimuth of a beam, in degrees.
    pub fn range_deg(&self) -> [f64; 2] {
        let [first, last] = [0, self.beams() - 1].map(|beam| self.azimuth_deg(beam));
        [first.min(last), first.max(last)]
    }

    /// Position of an azimuth in the scan, in steps from beam 0, from half a step before it.
    ///
    /// Azimuths a full turn apart are equivalent; positions past the last beam are not in the scan.
    pub fn place(&self, azimuth: f64) -> f64 {
        let ScanAngles {
            first_deg,
            step_deg,
            direction,
            ..
        } = self.angles;
        let along = direction.sign() * (azimuth.to_degrees() - first_deg);
        let turns = ((along + 0.5 * step_deg) / 360.0).floor();
        (along - 360.0 * turns) / step_deg
    }

    /// The beam whose azimuth is nearest to the given one; `None` outside the scan.
    pub fn nearest(&self, azimuth: f64) -> Option<usize> {
        let place = self.place(azimuth).round();
        if !place.is_finite() {
            return None;
        }
        // Within one turn, so the conversion does not truncate.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let beam = place as usize;
        match self.closes() {
            // The seam may be up to half a step wider or narrower than a step.
            true => Some(if beam < self.beams() { beam } else { 0 }),
            false => (beam < self.beams()).then_some(beam),
        }
    }

    /// Whether the beams cover the full circle, so that the first and the last are neighbors.
    pub fn closes(&self) -> bool {
        let around = self.angles.step_deg * self.beams() as f64;
        (around - 360.0).abs() <= 0.5 * self.angles.step_deg
    }

    /// The beams before and after a given one; `None` at an end of the scan.
    pub fn neighbors(&self, beam: usize) -> [Option<usize>; 2] {
        let (last, closes) = (self.beams() - 1, self.closes());
        let before = match beam {
            0 => closes.then_some(last),
            _ => Some(beam - 1),
        };
        let after = if beam < last {
            Some(beam + 1)
        } else {
            closes.then_some(0)
        };
        [before, after]
    }

    /// Number of steps from `a` to `b`, in the shorter direction if the scan closes; 0 if they are equal.
    pub fn apart(&self, a: usize, b: usize) -> usize {
        let straight = a.abs_diff(b);
        match self.closes() {
            true => straight.min(self.beams().saturating_sub(straight)),
            false => straight,
        }
    }

    /// Whether a run crosses the seam; never if the scan does not close.
    fn over_seam(&self, [first, last]: [usize; 2]) -> bool {
        first > last && self.closes()
    }

    /// The beams of a run that exist in the scan, in order; first > last crosses the seam.
    pub fn run(&self, run: [usize; 2]) -> impl Iterator<Item = usize> + Clone + use<> {
        let (beams, [first, last]) = (self.beams(), run);
        let to_last = last.saturating_add(1).min(beams);
        let (to_end, from_start) = match self.over_seam(run) {
            true => (first..beams, 0..to_last),
            false => (first..to_last, 0..0),
        };
        to_end.chain(from_start)
    }

    /// Whether a run contains a beam.
    pub fn holds(&self, run: [usize; 2], beam: usize) -> bool {
        let [first, last] = run;
        match self.over_seam(run) {
            true => beam >= first || beam <= last,
            false => (first..=last).contains(&beam),
        }
    }

    /// Number of steps from the first beam of a run to its last.
    pub fn length(&self, run: [usize; 2]) -> usize {
        let [first, last] = run;
        match self.over_seam(run) {
            true => (last + self.beams()).saturating_sub(first),
            false => last.saturating_sub(first),
        }
    }

    /// Number of steps from the first beam of a run to a beam; negative if the beam is before it.
    pub fn along(&self, run: [usize; 2], beam: usize) -> f64 {
        let straight = beam as f64 - run[0] as f64;
        if !self.closes() {
            return straight;
        }
        let around = self.beams() as f64;
        let on = straight.rem_euclid(around);
        let beyond = on - self.length(run) as f64;
        // Beams outside belong to the nearer end.
        if beyond <= around - on { on } else { on - around }
    }

    /// Number of steps that an angle spans, rounded up.
    pub fn steps_in(&self, angle_deg: f64) -> usize {
        // Small and positive; rounding noise above a whole number does not add a step.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = (angle_deg / self.angles.step_deg - SAME_PART_OF_STEP)
            .ceil()
            .max(0.0) as usize;
        steps
    }

    /// Number of steps from a beam to a run; 0 inside.
    pub fn beside(&self, run: [usize; 2], beam: usize) -> usize {
        match self.holds(run, beam) {
            true => 0,
            false => self.apart(run[0], beam).min(self.apart(run[1], beam)),
        }
    }

    /// A run extended by N beams on either side, within the scan; a scan that closes gives all its beams at most.
    pub fn widened(&self, [first, last]: [usize; 2], by: usize) -> [usize; 2] {
        let beams = self.beams();
        if !self.closes() {
            return [first.saturating_sub(by), last.saturating_add(by).min(beams - 1)];
        }
        if self.length([first, last]) + 1 + 2 * by >= beams {
            return [0, beams - 1];
        }
        [(first + beams - by) % beams, (last + by) % beams]
    }

    /// The shortest run that contains the given beams, in ascending order; `None` for no beams.
    ///
    /// If the scan closes, the run omits the largest gap, and the one across the seam in a tie.
    pub fn shortest_run(&self, beams: &[usize]) -> Option<[usize; 2]> {
        let (first, last) = (*beams.first()?, *beams.last()?);
        if !self.closes() {
            return Some([first, last]);
        }
        let over_seam = first + self.beams() - last;
        let widest = beams.windows(2).max_by_key(|pair| pair[1] - pair[0]);
        Some(match widest {
            Some(pair) if pair[1] - pair[0] > over_seam => [pair[1], pair[0]],
            _ => [first, last],
        })
    }

    /// Scans per second.
    pub fn scan_rate_hz(&self) -> f64 {
        self.scan_rate_hz
    }

    /// Time from the start of one scan to the start of the next, in seconds.
    pub fn scan_period_s(&self) -> f64 {
        1.0 / self.scan_rate_hz
    }

    /// Time from one beam of a scan to the next, in seconds.
    pub fn beam_time_s(&self) -> f64 {
        self.beam_time_s
    }

    /// Time at which a beam is read, in seconds after its scan begins.
    pub fn time_of(&self, beam: usize) -> f64 {
        beam as f64 * self.beam_time_s
    }
}

impl Default for ScanGeometry {
    /// The UST-20LX (data sheet): 270° in steps of 0.25°, counter-clockwise, 40 scans per second.
    fn default() -> Self {
        let scan_rate_hz = 40.0;
        let step_deg = 0.25;
        Self {
            angles: ScanAngles::centered(step_deg, 1081),
            scan_rate_hz,
            beam_time_s: step_deg / 360.0 / scan_rate_hz,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(first_deg: f64, step_deg: f64, beams: usize, direction: ScanDirection) -> ScanGeometry {
        let angles = ScanAngles {
            first_deg,
            step_deg,
            beams,
            direction,
        };
        ScanGeometry::new(angles, 10.0, None).expect("a valid scan")
    }

    fn all_around() -> ScanGeometry {
        scan(0.0, 0.25, 1440, ScanDirection::Ccw)
    }

    #[test]
    fn the_default_has_the_bits_of_the_formula_with_a_forward_beam() {
        let ust = ScanGeometry::default();
        let step = 0.25 * std::f64::consts::PI / 180.0;
        for beam in 0..ust.beams() {
            assert_eq!(
                ust.azimuth(beam).to_bits(),
                ((beam as f64 - 540.0) * step).to_bits()
            );
        }
        assert_eq!(ust.angles().first_deg, -135.0);
        assert_eq!(ust.step().to_bits(), step.to_bits());
        assert_eq!(
            ust.beam_time_s().to_bits(),
            (ust.scan_period_s() / 1440.0).to_bits()
        );
        assert_eq!(
            (ust.beam_time_s() * 1e6 / 1e6).to_bits(),
            ust.beam_time_s().to_bits()
        );
    }

    #[test]
    fn nearest_inverts_azimuth_for_every_beam() {
        for scan in [
            ScanGeometry::default(),
            scan(-120.0, 0.352, 682, ScanDirection::Ccw),
            scan(120.0, 0.352, 682, ScanDirection::Cw),
            all_around(),
            scan(180.0, 0.9, 400, ScanDirection::Cw),
        ] {
            for beam in 0..scan.beams() {
                for turn in [-1.0, 0.0, 1.0] {
                    let azimuth = scan.azimuth(beam) + turn * std::f64::consts::TAU;
                    assert_eq!(scan.nearest(azimuth), Some(beam), "{}", scan.angles());
                }
            }
            let outside = scan.azimuth(scan.beams() - 1) + scan.increment();
            assert_eq!(
                scan.nearest(outside),
                scan.closes().then_some(0),
                "{}",
                scan.angles()
            );
        }
        let ust = ScanGeometry::default();
        assert_eq!(ust.nearest(ust.azimuth(0) - ust.step()), None);
        assert_eq!(ust.nearest(f64::NAN), None);
    }

    #[test]
    fn clockwise_is_the_mirror_image() {
        let (ccw, cw) = (
            scan(-120.0, 0.352, 682, ScanDirection::Ccw),
            scan(120.0, 0.352, 682, ScanDirection::Cw),
        );
        for beam in 0..682 {
            assert_eq!(ccw.azimuth(beam), -cw.azimuth(beam));
            assert_eq!(ccw.time_of(beam), cw.time_of(beam));
        }
        assert_eq!(ccw.increment(), -cw.increment());
        assert_eq!(ccw.range_deg(), [-120.0, -120.0 + 0.352 * 681.0]);
    }

    #[test]
    fn the_ends_are_neighbors_if_the_scan_closes() {
        let around = all_around();
        assert!(around.closes() && !ScanGeometry::default().closes());
        assert_eq!(around.neighbors(0), [Some(1439), Some(1)]);
        assert_eq!(around.neighbors(1439), [Some(1438), Some(0)]);
        assert_eq!(ScanGeometry::default().neighbors(0), [None, Some(1)]);
        assert_eq!(ScanGeometry::default().neighbors(1080), [Some(1079), None]);
        assert_eq!((around.apart(1430, 5), around.apart(5, 1430)), (15, 15));
        assert_eq!(ScanGeometry::default().apart(1075, 5), 1070);
        // Half a step more or less than a turn still closes; a whole step does not.
        assert!(scan(0.0, 1.0, 360, ScanDirection::Ccw).closes());
        assert!(!scan(0.0, 1.0, 359, ScanDirection::Ccw).closes());
        assert!(scan(0.0, 0.9013, 399, ScanDirection::Ccw).closes());
    }

    #[test]
    fn runs_may_cross_the_seam() {
        let around = all_around();
        let over: Vec<usize> = around.run([1438, 1]).collect();
        assert_eq!(over, [1438, 1439, 0, 1]);
        assert_eq!(around.run([3, 5]).collect::<Vec<_>>(), [3, 4, 5]);
        assert!(around.holds([1438, 1], 1439) && !around.holds([1438, 1], 2));
        assert_eq!((around.length([1438, 1]), around.length([3, 5])), (3, 2));
        assert_eq!(around.beside([1438, 1], 4), 3);
        assert_eq!(around.beside([1438, 1], 1430), 8);
        assert_eq!(around.widened([1438, 1], 3), [1435, 4]);
        assert_eq!(around.widened([2, 10], 3), [1439, 13]);
        assert_eq!(around.widened([100, 90], 8), [0, 1439]);
        assert_eq!(ScanGeometry::default().widened([2, 1079], 3), [0, 1080]);
        assert_eq!(around.shortest_run(&[0, 1, 2, 1437, 1438]), Some([1437, 2]));
        assert_eq!(around.shortest_run(&[5, 6, 9]), Some([5, 9]));
        assert_eq!(around.shortest_run(&[7]), Some([7, 7]));
        assert_eq!(around.shortest_run(&[]), None);
        let ust = ScanGeometry::default();
        assert_eq!(ust.shortest_run(&[0, 1, 1080]), Some([0, 1080]));
        // If the scan does not close, nothing crosses its ends.
        assert_eq!((ust.run([1070, 4]).count(), ust.length([1070, 4])), (0, 0));
        assert!(!ust.holds([1070, 4], 2));
        assert_eq!(ust.run([1070, 2000]).count(), 11);
    }

    #[test]
    fn positions_along_a_run_continue_beyond_its_ends() {
        let around = all_around();
        for (beam, place) in [(1438, 0.0), (0, 2.0), (1, 3.0), (4, 6.0), (1430, -8.0)] {
            assert_eq!(around.along([1438, 1], beam), place, "beam {beam}");
        }
        assert_eq!(ScanGeometry::default().along([100, 200], 90), -10.0);
        assert_eq!(ScanGeometry::default().steps_in(2.5), 10);
        assert_eq!((around.steps_in(0.1), around.steps_in(0.0)), (1, 0));
    }

    #[test]
    fn impossible_scans_are_rejected() {
        let good = *ScanGeometry::default().angles();
        let key = |angles, rate, time| ScanGeometry::new(angles, rate, time).map_err(|e| e.key);
        assert_eq!(key(ScanAngles { beams: 0, ..good }, 40.0, None), Err("beams"));
        assert_eq!(
            key(ScanAngles { beams: 1441, ..good }, 40.0, None),
            Err("step_deg")
        );
        for step_deg in [0.0, -0.25, f64::NAN, f64::INFINITY] {
            assert_eq!(key(ScanAngles { step_deg, ..good }, 40.0, None), Err("step_deg"));
        }
        assert_eq!(
            key(
                ScanAngles {
                    first_deg: 400.0,
                    ..good
                },
                40.0,
                None
            ),
            Err("first_deg")
        );
        assert_eq!(key(good, 0.0, None), Err("scan_rate_hz"));
        assert_eq!(key(good, 40.0, Some(0.0)), Err("beam_time_us"));
        assert_eq!(key(good, 40.0, Some(25.0)), Err("beam_time_us"));
        assert_eq!(ScanGeometry::new(good, 40.0, None), Ok(ScanGeometry::default()));
        assert!(key(good, 40.0, Some(20.0)).is_ok());
    }

    #[test]
    fn angles_are_the_same_to_within_rounding() {
        let one = *scan(-120.0, 360.0 / 1024.0, 682, ScanDirection::Ccw).angles();
        let rounded = ScanAngles {
            step_deg: 0.3515625,
            ..one
        };
        assert!(one.same_as(&rounded));
        assert!(!one.same_as(&ScanAngles {
            step_deg: 0.352,
            ..one
        }));
        assert!(!one.same_as(&ScanAngles { beams: 683, ..one }));
        assert!(!one.same_as(&ScanAngles {
            direction: ScanDirection::Cw,
            ..one
        }));
        assert!(!one.same_as(&ScanAngles {
            first_deg: -119.9,
            ..one
        }));
    }
}
