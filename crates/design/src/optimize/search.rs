//! The swarms: which places they go to, and what is remembered of them.

use super::candidate::{Candidate, Judge};
use super::front::{front, spreads};
use super::{Options, Progress};
use argmin::core::{CostFunction, Error, Executor, PopulationState, SendAlias, SyncAlias};
use argmin::solver::particleswarm::{Particle, ParticleSwarm};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use rayon::prelude::*;
use std::borrow::Borrow;
use std::cell::RefCell;

/// Particles of a swarm.
const PARTICLES: usize = 16;

/// Share of the candidates that are spread out before the swarms begin.
const SPREAD_SHARE: f64 = 0.2;

/// Directions along the front of two goals, its ends among them.
const DIRECTIONS: usize = 5;

/// Weight of the sum beside the maximum: what is equal in the worst goal is told apart by the others.
const AUGMENTATION: f64 = 0.05;

/// Least weight of a goal: even at its ends the front is not paid for without limit.
const LEAST_WEIGHT: f64 = 0.02;

/// Beyond every cost of a candidate that keeps the requirements, and then of one that is a scene.
const UNMET: f64 = 1e6;
const REFUSED: f64 = 1e12;

/// How far a particle starts to move at most, as a share of the way between the limits.
const FIRST_STEP: f64 = 0.15;

/// Everything that was looked at, and how to go on.
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

/// What one swarm goes after.
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
struct Flight<'a, 'b> {
    search: &'b Search<'a>,
    aim: Aim,
}

impl CostFunction for Flight<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, place: &Vec<f64>) -> Result<f64, Error> {
        let costs = self.search.look(std::slice::from_ref(place), &self.aim)?;
        costs.first().copied().ok_or_else(|| Stopped.into())
    }

    fn bulk_cost<P>(&self, places: &[P]) -> Result<Vec<f64>, Error>
    where
        P: Borrow<Vec<f64>> + SyncAlias,
        f64: SendAlias,
        Self: SyncAlias,
    {
        let places: Vec<Vec<f64>> = places.iter().map(|p| p.borrow().clone()).collect();
        Ok(self.search.look(&places, &self.aim)?)
    }
}

/// Told to stop.
#[derive(Debug, Clone, Copy, thiserror::Error)]
#[error("told to stop")]
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

    /// Spreads candidates out, then sends one swarm after another.
    pub(super) fn run(&mut self) -> Result<(), String> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.options.seed);
        let first = self.first_places(&mut random);
        if self.note(&first).is_err() {
            return Ok(());
        }
        let weights = directions(self.options.goals.len());
        // The first looks for what beats the drawing in all goals, and is given twice as long.
        let shares = weights.len() + 1;
        for (number, weights) in weights.into_iter().enumerate() {
            let left = self
                .options
                .evaluations
                .saturating_sub(self.log.borrow().all.len());
            let to_come = shares - number - usize::from(number > 0);
            let share = left * if number == 0 { 2 } else { 1 } / to_come.max(1);
            let seed = random.next_u64();
            self.fly(self.aim(number == 0, weights), share / PARTICLES, seed)?;
            if self.stopped() {
                break;
            }
        }
        Ok(())
    }

    pub(super) fn stopped(&self) -> bool {
        self.log.borrow().stopped
    }

    /// Everything that was looked at, and the start.
    pub(super) fn done(self) -> (Vec<Candidate>, Candidate) {
        let all = self.log.into_inner().all;
        let start = all[0].clone();
        (all, start)
    }

    /// Half of them near the drawing, half anywhere.
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

    /// Sends one swarm, which begins where others have found the most.
    fn fly(&self, aim: Aim, rounds: usize, seed: u64) -> Result<(), String> {
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
        let flight = Flight { search: self, aim };
        let outcome = Executor::new(flight, swarm).configure(state).timer(false).run();
        match outcome {
            Err(error) if !self.stopped() => Err(error.to_string()),
            _ => Ok(()),
        }
    }

    /// Half of them the best so far, half any of the others.
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

    fn look(&self, places: &[Vec<f64>], aim: &Aim) -> Result<Vec<f64>, Stopped> {
        let begin = self.note(places)?;
        Ok(self.log.borrow().all[begin..]
            .iter()
            .map(|c| aim.cost(c))
            .collect())
    }

    /// Looks at places, in parallel, and notes what they come to, in order; where the notes begin.
    fn note(&self, places: &[Vec<f64>]) -> Result<usize, Stopped> {
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

/// A number from 0 to 1.
fn unit(random: &mut Xoshiro256PlusPlus) -> f64 {
    // 53 bits are as many as a float holds.
    (random.next_u64() >> 11) as f64 * (0.5_f64).powi(53)
}

/// Weights of the goals for every swarm: all alike first, then along the front.
fn directions(goals: usize) -> Vec<Vec<f64>> {
    let alike = vec![1.0 / goals as f64; goals];
    let mut all = vec![alike.clone()];
    match goals {
        1 => {}
        2 => {
            for k in 0..DIRECTIONS {
                let share = k as f64 / (DIRECTIONS - 1) as f64;
                all.push(vec![1.0 - share, share]);
            }
        }
        _ => {
            // The middle, every goal by itself, and every two together.
            all.push(alike);
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
            *weight = weight.max(LEAST_WEIGHT);
        }
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
    }
    all
}
