//! The particle swarms: which positions they evaluate, and the record of all candidates.

use super::candidate::{Candidate, Judge};
use super::front::{front, spreads};
use super::options::{Options, Progress};
use argmin::core::{CostFunction, Error, Executor, PopulationState, SendAlias, SyncAlias};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;
use std::borrow::Borrow;
use std::cell::RefCell;

/// Number of particles of a swarm.
const PARTICLES: usize = 16;

/// Fraction of the candidates that are spread out before the swarms begin.
const SPREAD_SHARE: f64 = 0.2;

/// Number of directions along the front of two goals, including its ends.
const DIRECTIONS: usize = 5;

/// Weight of the sum next to the maximum: it ranks candidates that are equal in the worst goal.
const AUGMENTATION: f64 = 0.05;

/// Minimum weight of a goal, so that even at its ends the front does not sacrifice a goal without limit.
const MIN_WEIGHT: f64 = 0.02;

/// Costs above that of any candidate that meets the requirements: of one that does not, and of one that is refused.
const UNMET: f64 = 1e6;
const REFUSED: f64 = 1e12;

/// Maximum initial step of a particle, as a fraction of the distance between the limits.
const FIRST_STEP: f64 = 0.15;

/// A search in progress: all candidates so far, and what is needed to evaluate more.
pub(super) struct Search<'a> {
    judge: &'a Judge<'a>,
    options: &'a Options,
    log: RefCell<Log<'a>>,
}

struct Log<'a> {
    all: Vec<Candidate>,
    watch: &'a mut dyn FnMut(Progress) -> bool,
    stopped: bool,
}

/// The scalar cost that one swarm minimizes.
#[derive(Clone)]
struct Aim {
    weights: Vec<f64>,
    from: Vec<f64>,
    spreads: Vec<f64>,
}

impl Aim {
    fn cost(&self, candidate: &Candidate) -> f64 {
        if !candidate.shortfall.is_finite() {
            return REFUSED;
        }
        if !candidate.is_kept() {
            return UNMET * (1.0 + candidate.shortfall.min(1e3));
        }
        let terms = || {
            let goals = self
                .weights
                .iter()
                .zip(&self.from)
                .zip(&self.spreads)
                .zip(&candidate.costs);
            goals.map(|(((weight, from), spread), cost)| weight * (cost - from) / spread)
        };
        terms().fold(f64::NEG_INFINITY, f64::max) + AUGMENTATION * terms().sum::<f64>()
    }
}

/// One swarm's problem, for argmin.
struct SwarmProblem<'a, 'b> {
    search: &'b Search<'a>,
    aim: Aim,
}

impl CostFunction for SwarmProblem<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, Error> {
        let costs = self.search.costs(std::slice::from_ref(place), &self.aim)?;
        costs.first().copied().ok_or_else(|| Stopped.into())
    }

    fn bulk_cost<P>(&self, places: &[P]) -> Result<Vec<f64>, Error>
    where
        P: Borrow<Vec<f64>> + SyncAlias,
        f64: SendAlias,
        Self: SyncAlias,
    {
        let places: Vec<Vec<f64>> = places.iter().map(|p| p.borrow().clone()).collect();
        Ok(self.search.costs(&places, &self.aim)?)
    }
}

/// The caller stopped the search.
#[derive(Debug, Clone, Copy, thiserror::Error)]
#[error("stopped by the caller")]
struct Stopped;

impl<'a> Search<'a> {
    pub(super) fn new(
        judge: &'a Judge<'a>,
        options: &'a Options,
        watch: &'a mut dyn FnMut(Progress) -> bool,
    ) -> Self {
        let log = Log {
            all: vec![judge.candidate(0, &judge.start())],
            watch,
            stopped: false,
        };
        Self {
            judge,
            options,
            log: RefCell::new(log),
        }
    }

