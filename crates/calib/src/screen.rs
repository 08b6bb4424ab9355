//! Which elements a mirror deflects (step 4): what each beam read in the known room and elsewhere, against what a beam
//! that no mirror touches would have read.

use crate::ahead::{AGREEMENT_FLOOR, ahead};
use crate::common::CommonErrors;
use crate::covariance::MountUncertainty;
use crate::jacobian;
use crate::observations::{BoardInSensor, azimuth, cone_half_angle};
use crate::pose::Mount;
use crate::spread;
use catoptric_model::session::NominalFacet;
use catoptric_model::{Dataset, Pose, PoseKind, PoseRecord, Summary, beam};
use nalgebra::Point3;

/// How many beams beyond the drawn ones a facet as built may serve.
///
/// At 65 mm a millimetre is 3.5 beams: an optical center a millimetre off in its housing, a facet half a millimetre and
/// 1° off in its frame, and posts that hide an edge on the drawing add up to several. Being generous costs nothing:
/// a beam that no mirror deflects is known by its readings, not by this.
pub const EDGE_BEAMS: usize = 10;

/// Share of the usable stretches in which a direct beam has to read what is in front of it.
const DIRECT_SHARE: f64 = 0.9;

/// Standard deviations within which a range agrees with its prediction.
const AGREEMENT_SIGMAS: f64 = 6.0;

/// A reading this near is of the structure around the sensor, in metres, wherever the mirrors are.
const STRUCTURE_RANGE: f64 = 0.12;

/// How far behind the farthest mirror point a reading is still of the structure, in metres.
const STRUCTURE_DEPTH: f64 = 0.03;

/// What screening makes of an element.
#[derive(Debug, Clone, PartialEq)]
pub enum Candidate {
    /// It reads what a beam without a mirror reads; the text says how often.
    Direct(String),
    /// A mirror may deflect it: indices of facets, the likeliest first.
    Deflected(Vec<usize>),
    /// Its readings are of no use, and why.
    Rejected(String),
}

/// What an undeflected beam should have read in one stretch.
enum Expected {
    /// This range, give or take this much, both in metres.
    Range(f64, f64),
    /// An edge lies in the beam: nothing can be said.
    Unclear,
}

/// The stretches of a dataset prepared for screening.
pub struct Screen<'a> {
    dataset: &'a Dataset,
    summaries: &'a [Vec<Summary>],
    mount: &'a MountUncertainty,
    common: CommonErrors<'a>,
    boards: &'a [Option<BoardInSensor>],
    rooms_from_sensor: Vec<Pose>,
}

impl<'a> Screen<'a> {
    /// Prepares the stretches; `boards` holds each pose's board in the sensor frame.
    pub fn new(
        dataset: &'a Dataset,
        summaries: &'a [Vec<Summary>],
        mount: &'a Mount,
        boards: &'a [Option<BoardInSensor>],
    ) -> Self {
        Self {
            dataset,
            summaries,
            mount: &mount.uncertainty,
            common: CommonErrors::of(&dataset.session),
            boards,
            rooms_from_sensor: dataset
                .poses
                .iter()
                .map(|p| p.room_from_rig * mount.rig_from_sensor)
                .collect(),
        }
    }

    /// The class of one element, from statistics alone.
    pub fn classify(&self, beam: usize) -> Candidate {
        let session = &self.dataset.session;
        let facets = facets_near(&session.facets, beam);
        let tally = self.tally(beam, &facets);
        if let Some(reason) = self.abnormal(beam, &facets) {
            return Candidate::Rejected(reason);
        }
        if tally.is_direct() {
            return Candidate::Direct(format!(
                "reads what is straight ahead in {} of {} stretches",
                tally.agreeing, tally.usable
            ));
        }
        if !facets.is_empty() {
            return Candidate::Deflected(facets);
        }
        Candidate::Rejected(match tally.worst {
            Some((expected, found, stretch)) => format!(
                "no mirror is drawn for it, yet it reads what is straight ahead in only {} of {} stretches: \
                 expected {expected:.3} m in stretch {stretch}, found {found:.3} m",
                tally.agreeing, tally.usable
            ),
            None => "no mirror is drawn for it and no stretch shows what it reads".to_owned(),
        })
    }

