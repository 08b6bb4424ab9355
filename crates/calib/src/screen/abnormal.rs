//! Statistics that no good beam shows: no return, too close, on the structure, or spread too far in the known room.

use super::evidence::Screen;
use crate::readings::observations::azimuth;
use crate::readings::spread;
use catoptric_model::{PoseKind, Summary, beam};
use nalgebra::Point3;

/// Range below which a reading is of the structure around the sensor, in meters, wherever the mirrors are.
const STRUCTURE_RANGE: f64 = 0.12;

/// Distance behind the farthest mirror point up to which a reading is of the structure, in meters.
const STRUCTURE_DEPTH: f64 = 0.03;

impl Screen<'_> {
    /// Describes statistics that no good beam shows.
    pub(super) fn abnormal(&self, beam: usize, facets: &[usize]) -> Option<String> {
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
                close += record.readings.statistics()[beam].too_close;
            }
            if summary.count > summary.missing {
                seen.push(summary);
                structure += usize::from(summary.mean < nearest);
            }
        }
        let total = count + missing;
        if total == 0 {
            return Some("no reading of the room or of a board".to_owned());
        }
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

    /// Range below which a reading is of the structure, in meters.
    fn structure_limit(&self, beam: usize, facets: &[usize]) -> f64 {
        let session = &self.dataset.session;
        let u = beam::direction(azimuth(session, beam));
        let origin = Point3::origin();
        facets
            .iter()
            .filter_map(|f| session.facets[*f].plane()?.distance_along(&origin, &u))
            .map(|d| d + STRUCTURE_DEPTH)
            // Outside its own polygon a facet's plane extends arbitrarily far; mirrors are within a hand's width of the
            // sensor.
            .filter(|d| *d < 3.0 * STRUCTURE_RANGE)
            .fold(STRUCTURE_RANGE, f64::max)
    }
}
