//! What is by chance in the readings of a stretch, scan by scan.
//!
//! Every draw is a function of (seed, purpose, scan, beam) alone. Correlated noise begins anew with each stretch, so
//! that scan k of a stretch follows exactly from the innovations of its scans 0 to k and from nothing else.

use super::setup::Laboratory;
use crate::noise::{Columns, Draws, Purpose};
use crate::receive::reading::{Chance, MAX_ECHOES};
use crate::scene::{Correlated, ErrorModel, Scene};
use catoptric_model::ScanGeometry;
use std::sync::Arc;

/// What is by chance in all readings of a stretch, and how what is new in every scan is drawn.
#[derive(Clone)]
pub(super) struct Luck<'a> {
    scene: &'a Scene,
    geometry: &'a ScanGeometry,
    seed: u64,
    drift: f64,
    /// Constant error of every beam; empty without any.
    elements: Arc<[f64]>,
    start_s: f64,
    first_scan: usize,
}

/// What is by chance in one scan, each kind for all beams; a kind that the scene has not is empty.
#[derive(Default)]
pub(super) struct ScanLuck {
    drift: f64,
    warm_up: f64,
    elements: Arc<[f64]>,
    noise: Vec<f64>,
    dropout: Vec<f64>,
    correlated: Vec<f64>,
    interference: Vec<f64>,
    /// Whether echoes are detected, of all beams, or of those that were asked for.
    detection: Columns,
    asked: Vec<(usize, [f64; MAX_ECHOES])>,
    /// Draws in the making.
    columns: Columns,
}

/// A beam is drawn by itself where fewer than this part of all is: a jump costs several columns in a row.
const FEW: usize = 8;

/// The chances of a stretch, from its first scan on.
pub struct Chances<'a> {
    luck: Luck<'a>,
    /// Scans of the stretch so far.
    done: usize,
    memory: Memory,
    scan: ScanLuck,
}

/// The AR(1) state of every beam, of unit variance, after so many scans; empty before the first.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Memory {
    states: Vec<f64>,
}

impl Laboratory {
    /// The chances of a stretch, scan after scan.
    pub fn chances(&self, number: usize) -> Chances<'_> {
        Chances {
            luck: self.luck(number),
            done: 0,
            memory: Memory::default(),
            scan: ScanLuck::default(),
        }
    }

    pub(super) fn luck(&self, number: usize) -> Luck<'_> {
        Luck {
            scene: &self.scene,
            geometry: self.sensor.scan(),
            seed: self.seed,
            drift: self.drift(number),
            elements: self.elements(number).into(),
            start_s: self.start_s(number),
            first_scan: self.first_scan(number),
        }
    }

    /// Constant error of every beam in a stretch, in metres; empty where there is none.
    fn elements(&self, number: usize) -> Vec<f64> {
        let sd = self.scene.errors.element_sd_mm * 1e-3;
        if sd == 0.0 || self.scene.errors.model == ErrorModel::None {
            return Vec::new();
        }
        let mut draws = Draws::new(self.seed, Purpose::Element, number as u64);
        (0..self.sensor.scan().beams())
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

impl Luck<'_> {
    /// The law of the correlated noise, if there is any.
    fn correlated(&self) -> Option<&Correlated> {
        let errors = &self.scene.errors;
        errors
            .correlated
            .as_ref()
            .filter(|_| errors.model != ErrorModel::None)
    }

    /// Row of a scan's draws.
    fn row(&self, scan: usize) -> u64 {
        (self.first_scan + scan) as u64
    }

    /// The innovations ε of a scan, for all beams; none without correlated noise.
    pub(super) fn innovations(&self, scan: usize, columns: &mut Columns, out: &mut Vec<f64>) {
        out.clear();
        if self.correlated().is_some() {
            columns.draw(
                self.geometry.beams(),
                self.seed,
                Purpose::Correlated,
                self.row(scan),
            );
            columns.normals(0, out);
        }
    }

    /// The AR(1) step of all beams, which turns the innovations of a scan into its states: x₀ = ε₀,
    /// xₖ = φ·xₖ₋₁ + √(1 − φ²)·εₖ.
    pub(super) fn remember(&self, scan: usize, memory: &mut Memory, innovations: &mut [f64]) {
        let Some(law) = self.correlated() else { return };
        let period_s = self.geometry.scan_period_s();
        let share = if scan == 0 {
            0.0
        } else {
            libm::exp(-period_s / law.time_constant_s)
        };
        let fresh = (1.0 - share * share).sqrt();
        memory.states.resize(self.geometry.beams(), 0.0);
        for (state, innovation) in memory.states.iter_mut().zip(innovations) {
            *state = share * *state + fresh * *innovation;
            *innovation = *state;
        }
    }

    /// Draws a scan; `states` are those of its correlated noise.
    ///
    /// With `asked`, only those beams are told whether their echoes are detected.
    pub(super) fn draw(&self, scan: usize, states: &[f64], asked: Option<&[usize]>, into: &mut ScanLuck) {
        let (errors, row) = (&self.scene.errors, self.row(scan));
        if errors.model != ErrorModel::None {
            let time_s = self.start_s + scan as f64 * self.geometry.scan_period_s();
            into.drift = self.drift;
            into.warm_up = warm_up(self.scene, time_s);
            into.elements = Arc::clone(&self.elements);
            into.columns
                .draw(self.geometry.beams(), self.seed, Purpose::Reading, row);
            into.columns.normals(0, &mut into.noise);
            into.columns.uniforms(2, &mut into.dropout);
            if let Some(law) = self.correlated() {
                into.correlated.clear();
                into.correlated
                    .extend(states.iter().map(|state| law.sd_mm * 1e-3 * state));
            }
            if let Some(law) = &errors.interference {
                into.columns
                    .draw(self.geometry.beams(), self.seed, Purpose::Interference, row);
                into.columns.uniforms(0, &mut into.interference);
                for step in &mut into.interference {
                    let u = *step;
                    let sign = if u < 0.5 * law.probability { -1.0 } else { 1.0 };
                    *step = if u < law.probability {
                        sign * law.step_mm * 1e-3
                    } else {
                        0.0
                    };
                }
            }
        }
        into.detection.clear();
        into.asked.clear();
        if self.scene.detection.noise_over_threshold > 0.0 {
            match asked {
                Some(beams) if beams.len() < self.geometry.beams() / FEW => {
                    let mut draws = Draws::new(self.seed, Purpose::Detection, row);
                    into.asked.extend(beams.iter().map(|beam| {
                        draws.seek(*beam as u64);
                        (*beam, std::array::from_fn(|_| draws.uniform()))
                    }));
                }
                _ => into
                    .detection
                    .draw(self.geometry.beams(), self.seed, Purpose::Detection, row),
            }
        }
    }
}