    /// Numbers that no good beam shows, in words.
    fn abnormal(&self, beam: usize, facets: &[usize]) -> Option<String> {
        let session = &self.dataset.session;
        let noise = session.believed.range_noise_sd_mm * 1e-3;
        let mut seen: Vec<&Summary> = Vec::new();
        let (mut count, mut missing, mut close, mut structure) = (0, 0, 0, 0);
        let nearest = self.structure_limit(beam, facets);
        for (record, summary) in self.screened() {
            let summary = &summary[beam];
            count += summary.count;
            missing += summary.missing;
            if summary.missing > 0 {
                close += record.readings(beam).filter(|r| *r == f64::NEG_INFINITY).count();
            }
            if summary.count > summary.missing {
                seen.push(summary);
                structure += usize::from(summary.mean < nearest);
            }
        }
        let total = count + missing;
        if 2 * close > total {
            return Some(format!("too close in {close} of {total} readings"));
        }
        if seen.is_empty() {
            return Some(format!("no return in {missing} of {total} readings"));
        }
        if 2 * structure > seen.len() {
            return Some(format!(
                "reads the structure: below {nearest:.3} m in {structure} of {} stretches",
                seen.len()
            ));
        }
        let room = self
            .screened()
            .filter(|(record, _)| record.label.kind == PoseKind::Room);
        for (_, summary) in room {
            let summary = &summary[beam];
            if spread::is_abnormal(summary, noise) {
                return Some(format!(
                    "abnormal spread in the known room: standard deviation {:.1} mm of {} readings, at most {:.1} mm \
                     expected",
                    1e3 * summary.sd,
                    summary.count,
                    1e3 * spread::largest_spread(noise, summary.count)
                ));
            }
        }
        None
    }

    /// Range below which a reading is of the structure, in metres.
    fn structure_limit(&self, beam: usize, facets: &[usize]) -> f64 {
        let session = &self.dataset.session;
        let u = beam::direction(azimuth(session, beam));
        let origin = Point3::origin();
        facets
            .iter()
            .filter_map(|f| session.facets[*f].plane()?.distance_along(&origin, &u))
            .map(|d| d + STRUCTURE_DEPTH)
            // Beyond its own polygon a facet's plane runs off to anywhere; mirrors stand within a hand of the sensor.
            .filter(|d| *d < 3.0 * STRUCTURE_RANGE)
            .fold(STRUCTURE_RANGE, f64::max)
    }

    /// All stretches with the mirrors on, with their statistics.
    fn screened(&self) -> impl Iterator<Item = (&'a PoseRecord, &'a Vec<Summary>)> {
        self.dataset
            .poses
            .iter()
            .zip(self.summaries)
            .filter(|(record, _)| record.label.kind != PoseKind::Bare)
    }

    fn tally(&self, beam: usize, facets: &[usize]) -> Tally {
        let nearby: Vec<&str> = facets
            .iter()
            .map(|f| self.dataset.session.facets[*f].name.as_str())
            .collect();
        let mut tally = Tally::default();
        for (pose, record) in self.dataset.poses.iter().enumerate() {
            let summary = &self.summaries[pose][beam];
            if record.label.kind == PoseKind::Bare || summary.count <= summary.missing {
                continue;
            }
            let Expected::Range(expected, tolerance) = self.expected(pose, beam, summary) else {
                continue;
            };
            let agrees = (summary.mean - expected).abs() <= tolerance;
            tally.usable += 1;
            tally.agreeing += usize::from(agrees);
            if record.label.kind == PoseKind::Room {
                tally.rooms += 1;
                tally.rooms_agreeing += usize::from(agrees);
            }
            if record
                .label
                .facet
                .as_deref()
                .is_some_and(|name| nearby.contains(&name))
            {
                tally.own += 1;
                tally.own_agreeing += usize::from(agrees);
            }
            let off = (summary.mean - expected).abs() - tolerance;
            if off > tally.worst_off {
                tally.worst_off = off;
                tally.worst = Some((expected, summary.mean, record.label.pose));
            }
        }
        tally
    }