    /// Evaluates spread-out candidates, then runs one swarm after another.
    pub(super) fn run(&mut self) -> Result<(), String> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.options.seed);
        let first = self.first_places(&mut random);
        if self.evaluate(&first).is_err() {
            return Ok(());
        }
        let weights = directions(self.options.goals.len());
        // The first searches for layouts that beat the drawing in all goals, and gets twice the evaluations.
        let shares = weights.len() + 1;
        for (number, weights) in weights.into_iter().enumerate() {
            let left = self
                .options
                .evaluations
                .saturating_sub(self.log.borrow().all.len());
            let to_come = shares - number - usize::from(number > 0);
            let share = left * if number == 0 { 2 } else { 1 } / to_come.max(1);
            let seed = random.next_u64();
            self.run_swarm(self.aim(number == 0, weights), share / PARTICLES, seed)?;
            if self.stopped() {
                break;
            }
        }
        Ok(())
    }

    pub(super) fn stopped(&self) -> bool {
        self.log.borrow().stopped
    }

    /// Returns all candidates, and the start.
    pub(super) fn finish(self) -> (Vec<Candidate>, Candidate) {
        let all = self.log.into_inner().all;
        let start = all[0].clone();
        (all, start)
    }

    /// Returns the first positions: half of them near the drawing, half anywhere.
    fn first_places(&self, random: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let share = (SPREAD_SHARE * self.options.evaluations as f64) as usize;
        let count = share
            .max(PARTICLES)
            .min(self.options.evaluations.saturating_sub(1));
        let start = self.judge.start();
        let place = |number: usize| -> Vec<f64> {
            let mut step = |from: &f64| {
                let u = unit(random);
                if number.is_multiple_of(2) {
                    (from + FIRST_STEP * (2.0 * u - 1.0)).clamp(0.0, 1.0)
                } else {
                    u
                }
            };
            start.iter().map(&mut step).collect()
        };
        (0..count).map(place).collect()
    }

    fn aim(&self, from_start: bool, weights: Vec<f64>) -> Aim {
        let log = self.log.borrow();
        let kept: Vec<&Candidate> = log.all.iter().filter(|c| c.is_kept()).collect();
        let goals = weights.len();
        let mut spreads = spreads(kept.iter().copied());
        spreads.resize(goals, 1.0);
        let best = |goal: usize| kept.iter().map(|c| c.costs[goal]).reduce(f64::min).unwrap_or(0.0);
        let start = log.all.first().filter(|s| from_start && s.costs.len() == goals);
        let from = match start {
            Some(start) => start.costs.clone(),
            None => (0..goals).map(best).collect(),
        };
        Aim {
            weights,
            from,
            spreads,
        }
    }

    /// Runs one swarm, starting from the best candidates so far.
    fn run_swarm(&self, aim: Aim, rounds: usize, seed: u64) -> Result<(), String> {
        if rounds == 0 {
            return Ok(());
        }
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let particles = self.particles(&aim, &mut random);
        let count = particles.len();
        let dimensions = self.judge.dimensions();
        let limits = (vec![0.0; dimensions], vec![1.0; dimensions]);
        let swarm: ParticleSwarm<Vec<f64>, f64, _> =
            ParticleSwarm::new(limits, count).with_rng_generator(random);
        let state = |state: PopulationState<Particle<Vec<f64>, f64>, f64>| {
            state.population(particles).max_iters(rounds as u64)
        };
        let problem = SwarmProblem { search: self, aim };
        let outcome = Executor::new(problem, swarm).configure(state).timer(false).run();
        match outcome {
            Err(error) if !self.stopped() => Err(error.to_string()),
            _ => Ok(()),
        }
    }

    /// Returns the initial particles: half of them the best so far, half random others.
    fn particles(&self, aim: &Aim, random: &mut Xoshiro256PlusPlus) -> Vec<Particle<Vec<f64>, f64>> {
        let log = self.log.borrow();
        let mut order: Vec<(f64, &Candidate)> = log.all.iter().map(|c| (aim.cost(c), c)).collect();
        order.sort_by(|(a, c), (b, d)| a.total_cmp(b).then(c.number.cmp(&d.number)));
        let (best, others) = order.split_at(order.len().min(PARTICLES / 2));
        let mut chosen = best.to_vec();
        let mut others = others.to_vec();
        while chosen.len() < PARTICLES && !others.is_empty() {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let index = (unit(random) * others.len() as f64) as usize;
            chosen.push(others.swap_remove(index.min(others.len() - 1)));
        }
        let mut particles = Vec::with_capacity(chosen.len());
        for (cost, candidate) in chosen {
            let step = |_: &f64| FIRST_STEP * (2.0 * unit(random) - 1.0);
            let velocity: Vec<f64> = candidate.place.iter().map(step).collect();
            particles.push(Particle::new(candidate.place.clone(), cost, velocity));
        }
        particles
    }

    fn costs(&self, places: &[Vec<f64>], aim: &Aim) -> Result<Vec<f64>, Stopped> {
        let begin = self.evaluate(places)?;
        Ok(self.log.borrow().all[begin..]
            .iter()
            .map(|c| aim.cost(c))
            .collect())
    }

    /// Evaluates positions in parallel and stores the candidates in order; returns the index of the first.
    fn evaluate(&self, places: &[Vec<f64>]) -> Result<usize, Stopped> {
        let begin = self.log.borrow().all.len();
        let judge = self.judge;
        for (batch, places) in places.chunks(PARTICLES).enumerate() {
            let number = begin + batch * PARTICLES;
            let found: Vec<Candidate> = places
                .par_iter()
                .enumerate()
                .map(|(i, place)| judge.candidate(number + i, place))
                .collect();
            let mut log = self.log.borrow_mut();
            log.all.extend(found);
            let progress = Progress {
                more: places.len(),
                front: front(&log.all).len(),
            };
            if !(log.watch)(progress) {
                log.stopped = true;
                return Err(Stopped);
            }
        }
        Ok(begin)
    }
}

/// Returns a uniform random number from 0 to 1.
fn unit(random: &mut Xoshiro256PlusPlus) -> f64 {
    // 53 bits are the precision of an `f64`.
    (random.next_u64() >> 11) as f64 * (0.5_f64).powi(53)
}

/// Returns the weights of the goals for every swarm: first all equal, then along the front.
fn directions(goals: usize) -> Vec<Vec<f64>> {
    let equal = vec![1.0 / goals as f64; goals];
    let mut all = vec![equal.clone()];
    match goals {
        1 => {}
        2 => {
            for k in 0..DIRECTIONS {
                let share = k as f64 / (DIRECTIONS - 1) as f64;
                all.push(vec![1.0 - share, share]);
            }
        }
        _ => {
            // The middle, every goal separately, and every pair.
            all.push(equal);
            for a in 0..goals {
                for b in a..goals {
                    let mut weights = vec![0.0; goals];
                    weights[a] += 0.5;
                    weights[b] += 0.5;
                    all.push(weights);
                }
            }
        }
    }
    for weights in &mut all {
        for weight in weights.iter_mut() {
            *weight = weight.max(MIN_WEIGHT);
        }
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
    }
    all
}
