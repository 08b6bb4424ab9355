//! Which numbers of Eqs. (3)–(5) the boards determine, and how each of them changes a range.

use catoptric_model::bias::interpolation_weights;
use catoptric_model::characterization::{NotObserved, StretchRow};
use catoptric_model::{AngleBias, ColorBias, DistanceBias, RangeBias, Session, TestKind};
use nalgebra::{DVector, RowDVector};
use std::collections::BTreeMap;

/// Distances closer to each other than this are one node of E_r, in meters.
const SAME_DISTANCE: f64 = 0.01;

/// Minimum spread of cos θ_N over all boards that determines A_a: boards within 11° of normal incidence do not.
const MIN_COSINE_SPREAD: f64 = 0.02;

/// Minimum spread of a color's distances, relative to the largest, that determines A_c.
const MIN_DISTANCE_SPREAD: f64 = 0.2;

/// Factor by which the fan reads a board closer and farther than its center.
const FAN_ROOM: f64 = 1.25;

/// A number to be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Term {
    /// E_r at a node.
    Distance(usize),
    /// A_a.
    AngleGain,
    /// B_a.
    AngleOffset,
    /// E_a minus a law held fixed, at a node of incidences.
    AngleNode(usize),
    /// A_c of a color.
    ColorSlope(usize),
    /// B_c of a color.
    ColorOffset(usize),
}

impl Term {
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Distance(_) => "E_r",
            Self::AngleGain => "A_a",
            Self::AngleOffset => "B_a",
            Self::AngleNode(_) => "E_a",
            Self::ColorSlope(_) => "A_c",
            Self::ColorOffset(_) => "B_c",
        }
    }

    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::ColorSlope(_) => "mm/m",
            _ => "mm",
        }
    }
}

/// The numbers to be fitted, in millimeters and meters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Design {
    /// Distances of E_r; the first terms are its values there.
    pub(super) nodes: Vec<f64>,
    /// Incidences of the table that is added to `held`, in degrees.
    pub(super) incidences: Vec<f64>,
    /// A law of E_a that is not fitted.
    pub(super) held: AngleBias,
    pub(super) terms: Vec<Term>,
    /// Colors with terms of their own.
    pub(super) colors: Vec<String>,
    pub(super) omitted: Vec<NotObserved>,
}

impl Design {
    /// The numbers that the boards of these rows determine.
    pub(super) fn of(rows: &[StretchRow], session: &Session) -> Self {
        let nodes = distance_nodes(rows);
        let mut design = Self {
            terms: (0..nodes.len()).map(Term::Distance).collect(),
            nodes,
            incidences: Vec::new(),
            held: AngleBias::default(),
            colors: Vec::new(),
            omitted: Vec::new(),
        };
        let reference = reference_color(rows);
        if design.nodes.is_empty() {
            design.omit(
                "E_r",
                None,
                "no test of the distance was recorded: the constant is in B_a or B_c, and an error that changes with the distance is taken for \
                 something else",
            );
        }
        design.add_angle(rows, session, reference.is_some());
        design.add_colors(rows, reference.as_deref());
        design
    }

    fn omit(&mut self, symbol: &str, color: Option<&str>, reason: &str) {
        self.omitted.push(NotObserved {
            symbol: symbol.to_owned(),
            color: color.map(str::to_owned),
            reason: reason.to_owned(),
        });
    }

