//! How often a beam reads what is straight ahead of it: what an undeflected beam would have read, stretch by stretch.

use super::evidence::Screen;
use crate::readings::ahead::{AGREEMENT_FLOOR, ahead};
use crate::readings::jacobian;
use crate::readings::observations::{azimuth, cone_half_angle};
use crate::readings::spread;
use catoptric_model::{PoseKind, Summary, beam};
use nalgebra::Point3;

/// Share of the usable stretches in which a direct beam has to read what is straight ahead.
const DIRECT_SHARE: f64 = 0.9;

/// Gate on the difference of a range from its prediction, in standard deviations.
const AGREEMENT_SIGMAS: f64 = 6.0;

/// What an undeflected beam should have read in one stretch.
enum Expected {
    /// A range and its tolerance, both in meters.
    Range(f64, f64),
    /// An edge is inside the beam: no prediction.
    Unclear,
}

/// How often a beam read what is straight ahead.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) usable: usize,
    pub(super) agreeing: usize,
    rooms: usize,
    rooms_agreeing: usize,
    /// Stretches with a board in front of a mirror that may deflect it.
    own: usize,
    own_agreeing: usize,
    /// Expected and found range, in meters, of the stretch with the largest disagreement, and its number.
    pub(super) worst: Option<(f64, f64, usize)>,
    worst_off: f64,
}

impl Tally {
    /// Whether the beam agrees in every known room, in nearly every stretch, and in most of those in which a mirror
    /// would have shown it a board.
    ///
    /// The last condition decides: by coincidence a mirror may show a wall as far away as the one straight ahead, and
    /// does so again in every stretch with the board elsewhere.
    pub(super) fn is_direct(&self) -> bool {
        self.usable > 0
            && self.rooms_agreeing == self.rooms
            && self.agreeing as f64 >= DIRECT_SHARE * self.usable as f64
            && 2 * self.own_agreeing >= self.own
    }
}

impl Screen<'_> {
    /// Counts the stretches in which a beam agrees with what is straight ahead.
    pub(super) fn tally(&self, beam: usize, facets: &[usize]) -> Tally {
        let nearby: Vec<&str> = facets
            .iter()
            .map(|f| self.dataset.session.facets[*f].name.as_str())
            .collect();
        let mut tally = Tally::default();
        for (pose, record) in self.dataset.poses.iter().enumerate() {
            let summary = &self.summaries[pose][beam];
            if !record.label.kind.is_evidence() || summary.count <= summary.missing {
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
        let noise = spread::noise_sd(summary, beliefs.noise_sd(summary.mean, color));
        let variance = (row * self.mount * row.transpose())[0]
            + self
                .common
                .row(ahead.distance, cos_incidence, color)
                .norm_squared()
            + self.common.unlisted_variance(color)
            + (1e-3 * beliefs.drift_sd_mm).powi(2)
            + (1e-3 * beliefs.element_sd_mm).powi(2)
            + (1e-3 * beliefs.marker_sd_mm / cos_incidence).powi(2)
            + noise * noise / summary.count as f64;
        // On a sloping wall a beam of finite width is smeared over s·tan α·width; its mean shifts by a tenth of that.
        let tan = (1.0 / (cos_incidence * cos_incidence) - 1.0).max(0.0).sqrt();
        let smear = 0.1 * ahead.distance * tan * cone_half_angle(session);
        Expected::Range(
            ahead.distance + bias,
            AGREEMENT_FLOOR + smear + ahead.spread + AGREEMENT_SIGMAS * variance.sqrt(),
        )
    }
}
