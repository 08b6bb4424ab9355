//! From candidates to a design: greedy choice, then exchanges until none improves it.
//!
//! Each element keeps C, the covariance of (cos φ·θ_a, φ, q). A board with row g and variance σ² makes it C −
//! (Cg)(Cg)ᵀ/(σ² + gᵀCg), in any order of boards. The angles start from a prior so wide that it has no weight, so that
//! elements without boards have a large but finite cost.

use super::answer::{Open, Standing};
use super::candidates::{PoseCandidate, Site, candidates};
use super::request::{Criterion, Request};
use super::situation::{Fan, PlannedElement, Situation, noise_on};
use super::words;
use crate::element::attempt::MIN_BOARDS;
use crate::error::CalibError;
use crate::judge::common::CommonErrors;
use crate::judge::covariance::{self, MountUncertainty, Sighting};
use crate::judge::levers::libm_cos;
use crate::judge::observability::{self, WEAKEST_SD};
use crate::readings::observations::BoardView;
use catoptric_model::{Stop, Stopped};
use nalgebra::{DMatrix, DVector, Matrix6};

/// Prior of each angle, in radians (30°): 10⁻⁶ of the information about a determined element.
const PRIOR_SD: f64 = std::f64::consts::PI / 6.0;

/// Smallest variance, in square meters: that of one micrometer.
const MIN_VARIANCE: f64 = 1e-12;

/// Cost of each board that an element lacks, as log det: more than the difference between any two candidate boards.
const LACKING_LOG_DET: f64 = 10.0;

/// Relative gain below which an exchange is not made.
const MIN_GAIN: f64 = 1e-9;

/// Maximum number of rounds of exchanges; five are usual.
const MAX_ROUNDS: usize = 50;

/// Number of rounds of trying poses around the chosen ones, each at half the distance of the round before.
const REFINEMENTS: i32 = 4;

/// The contribution of one board to one element.
#[derive(Debug, Clone)]
struct Row {
    element: usize,
    g: DVector<f64>,
    variance: f64,
}

/// The information about one element.
#[derive(Debug, Clone)]
struct Known {
    covariance: DMatrix<f64>,
    boards: usize,
}

/// Candidates in front of one facet, and the value of sets of them.
pub struct Designer<'a> {
    situation: &'a Situation,
    fan: &'a Fan,
    request: Request,
    site: Site<'a>,
    candidates: Vec<PoseCandidate>,
    rows: Vec<Vec<Row>>,
    /// With the boards already recorded or planned.
    start: Vec<Known>,
}

impl<'a> Designer<'a> {
    /// Finds the candidates in front of a facet.
    ///
    /// # Errors
    /// As [`candidates`].
    pub fn new(situation: &'a Situation, facet: &str, request: &Request) -> Result<Self, CalibError> {
        Self::until(situation, facet, request, &Stop::default())
    }

    pub(super) fn until(
        situation: &'a Situation,
        facet: &str,
        request: &Request,
        stop: &Stop,
    ) -> Result<Self, CalibError> {
        let candidates = candidates(situation, facet, request, stop)?;
        let fan = situation.fan(facet).ok_or_else(|| CalibError::UnknownFacet {
            name: facet.to_owned(),
            known: String::new(),
        })?;
        let mut designer = Self {
            situation,
            fan,
            request: *request,
            site: Site::new(situation, fan, request),
            rows: Vec::new(),
            candidates,
            start: Vec::new(),
        };
        designer.start = designer.start(false);
        let rows_of = |candidate: usize| {
            stop.check()?;
            Ok(designer.rows_of(candidate, false))
        };
        designer.rows = (0..designer.len())
            .map(rows_of)
            .collect::<Result<_, CalibError>>()?;
        Ok(designer)
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.candidates.len()
    }

    /// Always `false`: a designer has at least one candidate.
    pub fn is_empty(&self) -> bool {
        self.candidates.is_empty()
    }

    /// A candidate by its index.
    pub fn candidate(&self, number: usize) -> &PoseCandidate {
        &self.candidates[number]
    }

