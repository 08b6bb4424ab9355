//! Readings that are no ranges: beside the codes of REP-117, zero and whatever lies beyond the scanner's limits.
//!
//! Drivers report "no return" as infinity, NaN, 0, 65.533 m or a distance beyond the longest range. The limits are those of
//! the session and of the message, whichever are narrower.

use super::messages::single;
use catoptric_model::range::{INVALID, NO_RETURN, TOO_CLOSE};
use catoptric_model::session::ScannerSheet;

/// Shortest and longest range, in meters, as 32-bit numbers: readings are recorded as such.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    low: f64,
    high: f64,
}

/// How many readings of a recording were finite and yet no ranges.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Codes {
    readings: usize,
    zero: usize,
    below: usize,
    beyond: usize,
}

impl Limits {
    /// The narrower of the limits of a session and of a message; a message whose limits are both 0 states none.
    ///
    /// # Errors
    /// Limits of the message that no scanner has, as text.
    pub(super) fn of(scanner: &ScannerSheet, [low, high]: [f64; 2]) -> Result<Self, String> {
        let own = [scanner.range_min_m, scanner.range_max_m].map(|limit| f64::from(single(limit)));
        let [low, high] = match [low, high] {
            [0.0, 0.0] => own,
            // False for NaN; the longest range may be infinite.
            [low, high] if low >= 0.0 && low.is_finite() && high > low => [own[0].max(low), own[1].min(high)],
            [low, high] => {
                return Err(format!(
                    "range_min is {low} and range_max {high}; 0 or more and something larger are allowed, or 0 for both"
                ));
            }
        };
        Ok(Self { low, high })
    }
}

impl Codes {
    /// Replaces readings that are no ranges by codes of REP-117, and counts them.
    pub(super) fn replace(&mut self, ranges: &mut [f64], limits: Limits) {
        self.readings += ranges.len();
        for range in ranges {
            if !range.is_finite() || (limits.low..=limits.high).contains(range) {
                continue;
            }
            if *range == 0.0 {
                self.zero += 1;
                *range = INVALID;
            } else if *range < limits.low {
                self.below += 1;
                *range = TOO_CLOSE;
            } else {
                self.beyond += 1;
                *range = NO_RETURN;
            }
        }
    }

    /// What was found, if anything: a sentence.
    pub(super) fn words(&self) -> Option<String> {
        let kinds = [
            (self.zero, "0"),
            (self.below, "below the shortest range"),
            (self.beyond, "beyond the longest range"),
        ];
        let share = |count: usize| 100.0 * count as f64 / self.readings as f64;
        let found: Vec<String> = kinds
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{:.2} % of the readings ({count}) are {what}", share(*count)))
            .collect();
        (!found.is_empty()).then(|| format!("{}: they count as missing", found.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_no_scanner_has_are_refused() {
        let scanner = crate::tests::session(3).scanner;
        let [own_low, own_high] =
            [scanner.range_min_m, scanner.range_max_m].map(|limit| f64::from(single(limit)));
        let of = |limits| Limits::of(&scanner, limits).map(|l| [l.low, l.high]);
        assert_eq!(of([0.0, 0.0]), Ok([own_low, own_high]));
        assert_eq!(of([0.0, f64::INFINITY]), Ok([own_low, own_high]));
        assert_eq!(of([0.05, 20.0]), Ok([0.05, 20.0]));
        for [low, high] in [
            [f64::NAN, 20.0],
            [0.05, f64::NAN],
            [-0.05, 20.0],
            [20.0, 0.05],
            [1.0, 1.0],
            [f64::INFINITY, f64::INFINITY],
            [f64::NEG_INFINITY, 20.0],
        ] {
            let error = of([low, high]).expect_err("refused");
            assert!(
                error.starts_with(&format!("range_min is {low} and range_max {high};")),
                "{error}"
            );
        }
    }

    #[test]
    fn codes_are_no_ranges_and_limits_are_ranges() {
        let (low, high) = (f64::from(0.021_f32), 20.0);
        let mut ranges = [0.0, low, 1.5, high, 20.5, 65.533, 0.01, f64::INFINITY];
        let mut codes = Codes::default();
        codes.replace(&mut ranges, Limits { low, high });
        assert!(ranges[0].is_nan());
        assert_eq!(ranges[1..4], [low, 1.5, high]);
        assert_eq!(ranges[4..], [NO_RETURN, NO_RETURN, TOO_CLOSE, NO_RETURN]);
        let words = codes.words().expect("four of them are no ranges");
        assert!(words.contains("12.50 % of the readings (1) are 0") && words.contains("(2) are beyond"));
        assert_eq!(Codes::default().words(), None);
    }
}