    /// The raw range an undeflected beam would have read.
    fn expected(&self, pose: usize, beam: usize, summary: &Summary) -> Expected {
        let session = &self.dataset.session;
        let u = beam::direction(azimuth(session, beam));
        let ahead = ahead(
            session,
            &self.rooms_from_sensor[pose],
            self.boards[pose].as_ref(),
            &Point3::origin(),
            &u,
        );
        let Some((ahead, color)) = ahead else {
            return Expected::Unclear;
        };
        if ahead.spread.is_infinite() || ahead.distance > session.scanner.range_max_m {
            return Expected::Unclear;
        }
        let beliefs = &session.believed;
        let cos_incidence = ahead.plane.cos_incidence(&u);
        let bias = beliefs.bias.terms(ahead.distance, cos_incidence, color).total();
        let hit = Point3::origin() + u.into_inner() * ahead.distance;
        let row = jacobian::of_mount(&hit, &ahead.plane.normal, &u);
        let noise = spread::noise_sd(summary, beliefs.range_noise_sd_mm * 1e-3);
        let variance = (row * self.mount.total() * row.transpose())[0]
            + self
                .common
                .row(ahead.distance, cos_incidence, color)
                .norm_squared()
            + self.common.unlisted_variance(color)
            + (1e-3 * beliefs.drift_sd_mm).powi(2)
            + (1e-3 * beliefs.marker_sd_mm / cos_incidence).powi(2)
            + noise * noise / summary.count as f64;
        // A beam of finite width on a sloping wall is smeared over s·tan α·width; its mean moves by a tenth of that.
        let tan = (1.0 / (cos_incidence * cos_incidence) - 1.0).max(0.0).sqrt();
        let smear = 0.1 * ahead.distance * tan * cone_half_angle(session);
        Expected::Range(
            ahead.distance + bias,
            AGREEMENT_FLOOR + smear + ahead.spread + AGREEMENT_SIGMAS * variance.sqrt(),
        )
    }
}

/// How often a beam read what is straight ahead.
#[derive(Default)]
struct Tally {
    usable: usize,
    agreeing: usize,
    rooms: usize,
    rooms_agreeing: usize,
    /// Stretches with a board before a mirror that may deflect it.
    own: usize,
    own_agreeing: usize,
    /// Expected and found range, in metres, of the stretch with the largest disagreement, and its number.
    worst: Option<(f64, f64, usize)>,
    worst_off: f64,
}

impl Tally {
    /// Every known room, nearly every stretch, and most of those in which a mirror would have shown it a board.
    ///
    /// The last are what counts: a mirror may by chance show a wall as far away as the one ahead, and does so again
    /// in every stretch whose board stands elsewhere.
    fn is_direct(&self) -> bool {
        self.usable > 0
            && self.rooms_agreeing == self.rooms
            && self.agreeing as f64 >= DIRECT_SHARE * self.usable as f64
            && 2 * self.own_agreeing >= self.own
    }
}

/// The facets whose drawn range of beams is at most [`EDGE_BEAMS`] away, the nearest first.
pub fn facets_near(facets: &[NominalFacet], beam: usize) -> Vec<usize> {
    let mut near: Vec<(usize, usize)> = facets
        .iter()
        .enumerate()
        .map(|(i, f)| {
            let below = f.beams[0].saturating_sub(beam);
            let above = beam.saturating_sub(f.beams[1]);
            (below.max(above), i)
        })
        .filter(|(away, _)| *away <= EDGE_BEAMS)
        .collect();
    near.sort_unstable();
    near.into_iter().map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(first: usize, last: usize) -> NominalFacet {
        NominalFacet {
            name: String::new(),
            corners_mm: Vec::new(),
            beams: [first, last],
        }
    }

    #[test]
    fn an_edge_beam_may_belong_to_either_neighbor() {
        let facets = [facet(100, 200), facet(204, 300)];
        assert_eq!(facets_near(&facets, 150), [0]);
        assert_eq!(facets_near(&facets, 203), [1, 0]);
        assert_eq!(facets_near(&facets, 100 - EDGE_BEAMS), [0]);
        assert!(facets_near(&facets, 99 - EDGE_BEAMS).is_empty());
    }
}
