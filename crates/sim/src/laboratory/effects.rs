//! Random effects in the readings of a stretch, scan by scan.
//!
//! Every draw is a function of (seed, purpose, scan, beam) alone. Correlated noise starts anew with each stretch, so
//! scan k of a stretch depends on the innovations of its scans 0 to k and on nothing else.

use super::setup::Laboratory;
use crate::noise::{Columns, Draws, Purpose};
use crate::receive::reading::{MAX_ECHOES, RandomEffects};
use crate::scene::{Correlated, ErrorModel, Scene};
use catoptric_model::ScanGeometry;
use std::sync::Arc;

/// The random effects that all readings of a stretch share, and the source of those that are drawn in every scan.
#[derive(Clone)]
pub(super) struct EffectSource<'a> {
    scene: &'a Scene,
    geometry: &'a ScanGeometry,
    seed: u64,
    drift: f64,
    /// Constant error of every beam; empty if there is none.
    elements: Arc<[f64]>,
    start_s: f64,
    first_scan: usize,
}

/// Random effects of one scan, each kind for all beams; a kind that the scene does not have is empty.
#[derive(Default)]
pub(super) struct ScanEffects {
    drift: f64,
    warm_up: f64,
    elements: Arc<[f64]>,
    noise: Vec<f64>,
    intensity: Vec<f64>,
    dropout: Vec<f64>,
    correlated: Vec<f64>,
    interference: Vec<f64>,
    /// Draws that decide whether echoes are detected: for all beams here, or for the requested ones in `asked`.
    detection: Columns,
    asked: Vec<(usize, [f64; MAX_ECHOES])>,
    /// Scratch space for draws.
    columns: Columns,
}

/// Beams are drawn individually if fewer than one in this many is requested: a jump costs as much as several
/// consecutive columns.
const FEW: usize = 8;

/// Random effects of a stretch, from its first scan on.
pub struct StretchEffects<'a> {
    source: EffectSource<'a>,
    /// Scans of the stretch so far.
    done: usize,
    memory: Memory,
    scan: ScanEffects,
}

/// The AR(1) state of every beam, then the one that all beams share, of unit variance, after some number of scans; empty
/// before the first, and without those that the scene does not have.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Memory {
    states: Vec<f64>,
}

impl Laboratory {
    /// Random effects of a stretch, scan by scan.
    pub fn effects(&self, number: usize) -> StretchEffects<'_> {
        StretchEffects {
            source: self.effect_source(number),
            done: 0,
            memory: Memory::default(),
            scan: ScanEffects::default(),
        }
    }

    pub(super) fn effect_source(&self, number: usize) -> EffectSource<'_> {
        EffectSource {
            scene: &self.scene,
            geometry: self.sensor.scan(),
            seed: self.seed,
            drift: self.drift(number),
            elements: self.elements(number).into(),
            start_s: self.start_s(number),
            first_scan: self.first_scan(number),
        }
    }

    /// Constant error of every beam in a stretch, in meters; empty if there is none.
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

    /// Range error of the scanner while it warms up, in meters: a·exp(−t/τ), t seconds into the recording.
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

