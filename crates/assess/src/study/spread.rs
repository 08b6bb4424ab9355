//! Scatter of the angles of each element over the trials of a study, as in the paper's Figure 10.

use super::ElementAngles;
use catoptric_files::names::defused;
use std::collections::BTreeMap;

/// Header of `spread.csv`. Angles are in degrees.
const HEADER: [&str; 12] = [
    "cell",
    "method",
    "beam",
    "trials",
    "azimuth_mean_deg",
    "azimuth_sd_deg",
    "elevation_mean_deg",
    "elevation_sd_deg",
    "azimuth_error_mean_deg",
    "azimuth_error_sd_deg",
    "elevation_error_mean_deg",
    "elevation_error_sd_deg",
];

/// Statistics of θ_a and φ of one element by one contestant in one cell, over its trials, in degrees. Standard deviations
/// are those of a sample, and NaN for one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Index of the cell.
    pub cell: usize,
    /// Name of the contestant.
    pub method: String,
    /// Beam.
    pub beam: usize,
    /// Number of trials in which it was scored.
    pub trials: usize,
    /// Mean of the estimates.
    pub mean: [f64; 2],
    /// Their standard deviation.
    pub sd: [f64; 2],
    /// Mean error.
    pub error_mean: [f64; 2],
    /// Standard deviation of the error: equals that of the estimates if the mirror has the same pose in all trials.
    pub error_sd: [f64; 2],
}

/// Returns the spread of every element, ordered by cell, then by first appearance of the contestant, then by beam.
pub fn spread(elements: &[ElementAngles]) -> Vec<Spread> {
    let mut order: Vec<&str> = Vec::new();
    let mut groups: BTreeMap<(usize, usize, usize), Vec<&ElementAngles>> = BTreeMap::new();
    for e in elements {
        let place = order.iter().position(|m| *m == e.method).unwrap_or_else(|| {
            order.push(&e.method);
            order.len() - 1
        });
        groups.entry((e.cell, place, e.beam)).or_default().push(e);
    }
    let of_group = |((cell, place, beam), trials): ((usize, usize, usize), Vec<&ElementAngles>)| {
        // Azimuths are averaged relative to that of the first trial, so that there is no discontinuity at ±180°.
        let first = trials[0].estimate;
        let near_first = |e: &&ElementAngles| {
            let azimuth = e.estimate[0] - first[0];
            [
                first[0] + azimuth - 360.0 * (azimuth / 360.0).round(),
                e.estimate[1],
            ]
        };
        let (mean, sd) = moments(&trials.iter().map(near_first).collect::<Vec<_>>());
        let (error_mean, error_sd) = moments(&trials.iter().map(|e| e.error()).collect::<Vec<_>>());
        Spread {
            cell,
            method: order[place].to_owned(),
            beam,
            trials: trials.len(),
            mean,
            sd,
            error_mean,
            error_sd,
        }
    };
    groups.into_iter().map(of_group).collect()
}

/// Formats the table of spreads, `spread.csv`.
pub fn spread_to_csv(spreads: &[Spread]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Writing to memory cannot fail.
    let _ = writer.write_record(HEADER);
    let number = |x: f64| if x.is_nan() { String::new() } else { x.to_string() };
    for s in spreads {
        let mut row = vec![
            s.cell.to_string(),
            defused(&s.method).into_owned(),
            s.beam.to_string(),
            s.trials.to_string(),
        ];
        for (mean, sd) in [(s.mean, s.sd), (s.error_mean, s.error_sd)] {
            row.extend([0, 1].iter().flat_map(|i| [number(mean[*i]), number(sd[*i])]));
        }
        let _ = writer.write_record(row);
    }
    let bytes = writer.into_inner().unwrap_or_default();
    String::from_utf8(bytes).unwrap_or_default()
}

/// Mean and standard deviation of each component of some pairs.
fn moments(pairs: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let n = pairs.len() as f64;
    let mean = [0, 1].map(|i| pairs.iter().map(|p| p[i]).sum::<f64>() / n);
    let sd = [0, 1].map(|i| {
        let squares: f64 = pairs.iter().map(|p| (p[i] - mean[i]).powi(2)).sum();
        (squares / (n - 1.0)).sqrt()
    });
    (mean, sd)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_deviations_are_those_of_the_trials() {
        let element = |seed, azimuth: f64, elevation: f64| ElementAngles {
            cell: 0,
            seed,
            method: "beam".to_owned(),
            beam: 7,
            estimate: [azimuth, elevation],
            truth: [179.0, 40.0],
        };
        let found = spread(&[
            element(1, 179.0, 40.0),
            element(2, -179.0, 42.0),
            element(3, 180.0, 44.0),
        ]);
        assert_eq!(found.len(), 1);
        let s = &found[0];
        assert_eq!((s.beam, s.trials), (7, 3));
        // 179°, 181°, 180° and 40°, 42°, 44°.
        for (value, expected) in [
            (s.mean, [180.0, 42.0]),
            (s.sd, [1.0, 2.0]),
            (s.error_mean, [1.0, 2.0]),
            (s.error_sd, [1.0, 2.0]),
        ] {
            assert!(
                (0..2).all(|i| (value[i] - expected[i]).abs() < 1e-12),
                "{value:?}"
            );
        }
        let alone = spread(&[element(1, 179.0, 40.0)]);
        assert!(alone[0].sd[0].is_nan() && alone[0].error_mean == [0.0; 2]);
        let rows = spread_to_csv(&alone);
        assert!(rows.ends_with("0,beam,7,1,179,,40,,0,,0,\n"), "{rows}");
    }
}
