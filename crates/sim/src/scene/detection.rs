//! From received light to a range: which principle, which detector, which echo.

use super::omit::{is_default, is_zero};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

catoptric_model::closed_set! {
    /// What the time of flight is measured from.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum Principle {
        /// A short pulse.
        #[default]
        Pulsed,
        /// The phase of light whose amplitude is modulated: one range per beam, ambiguous by c/2f.
        Phase,
    }
}

catoptric_model::closed_set! {
    /// Which point of an echo is taken for the range.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum Detector {
        /// Where it rises through a fixed threshold: a weaker pulse reads longer.
        #[default]
        LeadingEdge,
        /// Where it rises through a fraction of its own height.
        ConstantFraction,
        /// Its highest point, or the middle of a top that is clipped by saturation.
        Peak,
        /// Its centroid.
        Centroid,
    }
}

catoptric_model::closed_set! {
    /// Which of a beam's echoes is reported.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    pub enum EchoChoice {
        /// The nearest.
        #[default]
        First,
        /// The highest.
        Strongest,
        /// The farthest.
        Last,
        /// The nearest in `/scan`, and every echo that the scanner can report in `/echoes`.
        All,
    }
}

/// From received light to a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Detection {
    /// What the time of flight is measured from.
    pub principle: Principle,
    /// Which point of an echo is taken for the range; pulsed light only.
    pub detector: Detector,
    /// Fraction of its own height at which `constant_fraction` takes an echo (assumed).
    #[schemars(range(min = 0.01, max = 0.99))]
    pub fraction: f64,
    /// Which echo is reported; pulsed light only.
    pub echo: EchoChoice,
    /// Full width at half maximum of the pulse, in nanoseconds (assumed; 3 to 5 are plausible).
    #[schemars(range(min = 0.1, max = 100.0))]
    pub pulse_fwhm_ns: f64,
    /// Frequency of the amplitude modulation, in hertz (assumed); ranges repeat every c/2f, 15 m at 10 MHz.
    #[schemars(range(min = 1e5, max = 1e9))]
    pub modulation_hz: f64,
    /// Reflectivity of a face-on target that is just detected at `threshold_range_m` (data sheet: 0.1).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub threshold_reflectivity: f64,
    /// Range at which that target is just detected, in meters (data sheet: 8).
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub threshold_range_m: f64,
    /// Range of the face-on white target at which the walk of the detector is calibrated out, in meters.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub reference_range_m: f64,
    /// Share of the walk, by which weaker echoes read longer, that the device itself takes out; 1 leaves none, and the
    /// error models without the detector's own errors have none.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub walk_compensated: f64,
    /// Height above which the receiver clips an echo, in units of the threshold; 0 for a receiver that never clips.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub saturation_over_threshold: f64,
    /// Noise-equivalent power, 1σ, in units of the threshold: an echo of height A is detected with the probability
    /// Φ((A − V)/σ); 0 for a sharp threshold.
    #[schemars(range(min = 0.0, max = 0.2))]
    pub noise_over_threshold: f64,
    /// Number of neighboring beams, an odd one, whose median the scanner reports in `/scan` instead of a reading; 0 if it
    /// does not smooth. A code stays one, and others do not count.
    #[serde(skip_serializing_if = "is_default")]
    #[schemars(range(min = 0, max = 31))]
    pub median_of_beams: u32,
    /// The intensities that the scanner reports with its ranges; without this table it reports none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intensity: Option<Intensity>,
}

/// Received power as a scanner reports it, in whole counts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Intensity {
    /// Counts of an echo that is just detected; others are in proportion to their power (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub counts_at_threshold: f64,
    /// Largest number that is reported (assumed: 16 bits).
    #[schemars(range(min = 1.0, max = 16777216.0))]
    pub largest: f64,
    /// Noise of one intensity, 1σ, as a share of it; the echoes of a reading have the same.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub noise_share: f64,
}

impl Default for Intensity {
    fn default() -> Self {
        Self {
            counts_at_threshold: 10.0,
            largest: 65535.0,
            noise_share: 0.0,
        }
    }
}

impl Default for Detection {
    fn default() -> Self {
        Self {
            principle: Principle::Pulsed,
            detector: Detector::LeadingEdge,
            fraction: 0.5,
            echo: EchoChoice::First,
            pulse_fwhm_ns: 4.0,
            modulation_hz: 1e7,
            threshold_reflectivity: 0.1,
            threshold_range_m: 8.0,
            reference_range_m: 2.0,
            walk_compensated: 0.0,
            saturation_over_threshold: 0.0,
            noise_over_threshold: 0.0,
            median_of_beams: 0,
            intensity: None,
        }
    }
}
