//! Doubts: which of the believed errors do the readings contradict?
//!
//! Each hypothesis adds errors to the model: a shape ([`shapes`]), or a larger spread of a kind of error. The one with the
//! smallest probability is named if that is too small to be chance, all hypotheses considered; then its errors count as
//! estimated, and the others are tested again. Others that would explain the same, nearly as well, are named with it.

mod evidence;
mod halves;
mod hypothesis;
mod shapes;
mod tail;
mod words;

use super::answer::Answer;
use super::group::JointElement;
use super::problem::Joint;
use crate::lsq::{self, Solution};
use catoptric_model::assessment::{Cause, ComponentTest, Doubt};
use catoptric_model::{Dataset, Session};
use evidence::{Evidence, Statistic};
use hypothesis::{Hypothesis, Kind, WORTH, hypotheses};
use nalgebra::Point3;

/// Probability of any doubt if all beliefs hold.
const FALSE_ALARM: f64 = 1e-3;

/// Maximum number of doubts that are followed up.
const ROUNDS: usize = 3;

/// Share of the best explanation's evidence, in logarithms, that another one needs to be named with it.
const NEARLY: f64 = 0.7;

/// Number of elements at either edge of a facet that are left out of the tests, and the share of its elements that is the
/// most.
const EDGE: usize = 4;
const EDGE_SHARE: usize = 8;

/// Studentized residual above which an element is left out too, and the maximum number of such elements: more are not
/// single ones.
const STRANGE: f64 = 4.0;
const MOST_STRANGE: usize = 10;

/// Correlation of neighboring beams that changes the uncertainty of their mean by less than a fifth.
const WORTH_OF_NEIGHBORS: f64 = 0.2;

/// Factor on the standard deviation of a reading that is left out.
const LEFT_OUT: f64 = 1e6;

impl Joint<'_> {
    /// Tests of the beliefs, and what is doubtful about them.
    pub(super) fn doubts(
        &self,
        dataset: &Dataset,
        solution: &Solution,
        answers: &[Answer],
    ) -> (Vec<ComponentTest>, Vec<Doubt>) {
        let session = &dataset.session;
        if session.believed.range_noise_sd_mm == 0.0 {
            // Where nothing is believed to be in the way there is no scale for a test.
            return (Vec::new(), Vec::new());
        }
        let (inner, left_out) = self.without_edges(answers);
        let Ok(solution) = inner.solve(solution.state.clone(), &lsq::SolverOptions::default()) else {
            return (Vec::new(), Vec::new());
        };
        let Some((shapes, whole)) = inner.evidence(dataset, &solution) else {
            return (Vec::new(), Vec::new());
        };
        // Mirrors may be of any figure.
        let mut estimated = shapes.of_figures();
        let mut left = whole.given(&estimated);
        let all = hypotheses(self, &shapes);
        let kinds = all.iter().filter(|h| h.pose.is_none()).count() + 4;
        let limit = libm::log(FALSE_ALARM / kinds as f64);
        let tests = all
            .iter()
            .filter(|h| h.pose.is_none())
            .map(|h| component(h, &left));
        let mut tests: Vec<ComponentTest> = tests.collect();
        tests.extend(worst_board(&all, &left));
        let mut doubts = Vec::new();
        let residuals = Statistic {
            chi_squared: solution.sum_of_squares,
            freedom: solution.degrees_of_freedom() as f64 - left_out as f64,
        };
        let halves = halves::correlated(self, dataset);
        tests.extend(halves.iter().flat_map(|h| [h.test(), h.test_of_neighbors()]));
        if let Some(halves) = halves {
            let correlated = halves.statistic.ln_p() < limit && halves.inflation > WORTH * WORTH;
            let smoothed = halves.of_neighbors().ln_p() < limit && halves.neighbors > WORTH_OF_NEIGHBORS;
            let mut doubts = Vec::new();
            doubts.extend(correlated.then(|| words::correlated(&halves)));
            doubts.extend(smoothed.then(|| words::smoothed(&halves)));
            if !doubts.is_empty() {
                // All other tests take noise for white.
                return (tests, doubts);
            }
        }
        for _ in 0..ROUNDS {
            let tested: Vec<_> = all.iter().map(|h| h.test_beside(&estimated, &left)).collect();
            let best = (0..all.len()).min_by(|a, b| tested[*a].1.total_cmp(&tested[*b].1));
            let Some(best) = best.filter(|b| tested[*b].1 < limit) else {
                break;
            };
            let others = (0..all.len()).filter(|other| {
                let nearly = tested[*other].1 < NEARLY * tested[best].1 && tested[*other].1 < limit;
                all[*other].cause != all[best].cause
                    && nearly
                    && all[best].test(&left.given(&all[*other].columns)).1 > limit
            });
            let named: Vec<&Hypothesis> = [best].into_iter().chain(others).map(|i| &all[i]).collect();
            doubts.push(words::doubt(session, &named, &left, &tested[best].0));
            estimated.extend(&all[best].columns);
            left = whole.given(&estimated);
        }
        doubts.extend(unexplained(
            session, &residuals, &whole, &estimated, limit, &mut tests,
        ));
        (tests, words::merged(doubts))
    }

    /// The problem without what may not be a whole beam: elements at the edges of facets, which may lose part of their
    /// light there or in the rim of the glass, and those with residuals that are hardly noise; and the number of readings
    /// left out.
    fn without_edges(&self, answers: &[Answer]) -> (Self, usize) {
        let mut inner = self.clone();
        let strange = strange(answers);
        let mut left_out = 0;
        for group in &mut inner.groups {
            for facet in 0..group.facets.len() {
                let mut own: Vec<_> = group
                    .elements
                    .iter_mut()
                    .filter(|e| e.facet == Some(facet))
                    .collect();
                own.sort_by(|a, b| a.along.total_cmp(&b.along));
                let count = own.len();
                let points: Vec<_> = own.iter().map(|e| self.in_rim(e, answers)).collect();
                let within = |from: Option<(Point3<f64>, f64)>| {
                    let near =
                        |p: &&(Point3<f64>, f64)| from.is_some_and(|(from, _)| (p.0 - from).norm() < p.1);
                    points.iter().flatten().filter(near).count()
                };
                let least = EDGE.min(count / EDGE_SHARE);
                let first = within(points.first().copied().flatten()).max(least);
                let last = within(points.last().copied().flatten()).max(least);
                for (place, element) in own.into_iter().enumerate() {
                    if place < first || place + last >= count || strange.contains(&element.beam) {
                        left_out += element.sights.len();
                        element.sights.iter_mut().for_each(|sight| sight.sd *= LEFT_OUT);
                    }
                }
            }
        }
        (inner, left_out)
    }

    /// Where an element meets its mirror, and how near to the edge of the glass it loses light, in meters; nothing without
    /// glass.
    fn in_rim(&self, element: &JointElement, answers: &[Answer]) -> Option<(Point3<f64>, f64)> {
        let glass = self.glass?;
        let deflection = answers.iter().find(|a| a.beam == element.beam)?.deflection;
        let thickness_mm = glass.thickness_mm + 2.0 * glass.thickness_sd_mm;
        let walk = glass.walk(&element.u, &deflection.exit_direction(element.azimuth));
        Some((
            deflection.deflection_point(element.azimuth),
            1e-3 * thickness_mm * walk,
        ))
    }
}