impl EffectSource<'_> {
    /// The law of the correlated noise, if there is any.
    fn correlated(&self) -> Option<&Correlated> {
        self.acting(&self.scene.errors.correlated)
    }

    /// The law of the noise that all beams share, if there is any.
    fn common(&self) -> Option<&Correlated> {
        self.acting(&self.scene.errors.common)
    }

    /// A law of the scene, unless the sensor has no errors.
    fn acting<'a>(&self, law: &'a Option<Correlated>) -> Option<&'a Correlated> {
        law.as_ref()
            .filter(|_| self.scene.errors.model != ErrorModel::None)
    }

    /// Number of states that beams have for themselves.
    fn own_states(&self) -> usize {
        self.correlated().map_or(0, |_| self.geometry.beams())
    }

    /// Noise row of a scan.
    fn row(&self, scan: usize) -> u64 {
        (self.first_scan + scan) as u64
    }

    /// The innovations ε of a scan, for all beams and then for what they share; empty without correlated noise.
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
        if self.common().is_some() {
            out.push(Draws::new(self.seed, Purpose::Common, self.row(scan)).normal());
        }
    }

    /// Takes the AR(1) step of all states, which turns the innovations of a scan into states: x₀ = ε₀,
    /// xₖ = φ·xₖ₋₁ + √(1 − φ²)·εₖ.
    pub(super) fn remember(&self, scan: usize, memory: &mut Memory, innovations: &mut [f64]) {
        memory.states.resize(innovations.len(), 0.0);
        let split = self.own_states();
        let (own, shared) = memory.states.split_at_mut(split);
        let (of_beams, of_all) = innovations.split_at_mut(split);
        for (law, states, innovations) in [
            (self.correlated(), own, of_beams),
            (self.common(), shared, of_all),
        ] {
            let Some(law) = law else { continue };
            let period_s = self.geometry.scan_period_s();
            let share = if scan == 0 {
                0.0
            } else {
                libm::exp(-period_s / law.time_constant_s)
            };
            let fresh = (1.0 - share * share).sqrt();
            for (state, innovation) in states.iter_mut().zip(innovations) {
                *state = share * *state + fresh * *innovation;
                *innovation = *state;
            }
        }
    }

    /// Draws a scan; `states` are those of its correlated noise.
    ///
    /// With `asked`, the detection of echoes is drawn for those beams only, if they are few.
    pub(super) fn draw(&self, scan: usize, states: &[f64], asked: Option<&[usize]>, into: &mut ScanEffects) {
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
            let (own, shared) = states.split_at(self.own_states());
            into.correlated.clear();
            if let Some(law) = self.correlated() {
                into.correlated
                    .extend(own.iter().map(|state| law.sd_mm * 1e-3 * state));
            }
            if let (Some(law), [state]) = (self.common(), shared) {
                into.correlated.resize(self.geometry.beams(), 0.0);
                let shared = law.sd_mm * 1e-3 * state;
                into.correlated.iter_mut().for_each(|own| *own += shared);
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
        let noisy = self.scene.detection.intensity.filter(|law| law.noise_share > 0.0);
        if noisy.is_some() && errors.model != ErrorModel::None {
            into.columns
                .draw(self.geometry.beams(), self.seed, Purpose::Intensity, row);
            into.columns.normals(0, &mut into.intensity);
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

impl ScanEffects {
    /// Random effects of a beam's reading.
    pub(super) fn of(&self, beam: usize) -> RandomEffects {
        let asked = self.asked.binary_search_by_key(&beam, |(asked, _)| *asked);
        let detection = match asked {
            Ok(place) => self.asked[place].1,
            Err(_) if self.detection.is_empty() => Default::default(),
            Err(_) => std::array::from_fn(|echo| self.detection.uniform(beam, echo)),
        };
        RandomEffects {
            detection,
            ..self.without_detection(beam)
        }
    }

    /// The same without the detection of its echoes.
    #[inline]
    pub(super) fn without_detection(&self, beam: usize) -> RandomEffects {
        let of = |kind: &[f64]| kind.get(beam).copied().unwrap_or_default();
        RandomEffects {
            drift: self.drift,
            element: of(&self.elements),
            warm_up: self.warm_up,
            correlated: of(&self.correlated),
            interference: of(&self.interference),
            noise: of(&self.noise),
            intensity: of(&self.intensity),
            dropout: of(&self.dropout),
            detection: Default::default(),
        }
    }
}

impl StretchEffects<'_> {
    /// Skips scans, keeping the state that later ones depend on.
    #[must_use]
    pub fn skip_scans(mut self, scans: usize) -> Self {
        for _ in 0..scans {
            self.step();
        }
        self
    }

    /// States of the next scan's correlated noise.
    fn step(&mut self) -> Vec<f64> {
        let mut states = Vec::new();
        self.source
            .innovations(self.done, &mut self.scan.columns, &mut states);
        self.source.remember(self.done, &mut self.memory, &mut states);
        self.done += 1;
        states
    }

    /// Draws the next scan; `asked` as for [`EffectSource::draw`].
    pub(super) fn next_scan(&mut self, asked: Option<&[usize]>) -> &ScanEffects {
        let scan = self.done;
        let states = self.step();
        self.source.draw(scan, &states, asked, &mut self.scan);
        &self.scan
    }
}

impl Iterator for StretchEffects<'_> {
    /// One per beam.
    type Item = Vec<RandomEffects>;

    fn next(&mut self) -> Option<Vec<RandomEffects>> {
        let beams = self.source.geometry.beams();
        let scan = self.next_scan(None);
        Some((0..beams).map(|beam| scan.of(beam)).collect())
    }
}
