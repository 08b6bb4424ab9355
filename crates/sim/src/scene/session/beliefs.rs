//! The believed errors, laid over those of the written session.

use super::over::{LieOver, overlay};
use catoptric_model::bias::{AngleBias, AngleTable, ColorBias, DistanceBias, RangeBias};
use catoptric_model::noise::Noise;
use catoptric_model::session::Beliefs;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

overlay! {
    /// The assumed errors. Standard deviations are 1σ.
    BeliefsOverlay over Beliefs {
        /// White noise of one reading, in millimeters. Given without `noise`, it holds at every distance and on every
        /// color.
        #[schemars(range(min = 0.0, max = 1000.0))]
        range_noise_sd_mm: f64,
        /// White noise of one reading over distance.
        noise: NoiseOverlay,
        /// The same on targets of some colors.
        noise_of: BTreeMap<String, NoiseOverlay>,
        /// Drift, constant over one pose, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        drift_sd_mm: f64,
        /// Error of one beam, constant over one pose, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        element_sd_mm: f64,
        /// Error of one marker coordinate, in millimeters.
        #[schemars(range(min = 0.0, max = 100.0))]
        marker_sd_mm: f64,
        /// The biases as characterized in step 1.
        bias: RangeBiasOverlay,
        /// Uncertainty of E_r at each node of its table, in millimeters.
        #[schemars(range(min = 0.0, max = 1000.0))]
        distance_bias_sd_mm: f64,
        /// Uncertainty of A_a, in millimeters.
        #[schemars(range(min = 0.0, max = 1000.0))]
        angle_gain_sd_mm: f64,
        /// Uncertainty of E_c, in millimeters.
        #[schemars(range(min = 0.0, max = 1000.0))]
        color_bias_sd_mm: f64,
    }
}

overlay! {
    /// Noise over distance.
    NoiseOverlay over Noise {
        /// Distances in meters, strictly increasing.
        #[schemars(length(min = 1), inner(range(min = 0.0, max = 10000.0)))]
        range_m: Vec<f64>,
        /// Standard deviations in millimeters at those distances.
        #[schemars(inner(range(min = 0.0, max = 1000.0)))]
        sd_mm: Vec<f64>,
    }
}

overlay! {
    /// Eqs. (3)–(5).
    RangeBiasOverlay over RangeBias {
        /// E_r.
        distance: DistanceBiasOverlay,
        /// E_a.
        angle: AngleBiasOverlay,
        /// E_c by color.
        color: BTreeMap<String, ColorBiasOverlay>,
    }
}

overlay! {
    /// E_r over distance.
    DistanceBiasOverlay over DistanceBias {
        /// Distances in meters, strictly increasing.
        #[schemars(inner(range(min = 0.0, max = 10000.0)))]
        range_m: Vec<f64>,
        /// Errors in millimeters at those distances.
        #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
        error_mm: Vec<f64>,
    }
}

overlay! {
    /// E_a = A_a·cos θ_N + B_a, and a table that is added to it.
    AngleBiasOverlay over AngleBias {
        /// A_a, in millimeters.
        #[schemars(range(min = -100000.0, max = 100000.0))]
        gain_mm: f64,
        /// B_a, in millimeters.
        #[schemars(range(min = -100000.0, max = 100000.0))]
        offset_mm: f64,
        /// The table.
        table: AngleTableOverlay,
    }
}

overlay! {
    /// E_a over incidence.
    AngleTableOverlay over AngleTable {
        /// Incidences in degrees, strictly increasing.
        #[schemars(length(min = 1), inner(range(min = 0.0, max = 90.0)))]
        incidence_deg: Vec<f64>,
        /// Errors in millimeters at those incidences.
        #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
        error_mm: Vec<f64>,
    }
}

overlay! {
    /// E_c = A_c·R + B_c.
    ColorBiasOverlay over ColorBias {
        /// A_c, in millimeters per meter.
        #[schemars(range(min = -100000.0, max = 100000.0))]
        slope_mm_per_m: f64,
        /// B_c, in millimeters.
        #[schemars(range(min = -100000.0, max = 100000.0))]
        offset_mm: f64,
    }
}
