//! A cloud as a page shows it: some of its points, and the extent of all.

use super::{CloudSheet, Lift};
use catoptric_model::{CloudPoint, Unreadable};

/// How many points a beam has in a cloud, and how far they reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Number of points.
    pub points: usize,
    /// Least x, y and z, in meters; NaN without points.
    pub low: [f64; 3],
    /// Largest x, y and z, in meters.
    pub high: [f64; 3],
}

/// A cloud in memory that does not grow with the scans it is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudSketch {
    /// What is known of the cloud.
    pub sheet: CloudSheet,
    /// One scan in this many is drawn: whole scans, as every n-th point would favor some beams.
    pub step: usize,
    /// The points of these scans.
    pub drawn: Vec<CloudPoint>,
    /// The extent of each beam's points, of all scans.
    pub beams: Vec<Extent>,
}

impl Extent {
    /// Of no point.
    pub const NONE: Self = Self {
        points: 0,
        low: [f64::NAN; 3],
        high: [f64::NAN; 3],
    };

    /// Of these points and those.
    #[must_use]
    pub fn with(self, other: &Self) -> Self {
        let each = |pick: fn(f64, f64) -> f64, a: [f64; 3], b: [f64; 3]| {
            std::array::from_fn(|axis| pick(a[axis], b[axis]))
        };
        Self {
            points: self.points + other.points,
            low: each(f64::min, self.low, other.low),
            high: each(f64::max, self.high, other.high),
        }
    }
}

impl CloudSketch {
    /// A sketch of the cloud of a stretch, with about this many points at most.
    ///
    /// # Errors
    /// [`Unreadable`] if the readings are there no more.
    pub fn of(lift: &Lift<'_>, most_points: usize) -> Result<Self, Unreadable> {
        let mut sketch = Self {
            sheet: lift.sheet,
            step: lift.sheet.points.div_ceil(most_points).max(1),
            drawn: Vec::new(),
            beams: vec![Extent::NONE; lift.deflections.len()],
        };
        lift.each(|point| {
            let at = point.position.coords.into();
            let beam = &mut sketch.beams[point.beam];
            *beam = beam.with(&Extent {
                points: 1,
                low: at,
                high: at,
            });
            if point.scan % sketch.step == 0 {
                sketch.drawn.push(point);
            }
            Ok::<_, Unreadable>(())
        })?;
        Ok(sketch)
    }
}
