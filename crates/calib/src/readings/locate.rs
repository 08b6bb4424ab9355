//! Locates a beam's readings in one stretch when some of them are outliers.
//!
//! Another scanner's pulses, dust or a passer-by throw single readings far off, and the mean with them. Readings that
//! are all within noise are averaged as they are. Otherwise their main body is sought, from the median outward; it
//! represents the beam as long as no more readings are outside than for other beams. A beam that reads two surfaces
//! alternately has more outside, keeps its wide spread and is judged by that (step 4).

use crate::readings::columns::{self, MOST_BYTES, Wanted};
use crate::readings::spread;
use catoptric_model::{BeamStatistics, Dataset, PoseRecord, Summary, Unreadable, Window};
use rayon::prelude::*;

/// One beam in this many, those with the most readings outside, is ignored when the usual share is determined.
const LEFT_OUT: usize = 4;

/// Standard deviations by which the number of a beam's readings outside may exceed the usual one.
const USUAL_SIGMAS: f64 = 5.0;

/// Number of readings, and fraction of a beam's readings, that may be outside in any case.
const FREE: f64 = 3.0;
const FREE_PART: f64 = 0.05;

/// Statistics of every beam in every stretch: of its main body, where it has one beside outliers.
///
/// # Errors
/// [`Unreadable`] if the recording can no longer be read: beams with outliers are read again.
pub fn summaries(dataset: &Dataset) -> Result<Vec<Vec<Summary>>, Unreadable> {
    let noise = dataset.session.believed.range_noise_sd_mm * 1e-3;
    let plain: Vec<Vec<Summary>> = dataset.poses.par_iter().map(PoseRecord::summarize).collect();
    let wanted = dataset.poses.iter().enumerate().map(|(pose, record)| Wanted {
        pose,
        beams: strays(record, noise),
    });
    let wanted = wanted.filter(|w| !w.beams.is_empty()).collect();
    let main_body = |readings: &[f64]| Summary::of_main_body(readings.iter().copied(), noise);
    let mut robust: Vec<Vec<Option<Summary>>> = plain.iter().map(|p| vec![None; p.len()]).collect();
    for (pose, beam, found) in columns::of_each(dataset, wanted, MOST_BYTES, main_body)? {
        robust[pose][beam] = found;
    }
    let usual = usual_share(&plain, &robust);
    let choose = |(plain, robust): (Vec<Summary>, Vec<Option<Summary>>)| {
        let of_one = |(plain, robust): (Summary, Option<Summary>)| match robust {
            Some(found) if is_usual(&found, usual) && !spread::is_abnormal(&found, noise) => found,
            _ => plain,
        };
        plain.into_iter().zip(robust).map(of_one).collect()
    };
    Ok(plain.into_iter().zip(robust).map(choose).collect())
}

/// The readings of a beam without its outliers, where its summary leaves some out.
pub(crate) fn kept(readings: &[f64], summary: &Summary, noise: f64) -> Vec<f64> {
    let window = (summary.outliers > 0)
        .then(|| Window::around(readings.iter().copied(), noise))
        .flatten();
    let ranges = readings.iter().copied().filter(|r| r.is_finite());
    ranges.filter(|r| window.is_none_or(|w| w.holds(*r))).collect()
}

/// The beams of which some reading lies farther out than noise throws any, or all of them too far apart.
fn strays(record: &PoseRecord, noise: f64) -> Vec<usize> {
    let far = Window::half_width(spread::largest_spread(noise, usize::MAX));
    let is_stray = |of: &BeamStatistics| {
        let off = (of.largest - of.all.mean).max(of.all.mean - of.least);
        spread::is_abnormal(&of.summary(), noise) || of.all.count > 0 && off > far
    };
    let beams = record.readings.statistics().iter().enumerate();
    beams
        .filter(|(_, of)| is_stray(of))
        .map(|(beam, _)| beam)
        .collect()
}