    /// The criterion over all elements with some candidates set up; lower is better. A is in deg², D a log of rad⁴.
    pub fn cost(&self, chosen: &[usize]) -> f64 {
        self.total(&self.with(chosen))
    }

    /// How well the elements are determined with some candidates set up.
    pub fn standing(&self, chosen: &[usize]) -> Standing {
        let open = self.reasons(chosen);
        let determined: Vec<bool> = open.iter().map(Option::is_none).collect();
        let of = |known: &[Known]| {
            let of_determined: Vec<f64> = (known.iter().zip(&determined))
                .filter(|(_, d)| **d)
                .map(|(k, _)| 0.5 * (k.covariance[(0, 0)] + k.covariance[(1, 1)]))
                .collect();
            let mean = of_determined.iter().sum::<f64>() / of_determined.len() as f64;
            (!of_determined.is_empty()).then(|| mean.sqrt().to_degrees())
        };
        let mut mounted = self.start(true);
        for candidate in chosen {
            add(&mut mounted, &self.rows_of(*candidate, true));
        }
        let count = determined.iter().filter(|d| **d).count();
        Standing {
            determined: count,
            open: determined.len() - count + self.fan.excluded.len(),
            bound_deg: of(&self.with(chosen)),
            bound_with_mounting_deg: of(&mounted),
        }
    }

    /// The bound of one beam with some candidates set up, in degrees per axis, with the mounting taken as known; `None`
    /// for a beam that is open.
    pub fn bound_deg(&self, beam: usize, chosen: &[usize]) -> Option<f64> {
        let number = self.fan.elements.iter().position(|e| e.beam == beam)?;
        if self.reasons(chosen)[number].is_some() {
            return None;
        }
        let known = self.with(chosen);
        let c = &known.get(number)?.covariance;
        Some((0.5 * (c[(0, 0)] + c[(1, 1)])).sqrt().to_degrees())
    }

    /// The best set that greedy choice and exchange find, the most informative first.
    ///
    /// Poses around those chosen become candidates too, and replace them as long as that improves the set. The same
    /// candidate may be in the set more than once: a board set up anew has its own drift and marker errors.
    pub fn best(&mut self, poses: usize) -> Vec<usize> {
        self.best_until(poses, &Stop::default())
            .unwrap_or_else(|_| unreachable!("nobody requests this stop"))
    }

    pub(super) fn best_until(&mut self, poses: usize, stop: &Stop) -> Result<Vec<usize>, Stopped> {
        let mut chosen = Vec::with_capacity(poses);
        let mut known = self.start.clone();
        for _ in 0..poses {
            let (best, _) = self.most_useful(&known, 0..self.len(), stop)?;
            add(&mut known, &self.rows[best]);
            chosen.push(best);
        }
        self.exchange(&mut chosen, stop)?;
        for round in 0..REFINEMENTS {
            let near = chosen
                .iter()
                .flat_map(|c| self.site.near(&self.candidates[*c], round));
            for candidate in near.collect::<Vec<_>>() {
                stop.check()?;
                self.candidates.push(candidate);
                self.rows.push(self.rows_of(self.len() - 1, false));
            }
            self.exchange(&mut chosen, stop)?;
        }
        self.ordered(chosen, stop)
    }

