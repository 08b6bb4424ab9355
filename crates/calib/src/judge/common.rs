//! Errors of the believed biases, shared by all boards and the mounting.

use catoptric_model::{RangeBias, Session};
use nalgebra::RowDVector;

/// Color of the bare structure, which no board has.
const STRUCTURE: &str = "structure";

/// The uncertain numbers behind E_r, E_a and E_c, each with its standard deviation: the nodes of the distance table,
/// then A_a, then E_c of each color of a board, and last the drift while the bare structure was ranged, if the scanner
/// itself ranged it.
#[derive(Debug, Clone, PartialEq)]
pub struct CommonErrors<'a> {
    session: &'a Session,
    colors: Vec<&'a str>,
}

impl<'a> CommonErrors<'a> {
    /// The uncertain numbers of a session.
    pub fn of(session: &'a Session) -> Self {
        let mut colors: Vec<&str> = session.boards.iter().map(|b| b.color.as_str()).collect();
        colors.sort_unstable();
        colors.dedup();
        Self { session, colors }
    }

    /// Colors of the boards, sorted.
    pub fn colors(&self) -> &[&'a str] {
        &self.colors
    }

    /// Number of them.
    pub(crate) fn len(&self) -> usize {
        let drift = usize::from(self.session.bare_structure.scanned);
        self.session.believed.bias.distance.range_m.len() + 1 + self.colors.len() + drift
    }

    /// Error of a corrected range per standard deviation of each number, in meters.
    ///
    /// A_a is uncertain with A_a + B_a, the error at normal incidence, held fixed: its column is cos θ_N − 1.
    pub fn row(&self, range: f64, cos_incidence: f64, color: &str) -> RowDVector<f64> {
        let mut row = RowDVector::zeros(self.len());
        for (number, error) in self.entries(range, cos_incidence, self.place(color)) {
            row[number] += error;
        }
        row
    }

    /// Index of a board's color among the numbers.
    pub(crate) fn place(&self, color: &str) -> Option<usize> {
        let place = self.colors.iter().position(|c| *c == color)?;
        Some(self.session.believed.bias.distance.range_m.len() + 1 + place)
    }

    /// The numbers that change a range, each with its error as in [`row`](Self::row); entries with the same index add
    /// up.
    pub(crate) fn entries(&self, range: f64, cos_incidence: f64, color: Option<usize>) -> [(usize, f64); 4] {
        let beliefs = &self.session.believed;
        let nodes = beliefs.bias.distance.range_m.len();
        let [below, above] = beliefs
            .bias
            .distance
            .weights(range)
            .map(|(node, weight)| (node, weight * beliefs.distance_bias_sd_mm * 1e-3));
        let gain = (cos_incidence - 1.0) * beliefs.angle_gain_sd_mm * 1e-3;
        let color = color.map_or((nodes, 0.0), |place| (place, beliefs.color_bias_sd_mm * 1e-3));
        [below, above, (nodes, gain), color]
    }

    /// Error of a bare distance per standard deviation of each number, in meters, for a distance that the scanner
    /// ranged and the believed biases corrected.
    pub(crate) fn bare_row(&self, distance: f64, cos_incidence: f64) -> RowDVector<f64> {
        if !self.session.bare_structure.scanned {
            return RowDVector::zeros(self.len());
        }
        let mut row = self.row(distance, cos_incidence, STRUCTURE);
        let last = self.len() - 1;
        row[last] = self.session.believed.drift_sd_mm * 1e-3;
        row
    }

    /// Standard deviation of a bare distance from all other errors that the beams of a facet share, and the facets do
    /// not, in meters.
    pub(crate) fn bare_sd(&self, distance: f64, cos_incidence: f64) -> f64 {
        let whole = self.session.bare_structure.distance_sd_mm * 1e-3;
        let shared = self.bare_row(distance, cos_incidence).norm_squared();
        (whole * whole - shared).max(0.0).sqrt()
    }

    /// Name of each number, and its standard deviation in the unit of that name.
    pub fn named(&self) -> Vec<(String, f64)> {
        let beliefs = &self.session.believed;
        let nodes = beliefs.bias.distance.range_m.iter();
        let nodes = nodes.map(|range| (format!("E_r at {range} m (mm)"), beliefs.distance_bias_sd_mm));
        let gain = ("A_a (mm)".to_owned(), beliefs.angle_gain_sd_mm);
        let colors = self.colors.iter();
        let colors = colors.map(|color| (format!("E_c of {color} (mm)"), beliefs.color_bias_sd_mm));
        let drift = beliefs.drift_sd_mm;
        let bare = (self.session.bare_structure.scanned)
            .then(|| ("drift at the bare structure (mm)".to_owned(), drift));
        nodes.chain([gain]).chain(colors).chain(bare).collect()
    }

    /// The believed biases, changed by a given number of standard deviations for each number.
    pub(crate) fn applied(&self, deviations: &[f64]) -> RangeBias {
        let beliefs = &self.session.believed;
        let mut bias = beliefs.bias.clone();
        let nodes = bias.distance.range_m.len();
        for (node, deviation) in bias.distance.error_mm.iter_mut().zip(deviations) {
            *node += beliefs.distance_bias_sd_mm * deviation;
        }
        if let Some(deviation) = deviations.get(nodes) {
            bias.angle.gain_mm += beliefs.angle_gain_sd_mm * deviation;
            bias.angle.offset_mm -= beliefs.angle_gain_sd_mm * deviation;
        }
        for (color, deviation) in self.colors.iter().zip(deviations.iter().skip(nodes + 1)) {
            let change = beliefs.color_bias_sd_mm * deviation;
            if change != 0.0 {
                bias.color.entry((*color).to_owned()).or_default().offset_mm += change;
            }
        }
        bias
    }

    /// Variance of E_c for a color that no board of the session has, in square meters; zero for a listed color.
    pub(crate) fn unlisted_variance(&self, color: &str) -> f64 {
        if self.colors.contains(&color) {
            0.0
        } else {
            (self.session.believed.color_bias_sd_mm * 1e-3).powi(2)
        }
    }
}
