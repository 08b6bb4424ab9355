//! Goals: quantities of a layout to maximize or minimize.

use crate::layout::{Analysis, Requirement};
use catoptric_model::beam;
use catoptric_model::place::nearest;
use catoptric_model::scan::MOST_BEAMS;
use nalgebra::{Unit, Vector3};
use serde::Serialize;

/// Whether more or less is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    /// More.
    Up,
    /// Less.
    Down,
}

/// A direction in which some elements should look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Azimuth, in degrees.
    pub azimuth_deg: f64,
    /// Elevation, in degrees: 90 is the ceiling, −90 the floor.
    pub elevation_deg: f64,
    /// Number of elements.
    pub elements: usize,
}

/// A quantity of a layout to maximize or minimize.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    name: String,
    better: Better,
    unit: Option<&'static str>,
    what: Measure,
}

/// A goal as results state it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Stated {
    /// Its name.
    pub name: String,
    /// Whether more or less of it is better.
    pub better: Better,
    /// Its unit; `None` for a share or a count.
    pub unit: Option<&'static str>,
}

#[derive(Debug, Clone, PartialEq)]
enum Measure {
    /// A figure of `layout --json`.
    Figure(String),
    /// Volume of the smallest cylinder about the scanner's axis that holds everything.
    Cylinder,
    /// Mean angle from wanted directions to the nearest elements.
    Directions(Vec<Wanted>),
}

/// Why a goal is invalid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GoalError {
    /// Nothing has that name.
    #[error("{text:?} is not a goal")]
    Unknown {
        /// The text as written.
        text: String,
        /// The name that was probably meant, or a list of all.
        help: String,
    },
    /// Not a valid direction.
    #[error(
        "{text:?} is not a direction: it takes an azimuth and an elevation in degrees, and the number of elements: 90,-60,4"
    )]
    Direction {
        /// The text as written.
        text: String,
    },
    /// Directions without the goal, or the goal without directions.
    #[error("the goal `directions` and wanted directions need one another")]
    Directions,
    /// A layout has no figure of that name.
    #[error("{key:?} is not a figure of a layout")]
    Figure {
        /// The name.
        key: String,
        /// The name that was probably meant.
        help: String,
    },
}

/// Goals with names of their own: whether more or less is better, the figure, and its unit.
const NAMED: [(&str, Better, &str, Option<&str>); 4] = [
    ("field_of_regard", Better::Up, "field_of_regard", None),
    ("split_beams", Better::Down, "counts.split", None),
    ("lost_beams", Better::Down, "lost", None),
    (
        "predicted_accuracy",
        Better::Down,
        "accuracy.per_axis_deg",
        Some("°"),
    ),
];

/// Goals that are not figures.
const OTHERS: [&str; 2] = ["size", "directions"];

impl Wanted {
    /// Parses a direction: `AZIMUTH,ELEVATION` or `AZIMUTH,ELEVATION,ELEMENTS`.
    ///
    /// # Errors
    /// [`GoalError::Direction`] for anything else.
    pub fn parse(text: &str) -> Result<Self, GoalError> {
        let wrong = || GoalError::Direction {
            text: text.to_owned(),
        };
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let angle = |part: &str, limit: f64| {
            let angle = part.parse::<f64>().map_err(|_| wrong())?;
            if angle.abs() <= limit {
                Ok(angle)
            } else {
                Err(wrong())
            }
        };
        let (azimuth, elevation, elements) = match parts.as_slice() {
            [azimuth, elevation] => (azimuth, elevation, 1),
            [azimuth, elevation, elements] => (azimuth, elevation, elements.parse().map_err(|_| wrong())?),
            _ => return Err(wrong()),
        };
        if !(1..=MOST_BEAMS).contains(&elements) {
            return Err(wrong());
        }
        Ok(Self {
            azimuth_deg: angle(azimuth, 360.0)?,
            elevation_deg: angle(elevation, 90.0)?,
            elements,
        })
    }
}