    /// Exchanges chosen candidates for others until no exchange improves the set.
    fn exchange(&self, chosen: &mut [usize], stop: &Stop) -> Result<(), Stopped> {
        let mut cost = self.cost(chosen);
        for _ in 0..MAX_ROUNDS {
            let mut changed = false;
            for place in 0..chosen.len() {
                let others: Vec<usize> = (0..chosen.len())
                    .filter(|p| *p != place)
                    .map(|p| chosen[p])
                    .collect();
                let without = self.with(&others);
                let (best, gain) = self.most_useful(&without, 0..self.len(), stop)?;
                let better = self.total(&without) - gain;
                if better < cost - MIN_GAIN * cost.abs() {
                    chosen[place] = best;
                    cost = better;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        Ok(())
    }

    /// The elements that are open with some candidates set up, and why; neighbors are merged.
    pub fn open(&self, chosen: &[usize]) -> Vec<Open> {
        let reasons = self.reasons(chosen);
        let mut open: Vec<(usize, String)> = (self.fan.elements.iter().zip(reasons))
            .filter_map(|(element, reason)| Some((element.beam, reason?)))
            .chain(self.fan.excluded.iter().cloned())
            .collect();
        open.sort();
        words::runs_with_reasons(&open)
    }

    /// Why each element is open; `None` for one that is not.
    fn reasons(&self, chosen: &[usize]) -> Vec<Option<String>> {
        let session = self.situation.session();
        let of_one = |(number, element): (usize, &PlannedElement)| {
            let mut views = self.views(element);
            views.extend(
                chosen
                    .iter()
                    .map(|c| &self.candidates[*c])
                    .filter(|c| c.served.binary_search(&number).is_ok())
                    .map(|c| self.view(c)),
            );
            if views.len() < MIN_BOARDS {
                return Some(format!(
                    "it reads {} of the {} boards in front of its facet; {MIN_BOARDS} are needed",
                    views.len(),
                    self.fan.boards + chosen.len()
                ));
            }
            let mount = MountUncertainty::none();
            let budget = covariance::budget(session, &mount, element.azimuth, &element.deflection, &views)?;
            Some(observability::weakness(&budget, element.deflection.elevation)?.reason)
        };
        self.fan.elements.iter().enumerate().map(of_one).collect()
    }

    /// Sorts by information, the most informative first.
    fn ordered(&self, mut rest: Vec<usize>, stop: &Stop) -> Result<Vec<usize>, Stopped> {
        let mut known = self.start.clone();
        let mut ordered = Vec::with_capacity(rest.len());
        while !rest.is_empty() {
            let (best, _) = self.most_useful(&known, rest.iter().copied(), stop)?;
            add(&mut known, &self.rows[best]);
            ordered.push(best);
            if let Some(place) = rest.iter().position(|c| *c == best) {
                rest.remove(place);
            }
        }
        Ok(ordered)
    }

    /// The candidate that lowers the cost most (the first of equals), and by how much.
    fn most_useful(
        &self,
        known: &[Known],
        mut among: impl Iterator<Item = usize>,
        stop: &Stop,
    ) -> Result<(usize, f64), Stopped> {
        let before: Vec<f64> = known
            .iter()
            .map(|k| self.cost_of(corner(&k.covariance), k.boards))
            .collect();
        among.try_fold((0, f64::NEG_INFINITY), |best, candidate| {
            stop.check()?;
            let gain = self.rows[candidate]
                .iter()
                .map(|row| {
                    let at = &known[row.element];
                    before[row.element] - self.cost_of(updated_corner(&at.covariance, row), at.boards + 1)
                })
                .sum::<f64>()
                / known.len() as f64;
            Ok(if gain > best.1 { (candidate, gain) } else { best })
        })
    }

    fn total(&self, known: &[Known]) -> f64 {
        let sum: f64 = known
            .iter()
            .map(|k| self.cost_of(corner(&k.covariance), k.boards))
            .sum();
        sum / known.len() as f64
    }

    /// Cost of one element from C₁₁, C₁₂ and C₂₂ of its angles, in rad².
    fn cost_of(&self, [a, b, c]: [f64; 3], boards: usize) -> f64 {
        let lacking = MIN_BOARDS.saturating_sub(boards) as f64;
        let squared_deg = (180.0 / std::f64::consts::PI).powi(2);
        match self.request.criterion {
            Criterion::A => (0.5 * (a + c) + lacking * WEAKEST_SD * WEAKEST_SD) * squared_deg,
            Criterion::D => libm::log((a * c - b * b).max(f64::MIN_POSITIVE)) + lacking * LACKING_LOG_DET,
        }
    }

    fn with(&self, chosen: &[usize]) -> Vec<Known> {
        let mut known = self.start.clone();
        for candidate in chosen {
            add(&mut known, &self.rows[*candidate]);
        }
        known
    }

    /// What is known from the existing boards, with the actual uncertainty of the mounting or with a known mounting.
    fn start(&self, mounting: bool) -> Vec<Known> {
        let session = self.situation.session();
        let columns = 2 + CommonErrors::of(session).len() + 1 + if mounting { 6 } else { 0 };
        let mut prior = DMatrix::identity(columns, columns);
        prior[(0, 0)] = PRIOR_SD * PRIOR_SD;
        prior[(1, 1)] = PRIOR_SD * PRIOR_SD;
        let mut known = vec![
            Known {
                covariance: prior,
                boards: 0
            };
            self.fan.elements.len()
        ];
        for (number, element) in self.fan.elements.iter().enumerate() {
            let rows: Vec<Row> = self
                .views(element)
                .iter()
                .filter_map(|view| self.row(number, element, view, mounting))
                .collect();
            add(&mut known, &rows);
        }
        known
    }

    fn rows_of(&self, candidate: usize, mounting: bool) -> Vec<Row> {
        let candidate = &self.candidates[candidate];
        let view = self.view(candidate);
        candidate
            .served
            .iter()
            .filter_map(|number| self.row(*number, &self.fan.elements[*number], &view, mounting))
            .collect()
    }

    fn row(&self, number: usize, element: &PlannedElement, view: &BoardView, mounting: bool) -> Option<Row> {
        let session = self.situation.session();
        let known = MountUncertainty::none();
        let mount = if mounting { &self.situation.mount } else { &known };
        let common = CommonErrors::of(session);
        let seen = Sighting::new(
            session,
            &common,
            mount,
            element.azimuth,
            &element.deflection,
            view,
        )?;
        let columns = 2 + seen.shared.len() + if mounting { 6 } else { 0 };
        let mut g = DVector::zeros(columns);
        g[0] = seen.angles.x / libm_cos(element.deflection.elevation);
        g[1] = seen.angles.y;
        g.rows_mut(2, seen.shared.len())
            .copy_from(&seen.shared.transpose());
        if mounting {
            let moved = seen.mount * square_root(&mount.independent);
            g.rows_mut(2 + seen.shared.len(), 6).copy_from(&moved.transpose());
        }
        Some(Row {
            element: number,
            g,
            variance: seen.own.max(MIN_VARIANCE),
        })
    }

    fn view<'c>(&self, candidate: &'c PoseCandidate) -> BoardView<'c> {
        let noise = noise_on(self.situation.session(), &candidate.in_sensor);
        candidate.in_sensor.view(noise, self.request.readings)
    }

    /// The boards that an element already reads.
    fn views<'s>(&'s self, element: &PlannedElement) -> Vec<BoardView<'s>> {
        let boards = &self.situation.boards;
        element
            .read
            .iter()
            .map(|(number, noise, count)| boards[*number].view(*noise, *count))
            .collect()
    }
}

