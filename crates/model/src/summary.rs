//! Statistics of one beam's readings over a stretch, with or without those that are of something else.

/// Standard deviations around the median that belong to the main body.
const WINDOW_SIGMAS: f64 = 5.0;

/// Half of the window at least, in meters: readings come in whole millimeters.
const LEAST_WINDOW: f64 = 2e-3;

/// Standard deviation of a normal variable over the median of its |x|.
const NORMAL_OVER_MEDIAN: f64 = 1.482_6;

/// Part of a beam's ranges that its main body needs at least.
const MAJORITY: f64 = 0.6;

/// Statistics of one beam over a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Summary {
    /// Readings that are ranges.
    pub count: usize,
    /// Readings that are not.
    pub missing: usize,
    /// Ranges that are left out of the rest, since they are plainly of something else.
    pub outliers: usize,
    /// Mean of the ranges, in meters; 0 without any.
    pub mean: f64,
    /// Sample standard deviation, in meters; 0 for fewer than two.
    pub sd: f64,
}

/// Number, mean and squares of ranges that are taken in one by one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// Ranges taken in.
    pub count: usize,
    /// Their mean, in meters; 0 without any.
    pub mean: f64,
    /// The sum of their squared deviations from it, in m².
    pub squares: f64,
}

/// The limits of the main body of some ranges, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// The least range that belongs to it.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Window {
    /// Five standard deviations, by the median deviation or as believed, around the median of the readings that are
    /// ranges; `None` if none is.
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

    /// Half the width of a window for noise of a standard deviation, in meters.
    pub fn half_width(noise_sd: f64) -> f64 {
        LEAST_WINDOW + WINDOW_SIGMAS * noise_sd
    }

    /// Whether a range belongs to it.
    pub fn holds(&self, range: f64) -> bool {
        (self.low..=self.high).contains(&range)
    }
}

impl Moments {
    /// Takes a range in, by Welford's recurrence: the naive sum of squares loses the noise under the range.
    pub fn add(&mut self, range: f64) {
        self.count += 1;
        let step = range - self.mean;
        self.mean += step / self.count as f64;
        self.squares += step * (range - self.mean);
    }

    /// The summary of the ranges that were taken in.
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
    /// Statistics of the main body of readings, all other ranges counted as outliers; `None` where no range is, or no
    /// majority of them is together.
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