    fn add_angle(&mut self, rows: &[StretchRow], session: &Session, referred: bool) {
        // A board is read by a fan: its half width widens the range of incidences.
        let cosines = rows.iter().flat_map(|r| {
            let width = session.board(&r.board).map_or(0.0, |b| b.width_mm * 1e-3);
            let fan = libm::atan2(0.5 * width, r.distance_m);
            let incidence = r.incidence_deg.abs().to_radians();
            [(incidence - fan).max(0.0), incidence + fan].map(libm::cos)
        });
        let (low, high) = cosines.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| {
            (l.min(c), h.max(c))
        });
        if high - low >= MIN_COSINE_SPREAD {
            self.terms.push(Term::AngleGain);
        } else {
            self.omit(
                "A_a",
                None,
                "all boards are read at nearly the same incidence; turn one by 30° or more",
            );
        }
        if self.nodes.is_empty() && referred {
            self.terms.push(Term::AngleOffset);
        }
    }

    fn add_colors(&mut self, rows: &[StretchRow], reference: Option<&str>) {
        let mut distances: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for row in rows.iter().filter(|r| Some(r.color.as_str()) != reference) {
            distances.entry(&row.color).or_default().push(row.distance_m);
        }
        for (color, distances) in distances {
            let index = self.colors.len();
            self.colors.push(color.to_owned());
            let near = distances.iter().copied().fold(f64::INFINITY, f64::min);
            let far = distances.iter().copied().fold(0.0, f64::max);
            if far - near >= MIN_DISTANCE_SPREAD * far {
                self.terms.push(Term::ColorSlope(index));
            } else {
                self.omit("A_c", Some(color), "the color was seen at one distance only");
            }
            self.terms.push(Term::ColorOffset(index));
        }
    }

    /// Whether E_r holds the error at normal incidence.
    pub(super) fn is_normal_in_distance(&self) -> bool {
        !self.nodes.is_empty()
    }

    pub(super) fn color(&self, term: &Term) -> Option<&str> {
        match term {
            Term::ColorSlope(c) | Term::ColorOffset(c) => Some(&self.colors[*c]),
            _ => None,
        }
    }

    /// Change of a range, in meters, per unit of each term.
    pub(super) fn row(&self, distance: f64, cos_incidence: f64, color: &str) -> RowDVector<f64> {
        let weight = |nodes: &[f64], at: f64, node: usize| -> f64 {
            let weights = interpolation_weights(nodes, at);
            weights.iter().filter(|(i, _)| *i == node).map(|(_, w)| w).sum()
        };
        let incidence = libm::acos(cos_incidence.clamp(-1.0, 1.0)).to_degrees();
        let own = |c: usize| if self.colors[c] == color { 1.0 } else { 0.0 };
        let value = |term: &Term| match *term {
            Term::Distance(node) => weight(&self.nodes, distance, node),
            Term::AngleGain if self.is_normal_in_distance() => cos_incidence - 1.0,
            Term::AngleGain => cos_incidence,
            Term::AngleOffset => 1.0,
            Term::AngleNode(node) => weight(&self.incidences, incidence, node),
            Term::ColorSlope(c) => own(c) * distance,
            Term::ColorOffset(c) => own(c),
        };
        RowDVector::from_iterator(self.terms.len(), self.terms.iter().map(|t| 1e-3 * value(t)))
    }

    /// The biases at these values of the terms; a table of incidences is left to the caller.
    pub(super) fn bias(&self, values: &DVector<f64>) -> RangeBias {
        let mut bias = RangeBias {
            distance: DistanceBias {
                range_m: self.nodes.clone(),
                error_mm: vec![0.0; self.nodes.len()],
            },
            angle: self.held.clone(),
            color: self
                .colors
                .iter()
                .map(|c| (c.clone(), ColorBias::default()))
                .collect(),
        };
        for (term, &value) in self.terms.iter().zip(values.iter()) {
            let color = self.color(term).map(str::to_owned);
            let color = color.and_then(|c| bias.color.get_mut(&c));
            match (*term, color) {
                (Term::Distance(node), _) => bias.distance.error_mm[node] = value,
                (Term::AngleGain, _) => {
                    bias.angle.gain_mm = value;
                    if self.is_normal_in_distance() {
                        bias.angle.offset_mm = -value;
                    }
                }
                (Term::AngleOffset, _) => bias.angle.offset_mm = value,
                (Term::ColorSlope(_), Some(color)) => color.slope_mm_per_m = value,
                (Term::ColorOffset(_), Some(color)) => color.offset_mm = value,
                (Term::AngleNode(_) | Term::ColorSlope(_) | Term::ColorOffset(_), _) => {}
            }
        }
        bias
    }
}

/// The reference color of E_c: that of the distance test, else of the angle test or of boards without a note. `None` if
/// only colors were tested.
fn reference_color(rows: &[StretchRow]) -> Option<String> {
    let of = |kinds: &[Option<TestKind>]| {
        rows.iter()
            .find(|r| kinds.contains(&r.test))
            .map(|r| r.color.clone())
    };
    of(&[Some(TestKind::Distance)]).or_else(|| of(&[Some(TestKind::Angle), Some(TestKind::Spot), None]))
}

/// Mean distances of the settings at which the distance was tested, in the reference color.
///
/// If no board was set up for a test, boards are at all distances and incidences, and the effects of the two must not
/// be confused: E_r is then a line over the distances at which they were read.
fn distance_nodes(rows: &[StretchRow]) -> Vec<f64> {
    let reference = reference_color(rows);
    if rows.iter().all(|r| r.test.is_none()) {
        let distances = || rows.iter().map(|r| r.distance_m);
        let (near, far) = (
            distances().fold(f64::INFINITY, f64::min) / FAN_ROOM,
            distances().fold(0.0, f64::max) * FAN_ROOM,
        );
        let spread = far / FAN_ROOM - near * FAN_ROOM;
        return if spread >= MIN_DISTANCE_SPREAD * far {
            vec![near, far]
        } else {
            Vec::new()
        };
    }
    let distances: Vec<f64> = rows
        .iter()
        .filter(|r| r.test == Some(TestKind::Distance) && Some(&r.color) == reference.as_ref())
        .map(|r| r.distance_m)
        .collect();
    let groups = grouped(distances, same_distance);
    groups.iter().map(|g| mean(g)).collect()
}

/// Sorts numbers into groups, each within `within` of its smallest number.
pub(super) fn grouped(mut numbers: Vec<f64>, within: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
    numbers.sort_by(f64::total_cmp);
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for x in numbers {
        match groups.last_mut() {
            Some(group) if x - group[0] < within(x) => group.push(x),
            _ => groups.push(vec![x]),
        }
    }
    groups
}

pub(super) fn mean(numbers: &[f64]) -> f64 {
    numbers.iter().sum::<f64>() / numbers.len() as f64
}

/// Tolerance of one distance: trials are set up anew each time, so it grows slightly with the distance.
fn same_distance(distance: f64) -> f64 {
    SAME_DISTANCE + 0.02 * distance
}