fn add(known: &mut [Known], rows: &[Row]) {
    for row in rows {
        let at = &mut known[row.element];
        let moved = &at.covariance * &row.g;
        let whole = row.variance + row.g.dot(&moved);
        at.covariance.ger(-1.0 / whole, &moved, &moved, 1.0);
        at.boards += 1;
    }
}

fn corner(covariance: &DMatrix<f64>) -> [f64; 3] {
    [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]]
}

/// The angles' block of C − (Cg)(Cg)ᵀ/(σ² + gᵀCg), without the rest.
fn updated_corner(covariance: &DMatrix<f64>, row: &Row) -> [f64; 3] {
    let (mut first, mut second, mut whole) = (0.0, 0.0, row.variance);
    // By columns, as stored in memory; C is symmetric.
    for (column, g) in covariance.column_iter().zip(row.g.iter()) {
        first += column[0] * g;
        second += column[1] * g;
        whole += g * column.iter().zip(row.g.iter()).map(|(c, g)| c * g).sum::<f64>();
    }
    let [a, b, c] = corner(covariance);
    [
        a - first * first / whole,
        b - first * second / whole,
        c - second * second / whole,
    ]
}

/// L with LLᵀ = M for a positive semidefinite M.
fn square_root(m: &Matrix6<f64>) -> Matrix6<f64> {
    let eigen = m.symmetric_eigen();
    let scale = eigen.eigenvalues.map(|v| v.max(0.0).sqrt());
    eigen.eigenvectors * Matrix6::from_diagonal(&scale)
}