impl ScanLuck {
    /// What is by chance in a beam's reading.
    pub(super) fn of(&self, beam: usize) -> Chance {
        let asked = self.asked.binary_search_by_key(&beam, |(asked, _)| *asked);
        let detection = match asked {
            Ok(place) => self.asked[place].1,
            Err(_) if self.detection.is_empty() => Default::default(),
            Err(_) => std::array::from_fn(|echo| self.detection.uniform(beam, echo)),
        };
        Chance {
            detection,
            ..self.but_detection(beam)
        }
    }

    /// The same without whether its echoes are detected.
    #[inline]
    pub(super) fn but_detection(&self, beam: usize) -> Chance {
        let of = |kind: &[f64]| kind.get(beam).copied().unwrap_or_default();
        Chance {
            drift: self.drift,
            element: of(&self.elements),
            warm_up: self.warm_up,
            correlated: of(&self.correlated),
            interference: of(&self.interference),
            noise: of(&self.noise),
            dropout: of(&self.dropout),
            detection: Default::default(),
        }
    }
}

impl Chances<'_> {
    /// Leaves scans out, keeping what later ones remember of them.
    #[must_use]
    pub fn skip_scans(mut self, scans: usize) -> Self {
        for _ in 0..scans {
            self.step();
        }
        self
    }

    /// The states of the next scan's correlated noise.
    fn step(&mut self) -> Vec<f64> {
        let mut states = Vec::new();
        self.luck
            .innovations(self.done, &mut self.scan.columns, &mut states);
        self.luck.remember(self.done, &mut self.memory, &mut states);
        self.done += 1;
        states
    }

    /// Draws the next scan; `asked` as for [`Luck::draw`].
    pub(super) fn next_scan(&mut self, asked: Option<&[usize]>) -> &ScanLuck {
        let scan = self.done;
        let states = self.step();
        self.luck.draw(scan, &states, asked, &mut self.scan);
        &self.scan
    }
}

impl Iterator for Chances<'_> {
    /// One for every beam.
    type Item = Vec<Chance>;

    fn next(&mut self) -> Option<Vec<Chance>> {
        let beams = self.luck.geometry.beams();
        let scan = self.next_scan(None);
        Some((0..beams).map(|beam| scan.of(beam)).collect())
    }
}
