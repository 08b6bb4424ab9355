//! Statistics of one beam's readings over a stretch, with or without outliers.

/// Half-width of the main body around the median, in standard deviations.
const WINDOW_SIGMAS: f64 = 5.0;

/// Minimum half-width of the window, in meters: readings are whole millimeters.
const LEAST_WINDOW: f64 = 2e-3;

/// Ratio of the standard deviation of a normal variable to the median of its |x|.
const NORMAL_OVER_MEDIAN: f64 = 1.482_6;

/// Minimum fraction of a beam's ranges in its main body.
const MAJORITY: f64 = 0.6;

/// Statistics of one beam over a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    /// Number of readings that are ranges.
    pub count: usize,
    /// Number of readings that are not.
    pub missing: usize,
    /// Number of ranges excluded from the statistics as clear outliers.
    pub outliers: usize,
    /// Mean of the ranges, in meters; 0 without any.
    pub mean: f64,
    /// Sample standard deviation, in meters; 0 for fewer than two.
    pub sd: f64,
}

/// Count, mean and sum of squares of ranges that are added one at a time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Number of ranges added.
    pub count: usize,
    /// Their mean, in meters; 0 without any.
    pub mean: f64,
    /// The sum of their squared deviations from it, in m².
    pub squares: f64,
}

/// The limits of the main body of a set of ranges, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Smallest range in it.
    pub low: f64,
    /// Largest range in it.
    pub high: f64,
}

impl Window {
    /// Five standard deviations, from the median deviation or as assumed, around the median of the readings that are
    /// ranges; `None` if there are no ranges.
    pub fn around(readings: impl Iterator<Item = f64>, noise_sd: f64) -> Option<Self> {
        let mut ranges: Vec<f64> = readings.filter(|r| r.is_finite()).collect();
        let middle = median(&mut ranges)?;
        for r in &mut ranges {
            *r = (*r - middle).abs();
        }
        let sd = (NORMAL_OVER_MEDIAN * median(&mut ranges)?).max(noise_sd);
        let half = Self::half_width(sd);
        Some(Self {
            low: middle - half,
            high: middle + half,
        })
    }

    /// Half-width of the window for noise of a given standard deviation, in meters.
    pub fn half_width(noise_sd: f64) -> f64 {
        LEAST_WINDOW + WINDOW_SIGMAS * noise_sd
    }

    /// Whether a range is within the limits.
    pub fn holds(&self, range: f64) -> bool {
        (self.low..=self.high).contains(&range)
    }
}

impl Moments {
    /// Adds a range by Welford's recurrence: the naive sum of squares would lose the noise to rounding.
    pub fn add(&mut self, range: f64) {
        self.count += 1;
        let step = range - self.mean;
        self.mean += step / self.count as f64;
        self.squares += step * (range - self.mean);
    }

    /// The summary of the ranges added.
    pub fn summary(&self) -> Summary {
        let sd = if self.count > 1 {
            (self.squares / (self.count - 1) as f64).sqrt()
        } else {
            0.0
        };
        Summary {
            count: self.count,
            mean: self.mean,
            sd,
            ..Summary::default()
        }
    }
}

impl Summary {
    /// Statistics of the main body of readings; all other ranges count as outliers. `None` if there are no ranges, or
    /// if no majority of them is close together.
    ///
    /// ```
    /// use catoptric_model::Summary;
    ///
    /// let readings = [2.001, 1.999, 2.0, 2.3, 2.0, f64::INFINITY];
    /// let found = Summary::of_main_body(readings.into_iter(), 0.004).expect("most are at 2 m");
    /// assert_eq!((found.count, found.outliers, found.missing), (4, 1, 1));
    /// assert!((found.mean - 2.0).abs() < 1e-12);
    /// ```
    pub fn of_main_body(readings: impl Iterator<Item = f64> + Clone, noise_sd: f64) -> Option<Self> {
        let window = Window::around(readings.clone(), noise_sd)?;
        let (mut body, mut missing, mut outliers) = (Moments::default(), 0, 0);
        for r in readings {
            if !r.is_finite() {
                missing += 1;
            } else if window.holds(r) {
                body.add(r);
            } else {
                outliers += 1;
            }
        }
        let all = (body.count + outliers) as f64;
        (body.count as f64 >= MAJORITY * all).then(|| Self {
            missing,
            outliers,
            ..body.summary()
        })
    }
}

fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}