/// The usual fraction of a beam's readings outside.
fn usual_share(plain: &[Vec<Summary>], robust: &[Vec<Option<Summary>>]) -> f64 {
    let pairs = plain.iter().flatten().zip(robust.iter().flatten());
    let mut shares: Vec<f64> = pairs
        .filter(|(plain, _)| plain.count > plain.missing)
        .map(|(plain, robust)| robust.map_or(0.0, |r| r.outliers as f64 / plain.count as f64))
        .collect();
    shares.sort_by(f64::total_cmp);
    let counted = shares.len() - shares.len() / LEFT_OUT;
    shares[..counted].iter().sum::<f64>() / counted.max(1) as f64
}

/// Whether the number of a beam's readings outside is within statistical fluctuation of the usual share.
fn is_usual(found: &Summary, usual: f64) -> bool {
    let n = (found.count + found.outliers) as f64;
    let free = FREE.min(FREE_PART * n);
    found.outliers as f64 <= n * usual + USUAL_SIGMAS * (n * usual * (1.0 - usual)).sqrt() + free
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::{Pose, PoseKind, PoseLabel, Readings};

    /// One stretch of some beams, each with its readings.
    fn record(beams: &[Vec<f64>]) -> PoseRecord {
        let scans = beams[0].len();
        PoseRecord {
            label: PoseLabel::of(0, PoseKind::Room, scans),
            room_from_rig: Pose::identity(),
            room_from_board: None,
            motion: None,
            watched: Vec::new(),
            readings: Readings::in_memory(
                beams.len(),
                (0..scans).flat_map(|s| beams.iter().map(move |b| b[s])).collect(),
            ),
        }
    }

    /// A hundred readings of 2 m with 4 mm of noise-like scatter, some of them off by ±0.3 m.
    fn readings(outliers: usize) -> Vec<f64> {
        let noise = |i: usize| 0.004 * (((i * 37) % 100) as f64 / 50.0 - 0.99) * 3.0_f64.sqrt();
        let step = |i: usize| if i.is_multiple_of(2) { 0.3 } else { -0.3 };
        (0..100)
            .map(|i| 2.0 + noise(i) + if i < outliers { step(i) } else { 0.0 })
            .collect()
    }

    #[test]
    fn the_main_body_of_readings_is_found() {
        let of = |outliers: usize| Summary::of_main_body(readings(outliers).into_iter(), 0.004);
        let found = of(15).expect("most readings are together");
        assert_eq!((found.count, found.outliers, found.missing), (85, 15, 0));
        // The mean of the same 85 readings without any outlier among them.
        let exact: f64 = readings(0)[15..].iter().sum::<f64>() / 85.0;
        assert!((found.mean - exact).abs() < 1e-12);
        assert_eq!(kept(&readings(15), &found, 0.004), readings(0)[15..].to_vec());
        let record = record(&[readings(15), readings(0), readings(45)]);
        assert_eq!(strays(&record, 0.004), [0, 2]);
        assert_eq!(of(45), None);
    }

    #[test]
    fn more_outliers_than_usual_are_detected() {
        let with = |outliers: usize| Summary {
            count: 100 - outliers,
            outliers,
            ..Summary::default()
        };
        assert!(is_usual(&with(3), 0.0) && !is_usual(&with(4), 0.0));
        assert!(is_usual(&with(30), 0.15) && !is_usual(&with(40), 0.15));
    }

    #[test]
    fn the_usual_share_is_that_of_most_beams() {
        let plain = vec![
            Summary {
                count: 100,
                ..Summary::default()
            };
            100
        ];
        let robust: Vec<Option<Summary>> = (0..100)
            .map(|beam| {
                let outliers = if beam < 80 { 10 } else { 40 };
                Some(Summary {
                    count: 100 - outliers,
                    outliers,
                    ..Summary::default()
                })
            })
            .collect();
        assert!((usual_share(&[plain], &[robust]) - 0.10).abs() < 1e-12);
    }
}