/// Whether the residuals are larger than expected, whatever else is estimated.
fn unexplained(
    session: &Session,
    residuals: &Statistic,
    evidence: &Evidence,
    estimated: &[usize],
    limit: f64,
    tests: &mut Vec<ComponentTest>,
) -> Option<Doubt> {
    let explained = evidence.shift(estimated);
    let statistic = Statistic {
        // More than all is explained where the linearization no longer holds.
        chi_squared: (residuals.chi_squared - explained.chi_squared).max(0.0),
        freedom: residuals.freedom - explained.freedom,
    };
    tests.push(ComponentTest {
        cause: Cause::Noise,
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        p_value: libm::exp(statistic.ln_p()),
    });
    (statistic.ln_p() < limit).then(|| words::noise(session, &statistic))
}

/// Beams of the elements with the largest residuals, if these are hardly noise.
fn strange(answers: &[Answer]) -> Vec<usize> {
    let largest = |a: &Answer| a.seen.iter().map(|s| s.studentized().abs()).fold(0.0, f64::max);
    let mut all: Vec<(f64, usize)> = answers.iter().map(|a| (largest(a), a.beam)).collect();
    all.retain(|(studentized, _)| *studentized > STRANGE);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.into_iter().take(MOST_STRANGE).map(|(_, beam)| beam).collect()
}

fn component(hypothesis: &Hypothesis, evidence: &Evidence) -> ComponentTest {
    let statistic = match hypothesis.kind {
        Kind::Shift => evidence.shift(&hypothesis.columns),
        Kind::Spread => evidence.spread(&hypothesis.columns).0,
    };
    ComponentTest {
        cause: hypothesis.cause,
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        p_value: libm::exp(statistic.ln_p()),
    }
}

/// The board that the others predict worst.
fn worst_board(all: &[Hypothesis], evidence: &Evidence) -> Option<ComponentTest> {
    let of_boards = all.iter().filter(|h| h.pose.is_some());
    let tested = of_boards.map(|h| h.test(evidence));
    let (statistic, ln_p) = tested.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(ComponentTest {
        cause: Cause::Board,
        statistic: statistic.chi_squared,
        degrees_of_freedom: statistic.freedom,
        p_value: libm::exp(ln_p),
    })
}