/// Returns the mean over wanted directions of the mean angle to the elements that serve them, in degrees; a missing
/// element counts as 180°. An element serves one direction: pairs are made in order of increasing angle.
fn mean_angle(wanted: &[Wanted], exits: &[Unit<Vector3<f64>>]) -> f64 {
    let mut pairs = Vec::with_capacity(wanted.len() * exits.len());
    for (direction, w) in wanted.iter().enumerate() {
        let own = beam::spherical(w.azimuth_deg.to_radians(), w.elevation_deg.to_radians());
        let angles = exits.iter().map(|v| beam::angle_between(&own, v).to_degrees());
        pairs.extend(angles.enumerate().map(|(exit, angle)| (angle, direction, exit)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut serves = vec![false; exits.len()];
    let mut lacking: Vec<usize> = wanted.iter().map(|w| w.elements).collect();
    let mut sums = vec![0.0; wanted.len()];
    for (angle, direction, exit) in pairs {
        if lacking[direction] > 0 && !serves[exit] {
            serves[exit] = true;
            lacking[direction] -= 1;
            sums[direction] += angle;
        }
    }
    let means = wanted.iter().zip(&sums).zip(&lacking);
    let means = means.map(|((w, sum), lacking)| (sum + 180.0 * *lacking as f64) / w.elements as f64);
    means.sum::<f64>() / wanted.len() as f64
}

impl Goal {
    /// Parses a goal: a named one, or a figure of `layout --json` and whether more or less of it is better:
    /// `share_within_5_deg:up`.
    ///
    /// # Errors
    /// [`GoalError`] for anything else, and for `directions` without wanted directions.
    pub fn parse(text: &str, wanted: &[Wanted]) -> Result<Self, GoalError> {
        let goal = |name: &str, better, unit, what| {
            Ok(Self {
                name: name.to_owned(),
                better,
                unit,
                what,
            })
        };
        if let Some((name, better, figure, unit)) = NAMED.iter().find(|(name, ..)| *name == text) {
            return goal(name, *better, *unit, Measure::Figure((*figure).to_owned()));
        }
        match text {
            "size" => return goal(text, Better::Down, Some("cm³"), Measure::Cylinder),
            "directions" if wanted.is_empty() => return Err(GoalError::Directions),
            "directions" => {
                return goal(
                    text,
                    Better::Down,
                    Some("°"),
                    Measure::Directions(wanted.to_vec()),
                );
            }
            _ => {}
        }
        if let Some((figure, direction)) = text.rsplit_once(':')
            && let Some(better) = match direction {
                "up" => Some(Better::Up),
                "down" => Some(Better::Down),
                _ => None,
            }
        {
            return goal(figure, better, None, Measure::Figure(figure.to_owned()));
        }
        let names = || NAMED.iter().map(|(name, ..)| *name).chain(OTHERS);
        let help = match nearest(text, names()) {
            Some(near) => format!("did you mean {near}?"),
            None => format!(
                "goals: {}; or a figure of layout --json and its direction: share_within_5_deg:up",
                names().collect::<Vec<_>>().join(", ")
            ),
        };
        Err(GoalError::Unknown {
            text: text.to_owned(),
            help,
        })
    }

    /// Returns its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns it as results state it.
    pub fn stated(&self) -> Stated {
        Stated {
            name: self.name.clone(),
            better: self.better,
            unit: self.unit,
        }
    }

    /// Whether it needs the predicted accuracy, which takes longer than everything else.
    pub(super) fn needs_accuracy(&self) -> bool {
        matches!(&self.what, Measure::Figure(key) if key.starts_with("accuracy"))
    }

    /// Checks that layouts have such a figure.
    pub(super) fn check(&self, figures: &[(String, Option<f64>)]) -> Result<(), GoalError> {
        let Measure::Figure(key) = &self.what else {
            return Ok(());
        };
        if figures.iter().any(|(name, _)| name == key) {
            return Ok(());
        }
        let near = nearest(key, figures.iter().map(|(name, _)| name.as_str()));
        Err(GoalError::Figure {
            key: key.clone(),
            help: near.map_or_else(
                || "every number of layout --json has a name, its keys joined by dots".to_owned(),
                |near| format!("did you mean {near}?"),
            ),
        })
    }

    /// Returns its value for a layout.
    pub(super) fn value(&self, analysis: &Analysis, figures: &[(String, Option<f64>)]) -> Option<f64> {
        match &self.what {
            Measure::Figure(key) => figures.iter().find(|(name, _)| name == key)?.1,
            Measure::Cylinder => {
                let size = &analysis.size;
                let radius_cm = 0.05 * size.diameter_mm;
                Some(std::f64::consts::PI * radius_cm * radius_cm * 0.1 * size.height_mm)
            }
            Measure::Directions(wanted) => {
                let seeing = analysis.elements.iter().filter(|e| e.class.sees());
                let exits: Vec<Unit<Vector3<f64>>> = seeing
                    .filter_map(|e| Some((e.exit_azimuth_deg?, e.exit_elevation_deg?)))
                    .map(|(azimuth, elevation)| beam::spherical(azimuth.to_radians(), elevation.to_radians()))
                    .collect();
                Some(mean_angle(wanted, &exits))
            }
        }
    }

    /// Returns a value with the sign such that less is better.
    pub(super) fn cost(&self, value: f64) -> f64 {
        match self.better {
            Better::Up => -value,
            Better::Down => value,
        }
    }
}

/// Whether a requirement needs the predicted accuracy.
pub(super) fn requires_accuracy(requirement: &Requirement) -> bool {
    requirement.key().starts_with("accuracy")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_named_or_figures_with_a_direction() {
        let goal = |text: &str| Goal::parse(text, &[]);
        assert_eq!(goal("lost_beams").expect("it is one").better, Better::Down);
        let figure = goal("facets.left-1.elements:up").expect("it is one");
        assert_eq!(
            (figure.name(), figure.better),
            ("facets.left-1.elements", Better::Up)
        );
        assert!(
            goal("field_of_regrad")
                .expect_err("a slip")
                .to_string()
                .contains("field_of_regrad")
        );
        assert_eq!(goal("directions"), Err(GoalError::Directions));
        assert!(matches!(goal("lost"), Err(GoalError::Unknown { .. })));
    }

    #[test]
    fn a_direction_is_as_far_as_its_nearest_elements() {
        let wanted = Wanted::parse("0,-90,2").expect("it is one");
        let exits = [(0.0, -80.0), (90.0, -84.0), (180.0, 0.0)];
        let exits = exits.map(|(a, e): (f64, f64)| beam::spherical(a.to_radians(), e.to_radians()));
        assert!((mean_angle(&[wanted], &exits) - 8.0).abs() < 1e-9);
        // A missing element counts as 180°.
        assert!((mean_angle(&[wanted], &exits[..1]) - 95.0).abs() < 1e-9);
        // Wanted twice, an element serves once: 6° and 10°, then 90° and nothing.
        assert!((mean_angle(&[wanted, wanted], &exits) - (8.0 + 0.5 * (90.0 + 180.0)) / 2.0).abs() < 1e-9);
        for text in ["", "90", "90,100", "90,-60,0", "90,-60,x", "1,2,3,4", "nan,0"] {
            assert!(Wanted::parse(text).is_err(), "{text}");
        }
    }
}
