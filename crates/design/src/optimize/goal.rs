//! Goals: what a layout should have more, or less, of.

use super::Stated;
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

/// A direction that some elements should look in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Azimuth, in degrees.
    pub azimuth_deg: f64,
    /// Elevation, in degrees: 90 is the ceiling, −90 the floor.
    pub elevation_deg: f64,
    /// How many elements.
    pub elements: usize,
}

/// What a layout should have more, or less, of.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    name: String,
    better: Better,
    unit: Option<&'static str>,
    what: What,
}

#[derive(Debug, Clone, PartialEq)]
enum What {
    /// A figure of `layout --json`.
    Figure(String),
    /// The least cylinder about the scanner's axis that holds everything.
    Cylinder,
    /// How far the nearest elements look from wanted directions.
    Directions(Vec<Wanted>),
}

/// Why a goal is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GoalError {
    /// Nothing has that name.
    #[error("{text:?} is no goal")]
    Unknown {
        /// What was written.
        text: String,
        /// The one that was probably meant, or all there are.
        help: String,
    },
    /// A direction that is none.
    #[error(
        "{text:?} is no direction: it takes an azimuth and an elevation in degrees, and the number of elements: 90,-60,4"
    )]
    Direction {
        /// What was written.
        text: String,
    },
    /// Directions without the goal, or the goal without any.
    #[error("the goal `directions` and wanted directions need one another")]
    Directions,
    /// A layout has no figure of that name.
    #[error("{key:?} is no figure of a layout")]
    Figure {
        /// The name.
        key: String,
        /// The one that was probably meant.
        help: String,
    },
}

/// Goals with a name of their own: which way is better, what figure they are, its unit.
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

/// Goals that are no figure.
const OTHERS: [&str; 2] = ["size", "directions"];

impl Wanted {
    /// Reads a direction: `AZIMUTH,ELEVATION` or `AZIMUTH,ELEVATION,ELEMENTS`.
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

/// Mean over wanted directions of the mean angle to the elements that serve them, in degrees; as far as can be for those that
/// lack. An element serves one direction: the nearest pairs are made first.
fn apart(wanted: &[Wanted], exits: &[Unit<Vector3<f64>>]) -> f64 {
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
    /// Reads a goal: one of the named ones, or a figure of `layout --json` with its direction, `share_within_5_deg:up`.
    ///
    /// # Errors
    /// [`GoalError`] for anything else, and for `directions` without any.
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
            return goal(name, *better, *unit, What::Figure((*figure).to_owned()));
        }
        match text {
            "size" => return goal(text, Better::Down, Some("cm³"), What::Cylinder),
            "directions" if wanted.is_empty() => return Err(GoalError::Directions),
            "directions" => {
                return goal(text, Better::Down, Some("°"), What::Directions(wanted.to_vec()));
            }
            _ => {}
        }
        if let Some((figure, way)) = text.rsplit_once(':')
            && let Some(better) = match way {
                "up" => Some(Better::Up),
                "down" => Some(Better::Down),
                _ => None,
            }
        {
            return goal(figure, better, None, What::Figure(figure.to_owned()));
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

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// In words.
    pub fn stated(&self) -> Stated {
        Stated {
            name: self.name.clone(),
            better: self.better,
            unit: self.unit,
        }
    }

    /// Whether it needs the predicted accuracy, which takes longer than all else.
    pub(super) fn needs_accuracy(&self) -> bool {
        matches!(&self.what, What::Figure(key) if key.starts_with("accuracy"))
    }

    /// Whether a layout has such a figure at all.
    pub(super) fn check(&self, figures: &[(String, Option<f64>)]) -> Result<(), GoalError> {
        let What::Figure(key) = &self.what else {
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

    /// Its value for a layout.
    pub(super) fn value(&self, analysis: &Analysis, figures: &[(String, Option<f64>)]) -> Option<f64> {
        match &self.what {
            What::Figure(key) => figures.iter().find(|(name, _)| name == key)?.1,
            What::Cylinder => {
                let size = &analysis.size;
                let radius_cm = 0.05 * size.diameter_mm;
                Some(std::f64::consts::PI * radius_cm * radius_cm * 0.1 * size.height_mm)
            }
            What::Directions(wanted) => {
                let seeing = analysis.elements.iter().filter(|e| e.class.sees());
                let exits: Vec<Unit<Vector3<f64>>> = seeing
                    .filter_map(|e| Some((e.exit_azimuth_deg?, e.exit_elevation_deg?)))
                    .map(|(azimuth, elevation)| beam::spherical(azimuth.to_radians(), elevation.to_radians()))
                    .collect();
                Some(apart(wanted, &exits))
            }
        }
    }

    /// A value so that less is better.
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
    fn goals_have_names_and_figures_have_ways() {
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
        assert!((apart(&[wanted], &exits) - 8.0).abs() < 1e-9);
        // One that lacks is as far as can be.
        assert!((apart(&[wanted], &exits[..1]) - 95.0).abs() < 1e-9);
        // Asked for twice, an element serves once: 6° and 10°, then 90° and nothing.
        assert!((apart(&[wanted, wanted], &exits) - (8.0 + 0.5 * (90.0 + 180.0)) / 2.0).abs() < 1e-9);
        for text in ["", "90", "90,100", "90,-60,0", "90,-60,x", "1,2,3,4", "nan,0"] {
            assert!(Wanted::parse(text).is_err(), "{text}");
        }
    }
}
