//! Random numbers for the tests, the same in every run.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand::rand_core::Rng;
use rand::rngs::ChaCha8Rng;

/// A stream of random numbers.
pub(crate) struct Draws(ChaCha8Rng);

impl Draws {
    /// The stream of a seed and a noise row.
    pub(crate) fn new(seed: u64, row: u64) -> Self {
        const PURPOSE: u64 = 4;
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&PURPOSE.to_le_bytes());
        key[16..24].copy_from_slice(&row.to_le_bytes());
        key[24..].copy_from_slice(b"catoptr1");
        Self(ChaCha8Rng::from_seed(key))
    }

    /// Draws uniformly from the open interval (0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        ((self.0.next_u64() >> 11) as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
    }

    /// Draws three standard normal numbers.
    pub(crate) fn normal3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| {
            let radius = (-2.0 * libm::log(self.uniform())).sqrt();
            radius * libm::cos(std::f64::consts::TAU * self.uniform())
        })
    }
}
