//! What is by chance in the readings of a stretch, scan by scan.
//!
//! Every draw is a function of (seed, purpose, scan, beam) alone. Correlated noise begins anew with each stretch, so
//! that scan k of a stretch follows exactly from the innovations of its scans 0 to k and from nothing else.

use super::Laboratory;
use crate::noise::{Draws, Purpose};
use crate::reading::Chance;
use crate::scene::{ErrorModel, Scene};
use catoptric_model::beam;

/// The chances of a stretch, from its first scan on.
pub struct Chances<'a> {
    scene: &'a Scene,
    seed: u64,
    drift: f64,
    /// Constant error of every beam; empty without any.
    elements: Vec<f64>,
    start_s: f64,
    first_scan: usize,
    /// Scans of the stretch so far.
    done: usize,
    /// The AR(1) state of every beam, of unit variance; empty without correlated noise.
    correlated: Vec<f64>,
}

impl Laboratory {
    /// The chances of a stretch, scan after scan.
    pub fn chances(&self, number: usize) -> Chances<'_> {
        let start = if self.scene.errors.correlated.is_some() {
            vec![0.0; beam::COUNT]
        } else {
            Vec::new()
        };
        Chances {
            scene: &self.scene,
            seed: self.seed,
            drift: self.drift(number),
            elements: self.elements(number),
            start_s: self.start_s(number),
            first_scan: self.first_scan(number),
            done: 0,
            correlated: start,
        }
    }

    /// Constant error of every beam in a stretch, in metres; empty where there is none.
    fn elements(&self, number: usize) -> Vec<f64> {
        let sd = self.scene.errors.element_sd_mm * 1e-3;
        if sd == 0.0 || self.scene.errors.model == ErrorModel::None {
            return Vec::new();
        }
        let mut draws = Draws::new(self.seed, Purpose::Element, number as u64);
        (0..beam::COUNT)
            .map(|beam| {
                draws.seek(beam as u64);
                sd * draws.normal()
            })
            .collect()
    }

    /// What the scanner is off because it is not warm yet, in metres: a·exp(−t/τ), t seconds into the recording.
    pub fn warm_up(&self, time_s: f64) -> f64 {
        warm_up(&self.scene, time_s)
    }
}

fn warm_up(scene: &Scene, time_s: f64) -> f64 {
    match &scene.errors.warm_up {
        Some(law) if scene.errors.model != ErrorModel::None => {
            law.amplitude_mm * 1e-3 * libm::exp(-time_s / law.time_constant_s)
        }
        _ => 0.0,
    }
}

impl Chances<'_> {
    /// Leaves scans out, keeping what later ones remember of them.
    #[must_use]
    pub fn skip_scans(mut self, scans: usize) -> Self {
        for _ in 0..scans {
            self.remember();
            self.done += 1;
        }
        self
    }

    /// The AR(1) step of all beams: x₀ = ε₀, xₖ = φ·xₖ₋₁ + √(1 − φ²)·εₖ.
    fn remember(&mut self) {
        let Some(law) = &self.scene.errors.correlated else {
            return;
        };
        let period_s = self.scene.scanner.limits().scan_period_s();
        let memory = if self.done == 0 {
            0.0
        } else {
            libm::exp(-period_s / law.time_constant_s)
        };
        let fresh = (1.0 - memory * memory).sqrt();
        let row = (self.first_scan + self.done) as u64;
        let mut draws = Draws::new(self.seed, Purpose::Correlated, row);
        for (column, state) in self.correlated.iter_mut().enumerate() {
            draws.seek(column as u64);
            *state = memory * *state + fresh * draws.normal();
        }
    }
}

impl Chances<'_> {
    /// What the errors' own terms do, in the order of [`Chance`].
    fn add_errors(&mut self, chances: &mut [Chance], row: u64) {
        let errors = &self.scene.errors;
        let seed = self.seed;
        let time_s = self.start_s + self.done as f64 * self.scene.scanner.limits().scan_period_s();
        let warm_up = warm_up(self.scene, time_s);
        let mut reading = Draws::new(seed, Purpose::Reading, row);
        for (column, chance) in chances.iter_mut().enumerate() {
            reading.seek(column as u64);
            chance.drift = self.drift;
            chance.warm_up = warm_up;
            chance.noise = reading.normal();
            chance.dropout = reading.uniform();
        }
        for (chance, element) in chances.iter_mut().zip(&self.elements) {
            chance.element = *element;
        }
        self.remember();
        if let Some(law) = &errors.correlated {
            for (chance, state) in chances.iter_mut().zip(&self.correlated) {
                chance.correlated = law.sd_mm * 1e-3 * state;
            }
        }
        if let Some(law) = &errors.interference {
            let mut draws = Draws::new(seed, Purpose::Interference, row);
            for (column, chance) in chances.iter_mut().enumerate() {
                draws.seek(column as u64);
                let u = draws.uniform();
                if u < law.probability {
                    let sign = if u < 0.5 * law.probability { -1.0 } else { 1.0 };
                    chance.interference = sign * law.step_mm * 1e-3;
                }
            }
        }
    }
}

impl Iterator for Chances<'_> {
    /// One for every beam.
    type Item = Vec<Chance>;

    fn next(&mut self) -> Option<Vec<Chance>> {
        let row = (self.first_scan + self.done) as u64;
        let mut chances = vec![Chance::default(); beam::COUNT];
        if self.scene.errors.model != ErrorModel::None {
            self.add_errors(&mut chances, row);
        }
        if self.scene.detection.noise_over_threshold > 0.0 {
            let mut draws = Draws::new(self.seed, Purpose::Detection, row);
            for (column, chance) in chances.iter_mut().enumerate() {
                draws.seek(column as u64);
                chance.detection = std::array::from_fn(|_| draws.uniform());
            }
        }
        self.done += 1;
        Some(chances)
    }
}
