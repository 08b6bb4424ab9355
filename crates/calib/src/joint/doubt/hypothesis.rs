//! Hypotheses about what the beliefs omit or underrate, and their tests.

use super::super::group::BOARD_ERRORS;
use super::super::problem::Joint;
use super::evidence::{Evidence, Statistic};
use super::shapes::Shapes;
use catoptric_model::assessment::Cause;

/// Smallest spread of a kind of error, relative to the believed one, that is worth a doubt.
pub(super) const WORTH: f64 = 1.1;

/// How a hypothesis is tested.
pub(super) enum Kind {
    /// The errors of these columns are not 0.
    Shift,
    /// The errors of these columns, each with its own size, are larger than believed.
    Spread,
}

/// Errors that the beliefs omit, or underrate.
pub(super) struct Hypothesis {
    pub(super) cause: Cause,
    pub(super) kind: Kind,
    pub(super) columns: Vec<usize>,
    /// Number of the pose, if the hypothesis is about one.
    pub(super) pose: Option<usize>,
    /// Unit of its errors, in millimeters.
    pub(super) unit_mm: f64,
    /// Number of hypotheses of its kind, each about another pose.
    among: usize,
}

impl Hypothesis {
    fn shift(cause: Cause, columns: Vec<usize>) -> Self {
        Self {
            cause,
            kind: Kind::Shift,
            columns,
            pose: None,
            unit_mm: 1.0,
            among: 1,
        }
    }

    fn spread(cause: Cause, columns: Vec<usize>) -> Self {
        Self {
            kind: Kind::Spread,
            ..Self::shift(cause, columns)
        }
    }

    /// The statistic, and ln of its probability for any hypothesis of its kind.
    pub(super) fn test(&self, evidence: &Evidence) -> (Statistic, f64) {
        let statistic = match self.kind {
            Kind::Shift => evidence.shift(&self.columns),
            Kind::Spread => match evidence.spread(&self.columns) {
                (statistic, ratio) if ratio > WORTH * WORTH => statistic,
                _ => Statistic::default(),
            },
        };
        (
            statistic,
            (statistic.ln_p() + libm::log(self.among as f64)).min(0.0),
        )
    }
}

impl Hypothesis {
    /// The same, once some errors are estimated: nothing if its own are among them.
    pub(super) fn test_beside(&self, estimated: &[usize], evidence: &Evidence) -> (Statistic, f64) {
        if self.columns.iter().all(|column| estimated.contains(column)) {
            return (Statistic::default(), 0.0);
        }
        self.test(evidence)
    }
}

/// All hypotheses about a solution.
pub(super) fn hypotheses(joint: &Joint, shapes: &Shapes) -> Vec<Hypothesis> {
    let boards = shapes.poses.len();
    let shared = |from: usize, to: usize| (shapes.shared + from..shapes.shared + to).collect::<Vec<_>>();
    let first = joint.first_common;
    let glass = joint.glass_column().zip(joint.glass);
    let mut all = vec![
        Hypothesis::spread(Cause::Drift, shapes.of_boards(0..1)),
        Hypothesis::spread(Cause::Markers, shapes.of_boards(1..BOARD_ERRORS)),
        Hypothesis::shift(Cause::WarmUp, (shapes.warming..shapes.thickness).collect()),
        Hypothesis::shift(Cause::BoardThickness, vec![shapes.thickness]),
        Hypothesis::shift(Cause::Glass, vec![shapes.glass]),
        Hypothesis::shift(Cause::BareDistances, vec![shapes.bare]),
        Hypothesis::shift(
            Cause::BareDistances,
            (shapes.bare_of_facets..shapes.bare_of_facets + shapes.facets).collect(),
        ),
        Hypothesis::shift(Cause::DistanceBias, shapes.distance.columns()),
        Hypothesis::shift(Cause::AngleBias, shapes.incidence.columns()),
        Hypothesis::shift(Cause::Mounting, shared(0, first)),
        Hypothesis::shift(Cause::Characterization, shared(first, first + joint.common.len())),
    ];
    if let Some((column, sheet)) = glass {
        all.push(Hypothesis {
            unit_mm: sheet.thickness_sd_mm,
            ..Hypothesis::shift(Cause::Glass, shared(column, column + 1))
        });
    }
    all.extend((0..boards).map(|board| Hypothesis {
        pose: Some(shapes.poses[board]),
        among: boards,
        ..Hypothesis::shift(Cause::Board, shapes.of_board(board))
    }));
    all
}
