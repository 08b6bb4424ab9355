//! Is the spread of a beam's readings that of one beam on one surface? (Step 4: abnormal statistics.)

use catoptric_model::Summary;

/// Spread that whole-millimeter readings and an unstated color may add to any noise, in meters.
const SPREAD_FLOOR: f64 = 2e-3;

/// How much noisier than believed a good surface may be: black paper against white is a factor of 1.5 in Table 4.
const SURFACE_FACTOR: f64 = 2.0;

/// Standard errors by which a sample standard deviation may be off before it counts as different.
const SPREAD_SIGMAS: f64 = 5.0;

/// Largest sample standard deviation that still counts as noise, in meters.
///
/// The standard error of a sample standard deviation is σ/√(2(N − 1)).
pub(crate) fn largest_spread(believed_sd: f64, count: usize) -> f64 {
    SPREAD_FLOOR + SURFACE_FACTOR * believed_sd * (1.0 + SPREAD_SIGMAS * relative_error(count))
}

/// Whether a beam's readings spread more than noise explains.
pub(crate) fn is_abnormal(summary: &Summary, believed_sd: f64) -> bool {
    summary.count > 1 && summary.sd > largest_spread(believed_sd, summary.count)
}

/// Noise of one reading, in meters: the believed one, or the observed one if it is clearly larger.
pub(crate) fn noise_sd(summary: &Summary, believed_sd: f64) -> f64 {
    // Always taking the larger of the two would overestimate the noise whenever the sample happens to be larger.
    let limit = believed_sd * (1.0 + 3.0 * relative_error(summary.count));
    if summary.sd > limit {
        summary.sd
    } else {
        believed_sd
    }
}

/// Relative standard error of the standard deviation of N readings.
fn relative_error(count: usize) -> f64 {
    1.0 / (2.0 * (count.max(2) - 1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(sd: f64) -> Summary {
        Summary {
            count: 100,
            mean: 1.0,
            sd,
            ..Summary::default()
        }
    }

    #[test]
    fn black_paper_passes_and_a_split_beam_does_not() {
        assert!(!is_abnormal(&of(0.0061), 0.0041));
        assert!(is_abnormal(&of(0.030), 0.0041));
        assert!(!is_abnormal(&of(0.0), 0.0));
        assert!(is_abnormal(&of(0.005), 0.0));
    }

    #[test]
    fn clearly_larger_noise_is_believed() {
        assert_eq!(noise_sd(&of(0.0042), 0.0041), 0.0041);
        assert_eq!(noise_sd(&of(0.0061), 0.0041), 0.0061);
    }
}
